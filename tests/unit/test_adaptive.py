"""A time step that follows the fluid, and what is left when a run blows up."""

import os
from pathlib import Path

import numpy as np
import pytest

import sdpd

from .sims import INTEGRATORS, assert_same_bits, small, small_scene


def shot(sim, mach=5.0):
    """One particle faster than sound."""
    sim.velocities[7] = [mach * sim.scene.sound.speed, 0.0]
    return sim


def test_in_equilibrium_it_is_the_step_of_the_scene():
    sim = small(edge=20, dt="adaptive", threads=1)
    assert sim.adaptive == sdpd.AdaptiveStep() and sim.dt == sim.bounds[0].value
    assert "now, chosen anew every 10 steps" in str(sim)
    sim.run(100, progress=False)
    assert sim.dt == sim.bounds[0].value
    assert sim.time == pytest.approx(100 * sim.dt)


def test_it_falls_for_a_fast_particle_and_comes_back():
    sim = shot(small(edge=20, dt="adaptive", threads=1))
    top = sim.bounds[0].value
    found = []
    sim.run(400, callback=lambda s: found.append(s.dt), every=10, progress=False)
    assert found[0] < 0.6 / (5.0 * sim.scene.sound.speed) < 2.0 * found[0]
    assert found[-1] == top
    rungs = 4.0 * np.log2(np.divide(found, top))
    np.testing.assert_allclose(rungs, np.round(rungs), atol=1e-9)


def test_the_limits_follow_speed_push_and_density():
    sim = small(edge=20, dt="adaptive", threads=1)
    calm = {bound.name: bound.value for bound in sim.adaptive.limits(sim)}
    acoustic = {bound.name: bound.value for bound in sim.bounds}["acoustic accuracy"]
    assert calm["sound and flow"] == pytest.approx(acoustic)  # V0 is 0 and nobody flows
    shot(sim)
    fast = {bound.name: bound.value for bound in sim.adaptive.limits(sim)}
    c = sim.scene.sound.speed
    assert fast["fastest particle"] == pytest.approx(0.6 * sim.scene.spacing / (5.0 * c))
    assert fast["sound and flow"] < 0.3 * calm["sound and flow"]
    h, push = sim.scene.support_radius, np.linalg.norm(sim.forces, axis=1).max()
    assert fast["largest acceleration"] == pytest.approx(0.25 * np.sqrt(h / push))
    half = sdpd.AdaptiveStep(safety=0.5).limits(sim)
    assert {b.name: b.value for b in half}["fastest particle"] == fast["fastest particle"] / 2
    stiff = small_scene(
        20,
        fluid=sdpd.Fluid(
            density=1.0,
            shear_viscosity=20.0,
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=sdpd.eos.Tait(),
        ),
    )
    crowd = small(scene=stiff, dt="adaptive", threads=1)
    crowd.positions[:40] = crowd.positions[50] + 0.02 * np.arange(1, 41)[:, None]
    crowd.refresh()
    assert crowd.densities.max() > 2.0
    dense = {bound.name: bound.value for bound in crowd.adaptive.limits(crowd)}
    at_rest = {bound.name: bound.value for bound in crowd.bounds}["acoustic accuracy"]
    assert dense["sound and flow"] < 0.5 * at_rest


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_bits_depend_on_neither_threads_cuts_nor_files(tmp_path, integrator):
    options = {"edge": 40, "dt": sdpd.AdaptiveStep(every=7), "integrator": integrator}
    whole = shot(small(threads=1, **options), mach=60.0)
    parts = shot(small(threads=2, **options), mach=60.0)
    whole.run(60, progress=False)
    parts.run(10, progress=False)
    parts.run(7, callback=lambda s: None, every=3, progress=False)
    parts.save(tmp_path / "parts.sdpd")
    loaded = sdpd.load(tmp_path / "parts.sdpd", threads=1)
    assert loaded.adaptive == whole.adaptive and loaded.dt == parts.dt
    assert loaded.time < 0.9 * loaded.step * loaded.bounds[0].value, "the step was never chosen"
    for sim in (parts, loaded):
        sim.run(43, progress=False)
        assert_same_bits(whole, sim)
        assert sim.dt == whole.dt
    whole.restore(tmp_path / "parts.sdpd")
    whole.run(43, progress=False)
    assert_same_bits(whole, parts)


def test_a_time_is_reached_exactly():
    sim = shot(small(edge=20, dt="adaptive", threads=1))
    for span in (0.3, 1.0):
        before = sim.time
        sim.run(time=span, progress=False)
        assert sim.time - before == pytest.approx(span, rel=1e-12)
    steps = sim.step
    sim.run(time=0.0, progress=False)
    assert sim.step == steps


def test_a_fixed_step_comes_back():
    sim = small(edge=20, dt="adaptive", threads=1)
    sim.dt = "auto"
    assert sim.adaptive is None and sim.dt == sim.bounds[0].value
    sim.dt = sdpd.AdaptiveStep(largest=0.01)
    assert sim.dt == 0.01 and sim.adaptive is not None


