"""Viscosity that the pair splitting delivers against dt/tau: decay of a shear wave on a lattice."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
    dimension: int = 3

    @property
    def title(self) -> str:
        return f"{kernels.get(self.kernel).title} {self.support:g}"

    @property
    def directions(self) -> list[tuple[int, int]]:
        """Axes of wave and velocity."""
        axes = range(self.dimension)
        return [(k, u) for k in axes for u in axes if k != u]


CURVES: tuple[Case, ...] = (
    Case("lucy", 3.0, 12),
    Case("wendland_c2", 3.0, 12),
    Case("lucy", 2.4, 20),
)
BOXES: tuple[
    Case, ...
] = (  # the same wavelength in more blocks, and the longest wave of larger boxes
    Case("wendland_c2", 3.0, 12, ratios=COARSE),
    Case("wendland_c2", 3.0, 24, wave=2, ratios=COARSE),
    Case("wendland_c2", 3.0, 24, ratios=COARSE),
    Case("wendland_c2", 3.0, 32, ratios=COARSE[1:]),
)
OTHERS: tuple[Case, ...] = (
    Case("quintic_spline", 3.0, 12, ratios=COARSE),
    Case("wendland_c4", 3.0, 12, ratios=COARSE),
    Case("wendland_c2", 2.4, 12, ratios=COARSE),
    Case("wendland_c2", 4.0, 12, ratios=COARSE),
    Case("lucy", 3.0, 40, ratios=COARSE, dimension=2),
    Case("wendland_c2", 3.0, 40, ratios=COARSE, dimension=2),
)


def scene_of(case: Case) -> sdpd.Scene:
    """A fluid at rest on a lattice, without noise."""
    return sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(case.edge),) * case.dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel=case.kernel, support=case.support),
        effects=sdpd.Effects(fluctuations=False),
        sound_speed=SOUND_SPEED,
    )


def delivered(case: Case, scene: sdpd.Scene, ratio: float, axis: int, component: int) -> float:
    """Decay rate of one shear wave over that of the lattice sum."""
    k = np.zeros(case.dimension)
    k[axis] = 2.0 * math.pi * case.wave / case.edge
    rates = discretization.lattice_rates(
        case.kernel,
        case.dimension,
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


def partners(case: Case) -> float:
    """Effective number of partners of a particle: (sum g)^2 / sum g^2 on the lattice."""
    reach = np.arange(-math.ceil(case.support), math.ceil(case.support) + 1.0)
    offsets = np.stack(np.meshgrid(*[reach] * case.dimension), axis=-1)
    distance = np.linalg.norm(offsets.reshape(-1, case.dimension), axis=1)
    _, f = kernels.evaluate(case.kernel, case.dimension, distance[distance > 0.0], case.support)
    return float(f.sum() ** 2 / (f @ f))


def blocks_of(scene: sdpd.Scene) -> str:
    """Blocks of the sweep along the axes."""
    sim = sdpd.Simulation(scene, threads=1)
    return " x ".join(str(n) for n in sim.statistics()["blocks"])


def curve(case: Case) -> list[tuple[float, float]]:
    """Mean and standard error over directions of wave and velocity, for each dt/tau."""
    scene = scene_of(case)
    return [
        mean_and_error(delivered(case, scene, ratio, *direction) for direction in case.directions)
        for ratio in case.ratios
    ]


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("delivered_viscosity", __doc__, argv)
    curves, others, boxes = CURVES, OTHERS, BOXES
    if report.quick:
        curves = tuple(replace(case, edge=8, ratios=(0.9, 3.7)) for case in CURVES[:2])
        others, boxes = tuple(replace(case, edge=12) for case in OTHERS[-1:]), ()
    found = [curve(case) for case in curves]
    rows = [
        [f"{ratio:g}", *(shown(*results[n], digits=5) for results in found)]
        for n, ratio in enumerate(curves[0].ratios)
    ]
    rows.append(["$P$", *(_partners(case) for case in curves)])
    parts = [
        grid(["$\\Delta t/\\tau$", *(case.title for case in curves)], rows),
        "Delivered viscosity over the lattice sum at the same wave number [1]; kernels and "
        "$h/\\Delta x$ in the header, cubic lattices of "
        + ", ".join(f"{case.edge}³" for case in curves)
        + f" particles, one wavelength along an edge; mean over {len(curves[0].directions)} "
        "directions of wave and velocity, one standard error. "
        "$P=(\\sum g)^2/\\sum g^2$ is the effective number of partners of a particle.",
        "Other kernels, supports and dimensions:",
        _list(
            others, ["kernel", "$D$", "$P$"], lambda c: [c.title, f"{c.dimension}", _partners(c)]
        ),
    ]
    if boxes:
        header = ["particles", "waves along an edge", "blocks"]
        parts += [
            f"{boxes[0].title} in larger boxes, so in more blocks:",
            _list(boxes, header, lambda c: [f"{c.edge}³", f"{c.wave}", blocks_of(scene_of(c))]),
        ]
    report.document(*parts)
    _plot(report, curves, found)


def _partners(case: Case) -> str:
    return f"{partners(case):.1f}"


def _list(cases: Sequence[Case], header: list[str], begin: Callable[[Case], list[str]]) -> str:
    rows = []
    for case in cases:
        results = dict(zip(case.ratios, curve(case), strict=True))
        cells = [shown(*results[r], digits=5) if r in results else "" for r in COARSE]
        rows.append([*begin(case), *cells])
    return grid([*header, *(f"$\\Delta t/\\tau={r:g}$" for r in COARSE)], rows)


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
    axes.text(2.15, 0.05, r"bound $2\tau$", color="0.4", transform=axes.get_xaxis_transform())
    axes.set(xlabel=r"$\Delta t/\tau$", ylabel="delivered over exact viscosity")
    axes.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
