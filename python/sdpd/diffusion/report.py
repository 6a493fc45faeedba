"""The study as text: tables, what they say, and the verdict."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sdpd.analysis.estimate import Estimate
from sdpd.diffusion.cases import EXPERIMENTAL_WATER

if TYPE_CHECKING:
    from sdpd.diffusion.collective import CollectiveTheory
    from sdpd.diffusion.results import CaseResult
    from sdpd.diffusion.study import Study

__all__ = ["conclusion", "report", "tables", "verdict"]

_NAMES = {"water": "Table 7, liquid water", "nitrogen": "Table 8, nitrogen gas"}


def _columns(header: Sequence[str], units: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Right-aligned columns under a name and a unit."""
    names = [list(header)] + ([list(units)] if any(units) else [])
    every = [*names, *map(list, lines)]
    widths = [max(len(line[k]) for line in every) for k in range(len(header))]
    shown = ["  ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) for line in every]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join([*shown[: len(names)], rule, *shown[len(names) :]])


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
    parts = (_conditions(study), _state(study), _coefficients(study), _schmidt(study))
    return "\n\n".join(parts)


def _conditions(study: Study) -> str:
    lines = []
    for r in study.results:
        tau, plan = r.friction_time, r.plan
        first, last = r.msd.window or (0.0, 0.0)
        _, end = r.integral.window or (0.0, 0.0)
        lines.append(
            [
                f"{r.case.number}",
                _length(r.case.edge),
                f"{r.scene.n_particles}",
                f"{r.scene.resolution.support:.2f}",
                f"{r.formulas.size_ratio:.3g}",
                f"{r.scene.reduced_viscosity:.0f}",
                f"{tau:.3g}",
                f"{plan.short / tau:.3f}, {plan.long / tau:.2f}, {plan.large / tau:.1f}",
                f"{plan.steps}",
                f"{plan.sampled / tau:.0f}",
                f"{first / tau:.0f} to {last / tau:.0f}",
                f"{end / tau:.0f}",
                f"{r.seconds:.0f}",
            ]
        )
    return (
        "Conditions (τ: friction time as measured; dt of short and long blocks and of "
        "equilibration; wall: time of all replicas)\n"
    ) + _columns(
        ["case", "L", "N", "h/dx", "size", "η*", "τ", "dt", "steps", "sampled", "MSD lags"]
        + ["VACF to", "wall"],
        ["", "", "", "", "dx/2R", "", "s", "τ", "", "τ", "τ", "τ", "s"],
        lines,
    )


def _state(study: Study) -> str:
    lines = [
        [
            f"{r.case.number}",
            _plain(r.temperature),
            _plain(r.temperature_variance),
            _plain(r.density),
            *(f"{100 * d.value:+.2f} ± {100 * d.stderr:.2f}" for d in r.drifts.values()),
            "yes" if r.is_steady(study.limits.drift_level) else "NO",
        ]
        for r in study.results
    ]
    return "State over the long blocks; drift from the first block to the last\n" + _columns(
        ["case", "T_kin", "Var T_kin", "mean density", "drift T", "drift density", "drift P"]
        + ["steady"],
        ["", "K", "2T²/3(N-1)", "kg/m³", "%", "%", "%", ""],
        lines,
    )


def _coefficients(study: Study) -> str:
    lines = [
        [
            f"{r.case.number}",
            _relative(r.short),
            _relative(r.exact),
            f"{r.deviation:+.1f}",
            _relative(r.msd),
            _relative(r.integral),
            f"{-100.0 * _remaining(r, theory):+.1f}",
            f"{r.formulas.continuum:.3e}",
            f"{r.formulas.bird:.3e}",
            f"{r.formulas.dissertation:.3e}",
        ]
        for r, theory in zip(study.results, study.collective, strict=True)
    ]
    return (
        "Self-diffusion [m²/s] ± one standard error (SE); to come: caging beyond the MSD lags, "
        "mean field\n"
    ) + _columns(
        ["case", "short, VACF", "short, exact", "z", "long, MSD", "long, VACF integral"]
        + ["to come", "D_K", "D_bird", "D_h"],
        ["", "slope", "⟨Σg(a+b/3)⟩", "SE", "slope/6", "∫C dt", "%", "continuum", "Y 3.7", "Y 3.8"],
        lines,
    )


def _schmidt(study: Study) -> str:
    lines = []
    for r in study.results:
        nu, lead = r.scene.fluid.kinematic_viscosity, r.formulas
        found = [r.schmidt(e) for e in (r.short, r.msd, r.integral)]
        lines.append(
            [
                f"{r.case.number}",
                *(f"{e.value:.4g} ± {100.0 * e.relative:.1f} %" for e in found),
                *(f"{nu / v:.4g}" for v in (lead.continuum, lead.bird, lead.dissertation)),
            ]
        )
    names = ["case", "short, VACF", "long, MSD", "long, VACF integral", "D_K", "D_bird", "D_h"]
    return "Schmidt number η/(ρD)\n" + _columns(names, [""] * len(names), lines)


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
        f"D at short times differs from D_K by {short}, as a particle has no friction with itself, "
        f"which the continuum counts. D at long times differs from that at short times by {long}: "
        f"momentum given to the neighbours comes back ({gain} in mean field), and the neighbours "
        f"cage the particle ({loss} in mean field, of which {rest} builds up beyond the first lag "
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
