"""Particles, slices, streamlines and surfaces in space with PyVista, drawn without a screen.

Each function adds to a ``pyvista.Plotter`` and returns it; `save` writes the picture. Lengths are
drawn in units of the longest edge seen: VTK's tolerances are made for sizes near one.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import optional, validation
from sdpd.fields import FieldSet
from sdpd.fields.targets import Grid

from .curves import labelled, magnitude
from .gl import require_gl

if TYPE_CHECKING:
    from sdpd.simulation import Simulation
    from sdpd.walls import BoundaryParticles

__all__ = [
    "boundary_particles",
    "new_plotter",
    "particles",
    "save",
    "slices",
    "stream_tubes",
    "surface",
]

Array = NDArray[np.float64]

# A vertical bar of colours at the right edge, off the picture.
_BAR = {"vertical": True, "position_x": 0.85, "position_y": 0.2, "height": 0.6, "width": 0.06}
_COLOURS = ("speed", "density", "pressure", "velocity_x", "velocity_y", "velocity_z", "id")


def new_plotter(*, size: tuple[int, int] = (900, 700)) -> Any:
    """A ``pyvista.Plotter`` without a screen.

    Raises
    ------
    ImportError, RuntimeError
        If PyVista is not installed, or OpenGL does not work here; see `require_gl`.
    """
    require_gl()
    import pyvista

    return pyvista.Plotter(off_screen=True, window_size=size)


def _into(plotter: Any) -> Any:
    return new_plotter() if plotter is None else plotter


def _three(values: ArrayLike) -> Array:
    array = np.asarray(values, dtype=np.float64)
    return np.pad(array, ((0, 0), (0, 3 - array.shape[1])))


def particles(
    source: Simulation | ArrayLike,
    *,
    colour: str | ArrayLike = "speed",
    label: str | None = None,
    box: ArrayLike | None = None,
    point_size: float | None = None,
    unit: float | None = None,
    plotter: Any = None,
    **style: Any,
) -> Any:
    """Draw particles as spheres coloured by a quantity, and the box.

    Parameters
    ----------
    source : Simulation or array_like, shape (N, D)
        The simulation, or positions [length].
    colour : str or array_like, shape (N,)
        "speed", "density", "pressure", "velocity_x", ... or "id" of a simulation, or values.
    label : str, optional
        Of the colour bar.
    box : array_like, shape (D,), optional
        Edge lengths [length] to be outlined; those of the simulation.
    point_size : float, optional
        Diameter on the picture in pixels; chosen from their number if None.
    unit : float, optional
        Length that is drawn as 1; the longest edge of the box if None. Give it to draw several
        things together.
    plotter : pyvista.Plotter, optional
        Drawn into; a new one if None.
    **style
        For ``Plotter.add_points``, e.g. ``cmap``, ``clim``.

    Returns
    -------
    pyvista.Plotter
    """
    values, text = colour, label or ""
    if hasattr(source, "positions"):
        sim: Any = source
        positions = np.array(sim.positions)
        box = sim.scene.box.lengths if box is None else box
        if isinstance(colour, str):
            values, text = _colour(sim, colour), label or _colour_label(sim, colour)
    else:
        positions = validation.real_array("source", source, (None, None))
        if isinstance(colour, str):
            if colour != "speed":
                raise ValueError(f"`colour` must be an array for positions, got {colour!r}")
            values = np.zeros(len(positions))
    values = validation.real_array("colour", values, (len(positions),))
    edges = np.ptp(positions, axis=0) if box is None else np.asarray(box, dtype=np.float64)
    scale = 1.0 / (validation.positive("unit", unit) if unit is not None else float(edges.max()))
    pixels = point_size or float(np.clip(500.0 / len(positions) ** (1 / len(edges)), 2.0, 80.0))
    drawing = _into(plotter)
    look = {"cmap": "viridis", "scalar_bar_args": {**_BAR, "title": text}}
    drawing.add_points(
        _three(positions * scale),
        scalars=values,
        render_points_as_spheres=True,
        point_size=pixels,
        **{**look, **style},
    )
    if box is not None:
        _outline(drawing, edges * scale)
    if len(edges) == 2:
        drawing.view_xy()
    return drawing


def _colour(sim: Any, name: str) -> Array:
    validation.choice("colour", name, _COLOURS[: 3 + sim.scene.dimension] + ("id",))
    if name == "speed":
        return np.asarray(np.linalg.norm(sim.velocities, axis=1))
    if name.startswith("velocity"):
        return np.array(sim.velocities[:, "xyz".index(name[-1])])
    return np.asarray({"density": sim.densities, "pressure": sim.pressures, "id": sim.ids}[name])


def _colour_label(sim: Any, name: str) -> str:
    from sdpd.fields.quantities import built_in_unit

    kind = "velocity" if name == "speed" or name.startswith("velocity") else name
    if kind == "id":
        return "id"
    return labelled(name, built_in_unit(kind, sim.scene.dimension, si=sim.scene.fluid.is_si))


def _outline(drawing: Any, edges: Array) -> None:
    import pyvista

    top = [*edges, 0.0][:3]
    drawing.add_mesh(
        pyvista.Box((0.0, top[0], 0.0, top[1], 0.0, top[2])), style="wireframe", color="black"
    )


def _scaled(fields: FieldSet, unit: float | None) -> tuple[Any, float]:
    points = fields.target.points
    longest = float(np.ptp(points, axis=0).max())
    scale = 1.0 / (longest if unit is None else validation.positive("unit", unit))
    mesh = fields.to_pyvista()
    return mesh.scale(scale, inplace=False), scale


def slices(
    fields: FieldSet,
    name: str,
    *,
    normals: str = "xyz",
    unit: float | None = None,
    plotter: Any = None,
    **style: Any,
) -> Any:
    """Draw slices of a field through the middle of a three-dimensional grid, or the whole plane.

    Parameters
    ----------
    fields : sdpd.fields.FieldSet
        On a `Grid` or a `Plane`.
    name : str
        A scalar or a component, e.g. ``"velocity_x"``; of a vector the magnitude.
    normals : str
        Axes that the slices of a grid are normal to.
    unit, plotter
        As for `particles`; the unit is the longest edge of the grid if None.
    **style
        For ``Plotter.add_mesh``.

    Returns
    -------
    pyvista.Plotter
    """
    chosen = fields[name]
    mesh, _ = _scaled(fields, unit)
    values = chosen.mean
    if chosen.components:
        values = np.linalg.norm(values, axis=-1)
        chosen = replace(chosen, name=magnitude(chosen.name))
    text = labelled(chosen.name, chosen.unit)
    # VTK counts the first axis fastest
    mesh.point_data.clear()
    mesh.point_data[text] = values.reshape(fields.target.shape).ravel(order="F")
    drawing = _into(plotter)
    for axis in normals:
        validation.choice("normals", axis, ("x", "y", "z"))
    flat = not isinstance(fields.target, Grid) or min(fields.target.shape) == 1
    flat = flat or fields.target.dimension == 2
    for piece in [mesh] if flat else [mesh.slice(normal=axis) for axis in normals]:
        look: dict[str, Any] = {"cmap": "viridis", "lighting": False, "scalar_bar_args": _BAR}
        drawing.add_mesh(piece, scalars=text, **{**look, **style})
    return _framed(drawing, fields, mesh)


def _framed(drawing: Any, fields: FieldSet, mesh: Any) -> Any:
    """Outlined, and seen from above if there is nothing to see from elsewhere."""
    drawing.add_mesh(mesh.outline(), color="black")
    if fields.target.dimension == 2:
        drawing.view_xy()
    return drawing


def stream_tubes(
    fields: FieldSet,
    name: str = "velocity",
    *,
    n_lines: int = 80,
    radius: float = 0.004,
    unit: float | None = None,
    plotter: Any = None,
    **style: Any,
) -> Any:
    """Draw streamlines of a vector field on a three-dimensional grid as tubes.

    Parameters
    ----------
    fields : sdpd.fields.FieldSet
        On a `Grid`.
    name : str
        The vector.
    n_lines : int
        Points they start from, in a ball half as wide as the grid.
    radius : float
        Of the tubes, over the longest edge.
    unit, plotter
        As for `slices`.
    **style
        For ``Plotter.add_mesh``.

    Returns
    -------
    pyvista.Plotter
    """
    chosen = fields[name]
    if len(chosen.components) != 3 or not isinstance(fields.target, Grid):
        raise ValueError(f"`name` must be that of a vector on a Grid in three dimensions: {name!r}")
    mesh, _ = _scaled(fields, unit)
    speed = labelled(magnitude(chosen.name), chosen.unit)
    vectors = np.nan_to_num(np.asarray(mesh.point_data[name]))
    size = np.linalg.norm(vectors, axis=1)
    top = float(size.max())
    mesh.point_data.clear()
    mesh.point_data["direction"] = vectors / (top or 1.0)
    mesh.point_data[speed] = size
    lines = mesh.streamlines(
        "direction",
        n_points=validation.integer("n_lines", n_lines, minimum=1),
        source_radius=0.25 * mesh.length,
        max_length=4.0 * mesh.length,
    )
    drawing = _into(plotter)
    if lines.n_points:
        tubes = lines.tube(radius=validation.positive("radius", radius))
        look: dict[str, Any] = {"cmap": "viridis", "scalar_bar_args": _BAR}
        drawing.add_mesh(tubes, scalars=speed, **{**look, **style})
    return _framed(drawing, fields, mesh)


def surface(
    points: ArrayLike,
    triangles: ArrayLike | None = None,
    *,
    normals: ArrayLike | None = None,
    colour: ArrayLike | None = None,
    label: str = "",
    arrow: float = 0.05,
    unit: float | None = None,
    plotter: Any = None,
    **style: Any,
) -> Any:
    """Draw a surface by its points, with triangles between them and normals on them.

    Parameters
    ----------
    points : array_like, shape (V, D)
        [length].
    triangles : array_like of int, shape (F, 3), or (F, 2) for a polyline, optional
        Points of each; the points alone are drawn if None.
    normals : array_like, shape (V, D), optional
        Drawn as arrows.
    colour : array_like, shape (V,), optional
        A value at each point.
    label : str
        Of the colour bar.
    arrow : float
        Length of the arrows over the longest extent of the surface.
    unit, plotter
        As for `particles`; the unit is the longest extent if None.
    **style
        For ``Plotter.add_mesh``, e.g. ``opacity``.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape.
    """
    places = validation.real_array("points", points, (None, None))
    if places.shape[1] not in (2, 3) or not len(places):
        raise ValueError(f"`points` must be rows of 2 or 3 coordinates, got {places.shape}")
    arrows = None if normals is None else validation.real_array("normals", normals, places.shape)
    faces = None if triangles is None else _faces(triangles, len(places))
    values = None if colour is None else validation.real_array("colour", colour, (len(places),))
    drawing = _into(plotter)
    import pyvista

    longest = float(np.ptp(places, axis=0).max()) or 1.0
    scale = 1.0 / (longest if unit is None else validation.positive("unit", unit))
    cloud = _three(places * scale)
    mesh = pyvista.PolyData(cloud)
    if faces is not None:
        lead = np.full((len(faces), 1), faces.shape[1])
        key = {"faces": np.hstack([lead, faces]).ravel()}
        mesh = pyvista.PolyData(cloud, **(key if faces.shape[1] == 3 else {"lines": key["faces"]}))
    look: dict[str, Any] = {"color": "lightsteelblue", "line_width": 2.0}
    if values is not None:
        mesh.point_data[label or "value"] = values
        look = {"scalars": label or "value", "cmap": "viridis", "scalar_bar_args": _BAR}
    drawing.add_mesh(mesh, **{**look, **style})
    if arrows is not None:
        drawing.add_arrows(cloud, _three(arrows), mag=arrow * longest * scale, color="firebrick")
    if places.shape[1] == 2:
        drawing.view_xy()
    return drawing


def boundary_particles(
    points: ArrayLike | BoundaryParticles,
    normals: ArrayLike | None = None,
    *,
    colour: ArrayLike | None = None,
    label: str = "",
    spacing: float | None = None,
    unit: float | None = None,
    plotter: Any = None,
    **style: Any,
) -> Any:
    """Draw the particles of a boundary as spheres, each with its normal as an arrow.

    Parameters
    ----------
    points : array_like, shape (V, D), or BoundaryParticles
        [length]; what `Wall.boundary_particles` returns has its normals.
    normals : array_like, shape (V, D), optional
        Directions, of any length; drawn as arrows of 1.5 spacings.
    colour : array_like, shape (V,), optional
        A value of each, e.g. a curvature; one colour if None.
    label : str
        Of the colour bar.
    spacing : float, optional
        Diameter of the spheres [length]; the median distance to the next point if None.
    unit, plotter
        As for `particles`; the unit is the longest extent if None.
    **style
        For ``Plotter.add_mesh`` of the spheres.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape, or a normal is zero.
    """
    from sdpd.walls import BoundaryParticles

    if isinstance(points, BoundaryParticles):
        normals = points.normals if normals is None else normals
        points = points.positions
    elif normals is None:
        raise TypeError("`normals` must be given, unless `points` are the BoundaryParticles")
    places = validation.real_array("points", points, (None, None))
    if places.shape[1] not in (2, 3) or len(places) < 2:
        raise ValueError(f"`points` must be 2 rows or more of 2 or 3 numbers, got {places.shape}")
    arrows = validation.real_array("normals", normals, places.shape)
    length = np.linalg.norm(arrows, axis=1)
    if not np.all(length > 0.0):
        raise ValueError(f"`normals` must not be zero, got row {int(np.argmin(length))}")
    values = None if colour is None else validation.real_array("colour", colour, (len(places),))
    if spacing is None:
        from scipy.spatial import cKDTree

        apart = float(np.median(cKDTree(places).query(places, k=2)[0][:, 1]))
    else:
        apart = validation.positive("spacing", spacing)
    drawing = _into(plotter)
    import pyvista

    longest = float(np.ptp(places, axis=0).max())
    scale = 1.0 / (longest if unit is None else validation.positive("unit", unit))
    cloud = pyvista.PolyData(_three(places * scale))
    look: dict[str, Any] = {"color": "lightsteelblue"}
    if values is not None:
        cloud.point_data[label or "value"] = values
        look = {"scalars": label or "value", "cmap": "viridis", "scalar_bar_args": _BAR}
    ball = pyvista.Sphere(radius=0.5 * apart * scale, theta_resolution=12, phi_resolution=12)
    drawing.add_mesh(cloud.glyph(geom=ball, scale=False, orient=False), **{**look, **style})
    directions = _three(arrows / length[:, None])
    drawing.add_arrows(cloud.points, directions, mag=1.5 * apart * scale, color="firebrick")
    if places.shape[1] == 2:
        drawing.view_xy()
    return drawing


def _faces(triangles: ArrayLike, count: int) -> NDArray[np.int64]:
    faces = np.asarray(triangles)
    if faces.ndim != 2 or faces.shape[1] not in (2, 3) or faces.dtype.kind not in "iu":
        raise ValueError(
            f"`triangles` must be integers of shape (F, 3) or (F, 2), got {faces.dtype} of shape "
            f"{faces.shape}"
        )
    if faces.size and not (faces.min() >= 0 and faces.max() < count):
        raise ValueError(f"`triangles` must name points 0 to {count - 1}, got {faces.max()}")
    return faces.astype(np.int64)


def save(plotter: Any, path: str | os.PathLike[str]) -> Path:
    """Write the picture and close the plotter.

    Parameters
    ----------
    plotter : pyvista.Plotter
    path : path
        Ending in ``.png``, or in ``.html`` for a scene that turns in the browser.

    Returns
    -------
    Path

    Raises
    ------
    ImportError
        If trame-pyvista is not installed and the ending is ``.html``.
    ValueError
        For another ending.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind not in (".png", ".html"):
        raise ValueError(f"`path` must end in .png or .html, got {str(target)!r}")
    if kind == ".html":
        optional.need("trame_pyvista", "html", "to write HTML")
        plotter.trame.export_html(target)
    else:
        plotter.screenshot(target)
    plotter.close()
    return target
