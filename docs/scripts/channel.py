"""Transient flow between plates without noise, as published, against the closed forms.

What `poiseuille.py` and `couette.py` share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, grid, subplots
from scipy.spatial import cKDTree

import sdpd
from sdpd.theory import couette_velocity, poiseuille_velocity

WIDTH = 1e-3  # m
ACCELERATION = 1e-4  # m/s^2
TOP = 1.25e-5  # m/s, steady maximum and speed of the moving plate
TIMES = (0.05, 0.1, 0.2, 0.5, 1.0)  # s
# h/dx and particles across: at a fixed h/dx the viscosity of the lattice sum is a floor
REFINEMENT = ((2.64, 16), (3.3, 32), (4.0, 64))


@dataclass(frozen=True)
class Moment:
    """A transient profile: time, places and velocities, and their errors over the maximum."""

    time: float
    z: np.ndarray
    velocity: np.ndarray
    rms: float
    largest: float
    density: float


def thin_scene(kind: str, particles: int, support: float, *, calibrate: bool = False) -> sdpd.Scene:
    """The published problem in two dimensions, as wide as its supports need."""
    columns = int(np.ceil(2.0 * support)) + 1
    box = sdpd.Box((columns * WIDTH / particles, WIDTH), periodic="x")
    moving = (TOP, 0.0) if kind == "couette" else None
    return sdpd.Scene(
        fluid=sdpd.fluids.water().in_plane(1e-4),
        box=box,
        walls=sdpd.walls.slab(box, "y", upper_velocity=moving),
        resolution=sdpd.Resolution(particles=(columns, particles), support=support),
        calibrate=calibrate,
        effects=sdpd.Effects(fluctuations=False),
        body_force=sdpd.UniformForce((ACCELERATION, 0.0)) if kind == "poiseuille" else None,
        sound_speed=1.25e-4,
    )


def exact(kind: str, scene: sdpd.Scene, z: np.ndarray, time: float, factor: float) -> np.ndarray:
    """Closed form with `factor` times the viscosity of the fluid."""
    nu = factor * scene.fluid.kinematic_viscosity
    if kind == "poiseuille":
        return poiseuille_velocity(
            z, time, acceleration=ACCELERATION, kinematic_viscosity=nu, width=WIDTH
        )
    return couette_velocity(z, time, wall_velocity=TOP, kinematic_viscosity=nu, width=WIDTH)


def flow(
    kind: str,
    scene: sdpd.Scene,
    times: Sequence[float] = TIMES,
    *,
    factor: float = 1.0,
    dt: float | str = "auto",
) -> list[Moment]:
    """Run from rest; errors over the steady maximum at all particles."""
    sim = sdpd.Simulation(scene, dt=dt, threads=1)
    found = []
    for time in times:
        sim.run(time=time - sim.time, progress=False)
        z, v = np.array(sim.positions[:, -1]), np.array(sim.velocities[:, 0])
        error = (v - exact(kind, scene, z, sim.time, factor)) / TOP
        bulk = np.abs(sim.densities / scene.fluid.density - 1.0).max()
        rms, largest = float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
        found.append(Moment(sim.time, z, v, rms, largest, float(bulk)))
    return found


def delivered_viscosity(sim: sdpd.Simulation, inner: np.ndarray) -> float:
    """Viscosity of the friction between particles, over that of the fluid, where `inner` is true.

    eta = n/2 <sum_j F_ij r_ij^2/(d_i d_j)> (a/D + b/(D (D + 2))): what this arrangement answers to
    an affine shear, averaged over directions. Give it particles a support away from walls.
    """
    scene, h, d = sim.scene, sim.scene.support_radius, sim.scene.dimension
    positions = np.array(sim.positions)
    edges = [
        edge if axis in scene.box.periodic_axes else 2.0 * edge
        for axis, edge in zip("xyz", scene.box.lengths, strict=False)
    ]
    pairs = cKDTree(positions, boxsize=edges).query_pairs(h, output_type="ndarray")
    r = positions[pairs[:, 0]] - positions[pairs[:, 1]]
    r -= np.rint(r / edges) * edges
    square = (r**2).sum(axis=1)
    _, slope = sdpd.kernels.evaluate(scene.resolution.kernel, d, np.sqrt(square), h)
    term = slope * square / np.array(sim.number_densities)[pairs].prod(axis=1)
    total = np.bincount(pairs.ravel(), np.repeat(term, 2), sim.n_particles)[inner].mean()
    share = scene.friction_across / d + scene.friction_along / (d * (d + 2.0))
    density = scene.nominal_density / scene.particle_mass
    return float(0.5 * density * total * share / scene.fluid.shear_viscosity)


def main(kind: str, text: str | None, argv: Sequence[str] | None) -> None:
    """Write table and figure of one flow."""
    report = Report.from_arguments(kind, text, argv)
    if report.quick:
        full, name = thin_scene(kind, 16, 3.0, calibrate=True), "two dimensions, 16 across"
    else:
        full, name = sdpd.scenes.load(kind), "as published, three dimensions, 31 across"
    moments = flow(kind, full)
    plain = flow(kind, full.replace(calibrate=False))
    rows = [
        [
            f"{a.time:.2f} s",
            f"{a.rms:.3%}",
            f"{a.largest:.3%}",
            f"{a.density:.1e}",
            f"{b.rms:.3%}",
        ]
        for a, b in zip(moments, plain, strict=True)
    ]
    header = ["time", "rms error", "largest error", "density error", "rms error, not calibrated"]
    steps = [
        [f"{support:g}", f"{n}", *(f"{moment.rms:.3%}" for moment in refined)]
        for support, n in REFINEMENT[: 1 if report.quick else 3]
        for refined in [flow(kind, thin_scene(kind, n, support))]
    ]
    columns = ["h/dx", "across", *(f"{time:g} s" for time in TIMES)]
    report.document(
        grid(header, rows),
        f"Errors of the velocity over the steady maximum at all {full.n_particles} particles "
        f"({name}), Wendland C2, $h/\\Delta x=3$, no noise; largest relative error of the density. "
        f"The lattice delivers $\\eta_\\mathrm{{eff}}/\\eta={full.factors.viscosity:.4f}$, which "
        "`calibrate=True` divides out.",
        grid(columns, steps),
        "rms error over the steady maximum as support and spacing are refined together: two "
        "dimensions, not calibrated.",
    )
    _plot(report, kind, full, moments)


def _plot(report: Report, kind: str, scene: sdpd.Scene, moments: list[Moment]) -> None:
    figure, axes = subplots(2, width=7.2, height=3.2)
    z = np.linspace(0.0, WIDTH, 300)
    colours = ("#4269d0", "#3ca951", "#ff725c", "#9c6b4e", "#a463f2")
    for moment, colour in zip(moments, colours, strict=True):
        line = exact(kind, scene, z, moment.time, 1.0)
        axes[0].plot(1e3 * z, 1e6 * line, color=colour, linewidth=1.0)
        axes[0].plot(1e3 * moment.z, 1e6 * moment.velocity, ".", color=colour, markersize=2.5)
        axes[0].plot([], [], color=colour, label=f"{moment.time:g} s")
        error = moment.velocity - exact(kind, scene, moment.z, moment.time, 1.0)
        axes[1].plot(1e3 * moment.z, 100.0 * error / TOP, ".", color=colour, markersize=2.5)
    axes[0].set(xlabel="z (mm)", ylabel="velocity (μm/s)")
    axes[1].set(xlabel="z (mm)", ylabel="error (% of the steady maximum)")
    axes[0].legend()
    report.figure(figure)
