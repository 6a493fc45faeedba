"""A wall in two dimensions: a polygon, or a line that goes on through the periodic faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import running, validation
from sdpd.box import AXES, Box
from sdpd.walls.base import check_extent
from sdpd.walls.shaped import ShapedWall, crossing, merged, tiled

if TYPE_CHECKING:
    from sdpd._core import Solid

__all__ = ["Polyline"]

Array = NDArray[np.float64]
_SAME = 1e-9  # of the box: points that are one


@dataclass(frozen=True, kw_only=True, repr=False)
class Polyline(ShapedWall):
    """Straight lines from point to point, with the fluid to their left.

    A closed one that goes round counter-clockwise has the fluid inside, one that goes round
    clockwise is a body in the fluid. An open one must begin and end on opposite periodic faces of
    the box, at the same height, and goes on in the neighbouring box.

    Parameters
    ----------
    points : sequence of points, shape (N, 2)
        [length]; the first is not repeated at the end.
    closed : bool
        Whether a last line leads from the last point to the first.
    velocity, angular_velocity, centre, slip
        As for `ShapedWall`.

    Raises
    ------
    TypeError, ValueError
        If it is not a list of points in the plane, or lines have no length or cross.

    Examples
    --------
    A channel with a step: 2 high, then 1.

    >>> import numpy as np
    >>> import sdpd
    >>> box = sdpd.Box((6.0, 2.0), periodic="x")
    >>> bottom = sdpd.Polyline(
    ...     points=[(0, 0), (2, 0), (2, 1), (4, 1), (4, 0), (6, 0)], closed=False
    ... )
    >>> bottom.distance(np.array([[1.0, 0.5], [3.0, 0.5]]), box).tolist()
    [0.5, -0.5]
    """

    points: tuple[tuple[float, ...], ...]
    closed: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        array = validation.real_array("points", self.points, (None, 2))
        check_extent("points", array)
        object.__setattr__(self, "closed", validation.boolean("closed", self.closed))
        least = 3 if self.closed else 2
        if len(array) < least:
            raise ValueError(f"`points` must have at least {least} rows, got {len(array)}")
        object.__setattr__(self, "points", tuple(map(tuple, array.tolist())))
        starts, ends = self._lines()
        lengths = np.linalg.norm(ends - starts, axis=1)
        if not lengths.all():
            k = int(np.argmin(lengths))
            raise ValueError(
                f"`points` must differ from one to the next, got twice {self.points[k]} in row {k}"
            )
        self._refuse_folds(starts, ends)
        self._refuse_crossings(starts, ends)

    def _lines(self) -> tuple[Array, Array]:
        array = np.asarray(self.points)
        if self.closed:
            return array, np.roll(array, -1, axis=0)
        return array[:-1], array[1:]

    def _refuse_crossings(self, starts: Array, ends: Array) -> None:
        count = len(starts)
        for k in range(count - 2):
            others = np.arange(k + 2, count - (1 if self.closed and k == 0 else 0))
            if not len(others):
                continue
            a, b, c, d = starts[k], ends[k], starts[others], ends[others]
            sides = (_side(a, b, c) * _side(a, b, d), _side(c, d, a) * _side(c, d, b))
            crossed = others[
                (sides[0] <= 0.0) & (sides[1] <= 0.0) & ((sides[0] < 0.0) | (sides[1] < 0.0))
            ]
            if len(crossed):
                other = int(crossed[0])
                raise ValueError(
                    f"`points` must make lines that do not cross, got lines {k} from "
                    f"{self.points[k]} and {other} from {self.points[other]}"
                )

    def _refuse_folds(self, starts: Array, ends: Array) -> None:
        """A line that goes back along the one before, or all of them without an area."""
        way = (ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None]
        after = np.roll(way, -1, axis=0)
        back = np.einsum("ij,ij->i", way, after) <= 1e-12 - 1.0
        if not self.closed:
            back[-1] = False
        if back.any():
            k = int(np.argmax(back))
            raise ValueError(
                f"`points` must not lead back along the line they came by, got that at "
                f"{tuple(ends[k].tolist())} in row {(k + 1) % len(self.points)}"
            )

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        super().check(box, name)
        if box.dimension != 2:
            raise ValueError(f"`{name}` is a Polyline, which needs two dimensions; use a Mesh")
        if not self.closed:
            self._check_ends(box, name)
        if (found := crossing(_solid(self, box))) is not None:
            # two triangles a line, copy by copy: each half of them goes through the lines again
            first, second = (triangle % len(self._lines()[0]) for triangle in found)
            raise ValueError(
                f"`{name}` must not cross its own periodic image, got that of lines near "
                f"{self.points[first]} and {self.points[second]}"
            )

    def _check_ends(self, box: Box, name: str) -> None:
        first, last = np.asarray(self.points[0]), np.asarray(self.points[-1])
        turns = (last - first) / np.asarray(box.lengths)
        whole = np.rint(turns)
        periodic = np.array([axis in box.periodic_axes for axis in AXES[:2]])
        fits = np.abs(turns - whole).max() <= 1e-9 and not whole[~periodic].any() and whole.any()
        if not fits:
            raise ValueError(
                f"`{name}` is open: its ends must lie on opposite periodic faces at the same "
                f"place, got {self.points[0]} and {self.points[-1]}; close it, or see "
                "`box.periodic`"
            )

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        lengths = np.asarray(box.lengths)
        periodic = [axis in box.periodic_axes for axis in AXES[:2]]
        flat = np.zeros((points.size // 2, 3))
        flat[:, :2] = np.where(periodic, np.mod(points, lengths), points).reshape(-1, 2)
        return np.asarray(_solid(self, box).distances(flat)).reshape(points.shape[:-1])

    def centroid(self, box: Box) -> Array:  # noqa: D102
        return self._middle()

    def _middle(self) -> Array:
        starts, ends = self._lines()
        weight = np.linalg.norm(ends - starts, axis=1)
        return np.asarray(weight @ (0.5 * (starts + ends)) / weight.sum())

    def measure(self, box: Box) -> float:  # noqa: D102
        starts, ends = self._lines()
        return float(np.linalg.norm(ends - starts, axis=1).sum())

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        starts, ends = self._lines()
        found = []
        for start, end in zip(starts, ends, strict=True):
            count = max(1, round(float(np.linalg.norm(end - start)) / spacing))
            part = (np.arange(count) + 0.5)[:, None] / count
            found.append(start + part * (end - start))
        return np.concatenate(found)

    @property
    def speed(self) -> float:  # noqa: D102
        return largest_speed(self, np.asarray(self.points), self._middle())

    def __repr__(self) -> str:
        kind = "closed" if self.closed else "open"
        return f"Polyline({len(self.points)} points, {kind})"

    __str__ = __repr__


def largest_speed(wall: ShapedWall, points: Array, middle: Array) -> float:
    """Of the points of a wall, which turns about its middle where no centre is given."""
    padded = np.zeros((len(points), 3))
    padded[:, : points.shape[1]] = points
    centre = np.zeros(3)
    centre[: len(middle)] = middle if wall.centre is None else wall.centre
    velocity = np.zeros(3)
    velocity[: len(wall.velocity or ())] = wall.velocity or ()
    moved = velocity + np.cross(np.asarray(wall.angular_velocity or (0.0,) * 3), padded - centre)
    return float(np.linalg.norm(moved, axis=1).max())


def _side(a: Array, b: Array, c: Array) -> Any:
    """Twice the area of the triangle a, b, c, > 0 if it goes round counter-clockwise."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (
        c[..., 0] - a[..., 0]
    )


@lru_cache(maxsize=16)
def _solid(wall: Polyline, box: Box) -> Solid:
    """The lines as a strip of triangles along z, long enough that its ends are never nearest."""
    from sdpd import _core

    starts, ends = wall._lines()
    both = np.concatenate([starts, ends])
    shifts = tiled(both, box)
    copies = np.concatenate(
        [np.concatenate([starts + s for s in shifts]), np.concatenate([ends + s for s in shifts])]
    )
    points, number = merged(copies, _SAME * max(box.lengths))
    start, end = number.reshape(2, -1)
    count, height = len(points), 4.0 * float(np.linalg.norm(box.lengths))
    levels = [np.column_stack([points, np.full(count, z)]) for z in (-height, height)]
    # the normals of the triangles point to the left of the line, into the fluid
    triangles = np.concatenate(
        [
            np.column_stack([start, end + count, end]),
            np.column_stack([start, start + count, end + count]),
        ]
    )
    return _core.Solid(
        np.concatenate(levels), triangles.astype(np.uint32), running.available_threads()
    )
