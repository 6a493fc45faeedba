"""Density theory: numbers of an independent calculation, limits, closed forms."""

import math

import numpy as np
import pytest

from sdpd import kernels, theory

KERNELS = ["lucy", "quintic_spline", "wendland_c2", "wendland_c4"]


def fluid(kernel, dimension, ratio, x, z):
    return theory.DensityTheory(
        kernel=kernel,
        dimension=dimension,
        support=ratio,
        number_density=1.0,
        stiffness=x,
        compressibility_factor=z,
    )


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", KERNELS)
def test_transform_against_adaptive_quadrature(kernel, dimension):
    from scipy import integrate, special

    def integrand(q, kh):
        w = float(kernels.evaluate(kernel, dimension, q)[0])
        if dimension == 2:
            return 2.0 * math.pi * q * w * special.j0(kh * q)
        return 4.0 * math.pi * q**2 * w * np.sinc(kh * q / math.pi)

    for kh in (0.0, 1.0, 5.0, 12.0):
        exact, _ = integrate.quad(integrand, 0.0, 1.0, args=(kh,), points=(1 / 3, 2 / 3))
        assert float(theory.kernel_transform(kernel, dimension, kh)) == pytest.approx(
            exact, abs=1e-12
        )


def test_transform_of_lucy_in_closed_form():
    """Integrated by parts: 3D, (1 + 3q)(1 - q)^3 = 1 - 6 q^2 + 8 q^3 - 3 q^4."""
    x = np.array([0.5, 3.0, 10.0, 80.0, 300.0])
    # int_0^1 q^n sin(x q) dq by recursion from the cosine and sine at 1
    sine, cosine = [(1.0 - np.cos(x)) / x], [np.sin(x) / x]
    for n in range(1, 6):
        sine.append((-np.cos(x) + n * cosine[n - 1]) / x)
        cosine.append((np.sin(x) - n * sine[n - 1]) / x)
    exact = 105.0 / (4.0 * x) * (sine[1] - 6.0 * sine[3] + 8.0 * sine[4] - 3.0 * sine[5])
    ours = theory.kernel_transform("lucy", 3, x)
    assert ours[1:] == pytest.approx(exact[1:], abs=1e-13)
    assert ours[0] == pytest.approx(exact[0], abs=1e-9)  # the recursion cancels there


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", KERNELS)
def test_transform_is_one_at_zero_and_keeps_its_shape(kernel, dimension):
    values = theory.kernel_transform(kernel, dimension, np.zeros((2, 3)))
    assert values == pytest.approx(np.ones((2, 3)), abs=1e-14)


def test_parseval():
    assert theory.kernel_square_integral("wendland_c2", 3) == pytest.approx(
        np.trapezoid(
            theory.kernel_transform("wendland_c2", 3, np.linspace(0, 150, 6001)) ** 2
            * np.linspace(0, 150, 6001) ** 2
            / (2.0 * math.pi**2),
            np.linspace(0, 150, 6001),
        ),
        rel=1e-5,
    )


@pytest.mark.parametrize(
    ("kernel", "dimension", "ratio", "x", "z", "variance"),
    [
        ("lucy", 3, 2.2, 100, 100, 1.204e-3),
        ("lucy", 3, 2.65, 100, 100, 6.89e-4),
        ("lucy", 3, 3.0, 100, 100, 4.75e-4),
        ("lucy", 3, 2.2, 100, 0, 5.12e-3),
        ("lucy", 3, 2.65, 100, 0, 2.93e-3),
        ("lucy", 3, 3.0, 100, 0, 2.02e-3),
        ("lucy", 3, 2.2, 400, 0, 1.72e-3),
        ("lucy", 3, 2.65, 400, 0, 9.86e-4),
        ("lucy", 3, 3.0, 400, 0, 6.80e-4),
        ("wendland_c2", 3, 2.2, 100, 100, 1.84e-3),
        ("wendland_c2", 3, 2.65, 100, 100, 1.05e-3),
        ("wendland_c2", 3, 3.0, 400, 400, 1.88e-4),
        ("lucy", 2, 2.2, 100, 100, 2.24e-3),
        ("lucy", 2, 2.65, 100, 100, 1.55e-3),
        ("lucy", 2, 3.0, 100, 100, 1.21e-3),
        ("quintic_spline", 3, 3.0, 400, 400, 2.744e-4),
        ("quintic_spline", 2, 3.0, 900, 900, 2.389e-4),
    ],
)
def test_variance_of_the_kernel_density(kernel, dimension, ratio, x, z, variance):
    assert fluid(kernel, dimension, ratio, x, z).variance() == pytest.approx(variance, rel=5e-3)


