"""What theory expects of a scene's viscosity."""

from __future__ import annotations

from functools import lru_cache

from sdpd.scene import Scene
from sdpd.theory import DensityTheory, FrictionTheory, ViscosityTheory

__all__ = ["friction_theory", "viscosity_theory"]


def friction_theory(scene: Scene) -> FrictionTheory:
    """Friction as the scene uses it: divided by the lattice factor where it is calibrated.

    Of a fluid with an energy less the share of the fluctuating temperatures, kB/(2 C).
    """
    active = scene.active_effects
    kept = 1.0 - 0.5 / scene.heat_capacity_number if active.energy else 1.0
    return FrictionTheory(
        kernel=scene.resolution.kernel,
        dimension=scene.dimension,
        support=scene.support_radius,
        density=scene.fluid.density,
        shear_viscosity=kept * scene.fluid.shear_viscosity / scene.calibration,
        bulk_viscosity=0.0
        if active.central_friction
        else kept * active.effective_bulk_viscosity / scene.calibration,
        central=active.central_friction,
    )


def viscosity_theory(scene: Scene, dt: float) -> ViscosityTheory:
    """Mean-field viscosity of a scene at a time step of the pair splitting [time].

    Raises
    ------
    ValueError
        Beyond the pairing limit, where the approximation does not exist.
    """
    density = DensityTheory(
        kernel=scene.resolution.kernel,
        dimension=scene.dimension,
        support=scene.support_radius,
        number_density=scene.n_particles / scene.box.volume,
        stiffness=scene.stiffness,
        compressibility_factor=scene.pressure_number,
    )
    return _theory(density, friction_theory(scene), scene.thermal_energy, dt)


@lru_cache(maxsize=8)
def _theory(
    density: DensityTheory, friction: FrictionTheory, energy: float, dt: float
) -> ViscosityTheory:
    """The same object for the same fluid: its tables take a while."""
    return ViscosityTheory(density=density, friction=friction, thermal_energy=energy, time_step=dt)
