"""What must hold bit for bit, or fall with a known power, whatever the physics is."""

from __future__ import annotations

import dataclasses
import gc
import pickle
import threading
import time
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import SimulationError, _core

from .build import core, problem, restated
from .twin import System

Array = NDArray[np.float64]

INTEGRATORS = ("velocity_verlet", "pair_splitting")
VIEWS = (
    "positions",
    "velocities",
    "forces",
    "number_densities",
    "densities",
    "pressures",
    "ids",
    "images",
)
WRITABLE = ("positions", "velocities")


def snapshot(sim: Any) -> dict[str, Any]:
    return {name: np.array(getattr(sim, name)) for name in VIEWS} | {
        "step": sim.step,
        "time": sim.time,
    }


def assert_same_bits(a: dict[str, Any], b: dict[str, Any]) -> None:
    for name, value in a.items():
        assert np.array_equal(value, b[name]), name


def fluid(dimension: int = 3, cells: tuple[int, ...] | None = None, **options: Any) -> System:
    """Large enough for several blocks an axis, quick enough for hundreds of steps."""
    size = cells or {2: (23, 18), 3: (11, 9, 10)}[dimension]
    return problem(dimension, cells=size, support=2.2, dt=0.005, **options)


# --- same bits -------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", ["general", "central", "none"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_same_bits_on_any_number_of_threads(integrator: str, dimension: int, friction: str) -> None:
    system = fluid(dimension, friction=friction)
    ends = []
    for threads in (1, 2, 3):
        sim = core(system, integrator, threads=threads)
        sim.run(30, system.dt)
        ends.append(snapshot(sim))
    assert_same_bits(ends[0], ends[1])
    assert_same_bits(ends[0], ends[2])


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_run_may_be_cut_anywhere(integrator: str, dimension: int) -> None:
    system = fluid(dimension)
    whole = core(system, integrator)
    whole.run(31, system.dt)
    pieces = core(system, integrator)
    for steps in (1, 0, 7, 13, 1, 9):
        pieces.run(steps, system.dt)
        np.array(pieces.forces)  # looking must not change anything
    assert_same_bits(snapshot(whole), snapshot(pieces))


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_a_verlet_run_may_be_cut_with_any_number_of_iterations(iterations: int) -> None:
    system = fluid(3)
    whole, pieces = (core(system, iterations=iterations) for _ in range(2))
    whole.run(12, system.dt)
    for steps in (5, 7):
        pieces.run(steps, system.dt)
    assert_same_bits(snapshot(whole), snapshot(pieces))


def test_kicks_by_a_body_force_may_be_cut_as_well() -> None:
    system = fluid(3, body_force=(0.3, 0.0, -0.2), body_wave=(1, 2))
    whole, pieces = (core(system, iterations=0) for _ in range(2))
    whole.run(12, system.dt)
    for steps in (1, 4, 1, 6):
        pieces.run(steps, system.dt)
    assert_same_bits(snapshot(whole), snapshot(pieces))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_particle_alone_feels_nothing_when_the_grid_is_renewed(integrator: str) -> None:
    system = problem(3, cells=(1, 1, 1), support=2.5, dt=0.01)
    moving = np.array([[0.7, -0.4, 0.2]])
    system = dataclasses.replace(system, box=np.full(3, 20.0), velocities=moving)
    sim = core(system, integrator, iterations=0)
    restated(sim, ids=[2**62 + 1])
    velocity = np.array(sim.velocities)
    known = sim.statistics()["grid_renewals"]
    sim.run(4000, system.dt)
    assert sim.statistics()["grid_renewals"] > known + 3
    assert not np.array(sim.forces).any() and np.array_equal(sim.velocities, velocity)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_grid_is_renewed_just_when_a_particle_has_left_its_margin(
    integrator: str, dimension: int
) -> None:
    system = fluid(dimension)
    sim = core(system, integrator)
    half = 0.5 * sim.statistics()["margin"] / system.support

    def farthest() -> float:
        state = sim.state()
        at = np.frombuffer(state["position"]).reshape(-1, 4)[:, :dimension]
        reference = np.frombuffer(state["grid_reference"]).reshape(-1, 3)[:, :dimension]
        return float(np.linalg.norm(at - reference, axis=1).max())

    renewals = 0
    for step in range(150):
        if step == 70:
            sim.set_state(sim.state())  # nobody knows then how far they are
        before, positions = farthest(), np.array(sim.positions)
        known = sim.statistics()["grid_renewals"]
        sim.run(1, system.dt)
        assert farthest() <= half
        # What sorting borrows is given back: forces have no fourth component.
        assert not np.frombuffer(sim.state()["force"]).reshape(-1, 4)[:, 3].any()
        if sim.statistics()["grid_renewals"] > known:
            renewals += 1
            way = np.array(sim.positions) - positions
            way -= system.box * np.round(way / system.box)
            longest = float(np.linalg.norm(way, axis=1).max()) / system.support
            assert before + longest > half * (1.0 - 1e-9)
            assert farthest() < 1e-12
    assert renewals > 3


