"""Steady flow through a square array of cylinders against a Navier-Stokes solution (Yang 3.3)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from channel import delivered_viscosity
from report import Report, blocked, grid, shown, subplots

import sdpd
from sdpd import fields
from sdpd.theory import CylinderArrayFlow, cylinder_array_drag, cylinder_array_flow

LENGTH, RADIUS = 0.1, 0.02  # m
ACCELERATION, SOUND_SPEED = 1.5e-7, 1e-3  # m/s^2, m/s
FRACTION = math.pi * RADIUS**2 / LENGTH**2
WARM_UP, SAMPLED = 3000.0, 1000.0  # s; the flow comes to rest with a time of about 450 s
AVERAGED = 5e-3  # m, support of the averaging kernel
# name: ends in units of L, along and across the acceleration
LINES = {
    "C1, x = 0": ((0.0, 0.0), (0.0, 1.0)),
    "C2, x = L/2": ((0.5, 0.0), (0.5, 1.0)),
    "C3, z = L/2": ((0.0, 0.5), (1.0, 0.5)),
    "C4, z = 0": ((0.0, 0.0), (1.0, 0.0)),
}
POINTS = 41


def plane_scene(
    across: int,
    support: float,
    *,
    slower: float = 1.0,
    sound_speed: float = SOUND_SPEED,
    law: sdpd.eos.EquationOfState | None = None,
    lattice: bool = False,
) -> sdpd.Scene:
    """The problem in two dimensions; `slower` divides the force and c^2, so that Ma stays."""
    fluid = sdpd.fluids.water().in_plane(1.0)
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", sdpd.ResolutionWarning
        )  # h > R/5: what it costs is measured
        return sdpd.Scene(
            fluid=fluid if law is None else replace(fluid, equation_of_state=law),
            box=sdpd.Box((LENGTH, LENGTH)),
            walls=[sdpd.Cylinder(radius=RADIUS, centre=(LENGTH / 2, LENGTH / 2))],
            resolution=sdpd.Resolution(spacing=LENGTH / across, support=support),
            start=sdpd.LatticeStart() if lattice else sdpd.RandomStart(),
            effects=sdpd.Effects(fluctuations=False),
            body_force=sdpd.UniformForce((ACCELERATION / slower, 0.0)),
            sound_speed=sound_speed / math.sqrt(slower),
            velocity_scale=1.2e-4 / slower,
        )


def published_scene() -> sdpd.Scene:
    """The ready scene, three-dimensional, with as many particles as published."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)
        return sdpd.scenes.load("cylinder")


def reference(scene: sdpd.Scene, factor: float = 1.0) -> CylinderArrayFlow:
    """The flow of an incompressible fluid with `factor` times the viscosity."""
    return cylinder_array_flow(
        length=LENGTH,
        radius=RADIUS,
        acceleration=scene.body_force.acceleration[0],
        kinematic_viscosity=factor * scene.fluid.kinematic_viscosity,
        density=scene.nominal_density,
    )


@dataclass(frozen=True)
class Line:
    """V_x and P on a line: coordinate, measured with error, and the reference averaged alike."""

    place: np.ndarray
    velocity: np.ndarray
    velocity_error: np.ndarray
    expected_velocity: np.ndarray
    pressure: np.ndarray
    pressure_error: np.ndarray
    expected_pressure: np.ndarray


@dataclass(frozen=True)
class Flow:
    """What one run gives."""

    particles: int
    mean_velocity: float  # U over that of the reference
    mean_velocity_error: float
    delivered: float  # viscosity of the friction in this arrangement over that of the fluid
    at_delivered: float  # U over the reference with that viscosity
    drag: float  # force on the wall over that of the body force on all particles
    imbalance: float  # of momentum over the sampled time, over what the body force brought
    lines: dict[str, Line]
    sheet: fields.Field  # velocity in the middle plane, points in the cylinder included

    def deviations(self, name: str) -> tuple[float, float]:
        """rms and largest deviation of "velocity" or "pressure" on all lines over their range."""
        found = np.concatenate([getattr(line, name) for line in self.lines.values()])
        expected = np.concatenate(
            [getattr(line, f"expected_{name}") for line in self.lines.values()]
        )
        error = (found - expected) / np.ptp(expected)
        return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


def in_plane(scene: sdpd.Scene, positions: np.ndarray) -> np.ndarray:
    """Coordinates along and across the acceleration, from the axis of the cylinder."""
    return np.array(positions)[:, [0, scene.dimension - 1]] - 0.5 * LENGTH


def targets(scene: sdpd.Scene) -> dict[str, fields.Line]:
    """The four lines in the middle of the thin axis."""
    middle = () if scene.dimension == 2 else (0.5 * scene.box.lengths[1],)

    def place(end: tuple[float, float]) -> tuple[float, ...]:
        return (end[0] * LENGTH, *middle, end[1] * LENGTH)

    return {k: fields.Line(place(a), place(b), POINTS) for k, (a, b) in LINES.items()}


