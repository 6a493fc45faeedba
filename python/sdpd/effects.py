"""What a scene calls for: derived from it, visible, overridable; absent effects cost nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sdpd import validation
from sdpd.box import AXES
from sdpd.fluids import Fluid

__all__ = ["ActiveEffects", "BodyForce", "Effects", "SinusoidalForce", "UniformForce"]


class BodyForce:
    """Base of the body forces: a force per unit mass [length/time^2] on every particle."""

    @property
    def peak(self) -> float:
        """Largest magnitude [length/time^2]."""
        raise NotImplementedError

    def core(self, dimension: int) -> tuple[list[float], tuple[int, int] | None]:
        """Amplitude, and axis and number of the waves (None: uniform), for the core."""
        raise NotImplementedError

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the force does not belong in that many dimensions."""
        raise NotImplementedError


@dataclass(frozen=True)
class UniformForce(BodyForce):
    """The same acceleration everywhere.

    In a periodic box the fluid as a whole accelerates without end: nothing balances the force.

    Parameters
    ----------
    acceleration : sequence of float, D of them
        [length/time^2].
    """

    acceleration: tuple[float, ...]

    def __post_init__(self) -> None:
        values = validation.vector("acceleration", self.acceleration)
        if len(values) not in (2, 3):
            raise ValueError(f"`acceleration` must have 2 or 3 entries, got {len(values)}")
        object.__setattr__(self, "acceleration", values)

    @property
    def peak(self) -> float:  # noqa: D102
        return float(sum(value**2 for value in self.acceleration) ** 0.5)

    def core(self, dimension: int) -> tuple[list[float], tuple[int, int] | None]:  # noqa: D102
        return list(self.acceleration), None

    def check_dimension(self, dimension: int) -> None:  # noqa: D102
        if len(self.acceleration) != dimension:
            raise ValueError(
                f"`acceleration` must have {dimension} entries, as many as the box has axes, "
                f"got {len(self.acceleration)}"
            )


@dataclass(frozen=True, kw_only=True)
class SinusoidalForce(BodyForce):
    """f = amplitude sin(2 pi n x_along / L_along) along `direction`: drives a shear wave.

    At rest on average, so a steady periodic shear flow answers it: the classical measurement of a
    viscosity (Backer et al., J. Chem. Phys. 122 (2005) 154503 use its square wave).

    Parameters
    ----------
    amplitude : float
        [length/time^2].
    direction : str
        Axis of the force: "x", "y" or "z".
    along : str
        Axis on which it varies.
    wavenumber : int
        n >= 1 waves in the box, each of two spacings at least; below two supports a scene warns.
    """

    amplitude: float
    direction: str = "x"
    along: str = "y"
    wavenumber: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", validation.finite("amplitude", self.amplitude))
        validation.choice("direction", self.direction, ("x", "y", "z"))
        validation.choice("along", self.along, ("x", "y", "z"))
        number = validation.integer("wavenumber", self.wavenumber, minimum=1, maximum=2**31 - 1)
        object.__setattr__(self, "wavenumber", number)

    @property
    def peak(self) -> float:  # noqa: D102
        return abs(self.amplitude)

    def core(self, dimension: int) -> tuple[list[float], tuple[int, int] | None]:  # noqa: D102
        amplitude = [self.amplitude if axis == self.direction else 0.0 for axis in AXES[:dimension]]
        return amplitude, (AXES.index(self.along), self.wavenumber)

    def check_dimension(self, dimension: int) -> None:  # noqa: D102
        axes = AXES[:dimension]
        for name, axis in (("direction", self.direction), ("along", self.along)):
            if axis not in axes:
                raise ValueError(f"`{name}` must be an axis of the box ({axes!r}), got {axis!r}")


_THERMAL = ("viscous_heating", "conduction", "variable_transport")
_OPTIONAL = ("fluctuations", "dissipation", "bulk_viscosity", "body_force", "energy", *_THERMAL)


