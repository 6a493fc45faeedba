"""Kinetic temperature of each component, by z-score, and the bias of velocity Verlet.

T_k = m sum_i v_ik^2 / ((N - 1) kT): the total momentum is conserved and zero, which takes one
degree of freedom a component. Each estimate is a mean of 32 blocks, each block much longer than
the slowest correlation time (a few friction times tau, or 1/(nu k^2) of the longest shear wave).
With 31 degrees of freedom |t| > 4.6 has p = 7e-5; the family below has about 50 members.

What Verlet does to the temperature follows from its map on one eigenmode of the friction matrix,
v' = -lambda v + noise (positions frozen, x = 1 - lambda dt/2), stationary variance over kT/m:

    iterations = 0 : 1 exactly (the stored force carries the friction of the half-step velocity)
    iterations = 1 : (g/2)(1 + x^2 + 2 x^3) / (1 - x^4), g = lambda dt, = 1 - g/4 + ...
    iterations = 2 : (g/2)(x^2 + y^2 + 2 x^2 y^2) / (1 - x^2 y^2), y = 1 - g x/2, = 1 - g/2 + ...

and the mean of lambda over the modes is 1/tau by the trace, so the first-order slopes against
dt/tau are 0, 1/4 and 1/2.
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
    assert 60 * 2.0 * stats.t.sf(LARGEST_T, BLOCKS - 1) < 0.01


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
    assert_agrees(kinetic_temperature(sim, system, samples=40, every=every), 1.0)


@pytest.mark.parametrize("noise", ["gaussian", "uniform"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_velocity_verlet(dimension: int, noise: str) -> None:
    """dt = tau/20: the known bias is 1.25 %, and the estimate must sit on it."""
    system = fluid(dimension, noise=noise)
    system = system.at(dt=0.05 * friction_time(system))
    sim = core(system, iterations=1)
    estimate = kinetic_temperature(sim, system, samples=30, every=15)
    rates = friction_spectrum(configuration(sim, system))
    assert_agrees(estimate, verlet_temperature(rates, system.dt, 1))


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_velocity_verlet_bias_is_first_order(iterations: int) -> None:
    system = fluid(3)
    tau = friction_time(system)
    ratios, biases, errors = np.array([0.08, 0.16, 0.32]), [], []
    for ratio in ratios:
        run = system.at(dt=ratio * tau)
        sim = core(run, iterations=iterations)
        estimate = kinetic_temperature(sim, run, samples=40, every=4)
        rates = friction_spectrum(configuration(sim, run))
        assert_agrees(estimate, verlet_temperature(rates, run.dt, iterations))
        biases.append(1.0 - estimate.overall)
        errors.append(estimate.overall_error)
    # weighted least squares through zero: the slope against dt/tau is iterations/4
    weight = ratios / np.square(errors)
    slope = float(np.sum(weight * biases) / np.sum(weight * ratios))
    print(iterations, slope, biases, errors)
