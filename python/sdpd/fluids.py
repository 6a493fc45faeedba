"""Fluids: constants of the continuum, each with its source.

All values in one consistent set of units, SI by default. In two dimensions a density is a mass per
area and a viscosity a mass per time.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sdpd import validation
from sdpd.equations_of_state import KINDS, ArtificialCompressibility, EquationOfState, IdealGas

__all__ = ["BOLTZMANN_CONSTANT", "Fluid", "argon", "nitrogen", "water"]

BOLTZMANN_CONSTANT = 1.380649e-23  # J/K, exact in the SI since 2019
_ATOMIC_MASS = 1.66053906660e-27  # kg, CODATA 2018
_OPTIONAL = (
    "sound_speed",
    "thermal_conductivity",
    "heat_capacity",
    "molecular_mass",
    "molecular_diameter",
    "mean_free_path",
)


@dataclass(frozen=True, kw_only=True)
class Fluid:
    """What the fluid is, apart from any particle.

    Parameters
    ----------
    density : float
        Mass density rho [mass/length^D].
    shear_viscosity : float
        eta [mass/(length^(D-2) time)], >= 0.
    bulk_viscosity : float
        zeta [as eta], >= 0. The particle model carries zeta <= eta (1 + 2/D) only (a >= 0); liquid
        water's (about 2.4e-3 Pa s, Holmes et al. 2011) lies beyond that.
    temperature : float
        T, so that boltzmann_constant * temperature is an energy.
    boltzmann_constant : float
        k_B [energy/temperature]; 1 in reduced units.
    sound_speed : float, optional
        True isothermal speed of sound [length/time]: the most a scene picks for itself. None: no
        such limit.
    thermal_conductivity : float, optional
        kappa; tells how strong viscous heating is.
    heat_capacity : float, optional
        c_v [energy/(mass temperature)]. An `sdpd.eos.EnergyTable` tells it itself.
    thermal_expansion : float
        alpha = -(1/rho) drho/dT at constant pressure [1/temperature]: how the pressure of a liquid
        with an energy goes with its temperature, dP/dT = alpha rho c^2. (Of an ideal gas it is 1/T
        by itself.)
    viscosity_exponent, conductivity_exponent : float
        n of eta, zeta ~ T^n and of kappa ~ T^n [1]; the values above are those at `temperature`.
        About 0.7 for gases (Y 4.1, 4.2).
    molecular_mass, molecular_diameter, mean_free_path : float, optional
        Of the molecules: tell where the continuum ends.
    equation_of_state : EquationOfState
        P(rho).
    dimension : int, optional
        2 or 3: the dimension D of the values above, which a scene compares with its box. The
        ready-made fluids have 3, `in_plane` makes it 2. None: not checked.
    name, source : str
        What it is and where its values come from.
    """

    density: float
    shear_viscosity: float
    bulk_viscosity: float = 0.0
    temperature: float
    boltzmann_constant: float = BOLTZMANN_CONSTANT
    sound_speed: float | None = None
    thermal_conductivity: float | None = None
    heat_capacity: float | None = None
    thermal_expansion: float = 0.0
    viscosity_exponent: float = 0.0
    conductivity_exponent: float = 0.0
    molecular_mass: float | None = None
    molecular_diameter: float | None = None
    mean_free_path: float | None = None
    equation_of_state: EquationOfState = ArtificialCompressibility()
    dimension: int | None = None
    name: str = "fluid"
    source: str = ""

    def __post_init__(self) -> None:
        for field in ("density", "temperature", "boltzmann_constant"):
            object.__setattr__(self, field, validation.positive(field, getattr(self, field)))
        for field in ("shear_viscosity", "bulk_viscosity"):
            object.__setattr__(self, field, validation.non_negative(field, getattr(self, field)))
        for field in _OPTIONAL:
            value = validation.optional_positive(field, getattr(self, field))
            object.__setattr__(self, field, value)
        for field in ("thermal_expansion", "viscosity_exponent", "conductivity_exponent"):
            object.__setattr__(self, field, validation.finite(field, getattr(self, field)))
        expected = "an equation of state (sdpd.eos)"
        validation.instance("equation_of_state", self.equation_of_state, EquationOfState, expected)
        if self.equation_of_state.kind not in KINDS:
            raise TypeError(
                f"`equation_of_state` must be {expected}, got {self.equation_of_state!r}"
            )
        self._adopt_heat_capacity()
        if self.dimension is not None:
            dimension = validation.integer("dimension", self.dimension, minimum=2, maximum=3)
            object.__setattr__(self, "dimension", dimension)
        validation.text("name", self.name)
        validation.text("source", self.source)

    def _adopt_heat_capacity(self) -> None:
        """An equation of state that tells the heat capacity has the last word."""
        law = self.equation_of_state.of_fluid(self)
        object.__setattr__(self, "equation_of_state", law)
        capacity = law.heat_capacity(self.density, self.temperature)
        if capacity is None:
            return
        if self.thermal_expansion != 0.0:
            raise ValueError(
                f"`thermal_expansion` must be 0 with {type(law).__name__}, which has its own, got "
                f"{self.thermal_expansion:g}"
            )
        object.__setattr__(self, "heat_capacity", capacity)

    @property
    def thermal_energy(self) -> float:
        """k_B T [energy]."""
        return self.boltzmann_constant * self.temperature

    @property
    def kinematic_viscosity(self) -> float:
        """nu = eta/rho [length^2/time]."""
        return self.shear_viscosity / self.density

    @property
    def is_si(self) -> bool:
        """Whether k_B has its SI value, so that results may be printed with SI units."""
        return self.boltzmann_constant == BOLTZMANN_CONSTANT

    def replace(self, **changes: Any) -> Fluid:
        """A copy with some values changed."""
        return dataclasses.replace(self, **changes)

    def in_plane(self, thickness: float) -> Fluid:
        """The fluid of a two-dimensional scene: a layer of that thickness [length].

        Density, viscosities and conductivity become those per area of the layer.

        Raises
        ------
        ValueError
            If the equation of state has constants of its own, which are three-dimensional, or the
            fluid is in a plane already.
        """
        height = validation.positive("thickness", thickness)
        if self.dimension == 2:
            raise ValueError("`dimension` must be 3 or None for in_plane, got 2")
        constants = [
            field
            for field in dataclasses.fields(self.equation_of_state)
            if field.name != "exponent"
        ]
        if any(getattr(self.equation_of_state, field.name) for field in constants):
            raise ValueError(
                "`equation_of_state` must have no constants of its own for in_plane, got "
                f"{self.equation_of_state!r}"
            )
        conductivity = self.thermal_conductivity
        return self.replace(
            dimension=2,
            density=self.density * height,
            shear_viscosity=self.shear_viscosity * height,
            bulk_viscosity=self.bulk_viscosity * height,
            thermal_conductivity=None if conductivity is None else conductivity * height,
        )

    def describe(self, dimension: int | None = None) -> str:
        """One line, with SI units for that many dimensions if k_B has its SI value."""
        dimension = dimension or self.dimension or 3
        pascal, density, kelvin = "", "", ""
        if self.is_si:
            pascal = " Pa s" if dimension == 3 else " Pa s m"
            density, kelvin = f" kg/m^{dimension}", " K"
        return (
            f"{self.name}: rho = {self.density:g}{density}, eta = {self.shear_viscosity:g}{pascal},"
            f" zeta = {self.bulk_viscosity:g}{pascal}, T = {self.temperature:g}{kelvin},"
            f" {self.equation_of_state.formula}"
        )

    def __str__(self) -> str:
        return self.describe()


def _between(name: str, value: object, low: float, high: float, what: str) -> float:
    number = validation.positive(name, value)
    if not low <= number <= high:
        raise ValueError(
            f"`{name}` must be between {low:g} and {high:g} K, the range of {what}, "
            f"got {number:g}; build an sdpd.Fluid for other states"
        )
    return number


def _kell(celsius: float) -> float:
    """Density of water at 0.1 MPa [kg/m^3], Kell, J. Chem. Eng. Data 20 (1975) 97."""
    t = celsius
    return (
        999.83952
        + t * (16.945176 + t * (-7.9870401e-3 + t * (-46.170461e-6 + t * 105.56302e-9)))
        - 280.54253e-12 * t**5
    ) / (1.0 + 16.879850e-3 * t)


def water(
    temperature: float = 300.0, *, properties: str = "yang2013", bulk_viscosity: float = 0.0
) -> Fluid:
    """Liquid water.

    Parameters
    ----------
    temperature : float
        [K]; 273.15 to 368.15 for the measured properties.
    properties : {"yang2013", "measured"}
        The constants of Yang's Tables 6 and 7 (rho = 1000 kg/m^3, eta = 1e-3 Pa s at every
        temperature), or measured values at 0.1 MPa and this temperature.
    bulk_viscosity : float
        [Pa s], 0 as in the dissertation. The true one (2.4e-3 Pa s at 298 K, Holmes et al., J.
        Phys.: Condens. Matter 23 (2011) 334216) is beyond what the model carries, eta (1 + 2/D).

    Returns
    -------
    Fluid

    Notes
    -----
    Measured: density, Kell, J. Chem. Eng. Data 20 (1975) 97; viscosity and conductivity, IAPWS
    SR6-08(2011); sound speed, Marczak, J. Acoust. Soc. Am. 102 (1997) 2776 (adiabatic; at most
    2 % above the isothermal one up to 340 K, 5 % at 368 K). Thermal expansion from the density;
    it acts where the fluid has an energy, with the compressibility of the scene's speed of sound.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.fluids.water().shear_viscosity
    0.001
    >>> round(sdpd.fluids.water(properties="measured").shear_viscosity, 7)
    0.0008537
    """
    validation.choice("properties", properties, ("yang2013", "measured"))
    molecule = 18.01528 * _ATOMIC_MASS
    if properties == "yang2013":
        kelvin = validation.positive("temperature", temperature)
        rho, eta, kappa, c = 1000.0, 1e-3, 0.58, 1480.0
        alpha = 2.75e-4  # Kell 1975 at 300 K
        source = "Yang (2013), Tables 6 and 7: constants, not functions of temperature"
    else:
        what = "the measured properties of liquid water"
        kelvin = _between("temperature", temperature, 273.15, 368.15, what)
        t, s = kelvin - 273.15, kelvin / 300.0
        rho = _kell(t)
        alpha = (_kell(t - 0.01) - _kell(t + 0.01)) / (0.02 * rho)
        eta = 1e-6 * (280.68 * s**-1.9 + 511.45 * s**-7.7 + 61.131 * s**-19.6 + 0.45903 * s**-40)
        kappa = 0.80201 * s**-0.32 - 0.25992 * s**-5.7 + 0.10024 * s**-12 - 0.032005 * s**-15
        c = 1402.385 + t * (
            5.038813 + t * (-5.799136e-2 + t * (3.287156e-4 + t * (-1.398845e-6 + t * 2.787860e-9)))
        )
        source = "Kell 1975; IAPWS SR6-08(2011); Marczak 1997, at 0.1 MPa"
    return Fluid(
        name="water",
        source=source,
        density=rho,
        shear_viscosity=eta,
        bulk_viscosity=bulk_viscosity,
        temperature=kelvin,
        sound_speed=c,
        thermal_conductivity=kappa,
        heat_capacity=4140.0,
        thermal_expansion=alpha,
        molecular_mass=molecule,
        molecular_diameter=(molecule / rho) ** (1.0 / 3.0),  # Y 3.4
        equation_of_state=ArtificialCompressibility(),
        dimension=3,
    )


def _gas(
    name: str,
    source: str,
    *,
    temperature: float,
    density: float,
    shear_viscosity: float,
    bulk_viscosity: float,
    thermal_conductivity: float,
    molecular_mass: float,
    molecular_diameter: float,
    degrees_of_freedom: int,
) -> Fluid:
    """An ideal gas; isothermal sound speed, c_v and mean free path follow from kinetic theory."""
    kt = BOLTZMANN_CONSTANT * temperature
    pressure = density * kt / molecular_mass
    return Fluid(
        name=name,
        source=source,
        density=density,
        shear_viscosity=shear_viscosity,
        bulk_viscosity=bulk_viscosity,
        temperature=temperature,
        sound_speed=math.sqrt(kt / molecular_mass),
        thermal_conductivity=thermal_conductivity,
        heat_capacity=0.5 * degrees_of_freedom * BOLTZMANN_CONSTANT / molecular_mass,
        molecular_mass=molecular_mass,
        molecular_diameter=molecular_diameter,
        mean_free_path=shear_viscosity / pressure * math.sqrt(math.pi * kt / (2 * molecular_mass)),
        equation_of_state=IdealGas(),
        dimension=3,
    )


def _sutherland(value: float, constant: float, temperature: float, reference: float) -> float:
    ratio: float = (temperature / reference) ** 1.5
    return value * ratio * (reference + constant) / (temperature + constant)


def nitrogen(
    temperature: float = 300.0,
    *,
    properties: str = "yang2013",
    pressure: float | None = None,
    bulk_viscosity: float = 0.0,
) -> Fluid:
    """Nitrogen gas.

    Parameters
    ----------
    temperature : float
        [K]; 200 to 1200 for the measured properties.
    properties : {"yang2013", "measured"}
        Yang's constants (rho = 1.184 kg/m^3, eta = 1.79e-5 Pa s, kappa = 0.026 W/m/K; Table 8 has
        eta = 1e-5: use ``.replace(shear_viscosity=1e-5)``), or measured values of the ideal gas.
    pressure : float, optional
        [Pa], sets the density of the measured gas; 101325 if None. Yang's has none to choose.
    bulk_viscosity : float
        [Pa s], 0 as in the dissertation; about 0.7 eta by measurement (Prangsma et al., Physica 64
        (1973) 278).

    Returns
    -------
    Fluid

    Notes
    -----
    Measured: Sutherland's law with the constants of White, *Viscous Fluid Flow*, 3rd ed., Tables
    1-2 and 1-3 (within 2 %); diameter 3e-10 m, Yang's Table 1.
    """
    validation.choice("properties", properties, ("yang2013", "measured"))
    molecule = 28.0134 * _ATOMIC_MASS
    if pressure is not None:
        pressure = validation.positive("pressure", pressure)
        if properties == "yang2013":
            raise ValueError(
                "`pressure` must be None with properties='yang2013', whose density is a constant, "
                f"got {pressure:g}; use properties='measured'"
            )
    if properties == "yang2013":
        kelvin = validation.positive("temperature", temperature)
        rho, eta, kappa = 1.184, 1.79e-5, 0.026
        source = "Yang (2013), Tables 1 and 9: constants, not functions of temperature"
    else:
        what = "the measured properties of nitrogen"
        kelvin = _between("temperature", temperature, 200.0, 1200.0, what)
        pascal = 101325.0 if pressure is None else pressure
        rho = pascal * molecule / (BOLTZMANN_CONSTANT * kelvin)
        eta = _sutherland(1.663e-5, 107.0, kelvin, 273.0)
        kappa = _sutherland(0.0242, 150.0, kelvin, 273.0)
        source = f"ideal gas at {pascal:g} Pa; Sutherland's law, White, Viscous Fluid Flow, 3rd ed."
    return _gas(
        "nitrogen",
        source,
        temperature=kelvin,
        density=rho,
        shear_viscosity=eta,
        bulk_viscosity=bulk_viscosity,
        thermal_conductivity=kappa,
        molecular_mass=molecule,
        molecular_diameter=3e-10,
        degrees_of_freedom=5,
    )


def argon(
    temperature: float = 300.0, *, pressure: float = 101325.0, bulk_viscosity: float = 0.0
) -> Fluid:
    """Argon gas.

    Parameters
    ----------
    temperature : float
        [K], 200 to 1200.
    pressure : float
        [Pa], sets the density.
    bulk_viscosity : float
        [Pa s], 0 for a dilute monatomic gas.

    Returns
    -------
    Fluid

    Notes
    -----
    Sutherland's law with the constants of White, *Viscous Fluid Flow*, 3rd ed., Tables 1-2 and 1-3
    (within 3 %); hard-sphere diameter 3.66e-10 m, Bird, *Molecular Gas Dynamics*, 1994, appendix A.
    """
    kelvin = _between("temperature", temperature, 200.0, 1200.0, "the measured properties of argon")
    pascal = validation.positive("pressure", pressure)
    molecule = 39.948 * _ATOMIC_MASS
    return _gas(
        "argon",
        f"ideal gas at {pascal:g} Pa; Sutherland's law, White, Viscous Fluid Flow, 3rd ed.",
        temperature=kelvin,
        density=pascal * molecule / (BOLTZMANN_CONSTANT * kelvin),
        shear_viscosity=_sutherland(2.125e-5, 144.0, kelvin, 273.0),
        bulk_viscosity=bulk_viscosity,
        thermal_conductivity=_sutherland(0.0163, 170.0, kelvin, 273.0),
        molecular_mass=molecule,
        molecular_diameter=3.66e-10,
        degrees_of_freedom=3,
    )


PRESETS: dict[str, Callable[..., Fluid]] = {"water": water, "nitrogen": nitrogen, "argon": argon}
