"""The twin checked by itself: known answers, quadrature, finite differences, conservation laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, stats

from .build import DIMENSIONS, EQUATIONS_OF_STATE, FRICTIONS, problem
from .twin import (
    KERNELS,
    System,
    Trajectory,
    force_factor,
    kernel_value,
    pair_counters,
    pair_splitting_step,
    pair_variates,
    philox4x32,
    pressure,
    sound_speed_squared,
    specific_potential,
    velocity_verlet_step,
)
from .twin.kernels import profile

# Random123 1.14, examples/kat_vectors, philox4x32 10: counter, key, answer.
KNOWN_ANSWERS = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000",
     "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff",
     "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0",
     "d16cfe09 94fdcceb 5001e420 24126ea1"),
]  # fmt: skip


def words(text: str) -> np.ndarray:
    return np.array([[int(word, 16) for word in text.split()]], dtype=np.uint64)


# --- kernels ---------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_kernel_integrates_to_one(kernel: str, dimension: int) -> None:
    h = 1.7
    shell = 2.0 * np.pi if dimension == 2 else 4.0 * np.pi

    def integrand(r: float) -> float:
        return float(shell * r ** (dimension - 1) * kernel_value(kernel, dimension, r, h))

    total = integrate.quad(integrand, 0.0, h, points=[h / 3, 2 * h / 3])[0]
    assert total == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_force_factor_is_minus_slope_over_r(kernel: str, dimension: int) -> None:
    h = 1.7
    q = np.concatenate([np.linspace(0.01, 0.999, 200), [1.0 / 3.0, 2.0 / 3.0]])
    slope = np.imag(profile(kernel, dimension, q + 1e-200j)) / 1e-200
    expected = -slope / q / h ** (dimension + 2)
    got = force_factor(kernel, dimension, q * h, h)
    scale = force_factor(kernel, dimension, np.zeros(1), h)[0]
    assert np.max(np.abs(got - expected)) < 1e-13 * scale
    assert np.all(got >= 0.0)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_force_factor_second_moment_is_the_dimension(kernel: str, dimension: int) -> None:
    """Integral of F r^2 over space is D for every kernel, from integration by parts."""
    shell = 2.0 * np.pi if dimension == 2 else 4.0 * np.pi

    def integrand(r: float) -> float:
        return float(shell * r ** (dimension + 1) * force_factor(kernel, dimension, r, 1.0))

    total = integrate.quad(integrand, 0.0, 1.0, points=[1 / 3, 2 / 3])[0]
    assert total == pytest.approx(dimension, abs=1e-11)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_force_factor_is_finite_and_continuous_at_zero(kernel: str, dimension: int) -> None:
    f = force_factor(kernel, dimension, np.array([0.0, 1e-300, 1e-12, 1e-9]), 1.0)
    assert np.all(np.isfinite(f))
    assert f == pytest.approx(f[0], rel=1e-7)
    if kernel == "quintic_spline":  # F(0) = 1080 N_D / h^(D+2), W(0) = 66 N_D / h^D
        w = kernel_value(kernel, dimension, np.zeros(1), 1.0)[0]
        assert f[0] / w == pytest.approx(1080.0 / 66.0, rel=1e-14)


@pytest.mark.parametrize("kernel", KERNELS)
def test_kernel_vanishes_from_the_support_on(kernel: str) -> None:
    r = np.array([1.0, 1.0 + 1e-15, 1.5, 10.0])
    assert np.all(kernel_value(kernel, 3, r, 1.0) == 0.0)
    assert np.all(force_factor(kernel, 3, r, 1.0) == 0.0)


# --- equations of state ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", EQUATIONS_OF_STATE)
def test_specific_potential_slope_is_pressure_over_density_squared(kind: str) -> None:
    parameters = EQUATIONS_OF_STATE[kind]
    rho = np.linspace(0.4, 1.6, 61) + 1e-3
    step = 1e-5
    high = specific_potential(kind, parameters, rho + step, 1.0)
    low = specific_potential(kind, parameters, rho - step, 1.0)
    expected = pressure(kind, parameters, rho) / rho**2
    assert np.allclose((high - low) / (2 * step), expected, atol=1e-5 * np.abs(expected).max())
    assert specific_potential(kind, parameters, np.ones(1), 1.0)[0] == 0.0


@pytest.mark.parametrize("kind", EQUATIONS_OF_STATE)
def test_sound_speed_is_the_slope_of_the_pressure(kind: str) -> None:
    parameters = EQUATIONS_OF_STATE[kind]
    rho = np.linspace(0.4, 1.6, 61) + 1e-3
    step = 1e-6
    slope = pressure(kind, parameters, rho + step) - pressure(kind, parameters, rho - step)
    got = sound_speed_squared(kind, parameters, rho)
    assert np.allclose(got, slope / (2 * step), atol=2e-4 * np.abs(got).max())


def test_table_is_monotone_smooth_and_straight_beyond_its_ends() -> None:
    parameters = EQUATIONS_OF_STATE["table"]
    nodes, values = np.split(np.asarray(parameters), 2)
    assert np.allclose(pressure("table", parameters, nodes), values, rtol=1e-14)
    fine = np.linspace(nodes[0], nodes[-1], 4001)
    p = pressure("table", parameters, fine)
    rising = np.diff(values)[np.searchsorted(nodes, fine[1:] - 1e-9) - 1] > 0
    inside = np.abs(fine[1:, None] - nodes[None, :]).min(axis=1) > fine[1] - fine[0]
    assert np.all((np.diff(p) >= -1e-12) == rising, where=inside)
    beyond = np.array([-0.2, -0.1]) + nodes[0], np.array([0.1, 0.2]) + nodes[-1]
    for end, rho in zip((nodes[0], nodes[-1]), beyond, strict=True):
        slope = (pressure("table", parameters, rho) - pressure("table", parameters, end)) / (
            rho - end
        )
        assert np.ptp(slope) < 1e-9


# --- noise -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_known_answers(counter: str, key: str, answer: str) -> None:
    assert np.array_equal(philox4x32(words(counter), words(key)), words(answer))


def test_pair_counters_are_distinct_also_for_large_ids() -> None:
    ids = np.array([0, 1, 2, 2**32 - 1, 2**32, 2**32 + 1, 2**40, 2**63, 2**64 - 1], dtype=np.uint64)
    i, j = np.triu_indices(len(ids), 1)
    seen = [
        tuple(row)
        for stream, step, draw in [
            ("pair_force", 0, 0),
            ("pair_force", 1, 0),
            ("pair_force", 2**32, 0),
            ("pair_exchange", 0, 0),
            ("pair_exchange", 0, 1),
        ]
        for row in pair_counters(stream, step, draw, ids[i], ids[j])
    ]
    assert len(set(seen)) == len(seen)
    assert np.array_equal(
        pair_counters("pair_force", 7, 0, ids[i], ids[j]),
        pair_counters("pair_force", 7, 0, ids[j], ids[i]),
    )


@pytest.mark.parametrize("variate", ["gaussian", "uniform"])
def test_variates_have_zero_mean_unit_variance_and_no_cross_correlation(variate: str) -> None:
    n = 200_000
    a = np.arange(n, dtype=np.uint64)
    x = pair_variates(11, "pair_force", 3, 0, a, a + np.uint64(1), variate, 3)
    law = stats.norm() if variate == "gaussian" else stats.uniform(-(3**0.5), 2 * 3**0.5)
    for column in x.T:  # 4 families of 3 tests each; 4.5 sigma is p = 7e-6
        assert abs(column.mean()) * np.sqrt(n) < 4.5
        assert abs(np.mean(column**2) - 1.0) / np.sqrt((law.stats("k") + 2.0) / n) < 4.5
        assert stats.kstest(column, law.cdf).pvalue > 1e-4
    cross = np.abs([np.mean(x[:, p] * x[:, q]) for p, q in ((0, 1), (0, 2), (1, 2))])
    assert np.all(cross * np.sqrt(n) < 4.5)


# --- forces ----------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("kind", EQUATIONS_OF_STATE)
@pytest.mark.parametrize("kernel", KERNELS)
def test_conservative_force_is_minus_the_gradient(kernel: str, kind: str, dimension: int) -> None:
    system = problem(dimension, kernel=kernel, eos=kind, friction="none", cells=(5,) * dimension)
    force = system.forces().conservative
    rng = np.random.default_rng(5)
    for _ in range(3):
        way = rng.standard_normal(system.positions.shape)
        step = 1e-5
        u = [
            system.at(positions=system.positions + s * step * way).potential_energy(1.0)
            for s in (-2, -1, 1, 2)
        ]
        slope = (8.0 * (u[2] - u[1]) - (u[3] - u[0])) / (12.0 * step)
        work = -float(np.sum(force * way))
        assert slope == pytest.approx(work, abs=1e-6 * np.linalg.norm(force) * np.linalg.norm(way))


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
def test_momentum(friction: str, dimension: int) -> None:
    forces = problem(dimension, friction=friction).forces(step=4)
    for part in forces:
        assert np.all(np.abs(part.sum(axis=0)) < 1e-12 * np.abs(part).sum())
        assert np.abs(part).max() > 1.0


def angular(vector: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Sum of r x f: one number in 2D, three in 3D."""
    return np.atleast_1d(np.cross(pad(vector), pad(force)).sum(axis=0))


