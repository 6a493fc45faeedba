"""Checks of arguments at the edge of the package: each names the argument, what was expected and
what came. A check returns the value in its plain form (float, int, tuple of float), so dataclasses
hold nothing but plain values and compare, hash, pickle and print as such.
"""

from __future__ import annotations

import difflib
import math
import numbers
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import numpy as np

__all__ = [
    "LARGEST",
    "boolean",
    "choice",
    "finite",
    "fraction",
    "instance",
    "integer",
    "non_negative",
    "optional_non_negative",
    "optional_positive",
    "positive",
    "real_array",
    "suggestion",
    "text",
    "vector",
]

T = TypeVar("T")

LARGEST = 2**63 - 1  # of the integers that the core counts steps and particles with


def _show(value: object) -> str:
    shown = f"{value:g}" if isinstance(value, np.floating) else repr(value)
    return shown if len(shown) <= 80 else shown[:77] + "..."


def _number(name: str, value: object, expected: str) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise TypeError(
            f"`{name}` must be a number ({expected}), got {_show(value)} of type "
            f"{type(value).__name__}"
        )
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"`{name}` must be {expected}, got an integer beyond any float") from None


def finite(name: str, value: object) -> float:
    """A finite float."""
    number = _number(name, value, "finite")
    if not math.isfinite(number):
        raise ValueError(f"`{name}` must be finite, got {number:g}")
    return number


def positive(name: str, value: object) -> float:
    """A finite float > 0."""
    number = _number(name, value, "finite and > 0")
    if not (math.isfinite(number) and number > 0.0):
        raise ValueError(f"`{name}` must be finite and > 0, got {number:.10g}")
    return number


def non_negative(name: str, value: object) -> float:
    """A finite float >= 0."""
    number = _number(name, value, "finite and >= 0")
    if not (math.isfinite(number) and number >= 0.0):
        raise ValueError(f"`{name}` must be finite and >= 0, got {number:.10g}")
    return number + 0.0


def fraction(name: str, value: object, low: float, high: float) -> float:
    """A finite float with ``low <= value < high``."""
    number = _number(name, value, f">= {low:g} and < {high:g}")
    if not low <= number < high:
        raise ValueError(f"`{name}` must be >= {low:g} and < {high:g}, got {number:.10g}")
    return number


def optional_positive(name: str, value: object) -> float | None:
    """None, or a finite float > 0."""
    return None if value is None else positive(name, value)


def optional_non_negative(name: str, value: object) -> float | None:
    """None, or a finite float >= 0."""
    return None if value is None else non_negative(name, value)


def integer(
    name: str, value: object, *, minimum: int | None = None, maximum: int | None = None
) -> int:
    """An int, within the bounds that are given. Bools and floats are refused."""
    bound = "" if minimum is None else f" >= {minimum}"
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
        raise TypeError(
            f"`{name}` must be an integer{bound}, got {_show(value)} of type {type(value).__name__}"
        )
    number = int(value)
    if minimum is not None and number < minimum:
        raise ValueError(f"`{name}` must be an integer{bound}, got {_show_integer(number)}")
    if maximum is not None and number > maximum:
        raise ValueError(f"`{name}` must be an integer <= {maximum}, got {_show_integer(number)}")
    return number


def _show_integer(number: int) -> str:
    """Its digits, or how many there are: Python itself refuses to print thousands of them."""
    bits = number.bit_length()
    return str(number) if bits <= 256 else f"one of {bits} bits"


def boolean(name: str, value: object) -> bool:
    """A bool; 0 and 1 are refused."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(
            f"`{name}` must be True or False, got {_show(value)} of type {type(value).__name__}"
        )
    return bool(value)


def text(name: str, value: object) -> str:
    """A str."""
    if not isinstance(value, str):
        kind = type(value).__name__
        raise TypeError(f"`{name}` must be a str, got {_show(value)} of type {kind}")
    return value


def suggestion(value: object, options: Iterable[str]) -> str:
    """``"; did you mean 'lucy'?"`` if one of the options is close, else an empty string."""
    wanted, known = str(value).lower(), list(options)
    close = difflib.get_close_matches(wanted, known, n=1, cutoff=0.65)
    close = close or [option for option in known if len(wanted) > 3 and wanted in option][:1]
    return f"; did you mean {close[0]!r}?" if close else ""


def choice(name: str, value: object, options: Sequence[str]) -> str:
    """One of the given strings."""
    chosen = text(name, value)
    if chosen not in options:
        listed = ", ".join(repr(option) for option in options)
        hint = suggestion(chosen, options)
        raise ValueError(f"`{name}` must be one of {listed}, got {chosen!r}{hint}")
    return chosen


PRECISIONS = ("double", "mixed")


def precision(value: object, *, energy: bool) -> str:
    """Of what happens between two particles; a fluid with an energy takes double only."""
    chosen = choice("precision", value, PRECISIONS)
    if energy and chosen != "double":
        raise ValueError(
            "`precision` must be 'double' for a fluid with an energy, whose books close to "
            f"rounding, got {chosen!r}"
        )
    return chosen


def instance(name: str, value: Any, kinds: type[T] | tuple[type[T], ...], expected: str) -> T:
    """An instance of one of the given classes; `expected` is how to say so."""
    if not isinstance(value, kinds):
        raise TypeError(
            f"`{name}` must be {expected}, got {_show(value)} of type {type(value).__name__}"
        )
    return value


def vector(name: str, value: Any, *, length: int | None = None) -> tuple[float, ...]:
    """A tuple of finite floats, of the given length if one is given."""
    expected = "a sequence of numbers" if length is None else f"a sequence of {length} numbers"
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        raise TypeError(
            f"`{name}` must be {expected}, got {_show(value)} of type {type(value).__name__}"
        )
    items = list(value)
    if length is not None and len(items) != length:
        raise ValueError(f"`{name}` must be {expected}, got {len(items)}: {_show(value)}")
    return tuple(finite(f"{name}[{index}]", item) for index, item in enumerate(items))


def real_array(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    """A C-contiguous float64 array of the given shape (None: any length), all finite."""
    wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"`{name}` must be an array of shape {wanted}, got {error}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"`{name}` must be an array of real numbers, got dtype {array.dtype}")
    matches = array.ndim == len(shape) and all(
        n is None or n == m for n, m in zip(shape, array.shape, strict=True)
    )
    if not matches:
        raise ValueError(f"`{name}` must be an array of shape {wanted}, got {array.shape}")
    array = np.ascontiguousarray(array, dtype=np.float64)
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(k) for k in np.argwhere(bad)[0])
        raise ValueError(f"`{name}` must be finite, got {array[where]} at index {where}")
    return array
