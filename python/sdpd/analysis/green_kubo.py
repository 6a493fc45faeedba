"""Green-Kubo sums over interval means, of whatever current.

For interval means of a current the sum Dt (C_0/2 + C_1 + ... + C_n) is no quadrature but half the
slope of the mean square of its time integral between the lags n and n + 1: exact for any interval,
with a delta-correlated current in C_0 alone.
"""

from __future__ import annotations

import numpy as np

from .arguments import positive
from .correlation import Correlation
from .estimate import Estimate

__all__ = ["green_kubo", "running_sum"]


def green_kubo(autocorrelation: Correlation, *, factor: float, cutoff: float | None) -> Estimate:
    """`factor` times the sum up to the lag `cutoff` [time]; the last one at hand if None.

    Raises
    ------
    ValueError
        If the lags are not equally spaced from 0, or do not reach the cut-off.
    """
    autocorrelation.require_lag_zero()
    unit = factor * autocorrelation.step
    lag = autocorrelation.lag
    end = float(lag[-1]) if cutoff is None else positive("cutoff", cutoff)
    if end > float(lag[-1]) * (1.0 + 1e-9):
        raise ValueError(f"`cutoff` must be <= the last lag {lag[-1]:.6g}, got {end:.6g}")
    count = int(np.searchsorted(lag, end * (1.0 + 1e-9), side="right"))
    return autocorrelation.derive(
        lambda mean: unit * float(mean[:count].sum() - 0.5 * mean[0]),
        window=(0.0, float(lag[count - 1])),
    )


def running_sum(autocorrelation: Correlation, *, factor: float) -> Correlation:
    """`factor` times the sum against its cut-off.

    Raises
    ------
    ValueError
        If the lags are not equally spaced from 0.
    """
    autocorrelation.require_lag_zero()
    unit = factor * autocorrelation.step
    return autocorrelation.transformed(
        lambda mean: unit * (np.cumsum(mean, axis=-1) - 0.5 * mean[..., :1])
    )