@dataclass(frozen=True, kw_only=True)
class Effects:
    """What is switched on. None derives it from the scene; True or False overrides.

    Parameters
    ----------
    auto : bool
        None leaves it to the regime instead: of what fluid and walls offer, that is on whose
        dimensionless number says that it matters (docs/guide/effects); `Scene.regime` tells the
        reasons. ``effects="auto"`` of a scene is this alone.
    fluctuations : bool, optional
        Thermal noise. Derived: on where there is dissipation.
    dissipation : bool, optional
        Viscous friction between particles. Derived: on if a viscosity is > 0.
    bulk_viscosity : bool, optional
        Derived: on if the fluid has one.
    body_force : bool, optional
        Derived: on if the scene has one.
    energy : bool, optional
        Particles have an internal energy, a temperature and an entropy. Derived: on if heat passes
        a wall in a way of its own (`sdpd.Isothermal(T)`, `Adiabatic`, `HeatFlux`). The equation of
        state becomes a caloric one with the heat capacity of the fluid.
    viscous_heating : bool, optional
        Friction heats, and its noise takes from the energies what it gives. Off: friction acts
        against a bath of the local temperature, which suits heat capacities of many k_B only (the
        energies then change by the work of the pressure alone, and drift). Derived: on with energy
        and dissipation.
    conduction : bool, optional
        Heat conduction, with its noise. Derived: on with energy if the fluid has a conductivity.
    variable_transport : bool, optional
        Viscosities and conductivity follow the temperature. Derived: on with energy if the fluid
        has exponents for it.
    central_friction : bool
        The friction along the line of centres only, which conserves angular momentum and fixes the
        bulk viscosity at eta (1 + 2/D).
    """

    fluctuations: bool | None = None
    dissipation: bool | None = None
    bulk_viscosity: bool | None = None
    body_force: bool | None = None
    energy: bool | None = None
    viscous_heating: bool | None = None
    conduction: bool | None = None
    variable_transport: bool | None = None
    central_friction: bool = False
    auto: bool = False

    def __post_init__(self) -> None:
        for name in _OPTIONAL:
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, validation.boolean(f"effects.{name}", value))
        central = validation.boolean("effects.central_friction", self.central_friction)
        object.__setattr__(self, "central_friction", central)
        object.__setattr__(self, "auto", validation.boolean("effects.auto", self.auto))

    def resolve(
        self, fluid: Fluid, dimension: int, body_force: BodyForce | None, *, heated: bool = False
    ) -> ActiveEffects:
        """The effects that act where none is left to the regime.

        `heated`: heat passes a wall in a way of its own.

        Raises
        ------
        ValueError
            If an override contradicts the scene.
        """
        limit = fluid.shear_viscosity * (1.0 + 2.0 / dimension)
        viscous = fluid.shear_viscosity > 0.0 or fluid.bulk_viscosity > 0.0
        dissipation = viscous if self.dissipation is None else self.dissipation
        if dissipation and not viscous:
            raise ValueError("`effects.dissipation` must be False as the fluid has no viscosity")
        thermal = self._thermal(fluid, dissipation, heated)
        dissipative = dissipation or thermal["conduction"]
        fluctuations = dissipative if self.fluctuations is None else self.fluctuations
        if fluctuations and not dissipative:
            raise ValueError(
                "`effects.fluctuations` must be False without dissipation: the noise balances the "
                "friction"
            )
        if self.central_friction:
            bulk, zeta = self._central(fluid, limit)
        else:
            has_bulk = fluid.bulk_viscosity > 0.0
            bulk = has_bulk if self.bulk_viscosity is None else self.bulk_viscosity
            if bulk and not has_bulk:
                raise ValueError(
                    "`effects.bulk_viscosity` must be False as `fluid.bulk_viscosity` is 0"
                )
            zeta = fluid.bulk_viscosity if bulk else 0.0
            if dissipation and zeta > limit * (1.0 + 1e-12):
                raise ValueError(
                    f"`fluid.bulk_viscosity` must be <= eta (1 + 2/D) = {limit:.6g} (so that a >= "
                    f"0 and the noise exists), got {zeta:.6g}; lower it or set "
                    f"effects=sdpd.Effects(bulk_viscosity=False)"
                )
        force = body_force is not None if self.body_force is None else self.body_force
        if force and body_force is None:
            raise ValueError("`effects.body_force` must be False as the scene has no body force")
        return ActiveEffects(
            fluctuations=fluctuations,
            dissipation=dissipation,
            bulk_viscosity=bulk and dissipation,
            body_force=force,
            central_friction=self.central_friction and dissipation,
            effective_bulk_viscosity=min(zeta, limit) if dissipation else 0.0,
            **thermal,
        )

    def _thermal(self, fluid: Fluid, dissipation: bool, heated: bool) -> dict[str, bool]:
        """Energy, heating, conduction and variable transport."""
        energy = heated if self.energy is None else self.energy
        if not energy:
            if heated:
                raise ValueError(
                    "`effects.energy` must not be False where walls have a temperature or a heat "
                    "flux of their own"
                )
            for name in _THERMAL:
                if getattr(self, name):
                    raise ValueError(f"`effects.{name}` must not be True without energy")
            return dict.fromkeys(("energy", *_THERMAL, "variable_heat_capacity"), False)
        if fluid.heat_capacity is None:
            raise ValueError("`effects.energy` must be False as `fluid.heat_capacity` is None")
        heating = dissipation if self.viscous_heating is None else self.viscous_heating
        if heating and not dissipation:
            raise ValueError("`effects.viscous_heating` must be False without dissipation")
        conductive = fluid.thermal_conductivity is not None
        conduction = conductive if self.conduction is None else self.conduction
        if conduction and not conductive:
            raise ValueError(
                "`effects.conduction` must be False as `fluid.thermal_conductivity` is None"
            )
        follows = conduction and (heating or not dissipation)
        varies = (heating and fluid.viscosity_exponent != 0.0) or (
            follows and fluid.conductivity_exponent != 0.0
        )
        variable = varies if self.variable_transport is None else self.variable_transport
        if variable and not varies:
            raise ValueError(
                "`effects.variable_transport` must be False as no exponent of the fluid is other "
                "than 0 (where there is friction it needs viscous heating, too)"
            )
        return {
            "energy": True,
            "viscous_heating": heating,
            "conduction": conduction,
            "variable_transport": variable,
            "variable_heat_capacity": not fluid.equation_of_state.constant_heat_capacity,
        }

    def _central(self, fluid: Fluid, limit: float) -> tuple[bool, float]:
        if self.bulk_viscosity is False:
            raise ValueError(
                "`effects.bulk_viscosity` must not be False with central_friction, which implies a "
                f"bulk viscosity eta (1 + 2/D) = {limit:.6g}"
            )
        given = fluid.bulk_viscosity
        if given > 0.0 and abs(given - limit) > 1e-6 * limit:
            raise ValueError(
                f"`fluid.bulk_viscosity` must be 0 or eta (1 + 2/D) = {limit:.6g} with "
                f"central_friction, which fixes it, got {given:.6g}"
            )
        return True, limit


