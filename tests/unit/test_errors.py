"""Every way a simulation and its observers refuse their arguments: class and text of the error."""

import math
import pickle

import numpy as np
import pytest

import sdpd

from .sims import assert_same_bits, small, small_scene

LATTICE = np.stack(np.divmod(np.arange(100), 10), axis=1) + 0.5
TWICE = LATTICE.copy()
TWICE[70] = TWICE[12] + [10.0, 0.0]  # the same point of a periodic box


class Other(sdpd.Observer):
    pass


CONSTRUCTION = [
    ({"scene": "water"}, TypeError, "`scene` must be an sdpd.Scene, got 'water' of type str"),
    (
        {"integrator": "verlet"},
        ValueError,
        (
            "`integrator` must be one of 'velocity_verlet', 'pair_splitting', got 'verlet'; did "
            "you mean 'velocity_verlet'?"
        ),
    ),
    (
        {"integrator": 3},
        TypeError,
        (
            "`integrator` must be sdpd.PairSplitting(), sdpd.VelocityVerlet() or one of their "
            "names, got 3 of type int"
        ),
    ),
    ({"dt": -0.1}, ValueError, "`dt` must be finite and > 0, got -0.1"),
    ({"dt": math.inf}, ValueError, "`dt` must be finite and > 0, got inf"),
    ({"dt": True}, TypeError, "`dt` must be a number (finite and > 0), got True of type bool"),
    ({"dt": "fast"}, ValueError, "`dt` must be one of 'auto', 'adaptive', got 'fast'"),
    ({"seed": -1}, ValueError, "`seed` must be an integer >= 0, got -1"),
    ({"seed": 2**64}, ValueError, "`seed` must be < 2^64, got 18446744073709551616"),
    ({"seed": 1.0}, TypeError, "`seed` must be an integer >= 0, got 1.0 of type float"),
    ({"threads": 0}, ValueError, "`threads` must be an integer >= 1, got 0"),
    ({"threads": 5000}, ValueError, "`threads` must be at most 4096, got 5000"),
    ({"skin": 0.0}, ValueError, "`skin` must be finite and > 0, got 0"),
    (
        {"temperature_error": 0.0},
        ValueError,
        "`temperature_error` must be finite and > 0, got 0",
    ),
    (
        {"resolve_vacf": 1},
        TypeError,
        "`resolve_vacf` must be True or False, got 1 of type int",
    ),
    (
        {"positions": np.zeros((0, 2))},
        ValueError,
        "`positions` must be an array of shape (100, 2), got (0, 2)",
    ),
    (
        {"positions": LATTICE[:, :1]},
        ValueError,
        "`positions` must be an array of shape (100, 2), got (100, 1)",
    ),
    (
        {"positions": "somewhere"},
        TypeError,
        "`positions` must be an array of real numbers, got dtype <U9",
    ),
    (
        {"positions": np.where(np.arange(200).reshape(100, 2) == 31, np.nan, LATTICE)},
        ValueError,
        "`positions` must be finite, got nan at index (15, 1)",
    ),
    (
        {"positions": TWICE},
        ValueError,
        "`positions` must be distinct, got particles 12 and 70 both at [1.5, 2.5]",
    ),
    (
        {"velocities": np.zeros((100, 3))},
        ValueError,
        "`velocities` must be an array of shape (100, 2), got (100, 3)",
    ),
    (
        {"velocities": np.full((100, 2), np.inf)},
        ValueError,
        "`velocities` must be finite, got inf at index (0, 0)",
    ),
]


@pytest.mark.parametrize(("options", "kind", "text"), CONSTRUCTION)
def test_construction(options, kind, text):
    with pytest.raises(kind) as caught:
        sdpd.Simulation(**{"scene": small_scene(), **options})
    assert str(caught.value) == text


RUNNING = [
    ({}, ValueError, "exactly one of `steps` and `time` must be given, got neither"),
    (
        {"steps": 1, "time": 1.0},
        ValueError,
        "exactly one of `steps` and `time` must be given, got both",
    ),
    ({"steps": -1}, ValueError, "`steps` must be an integer >= 0, got -1"),
    ({"steps": 2.0}, TypeError, "`steps` must be an integer >= 0, got 2.0 of type float"),
    ({"time": -1.0}, ValueError, "`time` must be finite and >= 0, got -1"),
    ({"time": math.nan}, ValueError, "`time` must be finite and >= 0, got nan"),
    ({"time": 1e30}, ValueError, "`time` must be less than 2^63 steps of 0.0446381, got 1e+30"),
    ({"steps": 1, "every": 0}, ValueError, "`every` must be an integer >= 1, got 0"),
    ({"steps": 1, "callback": 3}, TypeError, "`callback` must be callable, got int"),
    (
        {"steps": 1, "progress": "yes"},
        TypeError,
        "`progress` must be True or False, got 'yes' of type str",
    ),
    (
        {"steps": 1, "observe": 3},
        TypeError,
        "`observe` must be an observer or a sequence of them, got int",
    ),
    (
        {"steps": 1, "observe": [sdpd.Thermodynamics]},
        TypeError,
        (
            "`observe[0]` must be an observer, e.g. sdpd.Thermodynamics(), got <class "
            "'sdpd.observers.thermodynamics.Thermodynamics'> of type type"
        ),
    ),
    (
        {"steps": 1, "observe": (one := Other(), one)},
        ValueError,
        "`observe` must hold each observer once, got one twice",
    ),
]


