"""What the series of exact means inside the loop share: intervals, their rows and their parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .base import Array, LoopObserver

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["IntervalMeans"]


class IntervalMeans(LoopObserver):
    """Base of the series whose values are means over the interval since the sample before.

    The core keeps step and time of the end of each interval, and after them the parts. Subclasses
    name the parts that make up the whole and tell what the core keeps for each.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.
    """

    between_walls: ClassVar[bool] = False
    needs_equal_steps: ClassVar[bool] = True
    parts: ClassVar[tuple[str, ...]] = ()

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._dimension = 3
        self._volume = 1.0

    def attach(self, sim: Simulation, every: int, dt: float) -> None:
        """Begin a segment."""
        self._dimension, self._volume = sim.scene.dimension, sim.scene.box.volume
        super().attach(sim, every, dt)

    def rewind(self, step: int) -> None:
        """End the segment without the intervals that end after `step`."""
        self.detach()
        if self._segments:
            last = self._segments[-1]
            self._segments[-1] = last[last[:, 0] <= step]

    @property
    def interval(self) -> float:
        """Length of the intervals [time]."""
        return (self._every or 1) * self._dt

    @property
    def volume(self) -> float:
        """Volume of the box [length^D]."""
        return self._volume

    def _values(self, rows: Array) -> dict[str, Array]:
        """Each field from what the core keeps, (T, columns)."""
        raise NotImplementedError

    def _table(self, fields: tuple[str, ...], shape: tuple[int, ...]) -> NDArray[np.void]:
        """All intervals, one row each: step, time, and fields of that shape."""
        kinds: list[Any] = [("step", np.int64), ("time", np.float64)]
        kinds += [(name, np.float64, shape) for name in fields]
        tables = self._tables()
        result = np.zeros(sum(len(table) for table in tables), dtype=kinds)
        if len(result):
            rows = np.concatenate(tables)
            result["step"], result["time"] = rows[:, 0], rows[:, 1]
            for name, values in self._values(rows[:, 2:]).items():
                result[name] = values
        return result

    @property
    def data(self) -> NDArray[np.void]:
        """All intervals, one row each: a structured array."""
        raise NotImplementedError

    def _total(self) -> Array:
        """Sum of the parts."""
        data = self.data
        return np.asarray(sum(data[name] for name in self.parts))

    def __len__(self) -> int:
        return sum(len(table) for table in self._tables())

    def __repr__(self) -> str:
        name = type(self).__name__
        return f"<sdpd.{name} every {self._every or self.every}: {len(self)} intervals>"
