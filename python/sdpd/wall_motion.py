"""Walls whose motion changes between runs: a plate that oscillates, a cylinder that spins up.

The form and the place of a wall never change, only its velocity and its angular velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from sdpd.box import Box
from sdpd.walls import Wall

__all__ = ["motion", "moved", "with_motions"]

_NAMES = ("velocity", "angular_velocity")


def motion(wall: Wall) -> dict[str, Any]:
    """What a wall has of velocity and angular velocity, by name."""
    return {field.name: getattr(wall, field.name) for field in _motions(wall)}


def _motions(wall: Any) -> list[Any]:
    return [field for field in fields(wall) if field.name in _NAMES]


def moved(wall: Wall, name: str, box: Box, **given: Any) -> Wall:
    """The wall with another velocity or angular velocity, checked; `name` is what errors call it.

    Raises
    ------
    TypeError
        If neither is given, or the wall cannot move in this way.
    ValueError
        If it would leave its place.
    """
    has = [field.name for field in _motions(wall)]
    changes = {key: value for key, value in given.items() if value is not None}
    if not changes:
        raise TypeError("one of `velocity` and `angular_velocity` must be given")
    for key in changes:
        if key not in has:
            kind = type(wall).__name__
            raise TypeError(f"`{name}` is a {kind}, which has no `{key}` but only {has}")
    new = replace(wall, **changes)  # type: ignore[type-var]
    new.check(box, name)
    return new


def with_motions(
    walls: Sequence[Wall], motions: Sequence[dict[str, Any]], box: Box
) -> tuple[Wall, ...]:
    """Walls with the motions that `motion` gave, e.g. read from a file.

    Raises
    ------
    TypeError, ValueError
        If they do not belong to these walls.
    """
    if len(motions) != len(walls):
        raise ValueError(f"`wall_motions` must have {len(walls)} entries, got {len(motions)}")
    result = []
    for index, (wall, given) in enumerate(zip(walls, motions, strict=True)):
        new = replace(wall, **given)  # type: ignore[type-var]
        new.check(box, f"walls[{index}]")
        result.append(new)
    return tuple(result)