@dataclass(frozen=True, kw_only=True)
class ActiveEffects:
    """The effects of a scene after derivation; see `Effects`.

    Attributes
    ----------
    effective_bulk_viscosity : float
        zeta that acts [as eta].
    variable_heat_capacity : bool
        Whether the heat capacity follows temperature and density, as the equation of state says.
    """

    fluctuations: bool
    dissipation: bool
    bulk_viscosity: bool
    body_force: bool
    central_friction: bool
    effective_bulk_viscosity: float
    energy: bool = False
    viscous_heating: bool = False
    conduction: bool = False
    variable_transport: bool = False
    variable_heat_capacity: bool = False

    def settings(self) -> Effects:
        """Effects that set each of these, so that nothing is left to derive."""
        thermal: dict[str, Any] = {
            name: getattr(self, name) if self.energy else None for name in _THERMAL
        }
        return Effects(
            fluctuations=self.fluctuations,
            dissipation=self.dissipation,
            bulk_viscosity=None if self.central_friction else self.bulk_viscosity,
            body_force=self.body_force,
            energy=self.energy,
            central_friction=self.central_friction,
            **thermal,
        )

    @property
    def exchanges(self) -> str:
        """What exchanges energy, as the core names it; "none" for an isothermal fluid."""
        if not self.energy:
            return "none"
        kind = "_variable" if self.variable_transport else ""
        if self.variable_heat_capacity:
            kind = "_general"
        if not self.dissipation:
            return f"conduction{kind}" if self.conduction else "adiabatic"
        if not self.viscous_heating:
            bath = "_general" if self.variable_heat_capacity else ""
            return ("bath_conduction" if self.conduction else "bath") + bath
        return ("full" if self.conduction else "heating") + kind

    def __str__(self) -> str:
        names: tuple[str, ...] = (
            "fluctuations",
            "dissipation",
            "bulk_viscosity",
            "body_force",
            "central_friction",
        )
        names += ("energy", *_THERMAL) if self.energy else ("energy",)
        on = [name.replace("_", " ") for name in names if getattr(self, name)]
        off = [name.replace("_", " ") for name in names if not getattr(self, name)]
        return f"on: {', '.join(on) or 'none'}; off: {', '.join(off) or 'none'}"
