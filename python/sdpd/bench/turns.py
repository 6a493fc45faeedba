"""Timing by turns: whatever slows the machine down for a while meets all cases alike."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from sdpd.observers import Observer
    from sdpd.simulation import Simulation

__all__ = ["Lists", "Runs", "Spread", "take_turns"]

Key = TypeVar("Key", bound=Hashable)

FEWEST = 16  # steps of a turn: to take over and show the state must not count for much
ENOUGH, SHORT, LONG = 5, 120, 2.0  # lists, and how long to wait for them: steps, seconds
TRY = 3  # steps to wait to try it


@dataclass(frozen=True)
class Spread:
    """Median and quartiles of repeats."""

    median: float
    lower: float
    upper: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Of at least one value."""
        lower, median, upper = np.percentile(np.asarray(values, dtype=float), [25, 50, 75])
        return cls(float(median), float(lower), float(upper))

    def scaled(self, factor: float) -> Spread:
        """Of all values times a factor > 0."""
        return Spread(self.median * factor, self.lower * factor, self.upper * factor)

    def inverse(self, factor: float) -> Spread:
        """Of a factor > 0 over all values, which are > 0."""
        return Spread(factor / self.median, factor / self.upper, factor / self.lower)

    def shown(self, form: str = ".3g") -> str:
        """``"12.3 (12.1-12.6)"``."""
        sign = "+" if form.startswith("+") else ""
        between = " to " if sign else "-"
        return f"{self.median:{form}} ({self.lower:{form}}{between}{self.upper:{form}})"


@dataclass(frozen=True)
class Lists:
    """How often neighbour lists are built, and what that takes.

    Attributes
    ----------
    interval : float
        Steps between two lists; infinite if none was built.
    cost : float
        Of a new order of particles and its list, a particle [ns].
    step : float
        Of a step without, a particle [ns].
    """

    interval: float
    cost: float
    step: float

    def share(self, steps: int, built: float) -> float:
        """Time of so many steps with so many lists over that of the steps alone [1]."""
        return 1.0 + built * self.cost / (steps * self.step)

    @classmethod
    def of(cls, sim: Simulation, *, quick: bool = False) -> Lists:
        """Measured step by step, until a few lists have been built; 0 where nothing stands out."""
        fewest, longest = (TRY, 0.0) if quick else (SHORT, LONG)
        times: dict[bool, list[float]] = {True: [], False: []}
        began = time.perf_counter()
        while len(times[True]) < ENOUGH:
            steps = len(times[True]) + len(times[False])
            if steps >= fewest and time.perf_counter() - began > longest:
                break
            before = _builds(sim)
            begin = time.perf_counter()
            sim.run(1, progress=False)
            took = time.perf_counter() - begin
            times[_builds(sim) > before].append(took * 1e9 / sim.n_particles)
        built, kept = len(times[True]), len(times[False])
        interval = (built + kept) / built if built else math.inf
        step = float(np.median(times[False] or times[True]))
        cost = max(0.0, float(np.median(times[True])) - step) if built else 0.0
        return cls(interval, cost, step)


class Runs:
    """Turns of one simulation; a call takes a turn and gives its nanoseconds per particle-step.

    Parameters
    ----------
    sim : Simulation
    seconds : float
        Wall time of a turn, about, but some steps at least; 0: two steps, to try it.
    lists : Lists, optional
        Of the same steps in a smaller box; measured if None. A turn of few steps may have one list
        more or less than its share: its time is corrected for that.
    observe : Observer, optional
        Sees every step.
    """

    def __init__(
        self,
        sim: Simulation,
        seconds: float,
        *,
        lists: Lists | None = None,
        observe: Observer | None = None,
    ) -> None:
        self.sim = sim
        self._observe = () if observe is None else (observe,)
        self.lists = Lists.of(sim, quick=seconds == 0.0) if lists is None else lists
        self.steps = 2
        self()  # memory is in place after this
        if seconds > 0.0:
            steps = round(seconds / (self() * 1e-9 * sim.n_particles))
            self.steps = max(FEWEST, steps)

    def __call__(self) -> float:
        """Take a turn; [ns]."""
        before = _builds(self.sim)
        begin = time.perf_counter()
        self.sim.run(self.steps, observe=self._observe, progress=False)
        took = (time.perf_counter() - begin) * 1e9 / (self.steps * self.sim.n_particles)
        due, built = self.steps / self.lists.interval, _builds(self.sim) - before
        return took * self.lists.share(self.steps, due) / self.lists.share(self.steps, built)

    @property
    def bytes_per_particle(self) -> float:
        """Of state and lists."""
        found = self.sim.statistics()
        return float(found["state_bytes"] + found["list_bytes"]) / self.sim.n_particles


def _builds(sim: Simulation) -> int:
    """Lists built from scratch; to find what is near among their pairs is part of every step."""
    return int(sim.statistics()["grid_renewals"])


def take_turns(
    cases: Mapping[Key, Callable[[], float]],
    rounds: int,
    *,
    advance: Callable[[], object] | None = None,
) -> dict[Key, list[float]]:
    """What each case gives in each round; every other round goes backwards.

    Parameters
    ----------
    cases : mapping of callables
    rounds : int
    advance : callable, optional
        Called after every turn.
    """
    found: dict[Key, list[float]] = {key: [] for key in cases}
    forward = list(cases)
    for number in range(rounds):
        for key in forward if number % 2 == 0 else forward[::-1]:
            found[key].append(cases[key]())
            if advance is not None:
                advance()
    return found
