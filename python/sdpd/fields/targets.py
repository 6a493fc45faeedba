"""Where fields are wanted: grids, lines, planes, the points of a mesh, bins along an axis.

A target is a list of points with the shape in which they lie; results come back in that shape.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import optional, validation
from sdpd.box import AXES, Box

__all__ = ["Bins", "Grid", "Line", "Mesh", "Plane", "Points", "Target", "axis_index"]

Array = NDArray[np.float64]
Cells = list[tuple[str, NDArray[np.int64]]]


class Target:
    """Base of the targets.

    Attributes
    ----------
    points : ndarray, shape (P, D)
        [length].
    shape : tuple of int
        How the points lie; its product is P.
    axes : tuple of (str, ndarray)
        Name and coordinate of each axis of `shape` [length].
    """

    points: Array
    shape: tuple[int, ...]
    axes: tuple[tuple[str, Array], ...]

    @property
    def dimension(self) -> int:
        """D."""
        return int(self.points.shape[1])

    @property
    def cells(self) -> Cells:
        """Cells between the points, as meshio names them."""
        return _lattice_cells(self.shape)

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class Grid(Target):
    """A regular grid along the axes, of two or three dimensions.

    Parameters
    ----------
    low, high : sequence of float, length D
        First and last point [length]; equal along an axis with one point.
    shape : sequence of int, length D
        Points along each axis.

    Raises
    ------
    ValueError
        If a length differs from another or `high` is below `low`.

    Examples
    --------
    >>> import sdpd
    >>> grid = sdpd.fields.Grid.over(sdpd.Box((4.0, 2.0)), (4, 2))
    >>> grid.points[:2].tolist()
    [[0.5, 0.5], [0.5, 1.5]]
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    shape: tuple[int, ...]

    def __post_init__(self) -> None:
        low = _vector("low", self.low)
        high = validation.vector("high", self.high, length=len(low))
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        object.__setattr__(self, "shape", _counts("shape", self.shape, len(low)))
        for axis, (a, b, n) in enumerate(zip(low, high, self.shape, strict=True)):
            if b < a or (n > 1 and b == a):
                raise ValueError(f"`high[{axis}]` must be above `low[{axis}]`, {a:g}, got {b:g}")

    @classmethod
    def over(cls, box: Box | ArrayLike, shape: Sequence[int]) -> Grid:
        """The centres of that many equal cells of a box.

        Parameters
        ----------
        box : Box or array_like, shape (D,)
            The box or its edge lengths [length].
        shape : sequence of int, length D
            Cells along each axis; one cell is the middle of the box.
        """
        lengths = np.array(_vector("box", box.lengths if isinstance(box, Box) else box))
        counts = np.array(_counts("shape", shape, len(lengths)))
        half = 0.5 * lengths / counts
        return cls(tuple(half), tuple(lengths - half), tuple(counts))

    @cached_property
    def axes(self) -> tuple[tuple[str, Array], ...]:  # type: ignore[override]
        """Name and coordinates of each axis [length]."""
        lines = zip(AXES, self.low, self.high, self.shape, strict=False)
        return tuple((name, np.linspace(a, b, n)) for name, a, b, n in lines)

    @cached_property
    def points(self) -> Array:  # type: ignore[override]
        """Points, (P, D) [length], the last axis fastest."""
        lines = [line for _, line in self.axes]
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))