def pad(vector: np.ndarray) -> np.ndarray:
    return np.pad(vector, ((0, 0), (0, 3 - vector.shape[1])))


def free_cluster(system: System) -> System:
    """The same particles in a box so large that no image interacts."""
    return system.at(positions=system.positions + 10.0, box=system.box + 20.0)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_central_friction_exerts_no_torque(dimension: int) -> None:
    central = free_cluster(problem(dimension, friction="central"))
    general = free_cluster(problem(dimension, friction="general"))
    for part in central.forces():
        scale = np.sum(np.abs(pad(part)).sum(axis=1) * np.abs(central.positions).sum(axis=1))
        assert np.all(np.abs(angular(central.positions, part)) < 1e-13 * scale)
    for part in general.forces()[1:]:
        assert np.abs(angular(general.positions, part)).max() > 1.0


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
def test_fluctuation_dissipation_by_matrices(friction: str, dimension: int) -> None:
    """B B^T = 2 kT Gamma exactly: B from unit variates, Gamma from unit velocities, per pair."""
    system = replace(problem(dimension, friction=friction), thermal_energy=1.7)
    p = system.pairs
    a, b = system.across_along
    g = system.coupling(p)
    eye = np.eye(dimension)
    ee = p.unit[:, :, None] * p.unit[:, None, :]
    gamma = g[:, None, None] * (a * eye + b * ee)
    if friction == "central":
        amplitude = np.sqrt(2.0 * 1.7 * g * b)[:, None, None] * p.unit[:, :, None]
    else:
        amplitude = np.sqrt(2.0 * 1.7 * g)[:, None, None] * (
            np.sqrt(a) * eye + (np.sqrt(a + b) - np.sqrt(a)) * ee
        )
    assert np.allclose(
        amplitude @ amplitude.transpose(0, 2, 1), 2 * 1.7 * gamma, rtol=0, atol=1e-13 * gamma.max()
    )
    # the same matrices are what the pair forces use
    xi = system.variates(p, 9, "pair_force", 0)
    expected = np.einsum("pab,pb->pa", amplitude, xi) / np.sqrt(system.dt)
    assert np.allclose(system.pair_random(p, 9), expected, rtol=0, atol=1e-12 * np.abs(xi).max())
    drag = -system.friction_matrix() @ system.velocities.ravel()
    got = system.forces().dissipative.ravel()
    assert np.allclose(drag, got, rtol=0, atol=1e-12 * np.abs(got).max())
    assert np.linalg.eigvalsh(system.friction_matrix()).min() > -1e-11 * np.abs(drag).max()


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
def test_friction_rate_is_the_trace_of_the_friction_matrix(friction: str, dimension: int) -> None:
    system = problem(dimension, friction=friction)
    trace = np.trace(system.friction_matrix()) / (system.size * dimension * system.mass)
    assert system.friction_rates().mean() == pytest.approx(trace, rel=1e-13)


