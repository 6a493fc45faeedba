"""A wall given by a function: the surface where it is zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd import running
from sdpd.box import AXES, Box
from sdpd.walls.shaped import ShapedWall

__all__ = ["LevelSet"]

Array = NDArray[np.float64]
_CELLS = {2: 384, 3: 72}  # along the longest axis of the box, of the grid that finds the surface
_SHARPEN = 8  # Newton steps onto the surface
_SLIDE = 20  # steps along it to the nearest point
_RELAXATION = 0.75  # of the way along the tangent, at first
_SLID = 1e-4  # of a cell: near enough to the foot
_DIFFERENCE = 1e-6  # of the box: step of numerical gradients


@dataclass(frozen=True, kw_only=True, repr=False)
class LevelSet(ShapedWall):
    """The surface where a function of space is zero; the fluid is where it is positive.

    Parameters
    ----------
    function : callable
        Of points (n, D) [length], returns (n,) numbers of any unit: F > 0 in the fluid, 0 at the
        wall, < 0 in the solid. It need not be a distance, but its gradient must not vanish at the
        wall. In a periodic box it must be periodic.
    gradient : callable, optional
        Of points (n, D), returns (n, D): its gradient; by differences if None.
    velocity, angular_velocity, centre, slip
        As for `ShapedWall`.

    Raises
    ------
    TypeError
        If the function cannot be called.
    ValueError
        If the function does not return finite numbers, or has one sign in the whole box.

    Notes
    -----
    Where the surface is smooth, distances are exact to about 1e-6 of its radius of curvature: each
    point is projected onto it by Newton steps along the gradient, starting from the nearest of many
    points of the surface. Details thinner than 1/384 of the longest edge of the box (1/72 in three
    dimensions) are overlooked.

    A function has no place in a file: a scene with one cannot be written, nor a simulation of it
    saved.

    Examples
    --------
    >>> import numpy as np
    >>> import sdpd
    >>> wavy = sdpd.LevelSet(function=lambda r: r[:, 1] - 1.0 - 0.3 * np.sin(np.pi * r[:, 0]))
    >>> box = sdpd.Box((4.0, 4.0), periodic="x")
    >>> wavy.distance(np.array([[0.5, 2.0], [0.5, 1.0]]), box).round(5).tolist()
    [0.7, -0.3]
    """

    function: Callable[[Array], Any]
    gradient: Callable[[Array], Any] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("function", "gradient"):
            value = getattr(self, name)
            if value is not None and not callable(value):
                raise TypeError(
                    f"`{name}` must be a function of points, got {type(value).__name__}"
                )

    def values(self, points: Array) -> Array:
        """F at points (n, D), checked."""
        found = np.asarray(self.function(points), dtype=float)
        if found.shape != (len(points),):
            raise ValueError(
                f"`function` must return an array of shape ({len(points)},), got {found.shape}"
            )
        if not np.isfinite(found).all():
            k = int(np.argmin(np.isfinite(found)))
            raise ValueError(f"`function` must be finite, got {found[k]} at {points[k].tolist()}")
        return found

    def gradients(self, points: Array, box: Box) -> Array:
        """Gradient of F at points (n, D)."""
        if self.gradient is not None:
            found = np.asarray(self.gradient(points), dtype=float)
            if found.shape != points.shape or not np.isfinite(found).all():
                raise ValueError(
                    f"`gradient` must return finite numbers of shape {points.shape}, got shape "
                    f"{found.shape}"
                )
            return found
        step = _DIFFERENCE * max(box.lengths)
        found = np.empty_like(points)
        for axis in range(points.shape[1]):
            shift = np.zeros(points.shape[1])
            shift[axis] = step
            found[:, axis] = self.values(points + shift) - self.values(points - shift)
        return found / (2.0 * step)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        super().check(box, name)
        for axis in range(box.dimension):
            if AXES[axis] in box.periodic_axes:
                self._check_period(box, axis, name)
        _surface(self, box)

    def _check_period(self, box: Box, axis: int, name: str) -> None:
        """The function must be the same on both faces of a periodic axis."""
        sides = [np.linspace(0.0, length, 33) for length in box.lengths]
        sides[axis] = np.zeros(1)
        low = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, box.dimension)
        high = low.copy()
        high[:, axis] = box.lengths[axis]
        ends = np.stack([self.values(low), self.values(high)])
        apart = np.abs(ends[1] - ends[0])
        if apart.max() > 1e-6 * np.abs(ends).max():
            k = int(np.argmax(apart))
            raise ValueError(
                f"`{name}.function` must be periodic along {AXES[axis]}, got {ends[0, k]:.6g} at "
                f"{low[k].tolist()} and {ends[1, k]:.6g} at {high[k].tolist()}"
            )

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        flat = np.asarray(points, dtype=float).reshape(-1, box.dimension)
        return _distances(self, flat, box).reshape(points.shape[:-1])

    def centroid(self, box: Box) -> Array:  # noqa: D102
        return np.asarray(_surface(self, box)[0].mean(axis=0))

    def measure(self, box: Box) -> float:  # noqa: D102
        return float("nan")

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        points = _surface(self, box)[0]
        # A surface passes through that many cubes of its own area, in the mean over its directions.
        cubes = {2: 4.0 / np.pi, 3: 1.5}[box.dimension]
        edge = spacing * cubes ** (1.0 / (box.dimension - 1))
        _, first = np.unique(np.floor(points / edge), axis=0, return_index=True)
        return points[np.sort(first)]

    @property
    def speed(self) -> float:  # noqa: D102
        # without a box there is no surface: the translation alone
        return float(np.linalg.norm(self.velocity)) if self.velocity is not None else 0.0

    def speed_in(self, box: Box) -> float:  # noqa: D102
        moved = self.velocities_at(_surface(self, box)[0], box)
        return float(np.linalg.norm(moved, axis=1).max())

    def __repr__(self) -> str:
        return f"LevelSet({getattr(self.function, '__name__', 'function')})"

    __str__ = __repr__


def _onto(wall: LevelSet, points: Array, box: Box, steps: int) -> Array:
    """Points moved onto the surface along the gradient."""
    for _ in range(steps):
        gradient = wall.gradients(points, box)
        square = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 1e-300)
        points = points - (wall.values(points) / square)[:, None] * gradient
    return points


@lru_cache(maxsize=16)
def _surface(wall: LevelSet, box: Box) -> tuple[Array, Any]:
    """Many points of the surface, in and just around the box, and a tree of them."""
    from scipy.spatial import cKDTree

    dimension, lengths = box.dimension, np.asarray(box.lengths)
    step = lengths.max() / _CELLS[dimension]
    margin = np.where([a in box.periodic_axes for a in AXES[:dimension]], 0.5, 0.1) * lengths
    axes = [
        np.linspace(-m, length + m, max(8, int(np.ceil((length + 2.0 * m) / step))))
        for length, m in zip(lengths, margin, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = wall.values(grid.reshape(-1, dimension)).reshape(grid.shape[:-1])
    found = []
    for axis in range(dimension):
        low = tuple(slice(0, -1) if a == axis else slice(None) for a in range(dimension))
        high = tuple(slice(1, None) if a == axis else slice(None) for a in range(dimension))
        changes = (values[low] > 0.0) != (values[high] > 0.0)
        f, g = values[low][changes], values[high][changes]
        part = (f / (f - g))[:, None]
        found.append(grid[low][changes] * (1.0 - part) + grid[high][changes] * part)
    points = np.concatenate(found)
    inside = ((points >= -1e-9 * lengths) & (points <= lengths * (1.0 + 1e-9))).all(axis=1)
    if not inside.any():
        sign = "positive" if values.max() > 0.0 else "negative"
        raise ValueError(
            f"`function` must change its sign in the box, got {sign} numbers everywhere on a grid "
            f"of spacing {step:.3g}"
        )
    exact = _onto(wall, points, box, _SHARPEN)
    astray = np.linalg.norm(exact - points, axis=1) > 2.0 * step
    exact[astray] = points[astray]
    return exact, cKDTree(exact)


def _distances(wall: LevelSet, points: Array, box: Box) -> Array:
    """Signed distances: from the nearest known point of the surface slide along it to the foot."""
    lengths = np.asarray(box.lengths)
    periodic = [axis in box.periodic_axes for axis in AXES[: box.dimension]]
    points = np.where(periodic, np.mod(points, lengths), points)
    surface, tree = _surface(wall, box)
    best, nearest = tree.query(points, workers=running.available_threads())
    foot = surface[nearest]
    step = max(box.lengths) / _CELLS[box.dimension]
    active = np.arange(len(points))
    ease, before = np.full(len(points), _RELAXATION), np.zeros_like(points)
    for _ in range(_SLIDE):
        here, at = points[active], foot[active]
        gradient = wall.gradients(at, box)
        square = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 1e-300)
        apart = here - at
        off = wall.values(at) / square
        slope = np.einsum("ij,ij->i", apart, gradient) / square
        along = apart - slope[:, None] * gradient
        size = np.linalg.norm(along, axis=1)
        on_surface = np.abs(off) * np.sqrt(square) <= 1e-6 * step
        # At the foot what is left is along the normal; to it the error is of second order.
        arrived = size <= _SLID * step
        straight = np.abs(slope) * np.sqrt(square)
        now = np.where(arrived, straight, np.linalg.norm(apart, axis=1))
        now = np.where(on_surface, now, np.inf)
        best[active] = np.minimum(best[active], now)
        # Onto the surface, and along it: less than the way along the tangent, which overshoots
        # where the surface bends away, much less if it did, and no more than half of the distance
        # or a cell.
        back = -np.einsum("ij,ij->i", along, before[active])
        ease[active] *= np.where(back > 0.3 * size**2, 0.5, 1.0)
        before[active] = along
        most = np.maximum(step, 0.5 * np.linalg.norm(apart, axis=1))
        share = np.minimum(ease[active], most / np.maximum(size, 1e-300))
        foot[active] = at + share[:, None] * along - off[:, None] * gradient
        active = active[~(on_surface & arrived)]
        if not len(active):
            break
    return np.asarray(np.where(wall.values(points) > 0.0, best, -best))