def test_it_survives_what_a_fixed_step_does_not():
    """A shot at forty times the speed of sound."""
    sim = small(edge=20, threads=1)
    sim.velocities[7] = [40.0 * sim.scene.sound.speed, 0.0]
    with pytest.raises(sdpd.SimulationError):
        sim.run(200, progress=False)
    sim.dt = "adaptive"
    sim.run(400, progress=False)
    assert np.abs(sim.velocities).max() < 10.0 * sim.scene.thermal_speed


def test_a_step_that_would_never_end_is_an_error():
    sim = small(edge=20, dt=sdpd.AdaptiveStep(smallest=0.5), threads=1)
    shot(sim)
    with pytest.raises(
        sdpd.SimulationError, match=r"by `sound and flow` = .*, below `smallest`"
    ) as caught:
        sim.run(100, progress=False)
    assert sim.step == 0 and caught.value.step == 0 and caught.value.particle == 7


def test_observers_that_count_equal_steps_are_refused():
    sim = small(edge=20, dt="adaptive", threads=1)
    for observer in (sdpd.Correlator(), sdpd.Stress()):
        with pytest.raises(ValueError, match="where the time step is adaptive"):
            sim.run(1, observe=observer)
    thermo = sdpd.Thermodynamics(every=5)
    shot(sim).run(30, observe=thermo, progress=False)
    assert len(thermo) == 6 and np.all(np.diff(thermo["time"]) > 0.0)
    assert thermo["time"][-1] == sim.time


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"every": 0}, "`every` must be an integer >= 1, got 0"),
        ({"safety": 2.5}, "`safety` must be <= 2, got 2.5"),
        ({"smallest": 2.0}, "`smallest` must be <= 1, the share of `largest`, got 2"),
        ({"largest": -1.0}, "`largest` must be finite and > 0, got -1"),
    ],
)
def test_options_are_checked(options, text):
    with pytest.raises(ValueError) as caught:
        sdpd.AdaptiveStep(**options)
    assert str(caught.value) == text


# --- what is left of a run that blows up -----------------------------------------------------


def explode(sim, **options):
    """A particle that no step can hold, from step 20 on."""

    def push(s):
        s.velocities[3] = 1e7

    with pytest.raises(sdpd.SimulationError) as caught:
        sim.run(100, callback=push, every=20, progress=False, **options)
    return caught.value


def test_the_last_good_state_is_written_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sim, calm = small(edge=20, threads=1), small(edge=20, threads=1)
    error = explode(sim, on_error="checkpoint")
    assert error.checkpoint == "sdpd-step-20.sdpd" and f"saved in {error.checkpoint}" in str(error)
    assert error.step >= 20 and error.particle == 3 and error.dt == sim.dt
    loaded = sdpd.load(error.checkpoint)
    calm.run(20, progress=False)
    # The good state is what the callback left: calm but for the particle it pushed.
    np.testing.assert_array_equal(loaded.positions, calm.positions)
    rest = np.arange(400) != 3
    np.testing.assert_array_equal(loaded.velocities[rest], calm.velocities[rest])
    assert loaded.step == 20 and loaded.velocities[3].tolist() == [1e7, 1e7]
    for sim_ in (sim, loaded):
        sim_.velocities[3] = 0.0
        sim_.run(10, progress=False)
    assert_same_bits(sim, loaded)
    # A file that is there is never replaced.
    again = explode(small(edge=20, threads=1), on_error="checkpoint")
    assert again.checkpoint == "sdpd-step-20-2.sdpd"


def test_the_file_may_be_named(tmp_path):
    path = tmp_path / "good.sdpd"
    error = explode(small(edge=20, threads=1), on_error=path)
    assert error.checkpoint == str(path) and sdpd.load(path).step == 20


def test_a_state_that_cannot_be_saved_leaves_the_error(tmp_path, monkeypatch):
    def full(self, path):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sdpd.Simulation, "save", full)
    error = explode(small(edge=20, threads=1), on_error=tmp_path / "good.sdpd")
    assert error.checkpoint is None and "could not be saved" in str(error)
    assert "No space left" in str(error) and error.particle == 3
    assert os.listdir(tmp_path) == []


def test_nothing_is_written_unless_asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert explode(small(edge=20, threads=1)).checkpoint is None
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        ("save", ValueError, "`on_error` must be one of 'raise', 'checkpoint', got 'save'"),
        (3, TypeError, "`on_error` must be"),
        (Path("no/such/folder/a.sdpd"), ValueError, "`on_error` must be in a folder that exists"),
    ],
)
def test_on_error_is_checked(value, kind, text):
    with pytest.raises(kind) as caught:
        small().run(1, on_error=value)
    assert str(caught.value).startswith(text)
