"""Fields on fixed (Eulerian) bins: profiles along an axis, correlations between cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, box_lengths, edges, frames, integer, particle_values
from .blocked import BlockedFunction, Profile, block_index

__all__ = ["CellCorrelation", "cell_correlation", "local_profile"]


@dataclass(frozen=True, kw_only=True, eq=False)
class CellCorrelation(BlockedFunction):
    """Correlation of two fields on the cells of a grid against the distance between cells.

    Attributes
    ----------
    distance : ndarray, shape (M,)
        Between cell centres, ascending from 0 [length].
    n_offsets : ndarray of int, shape (M,)
        Cells at that distance from one cell.
    """

    distance: Array
    n_offsets: NDArray[np.int64]


def local_profile(
    position: ArrayLike,
    value: ArrayLike | None = None,
    *,
    axis: int,
    bins: int | ArrayLike,
    box: ArrayLike,
    n_blocks: int = 32,
) -> Profile:
    r"""Profile along an axis: number density, or the mean of a particle property.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D) or (N, D)
        Positions, wrapped or not [length].
    value : array_like, shape (T, N); (N,) for one frame, optional
        Property of the particles, any unit, e.g. ``velocities[..., 0]``; without it the number
        density is returned.
    axis : int
        Axis along which bins lie, 0 .. D - 1.
    bins : int or array_like
        Number of equal bins over the box, or their edges [length] within [0, L].
    box : array_like, shape (D,)
        Edge lengths of the periodic box [length].
    n_blocks : int
        Blocks of frames behind the standard error; at most T are used.

    Returns
    -------
    Profile
        [1/length^D] or the unit of `value`, a mean over the particles found in each bin;
        ``window`` is (first, last) frame.

    Raises
    ------
    ValueError
        If an argument has the wrong shape, is not finite or is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import analysis
    >>> position = np.random.default_rng(1).uniform(0.0, 2.0, size=(100, 80, 2))
    >>> density = analysis.local_profile(position, axis=1, bins=4, box=(2.0, 2.0))
    >>> bool(np.all(np.abs(density.mean - 20.0) < 4.0 * density.stderr))
    True
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    integer("axis", axis, low=0, high=dimension - 1)
    limits = edges("bins", bins, low=0.0, high=float(lengths[axis]))
    if limits[0] < 0.0 or limits[-1] > lengths[axis] * (1.0 + 1e-12):
        raise ValueError(
            f"`bins` must lie between 0 and {lengths[axis]:.6g}, got {limits[0]:.6g} to "
            f"{limits[-1]:.6g}"
        )
    weights = None if value is None else particle_values("value", value, rows, count)
    if weights is not None and weights.shape[2] != 1:
        raise ValueError("`value` must be one number per particle")
    block = block_index(rows, min(integer("n_blocks", n_blocks, low=1), rows))
    size = limits.size - 1
    sums = np.zeros((int(block[-1]) + 1, size))
    counts = np.zeros_like(sums)
    for row in range(rows):
        where = _folded(data[row, :, axis], float(lengths[axis]))
        index = np.searchsorted(limits, where, side="right") - 1
        inside = (index >= 0) & (index < size)
        counts[block[row]] += np.bincount(index[inside], minlength=size)
        if weights is not None:
            sums[block[row]] += np.bincount(index[inside], weights[row, inside, 0], size)
    window = (0.0, rows - 1.0)
    if weights is not None:
        return Profile.from_sums(limits, sums, counts, window)
    volume = np.diff(limits) * float(np.prod(lengths)) / float(lengths[axis])
    number = np.bincount(block)[:, None] * np.ones(size)
    return Profile.from_sums(limits, counts / volume, number, window)


