"""Equations of state P(rho) and their potential energy per mass, by quadrature.

The potential is integrated numerically from P on purpose: an implementation has closed forms,
and those are what this checks. Only differences of it have a meaning.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

Array = NDArray[np.float64]

KINDS = ("artificial_compressibility", "linear", "tait", "ideal_gas", "polynomial", "table")


def _table(nodes: Array, values: Array, rho: Array, order: int = 0) -> Array:
    """Monotone piecewise cubic (SciPy's, Fritsch and Butland 1984), straight beyond the ends."""
    cubic = PchipInterpolator(nodes, values)
    inside = np.clip(rho, nodes[0], nodes[-1])
    slope = cubic(inside, 1)
    return slope if order == 1 else cubic(inside) + slope * (rho - inside)


def pressure(kind: str, parameters: Sequence[float], density: Array) -> Array:
    """Pressure [force/length^(D-1)] at a mass density."""
    rho = np.asarray(density, dtype=float)
    if kind == "artificial_compressibility":
        rho0, c = parameters
        return rho0 * c**2 / 2.0 * ((rho / rho0) ** 2 - 1.0)
    if kind == "linear":
        rho0, c, p0 = parameters
        return p0 + c**2 * (rho - rho0)
    if kind == "tait":
        rho0, c, exponent, background = parameters
        return rho0 * c**2 / exponent * ((rho / rho0) ** exponent - 1.0) + background
    if kind == "ideal_gas":
        (c,) = parameters
        return c**2 * rho
    if kind == "polynomial":
        return sum((a * rho**k for k, a in enumerate(parameters)), np.zeros_like(rho))
    if kind == "table":
        nodes, values = np.split(np.asarray(parameters, dtype=float), 2)
        return _table(nodes, values, rho)
    raise ValueError(f"unknown equation of state {kind!r}")


def sound_speed_squared(kind: str, parameters: Sequence[float], density: Array) -> Array:
    """dP/drho [length^2/time^2]; central differences of fourth order except for the table."""
    rho = np.asarray(density, dtype=float)
    if kind == "table":
        nodes, values = np.split(np.asarray(parameters, dtype=float), 2)
        return _table(nodes, values, rho, order=1)
    step = 1e-3 * rho
    near = pressure(kind, parameters, rho + step) - pressure(kind, parameters, rho - step)
    far = pressure(kind, parameters, rho + 2 * step) - pressure(kind, parameters, rho - 2 * step)
    return (8.0 * near - far) / (12.0 * step)


def specific_potential(
    kind: str, parameters: Sequence[float], density: Array, reference: float
) -> Array:
    """Integral of P/rho^2 from `reference` to `density` [energy/mass], Gauss-Legendre."""
    rho = np.atleast_1d(np.asarray(density, dtype=float))
    x, weight = np.polynomial.legendre.leggauss(48)
    breaks = np.split(np.asarray(parameters), 2)[0] if kind == "table" else np.empty(0)
    result = np.empty_like(rho)
    for index, end in np.ndenumerate(rho):
        low, high = sorted((reference, float(end)))
        cuts = np.concatenate([[low], breaks[(breaks > low) & (breaks < high)], [high]])
        half, middle = 0.5 * np.diff(cuts), 0.5 * (cuts[1:] + cuts[:-1])
        nodes = middle[:, None] + half[:, None] * x
        value = pressure(kind, parameters, nodes) / nodes**2
        result[index] = np.copysign(1.0, end - reference) * np.sum(half[:, None] * weight * value)
    return result.reshape(np.shape(density))
