"""A wall in three dimensions: a triangulated surface, in memory or from a file."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import optional, running, validation
from sdpd.box import AXES, Box
from sdpd.errors import ResolutionWarning
from sdpd.walls.base import check_extent
from sdpd.walls.polyline import largest_speed
from sdpd.walls.shaped import ShapedWall, crossing, merged, tiled

if TYPE_CHECKING:
    from sdpd._core import Solid

__all__ = ["Mesh"]

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]
_SIDES = ("outside", "inside")
_SAME = 1e-9  # of the extent: points that are one
_COARSE = 0.65  # of a support: longest edges between facets of a curved surface
_CURVED = (0.03, 0.6)  # angles between facets of one [rad]: below it is flat, above it has an edge


@dataclass(frozen=True, kw_only=True, repr=False)
class Mesh(ShapedWall):
    """A surface of triangles, which seen from outside of the solid or vessel go round
    counter-clockwise.

    It must be closed, or go on through periodic faces of the box on which its edges match.

    Parameters
    ----------
    file : path, optional
        STL, PLY, OBJ, VTK, Gmsh or whatever else meshio reads; triangles are taken, polygons with
        four corners split.
    points : sequence of points, shape (N, 3), optional
        [length]; instead of `file`, with `triangles`.
    triangles : sequence of three numbers of points, shape (M, 3), optional
    fluid : {"outside", "inside"}
        Which side of the surface the fluid is on.
    scale : float
        Factor of the coordinates, e.g. 1e-3 for a file in millimetres.
    offset : sequence of float, three of them
        Added to the scaled coordinates [length].
    velocity, angular_velocity, centre, slip
        As for `ShapedWall`.

    Raises
    ------
    ImportError
        If `file` is given and meshio is not installed (``pip install 'sdpd[visual]'``).
    OSError
        If the file cannot be read.
    TypeError, ValueError
        If there are no triangles, one is degenerate, or they cross, are not closed, or do not all
        go round the same way; the text names the place.

    Notes
    -----
    Points and triangles are all that is kept: comparing, saving and scene files go by the content,
    not by the name of the file.

    Examples
    --------
    >>> import numpy as np
    >>> import sdpd
    >>> corners = [(2, 2, 2), (4, 2, 2), (2, 4, 2), (2, 2, 4)]
    >>> body = sdpd.Mesh(
    ...     points=corners, triangles=[(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    ... )
    >>> body.distance(np.array([[3.0, 3.0, 1.0]]), sdpd.Box((6.0, 6.0, 6.0))).tolist()
    [1.0]
    """

    file: str | os.PathLike[str] | None = None
    points: tuple[tuple[float, ...], ...] = ()
    triangles: tuple[tuple[int, ...], ...] = ()
    fluid: str = "outside"
    scale: float = 1.0
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        validation.choice("fluid", self.fluid, _SIDES)
        scale = validation.positive("scale", self.scale)
        offset = validation.vector("offset", self.offset, length=3)
        given = len(self.points) > 0 or len(self.triangles) > 0
        if (self.file is None) == (not given):
            raise ValueError("a Mesh needs either `file`, or `points` and `triangles`")
        if self.file is not None:
            points, triangles = _read(self.file)
        else:
            points = validation.real_array("points", self.points, (None, 3))
            triangles = _whole(self.triangles)
        with np.errstate(over="ignore", invalid="ignore"):
            points = points * scale + np.asarray(offset)
        check_extent("points", points)
        if not len(triangles):
            raise ValueError("`triangles` must hold at least one, got none")
        points, triangles = _cleaned(points, triangles)
        for name, value in (
            ("points", tuple(map(tuple, points.tolist()))),
            ("triangles", tuple(map(tuple, triangles.tolist()))),
            ("file", None),
            ("scale", 1.0),
            ("offset", (0.0, 0.0, 0.0)),
        ):
            object.__setattr__(self, name, value)
        _refuse_degenerate(points, triangles)
        _refuse_disorder(triangles, points)
        self._refuse_crossings(points, triangles)
        if not len(_open_edges(triangles)):
            _refuse_inside_out(points, triangles)

    @staticmethod
    def _refuse_crossings(points: Array, triangles: Triangles) -> None:
        from sdpd import _core

        found = _core.Solid(
            points, triangles.astype(np.uint32), running.available_threads()
        ).crossing()
        if found is not None:
            first, second = found
            at = points[triangles[first]].mean(axis=0)
            raise ValueError(
                f"`triangles` must not cross each other, got {first} and {second} near {_place(at)}"
            )

    def _arrays(self) -> tuple[Array, Triangles]:
        return np.asarray(self.points), np.asarray(self.triangles)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        super().check(box, name)
        if box.dimension != 3:
            raise ValueError(f"`{name}` is a Mesh, which needs three dimensions; use a Polyline")
        points, triangles = self._arrays()
        loose = _open_edges(triangles)
        if len(loose):
            self._check_faces(box, name, points, triangles, loose)
        if (found := crossing(_solid(self, box))) is not None:
            at = points[triangles[found[0] % len(triangles)]].mean(axis=0)
            raise ValueError(
                f"`{name}` must not cross its own periodic image, got that near {_place(at)}"
            )

    def _check_faces(
        self, box: Box, name: str, points: Array, triangles: Triangles, loose: Triangles
    ) -> None:
        lengths = np.asarray(box.lengths)
        periodic = np.array([axis in box.periodic_axes for axis in AXES])
        size = np.where(periodic, lengths, np.inf)
        with np.errstate(invalid="ignore"):
            turns = np.where(periodic, np.floor(points / size + 1e-9) * lengths, 0.0)
        _, number = merged(points - turns, 1e-7 * float(lengths.max()))
        left = _open_edges(number[triangles])
        if len(left):
            # the place of the first edge that has no partner
            edges = {tuple(edge) for edge in left.tolist()}
            worst = next(e for e in loose.tolist() if tuple(number[e].tolist()) in edges)
            raise ValueError(
                f"`{name}` must be a closed surface, or match itself on periodic faces of the box, "
                f"got {len(left)} edges of one triangle only, the first at "
                f"{_place(points[worst].mean(axis=0))}"
            )

    def distance(self, points: Array, box: Box) -> Array:  # noqa: D102
        lengths = np.asarray(box.lengths)
        periodic = [axis in box.periodic_axes for axis in AXES]
        flat = np.where(periodic, np.mod(points, lengths), points).reshape(-1, 3)
        found = np.asarray(_solid(self, box).distances(np.ascontiguousarray(flat)))
        return (found if self.fluid == "outside" else -found).reshape(points.shape[:-1])

    def centroid(self, box: Box) -> Array:  # noqa: D102
        return self._middle()

    def _middle(self) -> Array:
        points, triangles = self._arrays()
        weight = _areas(points, triangles)
        return np.asarray(weight @ points[triangles].mean(axis=1) / weight.sum())

    def measure(self, box: Box) -> float:  # noqa: D102
        return float(_areas(*self._arrays()).sum())

    def points_on(self, box: Box, spacing: float) -> Array:  # noqa: D102
        points, triangles = self._arrays()
        total = np.cumsum(_areas(points, triangles))
        count = max(1, round(float(total[-1]) / spacing**2))
        k = np.arange(count)
        which = np.searchsorted(total, (k + 0.5) / count * total[-1])
        # quasi-random places in the triangles: the additive recurrence of two dimensions
        s, t = (0.5 + k * 0.7548776662466927) % 1.0, (0.5 + k * 0.5698402909980532) % 1.0
        beyond = s + t > 1.0
        s, t = np.where(beyond, 1.0 - s, s), np.where(beyond, 1.0 - t, t)
        a, b, c = np.moveaxis(points[triangles[which]], 1, 0)
        return np.asarray(a + s[:, None] * (b - a) + t[:, None] * (c - a))

    def warn(self, support: float, name: str) -> None:  # noqa: D102
        points, triangles = self._arrays()
        edges, angle, length = _hinges(points, triangles)
        curved = (angle > _CURVED[0]) & (angle < _CURVED[1]) & (length > _COARSE * support)
        if curved.any():
            worst = int(np.argmax(np.where(curved, length, 0.0)))
            at = points[edges[worst]].mean(axis=0)
            warnings.warn(
                f"`{name}` is coarse where it is curved: an edge of {length[worst]:.3g} at "
                f"{_place(at)} is longer than {_COARSE:g} of the support, h = {support:.4g}; "
                "refine it, or energy drifts",
                ResolutionWarning,
                stacklevel=3,
            )

    @property
    def speed(self) -> float:  # noqa: D102
        return largest_speed(self, np.asarray(self.points), self._middle())

    def __repr__(self) -> str:
        size = f"{len(self.points)} points, {len(self.triangles)} triangles"
        return f"Mesh({size}, fluid={self.fluid!r})"

    __str__ = __repr__


def _place(at: Array) -> tuple[float, ...]:
    return tuple(float(f"{x:.4g}") for x in at)


def _whole(value: Any) -> Triangles:
    array = np.asarray(value)
    if array.ndim != 2 or array.shape[1] != 3 or not np.issubdtype(array.dtype, np.integer):
        raise TypeError(
            f"`triangles` must be integers of shape (M, 3), got {array.dtype} {array.shape}"
        )
    return array.astype(np.int64)


def _read(file: str | os.PathLike[str]) -> tuple[Array, Triangles]:
    meshio = optional.need("meshio", "visual", "to read meshes")
    path = os.fspath(file)
    if not os.path.isfile(path):
        raise FileNotFoundError(f"`file` must be a mesh, but there is no file {path!r}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy, about how meshio guesses the format
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - meshio ends the process
        raise ValueError(
            f"`file` must be a mesh that meshio reads, got {path!r} ({error})"
        ) from None
    found = []
    for block in mesh.cells:
        if block.type.startswith("triangle"):
            found.append(block.data[:, :3])
        elif block.type.startswith("quad"):
            found += [block.data[:, [0, 1, 2]], block.data[:, [0, 2, 3]]]
    if not found:
        raise ValueError(f"`file` must hold triangles, got none in {path!r}")
    return np.asarray(mesh.points, dtype=float)[:, :3], np.concatenate(found).astype(np.int64)


def _cleaned(points: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """Points that coincide made one (an STL file repeats them), those of no triangle left out."""
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise ValueError(
            f"`triangles` must hold numbers of the {len(points)} points, got "
            f"{triangles.min()} to {triangles.max()}"
        )
    extent = float(np.ptp(points[triangles.ravel()], axis=0).max())
    distinct, number = merged(points, _SAME * extent)
    triangles = number[triangles]
    used, again = np.unique(triangles, return_inverse=True)
    return distinct[used], again.reshape(triangles.shape)


def _areas(points: Array, triangles: Triangles) -> Array:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _volume(points: Array, triangles: Triangles) -> float:
    a, b, c = np.moveaxis(points[triangles] - points.mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _refuse_inside_out(points: Array, triangles: Triangles) -> None:
    """Each closed part must go round counter-clockwise seen from outside, and the other way round
    where it bounds a hollow of another.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    from sdpd import _core

    edges = _directed(triangles)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(points),) * 2)
    count, part = connected_components(graph, directed=False)
    pieces = [triangles[part[triangles[:, 0]] == k] for k in range(count)]
    solids = []
    for piece in pieces if count > 1 else []:
        # whichever way it goes round: the other one has its inside outside
        turned = piece if _volume(points, piece) > 0.0 else piece[:, ::-1]
        solids.append(_core.Solid(points, np.ascontiguousarray(turned, dtype=np.uint32), 1))
    for k, piece in enumerate(pieces):
        first = points[piece[0, 0]]
        around = [s.distances(first[None])[0] < 0.0 for j, s in enumerate(solids) if j != k]
        hollow = sum(around) % 2 == 1
        volume = _volume(points, piece) * (-1.0 if hollow else 1.0)
        extent = float(np.ptp(points[piece.ravel()], axis=0).max())
        if abs(volume) <= 1e-9 * extent**3:
            raise ValueError(
                f"`triangles` must enclose a volume, got none in the part at {_place(first)}"
            )
        if volume < 0.0:
            where = "within another part" if hollow else "seen from outside"
            way = "clockwise" if hollow else "counter-clockwise"
            raise ValueError(
                f"`triangles` must go round {way} {where}, got the other way round in the part at "
                f"{_place(first)}: exchange two columns, or use `fluid` to say which side the "
                "fluid is on"
            )


