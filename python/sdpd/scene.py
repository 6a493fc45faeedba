"""The scene: a physical situation as plain data, validated at once."""

from __future__ import annotations

import dataclasses
import math
import os
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from sdpd import kernels, running, timestep, validation
from sdpd.box import AXES, Box
from sdpd.effect_rules import LEAST_CAPACITY
from sdpd.effects import BodyForce, Effects, SinusoidalForce, UniformForce
from sdpd.errors import PairingWarning, RegimeWarning, ResolutionWarning
from sdpd.fluids import Fluid
from sdpd.initial import LatticeStart, RandomStart, Start
from sdpd.quantities import SceneQuantities
from sdpd.resolution import Resolution
from sdpd.wall_heat import HeatFlux, Isothermal
from sdpd.wall_models import MODELS, SymmetricImages, WallModel
from sdpd.walls import ShapedWall, Wall

if TYPE_CHECKING:
    from sdpd._core import WallField
    from sdpd.accuracy.advice import AccuracyCost
    from sdpd.cost import Cost
    from sdpd.integrators import Integrator
    from sdpd.regime import Regime

__all__ = ["Scene"]

# Beyond these a lattice of particles is no longer the fluid that was asked for.
_DENSITY_ERROR = 0.05  # of d/n
_LEAST_VISCOSITY = 0.8  # eta_eff/eta, warned of
_LEAST_CALIBRATED = 0.5  # eta_eff/eta that may be divided out
_CURVATURE = 0.2  # h/R, warned of beyond
_LEAST_CAPACITY = 4.0  # C/k_B of a particle, warned of below
_FIELD = 9  # place of the number of its field among the numbers of a wall of any shape
_WELL_RESOLVED = 6.0  # h/dx from which all factors are 1 to a few per mille


def _beyond_double_precision(what: str) -> ValueError:
    return ValueError(
        "`fluid`, `box` and `resolution` must give scales within double precision, got "
        f"{what}; choose other units"
    )


