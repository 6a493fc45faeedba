"""Nitrogen with an energy at equilibrium: Tables 9 to 11 of Yang (2013), all twenty cases.

Variances go to nitrogen.md, the coefficients of his Figures 24 and 25, and the conductivity that he
leaves to future work, to nitrogen_transport.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from report import Report, grid, shown

import sdpd
from sdpd import nitrogen
from sdpd.analysis import Estimate

KERNELS = ("wendland_c2", "lucy")
PAIRING = (1, 6, 10)  # cases run with both kernels, from places at random: a lattice pairs slowly
TRIED = nitrogen.Plan(equilibration=30, steps=15, stretches=2, stretch=10)
MOVING = range(1, 13)


def variances(study: nitrogen.Study) -> str:
    """Means and variances over what is exact or expected."""
    rows = []
    for found in study.cases:
        table = {row.name: row for row in found.rows}
        cells = [*_name(found), shown(*_ratio(table["P"], table["P"].expected))]
        for name in ("T_kin", "rho", "Var T", "Var V", "Var rho", "Var P"):
            row = table[name]
            cells.append(shown(*_ratio(row, row.expected)) + _accuracy(row))
            if name.startswith("Var"):
                cells.append(f"{(row.published or 0.0) / row.expected:.3g}")
                cells.append(f"{(row.analytical or 0.0) / row.expected:.3g}")
        rows.append(cells)
    header = ["case", "$N_i$", r"$h/\Delta x$", "$P$", "$T_{kin}$", r"$\rho$ (accuracy)"]
    for name in ("T", "V", r"\rho", "P"):
        header += [rf"Var ${name}$", "published", '"analytical"']
    return grid(header, rows)


def verdicts(study: nitrogen.Study) -> str:
    """Standard errors and distances of all that is judged."""
    cases = [found for found in study.cases if found.moves]
    names = list(dict.fromkeys(row.name for found in cases for row in found.rows if row.judged))
    rows = []
    for found in cases:
        cells = []
        for name in names:
            row = next((row for row in found.rows if row.name == name), None)
            if row is None:
                cells.append("")
                continue
            error = f"{100.0 * row.relative:.2g} %"
            cells.append(f"{row.t:+.1f}; {error}" if row.judged else f"–; {error}")
        rows.append([str(found.case.number), *cells])
    return grid(["case", *names], rows)


def _accuracy(row: nitrogen.Row) -> str:
    """In percent, where the prediction is not exact."""
    if not row.accuracy or not math.isfinite(row.expected):
        return ""
    return f" ({100.0 * row.accuracy / abs(row.expected):.2g} %)"


def diffusion(study: nitrogen.Study) -> str:
    """Self-diffusion at short and at long times."""
    rows = []
    for found in study.cases:
        table, transport = {row.name: row for row in found.rows}, found.transport
        assert transport is not None
        long, exact = transport.long, transport.exact.value
        tau = exact * found.scene.particle_mass / found.scene.thermal_energy
        first, last = (lag / tau for lag in long.window or (0.0, 0.0))
        expected = transport.expected_long
        rows.append(
            [
                *_name(found),
                f"{exact:.3g}",
                shown(*_ratio(table["D short"], exact), digits=3),
                f"{exact / found.scene.self_diffusion_continuum:.2f}",
                _times(long) if found.moves else f"[{_times(long)}]",
                f"{first:.0f} to {last:.0f}",
                f"{expected:.2g}" if found.moves and math.isfinite(expected) else "",
                f"{found.case.diffusion:.2g}",
            ]
        )
    header = [
        "case",
        "$N_i$",
        r"$h/\Delta x$",
        "$D$ of the friction [m²/s]",
        "slope of the VACF, over it",
        r"$D/(Kh^2\rho k_BT/m\eta)$",
        "long times [m²/s]",
        r"window [$\tau$]",
        "mean field [m²/s]",
        "Yang [m²/s]",
    ]
    return grid(header, rows)


def resistances(study: nitrogen.Study) -> str:
    """Viscosity and conductivity over those asked for."""
    rows = []
    for found in study.cases:
        table, transport = {row.name: row for row in found.rows}, found.transport
        assert transport is not None
        eta, kappa = transport.asked_viscosity, transport.asked_conductivity
        cells = ["frozen", "", "", ""]
        if found.moves:
            late = transport.long_viscosity
            last = (late.window or (0.0, 0.0))[1] / found.scene.friction_time
            cells = [
                shown(*_ratio(table["eta"], eta), digits=4),
                _expected(table["eta"], eta),
                shown(late.value / eta, late.stderr / eta, digits=2),
                f"{last:.0f}",
            ]
        rows.append(
            [
                *_name(found),
                *cells,
                f"{transport.lattice_viscosity / eta:.3f}",
                f"{found.case.viscosity / eta:.2f}",
                shown(*_ratio(table["kappa"], kappa), digits=4),
                _expected(table["kappa"], kappa),
                f"{transport.lattice_conductivity / kappa:.3f}",
            ]
        )
    header = [
        "case",
        "$N_i$",
        r"$h/\Delta x$",
        r"$\eta$, lags of 10 to 20 steps",
        "expected",
        r"$\eta$, long lags",
        r"to [$\tau$]",
        "lattice",
        "Yang",
        r"$\kappa$",
        "expected",
        "lattice",
    ]
    return grid(header, rows)


def waves(study: nitrogen.Study) -> str:
    """Viscosity of shear waves, where no theory knows the stress."""
    rows = []
    for found in study.cases:
        transport = found.transport
        if transport is None or transport.wave is None or transport.response is None:
            continue
        eta, response = transport.asked_viscosity, transport.response
        measured, put_in = transport.wave.scaled(1.0 / eta), response.viscosity.scaled(1.0 / eta)
        growth = "without bound"
        if math.isfinite(response.growth.value):
            growth = shown(response.growth.value, response.growth.stderr, digits=3)
        first, last = (
            (each.window or (0.0, 0.0))[1] / found.scene.friction_time
            for each in (response.viscosity, response.growth)
        )
        warmth = next(row for row in found.rows if row.name == "T wave")
        rows.append(
            [
                *_name(found),
                shown(*_ratio(warmth, warmth.expected), digits=4),
                shown(measured.value, measured.stderr, digits=4),
                shown(put_in.value, put_in.stderr, digits=4),
                f"{measured.z(put_in):+.1f}",
                f"{first:.0f}",
                growth,
                f"{last:.0f}",
                f"{math.sqrt(transport.moved):.2f}",
                "yes" if transport.flows else "no",
            ]
        )
    header = [
        "case",
        "$N_i$",
        r"$h/\Delta x$",
        "$T$ of waves",
        r"$\eta$ of waves, equilibrium",
        r"$\eta$ of waves, put in",
        "$t$",
        r"within [$\tau$]",
        "later over it",
        r"within [$\tau$]",
        r"rms displacement [$\Delta x$]",
        "judged",
    ]
    return grid(header, rows)


def _expected(row: nitrogen.Row, unit: float) -> str:
    return f"{row.expected / unit:.4f} ± {row.accuracy / unit:.4f}"


def pairing(studies: dict[str, nitrogen.Study]) -> str:
    """What becomes of particles that pair."""
    rows = []
    for kernel, study in studies.items():
        for found in study.cases:
            table, transport = {row.name: row for row in found.rows}, found.transport
            assert transport is not None
            variance = table["Var rho"].measured.scaled(1.0 / table["rho"].measured.value ** 2)
            scale = found.scene.stiffness
            rows.append(
                [
                    *_name(found),
                    kernel,
                    f"{found.paired:.0%}",
                    shown(scale * variance.value, scale * variance.stderr, digits=3),
                    _times(transport.long),
                    f"{transport.exact.value:.2g}",
                ]
            )
    header = [
        "case",
        "$N_i$",
        r"$h/\Delta x$",
        "kernel",
        r"with another within $\Delta x/2$",
        r"$N_i\,\mathrm{Var}\,\rho/\rho^2$",
        "$D$, long times [m²/s]",
        "short times [m²/s]",
    ]
    return grid(header, sorted(rows, key=lambda row: int(row[0])))


def _name(found: nitrogen.Measured) -> list[str]:
    ratio = found.case.support / found.case.spacing
    return [str(found.case.number), f"{found.scene.stiffness:.3g}", f"{ratio:.2f}"]


def _ratio(row: nitrogen.Row, unit: float) -> tuple[float, float]:
    return row.measured.value / unit, row.measured.stderr / unit


def _times(estimate: Estimate) -> str:
    """`2.63(4)e-09`: value and error in the same power of ten."""
    power = math.floor(math.log10(max(abs(estimate.value), estimate.stderr)))
    unit = 10.0**power
    digits = min(3, max(1, 1 - math.floor(math.log10(estimate.stderr / unit))))
    return f"({estimate.value / unit:.{digits}f} ± {estimate.stderr / unit:.{digits}f})e{power}"


def write(report: Report, study: nitrogen.Study, both: dict[str, nitrogen.Study]) -> None:
    """Tables and figures of a study, and of the cases run with both kernels."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    report.document(
        variances(study),
        "Ratios to what is exact ($T$, $V$, and $P$ over $R\\langle\\rho\\rangle T$) or expected "
        "($\\rho$ and Var $P$: random-phase estimate), with standard errors; published values "
        "likewise, in brackets the stated accuracy where it is not exact. $N_i$: molecules a "
        "particle.",
        verdicts(study),
        "Distances beyond the accuracy in standard errors, and relative standard errors, of the "
        "cases whose particles move; a dash where nothing is judged.",
        pairing(both),
        "Lucy's kernel beside one whose transform is positive.",
    )
    measured = (
        "$D$ of the friction: $k_BT/m$ over the exact initial slope of the VACF in the sampled "
        "arrangements. Long times: mean-square displacement over the window of lags, in friction "
        "times $\\tau$; in brackets glasses that run down."
    )
    against = (
        "Over the values asked for. Helfand moments, with the noise of these runs. Expected of "
        "$\\eta$: friction on the particles as they lay, the mean-field share of pressure forces "
        "within the lags, and what particles carry (judged in cases 1 to 4; the others by "
        "waves, below); of $\\kappa$: the lattice at the time step and what friction and motion "
        "carry. After ± the accuracy. Lattice: friction by its sum at the time step; decay of a "
        "wave of temperature, without noise, at a wavelength of 16 spacings or two supports."
    )
    text = [diffusion(study), measured, resistances(study), against]
    if any(found.transport and found.transport.response for found in study.cases):
        beside = (
            "Shear waves of the longest three lengths of the box, over the temperature and the "
            "viscosity asked for, with what short waves feel less in a continuum taken out: "
            "correlated in equilibrium, and put into another run. Later: viscosity within twenty "
            "times the lags. The displacement is that of the run in equilibrium."
        )
        text += [waves(study), beside]
    text.append(f"Written by `{report.command}`.")
    report.write("generated", "nitrogen_transport.md", "\n\n".join(text) + "\n")
    report.figure(nitrogen.plot(study, plt.figure(figsize=(9.0, 6.8), layout="constrained")))
    figure = plt.figure(figsize=(10.8, 4.4), layout="constrained")
    report.figure(nitrogen.plot_transport(study, figure), "transport")


