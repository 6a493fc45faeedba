"""`sdpd correlations` of fluids with an energy: what is expected of sound and heat, and fitted."""

from __future__ import annotations

import csv
import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import sdpd
from sdpd import cli, correlations
from sdpd.analysis import Correlation
from sdpd.correlations import Plan, predict, run_correlations
from sdpd.correlations.energy_fits import EnergyWave
from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.correlations.predictions import wave_numbers
from sdpd.correlations.recorder import ENERGY_FUNCTIONS, FUNCTIONS, FrictionSampler
from sdpd.correlations.results import assemble_shell
from sdpd.theory import DensityTheory, ThermalHydrodynamicTheory
from tests.unit.thermal import fluid, gas, scene


def small(of: sdpd.Fluid | None = None, **changes: Any) -> sdpd.Scene:
    arguments: dict[str, Any] = {
        "box": sdpd.Box((12.0, 12.0)),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        "start": sdpd.RandomStart(relax_steps=50),
        **changes,
    }
    return scene(of or gas(250.0, shear_viscosity=14.0, thermal_conductivity=2500.0), **arguments)


def wave_of(made: sdpd.Scene, k: float, dt: float = 0.0) -> EnergyWavePrediction:
    found = predict(made, k, dt)
    assert isinstance(found, EnergyWavePrediction)
    return found


@pytest.mark.parametrize("alpha", [None, 0.3, 0.0])
def test_long_waves_are_hydrodynamic(alpha: float | None) -> None:
    """gamma of the virial pressure, q of conduction, friction and diffusion, as k h -> 0."""
    constants = {"shear_viscosity": 14.0, "thermal_conductivity": 2500.0}
    of = (
        gas(250.0, **constants)
        if alpha is None
        else fluid(250.0, thermal_expansion=alpha, **constants)
    )
    made = small(of)
    wave = wave_of(made, 1e-3)
    whole = 250.0 + 1.0
    # dP/dT over n kB: of a gas P/(n kB T) itself, of a liquid alpha X and the motion
    rpa = DensityTheory(
        kernel="wendland_c2",
        dimension=2,
        support=2.65,
        number_density=1.0,
        stiffness=100.0,
        compressibility_factor=100.0,
    )
    virial = rpa.virial_pressure(thermal_energy=1.0, stiffness_slope=0.0)
    speed = math.sqrt(101.0)
    if alpha is None:
        assert wave.heat_ratio == pytest.approx(1.0 + virial**2 / (whole * 101.0), rel=1e-4)
        assert wave.heat_ratio == pytest.approx(made.adiabatic_ratio, rel=0.03)
    else:
        # 1 + alpha X, and what fluctuations do that soften as T rises
        step = 1e-3
        warm, cold = (
            dataclasses.replace(
                rpa,
                stiffness=100.0 / t,
                compressibility_factor=(100.0 + 100.0 * alpha * (t - 1)) / t,
            ).virial_pressure(thermal_energy=t, stiffness_slope=0.0)
            for t in (1.0 + step, 1.0 - step)
        )
        slope = (warm - cold) / (2.0 * step)
        assert slope == pytest.approx(1.0 + 100.0 * alpha, abs=3.0)
        assert wave.heat_ratio == pytest.approx(1.0 + slope**2 / (whole * 101.0), rel=1e-3)
    kappa = 2500.0 + (2.0 * made.friction_across + made.friction_along) / 4.0
    q = kappa / whole + 0.5 * made.self_diffusion
    assert wave.conduction / 1e-6 == pytest.approx(q, rel=1e-4)
    theory = ThermalHydrodynamicTheory(
        dimension=2,
        density=1.0,
        shear_viscosity=14.0 * (1.0 - 0.5 / 250.0),
        sound_speed=speed,
        heat_ratio=wave.heat_ratio,
        thermal_diffusivity=q / wave.heat_ratio,
    )
    t = np.linspace(0.0, 300.0, 40)
    for name, exact in (
        ("transverse", theory.transverse(1e-3, t)),
        ("density", theory.density_correlation(1e-3, t)),
        ("longitudinal", theory.longitudinal(1e-3, t)),
        ("energy", theory.temperature_correlation(1e-3, t)),
    ):
        np.testing.assert_allclose(wave.function(name, t), exact, atol=2e-4)


def test_without_coupling_it_is_the_isothermal_wave() -> None:
    """An expansion that makes the pressure independent of T: gamma(k) = 1."""
    made = small()
    wave = dataclasses.replace(wave_of(made, 0.5), coupling=0.0)
    cold = predict(made.replace(effects=sdpd.Effects(energy=False)), 0.5, 0.0)
    t = np.linspace(0.0, 1.0, 30)
    thinner = dataclasses.replace(cold, viscosity=wave.viscosity, damping=wave.damping)
    for name in FUNCTIONS:
        np.testing.assert_allclose(wave.function(name, t), thinner.function(name, t), atol=1e-9)
    assert wave.viscosity / cold.viscosity == pytest.approx(1.0 - 0.5 / 250.0)


