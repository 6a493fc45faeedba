"""Figure of a study of effects: what each changes beside what it costs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.drawing import BLUE, VERMILION, figure_or_new, finish, save

if TYPE_CHECKING:
    from sdpd.effects_study.results import Study

__all__ = ["plot", "write_figure"]

_WIDTH = 10.0  # inch
_FLOOR = 1e-3  # per cent, below which the axis of changes is linear


def _size(study: Study) -> tuple[float, float]:
    rows = sum(len(each.changes) for each in study.comparisons)
    return _WIDTH, max(3.0, 1.6 + 0.19 * rows)


def plot(study: Study, figure: Any = None) -> Any:
    """Draw relative changes with their errors, and the time of a particle-step.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    figure = figure_or_new(figure, _size(study))
    left, right = figure.subplots(1, 2, width_ratios=(2, 1))
    changed, names, place = study.changed, [], 0
    for each in study.comparisons:
        for change in each.changes:
            scale = max(abs(change.off.value), abs(change.on.value)) or 1.0
            seen = change.observable in changed[each.effect]
            left.errorbar(
                [100.0 * change.difference.value / scale],
                [place],
                xerr=[100.0 * change.difference.stderr / scale],
                fmt="o",
                ms=4,
                color=VERMILION if seen else "0.6",
            )
            names.append(f"{each.effect.replace('_', ' ')}: {change.observable}")
            place += 1
        left.axhline(place - 0.5, color="0.8", linewidth=0.7)
    left.set_yticks(range(place), names, fontsize=7)
    left.invert_yaxis()
    left.axvline(0.0, color="0.3", linewidth=0.8)
    floor = _floor(study)
    left.set_xscale("symlog", linthresh=floor)
    powers = [10.0**k for k in range(-3, 3) if 10.0**k > 2.0 * floor]
    ticks = [*(-each for each in reversed(powers)), 0.0, *powers]
    left.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=8)
    left.set_xlabel("on - off, % of the larger; red: changed")
    y = np.arange(len(study.comparisons))
    for shift, side, colour in ((-0.2, "without", "0.7"), (0.2, "with_it", BLUE)):
        spreads = [getattr(each.cost, side) for each in study.comparisons]
        medians = [spread.median for spread in spreads]
        bars = [
            [spread.median - spread.lower for spread in spreads],
            [spread.upper - spread.median for spread in spreads],
        ]
        label = "off" if side == "without" else "on"
        right.barh(y + shift, medians, 0.38, xerr=bars, color=colour, label=label)
    right.set_yticks(y, [each.effect.replace("_", " ") for each in study.comparisons], fontsize=8)
    right.invert_yaxis()
    right.set_xlabel("time of a particle-step [ns]")
    right.legend(fontsize=8)
    finish(figure, (left, right), study.scene, note="bars: one standard error; right: quartiles")
    return figure


def _floor(study: Study) -> float:
    """Where the axis of changes goes over from linear to logarithmic [%]: a small error."""
    errors = [
        100.0 * change.difference.stderr / scale
        for each in study.comparisons
        for change in each.changes
        if (scale := max(abs(change.off.value), abs(change.on.value))) > 0.0
    ]
    return max(_FLOOR, float(np.percentile(errors, 20.0))) if errors else _FLOOR


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write effects.png; the folder is made if need be."""
    return save(lambda figure: plot(study, figure), folder, "effects", size=_size(study))
