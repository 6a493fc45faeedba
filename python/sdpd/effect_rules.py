"""When an effect matters: the one table of dimensionless numbers and thresholds.

An effect is called for where any of its numbers reaches its threshold, and not where all of them
stay below; where one is not known and none of the others calls, nothing is decided. The thresholds
are orders of magnitude, argued for in docs/guide/effects.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sdpd.effects import Effects, SinusoidalForce
from sdpd.wall_heat import Adiabatic, HeatFlux, Isothermal
from sdpd.wall_models import SymmetricImages

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = [
    "CRITERIA",
    "LEAST_CAPACITY",
    "NO_ENERGY",
    "ORDER",
    "Criterion",
    "Numbers",
    "missing",
    "required",
]

# Each effect knows what was decided on those before it.
ORDER = (
    "fluctuations",
    "wall_heat",
    "energy",
    "variable_transport",
    "viscous_heating",
    "conduction",
    "bulk_viscosity",
)

NO_ENERGY = "no energy"
LEAST_CAPACITY = 1.0  # C/k_B of a particle, which a scene with an energy has to exceed


class Numbers:
    """Dimensionless numbers of a scene; None where it does not say enough.

    Parameters
    ----------
    scene : Scene
        Its own effects count where they are settled; a scene that leaves them to the regime is
        looked at as if it were isothermal.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = _isothermal(scene) if scene.effects.auto else scene
        self.dissipation = self._scene.active_effects.dissipation

    @property
    def speed(self) -> float | None:
        """V0 [length/time]."""
        return self._scene.flow_speed

    @property
    def capacity(self) -> float:
        """C/k_B of a particle."""
        return self._scene.heat_capacity_number

    @property
    def noise(self) -> float | None:
        """v_th/V0."""
        if self.speed is None:
            return None
        return self._scene.thermal_speed / self.speed if self.speed > 0.0 else math.inf

    @cached_property
    def wall_difference(self) -> float:
        """Largest difference between walls, or a wall, and the fluid, over T.

        Of a wall of given heat flux q: what drives q through the fluid, q L0/kappa, without
        bound where the fluid does not conduct.
        """
        scene, fluid = self._scene, self._scene.fluid
        found = [0.0]
        for wall in scene.walls:
            if isinstance(wall.heat, HeatFlux) and wall.heat.density != 0.0:
                resistance = scene.flow_length / (fluid.thermal_conductivity or math.nan)
                driven = wall.heat.density * resistance / fluid.temperature
                found.append(driven if math.isfinite(driven) else math.inf)
            elif isinstance(wall.heat, Isothermal) and wall.heat != Isothermal():
                points = wall.points_on(scene.box, max(scene.box.lengths) / 20.0)
                own = wall.heat.temperature_at(points, fluid.temperature)
                found += [float(t) / fluid.temperature - 1.0 for t in (own.min(), own.max())]
        return max(found) - min(found)

    @property
    def friction_heat(self) -> float | None:
        """eta V0^2/(8 kappa T): how much hotter friction makes a flow between walls, over T."""
        speed, fluid = self.speed, self._scene.fluid
        if speed is None or fluid.thermal_conductivity is None:
            return None
        heat = fluid.shear_viscosity * speed**2 if self.dissipation else 0.0
        return heat / (8.0 * fluid.thermal_conductivity * fluid.temperature)

    @property
    def compression_heat(self) -> float | None:
        """alpha V0^2/(2 c_v): how much hotter the pressure rho V0^2/2 makes the fluid, over T."""
        speed, fluid = self.speed, self._scene.fluid
        if speed is None or fluid.heat_capacity is None:
            return None
        alpha = fluid.equation_of_state.expansion(fluid)
        return abs(alpha) * speed**2 / (2.0 * fluid.heat_capacity)

    @property
    def differences(self) -> float | None:
        """Largest known relative difference of temperature; None if that is none for sure."""
        heats = (self.wall_difference, self.friction_heat, self.compression_heat)
        largest = max(heat for heat in heats if heat is not None)
        return largest if largest > 0.0 or None not in heats else None

    @property
    def coefficient_change(self) -> float | None:
        """|n| dT/T for the larger exponent n of viscosity and conductivity."""
        fluid, differences = self._scene.fluid, self.differences
        exponent = max(abs(fluid.viscosity_exponent), abs(fluid.conductivity_exponent))
        if differences is None or exponent == 0.0:
            return None if exponent else 0.0
        return exponent * differences

    @property
    def heating_share(self) -> float | None:
        """Differences of temperature by friction over all of them."""
        heat, differences = self.friction_heat, self.differences
        if heat is None or differences is None:
            return None
        return heat / differences if differences > 0.0 else 0.0

    @property
    def heat_spreading(self) -> float | None:
        """kappa/(rho c_v V0 L0), one over the Peclet number of heat."""
        scene, fluid = self._scene, self._scene.fluid
        speed, capacity = self.speed, fluid.heat_capacity
        if speed is None or capacity is None or fluid.thermal_conductivity is None:
            return None
        carried = fluid.density * capacity * speed * scene.flow_length
        return fluid.thermal_conductivity / carried if carried > 0.0 else math.inf

    @property
    def bulk_stress(self) -> float | None:
        """(zeta/eta) Ma^2, the stress of a flow that is nearly free of divergence.

        Ma is that of the fluid where its speed of sound is known: the scene may have a softer one.
        """
        fluid = self._scene.fluid
        if self.speed is None:
            return None
        if fluid.bulk_viscosity == 0.0 or fluid.shear_viscosity == 0.0:
            return math.inf if fluid.bulk_viscosity > 0.0 else 0.0
        mach = self.speed / (fluid.sound_speed or self._scene.sound.speed)
        return fluid.bulk_viscosity / fluid.shear_viscosity * mach**2

    def sound_damping(self, noise: bool) -> float:
        """Share of zeta in the damping of sound, where noise or a force along its wave makes it."""
        scene, fluid = self._scene, self._scene.fluid
        force = scene.body_force if scene.active_effects.body_force else None
        pushed = isinstance(force, SinusoidalForce) and force.along == force.direction
        if not (noise or pushed) or fluid.bulk_viscosity == 0.0:
            return 0.0
        shear = fluid.shear_viscosity * (2.0 - 2.0 / scene.dimension)
        return fluid.bulk_viscosity / (shear + fluid.bulk_viscosity)


