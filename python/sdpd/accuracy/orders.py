r"""How errors of flows without noise go with resolution, support and kernel, fitted to studies.

.. math:: e^2 = \left[c\,(1 - \eta_\mathrm{eff}/\eta) + f(h/\Delta x) + a\,(h/L)^p\right]^2
          + \left[b\,(h/L)^p\right]^2

with eta_eff/eta the lattice factor of the scene (1 if calibrated), f the floor that refining at a
fixed h/dx leaves, linear between supports, and h/L the support over the length that is resolved.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["ORDERS_FILE", "Orders", "Point", "fit", "load_orders", "sampling_constant"]

Array = NDArray[np.float64]
ORDERS_FILE = Path(__file__).with_name("orders.json")


@dataclass(frozen=True, kw_only=True)
class Point:
    """A setting as the fit sees it.

    Attributes
    ----------
    deficit : float
        1 - eta_eff/eta [1].
    reach : float
        h/L [1].
    support : float
        h/dx [1].
    error : float
        Measured [1].
    """

    deficit: float
    reach: float
    support: float
    error: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Orders:
    """Error of one problem with one kernel.

    Attributes
    ----------
    viscosity, amplitude, order, rest : float
        c, a, p and b above [1].
    supports, floors : tuple of float
        Where f is known, and f there [1].
    scatter : float
        Measured over predicted error of settings that were not fitted: root mean square factor [1].
    worst : float
        The factor within which 19 of 20 of them lie [1].
    reach : tuple of float
        h/L fitted, smallest and largest.
    smallest : float
        Error fitted: less is never promised, since floor and order may cancel by chance [1].
    fitted, held_out : int
        Settings.
    """

    viscosity: float
    amplitude: float
    order: float
    rest: float
    supports: tuple[float, ...]
    floors: tuple[float, ...]
    scatter: float = math.nan
    worst: float = math.nan
    reach: tuple[float, float] = (0.0, math.inf)
    smallest: float = 0.0
    fitted: int = 0
    held_out: int = 0

    def error(self, point: Point) -> float:
        """Expected [1]."""
        found = _error(self._numbers(), np.array(self.supports), *_columns([point]))
        return max(float(found[0]), self.smallest)

    def _numbers(self) -> Array:
        return np.array(
            [self.viscosity, self.amplitude, self.order, self.rest, *self.floors], dtype=float
        )

    def record(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def _columns(points: Sequence[Point]) -> tuple[Array, Array, Array]:
    table = np.array([(p.deficit, p.reach, p.support) for p in points], dtype=float)
    return table[:, 0], table[:, 1], table[:, 2]


def _error(numbers: Array, supports: Array, deficit: Array, reach: Array, ratio: Array) -> Array:
    c, a, p, b = numbers[:4]
    size = reach**p
    shift = c * deficit + np.interp(ratio, supports, numbers[4:]) + a * size
    return np.asarray(np.sqrt(shift**2 + (b * size) ** 2))


def fit(points: Sequence[Point], held_out: Sequence[Point], supports: ArrayLike) -> Orders:
    """Fit the constants in logarithms of the error, and try them on settings held out.

    Parameters
    ----------
    points, held_out : sequence of Point
        With errors > 0.
    supports : array_like
        h/dx at which the floor is free, increasing.

    Returns
    -------
    Orders
    """
    from scipy.optimize import least_squares

    nodes = np.asarray(supports, dtype=float)
    columns, found = _columns(points), np.log([p.error for p in points])
    scale = float(np.exp(found.max()) / columns[1].max() ** 2)
    low = np.array([-3.0, -np.inf, 1.0, 0.0, *[-1.0] * nodes.size])
    high = np.array([3.0, np.inf, 2.5, np.inf, *[1.0] * nodes.size])
    best: Any = None
    # several signs, as a floor and an order may cancel each other
    for c, sign, floor in product((0.3, 0.8), (-1.0, 1.0), (-0.05, 0.0, 0.05)):
        start = np.array([c, sign * scale, 2.0, 0.3 * scale, *[floor * scale] * nodes.size])
        result = least_squares(
            lambda x: np.log(_error(x, nodes, *columns) + 1e-12) - found,
            start,
            loss="soft_l1",
            bounds=(low, high),
            x_scale=np.array([1.0, scale, 1.0, scale, *[0.05 * scale] * nodes.size]),
        )
        if best is None or result.cost < best.cost:
            best = result
    numbers = best.x.tolist()
    if numbers[0] < 0.0:  # the sign of the whole bracket is free
        numbers = [-each if k not in (2, 3) else each for k, each in enumerate(numbers)]
    others = held_out or points
    away = np.abs(np.log(_error(best.x, nodes, *_columns(others)) / [p.error for p in others]))
    return Orders(
        viscosity=numbers[0],
        amplitude=numbers[1],
        order=numbers[2],
        rest=numbers[3],
        supports=tuple(nodes.tolist()),
        floors=tuple(numbers[4:]),
        scatter=float(np.exp(np.sqrt(np.mean(away**2)))),
        worst=float(np.exp(np.quantile(away, 0.95))),
        reach=(float(columns[1].min()), float(columns[1].max())),
        smallest=min(point.error for point in points),
        fitted=len(points),
        held_out=len(held_out),
    )


@lru_cache(maxsize=1)
def _document() -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads(ORDERS_FILE.read_text(encoding="utf-8"))
    return found


def load_orders(problem: str) -> dict[str, Orders]:
    """Those that the package comes with, by kernel; empty for a problem without."""
    table: dict[str, dict[str, Any]] = _document()["orders"].get(problem, {})
    found = {}
    for kernel, each in table.items():
        values: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in each.items()
        }
        found[kernel] = Orders(**values)
    return found


def sampling_constant(quantity: str) -> tuple[float, float]:
    """Fitted constant of a sampling error, and the factor by which it is off; see `advice`."""
    value, factor = _document()["sampling"][quantity]
    return float(value), float(factor)
