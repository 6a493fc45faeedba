"""`sdpd fluctuations` of fluids with an energy."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest

import sdpd
from sdpd import cli, fluctuations
from sdpd.fluctuations import DensityPrediction, EnergyPrediction, Plan, Sampler, run_fluctuations
from sdpd.fluctuations.energy_sums import EnergySums, draw_temperatures, shell_temperature
from sdpd.theory import EnergyShell, cell_variances
from tests.unit.test_energy_currents import Frames
from tests.unit.thermal import fluid, gas, scene


def small(of: sdpd.Fluid | None = None, edge: float = 10.0, **changes: Any) -> sdpd.Scene:
    arguments: dict[str, Any] = {
        "box": sdpd.Box((edge,) * 2),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        "start": sdpd.RandomStart(relax_steps=50),
        **changes,
    }
    return scene(of or gas(20.0), **arguments)


@pytest.fixture(scope="module")
def study() -> fluctuations.Study:
    plan = Plan(dt=0.025, equilibration=500, samples=30, every=2)
    return run_fluctuations(small(), seed=3, plan=plan, progress=False, threads=1)


def test_everything_agrees(study: fluctuations.Study) -> None:
    assert study.passed, str(study)
    groups = {item.group for item in study.items}
    assert {
        "temperature of particles",
        "temperature in space",
        "temperature modes",
        "temperature of cells",
        "entropy of particles",
        "entropy modes",
        "pressure of particles",
        "pressure modes",
    } <= groups
    text = str(study)
    assert "gamma = 6" in text and "share one energy" in text
    assert max(map(len, text.splitlines())) <= 120
    assert abs(study.energy_change) < 1e-9


def test_the_run_would_see_a_fault(study: fluctuations.Study) -> None:
    """A bath's variance, isothermal pressure and C_v for C_p are all told from what is measured."""
    found = {(item.group, item.name): item for item in study.items}
    variance = found["temperature of particles", "variance over T^2 kB/C, shell"]
    assert variance.estimate.stderr < 0.008
    shell = EnergyShell(particles=100, dimension=2, heat_capacity=20.0)
    assert variance.prediction == pytest.approx(20.0 * shell.variance)
    assert variance.estimate.value < 1.0  # next to a bath
    pressure = found["pressure modes", "over (rho c^2)^2 N, longest wave"]
    assert study.prediction is not None
    isothermal = float(study.prediction.structure_factor(study.sampler.wave_number[0]))
    assert pressure.estimate.value > 3.0 * isothermal
    entropy = found["entropy modes", "over kB^2 N, longest wave"]
    assert entropy.estimate.value > 2.0 * 20.0


def test_sums_are_those_of_the_trajectory() -> None:
    made = small(edge=8.0)
    sim = sdpd.Simulation(made, dt=0.01, seed=2, threads=1)
    sampler, frames = Sampler(made, samples=2, every=3), Frames(every=3)
    sim.run(steps=48, observe=[sampler, frames], progress=False)
    r, v, t = (np.stack(part) for part in zip(*frames.frames, strict=True))
    number, k = 64, 20.0
    whole = number * k + number - 1.0
    warm = (k * t.sum(axis=1) + 0.5 * np.sum(v**2, axis=(1, 2))) / whole
    assert sampler.energy is not None
    np.testing.assert_allclose(sampler.energy.temperatures, warm, rtol=1e-12)
    assert shell_temperature(sim) == pytest.approx(warm[-1], rel=1e-12)
    table, u = sampler.table, t / warm[:, None] - 1.0
    assert table["energies"][:, 1].mean() == pytest.approx(np.mean(u**2), rel=1e-10)
    assert sampler.energy.histogram.sum() == t.size
    shell = sampler.energy.shell
    wave = np.exp(2.0j * np.pi * r[..., 0] / 8.0)
    other = np.exp(2.0j * np.pi * r[..., 1] / 8.0)
    modes = []
    for each in (wave, other):
        expected = number * (shell.variance - shell.covariance)
        expected = expected + shell.covariance * np.abs(each.sum(axis=1)) ** 2
        modes.append(np.abs(np.sum(each * u, axis=1)) ** 2 / expected)
    assert table["temperature_modes"][:, 0].mean() == pytest.approx(np.mean(modes), rel=1e-9)
    cell = np.minimum((r / 4.0).astype(int), 1) @ np.array([1, 2])
    ratios = []
    for where, value in zip(cell, u, strict=True):
        count = np.bincount(where, minlength=4)
        exact = count * (shell.variance - shell.covariance) + count**2 * shell.covariance
        ratios.append(np.sum(np.bincount(where, value, 4) ** 2) / exact.sum())
    assert table["warm_cells_2"].mean() == pytest.approx(np.mean(ratios), rel=1e-9)


def test_long_waves_are_those_of_landau_and_lifshitz() -> None:
    """Var S = kB C_p and Var P = rho c_S^2 kB T/V, but for the motion of the particles."""
    for of in (gas(25.0), fluid(25.0, thermal_expansion=0.3)):
        made = scene(of)
        density = DensityPrediction(made, 0.0)
        theory = EnergyPrediction(made, density)
        assert theory.heat_ratio == pytest.approx(made.adiabatic_ratio, rel=0.04)
        cell = cell_variances(
            density=1.0,
            thermal_energy=1.0,
            sound_speed=10.0,
            volume=1.0,
            heat_ratio=made.adiabatic_ratio,
            temperature=1.0,
            specific_heat=25.0,
        )
        # 3.5 %: the mean density of the particles, squared; 2 %: ln T of a few k
        assert float(theory.entropy_modes(1e-6)) == pytest.approx(cell.entropy, rel=0.05)
        pressure = float(theory.pressure_modes(1e-6)) * 1e4
        assert pressure == pytest.approx(cell.pressure_adiabatic, rel=0.04)


def test_drawn_temperatures_are_of_the_equilibrium() -> None:
    made = small(edge=40.0)
    drawn = draw_temperatures(made, 4)
    assert drawn.mean() == pytest.approx(1.0)
    assert 20.0 * drawn.var() == pytest.approx(1.0, abs=0.15)
    np.testing.assert_array_equal(drawn, draw_temperatures(made, 4))
    assert EnergySums(made, np.zeros(2)).shell.particles == 1600


def test_energies_that_do_not_get_about_are_refused() -> None:
    still = small(gas(20.0, thermal_conductivity=None))
    with pytest.raises(ValueError, match="must have heat conduction where its fluid has an energy"):
        run_fluctuations(still)
    bath = small(effects=sdpd.Effects(energy=True, viscous_heating=False))
    with pytest.raises(ValueError, match="must have viscous heating where"):
        run_fluctuations(bath)


def test_command(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    small(edge=8.0).to_toml(path)
    arguments = ["fluctuations", str(path), "--quick", "--time-factor", "0.05", "--no-progress"]
    code = cli.main([*arguments, "-o", str(tmp_path / "out")])
    printed = capsys.readouterr().out
    assert code == 0, printed
    assert "T of the shell" in printed
    with (tmp_path / "out" / "fluctuations.csv").open(encoding="utf-8") as file:
        groups = {line["group"] for line in csv.DictReader(file)}
    assert "temperature of particles" in groups
    assert (tmp_path / "out" / "fluctuations.png").stat().st_size > 10_000
