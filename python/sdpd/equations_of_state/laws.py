"""Equations of state P(rho) of the isothermal fluid, as plain data handed to the compiled core.

(Y) is Yang, PhD dissertation, 2013. The reference density is that of the fluid and the sound speed
that of the scene unless given here, so that one object serves every resolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

if TYPE_CHECKING:
    from sdpd.fluids import Fluid

__all__ = [
    "ArtificialCompressibility",
    "EquationOfState",
    "IdealGas",
    "Linear",
    "Polynomial",
    "Table",
    "Tait",
]

Array = NDArray[np.float64]
_PLANCK = 6.62607015e-34  # J s, exact in the SI since 2019


@dataclass(frozen=True, kw_only=True)
class EquationOfState:
    """Base of the equations of state: a pressure as a function of the mass density.

    Parameters
    ----------
    reference_density : float, optional
        rho_0 [mass/length^D]; that of the fluid if None.
    sound_speed : float, optional
        c at rho_0 [length/time]; that of the scene if None.
    """

    kind: ClassVar[str] = ""
    formula: ClassVar[str] = ""
    unused: ClassVar[tuple[str, ...]] = ()
    constant_heat_capacity: ClassVar[bool] = True

    reference_density: float | None = None
    sound_speed: float | None = None

    def __post_init__(self) -> None:
        for name in ("reference_density", "sound_speed"):
            value = validation.optional_positive(name, getattr(self, name))
            if value is not None and name in self.unused:
                raise ValueError(
                    f"`{name}` must be None for {type(self).__name__}, {self.formula}, which does "
                    f"not depend on it, got {value:g}"
                )
            object.__setattr__(self, name, value)

    def parameters(self, rho0: float, c: float) -> list[float]:
        """Parameters in the order the core expects."""
        raise NotImplementedError

    def of_fluid(self, fluid: Fluid) -> EquationOfState:
        """The same as the equation of state of that fluid: the isotherm of its temperature."""
        return self

    def heat_capacity(self, density: float, temperature: float) -> float | None:
        """c_v [energy/(mass temperature)], if the equation of state and not the fluid tells it."""
        return None

    def expansion(self, fluid: Fluid) -> float:
        """alpha = -(1/rho) drho/dT at constant pressure, of that fluid [1/temperature]."""
        return fluid.thermal_expansion

    def check_range(self, density: float, temperatures: tuple[float, float]) -> None:
        """Refuse a fluid beyond the densities and temperatures that the law is made for.

        Raises
        ------
        ValueError
            If it is; the text begins with "`equation_of_state`".
        """

    def core(self, reference_density: float, sound_speed: float) -> tuple[str, list[float]]:
        """Kind and parameters for the core; the object's own rho_0 and c win over the arguments."""
        rho0 = self.reference_density or validation.positive("reference_density", reference_density)
        c = self.sound_speed or validation.positive("sound_speed", sound_speed)
        return self.kind, self.parameters(rho0, c)

    def caloric(
        self, fluid: Fluid, reference_density: float, sound_speed: float
    ) -> tuple[str, list[float], str]:
        """The caloric equation of state whose isotherm this is, for the core.

        P = P_0(rho) + alpha rho_0 c^2 (T - T_0), and the heat capacity of the fluid.
        """
        kind, parameters = self.core(reference_density, sound_speed)
        assert fluid.heat_capacity is not None
        slope = fluid.thermal_expansion * fluid.density * sound_speed**2
        return "liquid", [fluid.heat_capacity, slope, fluid.temperature, *parameters], kind

    def evaluate(
        self, density: ArrayLike, *, reference_density: float, sound_speed: float
    ) -> tuple[Array, Array, Array]:
        """Pressure, squared sound speed and potential energy per mass at the given densities.

        Parameters
        ----------
        density : array_like of float, any shape
            Mass density [mass/length^D], finite and > 0.
        reference_density, sound_speed : float
            rho_0 and c, used where the object does not have its own.

        Returns
        -------
        pressure : ndarray
            [energy/length^D].
        sound_speed_squared : ndarray
            dP/drho [length^2/time^2].
        specific_potential : ndarray
            Integral of P/rho^2 [energy/mass], up to a constant.
        """
        from sdpd import _core

        rho = np.asarray(density, dtype=np.float64)
        if not np.all(np.isfinite(rho) & (rho > 0.0)):
            raise ValueError("`density` must be finite and > 0")
        kind, parameters = self.core(reference_density, sound_speed)
        parts = _core.eos_evaluate(kind, parameters, np.ascontiguousarray(rho.ravel()))
        pressure, squared, potential = (np.asarray(part).reshape(rho.shape) for part in parts)
        return pressure, squared, potential

    def pressure(
        self, density: ArrayLike, *, reference_density: float, sound_speed: float
    ) -> Array:
        """P(rho) [energy/length^D]; see `evaluate`."""
        return self.evaluate(density, reference_density=reference_density, sound_speed=sound_speed)[
            0
        ]

    def __str__(self) -> str:
        given = ", ".join(
            f"{field.name} = {getattr(self, field.name)!r}"
            for field in fields(self)
            if getattr(self, field.name) is not None
        )
        return f"{self.formula}" + (f" ({given})" if given else "")