@pytest.mark.parametrize(("options", "kind", "text"), RUNNING)
def test_running(options, kind, text):
    sim = small()
    with pytest.raises(kind) as caught:
        sim.run(**options)
    assert str(caught.value) == text
    assert_same_bits(sim, small())


def test_observers():
    for options, kind, text in [
        ({"points": 7}, ValueError, "`points` must be even, got 7"),
        ({"points": 0}, ValueError, "`points` must be an integer >= 2, got 0"),
        ({"levels": 0}, ValueError, "`levels` must be an integer >= 1, got 0"),
        ({"levels": 41}, ValueError, "`levels` must be at most 40, got 41"),
        ({"every": 0}, ValueError, "`every` must be an integer >= 1, got 0"),
    ]:
        with pytest.raises(kind) as caught:
            sdpd.Correlator(**options)
        assert str(caught.value) == text


def test_trajectories(tmp_path):
    for options, kind, text in [
        ({"forces": 1}, TypeError, "`forces` must be True or False, got 1 of type int"),
        (
            {"precision": "half"},
            ValueError,
            "`precision` must be one of 'float32', 'float64', got 'half'",
        ),
        ({"compression": 10}, ValueError, "`compression` must be 1 to 9, got 10"),
        ({"compression": "gzip"}, TypeError, "`compression` must be an integer >= 1, got 'gzip'"),
    ]:
        with pytest.raises(kind) as caught:
            sdpd.Trajectory(tmp_path / "a.h5md", **options)
        assert str(caught.value).startswith(text)


def test_correlator_keeps_its_lags():
    sim = small()
    correlator = sdpd.Correlator(points=4, levels=1)
    sim.run(steps=4, observe=correlator)
    with pytest.raises(ValueError, match="`every` must be that of the samples a Correlator holds"):
        sim.run(steps=4, observe=correlator, every=2)
    sim.dt = 0.5 * sim.dt
    with pytest.raises(ValueError, match="`dt` must be that of the samples a Correlator holds"):
        sim.run(steps=4, observe=correlator)
    assert sim.step == 4 and correlator.data["origins"].tolist() == [4, 3, 2, 1]


def test_an_observer_serves_one_simulation():
    thermo = sdpd.Thermodynamics()
    small().run(steps=1, observe=thermo)
    sim = small()
    with pytest.raises(ValueError) as caught:
        sim.run(steps=1, observe=thermo)
    assert str(caught.value) == (
        "`observe` must hold observers of this simulation, got a Thermodynamics that already "
        "belongs to another one; make one for each"
    )
    assert sim.step == 0 and len(thermo) == 1


def test_assigned_arrays_are_checked():
    sim = small()
    with pytest.raises(ValueError, match=r"`positions` must be distinct, got particles 12 and 70"):
        sim.positions = TWICE
    with pytest.raises(ValueError, match=r"`velocities` must be an array of shape \(100, 2\)"):
        sim.velocities = np.zeros(3)
    with pytest.raises(ValueError, match="`dt` must be finite and > 0, got 0"):
        sim.dt = 0.0
    with pytest.raises(AttributeError):
        sim.forces = np.zeros((100, 2))
    assert_same_bits(sim, small())


def test_written_positions_must_be_finite():
    sim = small()
    sim.positions[3, 0] = np.inf
    with pytest.raises(ValueError, match="`positions` must be finite, got inf in row 3"):
        sim.refresh()


def test_force_parts_take_a_step():
    with pytest.raises(ValueError, match="`step` must be an integer >= 0, got -2"):
        small().force_parts(step=-2)


def test_classes():
    assert issubclass(sdpd.SimulationError, RuntimeError)
    assert issubclass(sdpd.CheckpointError, ValueError)
    for warning in (sdpd.TimeStepWarning, sdpd.PairingWarning, sdpd.ResolutionWarning):
        assert issubclass(warning, sdpd.SdpdWarning)
    assert issubclass(sdpd.SdpdWarning, UserWarning)


def test_simulation_errors_carry_where_and_survive_pickling():
    error = sdpd.SimulationError("text")
    assert (error.step, error.particle, error.time, error.dt) == (None,) * 4
    error.step, error.particle = 7, 3
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.step, again.particle) == ("text", 7, 3)
