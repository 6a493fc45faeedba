"""Lattice factors and plane waves against the published table and their own limits."""

import numpy as np
import pytest

import sdpd
from sdpd import discretization

ETA3 = {"across": 5 / 3, "along": 5 / 3}  # eta = 1, zeta = 0 in three dimensions
ETA2 = {"across": 2.0, "along": 0.0}  # and in two

# d/n, eta_eff/eta, friction rate / mean field, on the simple cubic lattice
TABLE = [
    ("wendland_c2", 2.05, 1.031, 0.879, 0.62),
    ("lucy", 2.2, 1.016, 0.950, 0.81),
    ("quintic_spline", 2.2, 1.012, 0.849, 0.59),
    ("wendland_c2", 2.2, 1.025, 0.915, 0.68),
    ("lucy", 2.64, 0.998, 0.991, 0.90),
    ("quintic_spline", 2.64, 1.000, 0.961, 0.77),
    ("wendland_c2", 2.64, 1.008, 0.948, 0.80),
    ("lucy", 3.0, 1.002, 0.996, 0.93),
    ("quintic_spline", 3.0, 1.000, 0.981, 0.84),
    ("wendland_c2", 3.0, 1.003, 0.983, 0.87),
    ("wendland_c2", 3.5, 1.002, 0.989, 0.91),
    ("wendland_c2", 4.0, 1.0005, 0.995, 0.94),
]


@pytest.mark.parametrize(("kernel", "support", "density", "viscosity", "friction"), TABLE)
def test_factors_of_the_cubic_lattice(kernel, support, density, viscosity, friction):
    factors = discretization.discrete_factors(kernel, 3, support, **ETA3)
    assert factors.density == pytest.approx(density, abs=6e-4)
    assert factors.viscosity == pytest.approx(viscosity, abs=6e-4)
    assert factors.friction == pytest.approx(friction, abs=6e-3)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", sdpd.kernels.names())
def test_factors_tend_to_one(kernel, dimension):
    given = ETA3 if dimension == 3 else ETA2
    factors = discretization.discrete_factors(kernel, dimension, 14.0, **given)
    assert factors.density == pytest.approx(1.0, abs=1e-3)
    assert factors.viscosity == pytest.approx(1.0, abs=5e-3)
    # the pairs closer than a spacing are missing, which the friction rate feels most
    assert factors.friction == pytest.approx(1.0, abs=0.04)


@pytest.mark.parametrize("dimension", [2, 3])
def test_viscosity_factor_is_the_long_wave_of_the_lattice(dimension):
    given = ETA3 if dimension == 3 else ETA2
    support, spacing, density = 2.6, 0.3, 7.0
    mass = density * spacing**dimension
    k = np.zeros(dimension)
    k[0] = 1e-3 / spacing
    rates = discretization.lattice_rates(
        "wendland_c2", dimension, support, k, spacing=spacing, mass=mass, **given
    )
    factors = discretization.discrete_factors("wendland_c2", dimension, support, **given)
    assert rates[1, 1] * density / k[0] ** 2 == pytest.approx(factors.viscosity, rel=1e-5)


def test_longitudinal_and_transverse_viscosity_on_a_fine_lattice():
    # Lucy, h/dx = 4: eta_T .998, eta_L 1.336 (4/3)
    k = [0.0, 0.0, 0.02]
    rates = discretization.lattice_rates("lucy", 3, 4.0, k, spacing=1.0, mass=1.0, **ETA3) / 0.02**2
    assert rates[0, 0] == pytest.approx(1.0017, abs=2e-3)
    assert rates[2, 2] == pytest.approx(1.336, abs=6e-3)
    assert abs(rates[0, 2]) < 1e-12
    np.testing.assert_allclose(rates, rates.T, atol=1e-15)


def test_continuum_rates_of_lucy():
    for dimension, given, expected in (
        (3, ETA3, (0.9988, 0.9951, 0.980, 0.924, 0.839)),
        (2, ETA2, (0.9986, 0.9944, 0.978, 0.915, 0.821)),
    ):
        k = np.array([0.25, 0.5, 1.0, 2.0, 3.0])
        rate = discretization.continuum_rate(
            "lucy", dimension, k, support_radius=1.0, density=1.0, **given
        )
        np.testing.assert_allclose(rate / k**2, expected, atol=6e-4)


def test_continuum_longitudinal_limit_with_bulk_viscosity():
    # (4/3 eta + zeta)/rho in three dimensions, eta (1 + 1 - 2/D) + zeta in general
    zeta, k = 0.4, 1e-2
    for dimension, expected in ((3, 4 / 3 + zeta), (2, 1 + zeta)):
        across = 1 + 2 / dimension - zeta
        along = (dimension + 2) * (zeta + 1 - 2 / dimension)
        rate = discretization.continuum_rate(
            "quintic_spline",
            dimension,
            k,
            support_radius=1.0,
            density=2.0,
            across=across,
            along=along,
            longitudinal=True,
        )
        assert float(rate) / k**2 * 2.0 == pytest.approx(expected, rel=1e-4)


def test_continuum_rate_tends_to_the_friction_rate_at_short_waves():
    rate = discretization.continuum_rate(
        "wendland_c4", 3, 90.0, support_radius=1.0, density=1.0, **ETA3
    )
    friction = (5 / 3 + 5 / 9) * sdpd.kernels.get("wendland_c4").friction_integral[1]
    assert float(rate) == pytest.approx(friction, rel=0.01)


def test_rates_do_not_depend_on_units():
    k = np.array([0.3, 0.1, -0.2])
    one = discretization.lattice_rates("lucy", 3, 2.5, k, spacing=1.0, mass=1.0, **ETA3)
    scale = 1e-9
    two = discretization.lattice_rates(
        "lucy", 3, 2.5, k / scale, spacing=scale, mass=scale**3, **ETA3
    )
    np.testing.assert_allclose(two * scale**2, one, rtol=1e-12, atol=1e-15)


def test_kernel_table():
    rows = discretization.kernel_table(dimension=2, supports=[3.0])
    assert [row.kernel for row in rows] == sdpd.kernels.names()
    assert rows[0].pairs == pytest.approx(0.5 * np.pi * 9)
    assert set(rows[0].as_dict()) >= {"kernel", "support", "pairs", "density", "viscosity"}
    assert len(discretization.kernel_table(names=["lucy"])) == 7


def test_wave_vector_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError, match=r"`wavevector` must have shape \(3,\), got \(2,\)"):
        discretization.lattice_rates("lucy", 3, 2.5, [1.0, 0.0], spacing=1.0, mass=1.0, **ETA3)
