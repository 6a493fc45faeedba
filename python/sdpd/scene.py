"""The scene: a physical situation as plain data, validated at once."""

from __future__ import annotations

import dataclasses
import math
import os
import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sdpd import kernels, validation
from sdpd.box import AXES, Box
from sdpd.effects import BodyForce, Effects
from sdpd.errors import PairingWarning
from sdpd.fluids import Fluid
from sdpd.initial import LatticeStart, Start
from sdpd.quantities import SceneQuantities
from sdpd.resolution import Resolution

if TYPE_CHECKING:
    from sdpd.cost import Cost
    from sdpd.integrators import Integrator
    from sdpd.regime import Regime

__all__ = ["Scene"]


@dataclass(frozen=True, kw_only=True)
class Scene(SceneQuantities):
    """A fluid in a box at a resolution, and what happens in it.

    Parameters
    ----------
    fluid : Fluid
    box : Box
    resolution : Resolution
    start : LatticeStart or RandomStart
        Initial state.
    effects : Effects
        Overrides of what is switched on.
    body_force : UniformForce or SinusoidalForce, optional
    sound_speed : float, optional
        c [length/time] to be used; by the rule of `Scene.sound` if None.
    velocity_scale : float, optional
        V0 [length/time], speed of the flow; that of the steady shear wave under a sinusoidal force.
    length_scale : float, optional
        L0 [length]; the wavelength of a sinusoidal force, else the shortest edge of the box.
    calibrate : bool
        Divide the friction by the lattice factor eta_eff/eta of kernel and support, so that the
        fluid of particles delivers the asked viscosity. (Friction rate and self-diffusion have
        another factor and cannot be right at once.)

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Warns
    -----
    PairingWarning
        If kernel, stiffness and equation of state let particles clump.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(temperature=300.0),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=3375),
    ... )
    >>> scene.n_particles, round(scene.stiffness)
    (3375, 100)
    """

    fluid: Fluid
    box: Box
    resolution: Resolution
    start: Start = field(default_factory=LatticeStart)
    effects: Effects = field(default_factory=Effects)
    body_force: BodyForce | None = None
    sound_speed: float | None = None
    velocity_scale: float | None = None
    length_scale: float | None = None
    calibrate: bool = False

    def __post_init__(self) -> None:
        validation.instance("fluid", self.fluid, Fluid, "an sdpd.Fluid, e.g. sdpd.fluids.water()")
        validation.instance("box", self.box, Box, "an sdpd.Box")
        validation.instance("resolution", self.resolution, Resolution, "an sdpd.Resolution")
        expected = "an sdpd.LatticeStart or sdpd.RandomStart"
        validation.instance("start", self.start, Start, expected)
        validation.instance("effects", self.effects, Effects, "an sdpd.Effects")
        if self.body_force is not None:
            expected = "an sdpd.UniformForce or sdpd.SinusoidalForce"
            validation.instance("body_force", self.body_force, BodyForce, expected)
            self.body_force.check_dimension(self.box.dimension)
        for name in ("sound_speed", "length_scale"):
            value = validation.optional_positive(name, getattr(self, name))
            object.__setattr__(self, name, value)
        speed = validation.optional_non_negative("velocity_scale", self.velocity_scale)
        object.__setattr__(self, "velocity_scale", speed)
        object.__setattr__(self, "calibrate", validation.boolean("calibrate", self.calibrate))
        self._check_supports()
        _ = self.active_effects, self.sound
        self._warn_of_pairing()

    def _check_supports(self) -> None:
        needed = 2.0 * self.support_radius
        for axis, length in zip(AXES, self.box.lengths, strict=False):
            if length < needed * (1.0 - 1e-12):
                raise ValueError(
                    f"`box.lengths` must be >= two supports, 2h = {needed:.6g}, on every periodic "
                    f"axis, got {length:.6g} along {axis} (h = {self.resolution.support:g} x "
                    f"spacing {self.spacing:.6g}); enlarge the box, or lower the spacing or the "
                    f"support"
                )

    def _warn_of_pairing(self) -> None:
        if not (self.starts_thermal or self.active_effects.fluctuations):
            return
        susceptibility, kh = self.pairing
        if susceptibility <= 1.0:
            return
        limit = self.stiffness / susceptibility
        name = self.resolution.kernel
        negative = kernels.KERNELS[name].pairing_limit[self.dimension - 2] < math.inf
        if negative and self.pressure_number > 0.0:
            cause = f"its Fourier transform is negative near k h = {kh:.3g}"
            cure = (
                "use kernel='wendland_c2' or 'wendland_c4', a lower sound speed, or "
                "sdpd.eos.ArtificialCompressibility()"
            )
        else:
            cause = "the pressure at the mean density is negative"
            cure = "use a background pressure or another equation of state"
        warnings.warn(
            f"particles will clump: kernel {name!r} with {self.fluid.equation_of_state.formula} at "
            f"X = m c^2/(k_B T) = {self.stiffness:.4g} is beyond its limit X = {limit:.4g} "
            f"({cause}); {cure}",
            PairingWarning,
            stacklevel=4,
        )

    def core_arguments(self) -> dict[str, Any]:
        """Physics of the scene as keyword arguments of the compiled core.

        Without the state, integrator, noise variate, step, seed and threads, which are the
        simulation's.
        """
        active = self.active_effects
        force = self.body_force if active.body_force else None
        friction = "central" if active.central_friction else "general"
        return {
            "box": self.box.lengths,
            "support": self.support_radius,
            "mass": self.particle_mass,
            "thermal_energy": self.thermal_energy,
            "kernel": self.resolution.kernel,
            "friction": friction if active.dissipation else "none",
            "friction_across": self.friction_across,
            "friction_along": self.friction_along,
            "eos": self.fluid.equation_of_state.core(self.fluid.density, self.sound.speed),
            "body_force": None if force is None else force.core(self.dimension),
        }

    def regime(self, integrator: Integrator | str | None = None) -> Regime:
        """Dimensionless numbers of the scene, each with what it means here."""
        from sdpd.regime import regime

        return regime(self, integrator)

    def cost(self, integrator: Integrator | str | None = None, **accuracy: Any) -> Cost:
        """Memory, pairs and every bound on the time step; `accuracy` as in `timestep.bounds`."""
        from sdpd.cost import cost

        return cost(self, integrator, **accuracy)

    def replace(self, **changes: Any) -> Scene:
        """A copy with some arguments changed."""
        return dataclasses.replace(self, **changes)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """TOML text of the scene, also written to `path` if one is given."""
        from sdpd.toml_io import scene_to_toml

        return scene_to_toml(self, path)

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Scene:
        """A scene from TOML text, or from the file of a path object or of a name ending in .toml.

        Raises
        ------
        TypeError, ValueError
            Naming the key.
        """
        from sdpd.toml_io import scene_from_toml

        return scene_from_toml(cls, source)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def __str__(self) -> str:
        from sdpd.summary import summary

        return summary(self)
