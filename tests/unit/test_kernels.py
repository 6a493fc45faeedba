"""The constants of the kernels against quadrature of the kernels themselves."""

import math

import numpy as np
import pytest

import sdpd
from sdpd import kernels, structure

NAMES = kernels.names()
DIMENSIONS = (2, 3)
# physics of the field (friction integral, self-diffusion factor): W and F of the literature
SELF_DIFFUSION = {
    ("lucy", 2): 1 / 20,
    ("lucy", 3): 3 / 70,
    ("quintic_spline", 2): 239 / 8316,
    ("quintic_spline", 3): 1 / 40,
    ("wendland_c2", 2): 1 / 28,
    ("wendland_c2", 3): 9 / 280,
    ("wendland_c4", 2): 1 / 36,
    ("wendland_c4", 3): 27 / 1100,
}


def integral(values_of_r, dimension, support=1.0):
    """Integral over the support by Gauss-Legendre panels, exact for the polynomial kernels."""
    x, weight = np.polynomial.legendre.leggauss(40)
    r = np.concatenate([(k + 0.5 * (x + 1)) * support / 3 for k in range(3)])
    weight = np.tile(weight * support / 6, 3)
    sphere = 2 * np.pi * r if dimension == 2 else 4 * np.pi * r**2
    return float(np.sum(weight * sphere * values_of_r(r)))


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("name", NAMES)
class TestConstants:
    def test_unit_integral(self, name, dimension):
        for h in (1.0, 3e-9):
            total = integral(lambda r: kernels.evaluate(name, dimension, r, h)[0], dimension, h)  # noqa: B023
            assert total == pytest.approx(1.0, rel=1e-13)

    def test_second_moment_of_f_is_the_dimension(self, name, dimension):
        moment = integral(lambda r: kernels.evaluate(name, dimension, r)[1] * r**2, dimension)
        assert moment == pytest.approx(dimension, rel=1e-13)

    def test_f_is_minus_the_derivative_over_r(self, name, dimension):
        r = np.linspace(0.03, 0.99, 60)
        step = 1e-5
        after, _ = kernels.evaluate(name, dimension, r + step)
        before, _ = kernels.evaluate(name, dimension, r - step)
        _, f = kernels.evaluate(name, dimension, r)
        np.testing.assert_allclose(-(after - before) / (2 * step) / r, f, rtol=1e-6, atol=1e-7)

    def test_vanishes_at_and_beyond_the_support(self, name, dimension):
        w, f = kernels.evaluate(name, dimension, [1.0, 1.5, 40.0])
        assert not w.any()
        assert not f.any()

    def test_f_is_finite_at_the_origin(self, name, dimension):
        _, f = kernels.evaluate(name, dimension, [0.0, 1e-7])
        assert f[0] == pytest.approx(f[1], rel=1e-5)

    def test_self_value(self, name, dimension):
        w, _ = kernels.evaluate(name, dimension, 0.0)
        assert kernels.get(name).self_value(dimension) == pytest.approx(float(w), rel=1e-14)

    def test_friction_integral(self, name, dimension):
        found = integral(lambda r: kernels.evaluate(name, dimension, r)[1], dimension)
        assert kernels.get(name).friction_integral[dimension - 2] == pytest.approx(found, rel=1e-12)
        w0 = kernels.get(name).self_value(dimension)
        if dimension == 2:  # 2 pi W(0)
            assert found == pytest.approx(2 * np.pi * w0, rel=1e-12)

    def test_self_diffusion_factor(self, name, dimension):
        factor = kernels.get(name).self_diffusion_factor(dimension)
        assert factor == pytest.approx(SELF_DIFFUSION[name, dimension], rel=1e-12)

    def test_pairing_limit(self, name, dimension):
        listed = kernels.get(name).pairing_limit[dimension - 2]
        low = structure.pairing_susceptibility(name, dimension, 1.0, 1.0)[0]
        if math.isinf(listed):
            assert low == 0.0
        else:
            assert 1.0 / low == pytest.approx(listed, rel=0.02)

    def test_acoustic_factor(self, name, dimension):
        found = structure.acoustic_wavenumber(name, dimension, 1.0)
        listed = kernels.get(name).acoustic_factor[dimension - 2]
        assert found == pytest.approx(listed, abs=0.006)

    def test_fourier_transform(self, name, dimension):
        assert kernels.fourier_transform(name, dimension, 0.0) == pytest.approx(1.0, rel=1e-13)
        # 1 - k^2 <r^2> / (2 D) at small k
        second = integral(lambda r: kernels.evaluate(name, dimension, r)[0] * r**2, dimension)
        small = kernels.fourier_transform(name, dimension, 1e-2)
        assert float(small) == pytest.approx(1 - 1e-4 * second / (2 * dimension), abs=1e-10)