@dataclass(frozen=True, kw_only=True)
class ArtificialCompressibility(EquationOfState):
    """P = rho_0 c^2/2 ((rho/rho_0)^2 - 1), Y 2.52.

    Zero at rho_0 and negative below. It does not let particles pair, at the price of density
    fluctuations about twice (in rms) those of P = c^2 rho.
    """

    kind: ClassVar[str] = "artificial_compressibility"
    formula: ClassVar[str] = "P = rho0 c^2/2 ((rho/rho0)^2 - 1)"

    def parameters(self, rho0: float, c: float) -> list[float]:
        return [rho0, c]


@dataclass(frozen=True, kw_only=True)
class Linear(EquationOfState):
    """P = p_0 + c^2 (rho - rho_0).

    Parameters
    ----------
    background_pressure : float
        p_0 [energy/length^D]. With p_0 = rho_0 c^2 this is `IdealGas`, which keeps particles in the
        best order; with p_0 = 0 the pressure is negative below rho_0.
    """

    kind: ClassVar[str] = "linear"
    formula: ClassVar[str] = "P = p0 + c^2 (rho - rho0)"

    background_pressure: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        value = validation.finite("background_pressure", self.background_pressure)
        object.__setattr__(self, "background_pressure", value)

    def parameters(self, rho0: float, c: float) -> list[float]:
        return [rho0, c, self.background_pressure]


@dataclass(frozen=True, kw_only=True)
class Tait(EquationOfState):
    """P = rho_0 c^2/gamma ((rho/rho_0)^gamma - 1) + p_b, stiff under compression (Y 2.55 to 2.57).

    Parameters
    ----------
    exponent : float
        gamma [1], > 1; 7 for water.
    background_pressure : float
        p_b [energy/length^D].
    """

    kind: ClassVar[str] = "tait"
    formula: ClassVar[str] = "P = rho0 c^2/gamma ((rho/rho0)^gamma - 1) + p_b"

    exponent: float = 7.0
    background_pressure: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        exponent = validation.finite("exponent", self.exponent)
        if exponent <= 1.0:
            raise ValueError(f"`exponent` must be > 1, got {exponent:g}")
        object.__setattr__(self, "exponent", exponent)
        value = validation.finite("background_pressure", self.background_pressure)
        object.__setattr__(self, "background_pressure", value)

    def parameters(self, rho0: float, c: float) -> list[float]:
        return [rho0, c, self.exponent, self.background_pressure]


