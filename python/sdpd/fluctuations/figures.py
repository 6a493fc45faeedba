"""Six panels: S(k), |j_k|^2, velocities, their correlation in space, density, and all z.

Two more of a fluid with an energy: temperatures of particles, and waves of T, S and P.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd.drawing import BLUE, GREEN, VERMILION, figure_or_new, finish, save
from sdpd.fluctuations.energy_items import EnergyPrediction
from sdpd.fluctuations.report import threshold
from sdpd.fluctuations.sampler import HISTOGRAM

if TYPE_CHECKING:
    from sdpd.fluctuations.study import Study

__all__ = ["plot", "write_figure"]

SIZE = (12.0, 7.2)


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
    drawn = [_structure, _currents, _histogram, _quantiles, _space, _deviations]
    if study.sampler.energy is not None:
        drawn[5:5] = [_temperatures, _energy_modes]
    columns = len(drawn) // 2
    figure = figure_or_new(figure, (SIZE[0] * columns / 3.0, SIZE[1]))
    panels = figure.subplots(2, columns).ravel()
    for axes, draw in zip(panels, drawn, strict=True):
        draw(study, axes)
    finish(figure, panels, study.scene, f"X = {study.scene.stiffness:.3g}")
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write fluctuations.png; the folder is made if need be."""
    width = SIZE[0] * (1.0 if study.sampler.energy is None else 4.0 / 3.0)
    return save(lambda figure: plot(study, figure), folder, "fluctuations", size=(width, SIZE[1]))


def _points(axes: Any, x: Any, rows: Any, color: str, marker: str, text: str) -> None:
    """Mean and standard error over blocks, shape (B, M)."""
    error = rows.std(axis=0, ddof=1) / len(rows) ** 0.5
    axes.errorbar(
        x,
        rows.mean(axis=0),
        yerr=error,
        fmt=marker,
        color=color,
        markersize=4.5,
        capsize=3.0,
        label=text,
        zorder=3,
    )


def _structure(study: Study, axes: Any) -> None:
    sampler, h = study.sampler, study.scene.support_radius
    _points(axes, sampler.wave_number * h, sampler.table["structure"], BLUE, "o", "measured")
    if study.prediction is not None:
        k = np.linspace(0.0, 1.05 * float(sampler.wave_number[-1]), 200)
        expected = study.prediction.structure_factor(k)
        share = study.prediction.accuracy("structure")
        axes.plot(k * h, expected, color="0.2", label="RPA at this dt")
        low, high = expected * (1.0 - share), expected * (1.0 + share)
        axes.fill_between(k * h, low, high, color="0.85", label=f"± {share:.0%}")
    axes.set(xlabel="$kh$", ylabel="$S(k)$", title="structure factor", yscale="log")
    axes.legend(fontsize=8)


def _currents(study: Study, axes: Any) -> None:
    sampler, h = study.sampler, study.scene.support_radius
    kinds = (("longitudinal", VERMILION, "s", 0.99), ("transverse", BLUE, "o", 1.01))
    for kind, color, marker, shift in kinds:
        _points(axes, shift * sampler.wave_number * h, sampler.table[kind], color, marker, kind)
    axes.axhline(1.0, color="0.2")
    label = r"$\langle|j_k|^2\rangle/(m\,k_BT\,N)$"
    axes.set(xlabel="$kh$", ylabel=label, title="momentum modes, exact: 1")
    axes.legend(fontsize=8)


def _histogram(study: Study, axes: Any) -> None:
    counts = study.sampler.histogram
    width = HISTOGRAM[1] - HISTOGRAM[0]
    centers = 0.5 * (HISTOGRAM[1:] + HISTOGRAM[:-1])
    seen = counts > 0
    axes.plot(centers[seen], counts[seen] / counts.sum() / width, "o", color=BLUE, markersize=3)
    axes.plot(centers, np.exp(-0.5 * centers**2) / np.sqrt(2.0 * np.pi), color="0.2")
    label = r"$v/\sqrt{k_BT/m}$"
    axes.set(xlabel=label, ylabel="probability density", title="velocities", yscale="log")


