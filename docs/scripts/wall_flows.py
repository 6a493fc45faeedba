"""Steady and oscillating flows along walls without noise, against their closed forms."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from channel import delivered_viscosity
from report import Report, grid, subplots

import sdpd
from sdpd.theory import (
    duct_velocity,
    oscillating_plate_velocity,
    pipe_velocity,
    taylor_couette_torque,
    taylor_couette_velocity,
)

SIZE = 1e-3  # m: edge of the duct, diameter of the pipe, radius of the outer cylinder, channel
ACCELERATION, SOUND_SPEED = 1e-4, 1.25e-4  # m/s^2, m/s: of Yang's Poiseuille flow
TOP = 1.25e-5  # m/s, speed of walls
SUPPORT = 3.0


@dataclass(frozen=True)
class Profile:
    """Velocities of particles at a coordinate, the closed form there, and the scale of errors.

    `layer` tells apart particles of different curves.
    """

    place: np.ndarray
    velocity: np.ndarray
    expected: np.ndarray
    largest: float
    layer: np.ndarray | int = 0

    @property
    def rms(self) -> float:
        """rms error over the largest velocity."""
        return float(np.sqrt(np.mean((self.velocity - self.expected) ** 2)) / self.largest)

    @property
    def worst(self) -> float:
        """Largest error over the largest velocity."""
        return float(np.abs(self.velocity - self.expected).max() / self.largest)


@dataclass(frozen=True)
class Result:
    """A steady flow: its profile, delivered viscosity, and integral quantities over the exact."""

    particles: int
    profile: Profile
    delivered: float
    integrals: dict[str, float]


def _scene(box: sdpd.Box, walls: Sequence[sdpd.walls.Wall], **options: object) -> sdpd.Scene:
    fluid = sdpd.fluids.water()
    arguments = {"effects": sdpd.Effects(fluctuations=False), "sound_speed": SOUND_SPEED}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)  # the coarse circles: h > R/5
        return sdpd.Scene(
            fluid=fluid if box.dimension == 3 else fluid.in_plane(1e-4),
            box=box,
            walls=walls,
            **{**arguments, **options},
        )


def duct(across: int) -> Result:
    """A square duct along x, at rest until the force starts."""
    spacing = SIZE / across
    columns = math.ceil(2.0 * SUPPORT)
    box = sdpd.Box((columns * spacing, SIZE, SIZE), periodic="x")
    scene = _scene(
        box,
        sdpd.walls.enclosure(box),
        resolution=sdpd.Resolution(particles=(columns, across, across), support=SUPPORT),
        calibrate=True,
        body_force=sdpd.UniformForce((ACCELERATION, 0.0, 0.0)),
    )
    sim = sdpd.Simulation(scene, threads=1)
    sim.run(time=0.5, progress=False)  # ten times the slowest mode's L^2/(2 pi^2 nu)
    forces = sdpd.WallForces(every=20)
    sim.run(steps=20, progress=False, observe=forces)
    y, z = np.array(sim.positions)[:, 1:].T
    options = {
        "acceleration": ACCELERATION,
        "kinematic_viscosity": scene.fluid.kinematic_viscosity,
        "width": SIZE,
        "height": SIZE,
    }
    exact = duct_velocity(y, z, **options)
    v = np.array(sim.velocities[:, 0])
    centre = float(duct_velocity(0.5 * SIZE, 0.5 * SIZE, **options))
    grid_points = (np.arange(200) + 0.5) / 200 * SIZE
    mean = float(duct_velocity(grid_points[:, None], grid_points, **options).mean())
    drive = scene.particle_mass * sim.n_particles * ACCELERATION
    return Result(
        sim.n_particles,
        Profile(z, v, exact, centre, np.floor(y / spacing).astype(int)),
        delivered_viscosity(sim, _inner(sim)),
        {
            "mean velocity": float(v.mean()) / mean,
            "drag of four walls": float(forces.force[0, :, 0].sum() / drive),
        },
    )


def pipe(across: int) -> Result:
    """A round pipe along x."""
    spacing, radius = SIZE / across, 0.5 * SIZE
    box = sdpd.Box((2.0 * SUPPORT * spacing * 1.02, SIZE, SIZE), periodic="x")
    wall = sdpd.Cylinder(radius=radius, centre=(0.0, radius, radius), axis="x", fluid="inside")
    scene = _scene(
        box,
        [wall],
        resolution=sdpd.Resolution(spacing=spacing, support=SUPPORT),
        start=sdpd.RandomStart(),
        body_force=sdpd.UniformForce((ACCELERATION, 0.0, 0.0)),
    )
    sim = sdpd.Simulation(scene, threads=1)
    sim.run(time=0.5, progress=False)  # eleven times R^2/(5.78 nu)
    forces = sdpd.WallForces(every=20)
    sim.run(steps=20, progress=False, observe=forces)
    r = np.hypot(*(np.array(sim.positions)[:, 1:] - radius).T)
    options = {
        "acceleration": ACCELERATION,
        "kinematic_viscosity": scene.fluid.kinematic_viscosity,
        "radius": radius,
    }
    exact = pipe_velocity(r, **options)
    v = np.array(sim.velocities[:, 0])
    centre = float(pipe_velocity(0.0, **options))
    drive = scene.particle_mass * sim.n_particles * ACCELERATION
    return Result(
        sim.n_particles,
        Profile(r, v, exact, centre),
        delivered_viscosity(sim, _inner(sim)),
        {
            "mean velocity": float(v.mean()) / (0.5 * centre),
            "drag of the wall": float(forces.force[0, 0, 0] / drive),
        },
    )


def taylor_couette(across: int, *, central: bool = True) -> Result:
    """A turning circle inside one at rest of twice its radius; friction is central."""
    inner, outer, support = 0.5 * SIZE, SIZE, 4.0
    omega = TOP / inner
    box = sdpd.Box((2.0 * outer, 2.0 * outer), periodic="")
    centre = (outer, outer)
    walls = (
        sdpd.Cylinder(radius=inner, centre=centre, angular_velocity=omega),
        sdpd.Cylinder(radius=outer, centre=centre, fluid="inside"),
    )
    scene = _scene(
        box,
        walls,
        resolution=sdpd.Resolution(spacing=2.0 * outer / across, support=support),
        start=sdpd.RandomStart(),
        effects=sdpd.Effects(fluctuations=False, central_friction=central),
    )
    sim = sdpd.Simulation(scene, threads=1)
    sim.run(time=0.4, progress=False)  # sixteen times gap^2/(pi^2 nu)
    forces = sdpd.WallForces(every=10)
    sim.run(time=0.1, progress=False, observe=forces)
    r = np.array(sim.positions) - outer
    radius, v = np.linalg.norm(r, axis=1), np.array(sim.velocities)
    turning = (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]) / radius
    cell = {"inner_radius": inner, "outer_radius": outer, "inner_angular_velocity": omega}
    torque = taylor_couette_torque(shear_viscosity=scene.fluid.shear_viscosity, **cell)
    on_inner, on_outer = forces.torque[:, :, 2].mean(axis=0) / torque
    return Result(
        sim.n_particles,
        Profile(radius, turning, taylor_couette_velocity(radius, **cell), TOP),
        delivered_viscosity(sim, _inner(sim)),
        {"torque, inner": float(-on_inner), "torque, outer": float(on_outer)},
    )


def _inner(sim: sdpd.Simulation) -> np.ndarray:
    """Particles more than a support away from every wall."""
    scene, positions = sim.scene, np.array(sim.positions)
    distance = [wall.distance(positions, scene.box) for wall in scene.walls]
    return np.min(distance, axis=0) > scene.support_radius


@dataclass(frozen=True)
class Oscillation:
    """Profiles at eight phases, and the stress on the plate over the closed form's."""

    particles: int
    profiles: dict[float, Profile]
    amplitude: float
    phase: float  # of the stress, less that of the closed form, in degrees

    @property
    def rms(self) -> float:
        """rms error over the speed of the plate, at all phases."""
        return float(np.sqrt(np.mean([p.rms**2 for p in self.profiles.values()])))


