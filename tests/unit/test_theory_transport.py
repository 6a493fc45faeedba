"""Friction, hydrodynamics and Landau-Lifshitz: tables of an independent calculation and limits."""

import math

import numpy as np
import pytest

from sdpd import kernels, theory

KERNELS = ["lucy", "quintic_spline", "wendland_c2", "wendland_c4"]


def friction(kernel="lucy", dimension=3, support=1.0, **more):
    return theory.FrictionTheory(
        kernel=kernel,
        dimension=dimension,
        support=support,
        density=more.pop("density", 1.0),
        shear_viscosity=more.pop("shear_viscosity", 1.0),
        **more,
    )


@pytest.mark.parametrize(
    ("dimension", "eta", "zeta", "across", "along"),
    [
        (2, 1.0, 0.3, 1.7, 1.2),
        (3, 1.0, 0.3, 5 / 3 - 0.3, 1.5 + 5 / 3),
        (3, 2.0, 0.0, 10 / 3, 10 / 3),
    ],
)
def test_friction_coefficients(dimension, eta, zeta, across, along):
    assert theory.friction_coefficients(eta, zeta, dimension) == pytest.approx((across, along))
    assert theory.viscosities(across, along, dimension) == pytest.approx((eta, zeta))


@pytest.mark.parametrize("dimension", [2, 3])
def test_central_form_has_the_largest_bulk_viscosity(dimension):
    central = friction(dimension=dimension, central=True)
    shear, bulk = theory.viscosities(*central.coefficients, dimension)
    assert shear == pytest.approx(1.0)
    assert bulk == pytest.approx(1.0 + 2.0 / dimension)
    limit = friction(dimension=dimension, bulk_viscosity=1.0 + 2.0 / dimension)
    assert limit.coefficients == pytest.approx(central.coefficients)


@pytest.mark.parametrize(
    ("kernel", "integrals"),
    [
        ("lucy", (10.0, 10.5)),
        ("quintic_spline", (4158 / 239, 18.0)),
        ("wendland_c2", (14.0, 14.0)),
        ("wendland_c4", (18.0, 55 / 3)),
    ],
)
def test_friction_integral(kernel, integrals):
    for dimension, exact in zip((2, 3), integrals, strict=True):
        assert theory.friction_integral(kernel, dimension) == pytest.approx(exact, rel=1e-13)
        index = dimension - 2
        assert kernels.get(kernel).friction_integral[index] == pytest.approx(exact)


@pytest.mark.parametrize(
    ("kernel", "factors"),
    [
        ("lucy", (1 / 20, 3 / 70)),
        ("quintic_spline", (239 / 8316, 1 / 40)),
        ("wendland_c2", (1 / 28, 9 / 280)),
        ("wendland_c4", (1 / 36, 27 / 1100)),
    ],
)
def test_self_diffusion_factor(kernel, factors):
    for dimension, exact in zip((2, 3), factors, strict=True):
        model = friction(kernel, dimension, support=2.0, density=3.0, shear_viscosity=5.0)
        assert model.self_diffusion_factor() == pytest.approx(exact, rel=1e-12)
        diffusion = model.self_diffusion(thermal_energy=0.7, mass=0.2)
        assert diffusion == pytest.approx(exact * 2.0**2 * 3.0 * 0.7 / (0.2 * 5.0))
        schmidt = model.schmidt_number(thermal_energy=0.7, mass=0.2)
        assert schmidt == pytest.approx(5.0 / (3.0 * diffusion))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", KERNELS)