def test_fourier_transform_in_two_dimensions_against_bessel():
    special = pytest.importorskip("scipy.special")
    kh = np.array([0.5, 3.0, 10.2, 16.2, 35.0])
    for name in NAMES:
        expected = [
            integral(lambda r: kernels.evaluate(name, 2, r)[0] * special.j0(k * r), 2)  # noqa: B023
            for k in kh
        ]
        np.testing.assert_allclose(kernels.fourier_transform(name, 2, kh), expected, atol=1e-13)


def test_smallest_values_of_the_transforms():
    kh = np.linspace(0.05, 40, 800)
    for name, dimension, low in (
        ("lucy", 3, -1.74e-3),
        ("lucy", 2, -6.4e-5),
        ("quintic_spline", 2, -2.5e-5),
        ("quintic_spline", 3, -2.2e-5),
    ):
        found = kernels.fourier_transform(name, dimension, kh).min()
        assert found == pytest.approx(low, rel=0.03)
    for name in ("wendland_c2", "wendland_c4"):
        for dimension in DIMENSIONS:
            assert kernels.fourier_transform(name, dimension, kh).min() > 0.0


@pytest.mark.parametrize(
    ("name", "support", "stiffness", "variance"),
    [  # Var d / n^2 of the random-phase approximation, P = c^2 rho, in three dimensions
        ("lucy", 2.2, 100, 1.204e-3),
        ("lucy", 2.65, 100, 6.89e-4),
        ("lucy", 3.0, 100, 4.75e-4),
        ("wendland_c2", 2.2, 100, 1.84e-3),
        ("wendland_c2", 3.0, 400, 1.88e-4),
        ("quintic_spline", 3.0, 400, 2.744e-4),
    ],
)
def test_density_deviation(name, support, stiffness, variance):
    found = structure.density_deviation(name, 3, support, stiffness, stiffness)
    assert found**2 == pytest.approx(variance, rel=0.01)


def test_density_deviation_of_artificial_compressibility():
    for support, variance in ((2.2, 5.12e-3), (2.65, 2.93e-3), (3.0, 2.02e-3)):
        found = structure.density_deviation("lucy", 3, support, 100.0, 0.0)
        assert found**2 == pytest.approx(variance, rel=0.01)
    found = structure.density_deviation("lucy", 2, 2.65, 100.0, 100.0)
    assert found**2 == pytest.approx(1.55e-3, rel=0.01)


def test_density_deviation_of_a_fluid_that_clumps_is_unknown():
    assert structure.density_deviation("lucy", 3, 3.0, 400.0, 400.0) is None


def test_registry_agrees_with_the_core():
    from sdpd import _core

    assert sorted(_core.kernel_names()) == sorted(NAMES)


def test_kernel_prints_its_formula():
    assert str(kernels.get("lucy")).startswith("Lucy kernel: W h^D / N = (1 + 3q)(1 - q)^3")
    assert sdpd.kernels is kernels


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: kernels.get("lucie"), "did you mean 'lucy'?"),
        (lambda: kernels.evaluate("lucy", 4, 0.1), "`dimension` must be 2 or 3, got 4"),
        (lambda: kernels.evaluate("lucy", 3, -0.1), "`distance` must be finite and >= 0"),
        (lambda: kernels.evaluate("lucy", 3, 0.1, 0.0), "`support` must be finite and > 0, got 0"),
        (lambda: kernels.fourier_transform("lucy", 3, 101.0), "`kh` must be >= 0 and <= 100"),
    ],
)
def test_messages(call, text):
    with pytest.raises(ValueError) as caught:
        call()
    assert text in str(caught.value)
