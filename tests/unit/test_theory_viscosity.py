"""Mean-field viscosity: against quadrature by other means, and its limits."""

import dataclasses

import numpy as np
import pytest

from sdpd import theory
from sdpd.theory.hydrodynamics import damped_wave


def fluid(kernel="wendland_c2", dimension=3, support=2.65, eta=20.0, **more):
    same = {"kernel": kernel, "dimension": dimension, "support": support}
    return theory.ViscosityTheory(
        density=theory.DensityTheory(
            **same, number_density=1.0, stiffness=100.0, compressibility_factor=100.0
        ),
        friction=theory.FrictionTheory(**same, density=1.0, shear_viscosity=eta),
        thermal_energy=1.0,
        **more,
    )


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("eta", [2.0, 20.0])
def test_long_waves_against_the_formula_of_mode_coupling(dimension, eta):
    """kB T/(60 pi^2) int q^4 (S'/S)^2 int f^2 dt dq (2D: q^3/(32 pi)), on a grid of its own."""
    found = fluid(dimension=dimension, eta=eta)
    q = np.linspace(1e-4, 14.0, 8001)
    structure = found.density.structure_factor(q)
    slope = np.gradient(np.log(structure), q)
    damping = found.friction.plane_wave_rates(q)[1]
    # of a damped oscillation that starts at rest: 1/(2 l) + l/(2 w^2)
    time = 0.5 / damping + 0.5 * damping * structure / q**2
    plane = q**3 / (32.0 * np.pi) if dimension == 2 else q**4 / (60.0 * np.pi**2)
    exact = np.trapezoid(plane * slope**2 * time, q)
    assert found.configurational() == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("kernel", ["lucy", "wendland_c2"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_waves_tend_to_long_ones(kernel, dimension):
    found = fluid(kernel, dimension)
    whole = found.configurational()
    shape = [found.configurational(k) / whole for k in (0.02, 0.2, 0.8, 2.0)]
    assert shape[0] == pytest.approx(1.0, abs=2e-3)
    assert shape == sorted(shape, reverse=True)


def test_waves_against_a_sum_over_a_grid_of_wave_vectors():
    """At a finite k, Cartesian and in 2D, with f_p f_q integrated step by step."""
    found, k = fluid(dimension=2, eta=3.0), 0.9
    grid = (np.arange(-80, 80) + 0.5) * 0.15
    qx, qy = np.meshgrid(grid, grid, indexing="ij")
    q, p = np.hypot(qx, qy), np.hypot(k - qx, qy)
    here, there = found.density.structure_factor(q), found.density.structure_factor(p)
    vertex = (qy * (1.0 / there - 1.0 / here)) ** 2 * here * there

    time = np.linspace(0.0, 6.0, 301)

    def decay(wave):
        number = np.linspace(1e-3, 18.0, 300)
        structure = found.density.structure_factor(number)
        damping = found.friction.plane_wave_rates(number)[1]
        rows = []
        for value, s, rate in zip(number, structure, damping, strict=True):
            even, odd, half = damped_wave(time, value / np.sqrt(s), 0.5 * rate)
            rows.append(even + half * odd)
        table = np.array(rows)
        return np.array([np.interp(wave, number, column) for column in table.T])

    overlap = np.trapezoid(decay(q.ravel()) * decay(p.ravel()), time, axis=0)
    total = float(vertex.ravel() @ overlap) * 0.15**2 / (2.0 * np.pi) ** 2
    assert found.configurational(k) == pytest.approx(0.5 / k**2 * total, rel=0.01)


def test_stiff_friction_adds_a_fixed_share():
    shares = [fluid(eta=eta).configurational() / eta for eta in (100.0, 200.0, 400.0)]
    assert shares == pytest.approx([shares[0]] * 3, rel=1e-3)
    assert fluid(eta=2.0).configurational() / 2.0 > 1.5 * shares[0]


def test_what_is_left_beyond_a_lag():
    found = fluid(eta=4.0)
    left = found.remaining(np.array([0.0, 0.05, 0.2, 1.0, 5.0]))
    assert left[0] == pytest.approx(1.0, rel=1e-12)
    assert (np.diff(left) < 0.0).all() and left[-1] < 1e-3
    assert float(found.remaining(found.relaxation_time(0.05))) == pytest.approx(0.05, rel=1e-3)
    # stress_time is the integral over lags of a function that begins at 1
    first = (1.0 - float(found.remaining(1e-4))) * found.stress_time / 1e-4
    assert first == pytest.approx(1.0, rel=0.01)


def test_large_steps_let_the_structure_relax_faster():
    plain = fluid(eta=20.0)
    tau = 1.0 / plain.friction.rate()
    found = [
        dataclasses.replace(plain, time_step=x * tau).configurational() for x in (1e-3, 2.0, 8.0)
    ]
    assert found[0] == pytest.approx(plain.configurational(), rel=1e-5)
    assert found[0] > found[1] > found[2]


def test_kinetic_part():
    found = fluid()
    assert found.kinetic == pytest.approx(0.5 / found.friction.rate())
    assert found.mass == 1.0


def test_theories_of_different_fluids_are_refused():
    one, two = fluid(), fluid("lucy")
    with pytest.raises(ValueError, match=r"`friction\.kernel` must be that of `density`"):
        dataclasses.replace(one, friction=two.friction)
    with pytest.raises(ValueError, match="`wave_number` must be finite and >= 0"):
        one.configurational(-1.0)
    with pytest.raises(ValueError, match="`share` must lie between 0 and 1"):
        one.relaxation_time(1.5)
