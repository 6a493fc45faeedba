"""Four panels: viscosity by method, against wave number, against lag, and the currents' decay."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.drawing import BLUE, GREEN, ORANGE, VERMILION, figure_or_new, finish, save

if TYPE_CHECKING:
    from sdpd.viscosity.study import Study

__all__ = ["plot", "write_figure"]

SIZE = (10.0, 7.2)
_COLOURS = (GREEN, BLUE, VERMILION)  # of the methods, in their order


def plot(study: Study, figure: Any = None) -> Any:
    """Draw the study.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    figure = figure_or_new(figure, SIZE)
    panels = figure.subplots(2, 2).ravel()
    for axes, draw in zip(panels, (_methods, _waves, _lags, _decays), strict=True):
        draw(study, axes)
    sample = study.sample
    finish(
        figure,
        panels,
        sample,
        f"X = {sample.stiffness:.3g}",
        f"η* = {sample.reduced_viscosity:.3g}",
        f"dt = {study.plan.dt / sample.friction_time:.2g} τ",
    )
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write viscosity.png; the folder is made if need be."""
    return save(lambda figure: plot(study, figure), folder, "viscosity", size=SIZE)


def _expected(study: Study) -> float:
    """Friction and mean field over the viscosity asked for."""
    added = study.theory.configurational() + study.theory.kinetic
    return (study.friction + added) / study.asked


def _methods(study: Study, axes: Any) -> None:
    names = ["asked", "lattice sum", "friction"]
    values = [1.0, study.on_lattice / study.asked, study.friction / study.asked]
    axes.plot(values, range(3), "|", color="0.2", markersize=16, markeredgewidth=2.0)
    axes.axvline(_expected(study), color="0.5", linestyle="--", zorder=1)
    for row, (method, color) in enumerate(zip(study.methods, _COLOURS, strict=True), start=3):
        found = method.viscosity.scaled(1.0 / study.asked)
        names.append(method.name)
        reach = method.accuracy / study.asked
        axes.plot(
            [found.value - reach, found.value + reach],
            [row, row],
            color="0.8",
            linewidth=7,
            solid_capstyle="butt",
        )
        axes.errorbar(found.value, row, xerr=found.stderr, fmt="o", color=color, capsize=4)
    kubo = study.stress.green_kubo.scaled(1.0 / study.asked)
    names.append("Green-Kubo")
    axes.errorbar(
        kubo.value, 6, xerr=kubo.stderr, fmt="o", color=GREEN, capsize=4, markerfacecolor="white"
    )
    axes.set_yticks(range(7), names)
    axes.set_ylim(6.6, -1.2)
    axes.set(
        xlabel="viscosity over that asked for",
        title="by method (grey: accuracy; dashed: friction and mean field)",
    )


def _waves(study: Study, axes: Any) -> None:
    h, asked, theory = study.sample.support_radius, study.asked, study.theory
    number = np.array([shell.wave_number for shell in study.shells])
    factor = study.lattice[1].factor.value
    friction = np.array([study.friction, *(factor * e.value for e in study.arrangement.waves)])
    k = np.array([0.0, *number])
    axes.plot(k * h, friction / asked, color="0.2", label="friction as particles lie")
    added = np.array([theory.configurational(q) + theory.kinetic for q in k])
    axes.plot(
        k * h, (friction + added) / asked, color="0.5", linestyle="--", label="with mean field"
    )
    found = [shell.viscosity for shell in study.shells]
    for method, color in zip(study.methods, _COLOURS, strict=True):
        if method.name == "transverse currents":
            continue
        axes.errorbar(
            method.wave_number * h,
            method.measured.value / asked,
            yerr=method.measured.stderr / asked,
            fmt="s",
            color=color,
            capsize=4,
            label=method.name,
        )
    axes.errorbar(
        number * h,
        [e.value / asked for e in found],
        yerr=[e.stderr / asked for e in found],
        fmt="o",
        color=BLUE,
        capsize=4,
        label="transverse currents",
    )
    axes.set(xlabel="$kh$", ylabel=r"$\eta(k)$ over that asked for", title="by wave number")
    axes.legend(fontsize=8)


def _lags(study: Study, axes: Any) -> None:
    """Part on part, from the bottom: random, conservative, kinetic; the rest are correlations."""
    stress, asked = study.stress, study.asked
    cell = 2.0 * study.sample.box.volume * study.sample.thermal_energy * asked
    tau = study.sample.friction_time
    t = stress.increments.lag[1:]

    def growth(curve: Any) -> Any:
        return curve.mean[1:] / (cell * t)

    level = np.full(t.size, stress.delta.value / asked)
    axes.plot(t / tau, level, color="0.2", linewidth=1.0, label="random, exact")
    for name, color in (("conservative", ORANGE), ("kinetic", BLUE)):
        top = level + growth(stress.parts[name])
        axes.fill_between(
            t / tau, level, top, color=color, alpha=0.4, linewidth=0, label=f"+ {name}"
        )
        level = top
    value, error = growth(stress.increments), stress.increments.stderr[1:] / (cell * t)
    axes.plot(t / tau, value, color=GREEN, label="total")
    axes.fill_between(t / tau, value - error, value + error, color=GREEN, alpha=0.2, linewidth=0)
    first, last = study.plan.stress_window
    axes.axvspan(first / tau, last / tau, color="0.93", label="window of the slope", zorder=0)
    axes.set(
        xlabel=r"lag over $\tau$",
        ylabel=r"$\langle\Delta G^2\rangle/(2Vk_BT\,t)$ over that asked for",
        title="Helfand moment",
        xscale="log",
    )
    axes.legend(fontsize=8, loc="upper left")


def _decays(study: Study, axes: Any) -> None:
    tau = study.sample.friction_time
    shades = np.linspace(0.0, 0.6, len(study.shells))
    for shell, shade in zip(study.shells, shades, strict=True):
        mean, error = shell.correlation.normalized()
        t = shell.correlation.lag
        color = (0.0 + shade, 0.45 + 0.4 * shade, 0.70 + 0.25 * shade)
        good = mean > 3.0 * error
        last = int(np.argmin(good)) if not good.all() else good.size
        k = shell.wave_number
        axes.plot(
            t[:last] / tau,
            mean[:last],
            color=color,
            label=f"$kh = {k * study.sample.support_radius:.2f}$",
        )
        rate = shell.viscosity.value * k**2 / study.sample.fluid.density
        axes.plot(t[:last] / tau, np.exp(-rate * t[:last]), ":", color="0.4", linewidth=1.0)
    axes.set(
        xlabel=r"lag over $\tau$",
        ylabel="$C_T(t)/C_T(0)$",
        title="transverse currents (dotted: exponentials)",
        yscale="log",
    )
    axes.legend(fontsize=8)
