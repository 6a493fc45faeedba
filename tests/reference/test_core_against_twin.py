"""The Rust core against the NumPy twin: densities, forces, noise, trajectories.

Rows: every dimension, kernel, equation of state, friction form and variate of the registry.
The bound is 1e-12 of the rms force (densities: of their mean); trajectories 1e-10 over 20 steps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import _core

from .build import (
    DIMENSIONS,
    EQUATIONS_OF_STATE,
    FRICTIONS,
    core,
    problem,
    rescaled,
    restated,
)
from .test_twin_self import KNOWN_ANSWERS, angular, free_cluster, pad, words
from .twin import (
    KERNELS,
    STREAMS,
    System,
    Trajectory,
    force_variates,
    pair_splitting_step,
    pair_variates,
    pressure,
    sound_speed_squared,
    specific_potential,
    velocity_verlet_step,
)
from .twin.kernels import force_profile, profile

Array = NDArray[np.float64]

PARTS = ("conservative", "dissipative", "random")


def rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def assert_same_forces(sim: Any, system: System, step: int = 0, tolerance: float = 1e-12) -> None:
    """Densities, pressures and the three force parts of a core against its twin."""
    d = system.number_densities
    assert np.abs(sim.number_densities - d).max() <= tolerance * d.mean()
    assert np.abs(sim.densities - system.densities).max() <= tolerance * system.densities.mean()
    p = system.pressures
    assert np.abs(sim.pressures - p).max() <= 10 * tolerance * np.abs(p).max()
    expected, got = system.forces(step), sim.force_parts()
    scale = rms(expected.total)
    for name in PARTS:
        worst = np.abs(got[name] - getattr(expected, name)).max()
        assert worst <= tolerance * scale, f"{name}: {worst / scale:.1e} of the rms force"


# --- the single functions --------------------------------------------------------------------


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_kernel_profiles(kernel: str, dimension: int) -> None:
    q = np.concatenate(
        [np.linspace(0.0, 1.2, 601), [1e-300, 1e-9, 1 / 3, 2 / 3, 1.0, np.nextafter(1.0, 0.0)]]
    )
    w, f = _core.kernel_profile(kernel, dimension, q)
    w_twin, f_twin = profile(kernel, dimension, q), force_profile(kernel, dimension, q)
    assert np.abs(w - w_twin).max() < 2e-14 * w_twin.max()
    assert np.abs(f - f_twin).max() < 2e-14 * f_twin.max()
    assert np.all(w[q >= 1.0] == 0.0)
    assert np.all(f[q >= 1.0] == 0.0)


def test_kernel_names() -> None:
    assert set(_core.kernel_names()) == set(KERNELS)


@pytest.mark.parametrize("kind", EQUATIONS_OF_STATE)
def test_equations_of_state(kind: str) -> None:
    parameters = EQUATIONS_OF_STATE[kind]
    rho = np.concatenate([np.linspace(0.4, 1.6, 61) + 1e-3, [1.0]])
    p, c2, e = _core.eos_evaluate(kind, parameters, rho)
    p_twin = pressure(kind, parameters, rho)
    assert np.abs(p - p_twin).max() < 1e-13 * np.abs(p_twin).max()
    c2_twin = sound_speed_squared(kind, parameters, rho)
    assert np.abs(c2 - c2_twin).max() < 1e-9 * np.abs(c2_twin).max()
    e_twin = specific_potential(kind, parameters, rho, 1.0)
    assert np.abs((e - e[-1]) - e_twin).max() < 1e-12 * np.abs(e_twin).max()


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_known_answers(counter: str, key: str, answer: str) -> None:
    got = _core.philox4x32([int(w) for w in words(counter)[0]], [int(w) for w in words(key)[0]])
    assert [int(w) for w in got] == [int(w) for w in words(answer)[0]]


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("variate", ["gaussian", "uniform"])
@pytest.mark.parametrize(
    ("seed", "stream", "step", "draw"),
    [
        (0, "pair_force", 0, 0),
        (2024, "pair_exchange", 1, 1),
        (2**63 + 12345678901, "pair_force", 2**32 + 7, 0),
        (2**64 - 1, "pair_exchange", 2**47 + 3, 1),
    ],
)
def test_pair_variates(
    variate: str, dimension: int, seed: int, stream: str, step: int, draw: int
) -> None:
    small = np.arange(1000, dtype=np.uint64)
    large = np.array([2**32 - 1, 2**32, 2**32 + 1, 2**40 + 5, 2**63, 2**64 - 1], dtype=np.uint64)
    a = np.concatenate([small, large, large[::-1]])
    b = np.concatenate([small[::-1] + np.uint64(1000), np.roll(large, 1), np.full(6, 3, np.uint64)])
    got = _core.pair_variates(seed, stream, step, draw, a, b, variate, dimension)
    expected = pair_variates(seed, stream, step, draw, a, b, variate, dimension)
    assert got.shape == (len(a), dimension)
    # |z| <= 6.8; the elementary functions of two libraries may differ in the last bits
    assert np.abs(got - expected).max() < 4e-15
    back = _core.pair_variates(seed, stream, step, draw, b, a, variate, dimension)
    assert np.array_equal(np.abs(got), np.abs(back))


@pytest.mark.parametrize("variate", ["gaussian", "uniform"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("seed", "step"), [(0, 0), (2024, 2**32 + 7), (2**64 - 1, 2**47 + 3)])
def test_force_variates(variate: str, dimension: int, seed: int, step: int) -> None:
    small = np.arange(2000, dtype=np.uint64)
    large = np.array([2**32 - 1, 2**32, 2**32 + 1, 2**40 + 5, 2**63, 2**64 - 1], dtype=np.uint64)
    a = np.concatenate([small, large])
    b = np.concatenate([small[::-1] + np.uint64(2000), np.roll(large, 1)])
    got = _core.force_variates(seed, step, a, b, variate, dimension)
    assert got.shape == (len(a), dimension)
    # normal ones are drawn in single precision
    expected = force_variates(seed, step, a, b, variate, dimension)
    assert np.abs(got - expected).max() < (1e-15 if variate == "uniform" else 2e-6)
    assert np.array_equal(got, -_core.force_variates(seed, step, b, a, variate, dimension))


def test_unknown_variates_are_refused() -> None:
    one = np.array([1], dtype=np.uint64)
    with pytest.raises(ValueError, match="`variate` must be"):
        _core.force_variates(1, 0, one, one, "normal", 3)
    with pytest.raises(ValueError, match="`id_b` must have the length of `id_a`, 1, got 2"):
        _core.force_variates(1, 0, one, np.repeat(one, 2), "uniform", 3)


def test_stream_names_are_known() -> None:
    one = np.array([1], dtype=np.uint64)
    for stream in STREAMS:
        assert _core.pair_variates(1, stream, 0, 0, one, one + one, "uniform", 3).shape == (1, 3)


# --- forces ----------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", ["gaussian", "uniform", "none"])
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("eos", EQUATIONS_OF_STATE)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_forces(dimension: int, kernel: str, eos: str, friction: str, noise: str) -> None:
    system = problem(dimension, kernel=kernel, eos=eos, friction=friction, noise=noise)
    sim = core(system)
    assert_same_forces(sim, system, step=0)
    expected = system.forces(0).total
    assert np.abs(sim.forces - expected).max() < 1e-12 * rms(expected)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_forces_without_friction(kernel: str, dimension: int) -> None:
    system = problem(dimension, kernel=kernel, friction="none")
    for integrator in ("velocity_verlet", "pair_splitting"):
        sim = core(system, integrator)
        expected = system.forces().total
        assert np.abs(sim.forces - expected).max() < 1e-12 * rms(expected)


# the ends of the allowed range: b = 0 (D = 2) or 5 eta/3; a = 0; b < 0; and neither
EXTREMES = [(20.0, 0.0), (0.0, 100.0), (20.0, -20.0), (20.0, -15.0), (0.0, 0.0)]


@pytest.mark.parametrize(("across", "along"), EXTREMES)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_extreme_friction_coefficients(dimension: int, across: float, along: float) -> None:
    system = problem(dimension).at(friction_across=across, friction_along=along)
    assert_same_forces(core(system), system)
    sim = core(system, "pair_splitting")
    forward = np.asarray(sim.pair_order(), dtype=np.int64)
    sim.run(1, system.dt)
    backward = np.asarray(sim.pair_order(), dtype=np.int64)[::-1]
    assert_same_state(sim, pair_splitting_step(system, 0, forward, backward), tolerance=1e-12)


@pytest.mark.parametrize("parameters", [[0.0], [30.0]])
def test_without_temperature_or_stiffness(parameters: list[float]) -> None:
    """No thermal and no sound speed: nothing to scale velocities by, still the same forces."""
    system = problem(3).at(thermal_energy=0.0, eos=("polynomial", parameters))
    sim = core(system)
    assert_same_forces(sim, system)
    assert np.all(sim.force_parts()["random"] == 0.0)
    sim.run(1, system.dt)
    assert_same_state(sim, velocity_verlet_step(Trajectory.start(system), 1).system, 1e-12)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
def test_friction_rate(integrator: str, friction: str, dimension: int) -> None:
    system = rescaled(problem(dimension, friction=friction), 3e-10, 2.7e-26, 2e-13)
    expected = system.friction_rates().mean()
    assert core(system, integrator).friction_rate() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("step", [1, 2**31, 2**32 + 5])
def test_noise_is_keyed_by_the_step(friction: str, dimension: int, step: int) -> None:
    system = problem(dimension, friction=friction)
    sim = core(system)
    restated(sim, step=step)
    assert sim.step == step
    assert_same_forces(sim, system, step=step)


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**63 + 17, 2**64 - 1])
def test_noise_is_keyed_by_all_64_bits_of_the_seed(seed: int) -> None:
    system = problem(3).at(seed=seed)
    assert_same_forces(core(system), system)


@pytest.mark.parametrize("friction", FRICTIONS)
def test_noise_is_keyed_by_ids_not_by_rows(friction: str) -> None:
    """Ids far beyond 2^32, in no order; the trajectory too."""
    system = problem(3, friction=friction)
    rng = np.random.default_rng(1)
    ids = rng.integers(0, 2**64, system.size, dtype=np.uint64, endpoint=False)
    ids[:4] = 2**64 - 1, 2**32, 2**32 - 1, 0
    system = system.at(ids=ids)
    sim = core(system)
    restated(sim, ids=ids)
    assert np.array_equal(sim.ids, ids)
    assert_same_forces(sim, system)
    sim = core(system, "pair_splitting")
    restated(sim, ids=ids)
    forward = np.asarray(sim.pair_order(), dtype=np.int64)
    sim.run(1, system.dt)
    backward = np.asarray(sim.pair_order(), dtype=np.int64)[::-1]
    assert_same_state(sim, pair_splitting_step(system, 0, forward, backward), tolerance=1e-12)


BOXES: list[tuple[Sequence[int], float]] = [
    ((5, 5), 2.5),  # exactly two supports
    ((5, 17), 2.5),
    ((6, 8), 2.0),
    ((9, 11), 2.2),
    ((13, 16), 2.5),
    ((31, 6), 2.1),
    ((5, 5, 5), 2.5),
    ((5, 5, 13), 2.5),
    ((6, 9, 5), 2.05),
    ((8, 8, 8), 2.0),
    ((11, 5, 7), 2.2),
    ((4, 4, 29), 1.9),
]


@pytest.mark.parametrize("skin", [None, 0.05, 0.4])
@pytest.mark.parametrize(("cells", "support"), BOXES, ids=lambda value: str(value))
def test_boxes(cells: Sequence[int], support: float, skin: float | None) -> None:
    """One, two, three, many blocks along an axis, anisotropic, exactly two supports."""
    system = problem(len(cells), cells=cells, support=support)
    assert_same_forces(core(system, skin=skin), system)
    assert_same_forces(core(system, "pair_splitting", skin=skin), system)


def test_positions_outside_the_box_are_images() -> None:
    inside = problem(3)
    shift = np.random.default_rng(3).integers(-3, 4, inside.positions.shape)
    outside = inside.at(positions=inside.positions + shift * inside.box)
    sim = core(outside)
    scale = rms(inside.forces().total)
    # shifting by boxes rounds the positions themselves
    assert np.abs(sim.forces - inside.forces().total).max() < 1e-11 * scale


@pytest.mark.parametrize(
    ("length", "mass", "time"),
    [(3e-10, 2.7e-26, 2e-13), (1e-1, 1.0, 1e2), (1.0, 1e-25, 1e-9), (1e-6, 1e-15, 1e-3)],
)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_any_units(dimension: int, length: float, mass: float, time: float) -> None:
    system = rescaled(problem(dimension), length, mass, time)
    assert_same_forces(core(system), system)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_pairs_at_the_support_and_almost_on_top_of_each_other(kernel: str, dimension: int) -> None:
    base = problem(dimension, kernel=kernel, cells=(8,) * dimension, support=2.0, jitter=0.0)
    positions = base.positions.copy()  # jitter 0: many pairs at exactly h = 2
    positions[1] = positions[0]
    positions[1, 0] += 1e-6
    positions[3] = positions[2]
    positions[3, 1] -= 1e-3
    system = base.at(positions=np.mod(positions, base.box))
    sim = core(system)
    # positions near 8 are known to 1e-15, so e_ij at r = 1e-6 is to 1e-9 at best: look at both
    near = np.zeros(system.size, dtype=bool)
    near[[0, 1]] = True
    expected, got = system.forces(), sim.force_parts()
    scale = rms(expected.total)
    for name in PARTS:
        error = np.abs(got[name] - getattr(expected, name))
        assert error[~near].max() < 1e-11 * scale
        assert error[near].max() < 1e-8 * scale
        assert np.all(np.isfinite(got[name]))


def test_few_particles() -> None:
    """One particle alone, and two exactly at, just inside and just outside the support."""
    base = problem(3, cells=(5, 5, 5))
    one = base.at(positions=base.positions[:1], velocities=np.zeros((1, 3)))
    sim = core(one)
    assert np.all(sim.forces == 0.0)
    assert sim.number_densities[0] == pytest.approx(one.number_densities[0], rel=1e-14)
    for distance in (2.5, np.nextafter(2.5, 0.0), np.nextafter(2.5, 3.0), 2.4, 0.3):
        positions = np.array([[0.25, 1.0, 1.0], [0.25 + distance, 1.0, 1.0]])
        two = base.at(positions=positions, velocities=base.velocities[:2])
        sim = core(two)
        expected = two.forces().total
        assert np.abs(sim.forces - expected).max() <= 1e-12 * max(1.0, np.abs(expected).max())


# --- laws, through the core itself -----------------------------------------------------------


def potential_energy(sim: Any, system: System) -> float:
    kind, parameters = system.eos
    e = _core.eos_evaluate(kind, parameters, np.asarray(sim.densities))[2]
    return float(system.mass * np.sum(e))


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("eos", EQUATIONS_OF_STATE)
@pytest.mark.parametrize("kernel", KERNELS)
def test_conservative_force_is_minus_the_gradient(kernel: str, eos: str, dimension: int) -> None:
    system = problem(dimension, kernel=kernel, eos=eos, friction="none", cells=(6,) * dimension)
    sim = core(system)
    start, force = sim.positions.copy(), sim.forces.copy()
    way = np.random.default_rng(8).standard_normal(start.shape)
    step, energies = 2e-5, []
    for offset in (-2, -1, 1, 2):
        sim.positions[:] = start + offset * step * way
        sim.refresh()
        energies.append(potential_energy(sim, system))
    slope = (8.0 * (energies[2] - energies[1]) - (energies[3] - energies[0])) / (12.0 * step)
    scale = np.linalg.norm(force) * np.linalg.norm(way)
    assert slope == pytest.approx(-float(np.sum(force * way)), abs=1e-7 * scale)


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_momentum_is_conserved_to_rounding(dimension: int, friction: str, integrator: str) -> None:
    system = problem(dimension, friction=friction)
    sim = core(system, integrator)
    steps = 200
    sim.run(steps, system.dt)
    scale = np.sqrt(steps * system.size) * np.finfo(float).eps * 100.0
    assert np.all(np.abs(sim.velocities.sum(axis=0)) < scale)
    assert rms(np.asarray(sim.velocities)) > 0.5


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_central_form_conserves_angular_momentum(dimension: int, integrator: str) -> None:
    """A free cluster with noise on that stays clear of its images; the general form must not."""
    steps = 50
    changes = {}
    for friction in FRICTIONS:
        system = free_cluster(problem(dimension, friction=friction, eos="ideal_gas", jitter=0.2))
        if friction == "general":  # a = b at zero bulk viscosity in three dimensions
            system = system.at(friction_across=30.0, friction_along=100.0)
        sim = core(system, integrator)
        before = angular(sim.positions, sim.velocities)
        sim.run(steps, system.dt)
        assert np.all(sim.images == 0)
        after = angular(sim.positions, sim.velocities)
        changes[friction] = np.abs(after - before).max()
        moments = np.cross(pad(sim.positions), pad(sim.velocities))
        scale = float(np.linalg.norm(moments, axis=1).sum())
    assert changes["central"] < 1e-13 * steps * scale
    assert changes["general"] > 1e-3


# --- trajectories ----------------------------------------------------------------------------


def unwrapped(sim: Any, system: System) -> Array:
    return np.asarray(sim.positions) + np.asarray(sim.images) * system.box


def assert_same_state(sim: Any, system: System, tolerance: float = 1e-10) -> None:
    difference = np.asarray(sim.positions) - system.positions
    difference -= system.box * np.rint(difference / system.box)
    assert np.abs(difference).max() < tolerance
    assert np.abs(sim.velocities - system.velocities).max() < tolerance
    assert np.all((sim.positions >= 0.0) & (sim.positions < system.box))


VERLET = [
    (2, "lucy", "general", "gaussian", "linear", 1),
    (2, "wendland_c2", "central", "uniform", "tait", 1),
    (3, "lucy", "general", "gaussian", "artificial_compressibility", 0),
    (3, "quintic_spline", "general", "uniform", "linear", 1),
    (3, "wendland_c4", "central", "gaussian", "ideal_gas", 2),
    (3, "wendland_c2", "general", "gaussian", "table", 3),
    (3, "lucy", "general", "none", "polynomial", 1),
    (3, "lucy", "none", "none", "linear", 1),
]


@pytest.mark.parametrize(("dimension", "kernel", "friction", "noise", "eos", "iterations"), VERLET)
def test_velocity_verlet_trajectory(
    dimension: int, kernel: str, friction: str, noise: str, eos: str, iterations: int
) -> None:
    system = problem(
        dimension,
        kernel=kernel,
        friction=friction,
        noise=noise,
        eos=eos,
        body_force=(5.0, -3.0, 2.0)[:dimension],
        body_wave=(1, 2) if iterations == 2 else None,
    )
    sim = core(system, iterations=iterations)
    state = Trajectory.start(system)
    for step in range(20):
        sim.run(1, system.dt)
        state = velocity_verlet_step(state, iterations)
        assert_same_state(sim, state.system, tolerance=1e-13 if step == 0 else 1e-10)
    assert np.abs(unwrapped(sim, system) - state.system.positions).max() < 1e-10
    assert np.abs(state.system.positions - system.positions).max() > 0.02
    parts = state.system.forces(20)
    if iterations > 0:  # else the drag at hand is that of the half-step velocities
        assert np.abs(sim.forces - parts.total).max() < 1e-9 * rms(parts.total)
    assert sim.step == 20
    assert sim.time == pytest.approx(20 * system.dt, rel=1e-14)


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_the_time_step_may_change_between_runs(iterations: int) -> None:
    """The force at hand gets noise of the new step's strength; time adds up."""
    system = problem(3)
    sim = core(system, iterations=iterations)
    state = Trajectory.start(system)
    for dt, steps in ((0.002, 5), (0.0005, 4), (0.003, 3)):
        sim.run(steps, dt)
        state = Trajectory.start(state.system.at(dt=dt), state.step)
        for _ in range(steps):
            state = velocity_verlet_step(state, iterations)
        assert_same_state(sim, state.system)
    assert sim.time == pytest.approx(5 * 0.002 + 4 * 0.0005 + 3 * 0.003, rel=1e-14)
    assert sim.step == 12


