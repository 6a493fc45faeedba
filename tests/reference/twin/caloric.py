"""Caloric equations of state in closed form, as textbooks have them; per mass, constant c_v."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .states import pressure, specific_potential

Array = NDArray[np.float64]


class Law:
    """What a particle of one density is, per mass, from its heat h = e - e_c."""

    def state(self, heat: float) -> tuple[float, float]:
        """T and c_v."""
        raise NotImplementedError

    def entropy(self, heat: float) -> float:
        raise NotImplementedError

    def heat(self, temperature: float) -> float:
        raise NotImplementedError


class ConstantLaw(Law):
    """h = c_v T."""

    def __init__(self, capacity: float, constant: float) -> None:
        self.capacity, self.constant = capacity, constant

    def state(self, heat: float) -> tuple[float, float]:
        return heat / self.capacity, self.capacity

    def entropy(self, heat: float) -> float:
        return self.constant + self.capacity * math.log(heat / self.capacity)

    def heat(self, temperature: float) -> float:
        return self.capacity * temperature


@dataclass(frozen=True)
class Caloric:
    """A fluid with constant c_v: "ideal_gas" (R, c_v, s_0) or "liquid" (c_v, beta, T_0, isotherm).

    Ideal gas: P = rho R T, e = c_v T, s = s_0 + c_v ln T - R ln rho. Liquid: P = P_0(rho) +
    beta (T - T_0); de/drho = (P - T dP/dT)/rho^2 and ds/drho = -(dP/dT)/rho^2 give the rest, with
    constants that are arbitrary: only differences of e and s have a meaning.
    """

    kind: str
    parameters: list[float]
    isotherm: str = ""

    @property
    def heat_capacity(self) -> float:
        """c_v."""
        return self.parameters[1 if self.kind == "ideal_gas" else 0]

    def laws(self, rho: Array) -> Sequence[Law]:
        """Of particles, one by one."""
        constants = self.entropy(rho, np.ones_like(rho)).tolist()
        return [ConstantLaw(self.heat_capacity, constant) for constant in constants]

    def heats(self, rho: Array, temperature: Array) -> Array:
        """h."""
        rows = zip(self.laws(rho), temperature.tolist(), strict=True)
        return np.array([law.heat(t) for law, t in rows])

    def states(self, rho: Array, heat: Array) -> tuple[Array, Array]:
        """T and c_v."""
        rows = zip(self.laws(rho), heat.tolist(), strict=True)
        t, capacity = np.array([law.state(h) for law, h in rows]).T
        return t, capacity

    def pressure(self, rho: Array, temperature: Array) -> Array:
        if self.kind == "ideal_gas":
            return rho * self.parameters[0] * temperature
        _, beta, rest = self.parameters[:3]
        return pressure(self.isotherm, self.parameters[3:], rho) + beta * (temperature - rest)

    def cold(self, rho: Array) -> Array:
        """e - c_v T."""
        if self.kind == "ideal_gas":
            return np.zeros_like(rho)
        _, beta, rest = self.parameters[:3]
        potential = specific_potential(self.isotherm, self.parameters[3:], rho, 1.0)
        return potential + beta * rest / rho

    def entropy(self, rho: Array, temperature: Array) -> Array:
        thermal = self.heat_capacity * np.log(temperature)
        if self.kind == "ideal_gas":
            gas, _, constant = self.parameters
            return constant + thermal - gas * np.log(rho)
        return thermal + self.parameters[1] / rho

    def temperature(self, rho: Array, entropy: Array) -> Array:
        return np.exp((entropy - self.entropy(rho, np.ones_like(rho))) / self.heat_capacity)