@dataclass(frozen=True, kw_only=True)
class Scene(SceneQuantities):
    """A fluid in a box at a resolution, and what happens in it.

    Parameters
    ----------
    fluid : Fluid
        Of the dimension of the box; see `Fluid.in_plane` for two.
    box : Box
    resolution : Resolution
    start : LatticeStart or RandomStart
        Initial state.
    effects : Effects or "auto"
        Overrides of what is switched on; "auto" leaves it to the dimensionless numbers, as
        ``Effects(auto=True)``.
    body_force : UniformForce or SinusoidalForce, optional
    sound_speed : float, optional
        c [length/time] to be used; by the rule of `Scene.sound` if None.
    velocity_scale : float, optional
        V0 [length/time], speed of the flow; that of the steady shear wave under a sinusoidal force.
    length_scale : float, optional
        L0 [length]; the wavelength of a sinusoidal force, else the shortest edge of the box.
    calibrate : bool
        Divide the friction by the lattice factor eta_eff/eta of kernel and support, so that the
        fluid of particles delivers the asked viscosity, and likewise the conductivity by its own.
        (Friction rate and self-diffusion have another factor and cannot be right at once.) Refused
        where that factor is below 0.5.
    walls : sequence of Plane, Cylinder, Sphere, Polyline, Mesh or LevelSet
        They must close every axis along which the box is not periodic, and be one support apart
        or meet at right angles. Edges at any angle and narrow gaps belong into one Polyline, Mesh
        or LevelSet.
    wall_model : SymmetricImages, OwnFootImages, Completion or FrozenParticles
        How all of them act on the particles; the others are for comparison.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Warns
    -----
    PairingWarning
        If kernel, stiffness and equation of state let particles clump.
    RegimeWarning
        If an effect is off that the dimensionless numbers clearly call for (of noise: only where
        the effects are "auto"), or, where they are, set on without being called for.
    ResolutionWarning
        If, on a lattice, the density is off by more than 5 % or the delivered viscosity is below
        0.8 of the asked one; if the wave of a sinusoidal force is shorter than two supports; if the
        support is longer than a fifth of a wall's radius.

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
    walls: tuple[Wall, ...] = ()
    wall_model: WallModel = field(default_factory=SymmetricImages)

    def __post_init__(self) -> None:
        validation.instance("fluid", self.fluid, Fluid, "an sdpd.Fluid, e.g. sdpd.fluids.water()")
        validation.instance("box", self.box, Box, "an sdpd.Box")
        validation.instance("resolution", self.resolution, Resolution, "an sdpd.Resolution")
        expected = "an sdpd.LatticeStart or sdpd.RandomStart"
        validation.instance("start", self.start, (LatticeStart, RandomStart), expected)
        if isinstance(self.effects, str):
            if self.effects != "auto":
                raise ValueError(
                    "`effects` must be 'auto' or an sdpd.Effects (in a file a table), got "
                    f"{self.effects!r}"
                )
            object.__setattr__(self, "effects", Effects(auto=True))
        validation.instance("effects", self.effects, Effects, "an sdpd.Effects or 'auto'")
        if self.body_force is not None:
            expected = "an sdpd.UniformForce or sdpd.SinusoidalForce"
            kinds = (UniformForce, SinusoidalForce)
            validation.instance("body_force", self.body_force, kinds, expected)
            self.body_force.check_dimension(self.box.dimension)
        for name in ("sound_speed", "length_scale"):
            value = validation.optional_positive(name, getattr(self, name))
            object.__setattr__(self, name, value)
        speed = validation.optional_non_negative("velocity_scale", self.velocity_scale)
        object.__setattr__(self, "velocity_scale", speed)
        object.__setattr__(self, "calibrate", validation.boolean("calibrate", self.calibrate))
        try:
            with np.errstate(all="ignore"):  # what overflows is refused as what it has become
                self._check()
        except (ZeroDivisionError, OverflowError):
            raise _beyond_double_precision("one beyond that") from None

    def _check(self) -> None:
        """Whether the parts go together."""
        self._check_dimension()
        self._check_walls()
        self._check_supports()
        self._check_wave()
        self._check_wall_images()
        self._check_wall_model()
        self._check_magnitudes()
        self._check_energy()
        self._check_factors()
        self._check_time_step()
        self._warn_of_pairing()
        self._warn_of_regime()

    def _check_dimension(self) -> None:
        given, needed = self.fluid.dimension, self.box.dimension
        if given is None or given == needed:
            return
        cure = "Fluid.in_plane(thickness) makes them those of a layer"
        if needed == 3:
            cure = "take the fluid before Fluid.in_plane(thickness)"
        raise ValueError(
            f"`fluid` must have the constants of {needed} dimensions, as many as the box has, got "
            f"{self.fluid.name!r} with those of {given}; {cure}"
        )

    def _check_walls(self) -> None:
        walls: Any = self.walls
        if isinstance(walls, Wall):
            walls = (walls,)
        if not isinstance(walls, Sequence) or isinstance(walls, str):
            kind = type(walls).__name__
            raise TypeError(f"`walls` must be a sequence of walls, got {kind}")
        object.__setattr__(self, "walls", tuple(walls))
        for index, wall in enumerate(self.walls):
            expected = "a wall, e.g. sdpd.Plane(axis='z', at=0.0)"
            validation.instance(f"walls[{index}]", wall, Wall, expected)
            wall.check(self.box, f"walls[{index}]")
            self._check_heat(wall, index)
        self.geometry.check_closed()

    def _check_heat(self, wall: Wall, index: int) -> None:
        name = f"walls[{index}].heat"
        wall.heat.check(self.box, name)
        if isinstance(wall.heat, HeatFlux) and math.isnan(self.geometry.area(index)):
            raise ValueError(
                f"`{name}` must not be a HeatFlux where the wall's area in the fluid is not known; "
                "use a Polyline, Mesh or LevelSet"
            )
        if getattr(wall.heat, "gradient", None) is None:
            return
        points = wall.points_on(self.box, max(self.box.lengths) / 50.0)
        found = wall.heat.temperature_at(points, self.fluid.temperature)
        coldest = int(found.argmin())
        if found[coldest] <= 0.0:
            place = ", ".join(f"{x:.4g}" for x in points[coldest])
            raise ValueError(
                f"`{name}` must be a temperature > 0 all along the wall, got "
                f"{found[coldest]:.4g} at ({place})"
            )

    def _check_wall_images(self) -> None:
        """What the core has to say of the walls, and what curved ones lose at this resolution."""
        if not self.walls:
            return
        from sdpd import _core

        h = self.support_radius
        # Those of any shape wait until there is a simulation: their fields take a while.
        simple = [wall for wall in self.walls if not isinstance(wall, ShapedWall)]
        _core.check_walls(
            list(self.box.lengths),
            support=h,
            periodic=self._periodicity(),
            walls=[wall.core(self.box) for wall in simple],
        )
        self._check_own_images()
        force = self.body_force
        if isinstance(force, SinusoidalForce) and force.along not in self.box.periodic_axes:
            raise ValueError(
                f"`body_force.along` must be a periodic axis ({self.box.periodic_axes!r}), got "
                f"{force.along!r}"
            )
        radii = [wall.radius_of_curvature for wall in self.walls]
        least = min((radius for radius in radii if radius is not None), default=math.inf)
        if h > _CURVATURE * least * (1.0 + 1e-9):
            warnings.warn(
                f"the support h = {h:.4g} is longer than a fifth of the radius of a wall, "
                f"{least:.4g}: the density at it is off by more than a few per mille; lower the "
                "spacing",
                ResolutionWarning,
                stacklevel=5,
            )

    def _check_wall_model(self) -> None:
        names = ", ".join(kind.__name__ for kind in MODELS.values())
        validation.instance("wall_model", self.wall_model, WallModel, f"one of sdpd.{names}")
        if not self.walls:
            return
        if self.active_effects.energy and self.wall_model != SymmetricImages():
            raise ValueError(
                "`wall_model` must be SymmetricImages where the fluid has an energy: the other "
                f"models know no heat, got {self.wall_model!r}"
            )
        self.wall_model.check(self)

    def _check_own_images(self) -> None:
        """Fluid inside a round wall must not reach its periodic image through the wall."""
        h = self.support_radius
        for index, wall in enumerate(self.walls):
            if isinstance(wall, ShapedWall) or getattr(wall, "fluid", "outside") == "outside":
                continue
            diameter = 2.0 * (wall.radius_of_curvature or 0.0)
            for axis, length in zip(AXES, self.box.lengths, strict=False):
                if axis not in self.box.periodic_axes or axis == getattr(wall, "axis", None):
                    continue
                if length - diameter < h * (1.0 - 1e-9):
                    raise ValueError(
                        f"`walls[{index}]` must leave a support, {h:.6g}, between its fluid and "
                        f"its periodic image along {axis}, got {length - diameter:.6g}; name only "
                        "the other axes in `periodic`"
                    )

    def _check_supports(self) -> None:
        needed = 2.0 * self.support_radius
        for axis, length in zip(AXES, self.box.lengths, strict=False):
            if axis not in self.box.periodic_axes:
                continue
            if length < needed * (1.0 - 1e-12):
                raise ValueError(
                    f"`box.lengths` must be >= two supports, 2h = {needed:.6g}, on every periodic "
                    f"axis, got {length:.6g} along {axis} (h = {self.resolution.support:g} x "
                    f"spacing {self.spacing:.6g}); enlarge the box, or lower the spacing or the "
                    f"support"
                )

    def _check_wave(self) -> None:
        force = self.body_force
        if not isinstance(force, SinusoidalForce) or not self.active_effects.body_force:
            return
        wave, spacing, support = self._wavelength(force), self.spacing, self.support_radius
        if wave < 2.0 * spacing * (1.0 - 1e-12):
            raise ValueError(
                "`body_force.wavenumber` must leave a wavelength >= two spacings, "
                f"{2.0 * spacing:.6g}, got {wave:.6g} with {force.wavenumber} waves along "
                f"{force.along}"
            )
        if wave < 2.0 * support * (1.0 - 1e-12):
            warnings.warn(
                f"the wavelength of `body_force`, {wave:.4g}, is shorter than two supports, "
                f"{2.0 * support:.4g}: the kernel smears it out, so that the flow that answers has "
                "neither the amplitude nor the viscosity of the continuum",
                ResolutionWarning,
                stacklevel=5,
            )

    def _check_magnitudes(self) -> None:
        """Refuse scales that double precision cannot hold."""
        mass, energy = self.particle_mass, self.thermal_energy
        scales = {
            "mass of a particle m": mass,
            "thermal energy k_B T": energy,
            "k_B T/m": energy / mass,
            "m k_B T": mass * energy,
            "h^(D+2)": self.support_radius ** (self.dimension + 2),
            "squared sound speed c^2": self.sound.speed**2,
            "m c^2": mass * self.sound.speed**2,
            "stiffness m c^2/(k_B T)": self.stiffness,
        }
        if self.active_effects.dissipation:
            scales["friction time tau"] = self.friction_time
            scales["self-diffusion k_B T tau/m"] = self.self_diffusion
        for name, value in scales.items():
            if not sys.float_info.min <= value < math.inf:
                raise _beyond_double_precision(f"{name} = {value:g}")
        if not math.isfinite(self.pressure_number):  # of any sign, and 0 as well
            raise _beyond_double_precision(f"P/(n k_B T) = {self.pressure_number:g}")

    def _check_time_step(self) -> None:
        """Every bound on the time step must be a number."""
        for bound in timestep.bounds(self):
            if not sys.float_info.min <= bound.value < math.inf:
                raise _beyond_double_precision(f"{bound.formula} = {bound.value:g} ({bound.name})")

    def _check_energy(self) -> None:
        """Heat capacity, and whether heat can pass the walls as they say."""
        active = self.active_effects
        if not active.energy:
            return
        law = self.fluid.equation_of_state
        law.check_range(self.fluid.density, self.temperature_range)
        capacity = self.least_heat_capacity_number
        if capacity <= LEAST_CAPACITY:
            raise ValueError(
                "`fluid.heat_capacity` must be above k_B a particle, got "
                f"{capacity:.3g} k_B: fewer and larger particles have more"
            )
        if capacity < _LEAST_CAPACITY:
            warnings.warn(
                f"a particle has a heat capacity of {capacity:.3g} k_B: its temperature fluctuates "
                f"by {capacity**-0.5:.0%}, more than equations for particles with a temperature "
                "stand for; take larger particles",
                ResolutionWarning,
                stacklevel=5,
            )
        for index, wall in enumerate(self.walls):
            own = isinstance(wall.heat, Isothermal) and wall.heat != Isothermal()
            if own and not active.conduction:
                raise ValueError(
                    f"`walls[{index}].heat` must not be a temperature without heat conduction, "
                    "which alone feels it: give the fluid a thermal_conductivity"
                )

    def _check_factors(self) -> None:
        if self.resolution.support > _WELL_RESOLVED:
            return
        density, viscosity = self.factors.density, self.factors.viscosity
        viscous = self.active_effects.dissipation
        if viscous and self.calibrate and viscosity < _LEAST_CALIBRATED:
            raise ValueError(
                f"`calibrate` must be False where eta_eff/eta < {_LEAST_CALIBRATED:g}: kernel "
                f"{self.resolution.kernel!r} with support {self.resolution.support:g} delivers "
                f"{viscosity:.3g} of the viscosity; use a larger support"
            )
        found = []
        if abs(density - 1.0) > _DENSITY_ERROR:
            found.append(f"d/n = {density:.4g} (density)")
        if viscous and viscosity < _LEAST_VISCOSITY:
            found.append(f"eta_eff/eta = {viscosity:.4g} (viscosity)")
        if found:
            warnings.warn(
                f"too few neighbours: kernel {self.resolution.kernel!r} with support "
                f"{self.resolution.support:g} has {' and '.join(found)} on a lattice, 1 being "
                "right; use a larger support or another kernel",
                ResolutionWarning,
                stacklevel=5,
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
            stacklevel=5,
        )

    def _warn_of_regime(self) -> None:
        from sdpd.decisions import contradictions

        for text in contradictions(self):
            warnings.warn(text, RegimeWarning, stacklevel=5)

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
            "flow_speed": self.flow_speed or 0.0,
            **self.wall_arguments(),
            **self.model_arguments(),
            **self._thermal_arguments(),
        }

    def _thermal_arguments(self) -> dict[str, Any]:
        """What the core wants of a fluid with an energy; nothing else."""
        active, fluid = self.active_effects, self.fluid
        if not active.energy:
            return {}
        variable = active.variable_transport
        thermal = {
            "eos": self.caloric,
            "boltzmann_constant": fluid.boltzmann_constant,
            "conductivity": self.conductivity if active.conduction else 0.0,
            "exponents": [
                fluid.viscosity_exponent if variable else 0.0,
                fluid.conductivity_exponent if variable else 0.0,
            ],
            "reference_temperature": fluid.temperature,
            "walls": [
                wall.heat.core(fluid.temperature, self.geometry.area(index), self.dimension)
                for index, wall in enumerate(self.walls)
            ],
        }
        return {"exchanges": active.exchanges, "thermal": thermal}

    def wall_arguments(self) -> dict[str, Any]:
        """Periodic axes and walls as keyword arguments of the core; none without walls."""
        if not self.walls:
            return {}
        walls, fields = [], 0
        for wall in self.walls:
            kind, numbers = wall.core(self.box)
            if isinstance(wall, ShapedWall):
                numbers[_FIELD], fields = float(fields), fields + 1
            walls.append((kind, numbers))
        return {"periodic": self._periodicity(), "walls": walls, **self.field_arguments()}

    def model_arguments(self) -> dict[str, Any]:
        """The model of the walls as keyword arguments of the core; none for symmetric images."""
        return self.wall_model.arguments(self) if self.walls else {}

    def _periodicity(self) -> list[bool]:
        return [axis in self.box.periodic_axes for axis in AXES[: self.dimension]]

    def field_arguments(self) -> dict[str, Any]:
        """Fields of the walls of any shape as a keyword argument of the core; none without them.

        Warns
        -----
        ResolutionWarning
            If such a wall is thinner than a support, or coarser than half of one.
        """
        return {"fields": self._fields} if self._fields else {}

    @cached_property
    def _fields(self) -> list[WallField]:
        return [
            wall.field(
                self.box,
                self.support_radius,
                self.resolution.kernel,
                name=f"walls[{index}]",
                threads=running.available_threads(),
            )
            for index, wall in enumerate(self.walls)
            if isinstance(wall, ShapedWall)
        ]

    def regime(self, integrator: Integrator | str | None = None) -> Regime:
        """Dimensionless numbers of the scene, each with what it means here."""
        from sdpd.regime import regime

        return regime(self, integrator)

    @overload
    def cost(
        self,
        integrator: Integrator | str | None = None,
        *,
        error: None = None,
        precision: str | None = None,
        **accuracy: Any,
    ) -> Cost: ...

    @overload
    def cost(
        self,
        integrator: Integrator | str | None = None,
        *,
        error: float,
        precision: str | None = None,
        **accuracy: Any,
    ) -> AccuracyCost: ...

    def cost(
        self,
        integrator: Integrator | str | None = None,
        *,
        error: float | None = None,
        precision: str | None = None,
        **accuracy: Any,
    ) -> Cost | AccuracyCost:
        """What a scene costs as it is, or the cheapest settings for an error and what they cost.

        Parameters
        ----------
        integrator : Integrator or str, optional
            The default if None; with `error` the cheapest.
        error : float, optional
            Relative error asked for [1].
        precision : {"double", "mixed"}, optional
            Of what happens between two particles; double if None, with `error` the cheaper one.
        **accuracy
            As in `timestep.bounds`; with `error` also `quantity`, `time`, `measure` and `refresh`
            of `accuracy.advise`.

        Returns
        -------
        Cost or AccuracyCost
            Memory, pairs and every bound on the time step; with `error` settings, bias and sampling
            error, length and seconds with their uncertainty.
        """
        from sdpd.cost import cost

        if error is None:
            return cost(self, integrator, precision, **accuracy)
        from sdpd.accuracy.advice import advise

        return advise(self, error, integrator=integrator, precision=precision, **accuracy)

    def replace(self, **changes: Any) -> Scene:
        """A copy with some arguments changed."""
        return dataclasses.replace(self, **changes)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """TOML text of the scene, also written to `path` if one is given.

        Raises
        ------
        TypeError
            If a part of it is of a class of your own, which no file can name.
        """
        from sdpd.toml_io import scene_to_toml

        return scene_to_toml(self, path)

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Scene:
        """A scene from TOML text, or from the file of a path object or of a name ending in .toml.

        Raises
        ------
        TypeError, ValueError
            Naming the key.

        Notes
        -----
        ``fluid.preset`` names a ready-made fluid; with ``fluid.thickness`` it is that of a plane.
        """
        from sdpd.toml_io import scene_from_toml

        return scene_from_toml(cls, source)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def __str__(self) -> str:
        from sdpd.summary import summary

        return summary(self)
