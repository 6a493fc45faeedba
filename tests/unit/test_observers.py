"""The observers of the loop against analysis of the trajectory, and their manners."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import sdpd
from sdpd import analysis

from .sims import small, small_scene

WAVES = [(1, 0), (0, 1), (2, 1), (-1, 2)]


def observers() -> list[sdpd.observers.LoopObserver]:
    """One of each kind, with few lags."""
    return [
        sdpd.Thermodynamics(every=1),
        sdpd.Stress(every=2),
        sdpd.Correlator(every=1, points=4, levels=2),
        sdpd.CurrentCorrelator(WAVES, every=1, points=4, levels=2),
        sdpd.StressCorrelator(every=1, points=4, levels=2, parts=True),
    ]


def shown(observer: sdpd.observers.LoopObserver) -> np.ndarray:
    if isinstance(observer, sdpd.observers.LaggedObserver):
        return observer._blocks()
    return observer.data


@pytest.fixture(scope="module")
def run():
    """A run with everything attached, and what it looked like from outside."""
    sim = small()
    thermo, stress, correlator, currents, stress_correlator = (
        sdpd.Thermodynamics(),
        sdpd.Stress(),
        sdpd.Correlator(points=8, levels=1),
        sdpd.CurrentCorrelator(WAVES, points=8, levels=1),
        sdpd.StressCorrelator(points=8, levels=1, parts=True),
    )
    frames = []
    sim.run(
        steps=3 * 129,
        every=3,
        observe=[thermo, stress, correlator, currents, stress_correlator],
        callback=lambda s: frames.append((s.unwrapped, s.velocities.copy())),
    )
    r, v = (np.array(part) for part in zip(*frames, strict=True))
    return sim, stress, correlator, currents, stress_correlator, r, v


def test_correlator_gives_what_analysis_gives(run):
    sim, _, correlator, _, _, r, v = run
    dt = 3 * sim.dt
    for kind, expected in (
        ("msd", analysis.msd(r, dt, max_lag=7, n_blocks=8)),
        ("vacf", analysis.vacf(v, dt, max_lag=7, n_blocks=8)),
    ):
        got = correlator.correlation(kind, n_blocks=8)
        np.testing.assert_allclose(got.lag, expected.lag)
        np.testing.assert_allclose(got.mean, expected.mean, rtol=1e-9, atol=1e-15)
        assert got.dimension == 2 and got.n_blocks == 8
        # Blocks own origins there and later ends here, so errors agree as estimates do.
        assert np.all(np.abs(np.log(got.stderr[1:] / expected.stderr[1:])) < 1.0)
        assert got.window == (0.0, pytest.approx(129 * dt))
    data = correlator.data
    assert np.isfinite(data["msd_stderr"]).all() and (data["vacf_stderr"] > 0.0).all()


def test_errors_of_the_correlator_are_those_of_its_blocks():
    """Lags longer than a block have no error, and no block is lost."""
    sim, correlator = small(), sdpd.Correlator(every=1, points=4, levels=8)
    sim.run(steps=640, observe=correlator)
    data, few, many = correlator.data, *(correlator.correlation("msd", n_blocks=n) for n in (8, 32))
    assert few.lag[-1] <= 80 * sim.dt < data["time"][few.lag.size]
    assert many.lag[-1] <= 20 * sim.dt < data["time"][many.lag.size]
    assert np.isnan(data["msd_stderr"][few.lag.size :]).all()
    np.testing.assert_array_equal(data["msd_stderr"][: many.lag.size], many.stderr)
    np.testing.assert_array_equal(
        data["msd_stderr"][many.lag.size : few.lag.size], few.stderr[many.lag.size :]
    )
    np.testing.assert_array_equal(few.counts, data["origins"][: few.lag.size])
    np.testing.assert_allclose(few.mean, data["msd"][: few.lag.size], rtol=1e-12)


def test_currents_give_what_analysis_gives(run):
    sim, _, _, currents, _, r, v = run
    lengths = sim.scene.box.lengths
    expected = analysis.current_correlations(
        r, v, lengths, 3 * sim.dt, wave_vectors=WAVES, max_lag=7, n_blocks=8
    )
    got = currents.correlations(n_blocks=8)
    assert [shell.wave_number for shell in got] == pytest.approx(
        [shell.wave_number for shell in expected]
    )
    for mine, its in zip(got, expected, strict=True):
        assert mine.wave_vectors.tolist() == its.wave_vectors.tolist()
        for name in ("density", "longitudinal", "transverse", "cross", "reversed_cross"):
            one, other = getattr(mine, name), getattr(its, name)
            scale = np.abs(other.mean).max()
            np.testing.assert_allclose(one.mean, other.mean, rtol=1e-8, atol=1e-9 * scale)
            assert one.dimension == other.dimension


def test_stress_correlator_gives_what_analysis_gives_of_the_series(run):
    sim, stress, _, _, correlator, _, _ = run
    kt = sim.scene.fluid.thermal_energy
    total = stress.total
    assert total.shape == (128, 2, 2)
    options = {"volume": stress.volume, "max_lag": 7, "n_blocks": 8}
    for component in ("shear", "longitudinal", "trace", "bulk"):
        # The correlator's first sample is the end of the first interval.
        expected = analysis.helfand_increments(
            total[1:], stress.interval, component=component, **options
        )
        got = correlator.increments(component, n_blocks=8)
        np.testing.assert_allclose(got.mean, expected.mean, rtol=1e-8, err_msg=component)
        product = analysis.stress_autocorrelation(
            total, stress.interval, component=component, max_lag=7, n_blocks=8
        )
        mine = correlator.autocorrelation(component, n_blocks=8)
        scale = product.mean[0]
        np.testing.assert_allclose(mine.mean, product.mean, rtol=1e-8, atol=1e-8 * scale)
    viscosity = analysis.einstein_viscosity(
        correlator.increments(n_blocks=8),
        volume=stress.volume,
        thermal_energy=kt,
        window=(0.0, 7 * stress.interval),
    )
    assert viscosity.value > 0.0


def test_parts_of_the_shear_increments(run):
    """Squares of sums, from the series by hand."""
    _, stress, _, _, correlator, _, _ = run
    data = stress.data
    unit = stress.volume * stress.interval
    off = ~np.eye(2, dtype=bool)
    chosen = {
        "total": ("kinetic", "conservative", "dissipative", "random"),
        "collisional": ("conservative", "dissipative", "random"),
        "kinetic": ("kinetic",),
        "random": ("random",),
    }
    for part, names in chosen.items():
        one = sum(data[name] for name in names)[:, off] * unit
        moved = one[1:]  # the correlator's first sample is the end of the first interval
        got = correlator.increments("shear", part=part, n_blocks=8)
        assert got.mean[0] == 0.0
        assert got.mean[1] == pytest.approx(np.mean(moved**2), rel=1e-9)


def test_a_cut_run_gives_the_same_numbers():
    whole, cut = observers(), observers()
    one, other = small(), small()
    one.run(steps=12, observe=whole)
    for steps in (5, 1, 6):
        other.run(steps=steps, observe=cut)
    for mine, its in zip(whole, cut, strict=True):
        assert shown(mine).tobytes() == shown(its).tobytes(), mine


def test_a_gap_begins_a_new_segment():
    sim, all_of_them = small(), observers()
    sim.run(steps=6, observe=all_of_them)
    before = [len(shown(observer)) for observer in all_of_them]
    sim.run(steps=3)
    sim.run(steps=6, observe=all_of_them)
    for observer, rows in zip(all_of_them, before, strict=True):
        assert len(shown(observer)) > rows
    stress = all_of_them[1]
    assert stress.data["step"].tolist() == [4, 6, 12, 14]


def test_a_failed_run_leaves_nothing_behind():
    """The samples end with the last good state; what the run would have added is gone."""
    sim, all_of_them = small(), observers()
    sim.run(steps=6, observe=all_of_them)
    before = [shown(observer).copy() for observer in all_of_them]
    sim.velocities[3] = 1e9
    with pytest.raises(sdpd.SimulationError):
        sim.run(steps=4, observe=all_of_them)
    for observer, rows in zip(all_of_them, before, strict=True):
        assert shown(observer).tobytes() == rows.tobytes(), observer


def test_observers_can_be_sent_to_another_process():
    all_of_them = observers()
    small().run(steps=8, observe=all_of_them)
    for observer in all_of_them:
        again = pickle.loads(pickle.dumps(observer))
        assert shown(again).tobytes() == shown(observer).tobytes()
        assert repr(again) == repr(observer)


def test_three_dimensions_run_too():
    sim = small_3d()
    currents = sdpd.CurrentCorrelator([(1, 0, 0), (0, 1, 1)], points=4, levels=1)
    stress = sdpd.StressCorrelator(points=4, levels=1)
    sim.run(steps=40, observe=[currents, stress])
    assert [s.transverse.dimension for s in currents.correlations(n_blocks=4)] == [2, 2]
    assert stress.increments(n_blocks=4).dimension == 6


def small_3d():
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water(),
        box=sdpd.Box((1e-8, 1e-8, 1e-8)),
        resolution=sdpd.Resolution(particles=512),
    )
    return sdpd.Simulation(scene, seed=1)


REFUSED = [
    (lambda: sdpd.CurrentCorrelator([(1.0, 0.0)]), TypeError, "`wave_vectors` must be integers"),
    (lambda: sdpd.CurrentCorrelator([1, 0]), ValueError, "`wave_vectors` must have shape (K, 2)"),
    (lambda: sdpd.CurrentCorrelator([(0, 0)]), ValueError, "`wave_vectors` must not be 0"),
    (
        lambda: sdpd.CurrentCorrelator([(1, 0), (-1, 0)]),
        ValueError,
        "`wave_vectors` must hold k or -k once",
    ),
    (
        lambda: sdpd.CurrentCorrelator([(99999, 0)]),
        ValueError,
        "`wave_vectors` must be at most 10000, got 99999",
    ),
    (lambda: sdpd.CurrentCorrelator([(1, 0)], points=5), ValueError, "`points` must be even"),
    (lambda: sdpd.Stress(every=0), ValueError, "`every` must be an integer >= 1, got 0"),
    (lambda: sdpd.StressCorrelator(levels=41), ValueError, "`levels` must be at most 40"),
    (lambda: sdpd.StressCorrelator(parts=1), TypeError, "`parts` must be True or False"),
    (
        lambda: sdpd.StressCorrelator().increments(),
        ValueError,
        "a StressCorrelator must have samples",
    ),
    (
        lambda: sdpd.StressCorrelator().increments("normal"),
        ValueError,
        "`component` must be one of",
    ),
    (
        lambda: sdpd.StressCorrelator().increments("bulk", part="random"),
        ValueError,
        '`part` must be "total" unless `component` is "shear"',
    ),
    (
        lambda: sdpd.StressCorrelator().increments(part="random"),
        ValueError,
        "made without parts=True, got 'random'",
    ),
    (lambda: sdpd.Correlator().correlation("vcf"), ValueError, "`kind` must be one of"),
    (lambda: sdpd.Correlator().correlation(), ValueError, "a Correlator must have samples"),
]


@pytest.mark.parametrize(("call", "kind", "text"), REFUSED)
def test_bad_arguments_are_named(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert text in str(caught.value)


def test_vectors_of_another_dimension_are_refused_before_anything_runs():
    sim, thermo = small(), sdpd.Thermodynamics()
    with pytest.raises(ValueError, match=r"`wave_vectors` must have shape \(K, 2\), got \(1, 3\)"):
        sim.run(steps=2, observe=[thermo, sdpd.CurrentCorrelator([(1, 0, 0)])])
    assert sim.step == 0 and len(thermo) == 0


def test_stress_is_refused_between_walls():
    box = sdpd.Box((8.0, 8.0), periodic="x")
    scene = small_scene(box=box, walls=sdpd.walls.slab(box, "y"))
    sim = small(scene=scene)
    for observer in (sdpd.Stress(), sdpd.StressCorrelator()):
        with pytest.raises(ValueError, match="where there are walls"):
            sim.run(steps=1, observe=observer)
    assert sim.step == 0


def test_lags_of_another_step_are_refused():
    sim = small()
    currents = sdpd.CurrentCorrelator([(1, 0)], points=4, levels=1)
    sim.run(steps=4, observe=currents)
    sim.dt = 0.5 * sim.dt
    with pytest.raises(ValueError, match="`dt` must be that of the samples a CurrentCorrelator"):
        sim.run(steps=4, observe=currents)


def test_memory_that_is_not_there_is_said_before_the_first_step():
    sim = small()
    with pytest.raises(MemoryError, match=r"a stress correlator of .* does not fit in memory"):
        sim.run(steps=1, observe=sdpd.StressCorrelator(points=2**40, levels=2))
    assert sim.step == 0 and math.isfinite(sim.temperature)
