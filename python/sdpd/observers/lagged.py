"""What the correlators inside the loop share: lags, blocks of time, segments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sdpd import validation

from .base import Array, LoopObserver

if TYPE_CHECKING:
    from sdpd.analysis.correlation import Correlation
    from sdpd.simulation import Simulation

__all__ = ["LaggedObserver"]

BLOCKS = 32  # behind a standard error, unless there are fewer
FEWEST = 8  # blocks for the error of the longest lags


class LaggedObserver(LoopObserver):
    """Base of the correlators of the core: sums at logarithmic lags, in blocks of time.

    No trajectory is kept: level l holds the last `points` samples taken every 2^l samples, so every
    lag is exact and memory does not grow with the run. Sums are kept in at most 64 blocks of equal
    length, which become longer as the run does: every mean has a standard error.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.
    points : int
        Lags on the first level, even; half as many on each further one.
    levels : int
        The longest lag is ``(points - 1) 2^(levels - 1)`` samples.
    """

    needs_equal_steps: ClassVar[bool] = True

    def __init__(self, *, every: int | None, points: int, levels: int) -> None:
        super().__init__(every=every)
        self.points = validation.integer("points", points, minimum=2, maximum=2**48)
        if self.points % 2:
            raise ValueError(f"`points` must be even, got {self.points}")
        self.levels = validation.integer("levels", levels, minimum=1)
        if self.levels > 40:
            raise ValueError(f"`levels` must be at most 40, got {self.levels}")
        self._dimension = 1
        self._began: float | None = None
        self._lags: Array = np.zeros(0)

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse another simulation, and other lags than those of the samples at hand."""
        super().check(sim, every, dt)
        if not self._tables():
            return
        kind = type(self).__name__
        cures = (f"use steps= (run(time=) adjusts dt) or a new {kind}", f"use a new {kind}")
        pairs = (("dt", dt, self._dt), ("every", every, self._every))
        for (name, mine, its), cure in zip(pairs, cures, strict=True):
            if mine != its:
                raise ValueError(
                    f"`{name}` must be that of the samples a {kind} holds, {its:.10g}, got "
                    f"{mine:.10g}; {cure}"
                )

    def attach(self, sim: Simulation, every: int, dt: float) -> None:
        """Begin a segment."""
        super().attach(sim, every, dt)
        self._dimension = sim.scene.dimension
        self._lags = np.asarray(self._handle.lags())
        if self._began is None:
            self._began = sim.time

    def _read(self) -> Array:
        return np.asarray(self._handle.blocks())

    def rewind(self, step: int) -> None:
        """End the segment; the core has taken back what the failed call added."""
        self.detach()

    def _blocks(self) -> Array:
        """All blocks of all segments, (B, lags, columns)."""
        tables = [table for table in self._tables() if len(table)]
        return np.concatenate(tables) if tables else np.zeros((0, self._lags.size, 1))

    def _grouped(self, n_blocks: int) -> tuple[Array, float]:
        """Neighbouring blocks joined into at most `n_blocks`, and the samples of the shortest."""
        blocks = self._blocks()
        samples = blocks[:, 0, 0]  # every sample is its own origin at lag 0
        total = samples.sum()
        if total == 0.0:
            return blocks, 0.0
        middle = np.cumsum(samples) - 0.5 * samples
        group = np.minimum((n_blocks * middle / total).astype(int), n_blocks - 1)
        starts = np.flatnonzero(np.diff(group, prepend=-1))
        joined = np.add.reduceat(blocks, starts, axis=0)
        return joined, float(joined[:, 0, 0].min())

    def _as_correlation(
        self, sums: Array, counts: Array, longest: float, *, dimension: int
    ) -> Correlation:
        """Correlation of ``sums / counts`` (B, lags) at the lags of at most `longest` samples.

        Lags longer than a block have no error that could be trusted, and are left out.
        """
        from sdpd.analysis.blocked import block_means
        from sdpd.analysis.correlation import Correlation

        kept = (self._lags <= longest) & (counts.sum(axis=0) > 0.0)
        step = (self._every or 1) * self._dt
        began = self._began or 0.0
        samples = float(self._blocks()[:, 0, 0].sum())
        return Correlation(
            lag=self._lags[kept] * step,
            blocks=block_means(sums[:, kept], counts[:, kept]),
            block_counts=counts[:, kept],
            window=(began, began + samples * step),
            dimension=dimension,
        )

    def _checked_blocks(self, n_blocks: Any) -> int:
        number = validation.integer("n_blocks", n_blocks, minimum=2)
        if not len(self._blocks()):
            raise ValueError(
                f"a {type(self).__name__} must have samples before it can be asked for results, "
                "got none: run the simulation with it"
            )
        return number

    @property
    def n_samples(self) -> int:
        """Samples taken so far."""
        blocks = self._blocks()
        return int(blocks[:, 0, 0].sum()) if len(blocks) else 0

    def __repr__(self) -> str:
        return (
            f"<sdpd.{type(self).__name__} every {self._every or self.every}, {self.points} points "
            f"on {self.levels} levels: {self.n_samples} samples>"
        )