@pytest.mark.parametrize(
    ("kernel", "dimension", "ratio", "x", "z", "bias"),
    [
        ("lucy", 3, 2.2, 100, 100, 1.00e-2),
        ("lucy", 3, 2.65, 100, 100, 0.57e-2),
        ("lucy", 3, 3.0, 100, 100, 0.39e-2),
        ("lucy", 3, 2.2, 100, 0, 4.1e-2),
        ("quintic_spline", 2, 3.0, 900, 900, 1.2e-3),
    ],
)
def test_bias_of_the_kernel_density(kernel, dimension, ratio, x, z, bias):
    assert fluid(kernel, dimension, ratio, x, z).bias() == pytest.approx(bias, rel=0.02)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("x", "z", "slope"), [(80.0, 80.0, 0.0), (80.0, 0.0, 80.0), (60.0, 9.0, 3)]
)
def test_integrals_against_adaptive_quadrature(dimension, x, z, slope):
    """Variance, bias and virial pressure written from the free energy, by another quadrature."""
    from scipy import integrate

    kernel, support = "wendland_c4", 2.7
    model = fluid(kernel, dimension, support, x, z)

    def response(k, density):
        """n beta (2 u' What + n u'' What^2), beta P = z + x (n - 1) + slope (n - 1)^2/2."""
        w = float(theory.kernel_transform(kernel, dimension, k * support))
        pressure = z + x * (density - 1.0) + 0.5 * slope * (density - 1.0) ** 2
        stiffness = x + slope * (density - 1.0)
        ratio = pressure / density
        return 2.0 * ratio * w + (stiffness - 2.0 * ratio) * w**2

    def integral(function):
        surface = (
            (lambda k: k / (2.0 * math.pi))
            if dimension == 2
            else (lambda k: k**2 / (2.0 * math.pi**2))
        )
        return sum(
            integrate.quad(lambda k: surface(k) * function(k), a, a + 4.0, epsrel=1e-10)[0]
            for a in range(0, 40, 4)
        )

    def transform(k):
        return float(theory.kernel_transform(kernel, dimension, k * support))

    variance = integral(lambda k: transform(k) ** 2 / (1.0 + response(k, 1.0)))
    assert model.variance() == pytest.approx(variance, rel=1e-6)
    bias = integral(lambda k: transform(k) / (1.0 + response(k, 1.0)))
    assert model.bias() == pytest.approx(bias, rel=1e-4)

    def free_energy(density):
        return 0.5 * integral(lambda k: math.log1p(response(k, density)))

    step = 1e-3
    slope_of_f = (free_energy(1.0 + step) - free_energy(1.0 - step)) / (2.0 * step)
    pressure = 1.0 + z + slope_of_f - free_energy(1.0)
    ours = model.virial_pressure(thermal_energy=1.0, stiffness_slope=slope)
    assert ours == pytest.approx(pressure, rel=2e-5)
    assert abs(ours - 1.0 - z) > 0.2  # the fluctuations have a share
    assert model.virial_pressure(thermal_energy=2.5, stiffness_slope=slope) == pytest.approx(
        2.5 * ours
    )


@pytest.mark.parametrize(
    ("kind", "parameters", "slope"),
    [
        ("ideal_gas", [10.0], 0.0),
        ("artificial_compressibility", [2.0, 10.0], 50.0),
        ("tait", [2.0, 10.0, 7.0, 3.0], 300.0),
        ("polynomial", [0.0, 0.0, 0.0, 5.0], 60.0),
    ],
)
def test_slope_of_the_stiffness(kind, parameters, slope):
    """m rho/(kB T) d2P/drho2."""
    found = theory.stiffness_slope(kind, parameters, density=2.0, mass=3.0, thermal_energy=6.0)
    assert found == pytest.approx(slope, rel=1e-6, abs=1e-6)


def test_ratio_to_landau_lifshitz_of_the_2d_quintic():
    ratio = fluid("quintic_spline", 2, 3.0, 900, 900).landau_lifshitz_ratio()
    assert ratio == pytest.approx(0.2150, abs=1e-4)


def test_correlation_of_the_2d_quintic():
    c = fluid("quintic_spline", 2, 3.0, 900, 900).correlation(
        3.0 * np.array([0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0])
    )
    assert c == pytest.approx([1.0, 0.934, 0.762, 0.544, 0.195, 0.056, 0.010], abs=6e-4)


def test_scale_does_not_matter():
    small = theory.DensityTheory(
        kernel="lucy",
        dimension=3,
        support=2.65e-9,
        number_density=1e27,
        stiffness=100.0,
        compressibility_factor=100.0,
    )
    large = fluid("lucy", 3, 2.65, 100.0, 100.0)
    assert small.variance() == pytest.approx(large.variance(), rel=1e-12)
    assert small.structure_factor(1e9) == pytest.approx(large.structure_factor(1.0), rel=1e-12)


