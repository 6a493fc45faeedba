r"""Structure in real space: radial distribution, spatial correlations, semivariogram.

Pairs come from periodic k-d trees with the minimum image; blocks are stretches of frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, box_lengths, edges, frames, integer, particle_values, positive
from .blocked import Profile, block_index
from .estimate import Estimate

__all__ = [
    "SpatialCorrelation",
    "SphericalModel",
    "fit_spherical_model",
    "radial_distribution",
    "semivariogram",
    "spatial_correlation",
]

_CHUNK = 2_000_000  # pairs held at a time


@dataclass(frozen=True, kw_only=True, eq=False)
class SpatialCorrelation(Profile):
    """Correlation of two particle properties against distance.

    Attributes
    ----------
    local : Estimate
        Mean product of a particle with itself, the value at distance zero.
    """

    local: Estimate


@dataclass(frozen=True)
class SphericalModel:
    """Spherical model of a semivariogram, ``c0 + s (3/2 r/a - 1/2 (r/a)^3)`` for r < a.

    Attributes
    ----------
    sill, range, nugget : Estimate
        Plateau c0 + s [quantity^2], range a [length], and c0 [quantity^2].
    """

    sill: Estimate
    range: Estimate
    nugget: Estimate

    def __call__(self, distance: ArrayLike) -> Array:
        """Semivariance at distances [length], any shape."""
        r = np.asarray(distance, dtype=np.float64)
        return _spherical(r, self.sill.value, self.range.value, self.nugget.value)


def radial_distribution(
    position: ArrayLike,
    box: ArrayLike,
    *,
    bins: int | ArrayLike = 100,
    max_distance: float | None = None,
    n_blocks: int = 32,
) -> Profile:
    r"""Radial distribution function g(r) in a periodic box.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D) or (N, D)
        Positions, wrapped or not [length]; N >= 2.
    box : array_like, shape (D,)
        Edge lengths [length].
    bins : int or array_like
        Number of equal bins on (0, max_distance), or their edges [length].
    max_distance : float, optional
        At most half the shortest edge, the default [length].
    n_blocks : int
        Blocks of frames behind the standard error; at most T are used.

    Returns
    -------
    Profile
        g(r) [1]; ``window`` is (first, last) frame.

    Raises
    ------
    ValueError
        If shapes, ranges or values are not acceptable.

    Notes
    -----
    .. math:: g(r) = \frac{V}{N(N-1)}\,\frac{\langle n_{pairs}(r, r+dr)\rangle}{V_{shell}}

    Independent particles have g = 1 at any N. The shell volume is exact, so wide bins average
    g with weight r^(D-1).
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    _enough(count)
    limits = _distance_edges(bins, max_distance, lengths)
    block = block_index(rows, _blocks(n_blocks, rows))
    histogram = np.zeros((int(block[-1]) + 1, limits.size - 1))
    for row in range(rows):
        for _, _, distance in _pairs(data[row], lengths, float(limits[-1])):
            histogram[block[row]] += np.histogram(distance, limits)[0]
    powers = limits**dimension
    shell = np.diff(powers) * (np.pi if dimension == 2 else 4.0 * np.pi / 3.0)
    expected = count * (count - 1.0) * shell / float(np.prod(lengths))
    per_block = np.bincount(block)[:, None] * np.ones_like(histogram)
    return Profile(
        edges=limits,
        blocks=histogram / (per_block * expected),
        block_counts=per_block,
        window=(0.0, float(rows - 1)),
    )