SPLITTING = [
    (2, "lucy", "general", "gaussian", "linear", (9, 8)),
    (2, "wendland_c2", "central", "gaussian", "tait", (14, 5)),
    (3, "lucy", "general", "gaussian", "linear", (5, 6, 5)),
    (3, "quintic_spline", "central", "gaussian", "ideal_gas", (5, 5, 5)),
    (3, "wendland_c4", "general", "none", "artificial_compressibility", (5, 5, 8)),
    (3, "wendland_c2", "none", "none", "table", (5, 5, 5)),
]


@pytest.mark.parametrize("dt", [0.002, 0.03])
@pytest.mark.parametrize(("dimension", "kernel", "friction", "noise", "eos", "cells"), SPLITTING)
def test_pair_splitting_trajectory(
    dimension: int,
    kernel: str,
    friction: str,
    noise: str,
    eos: str,
    cells: Sequence[int],
    dt: float,
) -> None:
    """The twin sweeps in the order the core reports before (forward) and after (backward)."""
    system = problem(
        dimension,
        kernel=kernel,
        friction=friction,
        noise=noise,
        eos=eos,
        cells=cells,
        dt=dt,
        body_force=(5.0, -3.0, 2.0)[:dimension],
    )
    sim = core(system, "pair_splitting")
    state = system
    for step in range(20):
        forward = np.asarray(sim.pair_order(), dtype=np.int64)
        sim.run(1, dt)
        backward = np.asarray(sim.pair_order(), dtype=np.int64)[::-1]
        state = pair_splitting_step(state, step, forward, backward)
        assert_same_state(sim, state, tolerance=1e-12 if step == 0 else 1e-10)
    assert np.abs(unwrapped(sim, system) - state.positions).max() < 1e-10


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("noise", ["gaussian", "none"])
def test_pair_splitting_in_several_sweeps(dimension: int, noise: str) -> None:
    """With friction that changes between the steps, as compensation does."""
    system = problem(dimension, noise=noise, dt=0.02)
    sim = core(system, "pair_splitting", iterations=3)
    state = system
    for step, scale in enumerate((1.0, 1.25)):
        across, along = scale * system.friction_across, scale * system.friction_along
        sim.set_friction(across, along)
        state = dataclasses.replace(state, friction_across=across, friction_along=along)
        forward = np.asarray(sim.pair_order(), dtype=np.int64)
        sim.run(1, system.dt)
        backward = np.asarray(sim.pair_order(), dtype=np.int64)[::-1]
        state = pair_splitting_step(state, step, forward, backward, sweeps=3)
        assert_same_state(sim, state, tolerance=1e-12 if step == 0 else 1e-10)
    with pytest.raises(ValueError, match="`friction_across` must be"):
        sim.set_friction(-1.0, 0.0)


