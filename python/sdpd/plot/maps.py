"""Maps and streamlines of fields in a plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdpd.fields import Field, Grid, Plane

from .curves import labelled, magnitude, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["field_map", "streamlines"]

Array = NDArray[np.float64]


class _Sheet(NamedTuple):
    """A field on a regular lattice of two axes."""

    names: tuple[str, str]
    unit: str
    lines: tuple[Array, Array]
    values: Array


def _sheet(data: Field) -> _Sheet:
    shape = data.target.shape
    kept = [k for k, n in enumerate(shape) if n > 1]
    if not isinstance(data.target, (Grid, Plane)) or len(kept) != 2:
        raise ValueError(
            "`data` must lie on a Plane, or on a Grid with two axes of more than one point, got "
            f"{type(data.target).__name__} {shape}"
        )
    axes = [data.target.axes[k] for k in kept]
    tail = data.mean.shape[len(shape) :]
    values = data.mean.reshape(*(shape[k] for k in kept), *tail)
    return _Sheet((axes[0][0], axes[1][0]), data.length_unit, (axes[0][1], axes[1][1]), values)


def field_map(
    data: Field,
    *,
    component: str | int | None = None,
    axes: Axes | None = None,
    colour_bar: bool = True,
    **style: Any,
) -> Axes:
    """Draw a field in a plane as colours; of a vector its magnitude or a component.

    Parameters
    ----------
    data : sdpd.fields.Field
        On a `Plane`, or on a `Grid` that is flat.
    component : str or int, optional
        Of a vector; its magnitude if None.
    axes : matplotlib Axes, optional
        Drawn into; new ones of pyplot if None.
    colour_bar : bool
    **style
        For ``Axes.pcolormesh``, e.g. ``cmap``, ``vmin``.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    ValueError
        If the points lie otherwise.
    """
    chosen = data if component is None else data.component(component)
    sheet = _sheet(chosen)
    values, name = sheet.values, chosen.name
    if chosen.components:
        values, name = np.linalg.norm(values, axis=-1), magnitude(name)
    axes = new_axes(axes)
    image = axes.pcolormesh(*sheet.lines, values.T, shading="nearest", **style)
    image.set_rasterized(True)
    if colour_bar:
        axes.figure.colorbar(image, ax=axes, label=labelled(name, chosen.unit))
    _frame(axes, sheet)
    return axes


def streamlines(data: Field, *, axes: Axes | None = None, **style: Any) -> Axes:
    """Draw the streamlines of a vector field in a plane along two axes of the box.

    Parameters
    ----------
    data : sdpd.fields.Field
        A vector on a flat `Grid`, or on a `Plane` along two axes.
    axes : matplotlib Axes, optional
        Drawn into; new ones of pyplot if None.
    **style
        For ``Axes.streamplot``, e.g. ``density``, ``color``.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    ValueError
        If it is no vector or the plane is oblique.
    """
    sheet = _sheet(data)
    if any(name not in data.components for name in sheet.names):
        raise ValueError(
            f"`data` must be a vector with the components {sheet.names} along its plane, got "
            f"{data.components or 'a scalar'}"
        )
    along = [data.components.index(name) for name in sheet.names]
    axes = new_axes(axes)
    u, v = (sheet.values[..., k].T for k in along)
    axes.streamplot(*sheet.lines, u, v, **{"color": "0.15", "linewidth": 0.7, **style})
    _frame(axes, sheet)
    return axes


def _frame(axes: Any, sheet: _Sheet) -> None:
    axes.set_aspect("equal")
    across, up = (labelled(name, sheet.unit) for name in sheet.names)
    axes.set(xlabel=across, ylabel=up)
