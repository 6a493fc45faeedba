"""The box; its number of lengths is the dimension of the scene."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Any

from sdpd import validation

__all__ = ["AXES", "Box"]

AXES = "xyz"


@dataclass(frozen=True)
class Box:
    """A rectangular box with one corner at the origin, periodic or closed by walls.

    Parameters
    ----------
    lengths : sequence of float, 2 or 3 of them
        Edge lengths [length]; their number is the dimension D.
    periodic : str, optional
        The periodic axes, such as "xy"; "" for none. All if None. Along the others the scene needs
        walls that close the box.

    Raises
    ------
    ValueError
        If a length or the volume is not finite and > 0, or an axis is unknown.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.Box((2e-9, 1e-9)).dimension
    2
    """

    lengths: tuple[float, ...]
    periodic: str | None = None

    def __post_init__(self) -> None:
        lengths: Any = validation.vector("lengths", self.lengths)
        if len(lengths) not in (2, 3):
            raise ValueError(f"`lengths` must have 2 or 3 entries, got {len(lengths)}")
        for index, length in enumerate(lengths):
            validation.positive(f"lengths[{index}]", length)
        if not sys.float_info.min <= math.prod(lengths) < math.inf:
            raise ValueError(
                "`lengths` must have a product, the volume, within double precision, got "
                f"{math.prod(lengths):g}; choose other units"
            )
        object.__setattr__(self, "lengths", lengths)
        axes = AXES[: len(lengths)]
        periodic = axes if self.periodic is None else validation.text("periodic", self.periodic)
        unknown = set(periodic) - set(axes)
        if unknown or len(set(periodic)) != len(periodic):
            raise ValueError(
                f"`periodic` must name axes among {axes!r}, each once, got {periodic!r}"
            )
        object.__setattr__(self, "periodic", "".join(a for a in axes if a in periodic))

    @property
    def periodic_axes(self) -> str:
        """The periodic axes, in order."""
        assert self.periodic is not None
        return self.periodic

    @property
    def dimension(self) -> int:
        """D."""
        return len(self.lengths)

    @property
    def volume(self) -> float:
        """Volume [length^D], an area in two dimensions."""
        return math.prod(self.lengths)
