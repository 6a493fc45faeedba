"""Bias of the kinetic temperature under velocity Verlet against dt/tau."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, blocked, grid, reduced_fluid, shown, subplots

import sdpd

ETA = 20.0
SOUND_SPEED = 10.0  # X = 100
RATIOS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
ITERATIONS = (0, 1, 2)
FIRST_ORDER = {0: 0.0, 1: -1.0 / 4.0, 2: -1.0 / 2.0}  # one mode, see the page
COLOURS = {0: "#4269d0", 1: "#3ca951", 2: "#ff725c"}


@dataclass(frozen=True)
class Line:
    """T/T0 - 1 = slope x + curvature x^2 with x = dt/tau, and standard errors."""

    slope: float
    slope_error: float
    curvature: float
    curvature_error: float


def scene_of(edge: int) -> sdpd.Scene:
    """An equilibrium fluid."""
    return sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.4),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )


def temperature_bias(
    scene: sdpd.Scene, positions: np.ndarray, iterations: int, ratio: float, time: float
) -> tuple[float, float, float]:
    """dt/tau with the tau of this fluid, T/T0 - 1 and its standard error."""
    integrator = sdpd.VelocityVerlet(iterations=iterations, noise="gaussian")
    tau = scene.friction_time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sim = sdpd.Simulation(
            scene, integrator=integrator, dt=ratio * tau, seed=7, threads=1, positions=positions
        )
    sim.run(time=20.0 * tau, progress=False)
    thermo = sdpd.Thermodynamics(every=max(1, round(0.2 / ratio)))
    sim.run(time=time * tau, observe=thermo, progress=False)
    mean, error = blocked(thermo["temperature"])
    return sim.dt * sim.friction_rate(), mean - 1.0, error


def fit(points: np.ndarray) -> Line:
    """Weighted least squares of rows (x, bias, error)."""
    x, bias, error = points.T
    design = np.stack([x, x**2], axis=1) / error[:, None]
    covariance = np.linalg.inv(design.T @ design)
    slope, curvature = covariance @ design.T @ (bias / error)
    errors = np.sqrt(np.diag(covariance))
    return Line(float(slope), float(errors[0]), float(curvature), float(errors[1]))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("verlet_temperature", __doc__, argv)
    edge, ratios, time = (10, RATIOS, 1500.0) if not report.quick else (6, (0.1, 0.2, 0.3), 40.0)
    scene = scene_of(edge)
    start = sdpd.Simulation(scene, seed=3, threads=1)
    start.run(time=5.0 if not report.quick else 0.1, progress=False)
    positions = np.array(start.positions)
    found = {
        n: np.array([temperature_bias(scene, positions, n, ratio, time) for ratio in ratios])
        for n in ITERATIONS
    }
    lines = {n: fit(points) for n, points in found.items()}
    rows = [
        [f"{ratio:g}", *(_percent(*found[n][index, 1:]) for n in ITERATIONS)]
        for index, ratio in enumerate(ratios)
    ]
    rows.append(
        ["slope", *(shown(x.slope, x.slope_error, digits=3, signed=True) for x in lines.values())]
    )
    rows.append(
        [
            "curvature",
            *(shown(x.curvature, x.curvature_error, digits=2, signed=True) for x in lines.values()),
        ]
    )
    rows.append(["one mode, slope", *(f"{FIRST_ORDER[n]:+.3f}" for n in ITERATIONS)])
    header = ["$\\Delta t/\\tau$", *(f"`iterations={n}`" for n in ITERATIONS)]
    report.document(
        grid(header, rows),
        "Bias of the kinetic temperature $T_\\mathrm{kin}/T-1$ in per cent, and the fit "
        "$T_\\mathrm{kin}/T-1=s\\,x+c\\,x^2$, $x=\\Delta t/\\tau$ [1], to all rows; one standard "
        f"error. Lucy, $h/\\Delta x=2.4$, $X=100$, $\\eta^*={ETA:g}$, $N={edge**3}$, Gaussian "
        "variates.",
    )
    _plot(report, found, lines)


def _percent(mean: float, error: float) -> str:
    return shown(100.0 * mean, 100.0 * error, digits=2, signed=True)


def _plot(report: Report, found: dict[int, np.ndarray], lines: dict[int, Line]) -> None:
    figure, axes = subplots(width=5.0, height=3.2)
    for n, points in found.items():
        x = np.linspace(0.0, 1.05 * points[:, 0].max(), 100)
        line, colour = lines[n], COLOURS[n]
        axes.plot(x, 100 * (line.slope * x + line.curvature * x**2), color=colour, linewidth=1.2)
        axes.plot(x, 100 * FIRST_ORDER[n] * x, color=colour, linewidth=0.8, linestyle="--")
        axes.errorbar(
            points[:, 0],
            100 * points[:, 1],
            100 * points[:, 2],
            color=colour,
            linestyle="",
            marker="o",
            markersize=3.5,
            label=f"iterations={n}",
        )
    axes.plot([], [], color="0.3", linewidth=0.8, linestyle="--", label="one mode, first order")
    axes.axhline(0.0, color="0.5", linewidth=0.8)
    axes.set(xlabel=r"$\Delta t/\tau$", ylabel="bias of the temperature (%)")
    axes.legend(loc="lower left")
    report.figure(figure)


if __name__ == "__main__":
    main()