def spatial_correlation(
    position: ArrayLike,
    box: ArrayLike,
    first: ArrayLike,
    second: ArrayLike | None = None,
    *,
    bins: int | ArrayLike = 50,
    max_distance: float | None = None,
    n_blocks: int = 32,
    subtract_mean: bool = False,
) -> SpatialCorrelation:
    r"""Correlation of particle properties (density, velocity, momentum) against distance.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D) or (N, D)
        Positions, wrapped or not [length].
    box : array_like, shape (D,)
        Edge lengths [length].
    first, second : array_like, shape (T, N) or (T, N, D); (N,) or (N, D) for one frame
        Properties of the particles, any unit; `second` is `first` by default. Vectors are
        contracted and divided by D.
    bins, max_distance, n_blocks
        As in :func:`radial_distribution`.
    subtract_mean : bool
        Subtract the mean over all frames and particles first.

    Returns
    -------
    SpatialCorrelation
        ``<a_i b_j>`` over the pairs of each bin, in the product of the units. ``local`` is the
        same for i = j. Over the pairs of all distances a conserved total leaves -local/(N - 1).

    Raises
    ------
    ValueError
        If shapes, ranges or values are not acceptable.
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    _enough(count)
    a = _values("first", first, rows, count, subtract_mean)
    b = a if second is None else _values("second", second, rows, count, subtract_mean)
    if a.shape != b.shape:
        raise ValueError(f"`second` must have the shape of `first`, {a.shape}, got {b.shape}")
    limits = _distance_edges(bins, max_distance, lengths)
    block = block_index(rows, _blocks(n_blocks, rows))
    sums = np.zeros((int(block[-1]) + 1, limits.size - 1))
    counts = np.zeros_like(sums)
    same = np.zeros(sums.shape[0])
    for row in range(rows):
        same[block[row]] += float(np.mean(a[row] * b[row]))
        for i, j, distance in _pairs(data[row], lengths, float(limits[-1])):
            product = np.einsum("pc,pc->p", a[row, i], b[row, j]) / a.shape[2]
            _accumulate(sums[block[row]], counts[block[row]], limits, distance, product)
    profile = Profile.from_sums(limits, sums, counts, (0.0, float(rows - 1)))
    per_block = same / np.bincount(block)
    stderr = float(per_block.std(ddof=1) / np.sqrt(per_block.size)) if rows > 1 else np.nan
    local = Estimate(float(np.mean(a * b)), stderr, float(per_block.size), profile.window)
    return SpatialCorrelation(
        edges=limits, blocks=profile.blocks, block_counts=counts, window=profile.window, local=local
    )


def semivariogram(
    position: ArrayLike,
    box: ArrayLike,
    value: ArrayLike,
    *,
    bins: int | ArrayLike = 50,
    max_distance: float | None = None,
    n_blocks: int = 32,
) -> Profile:
    r"""Semivariance of a scalar particle property against distance.

    Parameters
    ----------
    position, box, bins, max_distance, n_blocks
        As in :func:`radial_distribution`.
    value : array_like, shape (T, N); (N,) for one frame
        Property of the particles, any unit.

    Returns
    -------
    Profile
        [unit of the property squared].

    Raises
    ------
    ValueError
        If shapes, ranges or values are not acceptable.

    Notes
    -----
    .. math:: \gamma(r) = \tfrac12\langle (z_i - z_j)^2\rangle_{r_{ij}\in\mathrm{bin}}

    References
    ----------
    .. [1] Cressie, *Statistics for Spatial Data*, revised ed., 1993, sec. 2.4.
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    _enough(count)
    z = _values("value", value, rows, count, False)
    if z.shape[2] != 1:
        raise ValueError("`value` must be one number per particle")
    limits = _distance_edges(bins, max_distance, lengths)
    block = block_index(rows, _blocks(n_blocks, rows))
    sums = np.zeros((int(block[-1]) + 1, limits.size - 1))
    counts = np.zeros_like(sums)
    for row in range(rows):
        for i, j, distance in _pairs(data[row], lengths, float(limits[-1])):
            half = 0.5 * (z[row, i, 0] - z[row, j, 0]) ** 2
            _accumulate(sums[block[row]], counts[block[row]], limits, distance, half)
    return Profile.from_sums(limits, sums, counts, (0.0, float(rows - 1)))


