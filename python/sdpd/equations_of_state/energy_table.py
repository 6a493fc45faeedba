"""A user's own E(N, V, S): tabulated once, with any heat capacity C(T, rho) that comes of it.

Per mass, e = e_c(rho) + h with the heat h > 0, and the entropy s(rho, h). The core interpolates s
in ln rho and ln h and takes T = dh/ds, c_v and P as derivatives of the interpolant, so that they
belong together however coarse the table is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation
from sdpd.equations_of_state.laws import EquationOfState

if TYPE_CHECKING:
    from sdpd.fluids import Fluid

__all__ = ["EnergyTable"]

Array = NDArray[np.float64]
Function = Callable[[Array, Array], ArrayLike]

_ISOTHERM_POINTS = 160
_BISECTIONS = 200
_WIDENINGS = 60  # by 1.3: 7e6 steps
_LEAST_POINTS = 8
# Central differences of fourth order: errors of 1e-12 of a smooth function.
_STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0))


@dataclass(frozen=True, kw_only=True)
class EnergyTable(EquationOfState):
    """E(N, V, S) of any fluid, from `from_energy` or `from_helmholtz`.

    It tells the heat capacity, too, in the place of that of the fluid, and how the pressure goes
    with the temperature. Without an energy the scene has its isotherm at the temperature of the
    fluid. Beyond the table entropy goes on as a straight line in ln rho and ln h (a constant heat
    capacity).

    Parameters
    ----------
    densities : (float, float)
        Lowest and highest rho [mass/length^D].
    heats : (float, float)
        Lowest and highest heat h [energy/mass].
    cold_energies : sequence of float
        e_c [energy/mass] at densities equidistant in ln rho, at least 8.
    entropies : sequence of sequences of float
        s [energy/(mass temperature)], for each of the densities at heats equidistant in ln h, at
        least 8.
    temperature : float, optional
        Of the isotherm that stands for it without an energy; that of the fluid if None.

    Raises
    ------
    ValueError
        If temperature or heat capacity come out negative somewhere.
    """

    kind: ClassVar[str] = "energy_table"
    formula: ClassVar[str] = "E(N, V, S) interpolated in a table"
    unused: ClassVar[tuple[str, ...]] = ("reference_density", "sound_speed")
    constant_heat_capacity: ClassVar[bool] = False

    densities: tuple[float, float]
    heats: tuple[float, float]
    cold_energies: tuple[float, ...]
    entropies: tuple[tuple[float, ...], ...]
    temperature: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("densities", "heats"):
            object.__setattr__(self, name, _interval(name, getattr(self, name)))
        cold = validation.vector("cold_energies", self.cold_energies)
        if len(cold) < _LEAST_POINTS:
            raise ValueError(
                f"`cold_energies` must have at least {_LEAST_POINTS} entries, got {len(cold)}"
            )
        rows = tuple(self.entropies)
        if len(rows) != len(cold):
            raise ValueError(f"`entropies` must have {len(cold)} rows, got {len(rows)}")
        count = len(tuple(rows[0]))
        if count < _LEAST_POINTS:
            raise ValueError(
                f"`entropies` must have at least {_LEAST_POINTS} numbers a row, got {count}"
            )
        entropies = tuple(
            validation.vector(f"entropies[{k}]", row, length=count) for k, row in enumerate(rows)
        )
        object.__setattr__(self, "cold_energies", cold)
        object.__setattr__(self, "entropies", entropies)
        temperature = validation.optional_positive("temperature", self.temperature)
        object.__setattr__(self, "temperature", temperature)
        # The core looks at temperatures and heat capacities.
        self._evaluate(np.array([self.densities[0]]), np.array([1.0]))

    # --- from functions ---------------------------------------------------------------------

    @classmethod
    def from_energy(
        cls,
        energy: Function,
        *,
        densities: tuple[float, float],
        temperatures: tuple[float, float],
        points: tuple[int, int] = (32, 64),
        entropy: float = 0.0,
    ) -> EnergyTable:
        """From the energy as a function of density and entropy.

        Parameters
        ----------
        energy : callable
            e(rho, s) [energy/mass] for arrays of equal shape; smooth, with de/ds = T > 0 increasing
            in s at fixed rho. Infinite values where it overflows do no harm.
        densities, temperatures : (float, float)
            What the table has to cover; three times the range a scene uses is not too much.
        points : (int, int)
            Of density and heat, at least 8 each.
        entropy : float
            Some s [energy/(mass temperature)] near which energies are finite.

        Raises
        ------
        ValueError
            If no entropy has the temperatures asked for.
        """
        grid = _Grid(densities, temperatures, points)
        start = validation.finite("entropy", entropy)
        rho = grid.rho[:, None]

        def e(s: Array) -> Array:
            with np.errstate(over="ignore", invalid="ignore"):
                return np.asarray(energy(np.broadcast_to(rho, s.shape), s), dtype=np.float64)

        middle = np.full_like(rho, start)
        with np.errstate(invalid="ignore"):
            slope = np.abs(e(middle + 1e-3) - e(middle)) / 1e-3
        step = float(np.max(np.abs(e(middle)) / np.maximum(slope, 1e-300))) or 1.0
        if not 0.0 < step < 1e150:
            raise ValueError(
                f"`energy` must be finite and grow with s at s = {start:g}; see `entropy`"
            )

        def temperature(s: Array) -> Array:
            h = 1e-3 * step
            return sum((w * e(s + k * h) for k, w in _STENCIL), np.zeros_like(s)) / h

        low, high = (
            _solve("temperatures", temperature, np.full_like(rho, t), start, step)
            for t in grid.temperatures
        )
        floor, capacity = e(low), _capacity(temperature, low, 1e-3 * step)
        first = float(capacity[len(rho) // 2, 0]) * grid.temperatures[0]
        heat = grid.heats(first, float(np.max(e(high) - floor)))
        target = floor - first + heat[None, :]
        s = _solve("temperatures", e, target, start, step)
        return grid.table(cls, heat, floor[:, 0] - first, s)

    @classmethod
    def from_helmholtz(
        cls,
        energy: Function,
        *,
        densities: tuple[float, float],
        temperatures: tuple[float, float],
        points: tuple[int, int] = (32, 64),
    ) -> EnergyTable:
        """From the free energy as a function of density and temperature.

        Parameters
        ----------
        energy : callable
            f(rho, T) = e - T s [energy/mass] for arrays of equal shape; smooth and concave in T.
        densities, temperatures : (float, float)
            What the table has to cover; f must be defined a third beyond the temperatures.
        points : (int, int)
            Of density and heat, at least 8 each.

        Examples
        --------
        Nitrogen whose molecules vibrate (3394 K), from 1 to 3 kg/m^3:

        >>> import numpy as np, sdpd
        >>> R = 296.8
        >>> def f(rho, T):
        ...     return R * T * (np.log(rho) - 2.5 * np.log(T) + np.log(-np.expm1(-3394.0 / T)))
        >>> law = sdpd.eos.EnergyTable.from_helmholtz(
        ...     f, densities=(0.5, 5.0), temperatures=(150.0, 4000.0)
        ... )
        >>> [round(law.heat_capacity(1.2, T) / R, 2) for T in (300.0, 2000.0)]
        [2.5, 3.29]
        """
        grid = _Grid(densities, temperatures, points)
        rho = grid.rho[:, None]

        def f(t: Array) -> Array:
            return np.asarray(energy(np.broadcast_to(rho, t.shape), t), dtype=np.float64)

        def entropy(t: Array) -> Array:
            h = 1e-3 * t
            return -sum((w * f(t + k * h) for k, w in _STENCIL), np.zeros_like(t)) / h

        def e(t: Array) -> Array:
            return f(t) + t * entropy(t)

        low, high = (np.full_like(rho, t) for t in grid.temperatures)
        floor = e(low)
        slope = sum((w * e(low * (1.0 + 1e-3 * k)) for k, w in _STENCIL), np.zeros_like(low))
        first = float(slope[len(rho) // 2, 0]) / 1e-3
        heat = grid.heats(first, float(np.max(e(high) - floor)))
        target = floor - first + heat[None, :]
        middle = math.sqrt(grid.temperatures[0] * grid.temperatures[1])
        # ln T, so that no temperature is negative on the way.
        solved = _solve("temperatures", lambda x: e(np.exp(x)), target, math.log(middle), 0.5)
        return grid.table(cls, heat, floor[:, 0] - first, entropy(np.exp(solved)))

    # --- what the fluid and the core ask ----------------------------------------------------

    def of_fluid(self, fluid: Fluid) -> EquationOfState:
        """With the isotherm of its temperature."""
        return replace(self, temperature=fluid.temperature)

    def check_range(self, density: float, temperatures: tuple[float, float]) -> None:
        """Refuse a fluid at rest outside the table."""
        low, high = self.densities
        if not low <= density <= high:
            raise ValueError(
                f"`equation_of_state` must reach the density of the fluid {density:g}, but it is "
                f"tabulated from {low:g} to {high:g}"
            )
        rho = np.array([density, density])
        _, energy, *_ = self._evaluate(rho, np.array(temperatures))
        x = math.log(density / low) / math.log(high / low) * (len(self.cold_energies) - 1)
        cold = float(np.interp(x, np.arange(len(self.cold_energies)), self.cold_energies))
        for value, t in zip(energy - cold, temperatures, strict=True):
            if not 0.999 * self.heats[0] <= value <= 1.001 * self.heats[1]:
                raise ValueError(
                    f"`equation_of_state` must reach the temperature {t:g} of the scene, but its "
                    "table does not"
                )

    def heat_capacity(self, density: float, temperature: float) -> float:
        """c_v [energy/(mass temperature)] at a density and a temperature."""
        parts = self._evaluate(np.array([float(density)]), np.array([float(temperature)]))
        return float(parts[5][0])

    def expansion(self, fluid: Fluid) -> float:
        """(dP/dT)/(rho dP/drho), which is alpha."""
        step = 1e-4 * fluid.temperature
        temperatures = fluid.temperature + step * np.array([-1.0, 0.0, 1.0])
        pressure, _, _, slope, *_ = self._evaluate(np.full(3, fluid.density), temperatures)
        return float((pressure[2] - pressure[0]) / (2.0 * step * fluid.density * slope[1]))

    def parameters(self, rho0: float, c: float) -> list[float]:
        """The isotherm, as a `Table`."""
        if self.temperature is None:
            raise ValueError("`temperature` must be given to an EnergyTable outside of a fluid")
        rho = np.geomspace(*self.densities, _ISOTHERM_POINTS)
        pressure = self._evaluate(rho, np.full_like(rho, self.temperature))[0]
        if np.any(np.diff(pressure) < 0.0):
            place = int(np.argmax(np.diff(pressure) < 0.0))
            raise ValueError(
                "`equation_of_state` must not have a pressure that falls with density (the fluid "
                f"would part), but it does at T = {self.temperature:g}, rho = {rho[place]:g}; keep "
                "`densities` to one phase"
            )
        return [*rho.tolist(), *pressure.tolist()]

    def core(self, reference_density: float, sound_speed: float) -> tuple[str, list[float]]:
        """The isotherm for the core."""
        return "table", self.parameters(reference_density, sound_speed)

    def caloric(
        self, fluid: Fluid, reference_density: float, sound_speed: float
    ) -> tuple[str, list[float], str]:
        """The table for the core."""
        return "table", self._numbers(), ""

    def _numbers(self) -> list[float]:
        from scipy.interpolate import CubicSpline

        cold, s = np.array(self.cold_energies), np.array(self.entropies)
        x = np.linspace(math.log(self.densities[0]), math.log(self.densities[1]), len(cold))
        y = np.linspace(math.log(self.heats[0]), math.log(self.heats[1]), s.shape[1])
        along_x = CubicSpline(x, s, axis=0)(x, 1)
        parts = (
            s,
            along_x,
            CubicSpline(y, s, axis=1)(y, 1),
            CubicSpline(y, along_x, axis=1)(y, 1),
        )
        head = [x[0], x[1] - x[0], float(len(x)), y[0], y[1] - y[0], float(len(y))]
        energies = np.stack([cold, CubicSpline(x, cold)(x, 1)], axis=-1)
        return [*head, *energies.ravel().tolist(), *np.stack(parts, axis=-1).ravel().tolist()]

    def _evaluate(self, rho: Array, temperature: Array) -> tuple[Array, ...]:
        from sdpd import _core

        return tuple(_core.caloric_evaluate(("table", self._numbers(), ""), rho, temperature))

    def __str__(self) -> str:
        low, high = self.densities
        n, m = len(self.entropies), len(self.entropies[0])
        return f"{self.formula} of {n} x {m} points, densities {low:g} to {high:g}"

    __repr__ = __str__


class _Grid:
    """Where a function is tabulated."""

    def __init__(
        self,
        densities: tuple[float, float],
        temperatures: tuple[float, float],
        points: tuple[int, int],
    ) -> None:
        self.densities = _interval("densities", densities)
        self.temperatures = _interval("temperatures", temperatures)
        n, m = (
            validation.integer(f"points[{k}]", value, minimum=_LEAST_POINTS, maximum=10_000)
            for k, value in enumerate(points)
        )
        self.rho = np.geomspace(*self.densities, n)
        self.count = m

    def heats(self, first: float, span: float) -> Array:
        """From `first` at the lowest temperature to the most that the highest one takes."""
        if not (first > 0.0 and span > 0.0 and math.isfinite(first + span)):
            raise ValueError(
                "`energy` must have a positive heat capacity between `temperatures`, got "
                f"{first:g} and {span:g} of heat"
            )
        return np.geomspace(first, first + span, self.count)

    def table(self, cls: type[EnergyTable], heat: Array, cold: Array, s: Array) -> EnergyTable:
        return cls(
            densities=self.densities,
            heats=(float(heat[0]), float(heat[-1])),
            cold_energies=tuple(cold.tolist()),
            entropies=tuple(tuple(row) for row in s.tolist()),
        )


def _interval(name: str, value: tuple[float, float]) -> tuple[float, float]:
    low, high = validation.vector(name, value, length=2)
    if not 0.0 < low < high:
        raise ValueError(f"`{name}` must be > 0 and increasing, got ({low:g}, {high:g})")
    return low, high


def _capacity(temperature: Callable[[Array], Array], s: Array, h: float) -> Array:
    """T/(dT/ds)."""
    slope = sum((w * temperature(s + k * h) for k, w in _STENCIL), np.zeros_like(s)) / h
    return np.asarray(temperature(s) / slope)


def _solve(
    name: str, function: Callable[[Array], Array], target: Array, start: float, step: float
) -> Array:
    """Where an increasing function has the values `target`, element by element: bisection."""

    def above(x: Array) -> NDArray[np.bool_]:
        with np.errstate(over="ignore", invalid="ignore"):
            value = function(x)
        return np.where(np.isnan(value), x > start, value > target)

    low, high = np.full_like(target, start), np.full_like(target, start)
    for bound, sign in ((low, -1.0), (high, 1.0)):
        width = step
        for _ in range(_WIDENINGS):
            wrong = above(bound) if sign < 0.0 else ~above(bound)
            if not wrong.any():
                break
            bound[wrong] += sign * width
            width *= 1.3
        else:
            raise ValueError(f"`{name}` must be temperatures that the function reaches")
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if np.all((middle == low) | (middle == high)):
            break
        over = above(middle)
        high = np.where(over, middle, high)
        low = np.where(over, low, middle)
    return 0.5 * (low + high)