@pytest.mark.parametrize(("cells", "support"), BOXES, ids=lambda value: str(value))
def test_pair_order_visits_every_pair_once(cells: Sequence[int], support: float) -> None:
    system = problem(len(cells), cells=cells, support=support)
    order = np.sort(np.asarray(core(system, "pair_splitting").pair_order(), dtype=np.int64), axis=1)
    listed = {(int(i), int(j)) for i, j in order}
    assert len(listed) == len(order)
    assert all(i != j for i, j in listed)
    needed = {(int(i), int(j)) for i, j in zip(system.pairs.i, system.pairs.j, strict=True)}
    assert needed <= listed


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
def test_same_trajectory_in_any_units(integrator: str) -> None:
    """Equal dimensionless groups at 1e-9 m, at 1e-1 m and in reduced units agree to 1e-9."""
    system = problem(3, dt=0.004)
    ends = []
    for length, mass, time in [(1.0, 1.0, 1.0), (3e-9, 2.7e-23, 1e-11), (0.1, 1.0, 30.0)]:
        scaled = rescaled(system, length, mass, time)
        sim = core(scaled, integrator)
        sim.run(20, scaled.dt)
        ends.append((unwrapped(sim, scaled) / length, sim.velocities * time / length))
    for positions, velocities in ends[1:]:
        assert np.abs(positions - ends[0][0]).max() < 1e-9
        assert np.abs(velocities - ends[0][1]).max() < 1e-9