def cell_correlation(
    position: ArrayLike,
    box: ArrayLike,
    first: ArrayLike | None = None,
    second: ArrayLike | None = None,
    *,
    cells: Sequence[int],
    n_blocks: int = 32,
) -> CellCorrelation:
    r"""Correlation of two fields, density or momentum, between the cells of a fixed grid.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D)
        Positions, wrapped or not [length].
    box : array_like, shape (D,)
        Edge lengths of the periodic box [length].
    first, second : array_like, shape (T, N) or (T, N, C), optional
        What each particle adds to its cell, any unit: m v gives the momentum density. The number of
        particles without `first`; `second` is `first` by default. Vectors are contracted and
        divided by C.
    cells : sequence of int, length D
        Equal cells along each axis, more than one in all.
    n_blocks : int
        Blocks of frames behind the standard error; at most T are used.

    Returns
    -------
    CellCorrelation
        In the product of the units over length^(2 D), at the distances between cells up to half the
        shortest edge; ``window`` is (first, last) frame.

    Raises
    ------
    ValueError
        If an argument has the wrong shape, is not finite or is out of range.

    Notes
    -----
    .. math:: C(g) = \langle\delta A(\mathbf x)\,\delta B(\mathbf x+\mathbf g)\rangle,\qquad
              A(\mathbf x) = \frac1{V_c}\sum_{i\in c(\mathbf x)} a_i

    by FFT, with the mean over the cells of each frame taken off. What the box conserves then
    correlates distant cells by -1/(cells - 1) of the value at 0: sharp cells of a large box show
    the delta functions of fluctuating hydrodynamics (Landau and Lifshitz, *Statistical Physics,
    Part 2*, 1980, sec. 88), and a stiff fluid's number density its surface terms
    (:func:`sdpd.theory.cell_count_variance`).
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    shape = tuple(integer("cells", n, low=1) for n in cells)
    if len(shape) != dimension or int(np.prod(shape)) < 2:
        raise ValueError(f"`cells` must be {dimension} counts, more than one cell, got {shape}")
    a = np.ones((rows, count, 1)) if first is None else particle_values("first", first, rows, count)
    b = a if second is None else particle_values("second", second, rows, count)
    if a.shape != b.shape:
        raise ValueError(f"`second` must have the shape of `first`, {a.shape}, got {b.shape}")
    block = block_index(rows, min(integer("n_blocks", n_blocks, low=1), rows))
    axes = tuple(range(dimension))
    sums = np.zeros((int(block[-1]) + 1, *shape))
    for row in range(rows):
        flat = cell_index(data[row], lengths, shape)
        here = _deposit(flat, a[row], shape)
        there = here if b is a else _deposit(flat, b[row], shape)
        one = np.fft.rfftn(here, axes=axes)
        other = one if b is a else np.fft.rfftn(there, axes=axes)
        product = (np.conj(one) * other).sum(axis=-1)
        sums[block[row]] += np.fft.irfftn(product, s=shape, axes=axes)
    total = int(np.prod(shape))
    unit = (total / float(np.prod(lengths))) ** 2 / total / a.shape[2]
    distance, group, offsets = _offsets(lengths, shape)
    number = np.bincount(block)
    flat_sums = sums.reshape(len(number), -1)
    grouped = np.stack([np.bincount(group, row, offsets.size) for row in flat_sums])
    keep = distance <= 0.5 * float(lengths.min()) * (1.0 + 1e-9)
    blocks = unit * grouped / offsets / number[:, None]
    return CellCorrelation(
        distance=distance[keep],
        n_offsets=offsets[keep],
        blocks=blocks[:, keep],
        block_counts=(number[:, None] * offsets)[:, keep].astype(np.float64),
        window=(0.0, rows - 1.0),
    )


def _deposit(flat: NDArray[np.intp], weights: Array, shape: tuple[int, ...]) -> Array:
    """Sums over the particles of each cell less their mean, shape (*cells, C)."""
    total = int(np.prod(shape))
    sums = np.stack([np.bincount(flat, w, total) for w in weights.T], axis=-1)
    return np.asarray((sums - sums.mean(axis=0)).reshape(*shape, -1))


def cell_index(
    position: NDArray[np.float64], box: Array, shape: tuple[int, ...]
) -> NDArray[np.intp]:
    """Flat index of the cell that each particle is in, shape (N,)."""
    share = position.astype(np.float64) / box
    share -= np.floor(share)
    index = np.minimum((share * shape).astype(np.int64), np.array(shape) - 1)
    return np.asarray(np.ravel_multi_index(tuple(index.T), shape))


def _offsets(
    box: Array, shape: tuple[int, ...]
) -> tuple[Array, NDArray[np.intp], NDArray[np.int64]]:
    """Distances between cells, the group of each offset, and how many offsets each group has."""
    axes = []
    for edge, n in zip(box, shape, strict=True):
        turns = np.arange(n)
        axes.append((np.minimum(turns, n - turns) * edge / n) ** 2)
    squared = axes[0]
    for axis in axes[1:]:
        squared = np.add.outer(squared, axis)
    flat = np.sqrt(squared.ravel())
    _, first, group = np.unique(
        np.round(flat / float(box.min()), 9), return_index=True, return_inverse=True
    )
    return flat[first], group, np.bincount(group)


def _folded(where: NDArray[np.float64], length: float) -> Array:
    folded = where.astype(np.float64)
    folded -= length * np.floor(folded / length)
    return np.where(folded >= length, 0.0, folded)  # -tiny folds to the edge itself