def middle_plane(scene: sdpd.Scene) -> fields.Target:
    """Points of the middle plane."""
    if scene.dimension == 2:
        return fields.Grid.over(scene.box, (64, 64))
    return fields.Plane.across(scene.box, "y", 0.5 * scene.box.lengths[1], (64, 64))


def measure(
    scene: sdpd.Scene, warm_up: float = WARM_UP, sampled: float = SAMPLED, threads: int = 1
) -> Flow:
    """Bring the flow to its steady state and average it."""
    exact = reference(scene)
    expected = (
        fields.Quantity(
            name="expected_velocity",
            values=lambda sim: exact.velocity(in_plane(scene, sim.positions))[:, 0],
        ),
        fields.Quantity(
            name="expected_pressure",
            values=lambda sim: exact.pressure(in_plane(scene, sim.positions)),
        ),
    )
    sim = sdpd.Simulation(scene, threads=threads)
    sim.run(time=warm_up, progress=False)
    mass = scene.particle_mass * sim.n_particles
    before, start = sim.momentum[0], sim.time
    thermo, forces = sdpd.Thermodynamics(every=5), sdpd.WallForces(every=1)
    averages = {
        name: sdpd.FieldAverage(
            line,
            quantities=("velocity", "pressure", *expected),
            every=10,
            length=AVERAGED,
            n_blocks=8,
        )
        for name, line in targets(scene).items()
    }
    sheet = sdpd.FieldAverage(
        middle_plane(scene), quantities="velocity", every=10, length=AVERAGED, n_blocks=2
    )
    sim.run(time=sampled, progress=False, observe=[thermo, forces, sheet, *averages.values()])
    drive = mass * scene.body_force.acceleration[0]
    on_wall = forces.force[:, 0, 0]
    gained = sim.momentum[0] - before + (on_wall * np.diff(forces.time, prepend=start)).sum()
    brought = drive * (sim.time - start)
    level = float(thermo["mean_pressure"].mean())
    lines = {}
    for name, average in averages.items():
        found, line = average.result, targets(scene)[name]
        outside = np.hypot(*in_plane(scene, line.points).T) > RADIUS * (1.0 - 1e-9)
        lines[name] = _line(found, line, outside, level)
    mean, error = blocked(thermo["momentum_x"] / mass * (1.0 - FRACTION), 8)
    inner = np.hypot(*in_plane(scene, sim.positions).T) > RADIUS + scene.support_radius
    delivered = delivered_viscosity(sim, inner)
    return Flow(
        particles=sim.n_particles,
        mean_velocity=mean / exact.mean_velocity,
        mean_velocity_error=error / exact.mean_velocity,
        delivered=delivered,
        at_delivered=mean / reference(scene, delivered).mean_velocity,
        drag=float(on_wall.mean() / drive),
        imbalance=abs(gained / brought - 1.0),
        lines=lines,
        sheet=sheet["velocity"],
    )


def _line(found: fields.FieldSet, line: fields.Line, outside: np.ndarray, level: float) -> Line:
    velocity, pressure = found["velocity_x"], found["pressure"]
    return Line(
        place=line.axes[0][1][outside] / LENGTH,
        velocity=velocity.mean[outside],
        velocity_error=velocity.stderr[outside],
        expected_velocity=found["expected_velocity"].mean[outside],
        pressure=pressure.mean[outside] - level,
        pressure_error=pressure.stderr[outside],
        expected_pressure=found["expected_pressure"].mean[outside],
    )


FINEST = (102, 5.0)
SLOWER = 20.0  # Re = 0.05


def main(argv: Sequence[str] | None = None) -> None:
    """Write tables and figure."""
    report = Report.from_arguments("cylinder", __doc__, argv)
    across, support = (30, 4.0) if report.quick else FINEST
    times = (300.0, 200.0) if report.quick else (WARM_UP, SAMPLED)
    plane = measure(plane_scene(across, support), *times)
    slow = measure(plane_scene(30 if report.quick else 51, support, slower=SLOWER), *times)
    rows = {
        f"two dimensions, $h/\\Delta x={support:g}$": plane,
        f"two dimensions, $h/\\Delta x={support:g}$, Re = 0.05": slow,
    }
    if not report.quick:
        rows = {"as published, $h/\\Delta x=3.8$": measure(published_scene()), **rows}
    shown_first = next(iter(rows.values()))
    report.document(
        grid(HEADER, [row(name, flow) for name, flow in rows.items()]),
        "Mean velocity over that of the Navier-Stokes solution, with the standard error of its "
        "fluctuations in time; viscosity of the friction in the arrangement that flows, and the "
        "mean velocity over the solution with that viscosity; force on the wall over the body "
        "force on all particles; rms (largest) deviation on the four lines over the range of the "
        "solution.",
        f"At Re = 0.05 the drag is $F/\\eta U={slow_drag(slow):.2f}$, by the series of Sangani and "
        f"Acrivos {cylinder_array_drag(FRACTION):.2f}.",
        grid(LEVELS_HEADER, levels(report.quick, *times)),
        "Mean velocity in two dimensions, 51 across, by what decides the order of the particles "
        "and the level of their pressure; Y 2.52 is "
        "$P=\\rho_0c^2/2\\,((\\rho/\\rho_0)^2-1)$ with $\\rho_0=1000$ kg/m³ unless given.",
    )
    _plot(report, shown_first)