def test_plane_waves_against_adaptive_quadrature(kernel, dimension):
    """Over the ball in spherical coordinates, wave along the axis, nothing shared with the code."""
    from scipy import integrate

    model = friction(kernel, dimension, support=1.7, density=1.3, bulk_viscosity=0.4)
    across, along = model.coefficients
    for k in (0.6, 4.0):

        def integrand(angle, r, k, power):
            _, f = kernels.evaluate(kernel, dimension, np.array([r]), 1.7)
            axis = np.cos(angle)
            # mean over the direction of the polarisation across the wave: sin^2/(D - 1)
            square = axis**2 if power == "along" else np.sin(angle) ** 2 / (dimension - 1.0)
            surface = 2.0 * r if dimension == 2 else 2.0 * math.pi * r**2 * np.sin(angle)
            return float(f[0]) * (across + along * square) * (1 - np.cos(k * r * axis)) * surface

        for ours, power in zip(model.plane_wave_rates(k), ("across", "along"), strict=True):
            exact, _ = integrate.dblquad(
                integrand, 0.0, 1.7, 0.0, math.pi, args=(k, power), epsabs=1e-7, epsrel=1e-7
            )
            assert float(ours) == pytest.approx(exact / 1.3, rel=2e-6)


def test_kinetic_viscosity():
    model = friction(support=2.65, shear_viscosity=20.0)
    assert model.kinetic_viscosity(thermal_energy=1.0, mass=1.0) == pytest.approx(0.0075, abs=1e-4)


def test_self_diffusion_of_a_simulated_state():
    model = friction(support=2.65, shear_viscosity=20.0)
    assert model.self_diffusion(thermal_energy=1.0, mass=1.0) == pytest.approx(0.01505, abs=1e-5)
    thick = friction(bulk_viscosity=2.0 / 3.0)
    assert thick.self_diffusion_factor() == pytest.approx(1.0 / 28.0)


@pytest.mark.parametrize(
    ("dimension", "ratios"),
    [(3, (0.9988, 0.9951, 0.980, 0.924, 0.839)), (2, (0.9986, 0.9944, 0.978, 0.915, 0.821))],
)
def test_viscosity_at_finite_wave_number(dimension, ratios):
    ours = friction(dimension=dimension).viscosity_ratio([0.25, 0.5, 1.0, 2.0, 3.0])
    assert ours == pytest.approx(ratios, abs=6e-4)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", KERNELS)
def test_long_waves_feel_the_input_viscosities(kernel, dimension):
    eta, zeta, density = 1.3, 0.4, 2.0
    model = friction(kernel, dimension, density=density, shear_viscosity=eta, bulk_viscosity=zeta)
    for k in (1e-6, 1e-3):
        transverse, longitudinal = model.plane_wave_rates(k)
        assert transverse / k**2 == pytest.approx(eta / density, rel=1e-5)
        gamma = (eta * (2.0 - 2.0 / dimension) + zeta) / (2.0 * density)
        assert longitudinal / k**2 == pytest.approx(2.0 * gamma, rel=1e-5)


@pytest.mark.parametrize("dimension", [2, 3])
def test_short_waves_decay_at_the_friction_rate(dimension):
    model = friction("wendland_c2", dimension, bulk_viscosity=0.2)
    transverse, longitudinal = model.plane_wave_rates(400.0)
    assert transverse == pytest.approx(model.rate(), rel=0.01)
    assert longitudinal == pytest.approx(model.rate(), rel=0.01)


@pytest.mark.parametrize("dimension", [2, 3])
def test_angular_means_join_smoothly(dimension):
    from sdpd.theory.kernel_moments import one_minus_cosine

    x = np.array([1.0 - 1e-9, 1.0 + 1e-9])
    for mean in one_minus_cosine(dimension, x):
        assert mean[1] - mean[0] == pytest.approx(0.0, abs=1e-9)
    angle = (np.arange(4000) + 0.5) * math.pi / 4000
    weight = np.ones_like(angle) if dimension == 2 else np.sin(angle)
    weight /= weight.sum()
    for x0 in (0.3, 0.9, 2.0, 15.0):
        plain, side = one_minus_cosine(dimension, np.array([x0]))
        wave = 1.0 - np.cos(x0 * np.cos(angle))
        across = np.sin(angle) ** 2 / (dimension - 1.0)
        assert plain[0] == pytest.approx(np.sum(weight * wave), abs=1e-6)
        assert side[0] == pytest.approx(np.sum(weight * across * wave), abs=1e-6)


