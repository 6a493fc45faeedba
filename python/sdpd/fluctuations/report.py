"""The study as text: a table, what it can see, and the verdict."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sdpd import timestep
from sdpd.fluctuations.results import LEVEL
from sdpd.initial import LatticeStart
from sdpd.units import quantity

if TYPE_CHECKING:
    from sdpd.fluctuations.results import Item
    from sdpd.fluctuations.study import Study

__all__ = ["failure_bound", "item_table", "report", "threshold"]

MELTED = 0.5  # share of particles in their place below which a start is taken for forgotten


def threshold(study: Study) -> float:
    """Standard errors at which one item of this family fails, by Student's t."""
    return failure_bound(len(study.items), study.plan.blocks)


def failure_bound(items: int, blocks: int) -> float:
    """Standard errors at which one of so many items fails, by Student's t from so many blocks."""
    from scipy import stats

    return float(stats.t.isf(0.5 * LEVEL / items, blocks - 1))


def report(study: Study) -> str:
    """Everything the command prints."""
    table = item_table(study.items, study.agreed, threshold(study))
    return "\n\n".join([_head(study), table, _notes(study), _verdict(study)])


def _head(study: Study) -> str:
    scene, plan = study.scene, study.plan
    si = scene.fluid.is_si
    tau, limit = scene.friction_time, timestep.acoustic_limit(scene)
    sampled = quantity(plan.steps * plan.dt, "s", si=si)
    energy = ""
    if study.sampler.energy is not None:
        shell, kelvin = study.sampler.energy.shell, study.sampler.energy.temperatures
        mean = quantity(sum(kelvin) / len(kelvin), "K", si=si)
        energy = (
            f"\nenergy: C = {shell.heat_capacity:.4g} kB a particle, gamma = "
            f"{scene.adiabatic_ratio:.4g}, T of the shell {mean}; total energy changed by "
            f"{study.energy_change:.0e} of the kinetic"
        )
    return (
        f"Equilibrium fluctuations: {scene.n_particles} particles in {scene.dimension}D, "
        f"{scene.resolution.kernel} kernel, h/dx = {scene.resolution.support:g}\n"
        f"{scene.fluid.equation_of_state.formula}, X = {scene.stiffness:.4g}, "
        f"P/(rho c^2) = {scene.pressure_number / scene.stiffness:.3g}, "
        f"eta* = {scene.reduced_viscosity:.3g}\n"
        f"exact pair splitting, dt = {quantity(plan.dt, 's', si=si)} = {plan.dt / tau:.2f} tau = "
        f"{plan.dt / limit:.2f} of the acoustic limit\n"
        f"{plan.equilibration} steps of equilibration, {plan.blocks} blocks of {plan.samples} "
        f"samples every {plan.every} steps ({sampled}); seed {study.seed}, {study.seconds:.0f} s"
        + energy
    )


def item_table(items: Sequence[Item], agreed: Sequence[bool], bound: float) -> str:
    """One line an item, group by group, with what it can see at so many standard errors."""
    lines = [["", "measured", "SE", "theory", "", "z", "sees", ""]]
    group = ""
    for item, right in zip(items, agreed, strict=True):
        if item.group != group:
            group = item.group
            lines.append([group, *[""] * 7])
        lines.append(_line(item, right, bound))
    numbered = [line for line in lines if any(line[1:])]  # titles may run on over the numbers
    widths = [max(len(line[k]) for line in numbered) for k in range(8)]
    rows = []
    for line in lines:
        numbers = [cell.rjust(width) for cell, width in zip(line, widths, strict=True)]
        rows.append("  ".join([line[0].ljust(widths[0]), *numbers[1:]]))
    return "\n".join([rows[0].rstrip(), "-" * len(rows[0]), *(row.rstrip() for row in rows[1:])])


def _line(item: Item, agreed: bool, bound: float) -> list[str]:
    estimate = item.estimate
    kind = "exact" if item.exact else f"± {item.accuracy / item.scale:.1%}"
    seen = item.visible(bound)
    return [
        f"  {item.name}",
        f"{estimate.value:.5g}",
        f"{estimate.stderr:.2g}",
        f"{item.prediction:.5g}",
        kind,
        f"{item.z:+.1f}",
        f"{seen:.1%}",
        "ok" if agreed else "FAIL",
    ]


def _notes(study: Study) -> str:
    about = (
        "SE: one standard error, from the blocks. z: distance from theory in SE. Sees: the "
        "smallest fault, relative to theory (to kT/m for correlations in space, to rho c^2 for the "
        "pressure), that fails here. Velocities are predicted exactly at any dt; the density by "
        "the random-phase approximation (RPA) at this dt, with its stated accuracy, beyond which "
        "an item fails."
    )
    parts = [about]
    if study.sampler.energy is not None:
        shell = study.sampler.energy.shell
        bath = shell.heat_capacity * shell.variance
        parts.append(
            "The particles share one energy, so that temperatures are exact for any number of them "
            f"(shell); next to a bath Var T would be kB T^2/C, here it is {bath:.4f} of that. "
            "Entropy and pressure know the density in mean field."
        )
    if study.prediction is None:
        parts.append(
            "No prediction for the density: the fluid is beyond the pairing limit of its kernel "
            "and equation of state, where particles clump."
        )
    if study.stayed > MELTED:
        lattice = isinstance(study.scene.start, LatticeStart)
        parts.append(
            f"{study.stayed:.0%} of the particles are within half a spacing of where they began: "
            + ("the lattice of the start has not melted" if lattice else "they are caged")
            + ", and densities are those of that arrangement (start=RandomStart(), --time-factor)."
        )
    share = 100.0 * study.drift.value
    parts.append(
        f"Drift of the density variance from the first half to the second: {share:+.1f} ± "
        f"{100.0 * study.drift.stderr:.1f} %"
        + ("." if study.steady else ": NOT STEADY, equilibrate for longer (--time-factor).")
    )
    return "\n".join(textwrap.fill(part, 100) for part in parts)


def _verdict(study: Study) -> str:
    failed = [
        f"{item.group}: {item.name}"
        for item, agreed in zip(study.items, study.agreed, strict=True)
        if not agreed
    ]
    if not study.steady:
        failed.append("not steady")
    if failed:
        return "\n".join(["FAIL:", *(f"  {line}" for line in failed)])
    exact = sum(item.exact for item in study.items)
    text = (
        f"PASS: {len(study.items)} quantities agree, {exact} of them predicted exactly; fails "
        f"beyond {threshold(study):.1f} SE (Student t with {study.plan.blocks - 1} degrees of "
        f"freedom, {LEVEL:.0%} for the whole family by Bonferroni)."
    )
    return textwrap.fill(text, 100)
