r"""Straight lines through mean square displacements, of particles or of a Helfand moment.

The weights are those of a Brownian walk, whose overlapping displacements over lags of n <= m rows
have covariance proportional to (m - n + 1) n^2 + n (n - 1)(2 n - 1)/3 for many origins. Qian,
Sheetz and Elson, Biophys. J. 60, 910 (1991); Bullerjahn, von Bülow and Hummer, J. Chem. Phys. 153,
024116 (2020).
"""

from __future__ import annotations

import numpy as np

from .arguments import Array, choice
from .correlation import Correlation
from .estimate import Estimate

__all__ = ["fitted_slope"]


def fitted_slope(
    curve: Correlation, *, window: tuple[float, float], weights: str, factor: float
) -> Estimate:
    """Estimate `factor` times the slope of a straight line with intercept over a window of lags.

    The slope is linear in the curve, so the jackknife over blocks is exact: it equals the spread of
    the blocks' own slopes.

    Raises
    ------
    ValueError
        If the window holds fewer than two lags or leaves their range, or `weights` is unknown.
    """
    choice("weights", weights, ("brownian", "generalized", "uniform"))
    inside = curve.lags_within(window, least=2)
    lag = curve.lag[inside]
    # Lags need not be equally spaced: their number of rows follows from the closest two.
    rows = np.maximum(np.rint(lag / curve.resolution), 1.0)
    combination = factor * slope_weights(lag, rows, weights)
    return curve.derive(
        lambda mean: float(combination @ mean[inside]), window=(float(lag[0]), float(lag[-1]))
    )


def slope_weights(lag: Array, rows: Array, weights: str) -> Array:
    """Vector w with ``w @ msd`` the fitted slope; `rows` are the lags in rows."""
    scaled = lag / lag[-1]  # SI lags of 1e-12 would ill-condition the normal equations
    design = np.stack([np.ones_like(lag), scaled], axis=1)
    low, high = np.minimum.outer(rows, rows), np.maximum.outer(rows, rows)
    covariance = (high - low + 1.0) * low**2 + low * (low - 1.0) * (2.0 * low - 1.0) / 3.0
    if weights == "uniform":
        covariance = np.eye(lag.size)
    elif weights == "brownian":
        covariance = np.diag(np.diag(covariance))
    solved = np.linalg.solve(covariance / covariance.max(), design)
    return np.asarray(np.linalg.solve(design.T @ solved, solved.T)[1] / lag[-1])
