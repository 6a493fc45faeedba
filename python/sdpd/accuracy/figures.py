"""Work-precision figures: error against seconds."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from sdpd.accuracy.results import Study
from sdpd.drawing import BLUE, ORANGE, VERMILION, figure_or_new, save

__all__ = ["plot", "write_figure"]

_SIZE = (6.4, 4.4)  # inch
_FLOOR = 1e-16


def plot(study: Study, axes: Any = None, *, z: float = 1.0) -> Any:
    """Draw errors of all settings against seconds, log-log, with the front labelled.

    Parameters
    ----------
    study : Study
    axes : matplotlib Axes, optional
        Drawn into; those of a new figure if None.
    z : float
        Of the front, see `pareto`.

    Returns
    -------
    matplotlib Axes
    """
    if axes is None:
        axes = figure_or_new(None, _SIZE).subplots()
    front = study.pareto(z=z)
    rest = [row for row in study.rows if row not in front and math.isfinite(row.error)]
    for rows, colour, size in ((rest, "0.65", 3.0), (front, BLUE, 4.5)):
        axes.errorbar(
            [row.seconds for row in rows],
            [max(row.error, _FLOOR) for row in rows],
            [_bars(rows, -1), _bars(rows, 1)],
            color=colour,
            linestyle="",
            marker="o",
            markersize=size,
            elinewidth=0.8,
            zorder=3 if colour == BLUE else 2,
        )
    noisy = [row for row in front if row.sampling > 0.0]
    axes.plot(
        [row.seconds for row in noisy],
        [max(abs(row.bias), _FLOOR) for row in noisy],
        color=VERMILION,
        linestyle="",
        marker="_",
        label="bias alone",
    )
    axes.plot(
        [row.seconds for row in noisy],
        [row.sampling for row in noisy],
        color=ORANGE,
        linestyle="",
        marker="x",
        markersize=4.0,
        label="sampling of one run",
    )
    axes.plot(
        [row.seconds for row in front],
        [max(row.error, _FLOOR) for row in front],
        color=BLUE,
        linewidth=1.0,
        label="front",
    )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="seconds on one core [s]",
        ylabel="relative error [1]",
        title=study.problem.title,
    )
    axes.autoscale_view()
    if np.ptp(np.log10(axes.get_xlim())) > 1.5:  # decades are enough
        axes.xaxis.set_minor_formatter("")
    _label(study, axes, front)
    if noisy:
        axes.legend(fontsize=7, loc="upper right")
    axes.grid(color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
    return axes


def _label(study: Study, axes: Any, front: Any) -> None:
    """Names beside the front, towards the middle, but where there is no room for them."""
    taken: list[tuple[float, float]] = []
    for row in front:
        place = (row.seconds, max(row.error, _FLOOR))
        x, y = axes.transAxes.inverted().transform(axes.transData.transform(place))
        if any(abs(x - a) < 0.4 and abs(y - b) < 0.035 for a, b in taken):
            continue
        taken.append((x, y))
        right = x < 0.55
        axes.annotate(
            study.label(row),
            place,
            xytext=(5, 4) if right else (-5, -9),
            textcoords="offset points",
            ha="left" if right else "right",
            fontsize=6.5,
        ).set_in_layout(False)


def _bars(rows: Any, side: int) -> list[float]:
    """Standard errors, which on a logarithmic axis must not reach 0 below."""
    return [min(row.stderr, 0.9 * row.error) if side < 0 else row.stderr for row in rows]


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write accuracy_NAME.png; the folder is made if need be."""
    name = f"accuracy_{study.problem.name}"
    return save(lambda figure: plot(study, figure.subplots()), folder, name, size=_SIZE)
