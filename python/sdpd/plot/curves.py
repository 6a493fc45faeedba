"""Profiles with error bars beside their analytic curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import optional, validation
from sdpd.analysis.blocked import Profile
from sdpd.fields import Field

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["new_axes", "profile"]

Array = NDArray[np.float64]
Curve = Callable[[Array], Any]


def new_axes(axes: Any) -> Any:
    """The axes, or those of a new pyplot figure."""
    if axes is not None:
        return axes
    pyplot = optional.need("matplotlib.pyplot", "plot", "to draw")
    return pyplot.subplots(layout="constrained")[1]


def labelled(name: str, unit: str) -> str:
    """``"velocity_x [m/s]"``."""
    return f"{name} [{unit}]" if unit else name


def magnitude(name: str) -> str:
    """Name of the magnitude of a vector, without bars, which VTK's text swallows."""
    return "speed" if name == "velocity" else f"magnitude of {name}"


def profile(
    data: Field | Profile | tuple[ArrayLike, ArrayLike, ArrayLike],
    *,
    component: str | int | None = None,
    curve: Curve | None = None,
    curve_label: str = "theory",
    label: str | None = None,
    axes: Axes | None = None,
    **style: Any,
) -> Axes:
    """Draw a profile with bars of one standard error.

    Parameters
    ----------
    data : sdpd.fields.Field, sdpd.analysis.Profile, or a tuple of three arrays
        On a line or in bins; of a scalar, unless `component` is given. The arrays are coordinate,
        value and standard error, e.g. of a `sdpd.Profile`.
    component : str or int, optional
        Of a vector.
    curve : callable, optional
        Analytic curve: a function of the coordinate [length], drawn as a line.
    curve_label, label : str, optional
        In the legend, which the caller asks for; the name of the field if None.
    axes : matplotlib Axes, optional
        Drawn into; new ones of pyplot if None.
    **style
        For ``Axes.errorbar``.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    ValueError
        If the field is no scalar on a line.
    """
    if isinstance(data, Profile):
        x, mean, stderr = data.centers, data.mean, data.stderr
        name, across, text = "", "", label
    elif isinstance(data, tuple):
        x, mean, stderr = (validation.real_array("data", each, (None,)) for each in data)
        name, across, text = "", "", label
    else:
        chosen = data if component is None else data.component(component)
        lines = [(key, line) for key, line in chosen.target.axes if len(line) > 1]
        if len(lines) != 1 or chosen.components:
            raise ValueError(
                "`data` must be a scalar or one component on a line or in bins, got "
                f"{chosen.name!r} of shape {chosen.mean.shape}"
            )
        across, x = lines[0]
        across = labelled(across, chosen.length_unit)
        mean, stderr = chosen.mean.ravel(), chosen.stderr.ravel()
        name = labelled(chosen.name, chosen.unit)
        text = chosen.name if label is None else label
    axes = new_axes(axes)
    bars = stderr if np.isfinite(stderr).any() else None
    look: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 3.5, "label": text}
    drawn = axes.errorbar(x, mean, bars, **{**look, **style})
    if curve is not None:
        fine = np.linspace(x[0], x[-1], 400)
        colour = drawn.lines[0].get_color()
        axes.plot(fine, curve(fine), color=colour, linewidth=1.2, label=curve_label)
    if across and not axes.get_xlabel():
        axes.set_xlabel(across)
    if name and not axes.get_ylabel():
        axes.set_ylabel(name)
    return axes
