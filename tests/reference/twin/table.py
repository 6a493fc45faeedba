"""Any E(N, V, S) from the numbers of a table: the bicubic s(ln rho, ln h) by Bezier's ordinates.

e = e_c(rho) + h; T = h/s_y, c_v = s_y^2/(s_y - s_yy) and P = rho (e_c' - T s_x) with x = ln rho,
y = ln h, which is what T ds = dh at constant rho, de = T ds + P/rho^2 drho and c_v = dh/dT mean.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from .caloric import Caloric, Law

Array = NDArray[np.float64]

FAR = 8.0  # in ln h beyond the table, where roots are looked for


class Chain(NamedTuple):
    """A cubic of given values and slopes at equidistant points; beyond them straight lines."""

    start: float
    step: float
    values: list[float]
    slopes: list[float]

    @property
    def end(self) -> float:
        return self.start + self.step * (len(self.values) - 1)

    def at(self, y: float) -> tuple[float, float, float]:
        """The value and two derivatives."""
        inside = min(max(y, self.start), self.end)
        j = min(int((inside - self.start) / self.step), len(self.values) - 2)
        u = (inside - self.start) / self.step - j
        # differences of Bezier's ordinates from the first, then de Casteljau
        one, three = self.step * self.slopes[j] / 3.0, self.step * self.slopes[j + 1] / 3.0
        two = self.values[j + 1] - self.values[j] - one - three
        low, high = one + u * (two - one), two + u * (three - two)
        a, b, c = u * one, one + u * two, one + two + u * three
        rise = a + u * (b - a) + u * (b + u * (c - b) - a - u * (b - a))
        slope = 3.0 * (low + u * (high - low)) / self.step
        bend = 6.0 * (high - low) / self.step**2 if inside == y else 0.0
        return self.values[j] + rise + (y - inside) * slope, slope, bend

    def solve(self, target: float, log_slope: bool = False) -> float:
        """Where the value is `target`, or y - ln(slope) is."""

        def excess(y: float) -> float:
            value, slope, _ = self.at(y)
            return (y - math.log(slope) if log_slope else value) - target

        low, high = self.start - FAR, self.end + FAR
        return float(brentq(excess, low, high, xtol=1e-15, rtol=1e-15))


class TableLaw(Law):
    """At one density: chains of s and s_x along ln h."""

    def __init__(self, s: Chain, s_x: Chain) -> None:
        self.s, self.s_x = s, s_x

    def state(self, heat: float) -> tuple[float, float]:
        _, slope, bend = self.s.at(math.log(heat))
        return heat / slope, slope**2 / (slope - bend)

    def entropy(self, heat: float) -> float:
        return self.s.at(math.log(heat))[0]

    def heat(self, temperature: float) -> float:
        return math.exp(self.s.solve(math.log(temperature), log_slope=True))


class Table(Caloric):
    """Caloric("table", numbers): start, step and count of x and of y, then (e_c, e_c') for every x,
    then (s, s_x, s_y, s_xy) for every x and y."""

    @cached_property
    def _parts(self) -> tuple[Array, CubicHermiteSpline, list[CubicHermiteSpline]]:
        numbers = np.array(self.parameters)
        start, step, n = numbers[:3]
        n, m = int(n), int(numbers[5])
        x = start + step * np.arange(n)
        cold = numbers[6 : 6 + 2 * n].reshape(n, 2)
        s = numbers[6 + 2 * n :].reshape(n, m, 4)
        along = [CubicHermiteSpline(x, s[..., k], s[..., k + 1], axis=0) for k in (0, 2)]
        return x, CubicHermiteSpline(x, *cold.T), along

    def _at(self, spline: CubicHermiteSpline, rho: Array) -> tuple[Array, Array]:
        """Value and slope in ln rho."""
        nodes, x = self._parts[0], np.log(rho)
        inside = np.clip(x, nodes[0], nodes[-1])
        slope = spline(inside, 1)
        beyond = (x - inside).reshape((-1,) + (1,) * (slope.ndim - 1))
        return spline(inside) + beyond * slope, slope

    def laws(self, rho: Array) -> list[TableLaw]:
        start, step = self.parameters[3:5]
        s, s_y = (self._at(spline, rho) for spline in self._parts[2])
        rows = zip(*(part.tolist() for part in (*s, *s_y)), strict=True)
        return [
            TableLaw(Chain(start, step, s, s_y), Chain(start, step, s_x, s_xy))
            for s, s_x, s_y, s_xy in rows
        ]

    def pressure(self, rho: Array, temperature: Array) -> Array:
        slope = [
            law.s_x.at(math.log(law.heat(t)))[0]
            for law, t in zip(self.laws(rho), temperature.tolist(), strict=True)
        ]
        return rho * (self._at(self._parts[1], rho)[1] - temperature * np.array(slope))

    def cold(self, rho: Array) -> Array:
        return self._at(self._parts[1], rho)[0]

    def entropy(self, rho: Array, temperature: Array) -> Array:
        rows = zip(self.laws(rho), temperature.tolist(), strict=True)
        return np.array([law.entropy(law.heat(t)) for law, t in rows])

    def temperature(self, rho: Array, entropy: Array) -> Array:
        rows = zip(self.laws(rho), entropy.tolist(), strict=True)
        return np.array([law.state(math.exp(law.s.solve(s)))[0] for law, s in rows])
