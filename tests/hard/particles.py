"""Hard cases of particles: light ones, small heat capacities, overlaps, clumps, odd places."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

import sdpd
from sdpd.analysis import time_average

from .case import Found, case, plain_fluid, simulation


def refused(action: Callable[[], object], *pieces: str) -> float:
    """0 if the action is refused beforehand with these pieces in the reason, else 1."""
    try:
        action()
    except ValueError as error:
        return float(not all(piece in str(error) for piece in pieces))
    return 1.0


def nearest(sim: sdpd.Simulation) -> np.ndarray:
    """Distance of each particle to its nearest one over the spacing, in a periodic box."""
    lengths = np.asarray(sim.scene.box.lengths)
    points = np.mod(sim.positions, lengths)
    return np.asarray(cKDTree(points, boxsize=lengths).query(points, k=2)[0][:, 1]) / (
        sim.scene.spacing
    )


def outside(sim: sdpd.Simulation) -> float:
    """How far the worst particle is behind a wall, over the support."""
    inside = np.min([w.distance(sim.positions, sim.scene.box) for w in sim.walls], axis=0)
    return float(max(0.0, -inside.min())) / sim.scene.support_radius


@case("light_particles")
def light_particles(full: bool) -> Found:
    """Nguyen (2021), Table 3.1: m = .01, eta = 100, n = 10, k_B T = 1, r_c = 1.6, U = 1."""
    steps = 4000 if full else 120
    scene = sdpd.Scene(
        fluid=plain_fluid(100.0, density=0.1),
        box=sdpd.Box((10.0, 10.0), periodic="x"),
        walls=(
            sdpd.Plane(axis="y", at=0.0, velocity=(-1.0, 0.0)),
            sdpd.Plane(axis="y", at=10.0, velocity=(1.0, 0.0)),
        ),
        resolution=sdpd.Resolution(particles=1024, support=1.6 * math.sqrt(10.0), kernel="lucy"),
        velocity_scale=1.0,
        sound_speed=100.0,
        start=sdpd.RandomStart(),
    )
    numbers: dict[str, float] = {"mass": scene.particle_mass}
    for step in (5e-4, 1e-4) if full else (5e-4,):
        sim = simulation(scene, dt=step)
        thermo = sdpd.Thermodynamics(every=1)
        sim.run(steps, observe=thermo, progress=False)
        found = time_average(thermo["temperature_y"])
        key = "temperature_error" if step == 5e-4 else "temperature_error_at_1e-4"
        numbers |= {key: found.value - 1.0, f"{key}_stderr": found.stderr}
    numbers["dt_over_tau"] = 5e-4 / scene.friction_time
    numbers["outside"] = outside(sim)
    return Found(1024, steps, numbers)


@case("small_heat_capacity")
def small_heat_capacity(full: bool) -> Found:
    """C = 5, 2 and 1.2 k_B: <T> and Var T on the shell of constant energy; C = 1 is refused."""
    steps = 30_000 if full else 1200
    dimension, number = 2, 100

    def scene_of(capacity: float) -> sdpd.Scene:
        return sdpd.Scene(
            fluid=plain_fluid(5.0, heat_capacity=capacity, thermal_conductivity=2.5 * capacity),
            box=sdpd.Box((10.0, 10.0)),
            resolution=sdpd.Resolution(spacing=1.0, support=2.4, kernel="lucy"),
            sound_speed=10.0,
            effects=sdpd.Effects(energy=True),
        )

    numbers = {"not_refused_at_1": refused(lambda: scene_of(1.0), "must be above k_B a particle")}
    energy_error = 0.0
    for capacity in (5.0, 2.0, 1.2):
        integrator = sdpd.PairSplitting(metropolis=capacity < 5.0)
        sim = simulation(scene_of(capacity), integrator=integrator)
        before = sim.total_energy
        freedom = number * capacity + 0.5 * dimension * (number - 1)
        mean = before / freedom
        spread = mean**2 * (freedom - capacity) / (capacity * (freedom + 1.0))
        sim.run(200, progress=False)
        samples: list[tuple[float, float]] = []

        def look(
            s: sdpd.Simulation, mean: float = mean, into: list[tuple[float, float]] = samples
        ) -> None:
            t = s.temperatures
            into.append((float(t.mean()), float(((t - mean) ** 2).mean())))

        sim.run(steps, callback=look, every=5, progress=False)
        found = [time_average(np.array(column)) for column in zip(*samples, strict=True)]
        pairs = zip(("temperature", "variance"), found, (mean, spread), strict=True)
        for name, estimate, exact in pairs:
            key = f"{name}_error_at_{capacity:g}"
            numbers |= {
                key: estimate.value / exact - 1.0,
                f"{key}_stderr": estimate.stderr / exact,
            }
        energy_error = max(energy_error, abs(sim.total_energy / before - 1.0))
    return Found(number, steps, {**numbers, "energy": energy_error})


@case("random_overlaps")
def random_overlaps(full: bool) -> Found:
    """Independent uniform positions, nothing relaxed, in the stiffest law of the package."""
    edge, steps = (20, 1000) if full else (9, 150)
    scene = sdpd.Scene(
        fluid=plain_fluid(law=sdpd.eos.Tait()),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, support=2.64, kernel="lucy"),
        sound_speed=10.0,
        start=sdpd.RandomStart(relax=False),
    )
    sim = simulation(scene)
    closest = nearest(sim).min()
    densest = float(sim.densities.max())
    thermo = sdpd.Thermodynamics(every=1)
    sim.run(steps, observe=thermo, progress=False)
    late = time_average(thermo["temperature"][-max(50, steps // 2) :])
    numbers = {
        "closest_pair_at_start": float(closest),
        "densest_at_start": densest,
        "hottest": float(thermo["temperature"].max()),
        "temperature_error": late.value - 1.0,
        "temperature_error_stderr": late.stderr,
        "momentum": float(np.abs(sim.momentum).max()),
    }
    return Found(edge**3, steps, numbers)


@case("coincident_particles")
def coincident_particles(full: bool) -> Found:
    """At the same point: refused. A rounding apart: they part."""
    edge, steps = (20, 4000) if full else (10, 600)
    scene = sdpd.Scene(
        fluid=plain_fluid(5.0),
        box=sdpd.Box((float(edge),) * 2),
        resolution=sdpd.Resolution(spacing=1.0),
        sound_speed=10.0,
    )
    start = simulation(scene).positions.copy()
    same = start.copy()
    same[1] = same[0]
    numbers = {
        "not_refused": refused(lambda: simulation(scene, positions=same), "must be distinct")
    }
    running = simulation(scene)
    running.positions[1] = running.positions[0]
    numbers["not_refused_when_written"] = refused(lambda: running.run(1), "must all differ")
    close = start.copy()
    close[1] = close[0] + [1e-13, 0.0]
    sim = simulation(scene, positions=close)
    sim.run(steps, progress=False)
    numbers |= {
        "still_together": float(nearest(sim)[:2].min() < 0.1),
        "momentum": float(np.abs(sim.momentum).max()),
    }
    return Found(edge**2, steps, numbers)


@case("on_walls_and_in_corners")
def on_walls_and_in_corners(full: bool) -> Found:
    """A closed box whose outermost particles start on its walls, two in corners."""
    edge, steps = (16, 20_000) if full else (8, 1500)
    box = sdpd.Box((float(edge),) * 2, periodic="")
    scene = sdpd.Scene(
        fluid=plain_fluid(5.0),
        box=box,
        walls=sdpd.walls.enclosure(box),
        resolution=sdpd.Resolution(particles=(edge, edge)),
        sound_speed=10.0,
    )
    start = simulation(scene).positions.copy()
    start[start < 1.0] = 0.0
    start[start > edge - 1.0] = float(edge)
    sim = simulation(scene, positions=start)
    thermo = sdpd.Thermodynamics(every=1)
    sim.run(steps // 10, progress=False)
    sim.run(steps - steps // 10, observe=thermo, progress=False)
    temperature = time_average(thermo["temperature"])
    # No momentum is conserved between walls: all D N degrees of freedom count.
    share = 1.0 - 1.0 / edge**2
    mean = time_average(thermo["kinetic_energy"]).value / edge**2
    numbers = {
        "temperature_error": mean - 1.0,
        "temperature_error_stderr": temperature.stderr * share,
        "outside": outside(sim),
        "crossings": float(sim.statistics()["wall_crossings"]),
    }
    return Found(edge**2, steps, numbers)


@case("gap_thinner_than_h")
def gap_thinner_than_h(full: bool) -> Found:
    """A slit of 0.7 h: refused between two planes, run as one polygon."""
    length, steps = (30.0, 20_000) if full else (12.0, 3000)
    resolution = sdpd.Resolution(spacing=0.5, support=3.0, kernel="lucy")
    gap = 0.7 * 1.5

    def scene_of(box: sdpd.Box, walls: tuple[sdpd.walls.Wall, ...]) -> sdpd.Scene:
        return sdpd.Scene(
            fluid=plain_fluid(5.0, density=4.0),
            box=box,
            walls=walls,
            resolution=resolution,
            sound_speed=10.0,
            start=sdpd.RandomStart(),
        )

    open_ended = sdpd.Box((length, gap), periodic="x")
    planes = sdpd.walls.slab(open_ended, "y")
    not_refused = refused(lambda: scene_of(open_ended, planes), "walls", "support")
    corners = np.array([[0.0, 0.0], [length, 0.0], [length, gap], [0.0, gap]])
    scene = scene_of(sdpd.Box((length, gap), periodic=""), (sdpd.Polyline(points=corners),))
    sim = simulation(scene)
    thermo = sdpd.Thermodynamics(every=1)
    sim.run(steps // 3, progress=False)
    sim.run(steps - steps // 3, observe=thermo, progress=False)
    number = scene.n_particles
    kinetic = time_average(thermo["kinetic_energy"])
    numbers = {
        "gap_over_h": gap / scene.support_radius,
        "planes_not_refused": not_refused,
        "temperature_error": kinetic.value / number - 1.0,
        "temperature_error_stderr": kinetic.stderr / number,
        "outside": outside(sim),
    }
    return Found(number, steps, numbers)


@case("negative_pressure")
def negative_pressure(full: bool) -> Found:
    """Stretched to .85 of its rest density a fluid clumps; background pressure holds it apart."""
    edge, steps = (40, 6000) if full else (16, 500)
    found = {}
    for background in (0.0, 100.0):
        law = sdpd.eos.Linear(
            background_pressure=background, reference_density=1.0 / 0.85, sound_speed=10.0
        )
        scene = sdpd.Scene(
            fluid=plain_fluid(5.0, law),
            box=sdpd.Box((float(edge),) * 2),
            resolution=sdpd.Resolution(spacing=1.0, support=2.64),
            start=sdpd.RandomStart(),
        )
        sim = simulation(scene)
        sim.run(steps, progress=False)
        gaps = nearest(sim)
        found[background] = (float(np.mean(gaps < 0.35)), float(gaps.mean()), scene)
    numbers = {
        "clumped_without": found[0.0][0],
        "clumped_with_background": found[100.0][0],
        "nearest_without": found[0.0][1],
        "nearest_with_background": found[100.0][1],
        "fault_not_seen": float(found[0.0][0] < 0.1),
        "not_foretold": float(
            not (found[0.0][2].pairing[0] > 1.0 and found[0.0][2].pressure_number < 0.0)
        ),
    }
    return Found(edge**2, steps, numbers)


@case("beyond_the_pairing_limit")
def beyond_the_pairing_limit(full: bool) -> Found:
    """X = 900 in 3D with P = c^2 rho: Lucy (limit X = 287) pairs and says so, Wendland does not."""
    edge, steps = (12, 2000) if full else (8, 400)
    found = {}
    for kernel in ("lucy", "wendland_c2"):
        scene = sdpd.Scene(
            fluid=plain_fluid(5.0),
            box=sdpd.Box((float(edge),) * 3),
            resolution=sdpd.Resolution(spacing=1.0, support=2.64, kernel=kernel),
            start=sdpd.RandomStart(),
            sound_speed=30.0,
        )
        sim = simulation(scene)
        sim.run(steps, progress=False)
        gaps = nearest(sim)
        found[kernel] = (float(np.mean(gaps < 0.45)), float(gaps.mean()), scene.pairing[0])
    lucy, wendland = found["lucy"], found["wendland_c2"]
    numbers = {
        "paired_lucy": lucy[0],
        "paired_wendland": wendland[0],
        "nearest_lucy": lucy[1],
        "nearest_wendland": wendland[1],
        "limit_lucy": 900.0 / lucy[2],
        "fault_not_seen": float(lucy[1] > 0.85 * wendland[1]),
        "foretold_wrongly": float(lucy[2] <= 1.0 or wendland[2] > 1.0),
    }
    return Found(edge**3, steps, numbers)


@case("density_ratio_of_1000")
def density_ratio_of_1000(full: bool) -> Found:
    """Half of the particles in a thousandth of the volume of the others: refused at fixed h."""
    number = 8000 if full else 1000
    edge = round(number ** (1.0 / 3.0))
    scene = sdpd.Scene(
        fluid=plain_fluid(),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(particles=number),
        start=sdpd.RandomStart(),
    )
    places = simulation(scene).positions.copy()
    places[: number // 2] *= 0.1
    missing = refused(
        lambda: simulation(scene, positions=places), "`positions`", "density", "support"
    )
    mild = simulation(scene).positions.copy()
    mild[: number // 2] *= 0.8
    simulation(dataclasses.replace(scene), positions=mild)
    return Found(number, 0, {"not_refused": missing})
