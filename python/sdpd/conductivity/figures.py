"""Two panels: conductivity by way, and the Helfand moment by part against the lag."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.drawing import BLUE, GREEN, ORANGE, PURPLE, VERMILION, figure_or_new, finish, save

if TYPE_CHECKING:
    from sdpd.conductivity.study import Study

__all__ = ["plot", "write_figure"]

SIZE = (10.0, 4.2)
_PARTS = {"conduction": BLUE, "friction": ORANGE, "pressure": PURPLE, "convection": VERMILION}


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
    left, right = figure.subplots(1, 2)
    _ways(study, left)
    _lags(study, right)
    sample = study.equilibrium.sample
    capacity = f"C = {sample.heat_capacity_number:.3g} $k_B$"
    finish(figure, (left, right), sample, capacity)
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write conductivity.png; the folder is made if need be."""
    return save(lambda figure: plot(study, figure), folder, "conductivity", size=SIZE)


def _ways(study: Study, axes: Any) -> None:
    found, asked, prediction = study.equilibrium, study.asked, study.prediction
    exact = {
        "asked": asked,
        "lattice, this step": study.decay.delivered,
        "mean field": prediction.total,
    }
    axes.plot(
        [value / asked for value in exact.values()],
        range(len(exact)),
        "|",
        color="0.2",
        markersize=16,
        markeredgewidth=2.0,
    )
    measured = {
        "Helfand moment": (found.helfand, GREEN),
        "Green-Kubo": (found.green_kubo, GREEN),
        "imposed gradient": (study.gradient, VERMILION),
        **{f"{name} alone": (found.shares[name], color) for name, color in _PARTS.items()},
    }
    for row, (estimate, color) in enumerate(measured.values(), start=len(exact)):
        axes.errorbar(
            estimate.value / asked,
            row,
            xerr=estimate.stderr / asked,
            fmt="o",
            color=color,
            capsize=4,
        )
    names = [*exact, *measured]
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set(xlabel="conductivity over that asked for [1]", title="by way and by part")


def _lags(study: Study, axes: Any) -> None:
    found, asked = study.equilibrium, study.asked
    tau = found.sample.conduction_time
    curves = {"total": GREEN, **_PARTS}
    for name, color in curves.items():
        curve = found.increments[name]
        t = curve.lag[1:]
        unit = found.unit * asked * t
        value, error = curve.mean[1:] / unit, curve.stderr[1:] / unit
        axes.plot(t / tau, value, ".-", color=color, label=name)
        axes.fill_between(t / tau, value - error, value + error, color=color, alpha=0.2, lw=0)
    running = found.running
    axes.errorbar(
        running.lag / tau,
        running.mean / asked,
        running.stderr / asked,
        fmt="s",
        color="0.3",
        markersize=3.5,
        markerfacecolor="white",
        linewidth=0.8,
        label="Green-Kubo sum",
    )
    first, last = found.helfand.window or (0.0, 0.0)
    axes.axvspan(first / tau, last / tau, color="0.93", label="window of the slope", zorder=0)
    axes.axhline(found.noise.value / asked, color="0.2", linewidth=0.8, ls=":")
    axes.set(
        xlabel=r"lag over $\tau_q$ [1]",
        ylabel=r"$\langle\Delta G^2\rangle/(2Vk_BT^2\,t)$ over that asked for [1]",
        title="Helfand moment (dotted: noise alone)",
    )
    axes.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
