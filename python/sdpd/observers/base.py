"""What observers have in common, and the base of those written in Python."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Array", "LoopObserver", "Observer", "check_observers"]

Array = NDArray[np.float64]


class Observer:
    """Base of the observers; derive from it and override `sample` to sample in Python.

    An observer belongs to the first simulation it is used with and goes on over several runs. Its
    arrays are live: copy what is to be kept.

    Parameters
    ----------
    every : int, optional
        Steps between samples, which are taken when ``sim.step`` is a multiple; that of the run if
        None.

    Examples
    --------
    >>> import sdpd
    >>> class Fastest(sdpd.Observer):
    ...     def __init__(self, **options):
    ...         super().__init__(**options)
    ...         self.values = []
    ...
    ...     def sample(self, sim):
    ...         self.values.append(abs(sim.velocities).max())
    """

    may_write: ClassVar[bool] = True  # whether `sample` may write positions and velocities
    between_walls: ClassVar[bool] = True  # whether it has a meaning where there are walls
    needs_equal_steps: ClassVar[bool] = False  # whether its lags or intervals are multiples of dt

    def __init__(self, *, every: int | None = None) -> None:
        self.every: int | None = None
        if every is not None:
            every = validation.integer("every", every, minimum=1, maximum=validation.LARGEST)
            self.every = every
        self._owner: weakref.ref[Simulation] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_owner": None}

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse a run this observer cannot follow; changes nothing.

        Raises
        ------
        ValueError
            If it belongs to another simulation, or has no meaning where there are walls or where
            the time step is adaptive.
        """
        if sim.adaptive is not None and self.needs_equal_steps:
            raise ValueError(
                f"`observe` must not hold a {type(self).__name__} where the time step is adaptive: "
                "it counts time in equal steps; give the simulation a fixed dt"
            )
        if sim.scene.walls and not self.between_walls:
            raise ValueError(
                f"`observe` must not hold a {type(self).__name__} where the scene has walls: it is "
                "for periodic boxes"
            )
        if self._owner is not None and self._owner() is not sim:
            raise ValueError(
                f"`observe` must hold observers of this simulation, got a {type(self).__name__} "
                "that already belongs to another one; make one for each"
            )

    def adopt(self, sim: Simulation) -> None:
        """Become an observer of that simulation."""
        self._owner = weakref.ref(sim)

    def begin(self, sim: Simulation, every: int) -> None:
        """Called when a run begins that takes a sample every so many steps."""

    def sample(self, sim: Simulation) -> None:
        """Called after each step whose number is a multiple of `every`.

        May write positions and velocities: derived arrays are fresh again before the next observer.
        """

    def end(self, sim: Simulation) -> None:
        """Called when a run ends, however it ends."""


class LoopObserver(Observer):
    """Base of the observers that the core runs inside its loop, without Python.

    What the core collects between attaching and detaching is a *segment*; results join them.
    """

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._every: int | None = None
        self._dt = 0.0
        self._handle: Any = None
        self._segments: list[Array] = []

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "_handle": None, "_segments": self._tables()}

    def _attach(self, sim: Simulation, every: int) -> Any:
        raise NotImplementedError

    def _read(self) -> Array:
        """Copy what the core has collected in this segment."""
        return np.asarray(self._handle.table())

    def attach(self, sim: Simulation, every: int, dt: float) -> None:
        """Begin a segment."""
        self._every, self._dt = every, dt
        self._handle = self._attach(sim, every)

    def detach(self) -> None:
        """End the segment."""
        if self._handle is not None:
            self._segments.append(self._read())
            self._handle = None

    def mark(self) -> None:
        """Remember the present state: a failing run comes back to it."""

    def rewind(self, step: int) -> None:
        """End the segment without what came after the last mark, at `step`."""
        self.detach()

    def _tables(self) -> list[Array]:
        present = [] if self._handle is None else [self._read()]
        return [*self._segments, *present]


def check_observers(observe: Any) -> list[Observer]:
    """The observers of a run, each once."""
    if isinstance(observe, Observer):
        return [observe]
    if not isinstance(observe, Sequence) or isinstance(observe, str):
        kind = type(observe).__name__
        raise TypeError(f"`observe` must be an observer or a sequence of them, got {kind}")
    for index, observer in enumerate(observe):
        expected = "an observer, e.g. sdpd.Thermodynamics()"
        validation.instance(f"observe[{index}]", observer, Observer, expected)
    if len({id(observer) for observer in observe}) != len(observe):
        raise ValueError("`observe` must hold each observer once, got one twice")
    return list(observe)
