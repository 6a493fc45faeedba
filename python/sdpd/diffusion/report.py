"""The study as text, CSV and JSON."""

from __future__ import annotations

import csv
import json
import math
import os
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.analysis.estimate import Estimate
from sdpd.diffusion.cases import EXPERIMENTAL_WATER

if TYPE_CHECKING:
    from sdpd.diffusion.collective import CollectiveTheory
    from sdpd.diffusion.results import CaseResult
    from sdpd.diffusion.study import Study

__all__ = ["report", "rows", "tables", "write"]

_NAMES = {"water": "Table 7, liquid water", "nitrogen": "Table 8, nitrogen gas"}


def _columns(header: Sequence[str], units: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Right-aligned columns under a name and a unit."""
    every = [list(header), list(units), *map(list, lines)]
    widths = [max(len(line[k]) for line in every) for k in range(len(header))]
    shown = ["  ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) for line in every]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join([*shown[:2], rule, *shown[2:]])


def _relative(estimate: Estimate, digits: int = 4) -> str:
    """Value and relative standard error."""
    return f"{estimate.value:.{digits - 1}e} ± {100.0 * estimate.relative:.1f} %"


def _plain(estimate: Estimate) -> str:
    """Value and standard error with two digits of the error."""
    error = estimate.stderr
    digits = 1 - math.floor(math.log10(error)) if error > 0.0 else 3
    digits = max(0, min(digits, 6))
    return f"{estimate.value:.{digits}f} ± {error:.{digits}f}"


def _length(value: float) -> str:
    for unit, scale in (("nm", 1e-9), ("µm", 1e-6), ("mm", 1e-3)):
        if abs(value) < 999.5 * scale:
            return f"{value / scale:.4g} {unit}"
    return f"{value:.4g} m"


def tables(study: Study) -> str:
    """Conditions, state, self-diffusion and Schmidt numbers, a line a case."""
    results = study.results
    conditions = []
    for r in results:
        tau, first, last = r.friction_time, *(r.msd.window or (0.0, 0.0))
        conditions.append(
            [
                f"{r.case.number}",
                _length(r.case.edge),
                f"{r.scene.n_particles}",
                f"{r.scene.resolution.support:.2f}",
                f"{r.formulas.size_ratio:.3g}",
                f"{r.scene.reduced_viscosity:.0f}",
                f"{tau:.3g}",
                f"{r.plan.short / tau:.3f}, {r.plan.long / tau:.2f}, {r.plan.large / tau:.1f}",
                f"{r.plan.steps}",
                f"{r.plan.sampled / tau:.0f}",
                f"{first / tau:.0f} to {last / tau:.0f}",
                f"{r.integral.window[1] / tau:.0f}" if r.integral.window else "",
                f"{r.seconds:.0f}",
            ]
        )
    state = [
        [
            f"{r.case.number}",
            _plain(r.temperature),
            _plain(r.density),
            *(
                f"{100 * d.value:+.2f} ± {100 * d.stderr:.2f}"
                for d in (r.drifts[name] for name in r.drifts)
            ),
            "yes"
            if all(d.p(0.0) > study.limits.drift_level / 3 for d in r.drifts.values())
            else "NO",
        ]
        for r in results
    ]
    diffusion = [
        [
            f"{r.case.number}",
            _relative(r.short),
            _relative(r.exact),
            f"{r.deviation:+.1f}",
            _relative(r.msd),
            _relative(r.integral),
            f"{r.formulas.continuum:.3e}",
            f"{r.formulas.bird:.3e}",
            f"{r.formulas.dissertation:.3e}",
        ]
        for r in results
    ]
    schmidt = []
    for r in results:
        nu = r.scene.fluid.kinematic_viscosity
        found = [r.schmidt(e) for e in (r.short, r.msd, r.integral)]
        lines = [nu / v for v in (r.formulas.continuum, r.formulas.bird, r.formulas.dissertation)]
        schmidt.append(
            [
                f"{r.case.number}",
                *(f"{e.value:.4g} ± {e.stderr:.2g}" for e in found),
                *(f"{value:.4g}" for value in lines),
            ]
        )
    tau = "τ"
    return "\n\n".join(
        [
            "Conditions (τ: friction time as measured; dt of short blocks, long blocks, "
            "equilibration)\n"
            + _columns(
                ["case", "L", "N", "h/dx", "size", "η*", "τ", "dt", "steps", "sampled", "MSD lags"]
                + ["VACF to", "core"],
                ["", "", "", "", "dx/2R", "", "s", tau, "", tau, tau, tau, "s"],
                conditions,
            ),
            "State over the long blocks; drift from the first block to the last\n"
            + _columns(
                ["case", "T_kin", "mean density", "drift T", "drift density", "drift P", "steady"],
                ["", "K", "kg/m³", "%", "%", "%", ""],
                state,
            ),
            "Self-diffusion [m²/s]; the error is one standard error\n"
            + _columns(
                ["case", "short, VACF", "short, exact", "z", "long, MSD", "long, VACF integral"]
                + ["D_K", "D_bird", "D_h"],
                ["", "slope", "⟨Σg(a+b/3)⟩", "", "slope/6", "∫C dt", "continuum", "Y 3.7", "Y 3.8"],
                diffusion,
            ),
            "Schmidt number η/(ρD)\n"
            + _columns(
                ["case", "short, VACF", "long, MSD", "long, VACF integral", "D_K", "D_bird", "D_h"],
                [""] * 7,
                schmidt,
            ),
        ]
    )


def _range(values: Sequence[float], form: str = "+.1%") -> str:
    low, high = min(values), max(values)
    return (
        format(low, form)
        if format(low, form) == format(high, form)
        else (f"{format(low, form)} to {format(high, form)}")
    )


def conclusion(study: Study) -> str:
    """What the numbers say, in words."""
    results, theory = study.results, study.collective
    factors = results[0].formulas
    wrong = factors.continuum / factors.dissertation
    over = _range([r.msd.value / r.formulas.dissertation for r in results], ".2f")
    bird = _range([r.msd.value / r.formulas.bird for r in results], ".2f")
    why = ""
    if study.kernel == "lucy":
        why = (
            " = 3/70, not 1/63: friction damps each component of the velocity, so that D = kTτ/m "
            "without the 1/3 of Y A.10 (x 3), and its rate at ζ = 0 goes with 20η/9, not the 2η of "
            "Y A.4 and A.12 (x 0.9)"
        )
    formula = (
        f"The dissertation's formula D_h = ρh²kT/(63 mη) is too low by a factor of {wrong:.2f}. "
        f"The coefficient is K = {factors.factor:.4f}{why}. Measured, D at long times is {over} "
        f"times D_h and {bird} times D_bird."
    )
    short = _range([r.exact.value / r.formulas.continuum - 1.0 for r in results])
    long = _range([r.msd.value / r.exact.value - 1.0 for r in results])
    gain = _range([t.gain for t in theory])
    loss = _range([-t.loss for t in theory])
    rest = _range([-_remaining(r, t) for r, t in zip(results, theory, strict=True)])
    caging = (
        f"D at short times is {short} off D_K, as a particle has no friction with itself, which "
        f"the continuum counts. D at long times is {long} off that at short times. Two things "
        f"differ: momentum given to the neighbours comes back ({gain} in mean field), and the "
        f"neighbours cage the particle ({loss} in mean field, {rest} of it after the first lag "
        f"of the window; simulations over longer lags show up to twice as much). At X = "
        f"{results[0].scene.stiffness:.0f} cages are soft."
    )
    bias = _range([r.step_bias / r.msd.value for r in results])
    steps = (
        "Steps: the splitting keeps T at any dt. The VACF slope is exact to (dt/τ)²/12 = 0.02 %. "
        f"The MSD slope is {bias} too high at dt = τ/2, by (kT/m)(dt²/12)/τ, which is taken off. "
        "D is that of the periodic box, without a correction for its size."
    )
    return "\n\n".join(textwrap.fill(part, 100) for part in (formula, caging, steps))


def _remaining(result: CaseResult, theory: CollectiveTheory) -> float:
    """Mean-field caging that the window of the displacement has not seen."""
    first = 0.0 if result.msd.window is None else result.msd.window[0]
    return float(theory.remaining(first))


def verdict(study: Study) -> str:
    """Pass or fail, and why."""
    limits = study.limits
    if study.passed:
        results = study.results
        off = max(abs(r.deviation) for r in results)
        short = max(r.short.relative for r in results)
        long = max(max(r.msd.relative, r.integral.relative) for r in results)
        text = (
            f"PASS: D at short times is within {off:.1f} standard errors (SE) of its exact "
            f"prediction (limit {limits.deviation:g}) with SE <= {short:.1%} (limit "
            f"{limits.short_error:.0%}); at long times SE <= {long:.1%} (limit "
            f"{limits.long_error:.0%}); the temperature is that of the fluid; temperature, density "
            "and pressure are steady, so the start has been forgotten."
        )
        return textwrap.fill(text, 100)
    lines = [f"  {name}: {'; '.join(found)}" for name, found in study.failures.items()]
    return "\n".join(["FAIL:", *lines])


def report(study: Study) -> str:
    """Everything the command prints."""
    scene = study.results[0].scene
    law = scene.fluid.equation_of_state
    head = (
        f"Self-diffusion against particle size: Yang (2013), {_NAMES[study.fluid]}, "
        f"{scene.fluid.temperature:g} K\n"
        f"kernel {study.kernel}, {law.formula}, c = {study.sound_ratio:g} v_th, ζ = 0, exact pair "
        f"splitting; seed {study.seed}, {study.processes} "
        f"process{'es' if study.processes > 1 else ''}, {study.seconds:.0f} s"
        + ("; QUICK: small boxes, large errors, wide limits" if study.quick else "")
    )
    parts = [head, tables(study)]
    if study.fluid == "water":
        molecular = study.results[0].formulas.molecular or 0.0
        parts.append(
            f"Molecules of water: kT/(2πη 2R) = {molecular:.3g} m²/s (Y 3.6), measured "
            f"{EXPERIMENTAL_WATER:g} m²/s (as the dissertation quotes it)"
        )
    return "\n\n".join([*parts, conclusion(study), verdict(study)])


def rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict a case, every estimate with its standard error, in SI units."""
    found = []
    for r, theory in zip(study.results, study.collective, strict=True):
        row: dict[str, Any] = {
            "case": r.case.number,
            "edge_m": r.case.edge,
            "particles": r.scene.n_particles,
            "support_m": r.case.support_radius,
            "support_over_spacing": r.scene.resolution.support,
            "particle_mass_kg": r.scene.particle_mass,
            "size_ratio": r.formulas.size_ratio,
            "stiffness_X": r.scene.stiffness,
            "reduced_viscosity": r.scene.reduced_viscosity,
            "dt_short_s": r.plan.short,
            "dt_long_s": r.plan.long,
            "steps": r.plan.steps,
            "friction_time_s": r.friction_time,
        }
        _put(row, "temperature_K", r.temperature)
        _put(row, "density_kg_m3", r.density)
        _put(row, "pressure_Pa", r.pressure)
        for name, drift in r.drifts.items():
            _put(row, f"drift_{name}", drift)
        for name, estimate in _diffusion(r).items():
            _put(row, f"D_{name}_m2_s", estimate)
            _put(row, f"Sc_{name}", r.schmidt(estimate))
        row["short_deviation_in_standard_errors"] = r.deviation
        for name, window in (("msd", r.msd.window), ("integral", r.integral.window)):
            row[f"{name}_lag_first_s"], row[f"{name}_lag_last_s"] = window or (None, None)
        row["msd_step_bias_removed_m2_s"] = r.step_bias
        row |= {
            "D_continuum_m2_s": r.formulas.continuum,
            "D_bird_m2_s": r.formulas.bird,
            "D_dissertation_m2_s": r.formulas.dissertation,
            "D_bird_printed_m2_s": r.case.published_bird,
            "D_dissertation_printed_m2_s": r.case.published_support,
            "collective_gain": theory.gain,
            "caging_loss": theory.loss,
            "D_mean_field_m2_s": theory.long,
            "core_seconds": r.seconds,
            "failures": "; ".join(study.failures.get(r.case.name, [])),
        }
        found.append(row)
    return found


def _diffusion(r: CaseResult) -> dict[str, Estimate]:
    return {
        "short": r.short,
        "short_exact": r.exact,
        "long_msd": r.msd,
        "long_msd_early": r.slopes[0],
        "long_msd_late": r.slopes[1],
        "long_integral": r.integral,
    }


def _put(row: dict[str, Any], name: str, estimate: Estimate) -> None:
    row[name] = estimate.value
    row[f"{name}_stderr"] = estimate.stderr


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write diffusion.csv, diffusion.json and diffusion.txt; the folder is made if need be."""
    from sdpd import __version__

    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    table = rows(study)
    paths = [target / f"diffusion.{ending}" for ending in ("csv", "json", "txt")]
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    summary = {
        "version": __version__,
        "fluid": study.fluid,
        "kernel": study.kernel,
        "equation_of_state": study.results[0].scene.fluid.equation_of_state.kind,
        "sound_ratio": study.sound_ratio,
        "seed": study.seed,
        "quick": study.quick,
        "processes": study.processes,
        "wall_seconds": study.seconds,
        "passed": study.passed,
        "failures": study.failures,
        "cases": table,
    }
    paths[1].write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    paths[2].write_text(report(study) + "\n", encoding="utf-8")
    return paths
