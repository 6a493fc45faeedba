"""Pairs in single precision beside the O(N^2) twin and beside the core in double precision.

A pair's separation is right to 2^-32 of the box and then to 6e-8 of itself, and each force is a sum
of some hundred terms that largely cancel: errors are a few 1e-7 of the root mean square force.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import _core

from .build import DIMENSIONS, FRICTIONS, core, problem
from .twin import System

KERNELS = _core.kernel_names()
CLOSE = 2e-6  # of the root mean square
Array = NDArray[np.float64]


def mixed_core(system: System, integrator: str = "velocity_verlet", **options: Any) -> Any:
    return core(system, integrator, precision="mixed", **options)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("noise", ["gaussian", "uniform", "none"])
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_densities_and_forces(dimension: int, kernel: str, friction: str, noise: str) -> None:
    system = problem(dimension, kernel=kernel, friction=friction, noise=noise)
    sim = mixed_core(system)
    assert np.abs(sim.number_densities / system.number_densities - 1.0).max() < 1e-6
    expected = system.forces().total
    error = np.abs(np.asarray(sim.forces) - expected).max()
    assert 0.0 < error < CLOSE * rms(expected)


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_twenty_steps_beside_double_precision(
    dimension: int, friction: str, integrator: str
) -> None:
    system = problem(dimension, friction=friction, noise="gaussian")
    mixed = mixed_core(system, integrator)
    double = core(system, integrator)
    for sim in (mixed, double):
        sim.run(20, system.dt)
    for name in ("positions", "velocities"):
        its, other = np.asarray(getattr(mixed, name)), np.asarray(getattr(double, name))
        difference = np.abs(its - other)
        difference = np.minimum(difference, np.abs(difference - system.box))
        assert 0.0 < difference.max() < 1e-5, name


def test_re_evaluated_drag_beside_double_precision() -> None:
    system = problem(3)
    mixed = mixed_core(system, iterations=2)
    double = core(system, iterations=2)
    for sim in (mixed, double):
        sim.run(20, system.dt)
    assert np.abs(np.asarray(mixed.velocities) - np.asarray(double.velocities)).max() < 1e-5


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_momentum_is_conserved_to_rounding(dimension: int, integrator: str) -> None:
    """Each pair gives one particle what it takes from the other, in double precision."""
    system = problem(dimension)
    sim = mixed_core(system, integrator)
    sim.run(300, system.dt)
    assert np.abs(np.asarray(sim.velocities).sum(axis=0)).max() < 1e-12 * system.size


def test_errors_do_not_grow_with_the_box() -> None:
    """Single precision coordinates of a box of a thousand supports would be off by 1e-4 of one."""
    system = problem(2, cells=(2500, 6))
    found = []
    for precision in ("mixed", "double"):
        found.append(np.asarray(core(system, precision=precision).forces))
    mixed, double = found
    assert np.abs(mixed - double).max() < 2.0 * CLOSE * rms(double)


def test_pairs_almost_on_top_of_each_other() -> None:
    base = problem(3, cells=(6, 6, 6), support=2.0, jitter=0.0)
    positions = base.positions.copy()
    positions[1] = positions[0] + [1e-6, 0.0, 0.0]
    positions[3] = positions[2] + [0.0, -1e-3, 0.0]
    system = base.at(positions=np.mod(positions, base.box))
    forces = np.asarray(mixed_core(system).forces)
    assert np.all(np.isfinite(forces))
    near = np.zeros(system.size, dtype=bool)
    near[[0, 1]] = True  # e_ij at 1e-6 is known to 6 * 2^-32 / 1e-6
    error = np.abs(forces - system.forces().total)
    scale = rms(system.forces().total)
    assert error[~near].max() < 10.0 * CLOSE * scale
    assert error[near].max() < 1e-2 * scale


@pytest.mark.parametrize("kernel", KERNELS)
def test_energy_of_a_fluid_without_friction(kernel: str) -> None:
    """The rounding of the forces must not heat: what the total energy does is that of double."""
    drifts = {}
    for precision in ("mixed", "double"):
        system = problem(3, kernel=kernel, friction="none", noise="none", viscosity=0.0)
        sim = core(system, precision=precision)
        energies = []
        for _ in range(21):
            kind, parameters = system.eos
            potential = _core.eos_evaluate(kind, parameters, np.asarray(sim.densities))[2]
            kinetic = 0.5 * np.sum(np.asarray(sim.velocities) ** 2)
            energies.append(kinetic + system.mass * np.sum(potential))
            sim.run(50, 0.5 * system.dt)
        drifts[precision] = np.polyfit(np.arange(21), energies, 1)[0] / energies[0]
    assert abs(drifts["mixed"] - drifts["double"]) < 2e-6