@dataclass(frozen=True, kw_only=True)
class IdealGas(EquationOfState):
    """P = c^2 rho with the isothermal sound speed c, Y 2.53; without a reference density."""

    kind: ClassVar[str] = "ideal_gas"
    formula: ClassVar[str] = "P = c^2 rho"
    unused: ClassVar[tuple[str, ...]] = ("reference_density",)

    def parameters(self, rho0: float, c: float) -> list[float]:
        return [c]

    def expansion(self, fluid: Fluid) -> float:
        """1/T."""
        return 1.0 / fluid.temperature

    def caloric(
        self, fluid: Fluid, reference_density: float, sound_speed: float
    ) -> tuple[str, list[float], str]:
        """P = rho R T with R = c^2/T_0; entropy of Sackur and Tetrode for a monatomic gas.

        Where c_v is 3 R/2, R = k_B over the mass of a molecule and the units are those of the SI,
        the entropy is absolute; else it is 0 at the density and the temperature of the fluid.
        """
        _, [c] = self.core(reference_density, sound_speed)
        capacity, temperature = fluid.heat_capacity, fluid.temperature
        assert capacity is not None
        gas_constant = c**2 / temperature
        constant = gas_constant * math.log(fluid.density) - capacity * math.log(temperature)
        molecule = fluid.molecular_mass
        if molecule is not None and fluid.is_si and fluid.dimension != 2:
            monatomic = math.isclose(capacity, 1.5 * gas_constant, rel_tol=1e-6)
            own = fluid.boltzmann_constant / molecule
            if monatomic and math.isclose(gas_constant, own, rel_tol=1e-6):
                # s = R (5/2 + ln[(m/rho) (2 pi m k T/h^2)^(3/2)]), Y 2.49
                wave = 2.0 * math.pi * molecule * fluid.boltzmann_constant / _PLANCK**2
                constant = gas_constant * (2.5 + math.log(molecule) + 1.5 * math.log(wave))
        return "ideal_gas", [gas_constant, capacity, constant], ""


@dataclass(frozen=True, kw_only=True)
class Polynomial(EquationOfState):
    """P = a_0 + a_1 rho + a_2 rho^2 + ..., the user's own; no other argument of the base counts.

    Parameters
    ----------
    coefficients : sequence of float
        a_k [energy/length^D (length^D/mass)^k], at least one. The sound speed of the scene is then
        that of the polynomial.
    """

    kind: ClassVar[str] = "polynomial"
    formula: ClassVar[str] = "P = sum_k a_k rho^k"
    unused: ClassVar[tuple[str, ...]] = ("reference_density", "sound_speed")

    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        values = validation.vector("coefficients", self.coefficients)
        if not values:
            raise ValueError("`coefficients` must have at least 1 entry (a_0, a_1, ...), got 0")
        object.__setattr__(self, "coefficients", values)

    def parameters(self, rho0: float, c: float) -> list[float]:
        return list(self.coefficients)


@dataclass(frozen=True, kw_only=True)
class Table(EquationOfState):
    """A monotone cubic through the given points, linear beyond the ends.

    By Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300. The sound speed of the scene is
    then that of the table, and there is no reference density.

    Parameters
    ----------
    densities : sequence of float
        rho_k [mass/length^D], at least two, > 0 and increasing.
    pressures : sequence of float
        P_k [energy/length^D], as many, none below the one before (a fluid whose pressure falls
        with density is unstable).
    """

    kind: ClassVar[str] = "table"
    formula: ClassVar[str] = "P(rho) interpolated in a table"
    unused: ClassVar[tuple[str, ...]] = ("reference_density", "sound_speed")

    densities: tuple[float, ...]
    pressures: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        rho = validation.vector("densities", self.densities)
        pressure = validation.vector("pressures", self.pressures, length=len(rho))
        if len(rho) < 2:
            raise ValueError(f"`densities` must have at least 2 entries, got {len(rho)}")
        if rho[0] <= 0.0:
            raise ValueError(f"`densities` must be > 0, got {rho[0]:g} at index 0")
        for k in range(1, len(rho)):
            if rho[k] <= rho[k - 1]:
                raise ValueError(
                    f"`densities` must increase, got {rho[k - 1]:g} then {rho[k]:g} at index {k}"
                )
            if pressure[k] < pressure[k - 1]:
                raise ValueError(
                    f"`pressures` must not decrease, got {pressure[k - 1]:g} then "
                    f"{pressure[k]:g} at index {k}"
                )
        object.__setattr__(self, "densities", rho)
        object.__setattr__(self, "pressures", pressure)

    def parameters(self, rho0: float, c: float) -> list[float]:
        return [*self.densities, *self.pressures]