def disordered(number: int, kernel: str, plan: nitrogen.Plan | None = None) -> nitrogen.Measured:
    """A case from relaxed random places."""
    case = nitrogen.CASES[number]
    size = 512 if plan is None else 216
    start = sdpd.RandomStart(relax_steps=20)
    scene = nitrogen.scene_of(case, kernel=kernel, heat_capacity=2.5, particles=size, start=start)
    if plan is None:
        plan = nitrogen.Plan.of(case, scene, quick=True, transport=True)
    return nitrogen.measure(case, scene, plan, seed=1, threads=1)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("nitrogen", __doc__, argv)
    if report.quick:
        both = {kernel: nitrogen.Study((disordered(1, kernel, TRIED),), 0.0) for kernel in KERNELS}
        write(report, both["wendland_c2"], both)
        return
    moving = nitrogen.run_nitrogen(MOVING, threads=1)
    frozen = nitrogen.run_nitrogen(sorted({*nitrogen.CASES} - {*MOVING}), quick=True, threads=1)
    study = nitrogen.Study(moving.cases + frozen.cases, moving.seconds + frozen.seconds)
    both = {
        kernel: nitrogen.Study(tuple(disordered(n, kernel) for n in PAIRING), 0.0)
        for kernel in KERNELS
    }
    write(report, study, both)


if __name__ == "__main__":
    main()
