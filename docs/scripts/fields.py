"""Velocity field of a decaying Taylor-Green vortex with thermal noise, from an ensemble of runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, grid, reduced_fluid, shown, subplots

import sdpd
from sdpd import fields, kernels, plot
from sdpd.analysis import Estimate

ETA = 20.0
SPEED = 1.0  # of the vortex, that of thermal motion, a tenth of sound
SOUND_SPEED = 10.0
TIMES = (0.1, 0.2, 0.4, 0.6)


@dataclass(frozen=True)
class Case:
    """Size of the box and of the ensemble."""

    edge: int
    runs: int
    cells: int
    dt: float


def scene_of(case: Case) -> sdpd.Scene:
    """The fluid before the vortex."""
    return sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(case.edge),) * 2),
        resolution=sdpd.Resolution(spacing=1.0),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )


def vortex(points: np.ndarray, edge: float) -> np.ndarray:
    """(sin kx cos ky, -cos kx sin ky)."""
    x, y = 2.0 * np.pi / edge * points.T
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)], axis=1)


def simulate(
    case: Case, targets: Sequence[fields.Target], seed: int
) -> list[list[fields.FieldSet]]:
    """The velocity of one run at each time on each target."""
    sim = sdpd.Simulation(scene_of(case), seed=seed, threads=1, dt=case.dt)
    sim.run(time=1.0, progress=False)
    sim.velocities = sim.velocities + SPEED * vortex(sim.positions, float(case.edge))
    found = []
    for before, time in zip((0.0, *TIMES), TIMES, strict=False):
        sim.run(time=time - before, progress=False)
        found.append([fields.snapshot(sim, each, quantities="velocity") for each in targets])
    return found


def left_by_kernel(scene: sdpd.Scene) -> float:
    """Share of the wave that the averaging kernel, here that of the simulation, leaves."""
    k = np.sqrt(2.0) * 2.0 * np.pi / scene.box.lengths[0]
    kernel, length = scene.resolution.kernel, scene.support_radius
    return float(kernels.fourier_transform(kernel, 2, k * length))


def amplitude(field: fields.FieldSet, scene: sdpd.Scene) -> Estimate:
    """Of the vortex, from each component, what the kernel takes given back."""
    shape = vortex(field.target.points, scene.box.lengths[0])
    parts = [
        field.blocked(f"velocity_{axis}").derive(
            lambda mean, row=row: float(mean @ row / (row @ row))  # type: ignore[misc]
        )
        for axis, row in zip("xy", shape.T, strict=True)
    ]
    value = 0.5 * (parts[0].value + parts[1].value)
    error = 0.5 * float(np.hypot(parts[0].stderr, parts[1].stderr))
    left = left_by_kernel(scene)
    return Estimate(value / left, error / left, float(field.n_blocks))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("fields", __doc__, argv)
    case = Case(10, 3, 5, 0.02) if report.quick else Case(32, 64, 32, 0.01)
    scene = scene_of(case)
    edge = float(case.edge)
    targets = [
        fields.Grid.over(scene.box, (case.cells, case.cells)),
        fields.Line((edge / 4, 0.0), (edge / 4, edge), 17),
    ]
    runs = [simulate(case, targets, seed) for seed in range(1, case.runs + 1)]
    pooled = [
        [fields.ensemble([run[index][which] for run in runs]) for which in range(2)]
        for index in range(len(TIMES))
    ]
    decay = 2.0 * scene.fluid.kinematic_viscosity * (2.0 * np.pi / edge) ** 2
    found = [amplitude(on_grid, scene) for on_grid, _ in pooled]
    rows = []
    for time, one in zip(TIMES, found, strict=True):
        row = [f"{time:g}", f"{SPEED * np.exp(-decay * time):.4f}", shown(one.value, one.stderr)]
        if one.value > 3.0 * one.stderr:
            ratio = -np.log(one.value / SPEED) / (decay * time)
            row.append(shown(ratio, one.stderr / one.value / (decay * time), digits=3))
        else:
            row.append("")
        rows.append(row)
    header = ["$t$", "$U e^{-2\\nu k^2t}$", "amplitude", "$\\eta_\\mathrm{eff}/\\eta$ from it"]
    reach = pooled[0][0].particles_in_reach.mean()
    report.document(
        grid(header, rows),
        "Amplitude of the vortex $\\mathbf u = U(\\sin kx\\cos ky, -\\cos kx\\sin ky)$ in the "
        f"velocity field of {case.runs} runs, and the viscosity that its decay tells; one standard "
        f"error. $\\eta^*={ETA:g}$, $U/v_T={SPEED:g}$, $c/v_T={SOUND_SPEED:g}$, "
        f"$L/\\Delta x={edge:g}$, $l_d/\\Delta x={scene.support_radius:g}$: {reach:.1f} particles "
        f"in reach of a point, which leave {left_by_kernel(scene):.3f} of the wave; the amplitude "
        "is divided by that.",
    )
    _plot(report, scene, runs[0][1][0], pooled[1], found[1].value)


def _plot(
    report: Report,
    scene: sdpd.Scene,
    one: fields.FieldSet,
    pooled: Sequence[fields.FieldSet],
    size: float,
) -> None:
    figure, axes = subplots(3, width=9.6, height=3.0)
    on_grid, on_line = pooled
    titles = ("one run", f"mean of {on_grid.n_blocks} runs")
    for panel, field, title in zip(axes, (one, on_grid), titles, strict=False):
        plot.field_map(field["velocity"], axes=panel, cmap="Blues", vmin=0.0)
        plot.streamlines(field["velocity"], axes=panel, density=0.8)
        panel.grid(visible=False)
        panel.set_title(f"{title}, t = {TIMES[1]:g}", fontsize=8.5)

    def exact(y: np.ndarray) -> np.ndarray:
        edge = scene.box.lengths[0]
        points = np.stack([np.full_like(y, edge / 4), y], axis=1)
        return size * left_by_kernel(scene) * vortex(points, edge)[:, 0]

    line = on_line["velocity_x"]
    plot.profile(line, curve=exact, curve_label="fitted vortex", axes=axes[2], label="x = L/4")
    axes[2].legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
