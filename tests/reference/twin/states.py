"""Equations of state P(rho) and their potential energy per mass, by quadrature.

The potential is integrated numerically from P on purpose: an implementation has closed forms,
and those are what this checks. Only differences of it have a meaning.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("artificial_compressibility", "linear", "tait", "ideal_gas", "polynomial", "table")


def _fritsch_carlson_slopes(x: Array, y: Array) -> Array:
    """Node slopes of Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238, circle of radius 3.

    Start: mean of the neighbouring secants (the secant itself at an end), zero where they differ
    in sign; then (alpha, beta) is drawn back to the circle of radius 3.
    """
    secant = np.diff(y) / np.diff(x)
    slope = np.concatenate([secant[:1], 0.5 * (secant[1:] + secant[:-1]), secant[-1:]])
    slope[1:-1][secant[1:] * secant[:-1] <= 0.0] = 0.0
    for k, delta in enumerate(secant):
        if delta == 0.0:
            slope[k] = slope[k + 1] = 0.0
            continue
        alpha, beta = slope[k] / delta, slope[k + 1] / delta
        square = alpha * alpha + beta * beta
        if square > 9.0:
            shrink = 3.0 / np.sqrt(square)
            slope[k], slope[k + 1] = shrink * alpha * delta, shrink * beta * delta
    return slope


def _table(x: Array, y: Array, rho: Array, derivative: bool) -> Array:
    slope = _fritsch_carlson_slopes(x, y)
    k = np.clip(np.searchsorted(x, rho, side="right") - 1, 0, len(x) - 2)
    width = x[k + 1] - x[k]
    t = (rho - x[k]) / width
    if derivative:
        inside = (
            6.0 * t * (t - 1.0) * (y[k] - y[k + 1]) / width
            + (1.0 - t) * (1.0 - 3.0 * t) * slope[k]
            + t * (3.0 * t - 2.0) * slope[k + 1]
        )
        return np.where(rho < x[0], slope[0], np.where(rho > x[-1], slope[-1], inside))
    inside = (
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * y[k]
        + t * (1.0 - t) ** 2 * width * slope[k]
        + t * t * (3.0 - 2.0 * t) * y[k + 1]
        + t * t * (t - 1.0) * width * slope[k + 1]
    )
    below = y[0] + slope[0] * (rho - x[0])
    above = y[-1] + slope[-1] * (rho - x[-1])
    return np.where(rho < x[0], below, np.where(rho > x[-1], above, inside))


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
        return _table(nodes, values, rho, derivative=False)
    raise ValueError(f"unknown equation of state {kind!r}")


def sound_speed_squared(kind: str, parameters: Sequence[float], density: Array) -> Array:
    """dP/drho [length^2/time^2]; central differences of fourth order except for the table."""
    rho = np.asarray(density, dtype=float)
    if kind == "table":
        nodes, values = np.split(np.asarray(parameters, dtype=float), 2)
        return _table(nodes, values, rho, derivative=True)
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
