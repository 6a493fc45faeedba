"""Functions sampled in blocks: mean, standard error and jackknife of anything derived from them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .arguments import Array
from .estimate import Estimate, jackknife

__all__ = ["BlockedFunction", "Profile"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BlockedFunction:
    """A function on M points, known from B blocks.

    Attributes
    ----------
    mean, stderr : ndarray, shape (M,)
        Estimate and standard error, in the unit of the quantity; NaN where nothing was sampled,
        and the error is NaN from a single block.
    blocks : ndarray, shape (B, M)
        Mean of each block, same unit.
    block_counts : ndarray, shape (B, M)
        Number of samples in each block mean.
    window : tuple of float
        (start, stop) of what was sampled: times, lags or rows.
    """

    blocks: Array
    block_counts: Array
    window: tuple[float, float]
    mean: Array = field(init=False)
    stderr: Array = field(init=False)

    def __post_init__(self) -> None:
        total = self.block_counts.sum(axis=0)
        number = self.blocks.shape[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = self.block_counts / total
            mean = np.sum(share * self.blocks, axis=0)
            spread = np.sqrt(np.sum((share * (self.blocks - mean)) ** 2, axis=0))
        factor = math.sqrt(number / (number - 1.0)) if number > 1 else math.nan
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "stderr", spread * factor)

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.blocks.shape[0])

    @property
    def counts(self) -> Array:
        """Number of samples at each point, shape (M,)."""
        return np.asarray(self.block_counts.sum(axis=0))

    def leave_one_out(self) -> Array:
        """Mean function with each block left out in turn, shape (B, M)."""
        weighted = self.block_counts * self.blocks
        left: Array = self.block_counts.sum(axis=0) - self.block_counts
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray((weighted.sum(axis=0) - weighted) / left)

    def derive(
        self, function: Callable[[Array], float], *, window: tuple[float, float] | None = None
    ) -> Estimate:
        """Estimate any number computed from the function by the delete-one-block jackknife.

        Parameters
        ----------
        function : callable
            Takes the mean function, shape (M,), and returns a number.
        window : tuple of float, optional
            What was used of it, carried to the estimate; the function's window by default.

        Returns
        -------
        Estimate
            The value is that of the mean function; a curved `function` is biased by about its
            relative error squared, far below the error.

        Raises
        ------
        ValueError
            If there is only one block, or the number is not finite without some block.
        """
        if self.n_blocks < 2:
            raise ValueError("`n_blocks` must be >= 2 for a standard error, got 1")
        leave = np.array([function(row) for row in self.leave_one_out()])
        value = float(function(self.mean))
        _, stderr = jackknife(leave, value)
        span = self.window if window is None else window
        return Estimate(value, stderr, float(self.n_blocks), span)

    def at(self, index: int) -> Estimate:
        """Estimate at one point."""
        return Estimate(
            float(self.mean[index]), float(self.stderr[index]), float(self.n_blocks), self.window
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile(BlockedFunction):
    """A quantity in bins of a coordinate or a distance.

    Attributes
    ----------
    edges : ndarray, shape (M + 1,)
        Bin edges [length].
    """

    edges: Array

    @property
    def centers(self) -> Array:
        """Bin centres, shape (M,) [length]."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    @classmethod
    def from_sums(
        cls, edges: Array, sums: Array, counts: Array, window: tuple[float, float]
    ) -> Profile:
        """Make a profile of ``sums / counts`` in each block, both of shape (B, M)."""
        return cls(
            edges=edges, blocks=block_means(sums, counts), block_counts=counts, window=window
        )


def block_means(sums: Array, counts: Array) -> Array:
    """``sums / counts``, zero where nothing was counted (its weight is zero there)."""
    return np.asarray(np.divide(sums, counts, out=np.zeros_like(sums), where=counts > 0))


def block_index(rows: int, n_blocks: int) -> np.ndarray:
    """Block of each of `rows` rows, contiguous and of equal length to within one row."""
    return np.arange(rows) * n_blocks // rows
