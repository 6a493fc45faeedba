"""The current of heat from Python: its series, its correlations, and what has none."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import sdpd
from sdpd import analysis, conductivity

from .thermal import fluid, scene, slab


@pytest.fixture(scope="module")
def observed() -> tuple[sdpd.Simulation, sdpd.HeatCurrent, sdpd.HeatCurrentCorrelator]:
    sim = sdpd.Simulation(scene(edge=6.0), seed=3, threads=1)
    series, products = sdpd.HeatCurrent(every=2), sdpd.HeatCurrentCorrelator(every=2, points=8)
    sim.run(steps=400, observe=[series, products], progress=False)
    return sim, series, products


def settings(sim: sdpd.Simulation) -> dict[str, float]:
    return {"volume": sim.scene.box.volume, "temperature": 1.0, "boltzmann_constant": 1.0}


# --- series and correlations ------------------------------------------------------------------


def test_series_has_parts_that_add_up(observed) -> None:
    _, series, _ = observed
    data = series.data
    assert len(series) == 199 and data["step"][0] == 4
    assert series.interval == pytest.approx(np.diff(data["time"])[0])
    total = sum(data[name] for name in ("conduction", "friction", "pressure", "convection"))
    np.testing.assert_array_equal(series.total, total)
    # white noise is most of the flux over so short a time
    assert 0.5 < np.square(data["noise"]).mean() / np.square(series.total).mean() < 1.5


def test_correlator_is_the_correlation_of_the_series(observed) -> None:
    sim, series, products = observed
    volume, dt = sim.scene.box.volume, series.interval
    plain = products.increments(exact_noise=False, n_blocks=2)
    moment = np.concatenate([np.zeros((1, 3)), np.cumsum(series.total, axis=0)]) * volume * dt
    for lag in (1, 3, 7, 16):
        rows = moment[1:]  # the correlator's first sample is the end of the first interval
        expected = np.square(rows[lag:] - rows[:-lag]).mean()
        got = plain.mean[np.argmin(np.abs(plain.lag - lag * dt))]
        stride = 1 if lag < 8 else 2
        assert stride > 1 or got == pytest.approx(expected, rel=1e-10)
    flux = products.autocorrelation(exact_noise=False, n_blocks=2)
    for lag in range(4):
        stop = len(series) - lag
        expected = (series.total[lag:] * series.total[:stop]).mean()
        assert flux.mean[lag] == pytest.approx(expected, rel=1e-10)


def test_exact_noise_changes_no_mean_and_most_of_the_error(observed) -> None:
    sim, _, products = observed
    window = (2.0 * products._dt, 14.0 * products._dt)
    plain, exact = (
        analysis.einstein_conductivity(
            products.increments(exact_noise=way, n_blocks=16), window=window, **settings(sim)
        )
        for way in (False, True)
    )
    assert exact.stderr < 0.5 * plain.stderr
    assert abs(exact.value - plain.value) < 4.0 * plain.stderr
    noise = products.noise_increments()
    np.testing.assert_allclose(
        noise.mean[1:] / noise.lag[1:], noise.mean[1] / noise.lag[1], rtol=0.05
    )


def test_green_kubo_is_the_slope_of_the_helfand_moment() -> None:
    """To rounding where both use the same intervals: a periodic series."""
    flux = np.random.default_rng(7).normal(size=(64, 2))
    dt, volume, n = 0.3, 5.0, 6
    many = np.tile(flux, (40, 1))
    moment = analysis.heat_increments(many, dt, volume=volume, max_lag=n + 1, n_blocks=2)
    function = analysis.heat_autocorrelation(many, dt, max_lag=n, n_blocks=2)
    found = analysis.green_kubo_conductivity(
        function, volume=volume, temperature=2.0, boltzmann_constant=3.0
    )
    slope = (moment.mean[n + 1] - moment.mean[n]) / dt / (2.0 * volume * 3.0 * 2.0**2)
    assert found.value == pytest.approx(slope, rel=0.02)
    running = analysis.running_conductivity(
        function, volume=volume, temperature=2.0, boltzmann_constant=3.0
    )
    assert running.mean[-1] == pytest.approx(found.value, rel=1e-12)


def test_frozen_particles_conduct_as_the_lattice_sum_says() -> None:
    """No motion: conduction alone, of which the noise is all that matters to slow waves."""
    still = scene(
        fluid(50.0, shear_viscosity=0.0),
        edge=6.0,
        start=sdpd.LatticeStart(velocities="zero"),
    )
    dt = 0.25 * still.conduction_time
    sim = sdpd.Simulation(still, dt=dt, seed=5, threads=1)
    sim.run(steps=100, progress=False)
    heat = sdpd.HeatCurrentCorrelator(every=2, points=16, levels=1)
    sim.run(steps=1000, observe=heat, progress=False)
    assert np.abs(np.asarray(sim.velocities)).max() < 1e-9
    temperature = float(np.mean(sim.temperatures))
    found = analysis.einstein_conductivity(
        heat.increments(n_blocks=16),
        volume=still.box.volume,
        temperature=temperature,
        boltzmann_constant=1.0,
        window=(8.0 * dt, 28.0 * dt),
    )
    expected = conductivity.lattice_conductivity(still, 1e-3)
    assert found.relative < 0.02
    assert abs(found.value / expected - 1.0) < 4.0 * found.relative + 0.002, str(found)


# --- what has no current ----------------------------------------------------------------------


def test_what_has_no_current_is_refused() -> None:
    def refusal(made: sdpd.Scene, **options) -> str:
        sim = sdpd.Simulation(made, threads=1, **options)
        messages = []
        for observer in (sdpd.HeatCurrent(), sdpd.HeatCurrentCorrelator()):
            with pytest.raises(ValueError, match="`observe` must") as caught:
                sim.run(steps=2, observe=observer)
            messages.append(str(caught.value))
        assert sim.step == 0
        return " ".join(messages)

    assert "isothermal" in refusal(scene(effects=sdpd.Effects()))
    assert "walls" in refusal(slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.1)))
    bath = scene(effects=sdpd.Effects(energy=True, viscous_heating=False))
    assert "viscous heating" in refusal(bath)
    adiabats = sdpd.PairSplitting(energy_bookkeeping=False)
    assert "energy_bookkeeping" in refusal(scene(edge=6.0), integrator=adiabats)


def test_a_fluid_that_moves_carries_enthalpy_and_not_heat() -> None:
    sim = sdpd.Simulation(scene(edge=6.0), seed=1, threads=1)
    sim.velocities += 1.0
    with pytest.raises(ValueError, match="fluid at rest only: its mean velocity is up to 1 "):
        sim.run(steps=2, observe=sdpd.HeatCurrentCorrelator())
    series = sdpd.HeatCurrent(every=1)
    sim.run(steps=20, observe=series, progress=False)  # as it is
    enthalpy = sim.total_energy / sim.scene.box.volume + float(np.mean(sim.pressures))
    mean = series.total.mean(axis=0)  # e + P, times the velocity
    np.testing.assert_allclose(mean, enthalpy, rtol=0.06)
    driven = scene(edge=6.0, body_force=sdpd.SinusoidalForce(amplitude=1.0))
    with pytest.raises(ValueError, match="where a body force acts"):
        sdpd.Simulation(driven, threads=1).run(steps=2, observe=sdpd.HeatCurrentCorrelator())


def test_bad_arguments_are_named(observed) -> None:
    sim, series, products = observed
    with pytest.raises(ValueError, match="`part` must be one of 'total', 'conduction'"):
        products.increments("enthalpy")
    with pytest.raises(TypeError, match="`exact_noise` must be"):
        products.autocorrelation(exact_noise="yes")
    with pytest.raises(ValueError, match="`flux` must have shape"):
        analysis.heat_increments(np.zeros((9, 4)), 1.0, volume=1.0, max_lag=2)
    with pytest.raises(ValueError, match="`temperature` must be"):
        analysis.green_kubo_conductivity(
            products.autocorrelation(), volume=1.0, temperature=0.0, boltzmann_constant=1.0
        )
    kept = pickle.loads(pickle.dumps(series))
    np.testing.assert_array_equal(kept.total, series.total)
    assert "199 intervals" in repr(kept) and "HeatCurrentCorrelator" in repr(products)
    assert products.volume == sim.scene.box.volume
