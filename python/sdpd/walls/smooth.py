"""Planes, cylinders and spheres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.box import AXES, Box
from sdpd.wall_heat import Isothermal, WallHeat
from sdpd.walls.base import Wall, check_heat, check_length, spun, three, vector_of

__all__ = ["Cylinder", "Plane", "Sphere", "enclosure", "slab"]

Array = NDArray[np.float64]
_SIDES = ("outside", "inside")
_FACINGS = ("above", "below")


@dataclass(frozen=True, kw_only=True)
class Plane(Wall):
    """A plane, at right angles to an axis of the box or in any other direction.

    Parameters
    ----------
    axis : str, optional
        "x", "y" or "z": the plane is at right angles to it. With `at`.
    at : float, optional
        Its place along the axis [length].
    fluid : {"above", "below"}, optional
        Whether the fluid has the larger or the smaller coordinates; None: it lies towards the
        middle of the box.
    point, normal : sequence of float, optional
        Instead of `axis` and `at`: a point [length], and the direction into the fluid (of any
        length).
    velocity : sequence of float, optional
        Of the wall [length/time], along itself; at rest if None.
    slip : bool
        Whether the fluid slips freely: images then have no friction.
    heat : Isothermal, Adiabatic or HeatFlux
        How heat passes the wall, where the fluid has an energy.

    Raises
    ------
    ValueError
        If it is not given in one of the two ways, or moves out of its place.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.Plane(axis="z", at=1e-3, velocity=(1.25e-5, 0.0, 0.0)).speed
    1.25e-05
    """

    axis: str | None = None
    at: float | None = None
    fluid: str | None = None
    point: tuple[float, ...] | None = None
    normal: tuple[float, ...] | None = None
    velocity: tuple[float, ...] | None = None
    slip: bool = False
    heat: WallHeat = Isothermal()

    def __post_init__(self) -> None:
        by_axis = self.axis is not None and self.at is not None
        free = self.point is not None and self.normal is not None
        mixed = {self.axis, self.at, self.fluid} - {None} if free else set()
        if by_axis == free or mixed or (by_axis and (self.point or self.normal)):
            raise ValueError("a Plane needs either `axis` and `at`, or `point` and `normal`")
        if by_axis:
            validation.choice("axis", self.axis, tuple(AXES))
            object.__setattr__(self, "at", validation.finite("at", self.at))
            if self.fluid is not None:
                validation.choice("fluid", self.fluid, _FACINGS)
        else:
            object.__setattr__(self, "point", vector_of("point", self.point))
            object.__setattr__(self, "normal", vector_of("normal", self.normal))
            assert self.normal is not None
            if not any(self.normal):
                raise ValueError("`normal` must not be zero")
        if self.velocity is not None:
            object.__setattr__(self, "velocity", vector_of("velocity", self.velocity))
        object.__setattr__(self, "slip", validation.boolean("slip", self.slip))
        check_heat(self.heat)

    def frame(self, box: Box) -> tuple[Array, Array]:
        """A point and the unit normal into the fluid, (D,) each."""
        if self.axis is None:
            point, normal = np.asarray(self.point), np.asarray(self.normal)
            return point, normal / np.linalg.norm(normal)
        index = AXES.index(self.axis)
        assert self.at is not None
        point, normal = np.zeros(box.dimension), np.zeros(box.dimension)
        middle = 0.5 * box.lengths[index]
        above = self.at <= middle if self.fluid is None else self.fluid == "above"
        point[index], normal[index] = self.at, 1.0 if above else -1.0
        return point, normal

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        if self.axis is not None and self.axis not in AXES[: box.dimension]:
            raise ValueError(
                f"`{name}.axis` must be an axis of the box ({AXES[: box.dimension]!r}), got "
                f"{self.axis!r}"
            )
        for part in ("point", "normal", "velocity"):
            value = getattr(self, part)
            if value is not None:
                check_length(f"{name}.{part}", value, box)
        _, normal = self.frame(box)
        if self.velocity is not None:
            across = abs(float(normal @ np.asarray(self.velocity)))
            if across > 1e-9 * self.speed:
                raise ValueError(
                    f"`{name}.velocity` must lie in the plane, got a part {across:g} along its "
                    "normal"
                )

    def core(self, box: Box) -> tuple[str, list[float]]:  # noqa: D102
        point, normal = self.frame(box)
        numbers = three(point) + three(normal) + three(self.velocity or ())
        return "plane", [*numbers, float(self.slip)]

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        point, normal = self.frame(box)
        return np.asarray((points - point) @ normal)

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        point, normal = self.frame(box)
        # Orthonormal directions in the plane, from the axes that are most nearly in it.
        order = np.argsort(np.abs(normal))
        along: list[Array] = []
        for axis in order[: box.dimension - 1]:
            vector = np.eye(box.dimension)[axis]
            for other in (normal, *along):
                vector = vector - (vector @ other) * other
            along.append(vector / np.linalg.norm(vector))
        middle = 0.5 * np.asarray(box.lengths)
        foot = middle - ((middle - point) @ normal) * normal
        reach = 0.5 * float(np.linalg.norm(box.lengths))
        if np.abs(normal).max() > 1.0 - 1e-12:  # at right angles to an axis: fill the face
            sizes = [float(np.abs(vector) @ np.asarray(box.lengths)) for vector in along]
        else:
            sizes = [2.0 * reach] * len(along)
        ticks = [_ticks(size, spacing) for size in sizes]
        grid = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, len(along))
        return np.asarray(foot + grid @ np.stack(along))

    def velocities_at(self, points: Array, box: Box) -> Array:  # noqa: D102
        still = (0.0,) * box.dimension
        return np.broadcast_to(np.asarray(self.velocity or still), points.shape).copy()

    @property
    def speed(self) -> float:  # noqa: D102
        return float(np.linalg.norm(self.velocity)) if self.velocity is not None else 0.0


def _ticks(length: float, spacing: float) -> Array:
    """Midpoints of equal parts of about a spacing, around 0."""
    count = max(1, round(length / spacing))
    return np.asarray(((np.arange(count) + 0.5) / count - 0.5) * length)


def _radial_distance(
    points: Array, centre: tuple[float, ...], axis: int | None, radius: float, fluid: str, box: Box
) -> Array:
    r = points - np.asarray(centre)
    for index, length in enumerate(box.lengths):
        if AXES[index] in box.periodic_axes:
            r[..., index] -= length * np.rint(r[..., index] / length)
        if index == axis:
            r[..., index] = 0.0
    distance = np.sqrt(np.sum(r**2, axis=-1)) - radius
    return np.asarray(distance if fluid == "outside" else -distance)


@dataclass(frozen=True, kw_only=True)
class Cylinder(Wall):
    """A cylinder along an axis of the box; in two dimensions a circle, with axis "z".

    Parameters
    ----------
    radius : float
        [length].
    centre : sequence of float, D of them
        A point of its axis [length].
    axis : str
        "x", "y" or "z".
    fluid : {"outside", "inside"}
        Where the fluid is: around a body, or in a pipe.
    velocity : float
        Along the axis [length/time].
    angular_velocity : float
        About the axis, by the right-hand rule [1/time].
    slip : bool
        Whether the fluid slips freely: images then have no friction.
    heat : Isothermal, Adiabatic or HeatFlux
        How heat passes the wall, where the fluid has an energy.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.Cylinder(radius=2.0, centre=(5.0, 5.0), angular_velocity=0.5).speed
    1.0
    """

    radius: float
    centre: tuple[float, ...]
    axis: str = "z"
    fluid: str = "outside"
    velocity: float = 0.0
    angular_velocity: float = 0.0
    slip: bool = False
    heat: WallHeat = Isothermal()

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", validation.positive("radius", self.radius))
        object.__setattr__(self, "centre", vector_of("centre", self.centre))
        validation.choice("axis", self.axis, tuple(AXES))
        validation.choice("fluid", self.fluid, _SIDES)
        for name in ("velocity", "angular_velocity"):
            object.__setattr__(self, name, validation.finite(name, getattr(self, name)))
        object.__setattr__(self, "slip", validation.boolean("slip", self.slip))
        check_heat(self.heat)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        check_length(f"{name}.centre", self.centre, box)
        if box.dimension == 2 and self.axis != "z":
            raise ValueError(f"`{name}.axis` must be 'z' in two dimensions, got {self.axis!r}")
        if box.dimension == 2 and self.velocity != 0.0:
            raise ValueError(
                f"`{name}.velocity` must be 0 in two dimensions, got {self.velocity:g}"
            )

    def core(self, box: Box) -> tuple[str, list[float]]:  # noqa: D102
        index = AXES.index(self.axis)
        side = 1.0 if self.fluid == "outside" else -1.0
        velocity, spin = [0.0] * 3, [0.0] * 3
        velocity[index], spin[index] = self.velocity, self.angular_velocity
        shape = [*three(self.centre), float(index), self.radius, side]
        return "cylinder", [*shape, *velocity, *spin, float(self.slip)]

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        index = AXES.index(self.axis)
        return _radial_distance(points, self.centre, index, self.radius, self.fluid, box)

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        count = max(3, round(2.0 * math.pi * self.radius / spacing))
        angle = 2.0 * math.pi * np.arange(count) / count
        axis = AXES.index(self.axis)
        across = [(axis + 1) % 3, (axis + 2) % 3]
        height = _ticks(box.lengths[axis], spacing) if box.dimension == 3 else np.zeros(1)
        points = np.zeros((len(height), count, 3))
        points[..., across[0]] = self.radius * np.cos(angle)
        points[..., across[1]] = self.radius * np.sin(angle)
        points += np.asarray(three(self.centre))
        if box.dimension == 3:
            points[..., axis] = 0.5 * box.lengths[axis] + height[:, None]
        return np.asarray(points.reshape(-1, 3)[:, : box.dimension])

    def velocities_at(self, points: Array, box: Box) -> Array:  # noqa: D102
        index = AXES.index(self.axis)
        velocity, spin = np.zeros(3), np.zeros(3)
        velocity[index], spin[index] = self.velocity, self.angular_velocity
        return spun(points, np.asarray(three(self.centre)), spin, velocity, box, index)

    @property
    def speed(self) -> float:  # noqa: D102
        return float(np.hypot(self.velocity, self.radius * self.angular_velocity))

    @property
    def radius_of_curvature(self) -> float | None:  # noqa: D102
        return self.radius


@dataclass(frozen=True, kw_only=True)
class Sphere(Wall):
    """A sphere, in three dimensions.

    Parameters
    ----------
    radius : float
        [length].
    centre : sequence of float, three
        [length].
    fluid : {"outside", "inside"}
        Where the fluid is.
    angular_velocity : sequence of float, three
        [1/time].
    slip : bool
        Whether the fluid slips freely: images then have no friction.
    heat : Isothermal, Adiabatic or HeatFlux
        How heat passes the wall, where the fluid has an energy.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.Sphere(radius=1.0, centre=(5.0, 5.0, 5.0)).radius
    1.0
    """

    radius: float
    centre: tuple[float, ...]
    fluid: str = "outside"
    angular_velocity: tuple[float, ...] = (0.0, 0.0, 0.0)
    slip: bool = False
    heat: WallHeat = Isothermal()

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", validation.positive("radius", self.radius))
        for name in ("centre", "angular_velocity"):
            value = validation.vector(name, getattr(self, name))
            if len(value) != 3:
                raise ValueError(f"`{name}` must have 3 entries, got {len(value)}")
            object.__setattr__(self, name, value)
        validation.choice("fluid", self.fluid, _SIDES)
        object.__setattr__(self, "slip", validation.boolean("slip", self.slip))
        check_heat(self.heat)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        if box.dimension != 3:
            raise ValueError(f"`{name}` is a sphere, which needs three dimensions; use a Cylinder")

    def core(self, box: Box) -> tuple[str, list[float]]:  # noqa: D102
        side = 1.0 if self.fluid == "outside" else -1.0
        still = (0.0, 0.0, 0.0)
        shape = [*self.centre, self.radius, side]
        return "sphere", [*shape, *still, *self.angular_velocity, float(self.slip)]

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        return _radial_distance(points, self.centre, None, self.radius, self.fluid, box)

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        # A spiral of equal areas (Swinbank and Purser 2006): even, and without poles.
        count = max(4, round(4.0 * math.pi * (self.radius / spacing) ** 2))
        k = np.arange(count)
        z = 1.0 - (2.0 * k + 1.0) / count
        angle = k * math.pi * (3.0 - math.sqrt(5.0))
        ring = np.sqrt(1.0 - z**2)
        outward = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
        return np.asarray(np.asarray(self.centre) + self.radius * outward)

    def velocities_at(self, points: Array, box: Box) -> Array:  # noqa: D102
        return spun(points, np.asarray(self.centre), self.angular_velocity, (0.0,) * 3, box)

    @property
    def speed(self) -> float:  # noqa: D102
        return self.radius * float(np.linalg.norm(self.angular_velocity))

    @property
    def radius_of_curvature(self) -> float | None:  # noqa: D102
        return self.radius


def slab(
    box: Box,
    axis: str = "z",
    *,
    lower_velocity: tuple[float, ...] | None = None,
    upper_velocity: tuple[float, ...] | None = None,
) -> tuple[Plane, Plane]:
    """Two planes at the ends of an axis of the box: a channel.

    Parameters
    ----------
    box : Box
        Not periodic along the axis.
    axis : str
    lower_velocity, upper_velocity : sequence of float, D of them, optional
        [length/time]; at rest if None.

    Returns
    -------
    tuple of two Plane

    Examples
    --------
    >>> import sdpd
    >>> box = sdpd.Box((3.0, 1.0), periodic="x")
    >>> [plane.at for plane in sdpd.walls.slab(box, "y")]
    [0.0, 1.0]
    """
    validation.choice("axis", axis, tuple(AXES[: box.dimension]))
    length = box.lengths[AXES.index(axis)]
    return (
        Plane(axis=axis, at=0.0, velocity=lower_velocity),
        Plane(axis=axis, at=length, velocity=upper_velocity),
    )


def enclosure(box: Box) -> tuple[Plane, ...]:
    """Planes at rest at both ends of every axis along which the box is not periodic.

    Examples
    --------
    >>> import sdpd
    >>> len(sdpd.walls.enclosure(sdpd.Box((1.0, 1.0, 5.0), periodic="z")))
    4
    """
    open_axes = [a for a in AXES[: box.dimension] if a not in box.periodic_axes]
    return tuple(plane for axis in open_axes for plane in slab(box, axis))
