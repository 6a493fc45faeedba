"""Checks of what reaches the analysis: every refusal names the argument and says what came."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation
from sdpd.validation import choice, finite, non_negative, positive

__all__ = [
    "Array",
    "box_lengths",
    "choice",
    "edges",
    "finite",
    "frames",
    "integer",
    "non_negative",
    "particle_values",
    "positive",
    "real_array",
    "trajectory",
    "window",
]

Array = NDArray[np.float64]


def real_array(name: str, value: ArrayLike, ndim: int | tuple[int, ...]) -> NDArray[Any]:
    """Return `value` as a finite real array of an allowed number of dimensions.

    float32 and float64 are kept as they are (no copy); integers become float64.

    Raises
    ------
    TypeError
        If the data are not real numbers.
    ValueError
        If the number of dimensions is wrong or an element is not finite.
    """
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"`{name}` must be an array of real numbers, got dtype {array.dtype}")
    if array.dtype not in (np.float32, np.float64):
        array = array.astype(np.float64)
    allowed = (ndim,) if isinstance(ndim, int) else ndim
    if array.ndim not in allowed:
        wanted = " or ".join(f"{n}-d" for n in allowed)
        raise ValueError(f"`{name}` must be {wanted}, got shape {array.shape}")
    if array.size == 0:
        raise ValueError(f"`{name}` must not be empty, got shape {array.shape}")
    if not np.isfinite(array.sum()) and not np.isfinite(array).all():
        bad = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"`{name}` must be finite, got {array[tuple(bad)]} at {tuple(bad)}")
    return array


def trajectory(name: str, value: ArrayLike, *, frames: int = 1) -> NDArray[Any]:
    """Return `value` as a finite (T, N, D) array with at least `frames` rows in time."""
    array = real_array(name, value, 3)
    if array.shape[0] < frames:
        raise ValueError(f"`{name}` must have at least {frames} rows in time, got {array.shape}")
    return array


def frames(name: str, value: ArrayLike) -> NDArray[Any]:
    """Return `value` as (T, N, D); one configuration (N, D) is taken as T = 1."""
    array = real_array(name, value, (2, 3))
    return array[None] if array.ndim == 2 else array


def particle_values(name: str, value: ArrayLike, rows: int, count: int) -> Array:
    """Return a property of N particles in T frames as (T, N, C); one frame may lack its axis."""
    array = real_array(name, value, (1, 2, 3))
    if rows == 1 and array.shape[:1] == (count,) and array.ndim < 3:
        array = array[None]
    if array.ndim < 2 or array.shape[:2] != (rows, count):
        raise ValueError(f"`{name}` must start with shape ({rows}, {count}), got {array.shape}")
    return np.asarray(array.reshape(rows, count, -1), dtype=np.float64)


def box_lengths(value: ArrayLike, dimension: int) -> Array:
    """Return the edge lengths of the periodic box, shape (D,), all finite and > 0 [length]."""
    box = np.atleast_1d(real_array("box", value, 1)).astype(np.float64)
    if box.shape != (dimension,):
        raise ValueError(f"`box` must have {dimension} edge lengths, got shape {box.shape}")
    if not (box > 0.0).all():
        raise ValueError(f"`box` must be > 0 along every axis, got {box.tolist()}")
    return box


def integer(name: str, value: int, *, low: int, high: int | None = None) -> int:
    """Return `value` as an int with ``low <= value <= high``."""
    number = validation.integer(name, value)
    if number < low or (high is not None and number > high):
        span = f">= {low}" if high is None else f"between {low} and {high}"
        raise ValueError(f"`{name}` must be {span}, got {number}")
    return number


def window(name: str, value: tuple[float, float], *, high: float) -> tuple[float, float]:
    """Return an interval (start, stop) with ``0 <= start < stop <= high``."""
    try:
        start, stop = value
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` must be a pair (start, stop), got {value!r}") from None
    start, stop = finite(f"{name}[0]", start), finite(f"{name}[1]", stop)
    if not 0.0 <= start < stop <= high * (1.0 + 1e-9):
        raise ValueError(
            f"`{name}` must satisfy 0 <= start < stop <= {high:.6g}, got ({start:.6g}, {stop:.6g})"
        )
    return start, stop


def edges(name: str, value: int | ArrayLike, *, low: float, high: float) -> Array:
    """Return bin edges: a count makes equal bins on [low, high], an array is checked."""
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool):
        count = integer(name, int(value), low=1)
        return np.linspace(low, high, count + 1)
    array = real_array(name, value, 1).astype(np.float64)
    if array.size < 2 or not (np.diff(array) > 0.0).all():
        raise ValueError(f"`{name}` must be a count or at least two increasing edges")
    return array