def test_structure_factor_limits():
    s = fluid("lucy", 3, 2.65, 100.0, 100.0)
    assert float(s.structure_factor(0.0)) == pytest.approx(1.0 / 101.0)
    assert float(s.structure_factor(50.0)) == pytest.approx(1.0, abs=1e-3)
    free = fluid("lucy", 3, 2.65, 0.0, 0.0)
    assert free.structure_factor([0.0, 1.0]) == pytest.approx([1.0, 1.0])
    assert free.variance() == pytest.approx(theory.kernel_square_integral("lucy", 3) / 2.65**3)


@pytest.mark.parametrize(
    ("kernel", "limits"), [("lucy", (7.8e3, 287.0)), ("quintic_spline", (2.0e4, 2.33e4))]
)
def test_pairing_limits(kernel, limits):
    assert theory.pairing_limit(kernel, 2) == pytest.approx(limits[0], rel=0.015)
    assert theory.pairing_limit(kernel, 3) == pytest.approx(limits[1], rel=0.005)


@pytest.mark.parametrize("kernel", ["wendland_c2", "wendland_c4"])
def test_wendland_kernels_do_not_pair(kernel):
    assert theory.pairing_limit(kernel, 2) == theory.pairing_limit(kernel, 3) == math.inf


def test_artificial_compressibility_does_not_pair():
    assert theory.pairing_limit("lucy", 3, pressure_share=0.0) == math.inf
    with pytest.raises(ValueError, match=r"`stiffness` 400 is beyond the pairing limit"):
        fluid("lucy", 3, 3.0, 400.0, 400.0)


@pytest.mark.parametrize(
    ("kernel", "factors"),
    [
        ("lucy", (3.57, 3.69)),
        ("quintic_spline", (4.69, 4.77)),
        ("wendland_c2", (4.10, 4.18)),
        ("wendland_c4", (4.72, 4.79)),
    ],
)
def test_fastest_mode(kernel, factors):
    for dimension, factor in zip((2, 3), factors, strict=True):
        ours = fluid(kernel, dimension, 3.0, 50.0, 50.0).acoustic_factor()
        assert ours == pytest.approx(factor, abs=6e-3)


def test_cell_counts_of_a_stiff_fluid_are_a_surface_term():
    s = fluid("lucy", 3, 2.65, 100.0, 100.0)

    def counts(limit):
        return theory.cell_count_variance(
            s.structure_factor,
            box=(15, 15, 15),
            cell=(5, 5, 5),
            n_particles=3375,
            max_wave_number=limit / 2.65,
        )

    assert counts(25.0) == pytest.approx(counts(40.0), rel=1e-3)
    assert 7.0 < counts(25.0) / (125.0 / 101.0) < 14.0
    whole = theory.cell_count_variance(
        s.structure_factor, box=(9, 9, 9), cell=(9, 9, 9), n_particles=729, max_wave_number=9.0
    )
    assert whole == pytest.approx(0.0, abs=1e-12)


def test_reduced_equation_of_state():
    x, z = theory.reduced_equation_of_state(
        "ideal_gas", [10.0], density=2.0, mass=3.0, thermal_energy=6.0
    )
    assert (x, z) == pytest.approx((50.0, 50.0))
    x, z = theory.reduced_equation_of_state(
        "artificial_compressibility", [2.0, 10.0], density=2.0, mass=3.0, thermal_energy=6.0
    )
    assert (x, z) == pytest.approx((50.0, 0.0))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: theory.kernel_transform("lucy", 4, 1.0), "`dimension` must be 2 or 3"),
        (lambda: theory.kernel_transform("gauss", 3, 1.0), "`kernel` must be one of"),
        (lambda: theory.kernel_transform("lucy", 3, -1.0), "`kh` must be finite and >= 0"),
        (lambda: fluid("lucy", 3, 0.0, 1.0, 1.0), "`support` must be finite and > 0"),
        (lambda: fluid("lucy", 3, 3.0, -1.0, 1.0), "`stiffness` must be finite and >= 0"),
        (lambda: fluid("lucy", 3, 3.0, 0.0, 0.0).acoustic_factor(), "`stiffness` must be > 0"),
        (
            lambda: fluid("lucy", 3, 3.0, 1.0, 0.0).virial_pressure(
                thermal_energy=0.0, stiffness_slope=0.0
            ),
            "`thermal_energy` must be finite and > 0",
        ),
        (lambda: fluid("lucy", 3, 3.0, 1.0, 0.0).correlation(-1.0), "`distance` must be"),
        (
            lambda: theory.cell_count_variance(
                np.ones_like, box=(1, 1), cell=(2, 1), n_particles=5, max_wave_number=9.0
            ),
            "`cell` must lie between 0 and `box`",
        ),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call()
