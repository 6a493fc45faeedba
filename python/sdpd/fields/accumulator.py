"""Sums of many frames in blocks, without keeping any frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

from .field_set import FieldSet, FrameStatistics
from .quantities import Quantity, Recipe, column_values, recipe, with_components
from .sampling import KernelSampler, Sampler
from .state import State

__all__ = ["Accumulator"]

Array = NDArray[np.float64]

_WEIGHTS = ("one", "square")


class Accumulator:
    """Adds up frames of the quantities of one target.

    Blocks are doubled in length whenever there are twice as many as asked for, so there are
    `n_blocks` to twice as many of equal length, however long the run, once it has that many frames.

    Parameters
    ----------
    sampler : Sampler
    quantities : sequence of str or Quantity
    n_blocks : int
        At least 2.
    extra : sequence of Recipe
        Of quantities whose sums the caller brings.
    """

    def __init__(
        self,
        sampler: Sampler,
        quantities: Sequence[str | Quantity],
        *,
        n_blocks: int,
        extra: Sequence[Recipe] = (),
    ) -> None:
        self._sampler = sampler
        self._quantities = tuple(quantities)
        self._custom = {q.name: q for q in quantities if isinstance(q, Quantity)}
        self._capacity = 2 * validation.integer("n_blocks", n_blocks, minimum=2)
        self._extra = tuple(extra)
        self._recipes: tuple[Recipe, ...] = ()
        self._columns: dict[str, tuple[int, int]] = {}
        self._blocks: list[Array] = []
        self._frames: list[int] = []
        self._length = 1
        self._statistics: dict[str, FrameStatistics] = {}
        self._time: tuple[float, float] | None = None
        self._state: State | None = None

    @property
    def n_frames(self) -> int:
        """Frames added."""
        return sum(self._frames)

    def add(self, state: State, source: Any, extra: dict[str, Array] | None = None) -> None:
        """Add a frame.

        Parameters
        ----------
        state : State
        source : Simulation or State
            What custom quantities are called with.
        extra : dict of ndarray, shape (P,), optional
            Sums that the caller brings; zero if None.
        """
        values = self._values(state, source)
        matrix = np.concatenate([_matrix(v) for v in values.values()], axis=1) if values else None
        if matrix is None:
            matrix = np.empty((len(state.positions), 0))
        sums = self._sampler.sums(state, state.positions, matrix)
        if self._extra:
            brought = extra or {}
            names = [name for made in self._extra for name in made.columns]
            zero = np.zeros(len(sums))
            sums = np.column_stack([sums, *(brought.get(name, zero) for name in names)])
        self._take(sums)
        start = state.time if self._time is None else self._time[0]
        self._time = (start, state.time)
        self._state = state
        for made in self._recipes:
            value = made.evaluate(_named(self._columns, sums), 1.0)
            self._statistics[made.name].add(value)

    def _values(self, state: State, source: Any) -> dict[str, Array]:
        """What each particle contributes to each column; the first call lays the columns out."""
        made = self._recipes or tuple(recipe(quantity, state) for quantity in self._quantities)
        names = dict.fromkeys(name for each in made for name in each.columns if name != "one")
        brought = {name for each in self._extra for name in each.columns}
        values = {
            name: column_values(name, state, source, self._custom)
            for name in names
            if name not in brought
        }
        if not self._recipes:
            made = tuple(
                with_components(each, values[each.name]) if each.name in self._custom else each
                for each in made
            )
            self._recipes = (*made, *self._extra)
            widths: dict[str, int] = dict.fromkeys(_WEIGHTS, 0)
            widths |= {name: 0 if v.ndim == 1 else v.shape[1] for name, v in values.items()}
            widths |= dict.fromkeys((n for each in self._extra for n in each.columns), 0)
            at = 0
            for name, width in widths.items():
                self._columns[name] = (at, width)
                at += max(width, 1)
            self._statistics = {each.name: FrameStatistics() for each in self._recipes}
        return values

    def _take(self, sums: Array) -> None:
        if self._blocks and self._frames[-1] < self._length:
            self._blocks[-1] += sums
            self._frames[-1] += 1
            return
        if len(self._blocks) == self._capacity:
            pairs = zip(self._blocks[::2], self._blocks[1::2], strict=True)
            self._blocks = [one + two for one, two in pairs]
            self._length *= 2
            self._frames = [self._length] * len(self._blocks)
        self._blocks.append(sums)
        self._frames.append(1)

    def result(self) -> FieldSet:
        """The fields so far; a block that is not full yet is joined with the one before.

        Raises
        ------
        ValueError
            If there is no frame yet.
        """
        if self._state is None or self._time is None:
            raise ValueError("there are no fields before the first frame")
        blocks, frames = list(self._blocks), list(self._frames)
        if len(blocks) > 1 and frames[-1] < self._length:
            last, count = blocks.pop(), frames.pop()
            blocks[-1] = blocks[-1] + last
            frames[-1] += count
        kernel = self._sampler if isinstance(self._sampler, KernelSampler) else None
        return FieldSet(
            target=self._sampler.target,
            recipes=self._recipes,
            columns=dict(self._columns),
            sums=np.stack(blocks),
            frames=np.array(frames, dtype=np.float64),
            statistics={name: each.copy() for name, each in self._statistics.items()},
            time=self._time,
            length=kernel.length if kernel else None,
            kernel=kernel.kernel if kernel else None,
            length_unit="m" if self._state.si else "length",
        )


def _matrix(values: Array) -> Array:
    return values[:, None] if values.ndim == 1 else values


def _named(columns: dict[str, tuple[int, int]], sums: Array) -> dict[str, Array]:
    from .field_set import named_sums

    return named_sums(columns, sums)
