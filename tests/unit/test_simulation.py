"""`sdpd.Simulation`: views, running, observers, callbacks, interruption, failure."""

import gc
import io
import os
import pickle
import signal
import sys
import threading
import warnings

import numpy as np
import pytest

import sdpd
from sdpd import failure, progress, running

from .sims import ARRAYS, INTEGRATORS, assert_same_bits, small, small_scene

# --- construction ----------------------------------------------------------------------------


def test_default_integrator_follows_the_effects():
    assert isinstance(small().integrator, sdpd.PairSplitting)
    quiet = small_scene(effects=sdpd.Effects(fluctuations=False))
    assert isinstance(small(scene=quiet).integrator, sdpd.VelocityVerlet)
    dry = small_scene(effects=sdpd.Effects(dissipation=False))
    assert isinstance(small(scene=dry).integrator, sdpd.VelocityVerlet)


def test_integrator_by_name_and_object():
    assert small(integrator="velocity_verlet").integrator == sdpd.VelocityVerlet()
    chosen = sdpd.VelocityVerlet(iterations=0, noise="gaussian")
    assert small(integrator=chosen).integrator is chosen


def test_auto_time_step_is_the_smallest_bound():
    sim = small()
    assert sim.dt == sim.bounds[0].value
    assert sim.dt_bound == sim.bounds[0].name
    finer = small(resolve_vacf=True)
    assert finer.dt_bound == "velocity autocorrelation"
    assert finer.dt < sim.dt
    once = sdpd.VelocityVerlet(iterations=1)
    verlet = small(integrator=once, temperature_error=0.01)
    assert verlet.dt == pytest.approx(2.0 * small(integrator=once).dt)


def test_a_time_step_above_a_bound_warns_with_name_and_value():
    sim = small()
    with pytest.warns(sdpd.TimeStepWarning, match=r"`dt` = .* exceeds friction \(accuracy\)") as w:
        large = small(dt=1.1 * sim.dt)
    assert f"{sim.dt:.4g}" in str(w[0].message)
    assert large.dt == 1.1 * sim.dt
    with pytest.warns(sdpd.TimeStepWarning, match="exceeds acoustic stability"):
        sim.dt = 10.0 * sim.dt
    sim.dt = "auto"
    assert sim.dt == sim.bounds[0].value


def test_the_warning_points_at_the_caller():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sim = sdpd.Simulation(small_scene(), dt=0.06)
        sim.dt = 0.05
    assert [w.filename for w in caught] == [__file__, __file__]


