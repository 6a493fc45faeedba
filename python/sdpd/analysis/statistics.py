"""Estimates with standard errors from correlated samples.

Blocking after Flyvbjerg and Petersen (1989), integrated autocorrelation time after Madras and
Sokal (1988).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arguments import Array, choice, integer, positive, real_array
from .estimate import Bonferroni, Estimate, bonferroni, combine, ensemble, jackknife

__all__ = [
    "AutocorrelationTime",
    "Blocking",
    "Bonferroni",
    "Estimate",
    "block_average",
    "blocking",
    "bonferroni",
    "combine",
    "ensemble",
    "integrated_autocorrelation_time",
    "jackknife",
    "time_average",
]


@dataclass(frozen=True)
class AutocorrelationTime:
    """Integrated autocorrelation time in rows: ``Var(mean) = 2 value sigma^2 / T``.

    Attributes
    ----------
    value, stderr : float
        ``1/2 + sum_t rho(t)`` and its standard error [rows].
    window : int
        Last lag summed [rows].
    converged : bool
        False when no lag satisfied Sokal's rule: the series is too short to tell.
    n_effective : float
        Number of independent samples in the series, ``T / (2 value)``.
    """

    value: float
    stderr: float
    window: int
    converged: bool
    n_effective: float


@dataclass(frozen=True)
class Blocking:
    """Standard error against block length (Flyvbjerg and Petersen).

    Attributes
    ----------
    block_length : ndarray, shape (L,)
        Rows per block, 1, 2, 4, ...
    stderr, stderr_error : ndarray, shape (L,)
        Standard error of the mean at each level and its own uncertainty.
    plateau : int or None
        First level on the plateau; None when the series is too short to show one.
    estimate : Estimate
        Mean with the error of the plateau (without a plateau: the largest level).
    """

    block_length: Array
    stderr: Array
    stderr_error: Array
    plateau: int | None
    estimate: Estimate


def block_average(series: ArrayLike, *, n_blocks: int = 32) -> Estimate:
    """Mean of a correlated series with the standard error of `n_blocks` block means.

    Parameters
    ----------
    series : array_like, shape (T,)
        Samples at equal intervals, any unit. Rows beyond a multiple of `n_blocks` at the
        start are left out of the error but not of the mean.
    n_blocks : int
        Number of blocks, ``2 <= n_blocks <= T``; blocks must be much longer than the
        correlation time (:func:`blocking` shows whether they are).

    Returns
    -------
    Estimate
        ``window`` is (first, last) row.

    Raises
    ------
    ValueError
        If `series` is not 1-d and finite or `n_blocks` is out of range.

    Examples
    --------
    >>> from sdpd.analysis import block_average
    >>> block_average([1.0, 2.0, 3.0, 4.0], n_blocks=2)
    Estimate(value=2.5, stderr=1.0, n_effective=2.0, window=(0.0, 3.0))
    """
    data = real_array("series", series, 1).astype(np.float64)
    integer("n_blocks", n_blocks, low=2, high=data.size)
    length = data.size // n_blocks
    means = data[data.size - n_blocks * length :].reshape(n_blocks, length).mean(axis=1)
    stderr = float(means.std(ddof=1)) / math.sqrt(n_blocks)
    return Estimate(float(data.mean()), stderr, float(n_blocks), (0.0, float(data.size - 1)))


def blocking(series: ArrayLike) -> Blocking:
    """Find the standard error by pairwise blocking, with the plateau found automatically.

    Parameters
    ----------
    series : array_like, shape (T,)
        At least 8 samples at equal intervals, any unit.

    Returns
    -------
    Blocking

    Raises
    ------
    ValueError
        If `series` is not 1-d, not finite or shorter than 8.

    Notes
    -----
    Blocking is that of [1]_. The plateau is the first level whose block length B satisfies
    ``B^3 > 2 T (stderr_B / stderr_1)^4``, which balances bias against noise [2]_.

    References
    ----------
    .. [1] Flyvbjerg and Petersen, J. Chem. Phys. 91, 461 (1989).
    .. [2] Lee, Conduit, Nemec, López Ríos and Drummond, Phys. Rev. E 83, 066706 (2011).
    """
    data = real_array("series", series, 1).astype(np.float64)
    if data.size < 8:
        raise ValueError(f"`series` must have at least 8 samples, got {data.size}")
    total, mean = data.size, float(data.mean())
    lengths, errors, uncertainties = [], [], []
    level, length = data, 1
    while level.size >= 4:
        error = float(level.std(ddof=1)) / math.sqrt(level.size)
        lengths.append(length)
        errors.append(error)
        uncertainties.append(error / math.sqrt(2.0 * (level.size - 1)))
        level = level[level.size % 2 :].reshape(-1, 2).mean(axis=1)
        length *= 2
    plateau = None
    for index, (size, error) in enumerate(zip(lengths, errors, strict=True)):
        if errors[0] == 0.0 or size**3 > 2.0 * total * (error / errors[0]) ** 4:
            plateau = index
            break
    chosen = int(np.argmax(errors)) if plateau is None else plateau
    estimate = Estimate(
        mean, errors[chosen], float(total // lengths[chosen]), (0.0, float(total - 1))
    )
    return Blocking(
        np.array(lengths, dtype=np.float64),
        np.array(errors),
        np.array(uncertainties),
        plateau,
        estimate,
    )


def integrated_autocorrelation_time(
    series: ArrayLike, *, window_factor: float = 5.0
) -> AutocorrelationTime:
    """Integrated autocorrelation time with Sokal's self-consistent window.

    Parameters
    ----------
    series : array_like, shape (T,) or (T, M)
        Samples at equal intervals; M columns are equivalent series whose normalised
        autocorrelations are averaged.
    window_factor : float
        The sum stops at the smallest lag >= `window_factor` times the running sum, > 0.

    Returns
    -------
    AutocorrelationTime
        In rows. White noise has 1/2.

    Raises
    ------
    ValueError
        If `series` is not finite, shorter than 4 rows, or constant.

    References
    ----------
    .. [1] Madras and Sokal, J. Stat. Phys. 50, 109 (1988), appendix C.
    """
    data = real_array("series", series, (1, 2)).astype(np.float64)
    positive("window_factor", window_factor)
    columns = data[:, None] if data.ndim == 1 else data
    rows = columns.shape[0]
    if rows < 4:
        raise ValueError(f"`series` must have at least 4 rows, got {rows}")
    columns = columns - columns.mean(axis=0)
    if not columns.any():
        raise ValueError("`series` must not be constant")
    size = 1 << (2 * rows - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(columns, size, axis=0)) ** 2
    covariance = np.fft.irfft(spectrum.sum(axis=1), size)[:rows] / np.arange(rows, 0, -1)
    running = np.cumsum(covariance / covariance[0]) - 0.5
    lags = np.arange(rows)
    enough = np.flatnonzero(lags >= window_factor * running)
    converged = bool(enough.size and enough[0] <= rows // 2)
    window = int(enough[0]) if converged else rows // 2
    value = max(float(running[window]), 0.5 / rows)
    samples = rows * columns.shape[1]
    stderr = value * math.sqrt(2.0 * (2 * window + 1) / samples)
    return AutocorrelationTime(value, stderr, window, converged, samples / (2.0 * value))


def time_average(series: ArrayLike, *, method: str = "autocorrelation") -> Estimate:
    """Mean of one correlated series with its standard error.

    Parameters
    ----------
    series : array_like, shape (T,)
        Samples at equal intervals, any unit.
    method : {"autocorrelation", "blocking"}
        Error from the integrated autocorrelation time or from the blocking plateau.

    Returns
    -------
    Estimate

    Raises
    ------
    ValueError
        If `series` or `method` is not acceptable.
    """
    choice("method", method, ("autocorrelation", "blocking"))
    data = real_array("series", series, 1).astype(np.float64)
    if method == "blocking":
        return blocking(data).estimate
    span = (0.0, float(data.size - 1))
    if not (data != data[0]).any():
        return Estimate(float(data[0]), 0.0, 1.0, span)
    tau = integrated_autocorrelation_time(data)
    independent = min(max(tau.n_effective, 1.0), float(data.size))
    stderr = float(data.std(ddof=1)) / math.sqrt(independent)
    return Estimate(float(data.mean()), stderr, independent, span)
