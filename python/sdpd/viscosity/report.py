"""The study as text: what was asked, what each method found, how they agree."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from sdpd import timestep
from sdpd.agreement import LEVEL, columns, comparison_table, threshold
from sdpd.units import quantity

if TYPE_CHECKING:
    from sdpd.analysis import Estimate
    from sdpd.viscosity.study import Study

__all__ = ["report"]


def report(study: Study) -> str:
    """Everything the command prints."""
    return "\n\n".join(
        [_head(study), _table(study), _shares(study), _comparisons(study), _words(study)]
    )


def _head(study: Study) -> str:
    sample, plan = study.sample, study.plan
    si, tau = sample.fluid.is_si, sample.friction_time
    limit = timestep.acoustic_limit(sample)
    number = f"{sample.n_particles} particles in {sample.dimension}D"
    if sample.n_particles != study.scene.n_particles:
        number += f" (for the {study.scene.n_particles} of the scene)"
    first, last = plan.stress_window
    return (
        f"Delivered viscosity: {number}, {sample.resolution.kernel} kernel, "
        f"h/dx = {sample.resolution.support:g}\n"
        f"{sample.fluid.equation_of_state.formula}, X = {sample.stiffness:.4g}, "
        f"eta* = {sample.reduced_viscosity:.4g}"
        f"{', calibrated' if sample.calibrate else ''}\n"
        f"exact pair splitting, dt = {quantity(plan.dt, 's', si=si)} = {plan.dt / tau:.2f} tau = "
        f"{plan.dt / limit:.2f} of the acoustic limit\n"
        f"equilibrium: {plan.steps} steps; lags {first / tau:.3g} to {last / tau:.3g} tau "
        f"(stress), to {plan.current_lag / tau:.3g} tau (currents)\n"
        f"force: {plan.forced_steps} steps; amplitude of the flow "
        f"{study.amplitude.value / sample.thermal_speed:.3f} v_th\n"
        f"{_heating(study)}seed {study.seed}, {study.seconds:.0f} s"
    )


def _heating(study: Study) -> str:
    """What becomes of the work of the force, and what fluctuating temperatures cost."""
    scene = study.sample
    if not scene.active_effects.energy:
        return ""
    return (
        f"energy: C = {scene.heat_capacity_number:.4g} kB, so that fluctuating temperatures take "
        f"{0.5 / scene.heat_capacity_number:.2%} of the friction;\nthe force heats the fluid by "
        f"{study.heating:.2%} of T in all, taken out of all particles alike\n"
    )


def _table(study: Study) -> str:
    asked = study.asked
    unit = "Pa s" if study.sample.dimension == 3 else "Pa s m"
    shown = f" [{unit}]" if study.sample.fluid.is_si else ""
    kh = study.sample.support_radius
    lines = [["", f"viscosity{shown}", "SE", "over asked", "at kh", "measured there"]]

    def plain(name: str, value: float) -> None:
        lines.append([name, f"{value:.5g}", "", f"{value / asked:.4f}", "", ""])

    plain("asked", asked)
    plain("lattice sum, dt -> 0", study.on_lattice)
    small, step = study.lattice
    for decay in (small, step):
        ratio = decay.dt / study.sample.friction_time
        value = decay.factor.scaled(study.on_lattice)
        lines.append([f"lattice decay, dt = {ratio:.2g} tau", *_cells(value, asked), "", ""])
    plain("friction as particles lie, this dt", study.friction)
    added = study.theory.configurational() + study.theory.kinetic
    plain("  with mean field of the rest", study.friction + added)
    for method in study.methods:
        measured = method.measured
        lines.append(
            [
                method.name,
                *_cells(method.viscosity, asked),
                f"{method.wave_number * kh:.2f}",
                f"{measured.value:.5g} ± {measured.stderr:.2g}",
            ]
        )
    lines.append(["all three", *_cells(study.viscosity, asked), "", ""])
    lines.append(["Green-Kubo (same run)", *_cells(study.stress.green_kubo, asked), "", ""])
    return columns(lines)


def _cells(estimate: Estimate, asked: float) -> list[str]:
    over = estimate.scaled(1.0 / asked)
    return [
        f"{estimate.value:.5g}",
        f"{estimate.stderr:.2g}",
        f"{over.value:.4f} ± {over.stderr:.4f}",
    ]


def _shares(study: Study) -> str:
    lines = [["stress by part, alone", "", "SE", "over asked"]]
    for name, estimate in study.stress.shares.items():
        lines.append([f"  {name}", *_cells(estimate, study.asked)])
    lines.append(["  random, delta part of C(0)", *_cells(study.stress.delta, study.asked)])
    for name, value in (
        ("kinetic, mean field", study.theory.kinetic),
        ("conservative, mean field", study.theory.configurational()),
    ):
        lines.append([f"  {name}", f"{value:.5g}", "", f"{value / study.asked:.4f}"])
    return columns(lines)


def _comparisons(study: Study) -> str:
    return comparison_table(study.comparisons, study.agreed, _threshold(study))


def _threshold(study: Study) -> float:
    return threshold(study.comparisons, study.plan.blocks)


def _words(study: Study) -> str:
    found, thicker = study.viscosity, study.thicker
    share = found.scaled(1.0 / study.asked)
    text = (
        f"The thermal fluid delivers {share.value:.3f} ± {share.stderr:.3f} of the viscosity asked "
        f"for: {thicker.value:+.2f} ± {thicker.stderr:.2f} sqrt(m kT)/dx^(D-1) on top of eta* = "
        f"{study.sample.reduced_viscosity:.4g}. Friction accounts for "
        f"{study.friction / study.asked:.3f}, the rest is momentum that particles and pressure "
        "forces carry."
    )
    about = (
        "Each method at k = 0 and at rates slower than the stress relaxes: finite k by the "
        "friction on the particles as they lie and the mean-field shape of the rest. Accuracy: "
        "stress that relaxes beyond the lags, 0.4 of what that shape does, shear thinning of the "
        "forced flow. Sees: the smallest difference that fails here. A part of the stress alone "
        "leaves out its correlations with the others."
    )
    parts = [text, about]
    if study.to_come > 0.02 * study.asked:
        parts.append(
            f"Stress beyond the lags would add another {study.to_come / study.asked:.1%} in mean "
            "field: flows slower than that are thicker still (--time-factor)."
        )
    parts.append(_verdict(study))
    return "\n".join(textwrap.fill(part, 100) for part in parts)


def _verdict(study: Study) -> str:
    failed = [
        f"{each.first} against {each.second}"
        for each, agreed in zip(study.comparisons, study.agreed, strict=True)
        if not agreed
    ]
    if not study.lattice_holds:
        failed.append("decay on the lattice against its sum")
    if failed:
        return "FAIL: " + "; ".join(failed)
    return (
        f"PASS: the methods agree; two fail beyond their accuracy and {_threshold(study):.1f} SE "
        f"(Student t, {LEVEL:.0%} for the family by Bonferroni). On the lattice a wave at a small "
        f"step decays as its sum says to {abs(study.lattice[0].factor.value - 1.0):.1e}."
    )
