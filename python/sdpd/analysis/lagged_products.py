"""Sums over time origins of lagged products, block by block, by FFT in bounded memory."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import Array, choice, integer

_CHUNK = 2_000_000  # numbers transformed at a time: bounds the scratch memory to about 100 MB


@dataclass(frozen=True)
class BlockPlan:
    """How T rows and N columns are cut into blocks of origins."""

    total: int
    columns: int
    max_lag: int
    n_blocks: int
    by: str

    def blocks(self) -> Iterator[tuple[slice, slice]]:
        """Yield (origin rows, columns) of each block."""
        size = self.total if self.by == "time" else self.columns
        cuts = [round(size * b / self.n_blocks) for b in range(self.n_blocks + 1)]
        for start, stop in itertools.pairwise(cuts):
            part = slice(start, stop)
            if self.by == "time":
                yield part, slice(0, self.columns)
            else:
                yield slice(0, self.total), part

    def origins(self, rows: slice, lags: NDArray[Any]) -> NDArray[Any]:
        """Count the origins of the block that still have a partner at each lag."""
        count: NDArray[Any] = np.minimum(rows.stop, self.total - lags) - rows.start
        return count


def block_plan(shape: tuple[int, ...], max_lag: int, n_blocks: int, by: str) -> BlockPlan:
    """Check the lags and blocks asked for against (rows, columns) of the data."""
    total, columns = int(shape[0]), int(shape[1])
    choice("by", by, ("time", "particles"))
    high = total // 2 if by == "time" else columns
    if high < 2:
        raise ValueError(f"`n_blocks` needs at least 2 blocks by {by}, the data allow {high}")
    integer("n_blocks", n_blocks, low=2, high=high)
    longest = (total // n_blocks if by == "time" else total) - 1
    integer("max_lag", max_lag, low=1)
    if by == "time" and max_lag > longest:
        raise ValueError(
            f"`max_lag` must be < T // n_blocks = {total // n_blocks}, got {max_lag}: take fewer "
            'blocks, a longer run, or `by="particles"`'
        )
    integer("max_lag", max_lag, low=1, high=longest)
    return BlockPlan(total, columns, int(max_lag), int(n_blocks), by)


def product_sums(
    a: NDArray[Any], b: NDArray[Any], plan: BlockPlan, *, relative: bool = False
) -> NDArray[Any]:
    """Sum over origins and columns of conj(a) b at each lag, shape (n_blocks, max_lag + 1)."""
    from scipy import fft

    is_complex = np.iscomplexobj(a)
    forward, backward = (fft.fft, fft.ifft) if is_complex else (fft.rfft, fft.irfft)
    kind = np.complex128 if is_complex else np.float64
    sums = np.empty((plan.n_blocks, plan.max_lag + 1), dtype=kind)
    for row, (rows, columns) in enumerate(plan.blocks()):
        reach = min(rows.stop + plan.max_lag, plan.total)
        size = fft.next_fast_len(rows.stop - rows.start + plan.max_lag, real=not is_complex)
        width = max(1, _CHUNK // (size * a.shape[2]))
        spectrum: Any = 0.0
        for start in range(columns.start, columns.stop, width):
            part = slice(start, min(start + width, columns.stop))
            late = _columns(b[rows.start : reach, part], relative, kind)
            if a is b:
                early = late[: rows.stop - rows.start]
            else:
                early = _columns(a[rows, part], relative, kind)
            product = np.conj(forward(early, size, axis=0)) * forward(late, size, axis=0)
            spectrum = spectrum + product.sum(axis=1)
        sums[row] = backward(spectrum, size)[: plan.max_lag + 1]
    return sums


def _columns(part: NDArray[Any], relative: bool, kind: type) -> NDArray[Any]:
    flat = part.reshape(part.shape[0], -1)
    if relative:
        moved: NDArray[Any] = flat.astype(kind) - flat[0]
        return moved
    same: NDArray[Any] = flat.astype(kind, copy=False)
    return same


def squared_displacements(block: NDArray[Any]) -> Array:
    """Sum over columns of the squared displacement from the block's first row, shape (rows,)."""
    result = np.zeros(block.shape[0])
    width = max(1, _CHUNK // (block.shape[0] * block.shape[2]))
    for start in range(0, block.shape[1], width):
        moved = _columns(block[:, start : start + width], True, np.float64)
        result += np.einsum("tm,tm->t", moved, moved)
    return result
