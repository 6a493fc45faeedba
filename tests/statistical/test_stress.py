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
MEMBERS = 24
ETA, ZETA = 20.0, 15.0
LARGEST_Z = float(stats.norm.isf(0.5 * LEVEL / MEMBERS))
FAULT = 0.05


@functools.cache
def random_moments(dimension: int, friction: str) -> tuple[np.ndarray, np.ndarray]:
    """Random moment over each step of Verlet, and its variance from the positions."""
    steps = 1000 if dimension == 2 else 600
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
def equilibrium(
    dimension: int,
) -> tuple[sdpd.Simulation, sdpd.StressCorrelator, sdpd.Stress, np.ndarray]:
    """A viscous fluid with a bulk viscosity, and its friction as the particles lie in the run."""
    scene = sdpd.Scene(
        fluid=sdpd.Fluid(
            density=1.0,
            shear_viscosity=ETA,
            bulk_viscosity=ZETA,
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=sdpd.eos.IdealGas(),
        ),
        box=sdpd.Box((14.0, 14.0) if dimension == 2 else (8.0, 8.0, 8.0)),
        resolution=sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        sound_speed=10.0,
        start=sdpd.RandomStart(),
    )
    sim = sdpd.Simulation(scene, integrator="pair_splitting", dt=0.002, seed=3, threads=1)
    sim.run(steps=600)
    series = sdpd.Stress(every=5)
    correlator = sdpd.StressCorrelator(every=1, points=4, levels=5)
    steps, frames = (4000, 8) if dimension == 2 else (1600, 4)
    friction = []
    sim.run(
        steps=steps,
        observe=[correlator, series],
        callback=lambda s: friction.append(pair_viscosities(s)),
        every=steps // frames,
    )
    return sim, correlator, series, np.array(friction)


def pair_viscosities(sim: sdpd.Simulation) -> tuple[float, float]:
    """Sums g r_a^2 (a + b e_b^2)/V over pairs, off and on the diagonal."""
    scene, d = sim.scene, sim.scene.dimension
    r, box = np.array(sim.positions), np.asarray(scene.box.lengths)
    i, j = np.triu_indices(len(r), 1)
    apart = r[i] - r[j]
    apart -= box * np.rint(apart / box)
    distance = np.linalg.norm(apart, axis=1)
    near = distance < scene.support_radius
    apart, distance, i, j = apart[near], distance[near], i[near], j[near]
    density = np.array(sim.number_densities)
    _, f = sdpd.kernels.evaluate("wendland_c2", d, distance, scene.support_radius)
    g = f / (density[i] * density[j])
    across, along = ETA * (1.0 + 2.0 / d) - ZETA, (d + 2.0) * (ZETA + ETA * (1.0 - 2.0 / d))
    cosine2 = (apart / distance[:, None]) ** 2
    tensor = np.einsum("p,pa,pb->ab", g, apart**2, across + along * cosine2)
    tensor /= scene.box.volume
    off = ~np.eye(d, dtype=bool)
    return float(tensor[off].mean()), float(tensor[~off].mean())


@pytest.mark.parametrize("component", ["shear", "longitudinal", "bulk"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_short_time_viscosities(dimension: int, component: str) -> None:
    """Einstein-Helfand over the shortest lags gives the viscosities of drag and noise.

    They are exact averages over where the particles are; stress that relaxes, and momentum that
    particles carry, have added less than 2 % of the input by then.
    """
    sim, correlator, _, friction = equilibrium(dimension)
    shear, longitudinal = friction.mean(axis=0)
    share = 2.0 - 2.0 / dimension
    expected = {
        "shear": shear,
        "longitudinal": longitudinal,
        "bulk": longitudinal - share * shear,
    }[component]
    estimate = analysis.einstein_viscosity(
        correlator.increments(component, n_blocks=32),
        volume=sim.scene.box.volume,
        thermal_energy=1.0,
        window=(0.0, sim.dt),
    )
    scale = ETA if component == "shear" else ZETA + share * ETA
    assert LARGEST_Z * estimate.stderr < 3.0 * FAULT * scale, "too few steps to see a fault"
    assert abs(estimate.value - expected) < LARGEST_Z * estimate.stderr + 0.02 * scale
    nominal = {"shear": ETA, "longitudinal": ZETA + share * ETA, "bulk": ZETA}[component]
    assert expected == pytest.approx(nominal, rel=0.12)  # the kernel's own share is lost


@pytest.mark.parametrize("dimension", [2, 3])
def test_virial_and_kinetic_pressure(dimension: int) -> None:
    """Kinetic: (N - 1) kT/V with the excess of half a kick; drag and noise have no mean."""
    sim, _, series, _ = equilibrium(dimension)
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