@pytest.mark.parametrize("refresh", [False, True])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_refresh_without_a_change_is_no_change(integrator: str, refresh: bool) -> None:
    system = fluid(3)
    plain, refreshed = core(system, integrator), core(system, integrator)
    for _ in range(3):
        plain.run(6, system.dt)
        refreshed.run(6, system.dt)
        if refresh:
            refreshed.refresh()
    assert_same_bits(snapshot(plain), snapshot(refreshed))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_state_continues_bit_for_bit(integrator: str, dimension: int) -> None:
    system = fluid(dimension)
    sim = core(system, integrator)
    sim.run(17, system.dt)
    saved = pickle.loads(pickle.dumps(sim.state()))
    middle = snapshot(sim)
    sim.run(14, system.dt)
    end = snapshot(sim)
    # into another core, built from other velocities
    other = core(system.at(velocities=-system.velocities), integrator, threads=2)
    other.set_state(saved)
    assert_same_bits(middle, snapshot(other))
    other.run(14, system.dt)
    assert_same_bits(end, snapshot(other))
    # and back into the same one
    sim.set_state(saved)
    assert_same_bits(middle, snapshot(sim))
    sim.run(14, system.dt)
    assert_same_bits(end, snapshot(sim))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_state_is_a_copy(integrator: str) -> None:
    system = fluid(2)
    sim = core(system, integrator)
    saved = sim.state()
    before = pickle.dumps(saved)
    sim.run(3, system.dt)
    assert pickle.dumps(saved) == before


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_other_seeds_give_other_noise(integrator: str) -> None:
    system = fluid(3)
    a, b = core(system, integrator), core(system.at(seed=system.seed + 1), integrator)
    for sim in (a, b):
        sim.run(1, system.dt)
    assert np.abs(a.velocities - b.velocities).max() > 1e-3


# --- the skin is only speed ------------------------------------------------------------------

# Of the last two one is the margin, the other what should cost least.
SKINS = (0.03, 0.05, 0.08, "margin", None)