@pytest.mark.parametrize(
    ("kernel", "ratio", "factors"),
    [
        ("lucy", 2.2, (1.016, 0.950, 0.81)),
        ("lucy", 2.64, (0.998, 0.991, 0.90)),
        ("lucy", 3.0, (1.002, 0.996, 0.93)),
        ("quintic_spline", 2.2, (1.012, 0.849, 0.59)),
        ("quintic_spline", 2.64, (1.000, 0.961, 0.77)),
        ("quintic_spline", 3.0, (1.000, 0.981, 0.84)),
        ("wendland_c2", 2.05, (1.031, 0.879, 0.62)),
        ("wendland_c2", 3.0, (1.003, 0.983, 0.87)),
        ("wendland_c2", 4.0, (1.0005, 0.995, 0.94)),
    ],
)
def test_lattice_factors(kernel, ratio, factors):
    density, viscosity, rate = friction(kernel, support=ratio).lattice_factors(spacing=1.0)
    assert density == pytest.approx(factors[0], abs=6e-4)
    assert viscosity == pytest.approx(factors[1], abs=6e-4)
    assert rate == pytest.approx(factors[2], abs=6e-3)


def test_lattice_approaches_the_continuum():
    model = friction("wendland_c4", 2, bulk_viscosity=0.3)
    spacing = 1.0 / 12.0
    k = 2.0 * math.pi / 2.0
    transverse, longitudinal = model.plane_wave_rates(k)
    side = model.lattice_plane_wave_rate([k, 0.0], [0.0, 2.0], spacing=spacing)
    along = model.lattice_plane_wave_rate([k, 0.0], [3.0, 0.0], spacing=spacing)
    assert side == pytest.approx(float(transverse), rel=1e-3)
    assert along == pytest.approx(float(longitudinal), rel=1e-3)


def test_long_lattice_wave_does_not_cancel():
    model = friction(support=2.64e-9, density=1e3, shear_viscosity=1e-3)
    rates = [
        model.lattice_plane_wave_rate([k, 0, 0], [0, 1, 0], spacing=1e-9) / k**2
        for k in (1e-3, 1e3)
    ]
    assert rates[0] == pytest.approx(rates[1], rel=1e-9)
    assert rates[0] == pytest.approx(0.991 * 1e-6, rel=6e-4)


class TestHydrodynamics:
    fluid = theory.HydrodynamicTheory(
        dimension=2, density=2.0, shear_viscosity=1.0, bulk_viscosity=0.5, sound_speed=4.0
    )
    time = np.linspace(0.0, 6.0, 2001)

    def test_damping(self):
        assert self.fluid.kinematic_viscosity == 0.5
        assert self.fluid.sound_damping == pytest.approx(0.75 * 0.5)  # 3 nu/4 at zeta = eta/2
        three = theory.HydrodynamicTheory(
            dimension=3, density=2.0, shear_viscosity=1.0, sound_speed=4.0
        )
        assert three.sound_damping == pytest.approx(2.0 / 3.0 * 0.5)

    @pytest.mark.parametrize("k", [0.5, 2.0 * 4.0 / 0.75, 40.0], ids=["sound", "critical", "over"])
    def test_correlations_solve_the_linear_equations(self, k):
        """d rho = i k j; d j = i k c^2 rho - 2 Gamma k^2 j: in steps of the exact propagator."""
        from scipy import linalg

        c, damping = 4.0, 2.0 * self.fluid.sound_damping * k**2
        time = np.array([0.0, 0.01, 0.1, 0.7, 2.0])
        matrix = np.array([[0.0, 1j * k * c], [1j * k * c, -damping]])  # of (c rho, j)
        exact = np.array([linalg.expm(matrix * t) for t in time])
        assert self.fluid.density_correlation(k, time) == pytest.approx(
            exact[:, 0, 0].real, abs=1e-7
        )
        assert self.fluid.longitudinal(k, time) == pytest.approx(exact[:, 1, 1].real, abs=1e-7)
        assert self.fluid.cross_correlation(k, time) == pytest.approx(exact[:, 1, 0].imag, abs=1e-7)

    def test_transverse(self):
        assert self.fluid.transverse(2.0, self.time) == pytest.approx(np.exp(-2.0 * self.time))

    def test_sound_speed_includes_the_kinetic_part(self):
        speed = theory.isothermal_sound_speed(3.0, thermal_energy=8.0, mass=0.5)
        assert speed == pytest.approx(5.0)

    @pytest.mark.parametrize(
        ("call", "text"),
        [
            (lambda f: f.transverse(0.0, 1.0), "`wave_number` must be finite and > 0"),
            (lambda f: f.transverse(1.0, -1.0), "`time` must be finite and >= 0"),
            (
                lambda f: theory.HydrodynamicTheory(
                    dimension=1, density=1.0, shear_viscosity=1.0, sound_speed=1.0
                ),
                "`dimension` must be 2 or 3",
            ),
        ],
    )
    def test_bad_input_is_named(self, call, text):
        with pytest.raises(ValueError, match=text):
            call(self.fluid)