def fit_spherical_model(
    variogram: Profile, *, sill: float | None = None, nugget: bool = False
) -> SphericalModel:
    """Fit the spherical model to a semivariogram.

    Parameters
    ----------
    variogram : Profile
        From :func:`semivariogram`, with at least two blocks; empty bins are left out.
    sill : float, optional
        Known plateau, held fixed (Bian et al. 2015 take the variance) [quantity^2]; > 0.
    nugget : bool
        Fit a jump at the origin as well; zero otherwise.

    Returns
    -------
    SphericalModel
        Errors by the jackknife over the blocks: bins need not be independent.

    Raises
    ------
    ValueError
        If fewer bins than parameters are filled, or `sill` is not > 0.
    """
    from scipy import optimize

    if sill is not None:
        positive("sill", sill)
    used = np.isfinite(variogram.mean) & (variogram.block_counts > 0).all(axis=0)
    free = 1 + (sill is None) + nugget
    if int(used.sum()) < free + 1:
        raise ValueError(f"`variogram` must have more than {free} filled bins, got {used.sum()}")
    r = variogram.centers[used]
    weight = np.sqrt(variogram.counts[used] / variogram.counts[used].max())
    scale = float(np.max(variogram.mean[used])) or 1.0

    def fitted(mean: Array) -> Array:
        y = mean[used] / scale

        def residual(p: Array) -> Array:
            top = p[1] if sill is None else sill / scale
            return np.asarray(weight * (_spherical(r, top, p[0], p[-1] if nugget else 0.0) - y))

        start = [0.5 * r[-1]] + ([1.0] if sill is None else []) + ([0.0] if nugget else [])
        low = [1e-3 * r[0]] + [0.0] * (free - 1)
        best = optimize.least_squares(residual, start, bounds=(low, np.inf), xtol=1e-12)
        p = best.x
        top = p[1] * scale if sill is None else float(sill)
        return np.array([top, p[0], p[-1] * scale if nugget else 0.0])

    span = (float(r[0]), float(r[-1]))
    leave = np.array([fitted(row) for row in variogram.leave_one_out()])
    whole, count = fitted(variogram.mean), variogram.n_blocks
    spread = np.sqrt((count - 1) / count * np.sum((leave - leave.mean(axis=0)) ** 2, axis=0))
    made = [
        Estimate(float(v), float(s), float(count), span) for v, s in zip(whole, spread, strict=True)
    ]
    return SphericalModel(*made)


def _spherical(r: Array, sill: float, reach: float, nugget: float) -> Array:
    x = np.minimum(r / reach, 1.0)
    return np.asarray(nugget + (sill - nugget) * x * (1.5 - 0.5 * x**2))


def _pairs(
    position: NDArray[Any], box: Array, max_distance: float
) -> Iterator[tuple[NDArray[Any], NDArray[Any], Array]]:
    """Yield ordered pairs i != j closer than `max_distance`: i, j, distance."""
    from scipy.spatial import cKDTree

    folded = position.astype(np.float64)
    folded -= box * np.floor(folded / box)
    folded = np.where(folded >= box, 0.0, folded)  # -tiny folds to the edge itself
    tree = cKDTree(folded, boxsize=box)
    expected = folded.shape[0] * min(1.0, (2.0 * max_distance) ** box.size / float(np.prod(box)))
    width = max(1, int(_CHUNK / (expected + 1.0)))
    for start in range(0, folded.shape[0], width):
        part = cKDTree(folded[start : start + width], boxsize=box)
        found = part.sparse_distance_matrix(tree, max_distance, output_type="ndarray")
        i, j = found["i"] + start, found["j"]
        other = i != j
        yield i[other], j[other], found["v"][other]


def _accumulate(sums: Array, counts: Array, limits: Array, distance: Array, value: Array) -> None:
    index = np.searchsorted(limits, distance, side="right") - 1
    inside = (index >= 0) & (index < sums.size)
    sums += np.bincount(index[inside], value[inside], sums.size)
    counts += np.bincount(index[inside], minlength=sums.size)


def _distance_edges(bins: int | ArrayLike, max_distance: float | None, box: Array) -> Array:
    half = 0.5 * float(box.min())
    high = half if max_distance is None else positive("max_distance", max_distance)
    limits = edges("bins", bins, low=0.0, high=high)
    if limits[0] < 0.0 or limits[-1] > half * (1.0 + 1e-12):
        raise ValueError(
            f"`max_distance` must be <= half the shortest box edge, {half:.6g}, got "
            f"{limits[-1]:.6g}"
        )
    return limits


def _values(name: str, value: ArrayLike, rows: int, count: int, subtract: bool) -> Array:
    array = particle_values(name, value, rows, count)
    return array - array.mean(axis=(0, 1)) if subtract else array


def _blocks(n_blocks: int, rows: int) -> int:
    return min(integer("n_blocks", n_blocks, low=1), rows)


def _enough(count: int) -> None:
    if count < 2:
        raise ValueError(f"`position` must hold at least 2 particles, got {count}")
