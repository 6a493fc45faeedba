r"""Fourier components of particle fields, structure factor, cell counts.

rho_k = sum_i w_i exp(i k.r_i) at the wave vectors k = 2 pi (n_x/L_x, ...) a periodic box allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, box_lengths, frames, integer, particle_values, positive, real_array
from .blocked import BlockedFunction, block_index
from .cells import cell_index
from .estimate import Estimate

__all__ = [
    "StructureFactor",
    "allowed_wave_vectors",
    "cell_variance",
    "fourier_components",
    "structure_factor",
]

_CHUNK = 2_000_000  # complex numbers held at a time


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureFactor(BlockedFunction):
    """Static structure factor on shells of allowed wave vectors.

    Attributes
    ----------
    wave_number : ndarray, shape (M,)
        |k| of each shell [1/length].
    n_vectors : ndarray of int, shape (M,)
        Independent wave vectors (k and -k count once) in each shell.
    """

    wave_number: Array
    n_vectors: NDArray[np.int64]


def allowed_wave_vectors(box: ArrayLike, max_wave_number: float) -> NDArray[np.int64]:
    """List the integer wave vectors n of one half space with 0 < |k| <= a limit, by |k|.

    Parameters
    ----------
    box : array_like, shape (D,)
        Edge lengths [length]; k = 2 pi n / L.
    max_wave_number : float
        Largest |k| [1/length], > 0.

    Returns
    -------
    ndarray of int64, shape (K, D)

    Raises
    ------
    ValueError
        If no wave vector is that short, or an argument is out of range.
    """
    lengths = np.atleast_1d(real_array("box", box, 1)).astype(np.float64)
    lengths = box_lengths(lengths, lengths.size)
    limit = positive("max_wave_number", max_wave_number)
    reach = [int(limit * length / (2.0 * np.pi) * (1.0 + 1e-12)) for length in lengths]
    grids = np.meshgrid(*[np.arange(-n, n + 1) for n in reach], indexing="ij")
    vectors = np.stack(grids, axis=-1).reshape(-1, lengths.size)
    ordered = vectors @ (np.cumprod([1] + [2 * n + 1 for n in reach[:0:-1]])[::-1])
    squared = np.sum((2.0 * np.pi * vectors / lengths) ** 2, axis=1)
    keep = (ordered > 0) & (squared <= limit**2 * (1.0 + 1e-9))
    if not keep.any():
        raise ValueError(
            f"`max_wave_number` must be >= {2.0 * np.pi / lengths.max():.6g}, the smallest of the "
            f"box, got {limit:.6g}"
        )
    vectors, squared = vectors[keep], squared[keep]
    order = np.argsort(np.round(squared / squared.min(), 9), kind="stable")
    return np.asarray(vectors[order], dtype=np.int64)


def fourier_components(
    position: ArrayLike,
    box: ArrayLike,
    wave_vectors: ArrayLike,
    value: ArrayLike | None = None,
) -> NDArray[np.complex128]:
    r"""Fourier components of a particle field at integer wave vectors.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D) or (N, D)
        Positions, wrapped or not [length].
    box : array_like, shape (D,)
        Edge lengths [length].
    wave_vectors : array_like of int, shape (K, D)
        n of k = 2 pi n / L, none of them zero.
    value : array_like, shape (T, N) or (T, N, C), optional
        Weight of each particle, any unit; 1 by default.

    Returns
    -------
    ndarray of complex128, shape (T, K), or (T, K, C) for vector weights

    Raises
    ------
    TypeError
        If `wave_vectors` are not integers.
    ValueError
        If shapes or values are not acceptable.

    Notes
    -----
    .. math:: A_{\mathbf k}(t) = \sum_i a_i(t)\,e^{\,i\mathbf k\cdot\mathbf r_i(t)}
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    vectors = integer_vectors(wave_vectors, dimension)
    weights = None if value is None else real_array("value", value, (1, 2, 3))
    if weights is not None:
        weights = weights[None] if np.ndim(position) == 2 else weights
        if weights.ndim < 2 or weights.shape[:2] != (rows, count):
            raise ValueError(
                f"`value` must start with shape ({rows}, {count}), got {weights.shape}"
            )
    tail = () if weights is None else weights.shape[2:]
    result = np.empty((rows, len(vectors), *tail), dtype=np.complex128)
    width = max(1, _CHUNK // count)
    for row in range(rows):
        powers = _axis_powers(data[row].astype(np.float64) / lengths, np.abs(vectors).max(axis=0))
        for start in range(0, len(vectors), width):
            wave = _waves(powers, vectors[start : start + width])
            summed = wave.sum(axis=1) if weights is None else wave @ weights[row]
            result[row, start : start + width] = summed
    return result


def structure_factor(
    position: ArrayLike, box: ArrayLike, *, max_wave_number: float, n_blocks: int = 32
) -> StructureFactor:
    r"""Static structure factor S(k) on the shells of wave vectors a periodic box allows.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D) or (N, D)
        Positions, wrapped or not [length].
    box : array_like, shape (D,)
        Edge lengths [length].
    max_wave_number : float
        Largest |k| [1/length].
    n_blocks : int
        Blocks of frames behind the standard error; at most T are used.

    Returns
    -------
    StructureFactor
        [1]; ``window`` is (first, last) frame.

    Raises
    ------
    ValueError
        If shapes, ranges or values are not acceptable.

    Notes
    -----
    .. math:: S(k) = \tfrac1N\langle|\rho_{\mathbf k}|^2\rangle

    1 for independent particles. Nothing is extrapolated to k = 0, where a closed box has S = 0.
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    vectors = allowed_wave_vectors(lengths, max_wave_number)
    power = np.abs(fourier_components(data, lengths, vectors)) ** 2 / count
    wave_number = np.sqrt(np.sum((2.0 * np.pi * vectors / lengths) ** 2, axis=1))
    shell, sizes = shells(wave_number)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    per_row = np.add.reduceat(power, starts, axis=1) / sizes
    block = block_index(rows, min(integer("n_blocks", n_blocks, low=1), rows))
    number = np.bincount(block)
    sums = np.add.reduceat(per_row, np.searchsorted(block, np.arange(number.size)), axis=0)
    return StructureFactor(
        wave_number=shell,
        n_vectors=sizes,
        blocks=sums / number[:, None],
        block_counts=np.multiply.outer(number, sizes).astype(np.float64),
        window=(0.0, float(rows - 1)),
    )


def cell_variance(
    position: ArrayLike,
    box: ArrayLike,
    *,
    cells: Sequence[int],
    value: ArrayLike | None = None,
    n_blocks: int = 32,
) -> Estimate:
    r"""Variance over cells and frames of what a sharp cell contains.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D)
        Positions, wrapped or not [length].
    box : array_like, shape (D,)
        Edge lengths [length].
    cells : sequence of int, length D
        Equal cells along each axis, more than one in all.
    value : array_like, shape (T, N) or (T, N, C), optional
        Summed over the particles of a cell; without it they are counted. Components are averaged.
    n_blocks : int
        Blocks of frames behind the standard error, ``2 <= n_blocks <= T``.

    Returns
    -------
    Estimate
        Variance about the mean of all cells [particles^2 or unit^2]; compare counts with
        :func:`sdpd.theory.cell_count_variance`. ``window`` is (first, last) frame.

    Raises
    ------
    ValueError
        If shapes, ranges or values are not acceptable.
    """
    data = frames("position", position)
    rows, count, dimension = data.shape
    lengths = box_lengths(box, dimension)
    shape = [integer("cells", n, low=1) for n in cells]
    total = int(np.prod(shape))
    if len(shape) != dimension or total < 2:
        raise ValueError(f"`cells` must be {dimension} counts, more than one cell, got {shape}")
    integer("n_blocks", n_blocks, low=2, high=rows)
    if value is None:
        weights = np.ones((rows, count, 1))
    else:
        weights = particle_values("value", value, rows, count)
    variance = np.empty(rows)
    for row in range(rows):
        flat = cell_index(data[row], lengths, tuple(shape))
        sums = [np.bincount(flat, weights[row, :, c], total) for c in range(weights.shape[2])]
        mean = weights[row].sum(axis=0) / total
        variance[row] = np.mean((np.array(sums) - mean[:, None]) ** 2)
    block = block_index(rows, n_blocks)
    means = np.bincount(block, variance) / np.bincount(block)
    stderr = float(means.std(ddof=1)) / n_blocks**0.5
    return Estimate(float(variance.mean()), stderr, float(n_blocks), (0.0, float(rows - 1)))


def integer_vectors(wave_vectors: ArrayLike, dimension: int) -> NDArray[np.int64]:
    """Check integer wave vectors, shape (K, D), none zero."""
    vectors = np.asarray(wave_vectors)
    if vectors.dtype.kind not in "iu":
        raise TypeError(f"`wave_vectors` must be integers, got dtype {vectors.dtype}")
    if vectors.ndim != 2 or vectors.shape[1] != dimension or not len(vectors):
        raise ValueError(f"`wave_vectors` must have shape (K, {dimension}), got {vectors.shape}")
    if not vectors.any(axis=1).all():
        raise ValueError("`wave_vectors` must not contain the zero vector")
    return vectors.astype(np.int64)


def shells(wave_number: Array) -> tuple[Array, NDArray[np.int64]]:
    """Group ascending wave numbers that agree to 1e-9: the values and how many each has."""
    new = np.concatenate([[True], np.diff(wave_number) > 1e-9 * wave_number[1:]])
    starts = np.flatnonzero(new)
    return wave_number[starts], np.diff(np.append(starts, wave_number.size))


def _axis_powers(share: Array, reach: NDArray[Any]) -> list[NDArray[np.complex128]]:
    """exp(2 pi i n x/L) for n = 0 .. reach of each axis, shapes (reach + 1, N)."""
    powers = []
    for axis, highest in enumerate(reach):
        x = share[:, axis] - np.floor(share[:, axis])
        powers.append(np.exp(2.0j * np.pi * np.arange(highest + 1)[:, None] * x))
    return powers


def _waves(powers: list[NDArray[np.complex128]], vectors: NDArray[Any]) -> NDArray[np.complex128]:
    """exp(i k.r) for each vector and particle, shape (K, N)."""
    wave: Any = 1.0
    for axis, power in enumerate(powers):
        n = vectors[:, axis]
        factor = power[np.abs(n)]
        negative = n < 0
        if negative.any():
            factor[negative] = np.conj(factor[negative])
        wave = wave * factor
    return np.asarray(wave, dtype=np.complex128)
