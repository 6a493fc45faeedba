"""Distributions of samples: probability densities and quantile-quantile data, with errors.

Samples of a simulation are correlated in time, so errors come from blocks of rows: the share of
samples below a point is a mean like any other, and the error of a quantile is that of the share
over the density (Bahadur, Ann. Math. Statist. 37, 577 (1966)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .arguments import Array, choice, edges, finite, integer, positive, real_array
from .blocked import Profile, block_index

__all__ = ["Distribution", "QuantileData", "probability_density", "quantiles"]


class Distribution(Protocol):
    """What a reference distribution must offer; frozen ones of ``scipy.stats`` do."""

    def ppf(self, q: Any) -> Any:
        """Quantiles at probabilities."""

    def pdf(self, x: Any) -> Any:
        """Probability density."""


@dataclass(frozen=True)
class QuantileData:
    """Points of a quantile-quantile plot.

    Attributes
    ----------
    theoretical, empirical : ndarray, shape (Q,)
        Quantiles of the distribution and of the sample (same unit).
    probability : ndarray, shape (Q,)
        Probability of each point.
    stderr : ndarray, shape (Q,)
        Standard error of the empirical quantile.
    n_effective : float
        Independent samples behind each error; blocks, where there are blocks.
    """

    theoretical: Array
    empirical: Array
    probability: Array
    stderr: Array
    n_effective: float

    @property
    def z(self) -> Array:
        """Distance from the distribution in standard errors, shape (Q,); neighbours are alike."""
        return np.asarray((self.empirical - self.theoretical) / self.stderr)


def quantiles(
    samples: ArrayLike,
    *,
    distribution: str | Distribution = "normal",
    mean: float | None = 0.0,
    deviation: float | None = 1.0,
    count: int = 199,
    n_blocks: int | None = None,
) -> QuantileData:
    """Quantile-quantile data of a sample against a distribution.

    Parameters
    ----------
    samples : array_like, shape (T,) or (T, ...)
        Rows in time; each may hold many values, all of one distribution. Any unit.
    distribution : "normal" or object with ``ppf`` and ``pdf``
        What to compare with; frozen distributions of ``scipy.stats`` are such objects, e.g.
        ``stats.maxwell(scale=v_th)`` for speeds in 3D.
    mean, deviation : float or None
        Of the normal distribution, same unit, deviation > 0; that of the sample if None.
    count : int
        Number of quantiles, at probabilities ``(1 .. count) / (count + 1)``.
    n_blocks : int, optional
        Blocks of rows behind the errors, ``2 <= n_blocks <= T``, each much longer than the
        correlation time. Without it all samples are taken as independent.

    Returns
    -------
    QuantileData

    Raises
    ------
    TypeError
        If `distribution` is neither a name nor a distribution.
    ValueError
        If there are fewer than two finite samples or a parameter is out of range.

    Notes
    -----
    The error is ``stderr(share of samples below the quantile) / pdf``; for independent samples
    sqrt(p (1 - p)/n)/pdf. A fitted mean or deviation takes its share of the distance off, so z is
    then smaller than its nominal distribution says.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import analysis
    >>> sample = np.random.default_rng(1).normal(3.0, 0.5, size=(1000, 20))
    >>> data = analysis.quantiles(sample, mean=3.0, deviation=0.5, count=9, n_blocks=20)
    >>> bool(abs(data.z).max() < 4.0)
    True
    """
    rows = _rows(samples)
    integer("count", count, low=1)
    reference = _reference(distribution, rows, mean, deviation)
    probability = np.arange(1, count + 1) / (count + 1.0)
    theoretical = np.asarray(reference.ppf(probability), dtype=np.float64)
    empirical = np.quantile(rows, probability)
    if n_blocks is None:
        share_error = np.sqrt(probability * (1.0 - probability) / rows.size)
        independent = float(rows.size)
    else:
        share_error = _share_error(rows, empirical, n_blocks)
        independent = float(n_blocks)
    density = np.asarray(reference.pdf(theoretical), dtype=np.float64)
    return QuantileData(theoretical, empirical, probability, share_error / density, independent)


def probability_density(
    samples: ArrayLike, *, bins: int | ArrayLike = 100, n_blocks: int = 32
) -> Profile:
    """Probability density of a sample in bins, with blocked standard errors.

    Parameters
    ----------
    samples : array_like, shape (T,) or (T, ...)
        Rows in time; each may hold many values, all of one distribution. Any unit.
    bins : int or array_like
        Number of equal bins over the range of the sample, or their edges in its unit.
    n_blocks : int
        Blocks of rows behind the standard error; at most T are used.

    Returns
    -------
    Profile
        Density [1/unit]: of *all* samples, so that it integrates to the share inside the bins. Bins
        are means over their width. ``window`` is (first, last) row.

    Raises
    ------
    ValueError
        If there are fewer than two finite samples or a parameter is out of range.
    """
    rows = _rows(samples)
    low, high = float(rows.min()), float(rows.max())
    if low == high:
        high = low + (abs(low) or 1.0)  # one value: a bin that holds it
    limits = edges("bins", bins, low=low, high=high)
    block = block_index(len(rows), min(integer("n_blocks", n_blocks, low=1), len(rows)))
    size = rows.shape[1]
    counted = np.stack(
        [np.histogram(rows[block == b], limits)[0] for b in range(int(block[-1]) + 1)]
    )
    total = np.empty(counted.shape, dtype=np.float64)
    total[:] = (np.bincount(block) * float(size))[:, None]
    return Profile(
        edges=limits,
        blocks=counted / total / np.diff(limits),
        block_counts=total,
        window=(0.0, len(rows) - 1.0),
    )


def _rows(samples: ArrayLike) -> Array:
    """Samples as (T, M)."""
    data = np.asarray(samples)
    flat = real_array("samples", data.reshape(len(data), -1) if data.ndim > 1 else data, (1, 2))
    rows = flat.astype(np.float64).reshape(len(flat), -1)
    if rows.size < 2:
        raise ValueError(f"`samples` must hold at least 2 values, got {rows.size}")
    return rows


def _reference(
    distribution: str | Distribution, rows: Array, mean: float | None, deviation: float | None
) -> Distribution:
    if not isinstance(distribution, str):
        if not (hasattr(distribution, "ppf") and hasattr(distribution, "pdf")):
            kind = type(distribution).__name__
            raise TypeError(
                f"`distribution` must be a name or have `ppf` and `pdf`, as the frozen ones of "
                f"scipy.stats do, got {kind}"
            )
        return distribution
    from scipy import stats

    choice("distribution", distribution, ("normal",))
    center = float(rows.mean()) if mean is None else finite("mean", mean)
    width = float(rows.std()) if deviation is None else deviation
    frozen: Distribution = stats.norm(loc=center, scale=positive("deviation", width))
    return frozen


def _share_error(rows: Array, points: Array, n_blocks: int) -> Array:
    """Standard error of the share of samples below each point, from the shares in the blocks."""
    integer("n_blocks", n_blocks, low=2, high=len(rows))
    block = block_index(len(rows), n_blocks)
    share = np.stack(
        [
            np.searchsorted(np.sort(rows[block == b], axis=None), points, side="right")
            / (np.count_nonzero(block == b) * rows.shape[1])
            for b in range(n_blocks)
        ]
    )
    return np.asarray(share.std(axis=0, ddof=1) / np.sqrt(n_blocks))