def _isothermal(scene: Scene) -> Scene:
    """The scene as if it were isothermal, unchecked: what the numbers can be taken from."""
    bare = copy.copy(scene)  # its fields alone, nothing derived
    given = scene.effects
    plain = Effects(
        dissipation=given.dissipation,
        body_force=given.body_force,
        bulk_viscosity=None if given.central_friction else False,
        energy=False,
        central_friction=given.central_friction,
    )
    known = plain.resolve(scene.fluid, scene.dimension, scene.body_force)
    bare.__dict__["active_effects"] = known
    for name in ("geometry", "layout"):  # dear where walls have any shape
        if name in scene.__dict__:
            bare.__dict__[name] = scene.__dict__[name]
    return bare


On = Mapping[str, bool]


@dataclass(frozen=True)
class Criterion:
    """A number that calls for an effect where it reaches a threshold.

    Attributes
    ----------
    effect : str
    name, symbol : str
        Of the number.
    threshold : float
        [1].
    value : callable
        Of the numbers of a scene and of what was decided before; None where it is not known.
    changes_means : bool
        Whether means change without the effect, or fluctuations alone.
    """

    effect: str
    name: str
    symbol: str
    threshold: float
    value: Callable[[Numbers, On], float | None]
    changes_means: bool = True


_WALLS = ("temperature difference of walls / T", "dT_w/T")

