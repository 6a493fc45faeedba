"""The study as text: the plan, what was fitted, each quantity with its z, and the verdict."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from sdpd import timestep
from sdpd.correlations.energy_fits import EnergyWave
from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.fluctuations.report import failure_bound, item_table
from sdpd.fluctuations.results import LEVEL
from sdpd.units import quantity

if TYPE_CHECKING:
    from sdpd.analysis import Estimate
    from sdpd.correlations.study import Study

__all__ = ["report", "threshold"]


def threshold(study: Study) -> float:
    """Standard errors at which one item of this family fails, by Student's t."""
    return failure_bound(len(study.items), study.blocks)


def report(study: Study) -> str:
    """Everything the command prints."""
    table = item_table(study.items, study.agreed, threshold(study))
    parts = [_head(study), _fits(study), table, _notes(study), _verdict(study)]
    if study.scene.active_effects.energy:
        parts[2:2] = [_energy_fits(study)]
    return "\n\n".join(parts)


def _head(study: Study) -> str:
    scene, plan = study.scene, study.plan
    si = scene.fluid.is_si
    tau, limit = scene.friction_time, timestep.acoustic_limit(scene)
    sampled = quantity(plan.runs * plan.run_steps * plan.dt, "s", si=si)
    loss = -(timestep.expected_errors(scene, plan.dt, "pair_splitting").viscosity or 0.0)
    return (
        f"Correlations of waves: {scene.n_particles} particles in {scene.dimension}D, "
        f"{scene.resolution.kernel} kernel, h/dx = {scene.resolution.support:g}\n"
        f"{scene.fluid.equation_of_state.formula}, X = {scene.stiffness:.4g}, "
        f"c = {scene.sound.speed:.4g}, nu = {scene.fluid.kinematic_viscosity:.4g}, "
        f"eta* = {scene.reduced_viscosity:.3g}\n"
        f"exact pair splitting, dt = {quantity(plan.dt, 's', si=si)} = {plan.dt / tau:.2f} tau = "
        f"{plan.dt / limit:.2f} of the acoustic limit; delivers {loss:.1%} less friction\n"
        f"{plan.runs} independent runs, each {plan.equilibration} steps of equilibration and "
        f"{plan.run_steps} steps sampled every {plan.every}, in all {sampled};\n"
        f"{study.blocks} blocks; seed {study.seed}, {study.seconds:.0f} s"
    )


def _fits(study: Study) -> str:
    """What was fitted, in the units of the scene."""
    header = ["kh", "nu(k)", "in place", "continuum", "lattice"]
    header += ["c(k)", "theory", "Gamma(k)", "in place", "continuum", "Gamma k/c"]
    lines = [header]
    for shell in study.shells:
        theory, placed, fit = shell.continuum, shell.prediction, shell.fit
        lines.append(
            [
                f"{shell.wave_number * study.scene.support_radius:.2f}",
                _shown(fit.viscosity),
                f"{placed.viscosity:.4g}",
                f"{theory.viscosity:.4g}",
                f"{theory.lattice_viscosity:.4g}",
                _shown(fit.sound_speed),
                f"{theory.sound_speed:.4g}",
                _shown(fit.damping),
                f"{placed.damping:.4g}",
                f"{theory.damping:.4g}",
                f"{placed.sound_rate / placed.frequency:.2f}",
            ]
        )
    return _columns(lines)


def _energy_fits(study: Study) -> str:
    """Sound and heat where they are coupled, in the units of the scene."""
    header = ["kh", "c_S(k)", "theory", "gamma(k)", "theory", "sound/k^2", "theory"]
    header += ["heat/k^2", "theory", "q(k)/k^2", "theory"]
    lines = [header]
    for shell in study.shells:
        placed, fit, square = shell.prediction, shell.fit, shell.wave_number**2
        assert isinstance(placed, EnergyWavePrediction)
        assert isinstance(fit, EnergyWave)
        lines.append(
            [
                f"{shell.wave_number * study.scene.support_radius:.2f}",
                _shown(fit.adiabatic_speed),
                f"{placed.adiabatic_speed:.4g}",
                _shown(fit.heat_ratio),
                f"{placed.heat_ratio:.4g}",
                _shown(fit.sound_rate),
                f"{placed.system.sound_rate / square:.4g}",
                _shown(fit.heat_rate),
                f"{placed.system.heat_rate / square:.4g}",
                _shown(fit.conduction),
                f"{placed.conduction / square:.4g}",
            ]
        )
    return _columns(lines)


def _columns(lines: list[list[str]]) -> str:
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    rows = ["  ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) for line in lines]
    return "\n".join([rows[0], "-" * len(rows[0]), *rows[1:]])


def _shown(estimate: Estimate) -> str:
    return f"{estimate.value:.4g} ± {estimate.stderr:.2g}"


def _notes(study: Study) -> str:
    about = (
        "Theory: linearised hydrodynamics. Its friction is that among the particles where they are "
        "(in place): the exact rates at which the pairs begin to damp a wave, sampled in the "
        "runs, less what the time step takes. What is fitted beyond that comes from the motion of "
        "the particles and the forces between them. Continuum, lattice: the same rates by "
        "integrals, and on a lattice at rest. c(k)^2 = kT/(m S(k)) with S(k) of the random-phase "
        "approximation (RPA)."
    )
    if study.scene.active_effects.energy:
        about += (
            " Sound and heat are coupled: c(k) is the isothermal speed, c_S(k) the adiabatic "
            "one, gamma(k) the square of their ratio; heat/k^2 and sound/k^2 are the decays of "
            "the modes (chi and Gamma of long waves), q(k)/k^2 the diffusivity at constant "
            "density. Theory of q: conduction and friction in place, and half of the particles' "
            "short-time diffusion."
        )
    terms = (
        "SE: one standard error, from the blocks. z: distance from theory in SE. Sees: the "
        "smallest fault, relative to theory (to the value at zero for functions), that fails "
        "here: beyond the stated accuracy of theory. Functions are normalised."
    )
    return "\n".join(textwrap.fill(part, 100) for part in (about, terms))


def _verdict(study: Study) -> str:
    failed = [
        f"{item.group}: {item.name}"
        for item, agreed in zip(study.items, study.agreed, strict=True)
        if not agreed
    ]
    if failed:
        return "\n".join(["FAIL:", *(f"  {line}" for line in failed)])
    exact = sum(item.exact for item in study.items)
    text = (
        f"PASS: {len(study.items)} quantities agree, {exact} of them predicted exactly; fails "
        f"beyond {threshold(study):.1f} SE (Student t with {study.blocks - 1} degrees of freedom, "
        f"{LEVEL:.0%} for the whole family by Bonferroni)."
    )
    return textwrap.fill(text, 100)
