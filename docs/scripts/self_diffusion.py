"""Tables 7 and 8 and Figures 21 to 23 of Yang (2013): the dissertation's columns beside ours.

`python docs/scripts/self_diffusion.py` takes about six minutes on two cores; errors are those of
half the work of `sdpd diffusion`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from report import Report, grid, shown, subplots

import sdpd
from sdpd import diffusion
from sdpd.analysis import Estimate
from sdpd.diffusion import CaseResult, Study
from sdpd.drawing import BLUE, VERMILION

GREY = "0.35"
CORE_MINUTES = 0.5  # a case
EXTREMES = (("water", 1), ("water", 10), ("nitrogen", 1), ("nitrogen", 3))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("self_diffusion", __doc__, argv)
    studies = {fluid: study_of(fluid, report.quick) for fluid in ("water", "nitrogen")}
    water, nitrogen = studies["water"], studies["nitrogen"]
    report.document(
        "**Table 7, liquid water.** Printed columns, and the same computed from the inputs:",
        printed(water),
        "Measured here:",
        measured(water),
        "**Table 8, nitrogen.** Printed columns, and the same computed from the inputs:",
        printed(nitrogen),
        "Measured here:",
        measured(nitrogen),
        verdicts(water, nitrogen),
    )
    plot_phases(report)
    plot_temperatures(report, water, nitrogen)
    folder = report.output / "figures"
    for study, name in ((water, "water"), (nitrogen, "nitrogen")):
        for path in diffusion.write_figures(study, folder):
            path.replace(folder / f"{report.name}_{name}_{path.name}")


def study_of(fluid: str, quick: bool) -> Study:
    cases = (1, 10) if quick and fluid == "water" else None
    if not quick:
        cases = tuple(diffusion.TABLES[fluid])
    return diffusion.run_study(
        fluid=fluid, cases=cases, quick=quick, core_minutes=CORE_MINUTES, progress=False
    )


def verdicts(*studies: Study) -> str:
    parts = []
    for study in studies:
        z = np.array([result.deviation for result in study.results])
        square = float(z @ z)
        parts.append(
            f"{study.fluid.capitalize()}: {'all criteria met' if study.passed else 'FAILED'}; "
            f"$D$ at short times against its exact prediction, $\\sum z^2={square:.1f}$ over "
            f"{z.size} cases"
        )
    return ". ".join(parts) + "."


def number(value: float | None, digits: int = 3) -> str:
    """`1.23e-9`, or plain where that is short."""
    if value is None:
        return ""
    if 1e-2 <= abs(value) < 1e4:
        return f"{value:.0f}" if abs(value) >= 10.0**digits else f"{value:.{digits}g}"
    exponent = math.floor(math.log10(abs(value)))
    return f"${value / 10.0**exponent:.{digits - 1}f}\\cdot10^{{{exponent}}}$"


def printed(study: Study) -> str:
    """What the dissertation prints / what follows from its inputs."""
    header = ["case", "$N$", "$h/\\Delta x$", "$m_i/m$", "$\\Delta x/2R$"]
    header += ["$\\sqrt{\\overline{c^2}}$ [m/s]", "so $T$ [K]"]
    liquid = study.fluid == "water"
    if liquid:
        header += ["$D_{ii}$ (Y 3.7) [m²/s]", "$D^h_{ii}$ (Y 3.8) [m²/s]"]
    rows = []
    for result in study.results:
        case, again = result.case, diffusion.recomputed(result.case)
        pairs: list[tuple[float | None, float]] = [
            (case.published_mass_ratio, again.mass_ratio),
            (case.published_size_ratio, again.size_ratio),
            (case.published_speed, again.speed),
        ]
        row = [f"{case.number}", f"{case.particles}", f"{case.support_radius / case.spacing:.2f}"]
        row += [f"{number(a)} / {number(b)}" for a, b in pairs]
        row.append(f"{again.temperature:.0f}")
        if liquid:
            row.append(f"{number(case.published_bird)} / {number(again.bird)}")
            row.append(f"{number(case.published_support)} / {number(again.support)}")
        rows.append(row)
    return grid(header, rows)


def relative(estimate: Estimate) -> str:
    return f"{number(estimate.value, 4)} ± {100.0 * estimate.relative:.1f} %"


def measured(study: Study) -> str:
    header = ["case", "$\\bar\\rho$ [kg/m³]", "printed", "$T$ [K]", "$\\mathrm{Var}\\,T$, exact 1"]
    header += ["$D$ short, VACF", "exact", "$z$", "$D$ long, MSD", "$D$ long, VACF", "$D_K$"]
    header += ["$D_\\mathrm{long}/D^h$", "Sc"]
    rows = []
    for r in study.results:
        rows.append(
            [
                f"{r.case.number}",
                shown(r.density.value, r.density.stderr, digits=4),
                f"{r.case.published_density:g}",
                shown(r.temperature.value, r.temperature.stderr, digits=2),
                shown(r.temperature_variance.value, r.temperature_variance.stderr, digits=2),
                relative(r.short),
                number(r.exact.value, 4),
                f"{r.deviation:+.1f}",
                relative(r.msd),
                relative(r.integral),
                number(r.formulas.continuum, 4),
                f"{r.msd.value / r.formulas.dissertation:.2f}",
                number(r.schmidt(r.msd).value),
            ]
        )
    return grid(header, rows)


# --- Figure 21 --------------------------------------------------------------------------------


def plot_phases(report: Report) -> None:
    """v_x against v_y of the particles, smallest and largest of each fluid, in one scale of m/s."""
    figure, panels = subplots(4, width=10.4, height=3.0)
    for axes, (fluid, case_number) in zip(panels, EXTREMES, strict=True):
        case = diffusion.TABLES[fluid][case_number]
        scene = case.scene()
        step = 0.25 * sdpd.timestep.acoustic_limit(scene)
        sim = quiet_simulation(scene, step)
        sim.run(steps=20 if report.quick else 200, progress=False)
        v = sim.velocities
        speed = scene.thermal_speed
        axes.plot(v[:, 0], v[:, 1], ".", color=BLUE, markersize=1.6, alpha=0.6)
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        for sigma in (1.0, 2.0, 3.0):
            axes.plot(
                sigma * speed * np.cos(angle),
                sigma * speed * np.sin(angle),
                color=VERMILION,
                linewidth=0.9,
            )
        reach = 4.6 * speed
        axes.set(
            xlim=(-reach, reach),
            ylim=(-reach, reach),
            aspect="equal",
            xlabel="$v_x$ [m/s]",
        )
        axes.set_title(
            f"{fluid}, case {case_number}\n$m={tex(scene.particle_mass)}$ kg", fontsize=8.5
        )
    panels[0].set_ylabel("$v_y$ [m/s]")
    report.figure(figure, "phase")


def quiet_simulation(scene: sdpd.Scene, step: float) -> sdpd.Simulation:
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        return sdpd.Simulation(scene, integrator="pair_splitting", dt=step, seed=7, threads=1)


def tex(value: float) -> str:
    exponent = math.floor(math.log10(value))
    return f"{value / 10.0**exponent:.2g}\\cdot10^{{{exponent}}}"


# --- Figure 22 --------------------------------------------------------------------------------


def plot_temperatures(report: Report, water: Study, nitrogen: Study) -> None:
    figure, panels = subplots(3, width=10.4, height=3.3)
    heating(report, panels[0])
    for axes, study in ((panels[1], water), (panels[2], nitrogen)):
        against_mass(axes, study)
    report.figure(figure, "temperature")


def heating(report: Report, axes: Any) -> None:
    """From rest: the random forces bring the fluid to its temperature in some tau."""
    for case_number, color in ((1, BLUE), (10, VERMILION)):
        case = diffusion.TABLES["water"][case_number]
        scene = case.scene().replace(start=sdpd.RandomStart(velocities="zero"))
        tau = scene.friction_time
        sim = quiet_simulation(scene, 0.1 * tau)
        thermo = sdpd.Thermodynamics(every=1)
        sim.run(steps=60 if report.quick else 200, observe=thermo, progress=False)
        time = np.append(0.0, thermo["time"]) / tau
        axes.plot(
            time,
            np.append(0.0, thermo["temperature"]),
            color=color,
            label=f"case {case_number}, $N={case.particles}$",
        )
    axes.axhline(300.0, color=GREY, linewidth=0.8)
    axes.set(xlabel=r"$t/\tau$", ylabel="kinetic temperature [K]", title="water, started at rest")
    axes.legend(fontsize=7.5)


def against_mass(axes: Any, study: Study) -> None:
    """Mean with its standard error, standard deviation in time with the exact one."""
    results: Sequence[CaseResult] = study.results
    mass = np.array([r.scene.particle_mass for r in results])
    mean = np.array([r.temperature.value for r in results])
    error = np.array([r.temperature.stderr for r in results])
    asked = results[0].scene.fluid.temperature
    exact = np.array([asked * math.sqrt(2.0 / (3.0 * (r.scene.n_particles - 1))) for r in results])
    spread = exact * np.sqrt([r.temperature_variance.value for r in results])
    printed_at = np.array([diffusion.recomputed(r.case).temperature for r in results])
    axes.axhline(asked, color=GREY, linewidth=0.8)
    axes.errorbar(
        mass,
        mean,
        spread,
        fmt="none",
        ecolor=BLUE,
        elinewidth=3.0,
        alpha=0.35,
        label="standard deviation in time",
    )
    for sign in (-1.0, 1.0):
        axes.plot(
            mass,
            asked + sign * exact,
            "_",
            color="black",
            markersize=9,
            label="the same, exact" if sign > 0.0 else None,
        )
    axes.errorbar(
        mass, mean, error, fmt="o", color=BLUE, markersize=4, capsize=2.5, label="mean, one SE"
    )
    axes.plot(
        mass, printed_at, "x", color=VERMILION, markersize=6, label="dissertation, from its $c$"
    )
    axes.set(xscale="log", xlabel="mass of a particle [kg]", title=study.fluid)
    axes.legend(fontsize=7)


if __name__ == "__main__":
    main()
