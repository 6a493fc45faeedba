"""The stress in the loop against exact averages: random part, kinetic part, virial, viscosity.

The variance of the random moment over one step follows from where the particles are: in the same
run, 2 kT dt sum_pairs g r_a^2 (a + b e_b^2) for element (a, b), whatever the time step of velocity
Verlet. It sets the short-time viscosity. All z-scores are one family.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy import stats

import sdpd
from sdpd import analysis
from tests.reference.build import core, problem
from tests.reference.twin import System

LEVEL = 0.01
MEMBERS = 16
LARGEST_Z = float(stats.norm.isf(0.5 * LEVEL / MEMBERS))
FAULT = 0.05


@functools.cache
def random_moments(dimension: int, friction: str) -> tuple[np.ndarray, np.ndarray]:
    """Random moment over each step of Verlet, and its variance from the positions."""
    steps = 1000 if dimension == 2 else 400
    system = problem(dimension, friction=friction, viscosity=10.0, dt=0.001)
    sim = core(system, "velocity_verlet", iterations=0)
    stress = sim.attach_stress(1)
    expected = []
    for _ in range(steps + 1):
        sim.run(1, system.dt)
        expected.append(variance(system.at(positions=np.array(sim.positions))))
    rows = stress.table()[:, 2:].reshape(-1, 4, dimension, dimension)
    moments = rows[:, 3] * float(np.prod(system.box)) * system.dt
    # A step is half a kick of the old noise and half of the new one.
    mean = 0.25 * (np.array(expected)[1:] + np.array(expected)[:-1])
    return moments, mean


def variance(system: System) -> np.ndarray:
    p = system.pairs
    a, b = system.across_along
    g = system.coupling(p)
    e = p.unit
    terms = g[:, None, None] * p.vector[:, :, None] ** 2 * (a + b * e[:, None, :] ** 2)
    return 2.0 * system.thermal_energy * system.dt * terms.sum(axis=0)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("friction", ["general", "central"])
def test_variance_of_the_random_stress(dimension: int, friction: str) -> None:
    moments, expected = random_moments(dimension, friction)
    off = ~np.eye(dimension, dtype=bool)
    for chosen in (off, ~off):
        ratio = moments[:, chosen] ** 2 / expected[:, chosen]
        # Successive steps share a draw of noise: blocks of 20 are independent to a few per cent.
        estimate = analysis.block_average(ratio.mean(axis=1), n_blocks=len(ratio) // 20)
        assert LARGEST_Z * estimate.stderr < 0.25, "too few steps to see anything"
        assert abs(estimate.z(1.0)) < LARGEST_Z, estimate


@pytest.mark.parametrize("dimension", [2, 3])
def test_random_stress_has_no_mean(dimension: int) -> None:
    moments, expected = random_moments(dimension, "general")
    # Half kicks overlap, so the sum over n steps is that of n draws.
    z = moments.sum(axis=0) / np.sqrt(2.0 * expected.sum(axis=0))
    assert np.abs(z).max() < LARGEST_Z


@functools.cache
def equilibrium(dimension: int) -> tuple[sdpd.Simulation, sdpd.StressCorrelator, sdpd.Stress]:
    """A viscous fluid, long enough for the short lags."""
    scene = sdpd.Scene(
        fluid=sdpd.Fluid(
            density=1.0,
            shear_viscosity=20.0,
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=sdpd.eos.IdealGas(),
        ),
        box=sdpd.Box((14.0, 14.0) if dimension == 2 else (8.0, 8.0, 8.0)),
        resolution=sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        sound_speed=10.0,
        start=sdpd.RandomStart(),
    )
    sim = sdpd.Simulation(scene, integrator="pair_splitting", dt=0.004, seed=3, threads=1)
    sim.run(steps=300)
    correlator, series = sdpd.StressCorrelator(points=4, levels=5), sdpd.Stress(every=5)
    sim.run(steps=4000 if dimension == 2 else 1600, observe=[correlator, series])
    return sim, correlator, series


@pytest.mark.parametrize("dimension", [2, 3])
def test_short_time_viscosity_is_the_input(dimension: int) -> None:
    """Increments over the shortest lags: the viscosity of drag and noise at the particles at hand.

    Its exact value is the mean of sum_pairs g r_a^2 (a + b e_b^2)/(2 V), here from the last frames
    of the run; momentum carried by particles and stress that relaxes come on top at longer lags.
    """
    sim, correlator, _ = equilibrium(dimension)
    scene = sim.scene
    volume = scene.box.volume
    eta = analysis.einstein_viscosity(
        correlator.increments(part="collisional", n_blocks=32),
        volume=volume,
        thermal_energy=1.0,
        window=(0.0, 2 * sim.dt),
    )
    assert LARGEST_Z * eta.stderr < 3.0 * FAULT * 20.0, "too few steps to see a fault"
    factor = scene.factors.viscosity
    # The lattice knows the kernel's factor to 3 %, and conservative stress has begun to add to it.
    assert abs(eta.value - 20.0 * factor) < LARGEST_Z * eta.stderr + 0.04 * 20.0, (eta, factor)


@pytest.mark.parametrize("dimension", [2, 3])
def test_virial_and_kinetic_pressure(dimension: int) -> None:
    """Kinetic: (N - 1) kT/V with the excess of half a kick; drag and noise have no mean."""
    sim, _, series = equilibrium(dimension)
    pressure = analysis.virial_pressure(series.data, n_blocks=32)
    n, volume = sim.n_particles, sim.scene.box.volume
    force = np.array(sim.forces)
    excess = n / volume * sim.dt**2 * np.mean(force**2) / 4.0
    ideal = (n - 1) / volume
    assert excess < 0.03 * ideal
    assert LARGEST_Z * pressure.kinetic.stderr < FAULT * ideal
    assert abs(pressure.kinetic.value - ideal - excess) < LARGEST_Z * pressure.kinetic.stderr
    for part in (pressure.dissipative, pressure.random):
        assert abs(part.z(0.0)) < LARGEST_Z, part
