"""Figures of the benchmarks: cost against size, bars of effects, ratios to another code."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.bench.effects import EffectCosts
from sdpd.bench.peer_results import Peer
from sdpd.bench.speed import STEPS, Speed
from sdpd.drawing import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    figure_or_new,
    save,
)

if TYPE_CHECKING:
    from sdpd.bench.study import Study
    from sdpd.bench.turns import Spread

__all__ = ["plot", "plot_effects", "plot_peer", "plot_sizes", "write_figure"]

_COLOURS = dict(zip(STEPS, (BLUE, SKY, GREEN, ORANGE, VERMILION, PURPLE), strict=True))
_MARKS = ("o-", "s--", "^:", "v-.")  # by kernel
_SIZES = {"speed": (9.0, 3.8), "effects": (9.0, 6.0), "peer": (9.0, 3.8)}  # inch


def plot_sizes(speed: Speed, figure: Any = None) -> Any:
    """Draw nanoseconds a particle-step against the number of particles, a panel for each support.

    Parameters
    ----------
    speed : Speed
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    figure = figure_or_new(figure, _SIZES["speed"])
    supports = sorted({row.support for row in speed.rows})
    kernels = list(dict.fromkeys(row.kernel for row in speed.rows))
    panels = figure.subplots(1, len(supports), sharey=True, squeeze=False)[0]
    for axes, support in zip(panels, supports, strict=True):
        for step, colour in _COLOURS.items():
            for kernel, marks in zip(kernels, _MARKS, strict=False):
                rows = [
                    row
                    for row in speed.rows
                    if (row.support, row.step, row.kernel) == (support, step, kernel)
                ]
                times = [row.time for row in rows]
                axes.errorbar(
                    [row.particles for row in rows],
                    [time.median for time in times],
                    _bars(times),
                    fmt=marks,
                    ms=4,
                    color=colour,
                    label=step if len(kernels) == 1 else f"{step}, {kernel.replace('_', ' ')}",
                )
        axes.set(xscale="log", yscale="log", xlabel="particles [1]", title=f"h/Δx = {support:g}")
        _grid(axes)
    panels[0].set_ylabel("time of a particle-step [ns]")
    entries = panels[0].get_legend_handles_labels()
    figure.legend(*entries, fontsize=8, loc="outside lower center", ncols=3)
    return figure


def plot_effects(costs: EffectCosts, figure: Any = None) -> Any:
    """Draw a bar for what each effect costs; see `plot_sizes`."""
    figure = figure_or_new(figure, _SIZES["effects"])
    axes = figure.subplots()
    found = costs.effects[::-1]
    names = [f"{each.name}  [{each.base}]" for each in found]
    medians = [each.cost.median for each in found]
    axes.barh(range(len(found)), medians, xerr=_bars([each.cost for each in found]), color=BLUE)
    axes.set_yticks(range(len(found)), names, fontsize=8)
    axes.set_xscale("symlog", linthresh=100.0)
    axes.set_xlabel("it adds to a particle-step [ns]; black: quartiles; linear below 100 ns")
    _grid(axes)
    return figure


def plot_peer(peer: Peer, figure: Any = None) -> Any:
    """Draw how many times faster each step is than that of LAMMPS; see `plot_sizes`."""
    figure = figure_or_new(figure, _SIZES["peer"])
    axes = figure.subplots()
    steps = list(dict.fromkeys(row.step for row in peer.contests))
    groups = list(dict.fromkeys((row.particles, row.support) for row in peer.contests))
    width = 0.8 / len(groups)
    for place, (particles, support) in enumerate(groups):
        rows = [row for row in peer.contests if (row.particles, row.support) == groups[place]]
        y = [steps.index(row.step) + width * (place + 0.5) - 0.4 for row in rows]
        axes.barh(
            y,
            [row.ratio.median for row in rows],
            width,
            xerr=_bars([row.ratio for row in rows]),
            label=f"N = {particles:,}, h/Δx = {support:g}",
            color=(BLUE, GREEN, ORANGE, VERMILION)[place % 4],
        )
    axes.set_yticks(range(len(steps)), steps)
    axes.invert_yaxis()
    axes.set_xlabel("particle-steps a second over those of LAMMPS [1]; black: quartiles")
    axes.legend(fontsize=8)
    _grid(axes)
    return figure


def _bars(spreads: list[Spread]) -> Any:
    """Distances of the quartiles from the median, shape (2, n)."""
    below = [each.median - each.lower for each in spreads]
    return np.array([below, [each.upper - each.median for each in spreads]])


def _grid(axes: Any) -> None:
    axes.grid(color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)


def plot(study: Study, figure: Any = None) -> Any:
    """Draw a benchmark, whichever it is; see `plot_sizes`."""
    if isinstance(study, Speed):
        return plot_sizes(study, figure)
    if isinstance(study, EffectCosts):
        return plot_effects(study, figure)
    if isinstance(study, Peer):
        return plot_peer(study, figure)
    raise TypeError(f"`study` must be a benchmark, got {type(study).__name__}")


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write bench_KIND.png; the folder is made if need be."""
    size = _SIZES[study.kind]
    return save(lambda figure: plot(study, figure), folder, f"bench_{study.kind}", size=size)