@dataclass(frozen=True, eq=False)
class Line(Target):
    """Equally spaced points between two ends, both included.

    Parameters
    ----------
    start, end : sequence of float, length D
        [length].
    n_points : int
        At least 2.
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    n_points: int

    def __post_init__(self) -> None:
        start = _vector("start", self.start)
        end = validation.vector("end", self.end, length=len(start))
        if start == end:
            raise ValueError(f"`end` must differ from `start`, got {end} twice")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "end", end)
        validation.integer("n_points", self.n_points, minimum=2)

    @cached_property
    def points(self) -> Array:  # type: ignore[override]
        """Points, (P, D) [length]."""
        return np.linspace(self.start, self.end, self.n_points)

    @property
    def shape(self) -> tuple[int, ...]:  # type: ignore[override]
        """(P,)."""
        return (self.n_points,)

    @property
    def axes(self) -> tuple[tuple[str, Array], ...]:  # type: ignore[override]
        """The coordinate that varies if only one does, else the distance from `start` [length]."""
        differ = np.flatnonzero(np.array(self.start) != np.array(self.end))
        if len(differ) == 1:
            return ((AXES[differ[0]], self.points[:, differ[0]]),)
        return (("distance", np.linalg.norm(self.points - self.points[0], axis=1)),)


@dataclass(frozen=True, eq=False)
class Plane(Target):
    """A parallelogram of points in three dimensions.

    Parameters
    ----------
    origin : sequence of float, length 3
        A corner [length].
    first, second : sequence of float, length 3
        The two edges from it [length].
    shape : sequence of int, length 2
        Points along each edge, both ends included, at least 2.

    Raises
    ------
    ValueError
        If the edges are parallel or something has the wrong length.
    """

    origin: tuple[float, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    shape: tuple[int, ...]

    def __post_init__(self) -> None:
        for name in ("origin", "first", "second"):
            object.__setattr__(self, name, validation.vector(name, getattr(self, name), length=3))
        object.__setattr__(self, "shape", _counts("shape", self.shape, 2, minimum=2))
        area = np.linalg.norm(np.cross(self.first, self.second))
        if area <= 1e-9 * np.linalg.norm(self.first) * np.linalg.norm(self.second):
            raise ValueError(f"`second` must not be parallel to `first`, got {self.second}")

    @classmethod
    def across(
        cls, box: Box | ArrayLike, axis: int | str, position: float, shape: Sequence[int]
    ) -> Plane:
        """The cross-section of a box at a position along an axis.

        Parameters
        ----------
        box : Box or array_like, shape (3,)
            The box or its edge lengths [length].
        axis : {"x", "y", "z"} or int
            Normal to the plane.
        position : float
            Where it cuts the axis [length].
        shape : sequence of int, length 2
            Points along the two other axes, both ends included.
        """
        edges = box.lengths if isinstance(box, Box) else box
        lengths = validation.vector("box", _listed(edges), length=3)
        normal = axis_index(axis, 3)
        one, two = (np.eye(3)[a] * lengths[a] for a in range(3) if a != normal)
        origin = np.eye(3)[normal] * validation.finite("position", position)
        return cls(tuple(origin), tuple(one), tuple(two), tuple(shape))

    @cached_property
    def points(self) -> Array:  # type: ignore[override]
        """Points, (P, 3) [length], along `second` fastest."""
        u, v = (np.linspace(0.0, 1.0, n) for n in self.shape)
        one, two = np.array(self.first), np.array(self.second)
        grid = u[:, None, None] * one + v[None, :, None] * two
        return np.asarray((np.array(self.origin) + grid).reshape(-1, 3))

    @property
    def axes(self) -> tuple[tuple[str, Array], ...]:  # type: ignore[override]
        """Along an axis its coordinate, else the distance from the corner [length]."""
        edges = zip((self.first, self.second), "uv", self.shape, strict=True)
        return tuple(self._axis(np.array(edge), name, n) for edge, name, n in edges)

    def _axis(self, edge: Array, name: str, n: int) -> tuple[str, Array]:
        along = np.flatnonzero(edge)
        if len(along) == 1:
            low = self.origin[along[0]]
            return AXES[along[0]], np.linspace(low, low + edge[along[0]], n)
        return name, np.linspace(0.0, float(np.linalg.norm(edge)), n)


@dataclass(frozen=True, eq=False)
class Points(Target):
    """Points anywhere.

    Parameters
    ----------
    points : array_like, shape (P, D)
        [length].
    """

    points: Array

    def __post_init__(self) -> None:
        points = validation.real_array("points", self.points, (None, None))
        if points.shape[1] not in (2, 3) or not len(points):
            raise ValueError(f"`points` must be rows of 2 or 3 coordinates, got {points.shape}")
        object.__setattr__(self, "points", points)

    @property
    def shape(self) -> tuple[int, ...]:  # type: ignore[override]
        """(P,)."""
        return (len(self.points),)

    @property
    def axes(self) -> tuple[tuple[str, Array], ...]:  # type: ignore[override]
        """The number of the point."""
        return (("point", np.arange(len(self.points), dtype=np.float64)),)

    @property
    def cells(self) -> Cells:
        """A vertex for each point."""
        return [("vertex", np.arange(len(self.points))[:, None])]


class Mesh(Points):
    """The points of a mesh.

    Parameters
    ----------
    mesh : meshio.Mesh or path
        A mesh, or a file that meshio reads.
    dimension : {2, 3}
        Two: the mesh lies in a plane of constant z, which is left out.

    Raises
    ------
    ImportError
        If meshio is not installed and `mesh` is a path.
    ValueError
        If the file cannot be read, or the points have other dimensions.
    """

    def __init__(self, mesh: Any, *, dimension: int = 3) -> None:
        if isinstance(mesh, (str, os.PathLike)):
            mesh = _read_mesh(mesh)
        if not (hasattr(mesh, "points") and hasattr(mesh, "cells")):
            kind = type(mesh).__name__
            raise TypeError(f"`mesh` must be a meshio.Mesh or a path, got {kind}")
        if validation.integer("dimension", dimension) not in (2, 3):
            raise ValueError(f"`dimension` must be 2 or 3, got {dimension}")
        points = np.asarray(mesh.points, dtype=np.float64)
        if dimension == 3 and points.shape[1] == 2:
            raise ValueError("`mesh` must have points of three coordinates, got two")
        if dimension == 2 and points.shape[1] == 3 and np.ptp(points[:, 2]) > 0.0:
            raise ValueError("`mesh` must lie in a plane of constant z for two dimensions")
        super().__init__(np.ascontiguousarray(points[:, :dimension]))
        blocks = [(str(block.type), np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
        object.__setattr__(self, "_cells", blocks)

    @property
    def cells(self) -> Cells:
        """The cells of the mesh."""
        return list(getattr(self, "_cells"))  # noqa: B009  (set around the frozen dataclass)


@dataclass(frozen=True, eq=False)
class Bins(Target):
    """Bins along an axis, over the whole cross-section of the box.

    Parameters
    ----------
    axis : {"x", "y", "z"} or int
    edges : array_like, shape (M + 1,)
        Increasing [length].
    lengths : sequence of float, length D
        Edge lengths of the box [length].
    """

    axis: int
    edges: Array
    lengths: tuple[float, ...]

    def __post_init__(self) -> None:
        lengths = _vector("lengths", self.lengths)
        object.__setattr__(self, "lengths", lengths)
        object.__setattr__(self, "axis", axis_index(self.axis, len(lengths)))
        edges = validation.real_array("edges", self.edges, (None,))
        if len(edges) < 2 or not (np.diff(edges) > 0.0).all():
            raise ValueError("`edges` must be at least two increasing numbers")
        object.__setattr__(self, "edges", edges)

    @classmethod
    def over(cls, box: Box | ArrayLike, axis: int | str, bins: int) -> Bins:
        """That many equal bins over a box.

        Parameters
        ----------
        box : Box or array_like, shape (D,)
            The box or its edge lengths [length].
        axis : {"x", "y", "z"} or int
        bins : int
        """
        lengths = _vector("box", box.lengths if isinstance(box, Box) else box)
        index = axis_index(axis, len(lengths))
        number = validation.integer("bins", bins, minimum=1)
        return cls(index, np.linspace(0.0, lengths[index], number + 1), lengths)

    @property
    def centers(self) -> Array:
        """Middle of each bin, (M,) [length]."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def volumes(self) -> Array:
        """Volume of each bin, (M,) [length^D]."""
        across = np.prod(self.lengths) / self.lengths[self.axis]
        return np.asarray(np.diff(self.edges) * across)

    @cached_property
    def points(self) -> Array:  # type: ignore[override]
        """Centres of the bins on the axis of the box, (M, D) [length]."""
        points = np.tile(0.5 * np.array(self.lengths), (len(self.edges) - 1, 1))
        points[:, self.axis] = self.centers
        return points

    @property
    def shape(self) -> tuple[int, ...]:  # type: ignore[override]
        """(M,)."""
        return (len(self.edges) - 1,)

    @property
    def axes(self) -> tuple[tuple[str, Array], ...]:  # type: ignore[override]
        """The axis and the centres [length]."""
        return ((AXES[self.axis], self.centers),)


