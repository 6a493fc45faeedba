"""Steps that the arrays do not show: a large system is run step by step, and seen now and then."""

import os
import signal

import numpy as np
import pytest

import sdpd
from sdpd import running

from .scenes import reduced_scene
from .sims import assert_same_bits, small, small_scene


@pytest.fixture(params=[1, 3])
def step_by_step(request, monkeypatch):
    """Calls of the core as short as those of a large system, of which every eighth step is seen."""
    monkeypatch.setattr(running, "STEPS_BETWEEN_VIEWS", 8)
    monkeypatch.setattr(running, "chunk_steps", lambda *_: request.param)
    return request.param


def observed(sim, **options):
    stress, correlator = sdpd.Stress(every=2), sdpd.Correlator(every=1)
    sim.run(observe=[stress, correlator], **options)
    return stress.total, correlator.msd


@pytest.mark.parametrize("integrator", ["pair_splitting", "velocity_verlet"])
def test_bits_and_samples_are_those_of_long_calls(step_by_step, integrator):
    one = small(integrator=integrator)
    found = observed(one, steps=29)
    with pytest.MonkeyPatch.context() as long_calls:
        long_calls.setattr(running, "chunk_steps", lambda *_: 10**6)
        two = small(integrator=integrator)
        expected = observed(two, steps=29)
    assert_same_bits(one, two)
    for a, b in zip(found, expected, strict=True):
        assert a.tobytes() == b.tobytes()


@pytest.mark.parametrize("integrator", ["pair_splitting", "velocity_verlet"])
def test_impulses_of_walls(step_by_step, integrator):
    box = sdpd.Box((8.0, 8.0), periodic="x")
    scene = reduced_scene(2, box=box, walls=sdpd.walls.slab(box, "y"))
    found = []
    for chunk in (step_by_step, 10**6):
        with pytest.MonkeyPatch.context() as calls:
            calls.setattr(running, "chunk_steps", lambda *_, chunk=chunk: chunk)
            forces = sdpd.WallForces(every=5)
            sim = sdpd.Simulation(scene, dt=0.002, seed=1, integrator=integrator)
            sim.run(steps=22, observe=forces)
            found.append(forces.force)
    assert found[0].tobytes() == found[1].tobytes()


def test_callbacks_see_the_state_of_their_step(step_by_step):
    seen = {}
    sim = small()
    sim.run(steps=20, every=5, callback=lambda s: seen.update({s.step: np.array(s.positions)}))
    again = small()
    for step in (5, 10, 15, 20):
        again.run(steps=5)
        assert np.array_equal(again.positions, seen[step])


def test_a_failure_returns_to_what_was_shown(step_by_step):
    with pytest.warns(sdpd.TimeStepWarning):
        sim = small(integrator="velocity_verlet", dt=0.4)
    thermo = sdpd.Thermodynamics(every=1)
    with pytest.raises(sdpd.SimulationError) as caught:
        sim.run(steps=400, observe=thermo)
    # the last state that was shown: at most so many steps and a call before the failure
    assert 0 <= caught.value.step - sim.step <= running.STEPS_BETWEEN_VIEWS + step_by_step
    assert np.isfinite(sim.positions).all() and np.isfinite(sim.velocities).all()
    assert list(thermo["step"]) == list(range(1, sim.step + 1))
    assert sim.time == pytest.approx(sim.step * sim.dt)
    sim.velocities[:] = 0.0
    sim.dt = 0.001
    before = sim.step
    sim.run(steps=5)
    assert sim.step == before + 5


def test_an_exception_in_a_callback_leaves_whole_steps(step_by_step):
    class Stop(Exception):
        pass

    def stop(sim):
        if sim.step >= 10:
            raise Stop

    sim, again = small(), small()
    with pytest.raises(Stop):
        sim.run(steps=100, every=5, callback=stop)
    again.run(steps=10)
    assert_same_bits(sim, again)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer that signals")
def test_a_handler_that_saves_changes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(running, "chunk_steps", lambda *_: 1)
    scene = small_scene(40)
    sim, again = small(scene=scene), small(scene=scene)
    saved = []

    def handler(*_):
        path = tmp_path / f"{len(saved)}.sdpd"
        sim.save(path)
        saved.append((path, sim.step))

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.005, 0.02)
    try:
        sim.run(steps=150)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    again.run(steps=150)
    assert_same_bits(sim, again)
    assert saved and os.path.exists(saved[0][0])
    loaded = sdpd.load(saved[-1][0])
    loaded.run(steps=150 - loaded.step)
    assert_same_bits(loaded, again)
