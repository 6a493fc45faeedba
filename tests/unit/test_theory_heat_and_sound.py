"""Sound and heat against integration of the equations, closed forms, and sums over samples."""

import math

import numpy as np
import pytest
from scipy import integrate, special

from sdpd import theory
from sdpd.theory import EnergyShell, SoundAndHeat, ThermalHydrodynamicTheory

AIR = {
    "dimension": 3,
    "density": 1.2,
    "shear_viscosity": 0.9,
    "bulk_viscosity": 0.3,
    "sound_speed": 3.0,
}


def air(**changes):
    return ThermalHydrodynamicTheory(
        **{**AIR, "heat_ratio": 1.4, "thermal_diffusivity": 0.5, **changes}
    )


@pytest.mark.parametrize("wave_number", [0.1, 1.0, 8.0])
def test_functions_are_solutions_of_the_continuum_equations(wave_number):
    """Navier, Stokes and Fourier linearised, in their own variables, by a Runge-Kutta method."""
    fluid, k = air(), wave_number
    rho0, t0, c_v = fluid.density, 2.0, 3.5
    # (dP/dT)_rho from gamma - 1 = T beta^2/(rho^2 c_v c_T^2)
    beta = math.sqrt((fluid.heat_ratio - 1.0) * c_v / t0) * rho0 * fluid.sound_speed
    kappa = fluid.thermal_diffusivity * rho0 * fluid.heat_ratio * c_v
    viscous = 4.0 / 3.0 * fluid.shear_viscosity + fluid.bulk_viscosity

    def slope(_, state):  # rho, u, T of cos(k x), sin(k x), cos(k x)
        rho, u, t = state
        return [
            -rho0 * k * u,
            k * (fluid.sound_speed**2 * rho + beta * t) / rho0 - viscous * k**2 * u / rho0,
            -k * t0 * beta * u / (rho0 * c_v) - kappa * k**2 * t / (rho0 * c_v),
        ]

    # standard deviations at equilibrium, over a common factor
    deviation = np.array([rho0 / fluid.sound_speed, 1.0, math.sqrt(t0 / c_v)])
    times = np.linspace(0.0, 4.0 / (k * fluid.sound_speed), 40)
    found = fluid.wave(k).correlations(times)
    signs = np.array([1.0, -1.0, 1.0])  # compression is u < 0 here
    for start in range(3):
        state = np.zeros(3)
        state[start] = deviation[start] * signs[start]
        solved = integrate.solve_ivp(
            slope, (0.0, times[-1]), state, t_eval=times, rtol=1e-10, atol=1e-13, method="DOP853"
        )
        exact = solved.y / deviation[:, None] * signs[:, None]
        np.testing.assert_allclose(found[:, start], exact, atol=1e-8)


def test_named_functions_are_elements():
    fluid, t = air(), np.linspace(0.0, 3.0, 20)
    whole = fluid.wave(0.7).correlations(t)
    np.testing.assert_array_equal(fluid.density_correlation(0.7, t), whole[0, 0])
    np.testing.assert_array_equal(fluid.longitudinal(0.7, t), whole[1, 1])
    np.testing.assert_array_equal(fluid.temperature_correlation(0.7, t), whole[2, 2])
    nu = fluid.kinematic_viscosity
    np.testing.assert_allclose(fluid.transverse(0.7, t), np.exp(-nu * 0.49 * t))
    w = fluid.wave(0.7)
    # pressure and entropy are independent, and pressure is what moves the velocity
    assert w.pressure @ w.entropy == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(w.matrix[1, [0, 2]], -w.adiabatic_frequency * w.pressure[[0, 2]])
    np.testing.assert_allclose(w.entropy @ w.matrix[:, 1], 0.0, atol=1e-15)


def test_without_expansion_temperature_decouples():
    """gamma = 1: the isothermal theory and pure conduction, at any k."""
    fluid, t = air(heat_ratio=1.0), np.linspace(0.0, 5.0, 50)
    plain = theory.HydrodynamicTheory(**AIR)
    for k in (0.2, 3.0, 30.0):
        np.testing.assert_allclose(
            fluid.density_correlation(k, t), plain.density_correlation(k, t), atol=1e-11
        )
        np.testing.assert_allclose(fluid.longitudinal(k, t), plain.longitudinal(k, t), atol=1e-11)
        np.testing.assert_allclose(
            fluid.temperature_correlation(k, t), np.exp(-0.5 * k**2 * t), atol=1e-12
        )
    assert fluid.landau_placzek_ratio == 0.0


