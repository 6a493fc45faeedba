"""Kinetic temperature of each component, by z-score, and the bias of velocity Verlet.

T_k = m sum_i v_ik^2 / ((N - 1) kT): the total momentum is conserved and zero, which takes one
degree of freedom a component. Each estimate is a mean of 32 blocks, each block much longer than
the slowest correlation time (a few friction times tau, or 1/(nu k^2) of the longest shear wave).
With 31 degrees of freedom |t| > 4.6 has p = 7e-5; the family below has about 80 members.

What Verlet does to the temperature follows from its map on one eigenmode of the friction matrix,
v' = -lambda v + noise (positions frozen, g = lambda dt, x = 1 - g/2), as stationary variance over
kT/m:

    iterations = 0 : 1 exactly (the stored force carries the drag of the half-step velocity)
    iterations = 1 : (g/2) (1 + x^2 + 2 x^3) / (1 - x^4) = 1 - g/4 + ...
    iterations = 2 : (g/2) (x^2 + y^2 + 2 x^2 y^2) / (1 - x^2 y^2), y = 1 - g x/2, = 1 - g/2 + ...

The mean of lambda over the modes is 1/tau by the trace, so the first-order slopes against dt/tau
are 0, 1/4 and 1/2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from tests.reference.build import core, problem
from tests.reference.twin import System

Array = NDArray[np.float64]

BLOCKS = 32
LARGEST_T = 4.6
LARGEST_ERROR = 0.005
SAMPLES = {2: 60, 3: 35}  # per block; the box of two dimensions has the slower shear wave


class Estimate(NamedTuple):
    """Mean and standard error per component (D,), and of their mean over components."""

    mean: Array
    error: Array
    overall: float
    overall_error: float


def fluid(dimension: int, **options: Any) -> System:
    """A stiff, viscous fluid: X = 100, eta* = 20, no image closer than two supports."""
    cells = (16, 14) if dimension == 2 else (6, 6, 6)
    return problem(dimension, cells=cells, support=2.65, jitter=0.1, bulk_viscosity=0.0, **options)


def friction_time(system: System) -> float:
    """tau = 1 / <sum_j g_ij (a + b/D)/m> of the given configuration."""
    return float(1.0 / system.friction_rates().mean())


def configuration(sim: Any, system: System) -> System:
    return system.at(positions=np.array(sim.positions), velocities=np.array(sim.velocities))


def kinetic_temperature(sim: Any, system: System, samples: int, every: int) -> Estimate:
    """Block means of T_k/T; `samples` per block, `every` steps apart."""
    sim.run(20 * every, system.dt)
    factor = system.mass / ((system.size - 1) * system.thermal_energy)
    blocks = np.empty((BLOCKS, system.dimension))
    for block in blocks:
        block[:] = 0.0
        for _ in range(samples):
            sim.run(every, system.dt)
            block += np.sum(np.asarray(sim.velocities) ** 2, axis=0)
    blocks *= factor / samples
    root = np.sqrt(BLOCKS)
    overall = blocks.mean(axis=1)
    return Estimate(
        blocks.mean(axis=0),
        blocks.std(axis=0, ddof=1) / root,
        float(overall.mean()),
        float(overall.std(ddof=1) / root),
    )


def assert_agrees(estimate: Estimate, exact: float) -> None:
    assert np.all(estimate.error < LARGEST_ERROR), "too few samples to see a fault of 2 %"
    t = (np.append(estimate.mean, estimate.overall) - exact) / np.append(
        estimate.error, estimate.overall_error
    )
    assert np.all(np.abs(t) < LARGEST_T), f"t = {t}, {estimate}, expected {exact}"


def test_the_bound_is_a_family_wise_one_percent() -> None:
    assert 80 * 2.0 * stats.t.sf(LARGEST_T, BLOCKS - 1) < 0.01


def verlet_temperature(rate: Array, dt: float, iterations: int) -> float:
    """Stationary temperature of the linear map above, averaged over the eigenmodes."""
    g = rate * dt
    x = 1.0 - 0.5 * g
    if iterations == 0:
        return 1.0
    if iterations == 1:
        return float(np.mean(0.5 * g * (1.0 + x**2 + 2.0 * x**3) / (1.0 - x**4)))
    y = 1.0 - 0.5 * g * x
    return float(np.mean(0.5 * g * (x**2 + y**2 + 2.0 * (x * y) ** 2) / (1.0 - (x * y) ** 2)))


def friction_spectrum(system: System) -> Array:
    """Eigenvalues of Gamma/m without the D rigid translations."""
    values = np.linalg.eigvalsh(system.friction_matrix()) / system.mass
    return values[system.dimension :]


@pytest.mark.parametrize("friction", ["general", "central"])
@pytest.mark.parametrize("multiple", [0.5, 2.0, 6.0])
@pytest.mark.parametrize("dimension", [2, 3])
def test_pair_splitting_has_no_bias(dimension: int, multiple: float, friction: str) -> None:
    """At half, two and six friction times, dt below a quarter of the acoustic limit."""
    viscosity = 20.0 if multiple < 4.0 else 60.0
    system = fluid(dimension, friction=friction, viscosity=viscosity)
    system = system.at(dt=multiple * friction_time(system))
    sim = core(system, "pair_splitting")
    every = 2 if multiple < 1.0 else 1
    assert_agrees(kinetic_temperature(sim, system, SAMPLES[dimension], every), 1.0)


@pytest.mark.parametrize("multiple", [0.5, 6.0])
def test_pairs_in_single_precision_have_no_bias(multiple: float) -> None:
    viscosity = 20.0 if multiple < 4.0 else 60.0
    system = fluid(3, viscosity=viscosity)
    system = system.at(dt=multiple * friction_time(system))
    sim = core(system, "pair_splitting", precision="mixed")
    every = 2 if multiple < 1.0 else 1
    assert_agrees(kinetic_temperature(sim, system, SAMPLES[3], every), 1.0)


@pytest.mark.parametrize("noise", ["gaussian", "uniform"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_velocity_verlet(dimension: int, noise: str) -> None:
    """dt = tau/10: the known bias is 2.5 %, and the estimate must sit on it."""
    system = fluid(dimension, noise=noise)
    system = system.at(dt=0.1 * friction_time(system))
    sim = core(system, iterations=1)
    estimate = kinetic_temperature(sim, system, SAMPLES[dimension], every=8)
    rates = friction_spectrum(configuration(sim, system))
    assert_agrees(estimate, verlet_temperature(rates, system.dt, 1))


def test_verlet_bias_without_sampling() -> None:
    """The slopes of the map above: 0, 1/4, 1/2 whatever the spectrum, by the trace alone."""
    system = fluid(3)
    rates = friction_spectrum(system)
    modes = system.dimension * (system.size - 1)
    assert rates.min() > 0.0
    mean = rates.sum() / modes
    for iterations, slope in ((0, 0.0), (1, 0.25), (2, 0.5)):
        dt = 1e-4 / mean
        bias = 1.0 - verlet_temperature(rates, dt, iterations)
        assert bias / 1e-4 == pytest.approx(slope, abs=1e-3)


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_velocity_verlet_bias_is_first_order(iterations: int) -> None:
    """Two steps of .15 and .3 tau against the map, and a line through zero against its slope."""
    system = fluid(3)
    tau = friction_time(system)
    ratios = np.array([0.15, 0.3])
    bias, error, expected = np.zeros((3, len(ratios)))
    for n, ratio in enumerate(ratios):
        run = system.at(dt=ratio * tau)
        sim = core(run, iterations=iterations)
        estimate = kinetic_temperature(sim, run, samples=30, every=3)
        rates = friction_spectrum(configuration(sim, run))
        bias[n], error[n] = 1.0 - estimate.overall, estimate.overall_error
        expected[n] = 1.0 - verlet_temperature(rates, run.dt, iterations)
    assert np.all(error < LARGEST_ERROR)
    assert np.all(np.abs(bias - expected) < LARGEST_T * error), (bias, expected, error)
    # weighted least squares through zero
    weight = ratios / error**2 / np.sum((ratios / error) ** 2)
    slope_error = float(np.sqrt(np.sum((weight * error) ** 2)))
    assert slope_error < 0.01, "too few samples to tell 1/4 from 0.3"
    assert float(np.sum(weight * (bias - expected))) == pytest.approx(
        0.0, abs=LARGEST_T * slope_error
    )
