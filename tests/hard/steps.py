"""Hard cases of the time step: beyond tau, beyond each bound, very many steps, very large units."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np

import sdpd
from sdpd import compensation
from sdpd.analysis import time_average

from .case import Found, case, plain_fluid, simulation

SILENT = sdpd.Effects(fluctuations=False)


# --- dt = 10 tau and 100 tau ------------------------------------------------------------------


def _viscous_scene(ratio: float, edge: int) -> sdpd.Scene:
    """A fluid so viscous that the step of its sound is `ratio` friction times."""

    def of(eta: float) -> sdpd.Scene:
        return sdpd.Scene(
            fluid=plain_fluid(eta),
            box=sdpd.Box((float(edge),) * 3),
            resolution=sdpd.Resolution(spacing=1.0, support=3.0, kernel="lucy"),
            start=sdpd.RandomStart(),
            sound_speed=10.0,
        )

    scene = of(1.0)
    step = min(b.value for b in sdpd.timestep.bounds(scene) if b.name != "friction")
    return of(ratio * scene.friction_time / step)


def _decay_rate(scene: sdpd.Scene, ratio: float, **options: Any) -> float:
    """Mean rate of three shear waves in the fluid without order, sound and noise."""
    soft = scene.replace(sound_speed=1e-3, effects=SILENT)
    tau, edge = soft.friction_time, soft.box.lengths[0]
    rate = soft.fluid.kinematic_viscosity * (2.0 * math.pi / edge) ** 2
    span = 100.0 * tau * max(1, round(1.0 / (rate * 100.0 * tau)))
    start = simulation(soft).positions.copy()
    found = []
    for axis in range(3):
        wave = np.sin(2.0 * math.pi / edge * start[:, axis])
        velocities = np.zeros_like(start)
        velocities[:, axis - 1] = 1e-4 * (wave - wave.mean())
        sim = simulation(
            soft,
            dt=ratio * tau,
            positions=start,
            velocities=velocities,
            integrator=sdpd.PairSplitting(**options),
        )
        sim.run(round(span / sim.dt), progress=False)
        left = (sim.velocities[:, axis - 1] @ wave) / (velocities[:, axis - 1] @ wave)
        found.append(-math.log(left) / sim.time)
    return float(np.mean(found))


def _viscous(ratio: float, full: bool, **cure: Any) -> Found:
    edge, steps = (12, 1000 if ratio < 50.0 else 300) if full else (8, 60)
    scene = _viscous_scene(ratio, edge)
    dt = ratio * scene.friction_time
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation(scene, dt=dt)
    said = [str(w.message) for w in caught if w.category is sdpd.TimeStepWarning]
    sim = simulation(scene, dt=dt, integrator=sdpd.PairSplitting(**cure))
    thermo = sdpd.Thermodynamics(every=1)
    sim.run(steps, observe=thermo, progress=False)
    temperature = time_average(thermo["temperature"])
    numbers = {
        "temperature_error": temperature.value - 1.0,
        "temperature_error_stderr": temperature.stderr,
        "momentum": float(np.abs(sim.momentum).max()),
        "not_said": float(not any("delivered viscosity" in text for text in said)),
        "not_offered": float(not any("compensate=True" in text for text in said)),
        "viscosity_lost": 1.0 - compensation.delivered_viscosity(scene, dt),
    }
    if full:
        exact = _decay_rate(scene, 0.25)
        numbers["viscosity_error_without_cure"] = _decay_rate(scene, ratio) / exact - 1.0
        numbers["viscosity_error"] = _decay_rate(scene, ratio, **cure) / exact - 1.0
    else:
        scale = compensation.friction_scale(scene, dt, sweeps=cure.get("sweeps", 1))
        delivered = compensation.delivered_viscosity(
            scene, dt, scale=scale, sweeps=cure.get("sweeps", 1)
        )
        numbers["viscosity_error"] = delivered - 1.0
    return Found(edge**3, steps, numbers)


@case("step_of_10_tau")
def step_of_10_tau(full: bool) -> Found:
    return _viscous(10.0, full, compensate=True)


@case("step_of_100_tau")
def step_of_100_tau(full: bool) -> Found:
    return _viscous(100.0, full, compensate=True, sweeps=10)


# --- each bound -------------------------------------------------------------------------------


def _bounded_scenes() -> list[tuple[sdpd.Scene, str]]:
    """Small scenes whose bounds are all there are, with their integrators."""
    resolution = sdpd.Resolution(spacing=1.0)
    box = sdpd.Box((8.0, 8.0))
    force = sdpd.SinusoidalForce(amplitude=20.0)
    plain = sdpd.Scene(
        fluid=plain_fluid(), box=box, resolution=resolution, sound_speed=10.0, body_force=force
    )
    warm = plain.replace(
        fluid=plain_fluid(heat_capacity=50.0, thermal_conductivity=500.0),
        effects=sdpd.Effects(energy=True),
    )
    integrators = ("pair_splitting", "velocity_verlet")
    return [(scene, name) for scene in (plain, warm) for name in integrators]


@case("beyond_each_bound")
def beyond_each_bound(full: bool) -> Found:
    """At a bound nothing is said; above it the warning names it; far above, the error does too."""
    steps = 2000 if full else 200
    unsaid = silent_failures = unnamed = at_bound = failures = 0
    names = set()
    for scene, integrator in _bounded_scenes():
        bounds = sdpd.timestep.bounds(scene, integrator)
        tightest = bounds[0].value
        for bound in bounds:
            names.add(bound.name)
            for factor in (1.0, 1.01, 100.0):
                dt = factor * bound.value
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always")
                    sim = simulation(scene, integrator=integrator, dt=dt)
                said = " ".join(str(w.message) for w in caught)
                unsaid += (bound.name in said) != (factor > 1.0)
                try:
                    sim.run(steps, progress=False)
                except sdpd.SimulationError as error:
                    failures += 1
                    at_bound += dt <= tightest
                    over = sdpd.timestep.check_time_step(scene, dt, integrator)
                    unnamed += not any(each.name in str(error) for each in over)
                else:
                    finite = np.isfinite(sim.velocities).all() and np.isfinite(sim.positions).all()
                    silent_failures += not finite
    numbers = {
        "bounds": len(names),
        "warnings_missing_or_false": unsaid,
        "errors_at_the_tightest_bound": at_bound,
        "errors_without_the_bound": unnamed,
        "states_not_finite": silent_failures,
        "runs_refused_on_the_way": failures,
    }
    return Found(64, steps, numbers)


# --- very many steps --------------------------------------------------------------------------


@case("ten_million_steps")
def ten_million_steps(full: bool) -> Found:
    """Slopes over the whole run of what must not drift, from means of 64 blocks."""
    steps = 10_000_000 if full else 20_000
    scene = sdpd.Scene(
        fluid=plain_fluid(5.0),
        box=sdpd.Box((4.0, 4.0)),
        resolution=sdpd.Resolution(spacing=1.0, support=2.0, kernel="lucy"),
        sound_speed=5.0,
    )
    sim = simulation(scene)
    sim.run(2000, progress=False)
    blocks = 64
    names = ("temperature", "mean_density", "mean_pressure")
    means = []
    thermal_momentum = math.sqrt(scene.n_particles)
    momentum = 0.0
    for block in range(blocks):
        thermo = sdpd.Thermodynamics(every=10)
        whole = steps * (block + 1) // blocks - steps * block // blocks
        sim.run(whole, observe=thermo, progress=False)
        means.append([float(np.mean(thermo[name])) for name in names])
        momentum = max(momentum, float(np.abs(sim.momentum).max()))
    values = np.array(means) / np.mean(means, axis=0)
    time = (np.arange(blocks) + 0.5) / blocks - 0.5
    numbers: dict[str, Any] = {"momentum": momentum / thermal_momentum}
    for name, column in zip(names, values.T, strict=True):
        slope = float(time @ column / (time @ time))
        rest = column - 1.0 - slope * time
        error = float(np.sqrt(rest @ rest / (blocks - 2) / (time @ time)))
        numbers |= {f"{name}_drift": slope, f"{name}_drift_stderr": error}
    level = values[:, 0] * np.mean(means, axis=0)[0]
    numbers["temperature_error"] = float(level.mean() - 1.0)
    numbers["temperature_error_stderr"] = float(level.std(ddof=1) / math.sqrt(blocks))
    numbers["dt_over_tau"] = sim.dt / scene.friction_time
    return Found(16, steps, numbers)


# --- from a nanometre to a metre --------------------------------------------------------------


def _scaled(length: float, density: float, speed: float) -> sdpd.Scene:
    """The same fluid in units of a length, a density and a thermal speed; k_B and T are of SI."""
    mass = density * length**3
    k = 1.380649e-23
    return sdpd.Scene(
        fluid=sdpd.Fluid(
            density=density,
            shear_viscosity=20.0 * density * length * speed,
            temperature=mass * speed**2 / k,
            boltzmann_constant=k,
            equation_of_state=sdpd.eos.IdealGas(),
        ),
        box=sdpd.Box((8.0 * length,) * 3),
        resolution=sdpd.Resolution(spacing=length),
        sound_speed=10.0 * speed,
        start=sdpd.LatticeStart(jitter=0.3),
    )


@case("nanometre_to_metre")
def nanometre_to_metre(full: bool) -> Found:
    steps = 400 if full else 40
    results = []
    for length, density, speed in (
        (1.0, 1.0, 1.0),
        (1e-9, 1000.0, 50.0),
        (1e-6, 1.2, 1e-3),
        (1e-3, 1000.0, 1e-6),
        (1.0, 13600.0, 1e3),
    ):
        scene = _scaled(length, density, speed)
        sim = simulation(scene, dt=0.5 * scene.friction_time)
        sim.run(steps, progress=False)
        results.append((sim.unwrapped / length, sim.velocities / speed, sim.pressures))
        scale = density * speed**2
        results[-1] = (*results[-1][:2], results[-1][2] / scale)
    worst = [
        max(float(np.abs(mine - its).max()) for mine, its in zip(one, results[0], strict=True))
        for one in results[1:]
    ]
    return Found(512, steps, {"difference": max(worst), "dt_over_tau": 0.5})


# --- walls ------------------------------------------------------------------------------------


@case("walls_faster_than_thermal")
def walls_faster_than_thermal(full: bool) -> Found:
    """Couette flow between walls at three thermal speeds, either way: profile and temperature."""
    width, steps = (24.0, 20_000) if full else (8.0, 1500)
    speed, height = 3.0, 16.0
    box = sdpd.Box((width, height), periodic="x")
    scene = sdpd.Scene(
        fluid=plain_fluid(),
        box=box,
        walls=(
            sdpd.Plane(axis="y", at=0.0, velocity=(-speed, 0.0)),
            sdpd.Plane(axis="y", at=height, velocity=(speed, 0.0)),
        ),
        resolution=sdpd.Resolution(spacing=1.0),
        velocity_scale=speed,
        sound_speed=15.0,
        start=sdpd.RandomStart(),
    )
    sim = simulation(scene)
    sim.velocities[:, 0] += speed * (2.0 * sim.positions[:, 1] / height - 1.0)
    sim.run(steps // 5, progress=False)
    thermo = sdpd.Thermodynamics(every=10)
    slopes = []

    def look(s: sdpd.Simulation) -> None:
        y = s.positions[:, 1] - 0.5 * height
        slopes.append(float(y @ s.velocities[:, 0] / (y @ y)) * 0.5 * height / speed)

    sim.run(steps - steps // 5, observe=thermo, callback=look, every=10, progress=False)
    temperature, slope = time_average(thermo["temperature_y"]), time_average(np.array(slopes))
    distance = np.minimum(sim.positions[:, 1], height - sim.positions[:, 1])
    numbers = {
        "temperature_error": temperature.value - 1.0,
        "temperature_error_stderr": temperature.stderr,
        "shear_rate_error": slope.value - 1.0,
        "shear_rate_error_stderr": slope.stderr,
        "outside": float(-min(0.0, distance.min())),
    }
    return Found(scene.n_particles, steps, numbers)


@case("wall_at_ten_T")
def wall_at_ten_T(full: bool) -> Found:
    """Conduction between walls at T and 10 T: the books and the straight profile."""
    steps = 4000 if full else 500
    height, edge = 12.0, 6.0
    fluid = plain_fluid(
        law=sdpd.eos.Linear(background_pressure=100.0),
        heat_capacity=50.0,
        thermal_conductivity=500.0,
    )
    scene = sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((edge, edge, height), periodic="xy"),
        walls=(
            sdpd.Plane(axis="z", at=0.0, heat=sdpd.Isothermal(1.0)),
            sdpd.Plane(axis="z", at=height, heat=sdpd.Isothermal(10.0)),
        ),
        resolution=sdpd.Resolution(spacing=1.0, support=2.64, kernel="lucy"),
        sound_speed=10.0,
        effects=sdpd.Effects(energy=True),
    )
    sim = simulation(scene)
    before = sim.total_energy
    sim.run(steps // 2, progress=False)
    heat = sim.energy_accounts().wall_heat.copy()
    started, z, profile = sim.time, [], []

    def look(s: sdpd.Simulation) -> None:
        z.append(s.positions[:, 2].copy())
        profile.append(s.temperatures.copy())

    sim.run(steps - steps // 2, callback=look, every=10, progress=False)
    accounts = sim.energy_accounts()
    flux = (accounts.wall_heat - heat) / (sim.time - started) / edge**2
    expected = 500.0 * scene.factors.conductivity * 9.0 / height
    fit = np.polyfit(np.concatenate(z), np.concatenate(profile), 1)
    numbers = {
        "books": float((sim.total_energy - before - accounts.gained) / before),
        "slope_error": float(fit[0] * height / 9.0 - 1.0),
        "middle_error": float(np.polyval(fit, 0.5 * height) / 5.5 - 1.0),
        "flux_error": float(0.5 * (flux[0] - flux[1]) / expected - 1.0),
        "coldest": float(sim.temperatures.min()),
        "refused_exchanges": accounts.refused,
    }
    return Found(scene.n_particles, steps, numbers)