def _refuse_degenerate(points: Array, triangles: Triangles) -> None:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    longest = np.max([np.linalg.norm(x, axis=1) for x in (b - a, c - b, a - c)], axis=0)
    flat = _areas(points, triangles) <= 1e-9 * longest**2
    if flat.any():
        k = int(np.argmax(flat))
        raise ValueError(
            f"`triangles` must have an area, got none in {int(flat.sum())} of them, the first "
            f"being {k} at {_place(points[triangles[k]].mean(axis=0))}"
        )


def _directed(triangles: Triangles) -> Triangles:
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _open_edges(triangles: Triangles) -> Triangles:
    """Directed edges without one in the other direction, (k, 2)."""
    edges = _directed(triangles)
    count = int(triangles.max()) + 1
    forward, backward = edges @ [count, 1], edges @ [1, count]
    return edges[~np.isin(forward, backward)]


def _refuse_disorder(triangles: Triangles, points: Array) -> None:
    edges = _directed(triangles)
    distinct, count = np.unique(edges, axis=0, return_counts=True)
    if (count > 1).any():
        edge = distinct[np.argmax(count > 1)]
        raise ValueError(
            "`triangles` must all go round the same way, with two at each edge, got an edge passed "
            f"twice in one direction at {_place(points[edge].mean(axis=0))}"
        )


