"""Every field of a set in one picture."""

from __future__ import annotations

import os
from pathlib import Path

from sdpd import optional
from sdpd.fields import FieldSet

from .curves import labelled, profile
from .maps import field_map

__all__ = ["overview"]


def overview(fields: FieldSet, path: str | os.PathLike[str]) -> Path:
    """Draw each quantity of a line, of bins, or of a flat grid in a panel of its own.

    Parameters
    ----------
    fields : sdpd.fields.FieldSet
    path : path
        With an ending that matplotlib knows.

    Returns
    -------
    Path

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    ValueError
        If the points lie otherwise.
    """
    optional.need("matplotlib", "plot", "to draw")
    from matplotlib.figure import Figure

    number = len(fields.names)
    figure = Figure(figsize=(4.4 * number, 3.4), layout="constrained")
    one_axis = max(fields.target.shape) == len(fields.target)
    for name, axes in zip(fields, figure.subplots(1, number, squeeze=False)[0], strict=True):
        whole = fields[name]
        if not one_axis:
            field_map(whole, axes=axes)
            continue
        for part in map(whole.component, whole.components) if whole.components else [whole]:
            profile(part, axes=axes)
        axes.set_ylabel(labelled(name, whole.unit))
        if whole.components:
            axes.legend()
    figure.savefig(path, dpi=150)
    return Path(path)