class TestLandauLifshitz:
    def test_ideal_gas_of_n_molecules(self):
        """Var N = N: relative density variance 1/N; Var T = T^2 / (3N/2); gamma = 5/3."""
        number, boltzmann, temperature, mass, volume = 1000.0, 1.4e-23, 300.0, 5e-26, 2.0e-21
        density = number * mass / volume
        v = theory.cell_variances(
            density=density,
            thermal_energy=boltzmann * temperature,
            sound_speed=math.sqrt(boltzmann * temperature / mass),
            volume=volume,
            heat_ratio=5.0 / 3.0,
            temperature=temperature,
            specific_heat=1.5 * boltzmann / mass,
        )
        pressure = number * boltzmann * temperature / volume
        assert v.density / density**2 == pytest.approx(1.0 / number)
        assert v.velocity == pytest.approx(boltzmann * temperature / (mass * number))
        assert v.pressure_isothermal / pressure**2 == pytest.approx(1.0 / number)
        assert v.pressure_adiabatic / pressure**2 == pytest.approx(5.0 / 3.0 / number)
        assert v.temperature / temperature**2 == pytest.approx(2.0 / (3.0 * number))

    def test_closed_box(self):
        state = {"density": 1.0, "thermal_energy": 1.0, "sound_speed": 10.0, "volume": 2.0}
        open_cell = theory.cell_variances(**state)
        cell = theory.cell_variances(**state, box_volume=8.0)
        assert cell.density == pytest.approx(0.75 * open_cell.density)
        assert cell.velocity == pytest.approx(0.75 * open_cell.velocity)
        assert theory.cell_variances(**state, box_volume=2.0).velocity == 0.0
        assert open_cell.temperature is None

    @pytest.mark.parametrize(
        ("change", "text"),
        [
            ({"volume": 0.0}, "`volume` must be finite and > 0"),
            ({"box_volume": 1.0}, "`volume` must be <= `box_volume`"),
            ({"heat_ratio": 0.9}, "`heat_ratio` must be >= 1"),
            ({"temperature": 300.0}, "must be given together"),
        ],
    )
    def test_bad_input_is_named(self, change, text):
        state = {"density": 1.0, "thermal_energy": 1.0, "sound_speed": 10.0, "volume": 2.0}
        with pytest.raises(ValueError, match=text):
            theory.cell_variances(**{**state, **change})


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: theory.friction_coefficients(1.0, 2.0, 3), "`bulk_viscosity` must be <= shear"),
        (lambda: theory.friction_coefficients(1.0, 0.0, 1), "`dimension` must be 2 or 3"),
        (lambda: friction(shear_viscosity=0.0), "`shear_viscosity` must be finite and > 0"),
        (lambda: friction().plane_wave_rates(-1.0), "`wave_number` must be finite and >= 0"),
        (lambda: friction().viscosity_ratio(0.0), "`wave_number` must be > 0"),
        (
            lambda: friction().lattice_plane_wave_rate([1, 0, 0], [0, 0, 0], spacing=0.4),
            "`polarization` must not be zero",
        ),
        (
            lambda: friction().lattice_plane_wave_rate([1, 0], [0, 1, 0], spacing=0.4),
            "`wave_vector` must be a sequence of 3",
        ),
        (lambda: friction().lattice_rate(spacing=-1.0), "`spacing` must be finite and > 0"),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call()
