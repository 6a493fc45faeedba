"""`sdpd viscosity` of fluids with an energy: temperatures that fluctuate, heat taken out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import sdpd
from sdpd import viscosity
from sdpd.fluctuations.energy_sums import draw_temperatures, shell_temperature
from sdpd.viscosity.arrangement import Arrangement
from sdpd.viscosity.plan import check_scene, plan_scene, sample_scene
from sdpd.viscosity.predictions import friction_theory
from sdpd.viscosity.thermostat import Thermostat
from tests.unit.thermal import gas, scene, slab

VECTORS = np.array([[1, 0], [0, 1]])


def small(capacity: float = 10.0, **changes: Any) -> sdpd.Scene:
    arguments: dict[str, Any] = {
        "box": sdpd.Box((8.0, 8.0)),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        "start": sdpd.RandomStart(relax_steps=50),
        **changes,
    }
    return scene(gas(capacity, shear_viscosity=14.0), **arguments)


def test_fluctuating_temperatures_take_their_share_of_the_friction() -> None:
    """1 - kB/(2 C) where temperatures are equal; twice the harmonic mean over the sum elsewhere."""
    made = small()
    cold = made.replace(effects=sdpd.Effects(energy=False))
    sim = sdpd.Simulation(made, dt=0.005, seed=3, threads=1)
    found = []
    for of in (made, cold):
        seen = Arrangement(of, wave_vectors=VECTORS, dt=1e-7, every=1)
        seen.sample(sim)
        seen.sample(sim)
        found.append((seen.friction.value, seen.waves[0].value, seen.random.value))
    np.testing.assert_allclose(np.divide(*found)[:2], 1.0 - 0.05, rtol=1e-12)
    # the noise is that of kB Tbar, which here is the fluid's
    assert found[0][2] == pytest.approx(found[1][2], rel=1e-5)
    assert friction_theory(made).shear_viscosity == pytest.approx(0.95 * 14.0)


def test_random_part_of_the_stress_is_that_of_the_pairs() -> None:
    """Mean square of the random impulses' moment against the sum over pairs."""
    made = small()
    sim = sdpd.Simulation(made, dt=0.008, seed=8, threads=1)
    sim.temperatures = draw_temperatures(made, 2)
    sim.run(100, progress=False)
    stress = sdpd.StressCorrelator(every=1, points=4, levels=1, parts=True)
    seen = Arrangement(made, wave_vectors=VECTORS, dt=sim.dt, every=20)
    sim.run(1600, observe=[stress, seen], progress=False)
    found = stress.increments(part="random", n_blocks=32)
    expected = 2.0 * 64.0 * seen.random.value * sim.dt
    ratio = found.blocks[:, 1] / expected  # lag 0 is nothing
    error = ratio.std(ddof=1) / math.sqrt(len(ratio))
    assert found.lag[1] == pytest.approx(sim.dt)
    assert error < 0.03
    assert abs(ratio.mean() - 1.0) < 4.0 * error


def test_heat_of_the_force_is_taken_out() -> None:
    """T stays; what was taken is the work of the force."""
    force = sdpd.SinusoidalForce(amplitude=1.5, direction="x", along="y")
    made = small(body_force=force)
    sim = sdpd.Simulation(made, seed=5, threads=1)
    thermostat = Thermostat(sim, seed=1)
    start = shell_temperature(sim) - 1.0
    thermostat.run(800, every=4, progress=False)
    assert shell_temperature(sim) == pytest.approx(1.0, abs=1e-12)
    whole = 64 * 10.0 + 63
    work = sim.energy_accounts().body_work
    assert work > 0.05 * whole
    assert thermostat.heating * whole == pytest.approx(work + start * whole, rel=1e-9)
    plain = sdpd.Simulation(made.replace(effects=sdpd.Effects(energy=False)), seed=5, threads=1)
    idle = Thermostat(plain, seed=1)
    idle.run(4, every=4, progress=False)
    assert plain.step == 4
    assert idle.heating == 0.0


def test_sample_keeps_the_energy_and_drops_hot_walls() -> None:
    walled = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.2), of=gas(20.0), noise=True)
    assert sample_scene(walled, particles=343).active_effects.energy
    bath = small(effects=sdpd.Effects(energy=True, viscous_heating=False))
    with pytest.raises(ValueError, match="must have viscous heating where its fluid has an energy"):
        check_scene(bath)


def test_short_study() -> None:
    """Friction, lattice and report of a fluid with an energy; methods within their errors."""
    made = small(20.0)
    study = viscosity.run_viscosity(
        made, quick=True, time_factor=0.1, seed=3, progress=False, threads=1
    )
    assert study.lattice_holds
    assert study.passed, str(study)
    assert study.heating > 0.0
    share = study.friction / 14.0
    assert 0.85 < share < 0.975  # kernel, splitting, and 1 - kB/2C
    text = str(study)
    assert "2.50% of the friction" in text and "taken out" in text
    assert plan_scene(sample_scene(made), quick=True).dt <= 2.0 * made.conduction_time