def _quantiles(study: Study, axes: Any) -> None:
    from scipy import stats

    share = np.cumsum(study.sampler.histogram) / study.sampler.histogram.sum()
    inside = (share > 1e-5) & (share < 1.0 - 1e-5)
    normal = stats.norm.ppf(share[inside])
    axes.plot(normal, HISTOGRAM[1:][inside] - normal, "o", color=BLUE, markersize=3)
    axes.axhline(0.0, color="0.2")
    axes.set(
        xlabel="quantile of the normal distribution",
        ylabel="measured quantile less that",
        title="velocities, quantile-quantile",
    )


def _space(study: Study, axes: Any) -> None:
    sampler = study.sampler
    sums, counts = sampler.table["pairs"][:, 0], sampler.table["pairs"][:, 1]
    edges = sampler.distance_edges / study.scene.support_radius
    seen = counts.all(axis=0)
    centers = 0.5 * (edges[1:] + edges[:-1])[seen]
    _points(axes, centers, sums[:, seen] / counts[:, seen], GREEN, "o", "measured")
    exact = -1.0 / study.scene.n_particles
    axes.axhline(exact, color="0.2", label="exact: $-1/N$, as the total momentum is zero")
    label = r"$\langle v_i\cdot v_j\rangle/(D\,k_BT/m)$"
    axes.set(xlabel="$r/h$", ylabel=label, title="velocities in space")
    axes.legend(fontsize=8)


def _temperatures(study: Study, axes: Any) -> None:
    from scipy import stats

    energy = study.sampler.energy
    assert energy is not None
    counts, k = energy.histogram, energy.shell.heat_capacity
    width = HISTOGRAM[1] - HISTOGRAM[0]
    centers = 0.5 * (HISTOGRAM[1:] + HISTOGRAM[:-1])
    seen = counts > 0
    axes.plot(centers[seen], counts[seen] / counts.sum() / width, "o", color=BLUE, markersize=3)
    positive = centers > -np.sqrt(k)
    share = 1.0 + centers[positive] / np.sqrt(k)
    exact = stats.beta.pdf(share * k / energy.shell.freedom, k, energy.shell.freedom - k)
    axes.plot(centers[positive], exact * np.sqrt(k) / energy.shell.freedom, color="0.2")
    label = r"$(T_i/T-1)\,\sqrt{C/k_B}$"
    axes.set(xlabel=label, ylabel="probability density", title="temperatures", yscale="log")


def _energy_modes(study: Study, axes: Any) -> None:
    sampler, h = study.sampler, study.scene.support_radius
    assert sampler.energy is not None
    k = sampler.energy.shell.heat_capacity
    number = sampler.wave_number * h
    label = r"$\langle|T_k|^2\rangle C/k_BT^2N$"
    _points(axes, number, sampler.table["temperature_modes"], BLUE, "o", label)
    axes.axhline(1.0, color="0.2")
    if study.prediction is not None:
        theory = EnergyPrediction(study.scene, study.prediction)
        grid = np.linspace(0.0, 1.05 * float(sampler.wave_number[-1]), 200)
        unit = theory.pressure_modes(0.0) / theory.heat_ratio * (theory.heat_ratio - 1.0)
        entropy = sampler.table["entropy_modes"] / k
        _points(axes, number, entropy, VERMILION, "s", r"$\langle|S_k|^2\rangle/k_BCN$")
        axes.plot(grid * h, theory.entropy_modes(grid) / k, color=VERMILION)
        pressure = sampler.table["pressure_modes"] / unit
        _points(
            axes, number, pressure, GREEN, "^", r"$\langle|P_k|^2\rangle$, over its part by $T$"
        )
        axes.plot(grid * h, theory.pressure_modes(grid) / unit, color=GREEN)
    axes.set(
        xlabel="$kh$", ylabel="over that by $T$", title="waves of temperature, entropy, pressure"
    )
    axes.legend(fontsize=8)


def _deviations(study: Study, axes: Any) -> None:
    z = np.array([item.z for item in study.items])
    exact = np.array([item.exact for item in study.items])
    order = np.arange(z.size)
    axes.axhspan(-threshold(study), threshold(study), color="0.92")
    axes.plot(order[exact], z[exact], "o", color=BLUE, markersize=4, label="theory exact")
    axes.plot(order[~exact], z[~exact], "s", color=VERMILION, markersize=4, label="RPA")
    axes.set(xlabel="row of the table", ylabel="$z$", title="distance from theory, SE")
    axes.set_yscale("symlog", linthresh=5.0)
    axes.legend(fontsize=8)