HEADER = (
    "case", "particles", "$U/U_\\mathrm{ref}$", "delivered $\\eta$", "$U$ at that", "drag",
    "$V_x$ on lines", "$P$ on lines",
)  # fmt: skip
LEVELS_HEADER = ("start", "$h/\\Delta x$", "c (m/s)", "equation of state", "$U/U_\\mathrm{ref}$")


def row(name: str, flow: Flow) -> list[str]:
    """A run in the table."""
    velocity, pressure = flow.deviations("velocity"), flow.deviations("pressure")
    return [
        name,
        f"{flow.particles}",
        shown(flow.mean_velocity, flow.mean_velocity_error),
        f"{flow.delivered:.3f}",
        f"{flow.at_delivered:.3f}",
        f"{flow.drag:.3f}",
        f"{velocity[0]:.1%} ({velocity[1]:.1%})",
        f"{pressure[0]:.1%} ({pressure[1]:.1%})",
    ]


def slow_drag(flow: Flow) -> float:
    """F/(eta U) with F = rho f L^2, of the run at a small Reynolds number."""
    exact = reference(plane_scene(30, 4.0, slower=SLOWER))
    force = ACCELERATION / SLOWER * LENGTH**2
    return force / (exact.kinematic_viscosity * flow.mean_velocity * exact.mean_velocity)


def levels(quick: bool, warm_up: float, sampled: float) -> list[list[str]]:
    """How start, support, stiffness and pressure level change the mean velocity."""
    usual = sdpd.eos.ArtificialCompressibility()
    higher, lower = (
        sdpd.eos.ArtificialCompressibility(reference_density=x) for x in (990.0, 1010.0)
    )
    cases = [
        ("random", 3.8, 1e-3, usual, "Y 2.52"),
        ("lattice", 3.8, 1e-3, usual, "Y 2.52"),
        ("random", 3.0, 1e-3, usual, "Y 2.52"),
        ("random", 3.8, 5e-4, usual, "Y 2.52"),
        ("random", 3.8, 2e-3, usual, "Y 2.52"),
        ("random", 3.8, 1e-3, higher, "Y 2.52, $\\rho_0=990$"),
        ("random", 3.8, 1e-3, lower, "Y 2.52, $\\rho_0=1010$"),
        ("random", 3.8, 1e-3, sdpd.eos.IdealGas(), "$P=c^2\\rho$"),
    ]
    table = []
    for start, support, c, law, name in cases[: 1 if quick else None]:
        across = 30 if quick else 51
        scene = plane_scene(across, support, sound_speed=c, law=law, lattice=start == "lattice")
        flow = measure(scene, warm_up, sampled)
        ratio = shown(flow.mean_velocity, flow.mean_velocity_error)
        table.append([start, f"{support:g}", f"{c:g}", name, ratio])
    return table


def _plot(report: Report, flow: Flow) -> None:
    import matplotlib.pyplot as plt

    figure, axes = subplots(2, width=7.2, height=3.3)
    colours = ("#4269d0", "#ff725c", "#3ca951", "#9c6b4e")
    for (name, line), colour in zip(flow.lines.items(), colours, strict=True):
        for ax, kind, unit in ((axes[0], "velocity", 1e6), (axes[1], "pressure", 1e6)):
            expected = unit * getattr(line, f"expected_{kind}")
            place = line.place.copy()
            gap = np.flatnonzero(np.diff(place) > 0.1)  # the cylinder
            parts = np.split(np.arange(len(place)), gap + 1)
            for part in parts:
                ax.plot(place[part], expected[part], color=colour, linewidth=1.1)
            ax.errorbar(
                place,
                unit * getattr(line, kind),
                unit * getattr(line, f"{kind}_error"),
                color=colour,
                linestyle="",
                marker="o",
                markersize=2.5,
                elinewidth=0.7,
            )
        axes[0].plot([], [], color=colour, label=name)
    axes[0].set(xlabel="x/L or z/L", ylabel="$V_x$ (μm/s)")
    axes[1].set(xlabel="x/L or z/L", ylabel="$P$ (μPa)")
    axes[0].legend(fontsize=7)
    report.figure(figure)
    figure, ax = subplots(1, width=4.4, height=3.6)
    sdpd.plot.field_map(flow.sheet, component=0, axes=ax, cmap="viridis")
    sdpd.plot.streamlines(flow.sheet, axes=ax, color="white", density=0.9)
    ax.add_patch(plt.Circle((0.5 * LENGTH, 0.5 * LENGTH), RADIUS, color="0.6", zorder=5))
    ax.grid(False)
    report.figure(figure, "map")


if __name__ == "__main__":
    main()