CRITERIA = (
    Criterion(
        "fluctuations",
        "thermal speed / flow speed",
        "v_th/V0",
        0.01,
        lambda n, on: n.noise,
        changes_means=False,
    ),
    Criterion("wall_heat", *_WALLS, 1e-3, lambda n, on: n.wall_difference),
    Criterion("energy", *_WALLS, 1e-3, lambda n, on: n.wall_difference),
    Criterion("energy", "heating by friction / T", "dT/T", 1e-3, lambda n, on: n.friction_heat),
    Criterion(
        "energy", "heating by compression / T", "dT_c/T", 0.01, lambda n, on: n.compression_heat
    ),
    Criterion(
        "variable_transport",
        "exponent x temperature difference / T",
        "n dT/T",
        0.01,
        lambda n, on: n.coefficient_change,
    ),
    Criterion(
        "viscous_heating",
        "heating by friction / all differences",
        "dT/dT_max",
        0.01,
        lambda n, on: n.heating_share,
    ),
    Criterion(
        "conduction", "conducted / carried heat", "1/Pe_q", 1e-3, lambda n, on: n.heat_spreading
    ),
    Criterion(
        "bulk_viscosity",
        "bulk stress / shear stress",
        "(zeta/eta) Ma^2",
        0.01,
        lambda n, on: n.bulk_stress,
    ),
    Criterion(
        "bulk_viscosity",
        "share in the damping of sound",
        "G_zeta/G",
        0.01,
        lambda n, on: n.sound_damping(on["fluctuations"]),
        changes_means=False,
    ),
)


def missing(effect: str, scene: Scene, numbers: Numbers, on: On) -> str | None:
    """What the effect needs and the scene has not; None if nothing."""
    fluid, given = scene.fluid, scene.effects
    viscous = fluid.shear_viscosity > 0.0 or fluid.bulk_viscosity > 0.0
    friction = viscous and given.dissipation is not False
    if effect == "bulk_viscosity" and friction:
        some = fluid.bulk_viscosity > 0.0 or given.central_friction
        return None if some else "the fluid has none"
    if effect in ("fluctuations", "bulk_viscosity"):
        return None if friction else "no friction"
    if effect == "wall_heat":
        return None if scene.walls else "no walls"
    if effect == "energy":
        if fluid.heat_capacity is None:
            return "the fluid has no heat capacity"
        if given.auto and numbers.capacity <= LEAST_CAPACITY:
            return "a particle has a heat capacity of k_B at most"
        plain = not scene.walls or scene.wall_model == SymmetricImages()
        return None if plain else "the model of the walls knows no heat"
    if not on["energy"]:
        return NO_ENERGY
    if effect == "conduction":
        return None if fluid.thermal_conductivity is not None else "the fluid conducts no heat"
    if effect == "viscous_heating":
        return None if friction else "no friction"
    conducts = fluid.thermal_conductivity is not None and given.conduction is not False
    follows = (friction and fluid.viscosity_exponent != 0.0) or (
        conducts and fluid.conductivity_exponent != 0.0
    )
    if friction and given.viscous_heating is False:
        return "no viscous heating"
    return None if follows else "the coefficients do not follow the temperature"


def required(effect: str, scene: Scene, on: On) -> str | None:
    """Why the effect has to be on whatever its numbers; None if it need not."""
    adiabatic = any(isinstance(wall.heat, Adiabatic) for wall in scene.walls)
    if effect in ("wall_heat", "energy") and adiabatic:
        return "an adiabatic wall keeps what the flow heats"
    if effect == "energy":
        given = scene.effects
        parts = (given.viscous_heating, given.conduction, given.variable_transport)
        return "asked for by a part of it" if any(parts) else None
    if effect == "bulk_viscosity" and scene.effects.central_friction:
        return "the central form of the friction has one"
    if effect == "viscous_heating":
        if on["variable_transport"]:
            return "coefficients that follow the temperature need it"
        return "with noise energies drift without it" if on["fluctuations"] else None
    if effect == "conduction" and scene.walls:
        return "between walls heat crosses the flow by conduction alone"
    if effect == "conduction" and on["variable_transport"]:
        return "coefficients that follow the temperature need it"
    return None