def test_conduction_in_place_is_what_the_pairs_take() -> None:
    """Against the sum over all pairs: the power of conduction and friction in a wave of energy."""
    made = small(box=sdpd.Box((8.0, 8.0)))
    sim = sdpd.Simulation(made, dt=1e-3, seed=4, threads=1)
    groups = [group for _, group in wave_numbers(made, (1,))]
    sampler = FrictionSampler(made, groups, every=1)
    sampler.sample(sim)
    r, d, count = sim.positions, sim.number_densities, made.n_particles
    gap = r[:, None] - r[None]
    gap -= 8.0 * np.rint(gap / 8.0)
    distance = np.sqrt(np.sum(gap**2, axis=2)) + np.eye(count)
    _, f = sdpd.kernels.evaluate("wendland_c2", 2, distance, 2.65)
    g = f / np.multiply.outer(d, d) * (1.0 - np.eye(count))
    expected = 0.0
    for axis in range(2):
        phase = np.exp(2.0j * np.pi * r[:, axis] / 8.0)
        square = np.abs(phase[:, None] - phase[None]) ** 2
        # variances of the exchanges: 4 kappa kB g T^2 and (kB T)^2 tr(G)/m, half of them decay
        noise = 4.0 * 2500.0 + 2.0 * made.friction_across + made.friction_along
        expected += 0.5 * noise * np.sum(0.5 * g * square) / (count * 251.0) / 2.0
    assert sampler.rates[0, 2] == pytest.approx(expected, rel=1e-9)


def test_fits_return_what_was_put_in() -> None:
    made = small()
    wave = wave_of(made, 0.5)
    right = dataclasses.replace(
        wave,
        viscosity=1.1 * wave.viscosity,
        damping=0.9 * wave.damping,
        sound_speed=1.05 * wave.sound_speed,
        coupling=0.93 * wave.coupling,
        conduction=1.15 * wave.conduction,
    )
    lag = np.linspace(0.0, 3.0 / wave.slowest_rate, 120)
    units = {"transverse": 1.0, "longitudinal": 1.0, "density": 1e-2, "energy": 250.0}
    units |= dict.fromkeys(("cross", "reversed_cross"), 0.1)
    units |= {"density_energy": math.sqrt(2.5), "energy_current": math.sqrt(250.0)}
    members = [
        {
            name: Correlation(
                lag=lag,
                blocks=np.tile(scale * units[name] * right.function(name, lag), (2, 1)),
                block_counts=np.ones((2, lag.size)),
                window=(0.0, 1.0),
            )
            for name in FUNCTIONS + ENERGY_FUNCTIONS
        }
        for scale in (0.98, 1.0, 1.02, 1.01)
    ]
    rates = np.ones((4, 3)) * wave.conduction
    shell = assemble_shell(made, np.array([[1, 0]]), members, rates, wave)
    fit, system = shell.fit, right.system
    assert isinstance(fit, EnergyWave)
    assert fit.sound_speed.value == pytest.approx(right.sound_speed, rel=1e-5)
    assert fit.adiabatic_speed.value == pytest.approx(right.adiabatic_speed, rel=1e-5)
    assert fit.heat_ratio.value == pytest.approx(right.heat_ratio, rel=1e-5)
    assert fit.damping.value == pytest.approx(right.damping, rel=1e-4)
    assert fit.conduction.value * 0.25 == pytest.approx(right.conduction, rel=1e-4)
    assert fit.heat_rate.value * 0.25 == pytest.approx(system.heat_rate, rel=1e-4)
    assert fit.sound_rate.value * 0.25 == pytest.approx(system.sound_rate, rel=1e-4)


@pytest.fixture(scope="module")
def study() -> correlations.Study:
    return run_correlations(small(), seed=6, quick=True, waves=(1,), progress=False, threads=1)


def test_quick_study_agrees(study: correlations.Study) -> None:
    assert study.passed, str(study)
    [shell] = study.shells
    fit = shell.fit
    assert isinstance(fit, EnergyWave)
    assert shell.conduction is not None
    assert shell.conduction.relative < 2e-3
    # sound is not isothermal: gamma(k) = 1 and c_T are far away
    assert fit.adiabatic_speed.relative < 0.04
    assert fit.heat_ratio.value - 1.0 > 4.0 * fit.heat_ratio.stderr
    text = str(study)
    assert "c_S(k)" in text and "heat/k^2" in text
    assert max(map(len, text.splitlines())) <= 130


def test_files_and_command(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    made = small(box=sdpd.Box((8.0, 8.0)))
    path = tmp_path / "scene.toml"
    made.to_toml(path)
    plan = Plan(dt=0.01, equilibration=4, runs=4, steps=24, points=16, levels=1)
    found = run_correlations(made, seed=1, plan=plan, waves=(1,), progress=False, threads=1)
    names = correlations.write(found, tmp_path / "out")
    with names[1].open(encoding="utf-8") as file:
        assert {row["function"] for row in csv.DictReader(file)} == {*FUNCTIONS, *ENERGY_FUNCTIONS}
    assert correlations.write_figure(found, tmp_path).stat().st_size > 10_000
    still = small(gas(250.0, shear_viscosity=14.0, thermal_conductivity=None))
    still.to_toml(path)
    assert cli.main(["correlations", str(path), "--quick"]) == 2
    assert "must have heat conduction" in capsys.readouterr().err