def assert_skins_agree(dimension: int, integrator: str) -> None:
    """But for rounding: pairs in the skin, which come to nothing, take places in sums."""
    system = fluid(dimension)
    margin = core(system, integrator).statistics()["margin"]
    ends, prunings = [], []
    for skin in SKINS:
        sim = core(system, integrator, skin=margin if skin == "margin" else skin)
        sim.run(20, system.dt)
        ends.append(snapshot(sim))
        prunings.append(sim.statistics()["prunings"])
    assert prunings[0] > prunings[1] > prunings[2] and prunings[3] == 0 < prunings[4]
    for key in ("positions", "velocities"):
        *others, whole, _ = [end[key] for end in ends]
        for end in others:
            assert not np.array_equal(end, whole)  # or there were nothing to see here
        for end in ends:
            np.testing.assert_allclose(end[key], ends[3][key], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_skins_agree_for_verlet(dimension: int) -> None:
    assert_skins_agree(dimension, "velocity_verlet")


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_skins_agree_for_the_splitting(dimension: int) -> None:
    """The sweep's order must be a function of the particles, not of the skin."""
    assert_skins_agree(dimension, "pair_splitting")


# --- energy ----------------------------------------------------------------------------------


def total_energy(sim: Any, system: System) -> float:
    kind, parameters = system.eos
    e = _core.eos_evaluate(kind, parameters, np.asarray(sim.densities))[2]
    kinetic = 0.5 * float(np.sum(np.asarray(sim.velocities) ** 2))
    return system.mass * (kinetic + float(np.sum(e)))


@pytest.mark.parametrize("kernel", ["lucy", "wendland_c2"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_energy_error_falls_as_dt_squared(integrator: str, dimension: int, kernel: str) -> None:
    system = problem(
        dimension, kernel=kernel, friction="none", cells=(6,) * dimension, support=2.6, jitter=0.2
    )
    steps, errors = (0.016, 0.008, 0.004, 0.002), []
    for dt in steps:
        sim = core(system.at(dt=dt), integrator)
        energies = []
        for _ in range(round(0.64 / dt)):
            sim.run(1, dt)
            energies.append(total_energy(sim, system))
        errors.append(np.std(energies))
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 < order < 2.1, errors


# --- views -----------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_views_are_zero_copy_and_stay_where_they_are(integrator: str) -> None:
    system = fluid(3)
    sim = core(system, integrator)
    views = {name: getattr(sim, name) for name in VIEWS}
    addresses = {name: view.ctypes.data for name, view in views.items()}
    before = {name: view.copy() for name, view in views.items()}
    sim.run(50, system.dt)
    for name, view in views.items():
        again = getattr(sim, name)
        assert np.shares_memory(view, again), name
        assert again.ctypes.data == addresses[name], name
        assert np.array_equal(view, again), name
        assert view.shape == (system.size, 3)[: view.ndim]
        assert view.flags.writeable == (name in WRITABLE), name
    for name in ("positions", "velocities", "forces", "densities"):
        assert not np.array_equal(before[name], views[name]), name
    assert views["ids"].dtype == np.uint64
    assert views["images"].dtype == np.int32
    assert np.array_equal(views["ids"], before["ids"])
    assert len(set(views["ids"].tolist())) == system.size


def test_derived_views_refuse_writing() -> None:
    sim = core(fluid(2))
    for name in VIEWS:
        if name in WRITABLE:
            continue
        view = getattr(sim, name)
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 0
        with pytest.raises(ValueError, match="WRITEABLE"):
            view.flags.writeable = True


def test_views_outlive_the_core() -> None:
    sim = core(fluid(2))
    views = {name: getattr(sim, name) for name in VIEWS}
    copies = {name: view.copy() for name, view in views.items()}
    del sim
    gc.collect()
    for name, view in views.items():
        assert np.array_equal(view, copies[name])


def test_the_core_keeps_its_own_copy_of_what_it_was_given() -> None:
    system = fluid(2)
    positions = system.positions.copy()
    sim = core(system.at(positions=positions))
    positions[:] = 0.0
    assert np.abs(sim.positions - system.positions).max() < 1e-14


# --- what the user writes --------------------------------------------------------------------


@pytest.mark.parametrize("call_refresh", [False, True])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_written_velocities_are_honoured(integrator: str, call_refresh: bool) -> None:
    system = fluid(3)
    fresh = core(system.at(velocities=0.5 * system.velocities), integrator)
    written = core(system, integrator)
    written.velocities[:] *= 0.5
    if call_refresh:
        written.refresh()
    for sim in (fresh, written):
        sim.run(4, system.dt)
    assert_same_bits(snapshot(fresh), snapshot(written))


@pytest.mark.parametrize("call_refresh", [False, True])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_written_positions_are_honoured(integrator: str, call_refresh: bool) -> None:
    """Also moves far beyond any skin: two particles change places."""
    system = fluid(3)
    moved = system.positions.copy()
    moved[[3, 700]] = moved[[700, 3]]
    moved[11, 0] += 0.01
    fresh = core(system.at(positions=moved), integrator)
    written = core(system, integrator)
    written.positions[:] = moved
    if call_refresh:
        written.refresh()
        assert np.abs(written.densities - fresh.densities).max() < 1e-13
        assert np.abs(written.forces - fresh.forces).max() < 1e-10
    for sim in (fresh, written):
        sim.run(4, system.dt)
    assert_same_bits(snapshot(fresh), snapshot(written))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_one_written_number_is_enough(integrator: str) -> None:
    system = fluid(3)
    plain, written = core(system, integrator), core(system, integrator)
    for sim in (plain, written):
        sim.run(3, system.dt)
    written.velocities[5, 1] += 1.0
    for sim in (plain, written):
        sim.run(1, system.dt)
    change = np.asarray(written.velocities) - np.asarray(plain.velocities)
    assert change.sum(axis=0) == pytest.approx([0.0, 1.0, 0.0], abs=1e-10)
    assert np.abs(change[5, 1]) > 0.1


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_position_written_outside_the_box_is_wrapped(integrator: str) -> None:
    system = fluid(3)
    plain, written = core(system, integrator), core(system, integrator)
    written.positions[7] += 2.0 * system.box
    for sim in (plain, written):
        sim.run(2, system.dt)
    assert np.all((written.positions >= 0.0) & (written.positions < system.box))
    assert np.abs(written.positions - plain.positions).max() < 1e-10
    assert np.array_equal(written.images[7] - plain.images[7], [2, 2, 2])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_writing_a_position_keeps_the_image(integrator: str) -> None:
    """Unwrapped positions move by what was written, also just after crossing the boundary."""
    system = fluid(3).at(dt=0.01)
    system = system.at(velocities=system.velocities + 1.5)
    sim = core(system, integrator)
    for _ in range(12):
        sim.run(7, system.dt)
        before = sim.positions + sim.images * system.box
        sim.positions[:] += 1e-4
        sim.refresh()
        after = sim.positions + sim.images * system.box
        assert np.abs(after - before - 1e-4).max() < 1e-12
    assert np.abs(sim.images).max() > 0


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_run_holds_neither_the_gil_nor_the_caller(integrator: str) -> None:
    """While one thread runs, others work; using the same core from them is a RuntimeError."""
    system = fluid(3)
    sim = core(system, integrator)
    thread = threading.Thread(target=sim.run, args=(250, system.dt))
    refused = 0
    thread.start()
    while thread.is_alive():
        try:
            sim.refresh()
        except RuntimeError:
            refused += 1
        time.sleep(0.002)
    thread.join()
    assert refused > 2
    plain = core(system, integrator)
    plain.run(250, system.dt)
    assert_same_bits(snapshot(plain), snapshot(sim))


# --- failure ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("steps", "dt", "error"),
    [
        (-1, 0.01, (ValueError, OverflowError)),
        (3, 0.0, ValueError),
        (3, -0.01, ValueError),
        (3, float("nan"), ValueError),
        (3, float("inf"), ValueError),
        (1.5, 0.01, TypeError),
        (3, "fast", TypeError),
    ],
)
def test_a_refused_run_changes_nothing(steps: Any, dt: Any, error: Any) -> None:
    system = fluid(2)
    sim = core(system)
    sim.run(2, system.dt)
    before, state = snapshot(sim), pickle.dumps(sim.state())
    with pytest.raises(error):
        sim.run(steps, dt)
    assert_same_bits(before, snapshot(sim))
    assert pickle.dumps(sim.state()) == state


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_refused_state_changes_nothing(integrator: str) -> None:
    system = fluid(2)
    sim = core(system, integrator)
    sim.run(2, system.dt)
    before = snapshot(sim)
    good = sim.state()
    other = core(problem(2, cells=(8, 8)), integrator).state()
    lacking = {name: value for name, value in good.items() if name != "list_reference"}
    for bad in ({}, lacking, other, good | {"position": 3}, good | {"wall_force": [1.0]}):
        with pytest.raises((ValueError, TypeError, KeyError)):
            sim.set_state(bad)
        assert_same_bits(before, snapshot(sim))
    sim.run(2, system.dt)
    plain = core(system, integrator)
    plain.run(4, system.dt)
    assert_same_bits(snapshot(plain), snapshot(sim))


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", WRITABLE)
def test_written_nonsense_is_refused(name: str, value: float) -> None:
    system = fluid(2)
    sim = core(system)
    sim.run(2, system.dt)
    getattr(sim, name)[4, 1] = value
    with pytest.raises(ValueError, match=rf"{name}.*4"):
        sim.run(1, system.dt)
    assert sim.step == 2


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_runaway_stops_with_the_last_good_state(integrator: str) -> None:
    """Far beyond the acoustic limit 2h/(s c) = 0.12."""
    system = fluid(3, friction="none").at(dt=2.0)
    sim = core(system, integrator)
    sim.run(5, 0.005)
    before = snapshot(sim)
    with pytest.raises(SimulationError, match=r"step.*particle") as caught:
        sim.run(10_000, 2.0)
    assert 5 <= caught.value.step <= 10_005
    assert 0 <= caught.value.particle < system.size
    assert_same_bits(before, snapshot(sim))
    # and the run may go on with a better step as if nothing had happened
    sim.run(5, 0.005)
    plain = core(system, integrator)
    plain.run(10, 0.005)
    assert np.abs(sim.positions - plain.positions).max() < 1e-10
    assert sim.step == 10


# --- bad arguments ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "error", "name"),
    [
        ({"support": -1.0}, ValueError, "support"),
        ({"support": np.nan}, ValueError, "support"),
        ({"support": 11.6}, ValueError, "box"),
        ({"mass": 0.0}, ValueError, "mass"),
        ({"thermal_energy": -1.0}, ValueError, "thermal_energy"),
        ({"kernel": "gauss"}, ValueError, "kernel"),
        ({"friction": "dry"}, ValueError, "friction"),
        ({"friction_across": -1.0}, ValueError, "friction_across"),
        ({"friction_along": -1e3}, ValueError, "friction_along"),
        ({"noise": "loud"}, ValueError, "noise"),
        ({"integrator": "euler"}, ValueError, "integrator"),
        ({"iterations": -1}, (ValueError, OverflowError), "iterations|negative"),
        ({"eos": ("van_der_waals", [1.0])}, ValueError, "eos|van_der_waals"),
        ({"eos": ("linear", [1.0])}, ValueError, "eos|linear"),
        ({"dt": 0.0}, ValueError, "dt"),
        ({"skin": -0.1}, ValueError, "skin"),
        ({"seed": -1}, (ValueError, OverflowError), "seed|negative"),
        ({"box": np.array([11.0, 9.0])}, ValueError, "positions"),
        ({"box": np.array([11.0, 9.0, -10.0])}, ValueError, "box"),
        ({"positions": np.zeros((0, 3)), "velocities": np.zeros((0, 3))}, ValueError, "positions"),
        ({"positions": np.zeros((4, 4))}, ValueError, "positions"),
        ({"velocities": np.zeros((4, 3))}, ValueError, "velocities"),
        ({"body_force": (1.0,)}, ValueError, "body_force"),
        ({"kernel": 3}, TypeError, "kernel"),
        ({"support": "wide"}, TypeError, "support"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else None,
)
def test_bad_arguments_are_named(changes: dict[str, Any], error: Any, name: str) -> None:
    with pytest.raises(error, match=name):
        core(fluid(3), **changes)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("friction", ["general", "central"])
def test_coincident_particles_do_no_harm(friction: str, integrator: str) -> None:
    """A scene refuses them; the core has no direction for them, but must stay finite."""
    system = fluid(3, friction=friction)
    positions = system.positions.copy()
    positions[17] = positions[3]
    sim = core(system.at(positions=positions), integrator)
    sim.run(3, system.dt)
    for name in VIEWS:
        assert np.all(np.isfinite(getattr(sim, name))), name
    assert np.all(np.abs(sim.velocities.sum(axis=0)) < 1e-9)
