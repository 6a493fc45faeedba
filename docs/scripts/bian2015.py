"""Bian et al. (2015), section III, again: statistics, space, waves and pressure of his 2D fluid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from bian2015_runs import (
    ETA,
    SPACING,
    TIME_STEP,
    WAVES,
    Configurations,
    Length,
    configurations,
    density_theory,
    misfit,
    published,
    rpa_correlation,
    rpa_pressure,
    scene_of,
    stress_of,
    viscosity_within,
    waves_of,
)
from report import Report, grid, shown, subplots

from sdpd.analysis import (
    Correlation,
    Estimate,
    combine,
    fit_spherical_model,
    quantiles,
    radial_distribution,
    semivariogram,
    spatial_correlation,
)
from sdpd.correlations import Study, plot_function
from sdpd.drawing import BLUE, GREEN, VERMILION

GREY = "0.45"
COLOURS = (BLUE, VERMILION, GREEN)
MARKERS = ("o", "s", "^")
FUNCTIONS = ("transverse", "longitudinal", "density", "cross", "reversed_cross")
BINS = np.linspace(0.0, 1.4, 29)  # of r_c
PUBLISHED_VARIANCE, PUBLISHED_MEAN, PUBLISHED_RANGE = 2.4e-4, 1.001, 0.13
TABLE_I = {300: 0.9, 450: 1.4, 600: 1.8, 900: 2.7, 1200: 3.6, 1500: 4.5}


@dataclass(frozen=True)
class Size:
    """How much is run."""

    box: float
    waves: tuple[int, ...]
    runs: int  # of waves, for c_T = 1200, 600, 300 and for the thin fluid
    statics: Length
    sweep: Length
    speeds: tuple[float, ...]
    spacings: tuple[float, ...]


FULL = Size(
    box=2.0,
    waves=WAVES,
    runs=24,
    statics=Length(runs=8, frames=40, gap=50, settle=1500),
    sweep=Length(runs=4, frames=20, gap=30, settle=800),
    speeds=(300.0, 600.0, 1200.0, 2400.0),
    spacings=(0.05, 0.025),
)
QUICK = Size(
    box=0.6,
    waves=(1,),
    runs=4,
    statics=Length(runs=2, frames=8, gap=4, settle=40),
    sweep=Length(runs=2, frames=4, gap=4, settle=40),
    speeds=(300.0, 600.0),
    spacings=(0.05,),
)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("bian2015", __doc__, argv)
    size = QUICK if report.quick else FULL
    middle = configurations(scene_of(600.0, box=size.box), size.statics, seed=1, dt=TIME_STEP)
    sweep = {
        spacing: [
            configurations(scene_of(speed, spacing=spacing, box=size.box), size.sweep, seed=2)
            for speed in size.speeds
        ]
        for spacing in size.spacings
    }
    resolutions = [middle, *_other_resolutions(sweep, size)]
    studies = {
        (speed, eta): waves_of(
            speed, eta=eta, runs=size.runs, waves=size.waves, box=size.box, quick=report.quick
        )
        for speed, eta in ((1200.0, ETA), (600.0, ETA), (300.0, ETA), (300.0, 0.25 * ETA))
    }
    stress = stress_of(1200.0, runs=size.runs, seed=9, box=size.box, quick=report.quick)
    spaces = [Space(found) for found in resolutions]
    report.document(
        _statistics_table(middle, spaces[0]),
        "One standard error; $c_T=600$, $r_c=0.15$, his time step $1.4\\times10^{-5}$. Theory of "
        "the density: random-phase approximation at this time step.",
        _variance_table(sweep),
        "Variance of the density of particles: over the random-phase approximation at the time "
        "step (a quarter of the acoustic limit), itself, and over $1/X$, which is Landau–Lifshitz "
        "for a cell of one particle (B 13); and the effective pressure less $c_T^2\\rho$.",
        _space_table(spaces),
        "Correlation coefficient of the density against distance, and theory in brackets.",
        _wave_table(studies),
        "Fitted viscosity, sound speed and damping; in brackets linearised theory at this $k$ and "
        "time step, with the friction among the particles where they are, then with that of the "
        "continuum; and the largest distance of the longitudinal correlation (1 at zero) from our "
        "theory and from B 21b, with its $\\Gamma_T=\\frac23\\nu$ and with the right "
        "$\\frac34\\nu$; in brackets one standard error there.",
        _pooled(studies),
        _stress_table(studies[1200.0, ETA], stress),
        "Shear viscosity by Einstein and Helfand at $c_T=1200$, from the increments of the stress "
        "between half of a time and all of it, whole and of the forces between particles alone, at "
        "the decay times of the waves and at the longest lag; beside it what the waves have over "
        "the friction.",
        _scales_table(),
        "Table I of the paper, $r_cc_T/\\nu$, and what decides instead: $\\Gamma_Tk/c_T$ at "
        "$n_w=1,2,4$ (above 1 a wave is overdamped).",
    )
    _plot_distributions(report, middle)
    _plot_variance(report, sweep)
    _plot_space(report, spaces)
    _plot_structure(report, middle)
    _plot_waves(report, studies[1200.0, ETA])
    _plot_sound(report, studies)
    _plot_pressure(report, sweep)


def _other_resolutions(
    sweep: dict[float, list[Configurations]], size: Size
) -> list[Configurations]:
    """c_T = 600 at the other r_c: the finer of the sweep, and a coarser one."""
    at = size.speeds.index(600.0)
    finer = [found[at] for spacing, found in sweep.items() if spacing != SPACING]
    if len(size.spacings) == 1:
        return finer
    coarser = scene_of(600.0, spacing=2.0 * SPACING, box=size.box)
    return [*finer, configurations(coarser, replace(size.sweep, runs=8, frames=60), seed=3)]


class Space:
    """Correlations in space of one resolution."""

    def __init__(self, found: Configurations) -> None:
        scene = found.scene
        self.found, self.reach = found, scene.support_radius
        box, blocks = scene.box.lengths, 2 * found.runs
        bins = self.reach * BINS
        rho = found.density - found.density.mean()
        speed = scene.thermal_speed
        position = found.position
        self.density = spatial_correlation(position, box, rho, bins=bins, n_blocks=blocks)
        self.velocity = spatial_correlation(
            position, box, found.velocity / speed, bins=bins, n_blocks=blocks
        )
        deviation = float(np.sqrt(self.density.local.value))
        self.cross = spatial_correlation(
            position,
            box,
            rho / deviation,
            found.velocity[..., 0] / speed,
            bins=bins,
            n_blocks=blocks,
        )
        self.variogram = semivariogram(position, box, found.density, bins=bins, n_blocks=blocks)
        self.model = fit_spherical_model(self.variogram, sill=self.density.local.value)
        self.expected = rpa_correlation(scene, self.density.centers)

    def coefficient(self) -> tuple[np.ndarray, np.ndarray]:
        """Correlation coefficient of the density and its error."""
        scale = self.density.local.value
        return self.density.mean / scale, self.density.stderr / scale


# --- tables -----------------------------------------------------------------------------------


def _estimate(value: Estimate, digits: int = 5, scale: float = 1.0) -> str:
    return shown(scale * value.value, scale * value.stderr, digits=digits)


def _z(value: Estimate, expected: float) -> str:
    return f"{value.z(expected):+.1f}"


def _statistics_table(found: Configurations, space: Space) -> str:
    theory = found.prediction
    kurtosis = found.standardised_moment("velocity", 4)
    skewness = found.standardised_moment("density", 3)
    peaked = found.standardised_moment("density", 4)
    velocity = found.standardised_moment("velocity", 3)
    rows = [
        [
            "variance of a velocity component $\\times m/k_BT$",
            "below 1 % off",
            _estimate(found.temperature),
            "1",
            _z(found.temperature, 1.0),
        ],
        ["skewness of the velocity", "negligible", _estimate(velocity, 4), "0", _z(velocity, 0.0)],
        [
            "kurtosis of the velocity",
            "normal",
            _estimate(kurtosis, 4),
            "3",
            _z(kurtosis, 3.0),
        ],
        [
            "mean density of particles",
            f"{PUBLISHED_MEAN}",
            _estimate(found.mean_density, 6),
            f"{1.0 + theory.bias:.5f}",
            "",
        ],
        [
            "variance of the density $\\times10^4$",
            f"{1e4 * PUBLISHED_VARIANCE:.1f}",
            _estimate(found.variance, 4, 1e4),
            f"{1e4 * found.expected_variance:.3f}",
            "",
        ],
        ["skewness of the density", "negligible", _estimate(skewness, 4), "", ""],
        ["kurtosis of the density", "normal", _estimate(peaked, 4), "", ""],
        [
            "range of the spherical model, sill fixed",
            f"{PUBLISHED_RANGE}",
            _estimate(space.model.range, 5),
            "",
            "",
        ],
    ]
    return grid(["", "Bian et al.", "here", "theory", "z"], rows)


def _variance_table(sweep: dict[float, list[Configurations]]) -> str:
    rows = []
    for spacing, members in sweep.items():
        for found in members:
            scene = found.scene
            ideal = scene.thermal_energy * scene.n_particles / scene.box.volume
            model = scene.fluid.density * scene.sound.speed**2
            pressure = found.pressure
            excess = replace(pressure, value=(pressure.value - model))
            rows.append(
                [
                    f"{3.0 * spacing:g}",
                    f"{scene.sound.speed:g}",
                    f"{scene.stiffness:.4g}",
                    _estimate(found.variance, 4, 1.0 / found.expected_variance),
                    _estimate(found.variance, 4, 1e4),
                    _estimate(found.variance, 4, scene.stiffness),
                    _estimate(excess, 3, 1.0 / ideal),
                    f"{(rpa_pressure(scene) - model) / ideal:.3f}",
                ]
            )
    header = ["$r_c$", "$c_T$", "$X$", "over theory", "$\\sigma^2\\times10^4$"]
    header += ["over Landau–Lifshitz", "$(P-c_T^2\\rho)/nk_BT$", "theory"]
    return grid(header, rows)


def _space_table(spaces: Sequence[Space]) -> str:
    rows = []
    for place in (0.325, 0.425, 0.525, 0.725, 0.975, 1.175):
        row = [f"{place:g}"]
        for space in spaces:
            value, error = space.coefficient()
            at = int(np.argmin(np.abs(space.density.centers / space.reach - place)))
            row.append(f"{shown(float(value[at]), float(error[at]))} ({space.expected[at]:.3f})")
        rows.append(row)
    header = ["$r/r_c$", *(f"$r_c={space.reach:g}$" for space in spaces)]
    return grid(header, rows)


def _wave_table(studies: dict[tuple[float, float], Study]) -> str:
    rows = []
    for (speed, eta), study in studies.items():
        for index, (shell, number) in enumerate(zip(study.shells, study.waves, strict=True)):
            theory, fit = shell.prediction, shell.fit
            ratio = theory.sound_rate / theory.frequency
            rows.append(
                [
                    f"{speed:g}",
                    f"{eta:.4g}",
                    f"{number}",
                    f"{ratio:.2f}",
                    _beside(fit.viscosity, theory.viscosity, shell.continuum.viscosity),
                    _beside(fit.sound_speed, theory.sound_speed),
                    _beside(fit.damping, theory.damping, shell.continuum.damping),
                    *(
                        _distance(*misfit(study, index, "longitudinal", damping))
                        for damping in (None, 2.0 / 3.0, 0.75)
                    ),
                ]
            )
    header = ["$c_T$", "$\\nu$", "$n_w$", "$\\Gamma k/c$", "$\\nu(k)$", "$c(k)$", "$\\Gamma(k)$"]
    header += ["off theory", "off B 21b", "with $\\frac34\\nu$"]
    return grid(header, rows)


def _pooled(studies: dict[tuple[float, float], Study]) -> str:
    """All waves of his fluid together."""
    shells = [s for (_, eta), study in studies.items() if eta == ETA for s in study.shells]

    def ratio(name: str) -> Estimate:
        members = [
            getattr(shell.fit, name).scaled(1.0 / getattr(shell.prediction, name))
            for shell in shells
        ]
        return combine(members, weights="inverse_variance")

    viscosity, speed, damping = (ratio(n) for n in ("viscosity", "sound_speed", "damping"))
    return (
        f"Over theory, the {len(shells)} waves at $\\nu=49.71$ together: $\\nu(k)$ "
        f"{_estimate(viscosity, 4)}, $c(k)$ {_estimate(speed, 4)}, $\\Gamma(k)$ "
        f"{_estimate(damping, 4)}; $\\Gamma_T=\\frac23\\nu$ would be 0.889, "
        f"{damping.z(8.0 / 9.0):.0f} standard errors away."
    )


def _beside(found: Estimate, *expected: float) -> str:
    theory = ", ".join(f"{value:.4g}" for value in expected)
    return f"{shown(found.value, found.stderr, digits=2)} ({theory})"


def _distance(value: float, error: float) -> str:
    return f"{value:.3f} ({error:.3f})"


def _stress_table(study: Study, stress: dict[str, Correlation]) -> str:
    times = {
        f"$n_w={number}$": (1.0 / shell.prediction.shear_rate, shell)
        for number, shell in zip(study.waves, study.shells, strict=True)
    }
    longest = float(stress["total"].lag[-1])
    rows = []
    for name, time in [*((n, t) for n, (t, _) in reversed(times.items())), ("", longest)]:
        total, forces = (
            viscosity_within(stress[part], study.scene, time) for part in ("total", "conservative")
        )
        excess = ""
        if name:
            shell = times[name][1]
            share = shell.fit.viscosity.scaled(1.0 / shell.prediction.viscosity)
            excess = _estimate(replace(share, value=share.value - 1.0), 3)
        rows.append(
            [
                name,
                f"{time:.2g}",
                _estimate(total, 2),
                _estimate(forces, 2),
                _estimate(forces, 3, 1.0 / ETA),
                excess,
            ]
        )
    header = [
        "",
        "time",
        "whole",
        "forces",
        "forces over $\\eta$",
        "$\\nu(k)$ over friction, less 1",
    ]
    return grid(header, rows)


def _scales_table() -> str:
    rows = []
    for speed, printed in TABLE_I.items():
        numbers = [0.75 * ETA * math.pi * n / speed for n in WAVES]
        rows.append(
            [f"{speed}", f"{printed}", f"{3.0 * SPACING * speed / ETA:.2f}"]
            + [f"{number:.2f}" for number in numbers]
        )
    numbers = [0.75 * 0.25 * ETA * math.pi * n / 300.0 for n in WAVES]
    rows.append(
        ["300, $\\nu=12.43$", "3.6", f"{3.0 * SPACING * 300.0 / (0.25 * ETA):.2f}"]
        + [f"{number:.2f}" for number in numbers]
    )
    return grid(["$c_T$", "Table I", "here", *(f"$n_w={n}$" for n in WAVES)], rows)


# --- figures ----------------------------------------------------------------------------------


def _figure(report: Report, name: str, figure: Any) -> None:
    replace(report, name=f"bian2015_{name}").figure(figure)


def _plot_distributions(report: Report, found: Configurations) -> None:
    figure, axes = subplots(4, width=11.0, height=2.9)
    pairs = (
        (found.velocity, 0.0, found.scene.thermal_speed, "$v$", BLUE),
        (found.density, None, None, r"$\rho$", VERMILION),
    )
    for column, (data, mean, deviation, label, colour) in enumerate(pairs):
        values = np.ravel(data)
        centre = float(values.mean()) if mean is None else mean
        width = float(values.std()) if deviation is None else deviation
        edges = centre + width * np.linspace(-4.5, 4.5, 61)
        height, _ = np.histogram(values, edges, density=True)
        middle = 0.5 * (edges[1:] + edges[:-1])
        normal = np.exp(-0.5 * ((middle - centre) / width) ** 2) / (width * math.sqrt(2 * math.pi))
        left, right = axes[column], axes[2 + column]
        seen = height > 0.0
        left.plot(middle[seen], height[seen], "o", color=colour, markersize=3)
        left.plot(middle, normal, color="0.2", linewidth=1.0)
        left.set(xlabel=label, ylabel="probability density", yscale="log")
        points = quantiles(values, mean=centre, deviation=width, count=499)
        right.plot(
            (points.theoretical - centre) / width,
            (points.empirical - centre) / width,
            "o",
            color=colour,
            markersize=2.5,
        )
        right.plot([-3, 3], [-3, 3], color="0.2", linewidth=0.8)
        right.set(xlabel="normal quantile", ylabel=f"quantile of {label}, standardised")
    axes[0].set(title="Maxwell–Boltzmann")
    axes[1].set(title=f"normal, {found.density.mean():.4f}, {found.density.var():.3g}")
    _figure(report, "distributions", figure)


def _plot_variance(report: Report, sweep: dict[float, list[Configurations]]) -> None:
    figure, (left, right) = subplots(2, width=7.6, height=3.2)
    for (spacing, members), colour, marker in zip(sweep.items(), COLOURS, MARKERS, strict=False):
        speeds = np.array([found.scene.sound.speed for found in members])
        line = np.geomspace(speeds.min(), speeds.max(), 24)
        theory = np.array([density_theory(scene_of(c, spacing=spacing)).variance() for c in line])
        value = np.array([found.variance.value for found in members])
        error = np.array([found.variance.stderr for found in members])
        expected = np.array([found.expected_variance for found in members])
        label = f"$r_c={3.0 * spacing:g}$"
        left.errorbar(speeds, value, error, fmt=marker, color=colour, markersize=4, label=label)
        left.plot(line, theory, color=colour, linewidth=1.0)
        sharp = 1.0 / (spacing * line) ** 2
        left.plot(line, sharp, color=colour, linewidth=0.8, linestyle=":")
        right.errorbar(
            speeds, value / expected, error / expected, fmt=marker, color=colour, markersize=4
        )
    left.plot([], [], color="0.3", label="random-phase approximation")
    left.plot([], [], color="0.3", linestyle=":", label="Landau–Lifshitz, cell $dx^2$")
    left.set(xscale="log", yscale="log", xlabel="$c_T$", ylabel=r"variance of $\rho$")
    left.legend(fontsize=7)
    right.axhline(1.0, color="0.2", linewidth=0.8)
    right.set(xscale="log", xlabel="$c_T$", ylabel="measured over RPA")
    for panel in (left, right):
        _label_speeds(panel, sweep)
    _figure(report, "variance", figure)


def _label_speeds(axes: Any, sweep: dict[float, list[Configurations]]) -> None:
    speeds = [found.scene.sound.speed for found in next(iter(sweep.values()))]
    axes.set_xticks(speeds, [f"{speed:g}" for speed in speeds])
    axes.set_xticks([], minor=True)


def _plot_space(report: Report, spaces: Sequence[Space]) -> None:
    figure, axes = subplots(4, width=11.0, height=2.9)
    x = np.linspace(0.0, 1.4, 120)
    for space, colour, marker in zip(spaces, COLOURS, MARKERS, strict=False):
        label = f"$r_c={space.reach:g}$"
        place = space.density.centers / space.reach
        seen = space.density.counts > 20 * space.found.runs
        number = space.found.density.shape[1]
        options = {"fmt": marker, "color": colour, "markersize": 3, "linewidth": 0.8}
        velocity = space.velocity
        axes[0].errorbar(
            place[seen], velocity.mean[seen] + 1.0 / number, velocity.stderr[seen], **options
        )
        value, error = space.coefficient()
        axes[1].errorbar(place[seen], value[seen], error[seen], label=label, **options)
        theory = rpa_correlation(space.found.scene, x * space.reach)
        axes[1].plot(x, theory, color=colour, linewidth=0.9)
        cross = space.cross
        axes[2].errorbar(place[seen], cross.mean[seen], cross.stderr[seen], **options)
    first = spaces[0]
    variogram = first.variogram
    seen = variogram.counts > 20 * first.found.runs
    axes[3].errorbar(
        variogram.centers[seen] / first.reach,
        1e4 * variogram.mean[seen],
        1e4 * variogram.stderr[seen],
        fmt="o",
        color=BLUE,
        markersize=3,
        linewidth=0.8,
        label="measured",
    )
    axes[3].plot(
        x,
        1e4 * first.model(x * first.reach),
        color=VERMILION,
        linewidth=1.0,
        label=f"spherical, range {first.model.range.value:.3f}",
    )
    sill = first.density.local.value
    axes[3].plot(
        x,
        1e4 * sill * (1.0 - rpa_correlation(first.found.scene, x * first.reach)),
        color="0.2",
        linewidth=1.0,
        label="RPA",
    )
    axes[3].legend(fontsize=7)
    axes[1].legend(fontsize=7)
    axes[1].set(ylim=(-0.05, 1.1))
    for panel, title in zip(
        axes,
        (
            r"$v_i\cdot v_j+1/N$",
            r"$\rho_i\,\rho_j$",
            r"$\rho_i\,v_{x,j}$",
            "semivariogram, $10^{-4}$",
        ),
        strict=True,
    ):
        panel.set(xlabel="$r/r_c$", title=title, xlim=(0.0, 1.4))
    for panel in (axes[0], axes[2]):
        panel.axhline(0.0, color="0.2", linewidth=0.8)
        panel.set(ylim=(-0.025, 0.025))
    axes[0].set(ylabel="correlation coefficient")
    _figure(report, "space", figure)


def _plot_structure(report: Report, found: Configurations) -> None:
    figure, axes = subplots(width=4.6, height=3.0)
    reach = found.scene.support_radius
    longest = min(2.0 * reach, 0.5 * min(found.scene.box.lengths))
    for share, colour, marker in zip((0.1, 0.05, 0.025), COLOURS, MARKERS, strict=True):
        edges = np.arange(0.0, longest, share * reach)
        profile = radial_distribution(
            found.position, found.scene.box.lengths, bins=edges, n_blocks=2 * found.runs
        )
        axes.plot(
            profile.centers / reach,
            profile.mean,
            color=colour,
            marker=marker,
            markersize=2.5,
            linewidth=0.8,
            label=f"bins of ${share:g}\\,r_c$",
        )
    axes.axhline(1.0, color="0.5", linewidth=0.8)
    axes.set(xlabel="$r/r_c$", ylabel="$g(r)$")
    axes.legend()
    _figure(report, "structure", figure)


def _draw(study: Study, name: str, axes: Any, span: float) -> None:
    """Our theory as full lines, B 21 dashed, points."""
    plot_function(study, name, axes, span=span)
    for index, shell in enumerate(study.shells):
        theory = shell.prediction
        unit = theory.shear_rate if name == "transverse" else theory.frequency
        time = np.linspace(0.0, span / unit, 300)
        axes.plot(
            time * unit,
            published(study, index, name, time, 2.0 / 3.0),
            color=COLOURS[index],
            linestyle="--",
            linewidth=0.8,
            zorder=1,
        )


def _plot_waves(report: Report, study: Study) -> None:
    for figure_name, names, width in (("waves", FUNCTIONS[:3], 9.6), ("cross", FUNCTIONS[3:], 7.0)):
        figure, axes = subplots(len(names), width=width, height=3.0)
        for panel, name in zip(axes, names, strict=True):
            _draw(study, name, panel, 3.0 if name == "transverse" else 9.0)
        axes[-1].set(ylabel="")
        _legend(axes[0], study)
        _figure(report, figure_name, figure)


def _plot_sound(report: Report, studies: dict[tuple[float, float], Study]) -> None:
    chosen = [key for key in studies if key[0] < 1000.0]
    figure, axes = subplots(len(chosen), width=9.6, height=3.0)
    for panel, key in zip(axes, chosen, strict=True):
        _draw(studies[key], "longitudinal", panel, 9.0)
        panel.set(title=f"longitudinal, $c_T={key[0]:g}$, $\\nu={key[1]:.4g}$", ylabel="")
    _legend(axes[0], studies[chosen[0]])
    _figure(report, "sound", figure)


def _legend(axes: Any, study: Study) -> None:
    handles, _ = axes.get_legend_handles_labels()
    axes.legend(handles, [f"$n_w={n}$" for n in study.waves], fontsize=7)


def _plot_pressure(report: Report, sweep: dict[float, list[Configurations]]) -> None:
    figure, (left, right) = subplots(2, width=7.6, height=3.2)
    for (spacing, members), colour, marker in zip(sweep.items(), COLOURS, MARKERS, strict=False):
        scenes = [found.scene for found in members]
        model = np.array([scene.sound.speed**2 * scene.fluid.density for scene in scenes])
        ideal = scenes[0].thermal_energy * scenes[0].n_particles / scenes[0].box.volume
        value = np.array([found.pressure.value for found in members])
        error = np.array([found.pressure.stderr for found in members])
        theory = np.array([rpa_pressure(scene) for scene in scenes])
        label = f"$r_c={3.0 * spacing:g}$"
        left.plot(model, value, marker, color=colour, markersize=4, label=label)
        right.errorbar(
            np.sqrt(model),
            (value - model) / ideal,
            error / ideal,
            fmt=marker,
            color=colour,
            markersize=4,
        )
        right.plot(np.sqrt(model), (theory - model) / ideal, color=colour, linewidth=1.0)
    line = np.array([5e4, 1e7])
    left.plot(line, line, color="0.2", linewidth=0.8)
    left.set(xscale="log", yscale="log", xlabel=r"model, $c_T^2\rho$", ylabel="virial pressure")
    left.legend()
    right.axhline(0.0, color="0.5", linewidth=0.8, linestyle="--")
    right.set(
        xscale="log",
        xlabel="$c_T$",
        ylabel=r"$(P-c_T^2\rho)/(nk_BT)$",
        title="points: virial; lines: RPA",
    )
    _label_speeds(right, sweep)
    _figure(report, "pressure", figure)


if __name__ == "__main__":
    main()