def test_initial_arrays_are_taken_and_wrapped():
    scene = small_scene(edge=10)
    index = np.arange(100)
    points = np.stack([index % 10 + 0.5, index // 10 + 0.5], axis=1)
    speeds = np.zeros((100, 2))
    speeds[3] = 1.0, -2.0
    sim = sdpd.Simulation(scene, positions=points + [10.0, -20.0], velocities=speeds.tolist())
    np.testing.assert_allclose(sim.positions, points, atol=1e-13)
    np.testing.assert_array_equal(sim.velocities, speeds)
    np.testing.assert_array_equal(sim.images, 0)


def test_start_depends_on_the_seed_only():
    assert_same_bits(small(threads=1), small(threads=2))
    assert not np.array_equal(small(seed=1).positions, small(seed=2).positions)
    assert not np.array_equal(small(seed=1).velocities, small(seed=2).velocities)


def test_initial_velocities_are_thermal_without_momentum():
    sim = small(edge=30)
    assert np.abs(sim.momentum).max() < 1e-12
    assert abs(sim.temperature - 1.0) < 5.0 * np.sqrt(2.0 / (2 * 899))
    assert np.all(
        small(scene=small_scene(start=sdpd.LatticeStart(velocities="zero"))).velocities == 0
    )


def test_threads_default_to_what_is_worth_it():
    assert small().threads == 1
    assert 1 <= small(edge=40).threads <= max(1, os.cpu_count() or 1)
    assert small(threads=3).threads == 3


def test_it_shows_itself():
    sim = small()
    sim.run(steps=2)
    assert repr(sim).startswith("<sdpd.Simulation of 100 particles in 2D, step 2, time 0.0")
    text = str(sim)
    assert "PairSplitting" in text and "tightest bound friction" in text and "seed" in text
    assert len(sim) == sim.n_particles == 100


def test_properties():
    sim = small(integrator="velocity_verlet", seed=9)
    assert sim.seed == 9 and sim.scene.n_particles == 100
    mass = sim.scene.particle_mass
    v = sim.velocities
    assert sim.kinetic_energy == pytest.approx(0.5 * mass * (v**2).sum())
    peculiar = v - v.mean(axis=0)
    assert sim.temperature == pytest.approx(mass * (peculiar**2).sum() / (2 * 99))
    np.testing.assert_allclose(sim.momentum, mass * v.sum(axis=0))
    assert np.isfinite(sim.potential_energy)
    assert sim.friction_rate() == pytest.approx(1.0 / sim.scene.friction_time, rel=0.3)
    assert sim.statistics()["pairs_in_list"] > 100
    parts = sim.force_parts()
    assert set(parts) == {"conservative", "dissipative", "random"}
    assert parts["random"].shape == (100, 2)
    assert not np.array_equal(parts["random"], sim.force_parts(step=7)["random"])


def test_forces_are_the_conservative_ones_under_the_splitting():
    sim = small()
    sim.run(steps=3)
    np.testing.assert_allclose(sim.forces, sim.force_parts()["conservative"], rtol=1e-9, atol=1e-9)
    verlet = small(integrator="velocity_verlet")
    verlet.run(steps=3)
    conservative = verlet.force_parts()["conservative"]
    assert np.abs(verlet.forces - conservative).max() > 1.0


def test_forces_do_not_contain_the_body_force():
    force = sdpd.UniformForce((1.0, 0.0))
    for integrator in INTEGRATORS:
        sim = small(scene=small_scene(body_force=force), integrator=integrator)
        sim.run(steps=2)
        assert np.abs(sim.forces.sum(axis=0)).max() < 1e-9
        expected = 100 * sim.scene.particle_mass * sim.time
        assert sim.momentum[0] == pytest.approx(expected, rel=1e-9)


# --- views -----------------------------------------------------------------------------------


def test_views_share_memory_with_the_simulation():
    sim = small()
    for name in ARRAYS:
        view = getattr(sim, name)
        assert np.shares_memory(view, getattr(sim, name)), name
        assert not view.flags.owndata and view.flags.c_contiguous, name
        assert view.flags.writeable == (name in ("positions", "velocities")), name
    positions, densities = sim.positions, sim.densities
    before = positions.copy(), densities.copy()
    sim.run(steps=5)
    assert not np.array_equal(positions, before[0])
    assert not np.array_equal(densities, before[1])


def test_views_outlive_the_simulation():
    sim = small()
    sim.run(steps=1)
    view, copy = sim.positions, sim.positions.copy()
    del sim
    gc.collect()
    np.testing.assert_array_equal(view, copy)


def test_read_only_views_refuse_writing():
    sim = small()
    for name in set(ARRAYS) - {"positions", "velocities"}:
        with pytest.raises(ValueError, match="read-only"):
            getattr(sim, name)[0] = 0
        with pytest.raises(ValueError):
            getattr(sim, name).flags.writeable = True


def test_written_velocities_are_taken_over():
    sim = small()
    sim.velocities[:] = 0.0
    sim.velocities[:, 0] = 2.0
    sim.run(steps=3)
    np.testing.assert_allclose(sim.velocities.mean(axis=0), [2.0, 0.0], atol=1e-12)


def test_derived_arrays_are_fresh_after_refresh():
    sim = small()
    before = sim.densities.copy()
    sim.positions[7] = sim.positions[8] + 0.1
    np.testing.assert_array_equal(sim.densities, before)
    sim.refresh()
    assert sim.densities[7] > before[7]


def test_a_position_written_outside_is_wrapped_and_counted():
    sim = small()
    inside = sim.positions[4].copy()
    sim.positions[4] += [10.0, -20.0]
    sim.refresh()
    np.testing.assert_allclose(sim.positions[4], inside, atol=1e-12)
    np.testing.assert_array_equal(sim.images[4], [1, -2])
    np.testing.assert_allclose(sim.unwrapped[4], inside + [10.0, -20.0], atol=1e-12)


def test_whole_arrays_can_be_assigned():
    sim = small()
    view = sim.positions
    target = np.roll(sim.positions, 1, axis=0)
    sim.positions = target
    assert np.shares_memory(sim.positions, view)
    np.testing.assert_array_equal(view, target)
    sim.velocities *= 0.5
    sim.velocities = np.zeros((100, 2))
    assert sim.kinetic_energy == 0.0


def test_unwrapped_is_continuous():
    sim = small()
    sim.velocities[:] += 40.0
    begin, speed = sim.unwrapped, sim.velocities.mean(axis=0)
    sim.run(steps=10)
    moved = (sim.unwrapped - begin).mean(axis=0)
    np.testing.assert_allclose(moved, speed * sim.time, rtol=1e-9)
    assert sim.images.max() >= 1
    assert np.all((sim.positions >= 0.0) & (sim.positions < 10.0))


# --- running ---------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("threads", [1, 2])
def test_runs_in_parts_are_one_run(integrator, threads):
    options = {"integrator": integrator, "edge": 30}
    whole, parts = small(threads=1, **options), small(threads=threads, **options)
    whole.run(steps=40)
    for steps in (1, 12, 0, 27):
        parts.run(steps=steps)
    assert_same_bits(whole, parts)


def test_observers_and_callbacks_change_no_bit():
    plain, watched = small(), small()
    plain.run(steps=30)
    watched.run(
        steps=30,
        observe=[sdpd.Thermodynamics(every=3), sdpd.Correlator(every=1)],
        callback=lambda sim: sim.densities.sum(),
        every=7,
    )
    assert_same_bits(plain, watched)


def test_run_by_time_takes_equal_steps():
    sim = small()
    sim.run(time=10.4 * sim.dt)
    assert sim.step == 11
    assert sim.time == pytest.approx(10.4 * sim.dt, rel=1e-14)
    sim.run(time=0.0)
    assert sim.step == 11


@pytest.mark.parametrize("steps", [1, 3, 10, 1000, 12345])
def test_a_time_of_whole_steps_is_those_steps(steps):
    dt = 0.1
    assert running.plan_steps(None, steps * dt, dt) == running.Plan(steps, dt)
    assert running.plan_steps(None, sum([dt] * 10), dt) == running.Plan(10, dt)
    above = running.plan_steps(None, steps * dt * (1 + 1e-9), dt)
    assert above.steps == steps + 1 and above.dt * above.steps == pytest.approx(steps * dt)


def test_run_by_time_of_whole_steps_has_the_same_bits():
    one, other = small(), small()
    one.run(steps=10)
    other.run(time=10 * other.dt)
    assert_same_bits(one, other)


def test_dt_may_change_between_runs():
    sim = small()
    sim.run(steps=4)
    begin, old = sim.time, sim.dt
    sim.dt = 0.25 * old
    sim.run(steps=4)
    assert sim.time == pytest.approx(begin + old)


def test_chunks_shrink_with_the_system():
    assert running.chunk_steps(100.0, 1.2e7) > 1000
    assert running.chunk_steps(5e10, 1.2e7) == 1
    assert running.chunk_steps(3375 * 54.0, 2.2e7) == 24


def test_run_refuses_a_second_run():
    sim = small()
    with pytest.raises(RuntimeError, match="running already"):
        sim.run(steps=2, callback=lambda s: s.run(steps=1))
    sim.run(steps=1)


def test_a_second_thread_is_refused_while_running():
    sim = small(edge=30)
    errors = []

    def use(inner):
        thread = threading.Thread(target=attempt)
        thread.start()
        thread.join()

    def attempt():
        try:
            sim.run(steps=1)
        except RuntimeError as error:
            errors.append(str(error))

    sim.run(steps=1, callback=use)
    assert len(errors) == 1 and "running already" in errors[0]


def test_run_works_in_another_thread():
    sim, twin = small(), small()
    thread = threading.Thread(target=sim.run, kwargs={"steps": 10})
    thread.start()
    thread.join()
    twin.run(steps=10)
    assert_same_bits(sim, twin)


# --- callbacks -------------------------------------------------------------------------------


def test_callbacks_come_at_multiples_of_every():
    sim = small()
    seen = []
    sim.run(steps=10, callback=lambda s: seen.append(s.step), every=4)
    sim.run(steps=10, callback=lambda s: seen.append(s.step), every=4)
    assert seen == [4, 8, 12, 16, 20]
    sim.run(steps=3, callback=lambda s: seen.append(s.step))
    assert seen[-3:] == [21, 22, 23]


def test_callbacks_see_fresh_arrays_and_may_write():
    sim = small()

    def check(s):
        assert s is sim
        assert s.densities.mean() == pytest.approx(s.number_densities.mean())
        s.velocities[:] = 0.0

    sim.run(steps=4, callback=check, every=2)
    assert sim.kinetic_energy == 0.0


def test_an_exception_in_a_callback_stops_cleanly():
    sim, twin = small(), small()

    def fail(s):
        if s.step == 6:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        sim.run(steps=20, callback=fail, every=2)
    twin.run(steps=6)
    assert_same_bits(sim, twin)
    sim.run(steps=2)
    twin.run(steps=2)
    assert_same_bits(sim, twin)


def test_keyboard_interrupt_leaves_a_whole_step():
    sim, twin = small(), small()

    def interrupt(s):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sim.run(steps=20, callback=interrupt, every=7)
    assert sim.step == 7
    sim.run(steps=3)
    twin.run(steps=10)
    assert_same_bits(sim, twin)


def test_ctrl_c_stops_between_steps():
    class Impatient(sdpd.Observer):
        def begin(self, sim, every):
            self.timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
            self.timer.start()

        def end(self, sim):
            self.timer.cancel()

    sim, twin = small(edge=30), small(edge=30)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        sim.run(steps=10**7, observe=Impatient(every=10**7))
    assert signal.getsignal(signal.SIGINT) is before
    assert 0 < sim.step < 10**6
    twin.run(steps=sim.step)
    assert_same_bits(sim, twin)


def test_ctrl_c_waits_for_an_observer_but_not_for_a_callback():
    events = []

    class Slow(sdpd.Observer):
        def sample(self, sim):
            signal.raise_signal(signal.SIGINT)
            events.append("sampled")

    sim = small()
    with pytest.raises(KeyboardInterrupt):
        sim.run(steps=5, observe=Slow())
    assert events == ["sampled"] and sim.step == 1

    def callback(s):
        signal.raise_signal(signal.SIGINT)
        events.append("not reached")

    with pytest.raises(KeyboardInterrupt):
        sim.run(steps=5, callback=callback)
    assert events == ["sampled"]


def test_a_second_ctrl_c_comes_through():
    class Stuck(sdpd.Observer):
        def sample(self, sim):
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            raise AssertionError("not reached")

    with pytest.raises(KeyboardInterrupt):
        small().run(steps=5, observe=Stuck())


def test_a_foreign_signal_handler_is_left_alone():
    mine = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        handler = signal.getsignal(signal.SIGINT)
        small().run(steps=2, callback=lambda s: signal.raise_signal(signal.SIGINT))
        assert signal.getsignal(signal.SIGINT) is handler
    finally:
        signal.signal(signal.SIGINT, mine)


# --- progress --------------------------------------------------------------------------------


def test_progress_is_shown_where_somebody_looks(monkeypatch):
    assert progress.wanted(True) and not progress.wanted(False)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert not progress.wanted(None)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert progress.wanted(None)


def test_progress_shows_rate_and_time(monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(sys, "stderr", screen)
    small().run(steps=20, progress=True)
    assert "particle-steps/s" in screen.getvalue() and "t = " in screen.getvalue()
    screen.truncate(0)
    small().run(steps=20, progress=False)
    small().run(steps=20)
    assert screen.getvalue().strip("\0") == ""


def test_short_runs_on_a_terminal_show_nothing(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    small().run(steps=20)
    assert screen.getvalue() == ""


# --- observers -------------------------------------------------------------------------------


def test_thermodynamics_agrees_with_the_simulation():
    sim = small(integrator="velocity_verlet")
    thermo = sdpd.Thermodynamics(every=5)
    assert len(thermo) == 0 and thermo.names == () and len(thermo.data) == 0
    sim.run(steps=20, observe=thermo)
    row = thermo.data[-1]
    assert row["step"] == sim.step and row["time"] == sim.time
    assert row["temperature"] == pytest.approx(sim.temperature, rel=1e-12)
    assert row["temperature_x"] + row["temperature_y"] == pytest.approx(2.0 * sim.temperature)
    assert row["kinetic_energy"] == pytest.approx(sim.kinetic_energy, rel=1e-12)
    assert row["potential_energy"] == pytest.approx(sim.potential_energy, rel=1e-12)
    assert row["mean_density"] == pytest.approx(sim.densities.mean(), rel=1e-12)
    assert row["mean_square_density"] == pytest.approx((sim.densities**2).mean(), rel=1e-12)
    assert row["mean_pressure"] == pytest.approx(sim.pressures.mean(), rel=1e-12)
    assert abs(row["momentum_x"] - sim.momentum[0]) < 1e-12
    assert thermo.units["mean_pressure"] == "energy/length^2"
    assert set(thermo.units) == set(thermo.names) == set(thermo.data.dtype.names)


def test_thermodynamics_in_si_units(tmp_path):
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water().in_plane(1e-9),
        box=sdpd.Box((1e-8, 1e-8)),
        resolution=sdpd.Resolution(particles=100),
    )
    thermo = sdpd.Thermodynamics()
    sdpd.Simulation(scene).run(steps=20, observe=[thermo], every=10)
    assert thermo["step"].tolist() == [10, 20]
    assert thermo.units["temperature_x"] == "K" and thermo.units["mean_pressure"] == "N/m"
    assert thermo.units["mean_square_density"] == "kg^2/m^4"
    assert 200.0 < thermo["temperature"].mean() < 400.0
    thermo.to_csv(tmp_path / "thermo.csv")
    lines = (tmp_path / "thermo.csv").read_text().splitlines()
    assert lines[0].startswith("step [1],time [s],temperature [K]") and len(lines) == 3
    assert "2 samples" in repr(thermo)
    with pytest.raises(ValueError, match="did you mean 'temperature'"):
        thermo["temperatur"]


def reference_correlation(positions, velocities, lag):
    """Means over all origins, from a trajectory."""
    steps = positions[lag:] - positions[: len(positions) - lag]
    products = velocities[lag:] * velocities[: len(velocities) - lag]
    return (steps**2).sum(axis=2).mean(), products.mean()


def test_correlator_agrees_with_a_trajectory():
    sim = small()
    correlator = sdpd.Correlator(every=2, points=4, levels=3)
    frames = []
    sim.run(
        steps=40,
        observe=correlator,
        callback=lambda s: frames.append((s.unwrapped, s.velocities.copy())),
        every=2,
    )
    positions, velocities = (np.array(part) for part in zip(*frames, strict=True))
    data = correlator.data
    assert data["lag"].tolist() == [0, 2, 4, 6, 8, 12, 16, 24]
    for row in data[:4]:  # further levels skip origins
        msd, vacf = reference_correlation(positions, velocities, row["lag"] // 2)
        assert row["origins"] == 20 - row["lag"] // 2
        assert row["msd"] == pytest.approx(msd, rel=1e-9, abs=1e-12)
        assert row["vacf"] == pytest.approx(vacf, rel=1e-9)
    np.testing.assert_allclose(correlator.time, data["lag"] * sim.dt)
    np.testing.assert_array_equal(correlator.msd, data["msd"])
    np.testing.assert_array_equal(correlator.vacf, data["vacf"])
    assert "20 samples" in repr(correlator)


def test_observers_go_on_over_runs():
    whole, parts = small(), small()
    one = sdpd.Thermodynamics(every=3), sdpd.Correlator(every=1, points=4, levels=4)
    other = sdpd.Thermodynamics(every=3), sdpd.Correlator(every=1, points=4, levels=4)
    whole.run(steps=31, observe=one)
    parts.run(steps=10, observe=other)
    parts.run(steps=21, observe=list(other))
    for mine, its in zip(one, other, strict=True):
        assert mine.data.tobytes() == its.data.tobytes()


def test_a_gap_gives_new_origins():
    sim = small()
    correlator, thermo = sdpd.Correlator(points=4, levels=1), sdpd.Thermodynamics()
    sim.run(steps=5, observe=[correlator, thermo])
    sim.run(steps=5)
    assert len(thermo) == 5
    sim.run(steps=5, observe=[thermo, correlator])
    assert correlator.data["origins"].tolist() == [10, 8, 6, 4]
    assert thermo["step"].tolist() == [1, 2, 3, 4, 5, 11, 12, 13, 14, 15]


def test_results_outlive_the_simulation():
    thermo = sdpd.Thermodynamics(every=1)
    small().run(steps=3, observe=thermo)
    gc.collect()
    assert len(thermo.data) == 3


def test_results_can_be_sent_to_another_process():
    thermo, correlator = sdpd.Thermodynamics(every=1), sdpd.Correlator(every=1)
    small().run(steps=5, observe=[thermo, correlator])
    for observer in (thermo, correlator):
        again = pickle.loads(pickle.dumps(observer))
        assert again.data.tobytes() == observer.data.tobytes()
    assert again.points == observer.points


def test_own_observers():
    events = []

    class Mine(sdpd.Observer):
        def begin(self, sim, every):
            events.append(("begin", every))

        def sample(self, sim):
            events.append(sim.step)

        def end(self, sim):
            events.append("end")

    sim = small()
    sim.run(steps=4, observe=Mine(every=2))
    assert events == [("begin", 2), 2, 4, "end"]
    events.clear()
    with pytest.raises(KeyError):
        sim.run(steps=4, observe=Mine(), every=2, callback=lambda s: {}["no"])
    assert events == [("begin", 2), 6, "end"]


# --- failure ---------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_failing_run_keeps_the_last_good_state(integrator):
    sim = small(integrator=integrator)
    sim.run(steps=5)
    copies = {name: getattr(sim, name).copy() for name in ARRAYS}
    step, time = sim.step, sim.time
    good_dt = sim.dt
    thermo, correlator = sdpd.Thermodynamics(every=1), sdpd.Correlator(every=1)
    with pytest.warns(sdpd.TimeStepWarning):
        sim.dt = 100.0 * sim.bounds[-1].value
    with pytest.raises(sdpd.SimulationError) as caught:
        sim.run(steps=1000, observe=[thermo, correlator])
    error = caught.value
    assert (sim.step, sim.time) == (step, time)
    for name, copy in copies.items():
        np.testing.assert_array_equal(getattr(sim, name), copy, err_msg=name)
    assert error.dt == sim.dt and error.step >= step and 0 <= error.particle < 100
    assert error.time == pytest.approx(time + (error.step - step) * error.dt)
    assert "likely cause: `dt` =" in str(error) and "acoustic stability" in str(error)
    assert f"last good state, step {step}, time {time:.6g}" in str(error)
    assert len(thermo) == 0 and len(correlator.data) == 0
    sim.dt = good_dt
    sim.run(steps=20, observe=[thermo])
    assert np.isfinite(sim.velocities).all() and len(thermo) == 20


def test_observers_keep_what_came_before_a_failure():
    sim = small()
    thermo = sdpd.Thermodynamics(every=1)
    correlator = sdpd.Correlator(every=1, points=4, levels=1)
    sim.run(steps=5, observe=[thermo, correlator])

    def push(s):
        s.velocities[3] = 1e6

    with pytest.raises(sdpd.SimulationError, match="a particle at speed"):
        sim.run(steps=40, observe=[thermo, correlator], callback=push, every=10)
    assert sim.step == 10
    assert thermo["step"].tolist() == list(range(1, 11))
    assert correlator.data["origins"].tolist() == [10, 9, 8, 7]


def test_the_cause_may_be_overlap():
    sim = small(integrator="velocity_verlet")
    sim.positions[:20] = sim.positions[50] + 1e-3 * np.arange(1, 21)[:, None]
    sim.velocities[:] = 0.0
    sim.velocities[0] = 1e6
    with pytest.raises(sdpd.SimulationError, match="overlapping particles: the density reaches"):
        sim.run(steps=10)


def test_nothing_but_numbers_are_run():
    sim = small()
    good = sim.velocities[4].copy()
    sim.velocities[4, 1] = np.nan
    with pytest.raises(ValueError, match="`velocities` must be finite, got NaN in row 4"):
        sim.run(steps=1)
    assert sim.step == 0
    sim.velocities[4] = good
    sim.run(steps=1)


# --- what a run refuses ----------------------------------------------------------------------


def test_dt_cannot_be_set_in_a_run():
    sim, errors = small(edge=30), []
    dt = sim.dt

    def attempt(inner=None):
        for value in (0.5 * dt, "auto"):
            with pytest.raises(RuntimeError, match="`dt` cannot be set while") as caught:
                sim.dt = value
            errors.append(caught.value)

    def from_another_thread(inner):
        thread = threading.Thread(target=attempt)
        thread.start()
        thread.join()

    sim.run(steps=1, callback=attempt)
    sim.run(steps=1, callback=from_another_thread)
    assert len(errors) == 4 and sim.dt == dt and sim.time == pytest.approx(2 * dt)
    sim.dt = 0.5 * dt


def test_an_assignment_from_another_thread_changes_nothing_in_a_run():
    sim, errors = small(), []

    def attempt():
        before = sim.velocities.copy(), sim.positions.copy()
        for name in ("velocities", "positions"):
            with pytest.raises(RuntimeError, match="running in another thread") as caught:
                setattr(sim, name, np.roll(getattr(sim, name), 1, axis=0))
            errors.append(caught.value)
        np.testing.assert_array_equal(sim.velocities, before[0])
        np.testing.assert_array_equal(sim.positions, before[1])

    def use(inner):
        inner.velocities = inner.velocities  # the run's own thread may
        thread = threading.Thread(target=attempt)
        thread.start()
        thread.join()

    sim.run(steps=1, callback=use)
    assert len(errors) == 2


def test_an_assignment_that_cannot_be_taken_over_changes_nothing(monkeypatch):
    sim = small()
    before = sim.velocities.copy()

    def busy(self):
        raise RuntimeError("held")

    monkeypatch.setattr(type(sim), "refresh", busy)
    with pytest.raises(RuntimeError, match="held"):
        sim.velocities = 0.0 * before
    np.testing.assert_array_equal(sim.velocities, before)


def test_a_skin_beyond_the_margin_is_refused():
    margin = small().statistics()["margin"]
    assert small(skin=margin).statistics()["skin"] == pytest.approx(margin, rel=1e-12)
    with pytest.raises(ValueError, match=r"`skin` must be <= [\d.]+, the margin") as caught:
        small(skin=1.01 * margin)
    assert f"<= {margin:.6g}," in str(caught.value)


def test_enormous_numbers_of_steps_are_values():
    sim = small()
    with pytest.raises(ValueError, match="`every` must be an integer <= "):
        sim.run(steps=1, every=2**70, observe=sdpd.Thermodynamics())
    with pytest.raises(ValueError, match="`steps` must be an integer <= "):
        sim.run(steps=2**70)
    with pytest.raises(ValueError, match="`step` must be an integer <= "):
        sim.force_parts(2**70)
    sim.run(steps=1, every=2**63 - 1, observe=sdpd.Thermodynamics())


def test_a_correlator_says_how_to_keep_dt():
    sim, correlator = small(), sdpd.Correlator(points=4, levels=1)
    sim.run(time=10.3 * sim.dt, observe=correlator)
    with pytest.raises(ValueError, match=r"use steps= \(run\(time=\) adjusts dt\)"):
        sim.run(time=5.7 * sim.dt, observe=correlator)


def test_later_observers_see_what_earlier_ones_wrote():
    class Squeeze(sdpd.Observer):
        def sample(self, sim):
            sim.positions[:] = 0.999 * sim.positions + 1e-3 * sim.positions[::-1]

    class Look(sdpd.Observer):
        def sample(self, sim):
            self.seen = sim.densities.copy()
            sim.refresh()
            np.testing.assert_array_equal(self.seen, sim.densities)

    sim, look = small(), Look()
    before = sim.densities.copy()
    sim.run(steps=1, observe=[Squeeze(), look])
    assert not np.array_equal(look.seen, before)
    assert sdpd.Observer.may_write and not sdpd.Trajectory.may_write


def test_a_tiny_step_is_not_blamed_on_the_pressure():
    sim = small(integrator="velocity_verlet")
    sim.velocities[:] = 0.0
    assert sim.pressures.min() < 0.0
    assert failure.likely_cause(sim, 1e-300).startswith("a tiny time step: dt = 1e-300 is")
    assert failure.likely_cause(sim, 0.5 * sim.dt).startswith("negative pressure")
