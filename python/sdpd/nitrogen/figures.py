"""Figures of nitrogen: variances case by case, and transport against the size of particles."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.drawing import BLUE, GREEN, ORANGE, PURPLE, VERMILION, figure_or_new, save

if TYPE_CHECKING:
    from sdpd.nitrogen.measure import Measured
    from sdpd.nitrogen.rows import Row
    from sdpd.nitrogen.study import Study

__all__ = ["plot", "plot_transport", "write_figure"]

_SIZE = (9.0, 3.4)  # inch, a row of panels
_WIDE = (10.8, 4.4)
_MARKERS = "os^D"  # by rank of the support
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE)
_PANELS = (("Var T", "Var V"), ("Var rho", "Var P"))
_LIMITS = ((0.9, 1.75), (0.3, 2.2))  # of the cases that move; beyond them at the edge


def plot(study: Study, figure: Any = None) -> Any:
    """Draw measured and published variances over the expected ones, case by case.

    Cases that move and frozen ones have a row of panels each, these on a logarithmic scale.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    parts = _parts(study)
    figure = figure_or_new(figure, (_SIZE[0], _SIZE[1] * len(parts)))
    grid = figure.subplots(len(parts), 2, squeeze=False)
    for axes, cases in zip(grid, parts, strict=True):
        for axis, names, limits in zip(axes, _PANELS, _LIMITS, strict=True):
            _draw_variances(axis, cases, names, limits if cases[0].moves else None)
        axes[0].set_ylabel("variance over the expected one [1]")
    for axis in grid[-1]:
        axis.set_xlabel("case")
    return figure


def _parts(study: Study) -> list[list[Measured]]:
    """Cases that move, and frozen ones, where there are any."""
    moving = [found for found in study.cases if found.moves]
    frozen = [found for found in study.cases if not found.moves]
    return [part for part in (moving, frozen) if part]