def test_without_conduction_sound_is_adiabatic():
    """kappa = 0: a wave of c_S with the viscous damping, on a static share (gamma - 1)/gamma."""
    fluid, t = air(thermal_diffusivity=0.0), np.linspace(0.0, 5.0, 50)
    fast = theory.HydrodynamicTheory(**{**AIR, "sound_speed": math.sqrt(1.4) * 3.0})
    for k in (0.2, 3.0):
        static = 0.4 / 1.4
        np.testing.assert_allclose(
            fluid.density_correlation(k, t),
            static + (1.0 - static) * fast.density_correlation(k, t),
            atol=1e-11,
        )
        np.testing.assert_allclose(fluid.longitudinal(k, t), fast.longitudinal(k, t), atol=1e-11)
        np.testing.assert_allclose(fluid.entropy_correlation(k, t), 1.0, atol=1e-11)
        np.testing.assert_allclose(
            fluid.pressure_correlation(k, t), fast.density_correlation(k, t), atol=1e-11
        )


def test_with_infinite_conduction_sound_is_isothermal():
    plain, t = theory.HydrodynamicTheory(**AIR), np.linspace(0.0, 5.0, 50)
    error = []
    for chi in (1e4, 1e5):
        found = air(thermal_diffusivity=chi).density_correlation(1.0, t)
        error.append(np.max(np.abs(found - plain.density_correlation(1.0, t))))
    assert error[0] < 1e-3 and error[1] < 0.11 * error[0]


def test_long_waves():
    """Eigenvalues and lines of Landau and Placzek; errors fall as k^2."""
    fluid, away = air(), []
    for k in (1e-2, 1e-3):
        wave = fluid.wave(k)
        away.append(
            [
                wave.heat_rate / (0.5 * k**2) - 1.0,
                wave.sound_rate / (fluid.sound_damping * k**2) - 1.0,
                wave.sound_frequency / (fluid.adiabatic_sound_speed * k) - 1.0,
            ]
        )
    assert np.abs(away[0]).max() < 1e-4
    assert np.abs(away[1]).max() < 1.2e-2 * np.abs(away[0]).max() + 1e-9
    assert fluid.sound_damping == pytest.approx(0.5 * ((1.2 + 0.3) / 1.2 + 0.4 * 0.5))
    flat = air(dimension=2)
    assert flat.sound_damping == pytest.approx(0.5 * ((0.9 + 0.3) / 1.2 + 0.4 * 0.5))
    k = 1e-3
    peak = fluid.adiabatic_sound_speed * k
    for omega in (0.0, 0.5 * fluid.thermal_diffusivity * k**2, peak):
        exact = fluid.dynamic_structure_factor(k, omega)
        assert exact == pytest.approx(fluid.long_wave_structure_factor(k, omega), rel=2e-3)
    # Rayleigh over Brillouin
    grid = np.concatenate([-np.geomspace(1e-3, 1e-12, 4001), np.geomspace(1e-12, 1e-3, 4001)])
    line = np.abs(grid) < 0.3 * peak
    rayleigh = integrate.trapezoid(fluid.dynamic_structure_factor(k, grid[line]), grid[line])
    assert rayleigh / (1.0 - rayleigh) == pytest.approx(0.4, rel=0.01)


def test_spectrum_is_the_transform_of_the_correlation():
    fluid, k = air(), 0.8
    for omega in (0.0, 1.7, 4.0):
        value, _ = integrate.quad(
            lambda t, w=omega: float(fluid.density_correlation(k, t)) * math.cos(w * t),
            0.0,
            60.0,
            limit=400,
        )
        assert fluid.dynamic_structure_factor(k, omega) == pytest.approx(value / np.pi, rel=1e-6)