def test_densities_of_a_square_lattice_by_hand() -> None:
    """Support between sqrt 2 and 2: four neighbours at 1, four at sqrt 2, and the self term."""
    system = problem(2, support=1.9, cells=(6, 6), jitter=0.0)
    w = kernel_value("lucy", 2, np.array([0.0, 1.0, np.sqrt(2.0)]), 1.9)
    assert np.allclose(system.number_densities, w @ [1.0, 4.0, 4.0], rtol=1e-14)


def test_stress_is_the_volume_derivative_of_the_energy() -> None:
    """dU under a uniform strain eps is V stress : eps, for the conservative part."""
    system = problem(3, friction="none", cells=(5, 5, 5))
    stress = system.virial_stress(system.pair_conservative(system.pairs))
    step = 1e-6
    for axis in range(3):
        stretch = np.ones(3)
        energies = []
        for sign in (-1.0, 1.0):
            stretch[axis] = 1.0 + sign * step
            strained = system.at(positions=system.positions * stretch, box=system.box * stretch)
            energies.append(strained.potential_energy(1.0))
        slope = (energies[1] - energies[0]) / (2.0 * step)
        expected = stress[axis, axis] * np.prod(system.box)
        assert slope == pytest.approx(expected, rel=1e-6)


# --- integrators -----------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_verlet_energy_error_falls_as_dt_squared(dimension: int) -> None:
    base = problem(dimension, friction="none", cells=(5, 6, 5)[:dimension], jitter=0.2)
    errors, steps = [], (0.008, 0.004, 0.002)
    for dt in steps:
        state = Trajectory.start(base.at(dt=dt))
        energies = []
        for _ in range(round(0.12 / dt)):
            state = velocity_verlet_step(state, iterations=1)
            energies.append(state.system.kinetic_energy() + state.system.potential_energy(1.0))
        errors.append(np.std(energies))
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 < order < 2.1