def axis_index(axis: int | str, dimension: int) -> int:
    """0 .. D - 1 from a number or a letter."""
    if isinstance(axis, str):
        return AXES.index(validation.choice("axis", axis, list(AXES[:dimension])))
    number = validation.integer("axis", axis, minimum=0)
    if number >= dimension:
        raise ValueError(f"`axis` must be below {dimension}, got {number}")
    return number


def _listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _vector(name: str, value: Any) -> tuple[float, ...]:
    vector = validation.vector(name, _listed(value))
    if len(vector) not in (2, 3):
        raise ValueError(f"`{name}` must have 2 or 3 entries, got {len(vector)}")
    return vector


def _counts(name: str, value: Any, length: int, *, minimum: int = 1) -> tuple[int, ...]:
    items = list(_listed(value))
    if len(items) != length:
        raise ValueError(f"`{name}` must have {length} entries, got {len(items)}")
    checked = (validation.integer(f"{name}[{k}]", n, minimum=minimum) for k, n in enumerate(items))
    return tuple(checked)


def _lattice_cells(shape: tuple[int, ...]) -> Cells:
    """Lines, quadrilaterals or hexahedra between the points of a lattice, axes of one point out."""
    kinds = {1: "line", 2: "quad", 3: "hexahedron"}
    index = np.arange(int(np.prod(shape))).reshape([n for n in shape if n > 1])
    if index.ndim == 0:
        return [("vertex", np.zeros((1, 1), dtype=np.int64))]
    corners: list[tuple[int, ...]] = [(0,), (1,)]
    if index.ndim >= 2:
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if index.ndim == 3:
        corners = [(*corner, top) for top in (0, 1) for corner in corners]
    views = [
        index[tuple(slice(k, n - 1 + k) for k, n in zip(corner, index.shape, strict=True))].ravel()
        for corner in corners
    ]
    return [(kinds[index.ndim], np.stack(views, axis=1))]


def _read_mesh(path: str | os.PathLike[str]) -> Any:
    meshio = optional.need("meshio", "visual", "to read meshes")
    try:
        return meshio.read(path)
    except SystemExit:  # its way of saying no to some VTK files
        raise ValueError(f"`mesh` must be a file that meshio reads, got {str(path)!r}") from None
