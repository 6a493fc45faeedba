"""What all walls have in common."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.box import AXES, Box
from sdpd.wall_heat import WallHeat

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["BoundaryParticles", "Wall"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BoundaryParticles:
    """Points of a wall, evenly spread: what a picture of it needs.

    Parameters
    ----------
    positions : ndarray of float64, shape (N, D)
        Points of the surface in the box [length].
    normals : ndarray of float64, shape (N, D)
        Unit normals into the fluid.
    velocities : ndarray of float64, shape (N, D)
        Of the wall there [length/time].
    temperatures : ndarray of float64, shape (N,)
        Of the wall there [temperature]: that of the fluid, unless it has its own.
    """

    positions: Array
    normals: Array
    velocities: Array
    temperatures: Array

    def __len__(self) -> int:
        return len(self.positions)


def check_heat(heat: object) -> None:
    """Raise TypeError if it is no thermal condition."""
    expected = "sdpd.Isothermal(...), sdpd.Adiabatic() or sdpd.HeatFlux(...)"
    validation.instance("heat", heat, WallHeat, expected)


class Wall:
    """Base of the walls."""

    slip: bool
    heat: WallHeat

    def core(self, box: Box) -> tuple[str, list[float]]:
        """Name and numbers for the core."""
        raise NotImplementedError

    def distance(self, points: Array, box: Box) -> Array:
        """Signed distance of points (..., D) to the wall [length]; > 0 in the fluid."""
        raise NotImplementedError

    def check(self, box: Box, name: str) -> None:
        """Raise ValueError if the wall does not belong into the box."""
        raise NotImplementedError

    @property
    def speed(self) -> float:
        """Largest speed of the surface [length/time]."""
        raise NotImplementedError

    def speed_in(self, box: Box) -> float:
        """Largest speed of the part of the surface that is in a box [length/time]."""
        return self.speed

    @property
    def radius_of_curvature(self) -> float | None:
        """Radius of a round wall [length]; None for a plane."""
        return None

    def __str__(self) -> str:
        given = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in fields(self)  # type: ignore[arg-type]
            if getattr(self, field.name) != field.default
        )
        return f"{type(self).__name__}({', '.join(given)})"

    def boundary_particles(
        self, scene: Scene, *, spacing: float | None = None
    ) -> BoundaryParticles:
        """Points of the wall in the box of a scene, with normals into the fluid and velocities.

        Parameters
        ----------
        scene : Scene
        spacing : float, optional
            Their distance, about [length]; that of the particles if None.

        Returns
        -------
        BoundaryParticles

        Raises
        ------
        ValueError
            If the spacing is not > 0.

        Examples
        --------
        >>> import sdpd
        >>> scene = sdpd.scenes.load("couette")
        >>> points = scene.walls[1].boundary_particles(scene)
        >>> points.normals[0].tolist(), points.velocities[0].tolist()
        ([0.0, 0.0, -1.0], [1.25e-05, 0.0, 0.0])
        """
        step = scene.spacing if spacing is None else validation.positive("spacing", spacing)
        box = scene.box
        points = self.points_on(box, step)
        free = [axis not in box.periodic_axes for axis in AXES[: box.dimension]]
        lengths = np.asarray(box.lengths)
        points = np.where(free, points, np.mod(points, lengths))
        room = 1e-9 * lengths
        inside = ((points >= -room) & (points <= lengths + room)).all(axis=1)
        points = points[inside]
        others = [wall for wall in scene.walls if wall is not self]
        for wall in others:
            points = points[wall.distance(points, box) > -1e-9 * float(lengths.max())]
        return BoundaryParticles(
            points,
            self.normals_at(points, box),
            self.velocities_at(points, box),
            np.asarray(self.heat.temperature_at(points, scene.fluid.temperature)),
        )

    def points_on(self, box: Box, spacing: float) -> Array:
        """Points of the surface about a spacing apart, (N, D) [length]; some outside of the box."""
        raise NotImplementedError

    def normals_at(self, points: Array, box: Box) -> Array:
        """Unit normals into the fluid at points of the surface: differences of the distance."""
        step = 1e-6 * min(box.lengths)
        gradient = np.empty_like(points)
        for axis in range(points.shape[1]):
            shift = np.zeros(points.shape[1])
            shift[axis] = step
            ends = [self.distance(points + sign * shift, box) for sign in (1.0, -1.0)]
            gradient[:, axis] = (ends[0] - ends[1]) / (2.0 * step)
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        return np.asarray(gradient / np.maximum(length, 1e-300))

    def velocities_at(self, points: Array, box: Box) -> Array:
        """Velocity of the wall at points of its surface, (N, D) [length/time]."""
        raise NotImplementedError


def spun(
    points: Array, centre: Array, spin: Any, velocity: Any, box: Box, axis: int | None = None
) -> Array:
    """v + w x (r - centre) at points (N, D), from the nearest image of the centre."""
    dimension = box.dimension
    arm = np.zeros((len(points), 3))
    arm[:, :dimension] = points - centre[:dimension]
    for index, length in enumerate(box.lengths):
        if AXES[index] in box.periodic_axes:
            arm[:, index] -= length * np.rint(arm[:, index] / length)
    if axis is not None:
        arm[:, axis] = 0.0
    moved = np.asarray(velocity) + np.cross(np.asarray(spin), arm)
    return np.asarray(moved[:, :dimension])


def three(values: Any) -> list[float]:
    numbers = [float(x) for x in values]
    return numbers + [0.0] * (3 - len(numbers))


def vector_of(name: str, value: Any) -> tuple[float, ...]:
    numbers = validation.vector(name, value)
    if len(numbers) not in (2, 3):
        raise ValueError(f"`{name}` must have 2 or 3 entries, got {len(numbers)}")
    return numbers


def check_extent(name: str, points: Array) -> None:
    """Refuse coordinates whose fourth powers, products of areas, overflow."""
    largest = float(np.abs(points).max(initial=0.0))
    if not largest < 1e75:
        raise ValueError(f"`{name}` must be within 1e75 of the origin, got {largest:g}")


def check_length(name: str, value: tuple[float, ...], box: Box) -> None:
    if len(value) != box.dimension:
        raise ValueError(
            f"`{name}` must have {box.dimension} entries, as many as the box has axes, got "
            f"{len(value)}"
        )
