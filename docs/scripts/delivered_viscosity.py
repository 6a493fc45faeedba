"""Viscosity that the pair splitting delivers against dt/tau: decay of a shear wave on a lattice."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import KERNEL_COLOURS, Report, grid, mean_and_error, reduced_fluid, shown, subplots

import sdpd
from sdpd import discretization, kernels

ETA = 20.0
SOUND_SPEED = 1e-2  # so soft that the wave does nothing but diffuse
AMPLITUDE = 1e-4
RATIOS = (0.1, 0.25, 0.5, 0.9, 1.3, 1.8, 2.6, 3.7, 5.2, 7.3, 11.0)
COARSE = (0.9, 1.8, 3.7, 7.3, 11.0)


@dataclass(frozen=True)
class Case:
    """A kernel and support, particles along an edge, waves along it, and the steps to try."""

    kernel: str
    support: float
    edge: int
    wave: int = 1
    ratios: tuple[float, ...] = RATIOS

    @property
    def title(self) -> str:
        return f"{kernels.get(self.kernel).title} {self.support:g}"


CURVES = (
    Case("lucy", 3.0, 12),
    Case("wendland_c2", 3.0, 12),
    Case("lucy", 2.4, 20),
)
BOXES = (  # the same wavelength in more blocks, and the longest wave of larger boxes
    Case("wendland_c2", 3.0, 12, ratios=COARSE),
    Case("wendland_c2", 3.0, 24, wave=2, ratios=COARSE),
    Case("wendland_c2", 3.0, 24, ratios=COARSE),
    Case("wendland_c2", 3.0, 32, ratios=COARSE[1:]),
)


def scene_of(case: Case) -> sdpd.Scene:
    """A fluid at rest on a lattice, without noise."""
    return sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(case.edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel=case.kernel, support=case.support),
        effects=sdpd.Effects(fluctuations=False),
        sound_speed=SOUND_SPEED,
    )


def delivered(case: Case, scene: sdpd.Scene, ratio: float, axis: int, component: int) -> float:
    """Decay rate of one shear wave over that of the lattice sum."""
    k = np.zeros(3)
    k[axis] = 2.0 * math.pi * case.wave / case.edge
    rates = discretization.lattice_rates(
        case.kernel,
        3,
        case.support,
        k,
        spacing=1.0,
        across=scene.friction_across,
        along=scene.friction_along,
        mass=1.0,
    )
    exact = rates[component, component]
    dt = ratio * scene.friction_time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sim = sdpd.Simulation(scene, integrator="pair_splitting", dt=dt, threads=1)
    wave = np.sin(sim.positions @ k)
    velocities = np.zeros_like(sim.velocities)
    velocities[:, component] = AMPLITUDE * wave
    sim.velocities = velocities
    steps = max(1, round(1.0 / exact / dt))
    sim.run(steps, progress=False)
    left = (sim.velocities[:, component] @ wave) / (AMPLITUDE * (wave @ wave))
    return float(-math.log(left) / (steps * dt * exact))


def blocks_of(scene: sdpd.Scene) -> str:
    """Blocks of the sweep along the axes."""
    sim = sdpd.Simulation(scene, threads=1)
    return " x ".join(str(n) for n in sim.statistics()["blocks"])


def curve(case: Case, directions: Sequence[tuple[int, int]]) -> list[tuple[float, float]]:
    """Mean and standard error over directions of wave and velocity, for each dt/tau."""
    scene = scene_of(case)
    return [
        mean_and_error(delivered(case, scene, ratio, *direction) for direction in directions)
        for ratio in case.ratios
    ]


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("delivered_viscosity", __doc__, argv)
    directions = [(k, u) for k in range(3) for u in range(3) if k != u]
    curves, boxes = CURVES, BOXES
    if report.quick:
        directions = directions[:2]
        curves = tuple(Case(c.kernel, c.support, 8, ratios=(0.9, 3.7)) for c in CURVES[:2])
        boxes = ()
    found = [curve(case, directions) for case in curves]
    rows = [
        [f"{ratio:g}", *(shown(*results[n]) for results in found)]
        for n, ratio in enumerate(curves[0].ratios)
    ]
    header = ["$\\Delta t/\\tau$", *(case.title for case in curves)]
    parts = [
        grid(header, rows),
        "Delivered viscosity over the lattice sum at the same wave number [1]; kernels and "
        "$h/\\Delta x$ in the header, cubic lattices of "
        + ", ".join(f"{case.edge}³" for case in curves)
        + f" particles, one wavelength along an edge; mean over {len(directions)} directions of "
        "wave and velocity, one standard error.",
    ]
    if boxes:
        rows = []
        for case in boxes:
            results = dict(zip(case.ratios, curve(case, directions[:3]), strict=True))
            cells = [shown(*results[r]) if r in results else "" for r in COARSE]
            rows.append([f"{case.edge}³", f"{case.wave}", blocks_of(scene_of(case)), *cells])
        header = ["particles", "waves along an edge", "blocks"]
        parts += [
            f"{boxes[0].title} in larger boxes, so in more blocks:",
            grid([*header, *(f"$\\Delta t/\\tau={r:g}$" for r in COARSE)], rows),
        ]
    report.document(*parts)
    _plot(report, curves, found)


def _plot(
    report: Report, curves: Sequence[Case], found: Sequence[Sequence[tuple[float, float]]]
) -> None:
    figure, axes = subplots(width=5.0, height=3.2)
    for case, results, style in zip(curves, found, ("-", "-", "--"), strict=False):
        axes.errorbar(
            case.ratios,
            [mean for mean, _ in results],
            [error for _, error in results],
            color=KERNEL_COLOURS[case.kernel],
            linestyle=style,
            marker="o",
            markersize=3.5,
            linewidth=1.2,
            label=rf"{kernels.get(case.kernel).title}, $h/\Delta x={case.support:g}$",
        )
    axes.axhline(1.0, color="0.5", linewidth=0.8)
    axes.axvline(2.0, color="0.5", linewidth=0.8, linestyle=":")
    axes.text(
        2.15, 0.05, r"bound $2\tau$", color="0.4", transform=axes.get_xaxis_transform()
    )
    axes.set(xlabel=r"$\Delta t/\tau$", ylabel="delivered over exact viscosity")
    axes.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
