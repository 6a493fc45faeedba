"""Fields for xarray, meshio and PyVista, and as files."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import optional
from sdpd.box import AXES

from .targets import Grid, Plane

if TYPE_CHECKING:
    from .field_set import FieldSet

__all__ = ["to_meshio", "to_pyvista", "to_xarray", "write"]

Array = NDArray[np.float64]


def to_xarray(fields: FieldSet) -> Any:
    """See `FieldSet.to_xarray`."""
    xarray = optional.need("xarray", "xarray", "for to_xarray()")
    dims = [name for name, _ in fields.target.axes]
    coordinates: dict[str, Any] = {}
    for name, line in fields.target.axes:
        coordinates[name] = (name, line, {} if name == "point" else {"units": fields.length_unit})
    if dims == ["point"]:
        for axis, column in zip(AXES, fields.target.points.T, strict=False):
            coordinates[axis] = ("point", column, {"units": fields.length_unit})
    variables: dict[str, Any] = {}
    for name in fields:
        found, over = fields[name], list(dims)
        if found.components:
            over.append(f"{name}_component")
            coordinates[over[-1]] = list(found.components)
        unit = {"units": found.unit}
        variables[name] = (over, found.mean, unit)
        variables[f"{name}_stderr"] = (over, found.stderr, unit)
    notes: dict[str, Any] = {
        "n_frames": fields.n_frames,
        "n_blocks": fields.n_blocks,
        "time": fields.time,
    }
    if fields.kernel is not None:
        notes |= {"kernel": fields.kernel, "averaging_length": fields.length}
    return xarray.Dataset(variables, coords=coordinates, attrs=notes)


def _padded(values: Array) -> Array:
    """Vectors with a third component: the formats know no others."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.pad(values, ((0, 0), (0, 1)))
    return values


def _point_data(fields: FieldSet) -> dict[str, Array]:
    data = {}
    for name in fields:
        found = fields[name]
        tail = (len(found.components),) if found.components else ()
        shape = (len(fields.target), *tail)
        data[name] = _padded(found.mean.reshape(shape))
        if fields.n_blocks > 1:
            data[f"{name}_stderr"] = _padded(found.stderr.reshape(shape))
    return data


def to_meshio(fields: FieldSet) -> Any:
    """See `FieldSet.to_meshio`."""
    meshio = optional.need("meshio", "visual", "for to_meshio()")
    points = _padded(fields.target.points)
    return meshio.Mesh(points, fields.target.cells, point_data=_point_data(fields))


def to_pyvista(fields: FieldSet) -> Any:
    """See `FieldSet.to_pyvista`."""
    pyvista = optional.need("pyvista", "visual", "for to_pyvista()")
    target = fields.target
    points = _padded(target.points)
    if isinstance(target, Grid):
        lines = [line for _, line in target.axes]
        steps = [line[1] - line[0] if len(line) > 1 else 1.0 for line in lines]
        shape = (*target.shape, 1)[:3]
        mesh = pyvista.ImageData(
            dimensions=shape,
            spacing=tuple([*steps, 1.0][:3]),
            origin=tuple([*(line[0] for line in lines), 0.0][:3]),
        )
        order: Any = np.arange(len(target)).reshape(shape).ravel(order="F")  # VTK: x fastest
    elif isinstance(target, Plane):
        grid = points.reshape(*target.shape, 1, 3)
        mesh = pyvista.StructuredGrid(*np.moveaxis(grid, -1, 0))
        order = np.arange(len(target)).reshape(target.shape).ravel(order="F")
    else:
        mesh, order = pyvista.from_meshio(to_meshio(fields)), slice(None)
        mesh.clear_data()
    for name, values in _point_data(fields).items():
        mesh.point_data[name] = values[order]
    return mesh


def _rows(fields: FieldSet) -> tuple[list[str], list[Array]]:
    header = [f"{axis} [{fields.length_unit}]" for axis in AXES[: fields.target.dimension]]
    columns = list(fields.target.points.T)
    for name in fields:
        whole = fields[name]
        parts = [whole.component(c) for c in whole.components] if whole.components else [whole]
        for part in parts:
            unit = f" [{part.unit}]" if part.unit else ""
            header += [f"{part.name}{unit}", f"{part.name} stderr{unit}"]
            columns += [part.mean.ravel(), part.stderr.ravel()]
    return header, columns


def write(fields: FieldSet, path: str | os.PathLike[str]) -> Path:
    """See `FieldSet.write`."""
    target = Path(path)
    if target.suffix.lower() == ".csv":
        header, columns = _rows(fields)
        with target.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(np.column_stack(columns).tolist())
        return target
    meshio = optional.need("meshio", "visual", f"to write {target.suffix or 'mesh'} files")
    try:
        meshio.write(target, to_meshio(fields))
    except (meshio.ReadError, meshio.WriteError, SystemExit) as error:
        raise ValueError(
            f"`path` must end in .csv or what meshio writes, such as .vtu, got {str(target)!r} "
            f"({error})"
        ) from None
    return target
