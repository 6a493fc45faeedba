"""Walls of any shape: what the core needs of them is a distance and a motion."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.box import AXES, Box
from sdpd.errors import ResolutionWarning
from sdpd.wall_heat import Isothermal, WallHeat
from sdpd.walls.base import Wall, check_heat, check_length, spun, three, vector_of

if TYPE_CHECKING:
    from sdpd._core import Solid, WallField

__all__ = ["ROUNDING", "ShapedWall"]

Array = NDArray[np.float64]
LARGEST_GRID = 1e7  # bricks: their centres alone take 240 MB
ROUNDING = {2: 0.5 / 16, 3: 0.5 / 6}  # of a support: half a cell of the grid rounds off edges


@dataclass(frozen=True, kw_only=True, repr=False)
class ShapedWall(Wall):
    """A wall of any shape: a `LevelSet`, a `Polyline` or a `Mesh`.

    Parameters
    ----------
    velocity : sequence of float, D of them, optional
        Of the wall [length/time]. The wall must not leave its place: all of its surface moves along
        itself, as a profile that goes on along an axis does, or a body of revolution that turns.
    angular_velocity : float or sequence of float, three of them, optional
        About `centre`, by the right-hand rule [1/time]; in two dimensions a number.
    centre : sequence of float, D of them, optional
        What the wall turns about, and what torques are taken about [length]; the centroid of the
        surface if None.
    slip : bool
        Whether the fluid slips freely: images then have no friction.
    heat : Isothermal, Adiabatic or HeatFlux
        How heat passes the wall, where the fluid has an energy.
    """

    velocity: tuple[float, ...] | None = None
    angular_velocity: tuple[float, ...] | None = None
    centre: tuple[float, ...] | None = None
    slip: bool = False
    heat: WallHeat = Isothermal()

    def __post_init__(self) -> None:
        for name in ("velocity", "centre"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, vector_of(name, getattr(self, name)))
        spin: Any = self.angular_velocity
        if spin is not None:
            if np.ndim(spin) == 0:
                spin = (0.0, 0.0, validation.finite("angular_velocity", spin))
            spin = validation.vector("angular_velocity", spin)
            if len(spin) != 3:
                raise ValueError(
                    f"`angular_velocity` must be a number or have 3 entries, got {len(spin)}"
                )
            object.__setattr__(self, "angular_velocity", spin)
        object.__setattr__(self, "slip", validation.boolean("slip", self.slip))
        check_heat(self.heat)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        for part in ("velocity", "centre"):
            value = getattr(self, part)
            if value is not None:
                check_length(f"{name}.{part}", value, box)
        spin = self.angular_velocity
        if box.dimension == 2 and spin is not None and any(spin[:2]):
            raise ValueError(
                f"`{name}.angular_velocity` must be about z in two dimensions, got {spin}"
            )

    def centroid(self, box: Box) -> Array:
        """Mean of the surface, (D,) [length]."""
        raise NotImplementedError

    def measure(self, box: Box) -> float:
        """Area of the surface, or its length in two dimensions [length^(D-1)]."""
        raise NotImplementedError

    def pivot(self, box: Box) -> Array:
        """`centre`, or the centroid, (D,) [length]."""
        return np.asarray(self.centre) if self.centre is not None else self.centroid(box)

    def core(self, box: Box) -> tuple[str, list[float]]:  # noqa: D102
        numbers = three(self.pivot(box)) + three(self.velocity or ())
        numbers += three(self.angular_velocity or ())
        return "field", [*numbers, 0.0, float(self.slip)]

    def velocities_at(self, points: Array, box: Box) -> Array:  # noqa: D102
        velocity = three(self.velocity or ())
        return spun(points, self.pivot(box), three(self.angular_velocity or ()), velocity, box)

    def warn(self, support: float, name: str) -> None:
        """Warn where the surface is too coarse for the support."""

    def field(
        self,
        box: Box,
        support: float,
        kernel: str,
        *,
        name: str = "wall",
        threads: int = 1,
        spacing: float | None = None,
    ) -> WallField:
        """Distances and weights of images on a grid, as the core wants them.

        Parameters
        ----------
        box : Box
        support : float
            h [length].
        kernel : str
        name : str
            For warnings.
        threads : int
            The result does not depend on them.
        spacing : float, optional
            Of the grid [length]; h/16 in two dimensions and h/6 in three if None.

        Raises
        ------
        TypeError, ValueError
            If an argument is out of range, the surface does not pass through the box, or the solid
            is no thicker than a surface.

        Warns
        -----
        ResolutionWarning
            If the solid is somewhere thinner than a support, so that particles on both sides feel
            each other through it.
        """
        from sdpd import _core

        support = validation.positive("support", support)
        threads = validation.integer("threads", threads, minimum=1)
        if spacing is not None:
            spacing = validation.positive("spacing", spacing)
        cell = spacing or 2.0 * ROUNDING[box.dimension] * support
        bricks = math.prod(length / (8.0 * cell) + 1.0 for length in box.lengths)
        if bricks > LARGEST_GRID:
            raise ValueError(
                f"`{name}` needs a grid of {bricks:.3g} bricks of 8 cells along each axis, h = "
                f"{support:.4g} in a box of {box.lengths}, more than {LARGEST_GRID:.0e}: raise the "
                "spacing or the support"
            )
        periodic = [axis in box.periodic_axes for axis in AXES[: box.dimension]]
        try:
            field = _core.WallField(
                lambda points: self.distance(points, box),
                list(box.lengths),
                periodic,
                support,
                kernel,
                threads,
                spacing,
            )
        except ValueError as error:
            raise ValueError(f"`{name}`: {error}") from None
        report = field.report()
        lightest = report["weights"][0]
        if not lightest > 0.0:
            raise ValueError(
                f"`{name}` must bound a solid that the grid resolves: images must have weights "
                f"> 0, got {lightest:.3g}"
            )
        thinnest = report["thinnest"]
        if thinnest is not None:
            thickness, place = thinnest
            where = tuple(float(f"{x:.4g}") for x in place)
            warnings.warn(
                f"`{name}` is only {thickness:.3g} thick at {where}, less than a support, "
                f"h = {support:.4g}: particles on both sides feel each other through it; lower the "
                "spacing",
                ResolutionWarning,
                stacklevel=2,
            )
        self.warn(support, name)
        return field


@lru_cache(maxsize=16)
def crossing(solid: Solid) -> tuple[int, int] | list[int] | None:
    """Two triangles that cross; looked for once, however many scenes the wall is checked for."""
    return solid.crossing()


def tiled(points: Array, box: Box, reach: float = 0.5) -> list[Array]:
    """Shifts (k, D) of whole boxes by which copies of points come within half a box of the box."""
    dimension, lengths = box.dimension, np.asarray(box.lengths)
    low, high = points.min(axis=0), points.max(axis=0)
    ranges = []
    for axis in range(dimension):
        if AXES[axis] not in box.periodic_axes:
            ranges.append(np.array([0]))
            continue
        first = int(np.floor((-reach * lengths[axis] - high[axis]) / lengths[axis]))
        last = int(np.ceil(((1.0 + reach) * lengths[axis] - low[axis]) / lengths[axis]))
        turns = np.arange(first, last + 1)
        near = (high[axis] + turns * lengths[axis] > -reach * lengths[axis]) & (
            low[axis] + turns * lengths[axis] < (1.0 + reach) * lengths[axis]
        )
        ranges.append(turns[near])
    grid = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, dimension)
    return [np.asarray(turn * lengths) for turn in grid]


def merged(points: Array, tolerance: float) -> tuple[Array, NDArray[np.int64]]:
    """Distinct points, and which of them each point is: those within a tolerance are one."""
    from scipy.spatial import cKDTree

    first = np.arange(len(points))
    for i, j in sorted(cKDTree(points).query_pairs(tolerance)):
        first[j] = min(first[j], first[i])
    kept, number = np.unique(first, return_inverse=True)
    return points[kept], np.asarray(number)
