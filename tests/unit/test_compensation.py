"""The viscosity that the splitting delivers at large steps, and what gives it back."""

import math
import warnings

import numpy as np
import pytest

import sdpd
from sdpd import compensation

from .scenes import reduced_scene
from .sims import assert_same_bits

SILENT = sdpd.Effects(fluctuations=False)


def soft(dimension=3, support=3.0, **changes):
    """So soft that nothing but friction acts."""
    resolution = sdpd.Resolution(spacing=1.0, support=support, kernel="lucy")
    return reduced_scene(
        dimension, resolution=resolution, sound_speed=1e-3, **{"effects": SILENT, **changes}
    )


def decay_rate(scene, ratio, seed=1, **options):
    """Of a shear wave along y, at dt = `ratio` tau."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sim = sdpd.Simulation(
            scene,
            dt=ratio * scene.friction_time,
            integrator=sdpd.PairSplitting(**options),
            seed=seed,
            threads=1,
        )
    k = 2.0 * math.pi / scene.box.lengths[1]
    wave = np.sin(k * sim.positions[:, 1])
    sim.velocities[:, 0] = 1e-4 * (wave - wave.mean())
    before = sim.velocities[:, 0] @ wave
    steps = max(1, round(1.0 / (20.0 * k**2 * sim.dt)))
    sim.run(steps, progress=False)
    return -math.log(sim.velocities[:, 0] @ wave / before) / (steps * sim.dt)


def test_delivered_viscosity_is_that_of_the_measured_curves():
    """docs/generated/delivered_viscosity.md, Lucy 3; dt -> 0 delivers all."""
    scene = soft()
    for ratio, expected in ((0.01, 1.0), (0.5, 0.9997), (1.8, 0.9964), (11.0, 0.9398)):
        found = compensation.delivered_viscosity(scene, ratio * scene.friction_time)
        assert found == pytest.approx(expected, abs=5e-4)


def test_sweeps_deliver_what_shorter_steps_do():
    scene = soft()
    tau = scene.friction_time
    for sweeps in (2, 5):
        one = compensation.delivered_viscosity(scene, 10.0 * tau / sweeps)
        several = compensation.delivered_viscosity(scene, 10.0 * tau, sweeps=sweeps)
        assert several == pytest.approx(one, abs=0.35 * (1.0 - one))


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_scale_gives_the_viscosity_back_on_a_lattice(dimension):
    scene = soft(dimension)
    dt = 8.0 * scene.friction_time
    scale = compensation.friction_scale(scene, dt)
    assert 1.03 < scale < 1.5
    assert compensation.delivered_viscosity(scene, dt, scale=scale) == pytest.approx(1.0, abs=1e-4)


def test_a_fluid_without_order_delivers_what_was_asked_for():
    """Against its own decay at tau/4, which friction alone decides."""
    scene = soft(2, box=sdpd.Box((24.0, 24.0)), start=sdpd.RandomStart())
    exact = decay_rate(scene, 0.25)
    lost = decay_rate(scene, 10.0) / exact
    assert lost < 0.85
    assert decay_rate(scene, 10.0, compensate=True) / exact == pytest.approx(1.0, abs=0.015)
    many = decay_rate(scene, 100.0, compensate=True, sweeps=10) / exact
    assert many == pytest.approx(1.0, abs=0.015)


def test_noise_follows_the_friction():
    """The temperature is that of the fluid, compensated or in sweeps."""
    scene = reduced_scene(3, eta=200.0, box=sdpd.Box((8.0,) * 3), sound_speed=3.0)
    for options in ({"compensate": True}, {"sweeps": 4}):
        sim = sdpd.Simulation(
            scene,
            dt=8.0 * scene.friction_time,
            integrator=sdpd.PairSplitting(**options),
            seed=3,
            threads=1,
        )
        thermo = sdpd.Thermodynamics(every=1)
        sim.run(100, observe=thermo, progress=False)
        found = sdpd.analysis.time_average(thermo["temperature"])
        assert found.stderr < 5e-3
        assert abs(found.value - 1.0) < 4.0 * found.stderr
        assert np.abs(sim.momentum).max() < 1e-11


def test_the_bits_are_those_of_one_run_on_any_threads_and_across_files(tmp_path):
    scene = reduced_scene(2, eta=200.0, box=sdpd.Box((40.0, 40.0)), sound_speed=3.0)
    options = {
        "dt": 9.0 * scene.friction_time,
        "integrator": sdpd.PairSplitting(compensate=True, sweeps=2),
        "seed": 2,
    }
    whole = sdpd.Simulation(scene, threads=1, **options)
    parts = sdpd.Simulation(scene, threads=2, **options)
    whole.run(11, progress=False)
    parts.run(4, progress=False)
    parts.save(tmp_path / "parts.sdpd")
    parts = sdpd.load(tmp_path / "parts.sdpd", threads=1)
    assert parts.integrator == options["integrator"]
    parts.run(7, progress=False)
    assert_same_bits(whole, parts)


def test_the_friction_follows_a_new_step():
    scene = reduced_scene(3, eta=200.0, box=sdpd.Box((8.0,) * 3), sound_speed=3.0)
    integrator = sdpd.PairSplitting(compensate=True)
    sim = sdpd.Simulation(scene, dt=9.0 * scene.friction_time, integrator=integrator, threads=1)
    sim.run(1, progress=False)
    sim.dt = 0.01 * scene.friction_time
    sim.run(1, progress=False)
    plain = sdpd.Simulation(scene, positions=sim.positions, dt=sim.dt, threads=1)
    assert sim.friction_rate() == pytest.approx(plain.friction_rate(), rel=1e-4)


def test_what_cannot_be_compensated_is_refused_with_the_cure():
    scene = reduced_scene(3, sound_speed=1.0)
    text = (
        r"`compensate` must be False at dt = .* = 100 tau in 1 sweep a half step, which deliver 0\."
    )
    integrator = sdpd.PairSplitting(compensate=True)
    with pytest.warns(sdpd.TimeStepWarning), pytest.raises(ValueError, match=text):
        sdpd.Simulation(scene, dt=100.0 * scene.friction_time, integrator=integrator)
    sim = sdpd.Simulation(scene, integrator=integrator)
    before = sim.dt
    with pytest.warns(sdpd.TimeStepWarning), pytest.raises(ValueError, match="raise `sweeps`"):
        sim.dt = 100.0 * scene.friction_time
    assert sim.dt == before


def test_the_bound_says_what_is_lost_and_the_cure():
    scene = reduced_scene(3, sound_speed=1.0)
    tau = scene.friction_time
    plain = {bound.name: bound for bound in sdpd.timestep.bounds(scene)}["friction"]
    assert plain.value == pytest.approx(2.0 * tau)
    assert "the delivered viscosity falls" in plain.reason and "compensate=True" in plain.reason
    mended = sdpd.PairSplitting(compensate=True, sweeps=3)
    bound = {bound.name: bound for bound in sdpd.timestep.bounds(scene, mended)}["friction"]
    assert bound.value == pytest.approx(30.0 * tau) and bound.formula == "3 x 10 tau"
    assert sdpd.timestep.expected_errors(scene, 9.0 * tau, mended).viscosity == 0.0
    sweeps = sdpd.timestep.expected_errors(scene, 9.0 * tau, sdpd.PairSplitting(sweeps=3))
    alone = sdpd.timestep.expected_errors(scene, 3.0 * tau)
    assert sweeps.viscosity == alone.viscosity


@pytest.mark.parametrize(
    ("options", "kind", "text"),
    [
        ({"compensate": 1}, TypeError, "`compensate` must be True or False, got 1 of type int"),
        ({"sweeps": 0}, ValueError, "`sweeps` must be an integer >= 1, got 0"),
        ({"sweeps": 256}, ValueError, "`sweeps` must be"),
    ],
)
def test_options_are_checked(options, kind, text):
    with pytest.raises(kind) as caught:
        sdpd.PairSplitting(**options)
    assert str(caught.value).startswith(text)


def test_fluids_with_an_energy_refuse_both():
    for options in ({"compensate": True}, {"sweeps": 2}):
        with pytest.raises(ValueError, match="where the fluid has an energy, got PairSplitting"):
            sdpd.integrators.resolve(sdpd.PairSplitting(**options), fluctuations=True, energy=True)
    with pytest.raises(ValueError, match="`scene` must have a viscosity"):
        compensation.delivered_viscosity(reduced_scene(3, eta=0.0), 0.1)
