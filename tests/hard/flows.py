"""Hard cases of flows: jets, shocks, a wake, and a vortex until next to nothing is left of it."""

from __future__ import annotations

import math

import numpy as np

import sdpd

from .case import Found, case, plain_fluid, simulation
from .particles import outside

SILENT = sdpd.Effects(fluctuations=False)


def energy_rise(series: list[float]) -> float:
    """Largest rise of an energy above an earlier value, over the first one."""
    values = np.array(series)
    return float((values - np.minimum.accumulate(values)).max() / values[0])


@case("jet_onto_a_wall")
def jet_onto_a_wall(full: bool) -> Found:
    """Half of the fluid flies at Ma = .5 onto a slippery wall, which takes no momentum along it."""
    edge, steps = (64, 6000) if full else (24, 500)
    box = sdpd.Box((float(edge),) * 2, periodic="x")
    scene = sdpd.Scene(
        fluid=plain_fluid(0.5),
        box=box,
        walls=tuple(sdpd.Plane(axis="y", at=at, slip=True) for at in (0.0, float(edge))),
        resolution=sdpd.Resolution(spacing=1.0),
        sound_speed=10.0,
        velocity_scale=5.0,
        effects=SILENT,
    )
    sim = simulation(scene, dt="adaptive")
    middle = np.abs(sim.positions[:, 0] - 0.5 * edge) < 0.25 * edge
    sim.velocities[middle, 1] = -5.0
    mass = float(sim.densities.sum())
    energy = [sim.total_energy]
    densest, momentum = 0.0, 0.0

    def look(s: sdpd.Simulation) -> None:
        nonlocal densest, momentum
        energy.append(s.total_energy)
        densest = max(densest, float(s.densities.max()))
        momentum = max(momentum, abs(float(s.momentum[0])))

    # potential energy is that of P = c^2 rho from any zero: take the start's off
    sim.run(steps, callback=look, every=10, progress=False)
    kinetic = 0.5 * 25.0 * middle.sum()
    shifted = [value - energy[0] + kinetic for value in energy]
    numbers = {
        "energy_rise": energy_rise(shifted),
        "momentum_along": momentum / (5.0 * float(middle.sum())),
        "outside": outside(sim),
        "densest": densest,
        "kinetic_left": float(sim.kinetic_energy / kinetic),
        "mean_density": mass / len(sim),
    }
    return Found(scene.n_particles, steps, numbers)


@case("compression_and_rarefaction")
def compression_and_rarefaction(full: bool) -> Found:
    """A velocity wave at Ma = 1.5 drives the fluid together in one place and apart in the other."""
    length, width, steps = (160, 16, 3000) if full else (48, 8, 300)
    scene = sdpd.Scene(
        fluid=plain_fluid(2.0),
        box=sdpd.Box((float(length), float(width))),
        resolution=sdpd.Resolution(spacing=1.0),
        sound_speed=10.0,
        velocity_scale=15.0,
        effects=SILENT,
    )
    sim = simulation(scene, dt="adaptive")
    sim.velocities[:, 0] = 15.0 * np.sin(2.0 * math.pi * sim.positions[:, 0] / length)
    kinetic, first = sim.kinetic_energy, sim.total_energy
    energy, low, high, smallest = [kinetic], 1.0, 1.0, sim.dt

    def look(s: sdpd.Simulation) -> None:
        nonlocal low, high, smallest
        smallest = min(smallest, s.dt)
        energy.append(s.total_energy - first + kinetic)
        low, high = min(low, float(s.densities.min())), max(high, float(s.densities.max()))

    sim.run(steps, callback=look, every=10, progress=False)
    numbers = {
        "energy_rise": energy_rise(energy),
        "momentum": float(np.abs(sim.momentum).max()) / (15.0 * len(sim)),
        "least_density": low,
        "largest_density": high,
        "smallest_dt_over_auto": smallest / sim.bounds[0].value,
    }
    return Found(scene.n_particles, steps, numbers)


FALL = 1e4  # of the energy of the vortex