def _hinges(points: Array, triangles: Triangles) -> tuple[Triangles, Array, Array]:
    """Inner edges, the angle between their triangles [rad] and their length."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edges = _directed(triangles)
    owner = np.tile(np.arange(len(triangles)), 3)
    count = int(triangles.max()) + 1
    order = np.argsort(edges @ [count, 1])
    keys = (edges @ [count, 1])[order]
    wanted = edges @ [1, count]
    at = np.searchsorted(keys, wanted)
    found = (at < len(keys)) & (keys[np.minimum(at, len(keys) - 1)] == wanted)
    found &= edges[:, 0] < edges[:, 1]
    other = owner[order[at[found]]]
    cosine = np.einsum("ij,ij->i", normal[owner[found]], normal[other])
    inner = edges[found]
    length = np.linalg.norm(points[inner[:, 0]] - points[inner[:, 1]], axis=1)
    return inner, np.arccos(np.clip(cosine, -1.0, 1.0)), length


@lru_cache(maxsize=8)
def _solid(wall: Mesh, box: Box) -> Solid:
    """The triangles, with the copies of them that are near the box."""
    from sdpd import _core

    points, triangles = wall._arrays()
    shifts = tiled(points, box)
    copies = np.concatenate([points + shift for shift in shifts])
    every = np.concatenate([triangles + k * len(points) for k in range(len(shifts))])
    if len(shifts) > 1 and len(_open_edges(triangles)):
        copies, number = merged(copies, 1e-7 * max(box.lengths))
        every = number[every]
    return _core.Solid(copies, every.astype(np.uint32), running.available_threads())