def oscillating_plate(across: int, support: float) -> Oscillation:
    """Stokes' plate and, five penetration depths away, one at rest; it is set at each step."""
    columns = math.ceil(2.0 * support)
    box = sdpd.Box((columns * SIZE / across, SIZE), periodic="x")
    scene = _scene(
        box,
        sdpd.walls.slab(box, "y"),
        resolution=sdpd.Resolution(particles=(columns, across), support=support),
        calibrate=True,
        velocity_scale=TOP,
    )
    nu = scene.fluid.kinematic_viscosity
    omega = 2.0 * nu / (0.2 * SIZE) ** 2
    period = 2.0 * math.pi / omega
    plate = {
        "amplitude": TOP,
        "angular_frequency": omega,
        "kinematic_viscosity": nu,
        "width": SIZE,
    }
    steps = 16 * math.ceil(period / sdpd.Simulation(scene).dt / 16)
    dt = period / steps
    sim = sdpd.Simulation(scene, dt=dt, threads=1)
    # from the periodic state itself: nothing to wait for
    sim.velocities[:, 0] = oscillating_plate_velocity(sim.positions[:, 1], 0.0, **plate)

    def follow(s: sdpd.Simulation) -> None:
        # the velocity in the middle of the step to come: second order in dt
        speed = TOP * math.cos(omega * (s.time + 0.5 * dt))
        s.set_wall_velocity(0, (speed, 0.0))

    forces, profiles = sdpd.WallForces(every=1), {}
    follow(sim)
    for k in range(16):
        sim.run(steps=steps // 8, every=1, callback=follow, progress=False, observe=forces)
        if k >= 8:
            z = np.array(sim.positions[:, 1])
            exact = oscillating_plate_velocity(z, sim.time, **plate)
            profile = Profile(z, np.array(sim.velocities[:, 0]), exact, TOP)
            profiles[(k - 7) / 8.0] = profile
    # complex amplitude over the second period, at the middles of the steps
    time = forces.time[steps:] - 0.5 * dt
    found = 2.0 * np.mean(forces.stress[steps:, 0, 0] * np.exp(-1j * omega * time))
    k = np.sqrt(1j * omega / nu)
    expected = -scene.fluid.shear_viscosity * TOP * k / np.tanh(k * SIZE)
    ratio = found / expected
    return Oscillation(sim.n_particles, profiles, abs(ratio), math.degrees(np.angle(ratio)))


@dataclass(frozen=True)
class Plug:
    """Free-slip flow with noise: change of momentum over its value, and how flat it stays."""

    particles: int
    steps: int
    momentum_change: float
    quiet_spread: float  # largest deviation of a velocity without noise, over the velocity
    z: np.ndarray  # of the profile with noise, in standard errors


def plug_flow(steps: int) -> Plug:
    """Water between slipping plates that moves as a whole."""
    box = sdpd.Box((5e-4, 3e-4, SIZE), periodic="xy")
    walls = [
        sdpd.Plane(axis="z", at=0.0, slip=True),
        sdpd.Plane(axis="z", at=SIZE, slip=True),
    ]
    resolution = sdpd.Resolution(particles=(10, 6, 20), support=SUPPORT)
    quiet = sdpd.Simulation(_scene(box, walls, resolution=resolution), threads=1)
    quiet.velocities[:, 0] = TOP
    quiet.run(steps=steps, progress=False)
    scene = _scene(box, walls, resolution=resolution, effects=sdpd.Effects())
    noisy = sdpd.Simulation(scene, seed=1, threads=1)
    noisy.velocities[:, 0] += TOP - noisy.velocities[:, 0].mean()
    noisy.refresh()
    before = noisy.momentum[0]
    profile = sdpd.Profile(axis="z", bins=10, every=5, samples_per_block=max(1, steps // 160))
    noisy.run(steps=steps, progress=False, observe=profile)
    z = (profile.velocity[:, 0] - TOP) / profile.error("velocity")[:, 0]
    return Plug(
        noisy.n_particles,
        steps,
        float(abs(noisy.momentum[0] / before - 1.0)),
        float(np.abs(quiet.velocities[:, 0] / TOP - 1.0).max()),
        z,
    )


def main(argv: Sequence[str] | None = None) -> None:
    """Write table and figure."""
    report = Report.from_arguments("wall_flows", __doc__, argv)
    quick = report.quick
    flows = {
        "square duct": duct(10 if quick else 24),
        "round pipe": pipe(18 if quick else 31),
        **{
            f"Taylor–Couette, {n} across": taylor_couette(n) for n in ((41,) if quick else (41, 81))
        },
    }
    if not quick:
        flows["the same, general friction"] = taylor_couette(81, central=False)
    plate = oscillating_plate(16 if quick else 48, 3.0 if quick else 3.6)
    plug = plug_flow(320)
    rows = [
        [
            name,
            f"{flow.particles}",
            f"{flow.profile.rms:.2%}",
            f"{flow.profile.worst:.2%}",
            f"{flow.delivered:.3f}",
            ", ".join(f"{kind} {value:.4f}" for kind, value in flow.integrals.items()),
        ]
        for name, flow in flows.items()
    ]
    last = f"amplitude of the stress {plate.amplitude:.4f}, its phase off by {plate.phase:+.2f}°"
    worst = max(p.worst for p in plate.profiles.values())
    rows.append(
        ["oscillating plate", f"{plate.particles}", f"{plate.rms:.2%}", f"{worst:.2%}", "", last]
    )
    header = ("flow", "particles", "rms error", "largest", "delivered $\\eta$", "over closed form")
    report.document(
        grid(header, rows),
        "Errors of the velocities of all particles over the largest velocity of the closed form; "
        "viscosity of the friction in the arrangement of the particles over that of the fluid; "
        "integral quantities over those of the closed form.",
        f"Plug flow between slipping plates: over {plug.steps} steps with noise the momentum of "
        f"{plug.particles} particles changes by {plug.momentum_change:.0e} of its value; without "
        f"noise velocities stay within {plug.quiet_spread:.0e}.",
    )
    _plot(report, flows, plate)


def _plot(report: Report, flows: dict[str, Result], plate: Oscillation) -> None:
    figure, axes = subplots(4, width=10.0, height=2.8)
    labels = {"square duct": "z (mm), by layer in y", "round pipe": "r (mm)"}
    circles = [name for name in flows if name.endswith("across")][-1]
    for ax, name in zip(axes, ("square duct", "round pipe", circles), strict=False):
        profile = flows[name].profile
        layers = np.broadcast_to(profile.layer, profile.place.shape)
        for layer in np.unique(layers)[: (len(np.unique(layers)) + 1) // 2]:
            order = np.flatnonzero(layers == layer)
            order = order[np.argsort(profile.place[order])]
            place = 1e3 * profile.place[order]
            few = slice(None, None, max(1, len(order) // 500))
            dots = 1e6 * profile.velocity[order][few]
            ax.plot(place[few], dots, ".", color="#4269d0", markersize=3)
            ax.plot(place, 1e6 * profile.expected[order], color="#ff725c", linewidth=0.9)
        ax.set(title=name, xlabel=labels.get(name, "r (mm)"))
    for phase, profile in list(plate.profiles.items())[::2]:
        order = np.argsort(profile.place)
        place = 1e3 * profile.place[order]
        axes[3].plot(place, 1e6 * profile.velocity[order], ".", color="#4269d0", markersize=2)
        axes[3].plot(place, 1e6 * profile.expected[order], color="#ff725c", linewidth=0.9)
        axes[3].annotate(f"{phase:g}", (0.0, 1e6 * profile.expected[order][0]), fontsize=6)
    axes[3].set(title="oscillating plate", xlabel="z (mm)")
    axes[0].set_ylabel("velocity (μm/s)")
    axes[2].plot([], [], ".", color="#4269d0", label="particles")
    axes[2].plot([], [], color="#ff725c", label="closed form")
    axes[2].legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