@pytest.mark.parametrize("friction", FRICTIONS)
def test_splitting_conserves_momentum_and_relaxes_pairs_exactly(friction: str) -> None:
    """Momentum to rounding; without noise the mean of u decays by the exact exponential."""
    system = problem(3, friction=friction, cells=(5, 5, 5))
    order = np.argwhere(np.triu(np.ones((system.size,) * 2), 1))
    moved = pair_splitting_step(system, 0, order, order[::-1])
    assert np.all(np.abs(moved.velocities.sum(axis=0)) < 1e-11)
    still = system.at(noise="none", thermal_energy=0.0)
    pair = np.array([[3, 8]])
    from .twin.integrators import exchange_sweep

    p = still.geometry(pair[:, 0], pair[:, 1])
    a, b = still.across_along
    g = float(still.coupling(p)[0])
    u = still.velocities[3] - still.velocities[8]
    after = exchange_sweep(still, pair, 0, 0, 0.3).velocities
    matrix = -2.0 * g * (a * np.eye(3) + b * np.outer(p.unit[0], p.unit[0]))
    values, vectors = np.linalg.eigh(matrix)
    exact = vectors @ (np.exp(values * 0.3) * (vectors.T @ u))
    assert np.allclose(after[3] - after[8], exact, atol=1e-14)
