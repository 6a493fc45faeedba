"""The text that ``print(scene)`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdpd.units import quantity, table
from sdpd.wall_models import SymmetricImages

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["summary"]


def _particle_rows(scene: Scene) -> list[tuple[str, str]]:
    si, resolution = scene.fluid.is_si, scene.resolution
    lengths = " x ".join(f"{length:.4g}" for length in scene.box.lengths)
    spacing = quantity(scene.spacing, "m", si=si)
    mass = quantity(scene.particle_mass, "kg", si=si)
    support = quantity(scene.support_radius, "m", si=si)
    kernel = f"{resolution.kernel}, support {resolution.support:g} spacings = {support}"
    return [
        ("fluid", scene.fluid.describe(scene.dimension)),
        ("box", f"{lengths}{' m' if si else ''}, {_periodicity(scene)}"),
        *[("wall", str(wall)) for wall in scene.walls],
        *_model_rows(scene),
        ("particles", f"{scene.n_particles}, spacing {spacing}, mass {mass}"),
        ("kernel", f"{kernel}, {scene.pairs_per_particle:.0f} pairs a particle"),
        ("start", repr(scene.start)),
        ("effects", f"{scene.active_effects}{' (by the regime)' if scene.effects.auto else ''}"),
    ]


def _model_rows(scene: Scene) -> list[tuple[str, str]]:
    if not scene.walls or scene.wall_model == SymmetricImages():
        return []
    return [("wall model", repr(scene.wall_model))]


def _periodicity(scene: Scene) -> str:
    axes = scene.box.periodic_axes
    if len(axes) == scene.dimension:
        return "periodic"
    return f"periodic along {', '.join(axes)}" if axes else "closed"


def _friction_rows(scene: Scene) -> list[tuple[str, str]]:
    factors, si = scene.factors, scene.fluid.is_si
    tau = quantity(scene.friction_time, "s", si=si)
    numbers = f"eta* = {scene.reduced_viscosity:.4g}, Sc = {scene.schmidt_number:.4g}"
    viscosity = f"viscosity {factors.viscosity:.4f}{' divided out' if scene.calibrate else ''}"
    rest = f"friction rate {factors.friction:.3f} of the continuum (lattice)"
    return [
        ("friction", f"time tau {tau}, {numbers}"),
        ("discrete", f"density {factors.density:.4f}, {viscosity}, {rest}"),
    ]


def summary(scene: Scene) -> str:
    """A readable summary of a scene, with SI units if k_B has its SI value."""
    si = scene.fluid.is_si
    rows = _particle_rows(scene)
    thermal = quantity(scene.thermal_speed, "m/s", si=si)
    sound = f"{quantity(scene.sound.speed, 'm/s', si=si)} ({scene.sound.reason})"
    rows.append(("speeds", f"thermal {thermal}, sound {sound}, X = {scene.stiffness:.4g}"))
    if scene.active_effects.energy:
        adiabatic = scene.sound.speed * scene.adiabatic_ratio**0.5
        capacity = f"C = {scene.heat_capacity_number:.4g} k_B a particle"
        gamma = f"gamma = {scene.adiabatic_ratio:.4g}"
        fast = f"adiabatic sound {quantity(adiabatic, 'm/s', si=si)}"
        rows.append(("energy", f"{capacity}, {gamma}, {fast}"))
    deviation = scene.density_deviation
    if deviation is None:
        rows.append(("density", "particles clump: see regime()"))
    elif deviation > 0.0:
        rows.append(("density", f"rms fluctuation {deviation:.2%} (random-phase estimate)"))
    if scene.active_effects.dissipation:
        rows += _friction_rows(scene)
    if scene.body_force is not None:
        rows.append(("body force", repr(scene.body_force)))
    return "sdpd scene\n" + table([[f"  {name}", text] for name, text in rows])
