"""Exceptions and warnings of the package, one place so that user code can catch them by name."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = [
    "CheckpointError",
    "PairingWarning",
    "RegimeWarning",
    "ResolutionWarning",
    "SdpdWarning",
    "SimulationError",
    "TimeStepWarning",
    "silenced",
]


class SimulationError(RuntimeError):
    """A run that blew up: NaN, a runaway particle. Names step, particle and the likely cause.

    The last good state of the simulation stays readable.

    Attributes
    ----------
    step : int or None
        Step in which it was seen.
    particle : int or None
        Id of the particle.
    time : float or None
        Simulated time of that step [time].
    dt : float or None
        Time step of the run [time].
    checkpoint : str or None
        File with the last good state, where ``run(on_error=...)`` asked for one.
    """

    step: int | None = None
    particle: int | None = None
    time: float | None = None
    dt: float | None = None
    checkpoint: str | None = None


class CheckpointError(ValueError):
    """A checkpoint file that is truncated, foreign or of an unknown version; nothing changed."""


class SdpdWarning(UserWarning):
    """Base class of the warnings below: ``warnings.simplefilter("error", sdpd.SdpdWarning)``."""


class PairingWarning(SdpdWarning):
    """The kernel, support and equation of state of a scene let particles clump in pairs."""


class RegimeWarning(SdpdWarning):
    """An effect of a scene is off, or on, against what its dimensionless numbers say clearly."""


class ResolutionWarning(SdpdWarning):
    """The particles of a scene are too few for its kernel, or for the wave that drives it."""


class TimeStepWarning(SdpdWarning):
    """A time step above one of its bounds; names the bound and its value."""


@contextmanager
def silenced() -> Iterator[None]:
    """Without the warnings of this package: where they were given before, or do not matter."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SdpdWarning)
        yield