def _vortex(edge: int, reynolds: float) -> tuple[sdpd.Simulation, dict[str, np.ndarray]]:
    """Decay of a Taylor-Green vortex from a lattice: time times rate, energy, and the vortex' own.

    With P = 0 at rest: pressure would make the lattice a crystal, which resists the flow.
    """
    eta = edge / reynolds
    scene = sdpd.Scene(
        fluid=plain_fluid(eta, sdpd.eos.ArtificialCompressibility()),
        box=sdpd.Box((float(edge),) * 2),
        resolution=sdpd.Resolution(spacing=1.0, support=3.0),
        sound_speed=10.0,
        velocity_scale=1.0,
        calibrate=True,
        effects=SILENT,
    )
    sim = simulation(scene)
    k = 2.0 * math.pi / edge

    def shape(points: np.ndarray) -> np.ndarray:
        x, y = k * points.T
        return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)], axis=1)

    sim.velocities = shape(sim.positions)
    first = sim.kinetic_energy
    rate = 4.0 * eta * k**2
    steps = math.ceil(math.log(FALL) / rate / sim.dt)
    rows = []

    def look(s: sdpd.Simulation) -> None:
        field = shape(s.positions)
        left = float((s.velocities * field).sum() / (field * field).sum())
        rows.append((rate * s.time, s.kinetic_energy / first, left**2))

    sim.run(steps, callback=look, every=max(1, steps // 60), progress=False)
    table = np.array(rows)
    return sim, {"time": table[:, 0], "energy": table[:, 1], "vortex": table[:, 2]}


def _rate_error(curve: dict[str, np.ndarray], name: str, least: float) -> float:
    """Of the slope of the logarithm, while more than `least` is left."""
    kept = curve[name] > least
    return float(-np.polyfit(curve["time"][kept], np.log(curve[name][kept]), 1)[0] - 1.0)


@case("taylor_green_to_1e-4")
def taylor_green(full: bool) -> Found:
    """2D, without noise: the energy must fall as exp(-4 nu k^2 t) over four decades."""
    edge = 64 if full else 24
    sim, curve = _vortex(edge, 1.0)
    numbers = {
        "rate_error": _rate_error(curve, "energy", 0.0),
        "rate_error_of_the_vortex": _rate_error(curve, "vortex", 0.0),
        "energy_left": float(curve["energy"][-1]),
        "residual_noise": float((curve["energy"] - curve["vortex"])[-1]),
        "momentum": float(np.abs(sim.momentum).max()) / len(sim),
    }
    found = Found(edge**2, sim.step, numbers)
    if full:
        _, other = _vortex(edge, 10.0)
        numbers |= {
            "rate_error_at_Re_10_to_a_tenth": _rate_error(other, "energy", 0.1),
            "rate_error_at_Re_10": _rate_error(other, "energy", 0.0),
            "residual_noise_at_Re_10": float((other["energy"] - other["vortex"])[-1]),
            "curves": {
                str(reynolds): {k: [float(f"{v:.6g}") for v in c] for k, c in each.items()}
                for reynolds, each in ((1, curve), (10, other))
            },
        }
    return found


def _without_sound(forces: sdpd.WallForces, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Time and lift less its mean, averaged twice over a quarter of the time D/U."""
    time = np.linspace(forces.time[0], forces.time[-1], len(forces.time))
    lift = np.interp(time, forces.time, forces.force[:, 0, 1])
    width = max(1, round(0.25 * turn / (time[1] - time[0])))
    for _ in range(2):
        lift = np.convolve(lift, np.full(width, 1.0 / width), mode="valid")
    return time[: len(lift)], lift - lift.mean()


@case("cylinder_at_Re_100")
def cylinder_at_re_100(full: bool) -> Found:
    """A body force drives the fluid past a periodic row of cylinders in 2D.

    In the mean over time the drag is the force on the fluid: nothing else takes it up. The pressure
    at rest is 3 rho U^2: enough to stay positive in the wake; that of P = c^2 rho would freeze the
    particles, which are without noise, around the cylinder.
    """
    diameter, steps = (20.0, 30_000) if full else (10.0, 400)
    speed, re = 1.0, 100.0
    length, height = 6.0 * diameter, 4.0 * diameter
    area = length * height - 0.25 * math.pi * diameter**2
    drag = 0.5 * 2.1 * diameter * speed**2  # for a drag coefficient of some 2.1
    scene = sdpd.Scene(
        fluid=plain_fluid(speed * diameter / re, sdpd.eos.Linear(background_pressure=3.0)),
        box=sdpd.Box((length, height)),
        walls=(sdpd.Cylinder(radius=0.5 * diameter, centre=(0.3 * length, 0.5 * height)),),
        resolution=sdpd.Resolution(spacing=1.0, support=2.64),
        body_force=sdpd.UniformForce((drag / area, 0.0)),
        sound_speed=10.0,
        velocity_scale=1.5 * speed,
        effects=SILENT,
        start=sdpd.RandomStart(velocities="zero"),
    )
    sim = simulation(scene, dt="adaptive")
    # A push across, so that the wake need not wait for rounding to break its symmetry.
    phase = 2.0 * math.pi * sim.positions[:, 0] / length
    sim.velocities = speed * np.stack([np.ones(len(sim)), 0.2 * np.sin(phase)], axis=1)
    sim.run(steps // 3, progress=False)
    forces, speeds = sdpd.WallForces(every=10), []
    before, started = float(sim.momentum[0]), sim.time
    sim.run(
        steps - steps // 3,
        observe=forces,
        callback=lambda s: speeds.append(float(s.velocities[:, 0].mean())),
        every=10,
        progress=False,
    )
    gaps = np.diff(np.concatenate([[started], forces.time]))
    received = float(gaps @ forces.force[:, 0, 0])
    given = drag / area * scene.particle_mass * len(sim) * float(gaps.sum())
    gained = float(sim.momentum[0]) - before
    mean = float(np.mean(speeds))
    numbers = {
        "balance": (received + gained) / given - 1.0,
        "outside": outside(sim),
        "reynolds": mean * re / speed,
        "reynolds_error": mean / speed - 1.0,
        "negative_pressures": float((sim.pressures < 0.0).sum()),
        "drag_coefficient": received / float(gaps.sum()) / (0.5 * diameter * mean**2),
        "density_extremes": [float(sim.densities.min()), float(sim.densities.max())],
    }
    if full:
        time, lift = _without_sound(forces, diameter / mean)
        turns = np.flatnonzero((lift[:-1] < 0.0) & (lift[1:] >= 0.0))
        numbers |= {
            "no_vortices": float(len(turns) < 5),
            "strouhal": diameter / (mean * float(np.diff(time[turns]).mean())),
            "lift_coefficient_rms": float(lift.std() / (0.5 * diameter * mean**2)),
        }
    return Found(scene.n_particles, steps, numbers)