def test_overdamped_and_degenerate_waves():
    t = np.linspace(0.0, 4.0, 30)
    thick = SoundAndHeat(frequency=1.0, coupling=0.6, damping=9.0, conduction=0.2)
    assert thick.sound_frequency == 0.0
    assert 0.0 < thick.heat_rate < thick.conduction + 1.0
    # a double eigenvalue: damping = 2 w without coupling
    double = SoundAndHeat(frequency=1.0, coupling=0.0, damping=2.0, conduction=0.5)
    np.testing.assert_allclose(double.correlations(t)[0, 0], np.exp(-t) * (1.0 + t), atol=1e-12)
    assert double.correlations(0.0).shape == (3, 3)
    assert double.correlations(t[:6].reshape(2, 3)).shape == (3, 3, 2, 3)


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match=r"`heat_ratio` must be >= 1, got 0\.9"):
        air(heat_ratio=0.9)
    with pytest.raises(ValueError, match="`dimension`"):
        air(dimension=1)
    with pytest.raises(ValueError, match="`thermal_diffusivity`"):
        air(thermal_diffusivity=-1.0)
    with pytest.raises(ValueError, match="`frequency`"):
        SoundAndHeat(frequency=0.0, coupling=0.0, damping=0.0, conduction=0.0)
    with pytest.raises(ValueError, match="`time` must be finite"):
        air().density_correlation(1.0, -1.0)
    with pytest.raises(ValueError, match="`particles`"):
        EnergyShell(particles=1, dimension=3, heat_capacity=5.0)
    with pytest.raises(ValueError, match="`number` must be <= 8"):
        EnergyShell(particles=8, dimension=2, heat_capacity=5.0).cell_variance(9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_shell_against_drawn_energies(dimension):
    """Energies drawn as gamma variates next to a bath and rescaled to a constant sum."""
    count, k, draws = 6, 5.0, 100_000
    shell = EnergyShell(particles=count, dimension=dimension, heat_capacity=k)
    random = np.random.default_rng(7)
    heat = random.gamma(k, size=(draws, count))
    motion = random.normal(size=(draws, dimension * (count - 1)))
    unit = (heat.sum(axis=1) + 0.5 * np.sum(motion**2, axis=1)) / shell.freedom
    t, v = heat / k / unit[:, None], motion[:, 0] / np.sqrt(unit)
    checks = (
        (t[:, 0] - 1.0, 0.0),
        ((t[:, 0] - 1.0) ** 2, shell.variance),
        ((t[:, 0] - 1.0) * (t[:, 1] - 1.0), shell.covariance),
        ((t[:, :3].mean(axis=1) - 1.0) ** 2, shell.cell_variance(3)),
        (v**4 / 3.0, shell.velocity_fourth_moment),
    )
    for values, exact in checks:
        error = values.std() / math.sqrt(draws)
        assert abs(values.mean() - exact) < 4.0 * error
        assert error < 0.025 * shell.variance or exact > 0.9
    log = np.log(t)
    assert log[:, 0].var() == pytest.approx(shell.logarithmic_variance, rel=0.02)
    covariance = np.cov(log[:, 0], log[:, 1])[0, 1]
    assert covariance == pytest.approx(shell.logarithmic_covariance, abs=0.002)


def test_whole_shell_has_no_freedom_left():
    """All temperatures together fluctuate by the share of the motion alone; a bath as N grows."""
    shell = EnergyShell(particles=50, dimension=3, heat_capacity=20.0)
    a, motion = shell.freedom, 0.5 * 3 * 49
    assert shell.cell_variance(50) == pytest.approx(motion / (50 * 20.0 * (a + 1.0)), rel=1e-10)
    large = EnergyShell(particles=10**9, dimension=3, heat_capacity=20.0)
    assert large.variance == pytest.approx(1.0 / 20.0)
    assert large.logarithmic_variance == pytest.approx(special.polygamma(1, 20.0))


def test_landau_lifshitz_entropy_and_pressure():
    """<dS^2> = kB C_p, and T and rho independent: Var P = c_T^4 Var rho + beta^2 Var T."""
    rho, kt, c, volume, gamma, t, c_v = 1.3, 2.0, 4.0, 5.0, 1.5, 8.0, 3.0
    cell = theory.cell_variances(
        density=rho,
        thermal_energy=kt,
        sound_speed=c,
        volume=volume,
        heat_ratio=gamma,
        temperature=t,
        specific_heat=c_v,
    )
    mass = rho * volume
    assert cell.entropy * mass**2 == pytest.approx(kt / t * mass * gamma * c_v)
    beta_squared = (gamma - 1.0) * rho**2 * c_v * c**2 / t
    assert cell.pressure_adiabatic == pytest.approx(
        c**4 * cell.density + beta_squared * cell.temperature
    )
    # s = c_v ln T - (beta/rho^2) rho
    assert cell.entropy == pytest.approx(
        (c_v / t) ** 2 * cell.temperature + beta_squared / rho**4 * cell.density
    )
