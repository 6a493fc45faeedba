"""Two log-log figures against the size of the particles: self-diffusion and Schmidt number.

Below each, the same points over the continuum formula, where their error bars can be seen.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd.diffusion.cases import EXPERIMENTAL_WATER
from sdpd.drawing import BLUE, GREEN, ORANGE, PURPLE, VERMILION, figure_or_new, save

if TYPE_CHECKING:
    from sdpd.diffusion.study import Study

__all__ = ["plot_diffusion", "plot_schmidt", "write_figures"]

Array = NDArray[np.float64]
Convert = Callable[[Any], Any]

SIZE = (7.2, 8.0)
# name in CaseResult, shift along the axis (the points would hide each other), marker, colour, text
_MEASURED = (
    ("short", 0.94, "o", BLUE, "short times, slope of the VACF"),
    ("msd", 1.0, "s", VERMILION, "long times, mean-square displacement"),
    ("integral", 1.06, "^", GREEN, "long times, integral of the VACF"),
)
_FORMULAS = (
    ("continuum", "-", "0.2", r"$D_K = K h^2\rho\,k_BT/(m\eta)$, $K = %s$"),
    ("bird", "--", PURPLE, r"$D_\mathrm{bird} = k_BT/(2\pi\eta\,\Delta x)$ (Y 3.7)"),
    ("dissertation", ":", ORANGE, r"$D_h = \rho h^2k_BT/(63\,m\eta)$ (Y 3.8)"),
)


def plot_diffusion(study: Study, figure: Any = None) -> Any:
    """Self-diffusion coefficient against dx/(2R), all estimates and lines.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    return _plot(study, figure, lambda value: value, "self-diffusion coefficient $D$  [m$^2$/s]")


def plot_schmidt(study: Study, figure: Any = None) -> Any:
    """Schmidt number eta/(rho D) against dx/(2R); see `plot_diffusion`."""
    nu = study.results[0].scene.fluid.kinematic_viscosity
    label = r"Schmidt number $\mathrm{Sc} = \eta/(\rho D)$"
    return _plot(study, figure, lambda value: nu / value, label)


def write_figures(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write diffusion.png and schmidt.png; the folder is made if need be."""
    drawn = {"diffusion": plot_diffusion, "schmidt": plot_schmidt}

    def one(name: str) -> Path:
        draw = drawn[name]
        return save(lambda figure: draw(study, figure), folder, name, size=SIZE, dpi=150)

    return [one(name) for name in drawn]


def _plot(study: Study, figure: Any, convert: Convert, label: str) -> Any:
    figure = figure_or_new(figure, SIZE)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    results = study.results
    size = np.array([r.formulas.size_ratio for r in results])
    ones = np.ones_like(size)
    continuum = convert(np.array([r.formulas.continuum for r in results]))
    _lines(study, upper, convert)
    for axes, unit in ((upper, ones), (lower, continuum)):
        _points(study, axes, convert, size, unit)
        axes.grid(which="major", color="0.88", linewidth=0.7)
        axes.set_axisbelow(True)
    lower.axhline(1.0, color="0.2", linewidth=1.6)
    upper.set(xscale="log", yscale="log", ylabel=label)
    lower.set_ylabel("the same over that of $D_K$")
    molecule = "molecule" if study.fluid == "water" else "molecular diameter"
    lower.set_xlabel(rf"size of a particle over that of a {molecule}, $\Delta x/2R$")
    _name_cases(upper, study, size)
    upper.legend(fontsize=8, framealpha=0.95, loc="best")
    kernel = results[0].scene.resolution.kernel.replace("_", " ").capitalize()
    upper.set_title(
        f"SDPD {study.fluid}, {kernel} kernel, $c = {study.sound_ratio:g}\\,v_\\mathrm{{th}}$; "
        "bars: one standard error; above: cases of the table",
        fontsize=9,
    )
    return figure


def _points(study: Study, axes: Any, convert: Convert, size: Array, unit: Array) -> None:
    """What was measured and the exact short-time coefficient, over `unit`."""
    for name, shift, marker, color, text in _MEASURED:
        found = [getattr(r, name) for r in study.results]
        value = convert(np.array([e.value for e in found])) / unit
        error = value * np.array([e.relative for e in found])
        axes.errorbar(
            size * shift,
            value,
            yerr=error,
            fmt=marker,
            color=color,
            markersize=5.5,
            markeredgecolor="white",
            markeredgewidth=0.5,
            elinewidth=1.2,
            capsize=3.5,
            label=text,
            zorder=4,
        )
    exact = convert(np.array([r.exact.value for r in study.results])) / unit
    text = r"short times, exact: $k_BT\,/\,\langle\Sigma_j\, g_{ij}(a+b/3)\rangle$"
    axes.plot(size * 0.94, exact, "_", color="black", markersize=15, label=text, zorder=5)


def _lines(study: Study, axes: Any, convert: Convert) -> None:
    """Formulas as lines through the cases, molecules as levels."""
    results = sorted(study.results, key=lambda r: r.formulas.size_ratio)
    size = np.array([r.formulas.size_ratio for r in results])
    for name, style, color, text in _FORMULAS:
        value = convert(np.array([getattr(r.formulas, name) for r in results]))
        label = text % _factor(study) if "%" in text else text
        axes.plot(size, value, style, color=color, linewidth=1.6, label=label, zorder=2)
    molecular = results[0].formulas.molecular
    if molecular is None:
        return
    levels: tuple[tuple[float, Any, str], ...] = (
        (molecular, "-.", rf"molecules: $k_BT/(2\pi\eta\,2R)$ = {molecular:.3g} m$^2$/s (Y 3.6)"),
        (EXPERIMENTAL_WATER, (0, (1, 1)), f"experiment: {EXPERIMENTAL_WATER:.2g} m$^2$/s"),
    )
    for level, style, text in levels:
        axes.axhline(
            convert(level), linestyle=style, color="0.5", linewidth=1.3, label=text, zorder=1
        )


def _name_cases(axes: Any, study: Study, size: Array) -> None:
    """Numbers of the cases along the upper edge."""
    top = axes.secondary_xaxis("top")
    top.set_xscale("log")
    top.set_xticks(size, [f"{r.case.number}" for r in study.results], fontsize=8)
    top.minorticks_off()


def _factor(study: Study) -> str:
    return "3/70" if study.kernel == "lucy" else f"{study.results[0].formulas.factor:.4f}"
