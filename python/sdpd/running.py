"""How a run is cut into calls of the core: planned steps, turns of observers and callbacks, Ctrl-C.

The cuts depend on numbers of the run only and change no bit of the trajectory.
"""

from __future__ import annotations

import math
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any

from sdpd import validation

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = [
    "Interruptions",
    "Plan",
    "choose_threads",
    "chunk_steps",
    "plan_steps",
    "steps_to_next",
]

# A call of the core should last about this long [s], so that Ctrl-C and the bar respond.
CHUNK_SECONDS = 0.2
# Showing the state costs a particle a third of a step or less: not after fewer steps than these.
STEPS_BETWEEN_VIEWS = 32
# Fewer particles than this are not worth a thread of their own.
PARTICLES_PER_THREAD = 500
# t/dt this close above an integer (relative) is that integer: 0.1 + 0.2 is 0.3 here.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Plan:
    """Steps of a run.

    Attributes
    ----------
    steps : int
        Their number; an estimate where the time step is adaptive and a time was asked for.
    dt : float
        [time].
    time : float or None
        Time to simulate with an adaptive step [time].
    """

    steps: int
    dt: float
    time: float | None = None


def plan_steps(steps: Any, time: Any, dt: float, *, adaptive: bool = False) -> Plan:
    """Steps from exactly one of a number and a time.

    Raises
    ------
    TypeError, ValueError
        If both or none are given, or the one given is out of range.
    """
    if (steps is None) == (time is None):
        got = "neither" if steps is None else "both"
        raise ValueError(f"exactly one of `steps` and `time` must be given, got {got}")
    if steps is not None:
        number = validation.integer("steps", steps, minimum=0, maximum=validation.LARGEST)
        return Plan(number, dt)
    span = validation.non_negative("time", time)
    ratio = span / dt
    if not ratio < 2.0**63:
        raise ValueError(f"`time` must be less than 2^63 steps of {dt:g}, got {span:g}")
    if adaptive:
        return Plan(math.ceil(ratio), dt, span)
    nearest = round(ratio)
    if nearest > 0 and abs(ratio - nearest) <= ROUNDING * ratio:
        return Plan(nearest, dt)  # dt itself, so that the bits are those of run(steps=nearest)
    number = math.ceil(ratio)
    return Plan(number, span / number if number else dt)


def chunk_steps(pairs: float, pairs_per_second: float) -> int:
    """Steps of one call of the core."""
    return max(1, int(CHUNK_SECONDS * pairs_per_second / max(pairs, 1.0)))


def steps_to_next(step: int, every: int) -> int:
    """Steps from `step` to the next multiple of `every`, >= 1."""
    return every - step % every


def available_threads() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def choose_threads(threads: Any, n_particles: int) -> int:
    """Checked threads, or (None) as many as are at hand and worth it."""
    if threads is None:
        return max(1, min(available_threads(), n_particles // PARTICLES_PER_THREAD))
    number = validation.integer("threads", threads, minimum=1)
    if number > 4096:
        raise ValueError(f"`threads` must be at most 4096, got {number}")
    return number


class Interruptions:
    """Holds Ctrl-C back while the core or an observer works; a second one comes through at once.

    Only in the main thread and only if Python's own handler is installed.
    """

    def __init__(self) -> None:
        self._requested = False
        self._immediate = False
        self._installed = False

    def __enter__(self) -> Self:
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._handle)
            self._installed = True
        return self

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self._immediate or self._requested:
            raise KeyboardInterrupt
        self._requested = True

    @contextmanager
    def allowed(self) -> Iterator[None]:
        """Let Ctrl-C through at once: around the user's own code."""
        self._immediate = True
        try:
            yield
        finally:
            self._immediate = False

    def check(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C came since."""
        if self._requested:
            raise KeyboardInterrupt

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if error is None:
            self.check()
