"""Six panels: the four correlation functions, what was fitted, and all z.

Two more of a fluid with an energy: the energy, and the energy with the current.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.correlations.recorder import FUNCTIONS
from sdpd.correlations.report import threshold
from sdpd.drawing import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, figure_or_new, finish, save

if TYPE_CHECKING:
    from sdpd.correlations.results import Shell
    from sdpd.correlations.study import Study

__all__ = ["plot", "plot_function", "write_figure"]

SIZE = (12.0, 7.2)
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = ("o", "s", "^", "D", "v", "P")
SPANS = {
    "transverse": 3.0,
    "longitudinal": 9.0,
    "density": 9.0,
    "cross": 9.0,
    "reversed_cross": 9.0,
    "energy": 3.0,
    "density_energy": 9.0,
    "energy_current": 9.0,
}
TITLES = {
    "transverse": "transverse current",
    "longitudinal": "longitudinal current",
    "density": "density",
    "cross": "density, then current",
    "reversed_cross": "current, then density",
    "energy": "energy",
    "density_energy": "density and energy",
    "energy_current": "energy and current",
}


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
    names: tuple[str, ...] = FUNCTIONS[:4]
    if study.scene.active_effects.energy:
        names += ("energy", "energy_current")
    columns = 1 + len(names) // 2
    figure = figure_or_new(figure, (SIZE[0] * columns / 3.0, SIZE[1]))
    panels = figure.subplots(2, columns).ravel()
    for axes, name in zip(panels, names, strict=False):
        plot_function(study, name, axes)
    panels[0].legend(fontsize=8)
    _parameters(study, panels[-2])
    _deviations(study, panels[-1])
    scene = study.scene
    finish(
        figure,
        panels,
        scene,
        f"X = {scene.stiffness:.3g}",
        f"η* = {scene.reduced_viscosity:.3g}",
        note=f"points: {study.plan.runs} runs, bars: one standard error; lines: linearised theory",
    )
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write correlations.png; the folder is made if need be."""
    width = SIZE[0] * (4.0 / 3.0 if study.scene.active_effects.energy else 1.0)
    size = (width, SIZE[1])
    return save(lambda figure: plot(study, figure), folder, "correlations", size=size)


def plot_function(study: Study, name: str, axes: Any, *, span: float | None = None) -> None:
    """Draw one normalised function of all wave numbers against reduced time.

    Parameters
    ----------
    study : Study
    name : {"transverse", "longitudinal", "density", "cross", "reversed_cross"}
        Of a fluid with an energy also "energy", "density_energy" and "energy_current".
    axes : matplotlib Axes
    span : float, optional
        Where the reduced time ends [1].
    """
    end = SPANS[name] if span is None else span
    for index, shell in enumerate(study.shells):
        colour, marker = COLOURS[index % 6], MARKERS[index % 6]
        unit = _unit(shell, name)
        time = np.linspace(0.0, end, 300)
        axes.plot(time, shell.prediction.function(name, time / unit), color=colour, linewidth=1.2)
        lag, mean, error = shell.normalized(name)
        chosen = _spread(lag * unit, end)
        axes.errorbar(
            lag[chosen] * unit,
            mean[chosen],
            yerr=error[chosen],
            fmt=marker,
            color=colour,
            markersize=3.5,
            linewidth=0.8,
            label=f"$kh={shell.wave_number * study.scene.support_radius:.2f}$",
        )
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    labels = {"transverse": r"$\nu k^2t$", "energy": "heat mode's decay times $t$"}
    label = labels.get(name, r"$c(k)\,k\,t$")
    axes.set(xlabel=label, ylabel="correlation, normalised", title=TITLES[name], xlim=(0.0, end))


def _unit(shell: Shell, name: str) -> float:
    theory = shell.prediction
    if name == "energy" and isinstance(theory, EnergyWavePrediction):
        return theory.system.heat_rate
    return theory.shear_rate if name == "transverse" else theory.frequency


def _spread(time: Any, end: float) -> Any:
    """Some 24 lags at about equal distances."""
    wanted = np.linspace(0.0, end, 25)
    inside = np.flatnonzero(time <= end)
    nearest = [int(inside[np.argmin(np.abs(time[inside] - t))]) for t in wanted]
    return np.unique(nearest)


def _parameters(study: Study, axes: Any) -> None:
    h = study.scene.support_radius
    kh = np.array([shell.wave_number * h for shell in study.shells])
    kinds: tuple[tuple[str, str, str, str, float], ...] = (
        (r"$\nu(k)$", COLOURS[0], "o", "viscosity", 0.97),
        (r"$\Gamma(k)$", COLOURS[1], "s", "damping", 1.0),
        (r"$c(k)$", COLOURS[2], "^", "sound_speed", 1.03),
    )
    if study.scene.active_effects.energy:
        kinds += (
            (r"$c_S(k)$", COLOURS[3], "D", "adiabatic_speed", 0.95),
            ("$q(k)$", COLOURS[4], "v", "conduction", 1.05),
        )
    for label, colour, marker, name, shift in kinds:
        found = [getattr(shell.fit, name) for shell in study.shells]
        expected = np.array([getattr(shell.prediction, name) for shell in study.shells])
        if name == "conduction":  # the fit's is over k^2
            expected = expected / np.array([shell.wave_number for shell in study.shells]) ** 2
        axes.errorbar(
            shift * kh,
            [e.value for e in found] / expected,
            yerr=[e.stderr for e in found] / expected,
            fmt=marker,
            color=colour,
            markersize=4.5,
            capsize=3.0,
            label=label,
        )
    accuracy = max(shell.prediction.viscosity_accuracy for shell in study.shells)
    axes.axhspan(1.0 - accuracy, 1.0 + accuracy, color="0.92")
    axes.axhline(1.0, color="0.2", linewidth=0.8)
    axes.set(xlabel="$kh$", ylabel="fitted over predicted", title="viscosity, damping, sound speed")
    axes.legend(fontsize=8)


def _deviations(study: Study, axes: Any) -> None:
    z = np.array([item.z for item in study.items])
    exact = np.array([item.exact for item in study.items])
    order = np.arange(z.size)
    axes.axhspan(-threshold(study), threshold(study), color="0.92")
    axes.plot(order[exact], z[exact], "o", color=COLOURS[0], markersize=4, label="theory exact")
    axes.plot(
        order[~exact], z[~exact], "s", color=COLOURS[1], markersize=4, label="theory approximate"
    )
    axes.set(xlabel="row of the table", ylabel="$z$", title="distance from theory, SE")
    axes.set_yscale("symlog", linthresh=5.0)
    axes.legend(fontsize=8)