def _draw_variances(
    axis: Any, cases: list[Measured], names: Sequence[str], limits: tuple[float, float] | None
) -> None:
    numbers = np.array([found.case.number for found in cases], dtype=float)
    for k, (name, colour, other) in enumerate(
        zip(names, (BLUE, GREEN), (VERMILION, ORANGE), strict=True)
    ):
        rows = [_row(found, name) for found in cases]
        place = numbers + 0.16 * (2 * k - 1)
        known = [row.accuracy / row.expected for row in rows]
        if limits and any(known):
            axis.bar(
                place, 2.0 * np.array(known), 0.3, 1.0 - np.array(known), color=colour, alpha=0.2
            )
        ratio = [row.measured.value / row.expected for row in rows]
        error = [row.measured.stderr / row.expected for row in rows]
        axis.errorbar(place, ratio, error, fmt="o", ms=4, color=colour, label=name)
        theirs = np.array([(row.published or math.nan) / row.expected for row in rows])
        high = theirs > limits[1] if limits else np.zeros(len(theirs), dtype=bool)
        axis.plot(place[~high], theirs[~high], "x", color=other, label=f"{name}, Yang (2013)")
        if limits:
            edge = np.full(int(high.sum()), limits[1] - 0.03 * (limits[1] - limits[0]))
            axis.plot(place[high], edge, "^", ms=5, color=other)
    axis.axhline(1.0, color="0.5", linewidth=0.8)
    if limits:
        axis.set_ylim(*limits)
    else:
        axis.set_yscale("log")
    axis.set_xticks(numbers)
    axis.grid(color="0.9", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.legend(fontsize=7.5)


def plot_transport(study: Study, figure: Any = None) -> Any:
    """Draw D, eta and kappa against molecules a particle, one mark for each rank of the support.

    Parameters
    ----------
    study : Study
        With transport coefficients.
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ValueError
        If the study has no transport coefficients.
    """
    cases = [found for found in study.cases if found.transport is not None]
    if not cases:
        raise ValueError("`study` must have transport coefficients, got one without")
    figure = figure_or_new(figure, _WIDE)
    diffusion, viscosity, conductivity = figure.subplots(1, 3)
    for found in cases:
        _draw_diffusion(diffusion, found)
        _draw_viscosity(viscosity, found)
        _draw_conductivity(conductivity, found)
    _lines(diffusion, cases)
    fluid = cases[0].scene.fluid
    viscosity.axhline(fluid.shear_viscosity, color="0.3", linewidth=0.8)
    conductivity.axhline(fluid.thermal_conductivity or math.nan, color="0.3", linewidth=0.8)
    diffusion.set_yscale("log")
    labels = ("D [m²/s]", "η [Pa s]", "κ [W/(m K)]")
    for axis, label in zip((diffusion, viscosity, conductivity), labels, strict=True):
        axis.set(xlabel="molecules a particle [1]", ylabel=label)
        axis.set_xscale("log")
        axis.grid(color="0.9", linewidth=0.7)
        axis.set_axisbelow(True)
    figure.legend(handles=_legend(), fontsize=8, loc="outside lower center", ncols=5, frameon=False)
    return figure


def _rank(found: Measured) -> int:
    """0 to 3, from the finest support of a size."""
    return (found.case.number - 1) % 4


def _place(found: Measured) -> float:
    """Molecules a particle, supports side by side."""
    return found.scene.stiffness * float(1.18 ** (_rank(found) - 1.5))


def _row(found: Measured, name: str) -> Row:
    return next(row for row in found.rows if row.name == name)


def _point(axis: Any, found: Measured, name: str, *, filled: bool) -> None:
    row, rank = _row(found, name), _rank(found)
    colour = _COLOURS[rank] if found.moves else "0.7"
    face = colour if filled else "white"
    x = _place(found)
    value, error = row.measured.value, row.measured.stderr
    axis.errorbar(x, value, error, fmt=_MARKERS[rank], ms=4.5, color=colour, mfc=face)
    if row.published is not None:
        axis.plot(x, row.published, "x", ms=4, color="0.4")
    if found.moves and math.isfinite(row.expected):
        axis.plot(x, row.expected, "_", ms=11, color=colour)


def _draw_diffusion(axis: Any, found: Measured) -> None:
    _point(axis, found, "D short", filled=False)
    if _row(found, "D long").measured.value > 0.0:
        _point(axis, found, "D long", filled=True)


def _draw_viscosity(axis: Any, found: Measured) -> None:
    assert found.transport is not None
    axis.plot(_place(found), _row(found, "eta").published, "x", ms=4, color="0.4")
    waves = found.transport.wave is not None
    if found.moves:
        _point(
            axis, found, "eta wave" if waves else "eta", filled=not waves or found.transport.flows
        )
    value = found.transport.lattice_viscosity
    axis.plot(_place(found), value, _MARKERS[_rank(found)], ms=4.5, color="0.6", mfc="white")


def _draw_conductivity(axis: Any, found: Measured) -> None:
    assert found.transport is not None
    if found.moves:
        _point(axis, found, "kappa", filled=True)
    value = found.transport.lattice_conductivity
    axis.plot(_place(found), value, _MARKERS[_rank(found)], ms=4.5, color="0.6", mfc="white")


def _lines(axis: Any, cases: list[Measured]) -> None:
    """K h^2 rho k_B T/(m eta) for each rank of the support, and D of molecules."""
    for rank in range(4):
        chosen = sorted((x for x in cases if _rank(x) == rank), key=lambda x: x.scene.stiffness)
        if len(chosen) > 1:
            x = [each.scene.stiffness for each in chosen]
            y = [each.scene.self_diffusion_continuum for each in chosen]
            axis.plot(x, y, "-", linewidth=0.8, color=_COLOURS[rank])
    sizes = np.array([found.scene.stiffness for found in cases])
    axis.set_xlim(0.5 * sizes.min(), 2.0 * sizes.max())


def _legend() -> list[Any]:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], marker=m, ms=4.5, color=c, linewidth=0.8, label=f"h/Δx = {name}")
        for m, c, name in zip(_MARKERS, _COLOURS, ("2.3", "2.9", "3.5", "4.4"), strict=True)
    ]
    rest: dict[str, Any] = {"ls": "", "color": "0.3"}
    handles += [
        Line2D([], [], marker="o", ms=4.5, **rest, label="with noise (D: long times)"),
        Line2D(
            [], [], marker="o", ms=4.5, mfc="white", **rest, label="D of short times, η that grows"
        ),
        Line2D([], [], marker="o", ms=4.5, mfc="white", color="0.6", ls="", label="lattice"),
        Line2D([], [], marker="_", ms=11, **rest, label="expected"),
        Line2D([], [], marker="x", ms=4, color="0.4", ls="", label="Yang (2013)"),
    ]
    return handles


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write nitrogen.png, variances and where measured transport; the folder is made if need be."""
    height = _SIZE[1] * len(_parts(study))
    if all(found.transport is None for found in study.cases):
        return save(lambda figure: plot(study, figure), folder, "nitrogen", size=(_SIZE[0], height))

    def both(figure: Any) -> None:
        upper, lower = figure.subfigures(2, 1, height_ratios=(height, _WIDE[1]))
        plot(study, upper)
        plot_transport(study, lower)

    return save(both, folder, "nitrogen", size=(_WIDE[0], height + _WIDE[1]))
