"""Where the fluid is: the box less what lies behind the walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sdpd.box import AXES, Box
from sdpd.walls import Cylinder, Plane, ShapedWall, Sphere, Wall

__all__ = ["Geometry"]

Array = NDArray[np.float64]
_FACE_POINTS = 24  # along each edge of a face of the box that must be closed
_CELLS = {2: 1024, 3: 128}  # of the numerical volume, along each axis
_COARSE_CELLS = {2: 128, 3: 32}  # with walls of any shape, along the longest axis
_FINE_CELLS = {2: 8, 3: 4}  # in each of them at a wall


@dataclass(frozen=True)
class Geometry:
    """The part of a box that the walls leave to the fluid."""

    box: Box
    walls: tuple[Wall, ...]

    @property
    def planes(self) -> list[Plane]:
        """The walls that are planes."""
        return [wall for wall in self.walls if isinstance(wall, Plane)]

    @property
    def round_walls(self) -> list[Cylinder | Sphere]:
        """The cylinders and spheres."""
        return [wall for wall in self.walls if isinstance(wall, (Cylinder, Sphere))]

    @property
    def is_shaped(self) -> bool:
        """Whether there are walls of any shape."""
        return any(isinstance(wall, ShapedWall) for wall in self.walls)

    @cached_property
    def extents(self) -> tuple[tuple[float, float], ...]:
        """Lowest and highest coordinate of the fluid on each axis [length], by the planes that are
        at right angles to it.
        """
        low, high = [0.0] * self.box.dimension, list(self.box.lengths)
        for plane in self.planes:
            point, normal = plane.frame(self.box)
            axis = int(np.argmax(np.abs(normal)))
            if abs(normal[axis]) < 1.0 - 1e-12:
                continue
            if normal[axis] > 0.0:
                low[axis] = max(low[axis], float(point[axis]))
            else:
                high[axis] = min(high[axis], float(point[axis]))
        return tuple(zip(low, high, strict=True))

    @property
    def is_tilted(self) -> bool:
        """Whether some plane is at an angle to the axes."""
        frames = (plane.frame(self.box)[1] for plane in self.planes)
        return any(np.abs(normal).max() < 1.0 - 1e-12 for normal in frames)

    @property
    def is_cuboid(self) -> bool:
        """Whether the fluid fills a box of its own."""
        return not self.round_walls and not self.is_tilted and not self.is_shaped

    @property
    def cuboid(self) -> Box:
        """A box of the size of `extents`."""
        return Box(tuple(high - low for low, high in self.extents))

    @property
    def width(self) -> float:
        """Scale of the flow [length]: the narrowest distance between walls, or a diameter."""
        widths = [2.0 * wall.radius for wall in self.round_walls]
        for (low, high), axis in zip(self.extents, AXES, strict=False):
            if axis not in self.box.periodic_axes:
                widths.append(high - low)
        if self.is_shaped:
            widths.append(2.0 * self._measured[1])
        return min(widths, default=min(self.box.lengths))

    def distance(self, points: Array) -> Array:
        """Distance to the nearest wall [length], of points (..., D); > 0 in the fluid."""
        result = np.full(points.shape[:-1], math.inf)
        for wall in self.walls:
            np.minimum(result, wall.distance(points, self.box), out=result)
        return result

    @cached_property
    def volume(self) -> float:
        """Volume of the fluid [length^D]."""
        if not self.walls:
            return self.box.volume
        if self.is_shaped:
            return self._measured[0]
        if self.is_tilted:
            return self._numerical_volume()
        lengths = [high - low for low, high in self.extents]
        inner = [wall for wall in self.round_walls if wall.fluid == "inside"]
        total = self._body(inner[0], lengths) if inner else math.prod(lengths)
        bodies = (wall for wall in self.round_walls if wall.fluid == "outside")
        return total - sum(self._body(wall, lengths) for wall in bodies)

    def _body(self, wall: Cylinder | Sphere, lengths: Sequence[float]) -> float:
        if isinstance(wall, Sphere):
            return 4.0 / 3.0 * math.pi * wall.radius**3
        length = lengths[AXES.index(wall.axis)] if self.box.dimension == 3 else 1.0
        return math.pi * wall.radius**2 * length

    def _numerical_volume(self) -> float:
        """Midpoint rule on cells, those at a wall by how much of them is in the fluid."""
        dimension = self.box.dimension
        cells = _CELLS[dimension]
        edges = [length / cells for length in self.box.lengths]
        axes = [(np.arange(cells) + 0.5) * edge for edge in edges]
        width = math.prod(edges) ** (1.0 / dimension)
        total = 0.0
        for first in axes[0]:  # slice by slice: memory
            grid = np.stack(np.meshgrid(np.array([first]), *axes[1:], indexing="ij"), axis=-1)
            share = np.clip(0.5 + self.distance(grid) / width, 0.0, 1.0)
            total += float(share.sum())
        return total * math.prod(edges)

    @cached_property
    def _measured(self) -> tuple[float, float]:
        """Volume and largest distance to a wall, by cells: finer ones where a wall is near."""
        dimension = self.box.dimension
        lengths = np.asarray(self.box.lengths)
        edge = lengths.max() / _COARSE_CELLS[dimension]
        counts = np.maximum(1, np.ceil(lengths / edge)).astype(int)
        edges = lengths / counts
        index = np.indices(counts).reshape(dimension, -1).T
        centres = (index + 0.5) * edges
        distance = self.distance(centres)
        cut = np.abs(distance) < 0.5 * float(np.linalg.norm(edges)) * (1.0 + 1e-9)
        total = float((distance[~cut] > 0.0).sum())
        parts = _FINE_CELLS[dimension]
        offsets = (np.indices((parts,) * dimension).reshape(dimension, -1).T + 0.5) / parts - 0.5
        width = float(np.prod(edges)) ** (1.0 / dimension) / parts
        for chunk in np.array_split(centres[cut], max(1, int(cut.sum()) // 4096)):  # memory
            fine = chunk[:, None, :] + offsets * edges
            share = np.clip(0.5 + self.distance(fine) / width, 0.0, 1.0)
            total += float(share.sum()) / len(offsets)
        return total * float(np.prod(edges)), float(max(distance.max(initial=0.0), 0.0))

    def area(self, index: int) -> float:
        """Area of a wall in the box [length^(D-1)]; NaN where it has no simple one."""
        wall = self.walls[index]
        lengths = [high - low for low, high in self.extents]
        if isinstance(wall, Plane):
            axis = int(np.argmax(np.abs(wall.frame(self.box)[1])))
            if not self.is_cuboid:
                return float("nan")
            return float(np.prod([length for k, length in enumerate(lengths) if k != axis]))
        if isinstance(wall, ShapedWall):
            return wall.measure(self.box)
        if isinstance(wall, Sphere):
            return float(4.0 * np.pi * wall.radius**2)
        assert isinstance(wall, Cylinder)
        length = lengths[AXES.index(wall.axis)] if self.box.dimension == 3 else 1.0
        return float(2.0 * np.pi * wall.radius * length)

    def check_closed(self) -> None:
        """Raise ValueError where the fluid reaches an end of the box that is not periodic."""
        dimension, lengths = self.box.dimension, self.box.lengths
        for axis in range(dimension):
            if AXES[axis] in self.box.periodic_axes:
                continue
            others = [
                (np.arange(_FACE_POINTS) + 0.5) / _FACE_POINTS * lengths[k]
                if k != axis
                else np.array([0.0, lengths[axis]])
                for k in range(dimension)
            ]
            points = np.stack(np.meshgrid(*others, indexing="ij"), axis=-1).reshape(-1, dimension)
            open_ = points[self.distance(points) > 1e-9 * max(lengths)]
            if len(open_):
                raise ValueError(
                    f"`walls` must close the box along {AXES[axis]}, which is not periodic, got "
                    f"fluid at {tuple(float(x) for x in open_[0])}; add a wall (see "
                    "sdpd.walls.slab and enclosure) or make the axis periodic"
                )
