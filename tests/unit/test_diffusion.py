"""The main job: tables, formulas, estimators on known input, the study itself at a small size."""

import csv
import dataclasses
import json
import math
import pickle

import numpy as np
import pytest

import sdpd
from sdpd import diffusion
from sdpd.analysis import Estimate
from sdpd.diffusion import measure, results, study
from sdpd.diffusion.plan import POINTS

WATER, NITROGEN = diffusion.TABLES["water"], diffusion.TABLES["nitrogen"]


# --- tables and formulas ----------------------------------------------------------------------


@pytest.mark.parametrize("case", WATER.values(), ids=lambda case: case.name)
def test_water_table_agrees_with_its_own_derived_columns(case):
    scene = case.scene()
    found = diffusion.formulas(scene)
    assert found.bird == pytest.approx(case.published_bird, rel=0.005)
    # printed with the measured density; case 3 with h = 1.8e-9 instead of the printed 1.9e-9
    at_density = found.dissertation * case.published_density / 1000.0
    expected = case.published_support * ((1.9 / 1.8) ** 2 if case.number == 3 else 1.0)
    assert at_density == pytest.approx(expected, rel=0.02)
    assert math.sqrt(3.0) * scene.thermal_speed == pytest.approx(case.published_speed, rel=0.03)
    assert scene.stiffness == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("number", "ratio"), [(1, 1.08), (2, 1.72), (3, 2.15), (5, 21.5), (6, 108), (9, 215), (10, 323)]
)
def test_size_ratio_is_that_of_the_table(number, ratio):
    found = diffusion.formulas(WATER[number].scene())
    assert found.size_ratio == pytest.approx(ratio, rel=0.007)


@pytest.mark.parametrize("case", NITROGEN.values(), ids=lambda case: case.name)
def test_nitrogen_is_an_ideal_gas_of_the_viscosity_of_table_8(case):
    scene = case.scene()
    assert scene.fluid.shear_viscosity == 1e-5
    assert scene.fluid.equation_of_state == sdpd.eos.IdealGas()
    assert scene.stiffness == pytest.approx(100.0)
    found = diffusion.formulas(scene)
    ratio = {1: 222.22, 2: 333.33, 3: 2222.22}[case.number]
    assert found.size_ratio == pytest.approx(ratio, rel=1e-3)
    assert found.molecular is None


def test_the_dissertation_is_too_low_by_2_70_with_lucy():
    found = diffusion.formulas(WATER[3].scene())
    assert found.factor == pytest.approx(3.0 / 70.0)
    assert found.continuum / found.dissertation == pytest.approx(2.70)
    assert found.molecular == pytest.approx(2.12e-9, rel=0.005)


def test_cases_are_chosen_by_number():
    assert [case.number for case in diffusion.get_cases()] == [1, 3, 5, 9, 10]
    assert [case.number for case in diffusion.get_cases("nitrogen")] == [1, 2, 3]
    assert [case.number for case in diffusion.get_cases("water", (7, 2, 7))] == [2, 7]
    with pytest.raises(ValueError, match=r"`cases` must be among .* for nitrogen, got 4"):
        diffusion.get_cases("nitrogen", (4,))
    with pytest.raises(ValueError, match="`cases` must name at least one case"):
        diffusion.get_cases("water", ())
    with pytest.raises(ValueError, match="`fluid` must be one of"):
        diffusion.get_cases("argon")


def test_a_resized_case_keeps_its_particles():
    case = WATER[5]
    small = case.resized(216)
    assert small.spacing == pytest.approx(case.spacing)
    full, less = case.scene(), small.scene()
    assert less.n_particles == 216
    assert less.particle_mass == pytest.approx(full.particle_mass)
    assert less.friction_time == pytest.approx(full.friction_time)
    assert less.stiffness == pytest.approx(100.0)


def test_another_choice_of_kernel_and_equation_of_state():
    scene = WATER[3].scene(kernel="wendland_c2", equation_of_state="linear", sound_ratio=20.0)
    assert scene.resolution.kernel == "wendland_c2"
    assert scene.fluid.equation_of_state.kind == "linear"
    assert scene.stiffness == pytest.approx(400.0)
    with pytest.warns(sdpd.PairingWarning):
        WATER[3].scene(equation_of_state="ideal_gas", sound_ratio=20.0)


# --- plans ------------------------------------------------------------------------------------


def test_a_plan_fills_the_time_asked_for():
    scene = WATER[3].scene()
    plan, longer = diffusion.plan_case(scene), diffusion.plan_case(scene, core_minutes=2.4)
    assert longer.steps == pytest.approx(2.0 * plan.steps, rel=0.02)
    assert plan.short <= 0.05 * scene.friction_time * (1.0 + 1e-12)
    assert plan.long <= 0.5 * scene.friction_time * (1.0 + 1e-12)
    assert plan.replicas * plan.blocks >= 16
    with pytest.raises(ValueError, match="`core_minutes` must be finite and > 0"):
        diffusion.plan_case(scene, core_minutes=0.0)


@pytest.mark.parametrize("steps", [64, 65, 100, 262, 1000, 5000])
def test_lags_reach_the_window_and_the_cutoff(steps):
    plan = dataclasses.replace(diffusion.quick_plan(WATER[3].scene()), long_steps=steps)
    longest = (POINTS - 1) * 2 ** (plan.levels - 1) * plan.long
    assert longest >= plan.window[1]
    assert plan.cutoff <= 0.9 * steps * plan.long * (1.0 + 1e-12)
    assert plan.cutoff >= 0.45 * steps * plan.long or plan.cutoff == POINTS * plan.long


def test_seeds_of_replicas_differ_and_repeat():
    keys = [(seed, fluid, case, r) for seed in (1, 2) for fluid in ("water", "nitrogen")
            for case in (1, 3) for r in (0, 1)]  # fmt: skip
    seeds = [measure.replica_seed(*key) for key in keys]
    assert len(set(seeds)) == len(seeds)
    assert seeds == [measure.replica_seed(*key) for key in keys]


# --- estimators on known input ----------------------------------------------------------------


def octaves(points, levels):
    """The lags of a correlator."""
    lags = list(range(points))
    for level in range(1, levels):
        lags += [k << level for k in range(points // 2, points)]
    return np.array(lags, dtype=float)


def test_slope_of_a_straight_line_is_exact():
    lag = 0.5 * octaves(16, 5)
    weights = results.slope_weights(lag, 0.5, (6.0, 90.0))
    assert weights @ (3.0 + 0.7 * lag) == pytest.approx(0.7, rel=1e-12)
    assert (weights[lag < 6.0] == 0.0).all()
    assert (weights[lag > 90.0] == 0.0).all()
    with pytest.raises(ValueError, match="`window` must hold at least 2 lags"):
        results.slope_weights(lag, 0.5, (6.1, 6.2))


def test_integral_over_octaves_of_lags():
    lag = 0.5 * octaves(32, 4)
    weights = results.integral_weights(lag, 64.0)
    assert weights @ lag**3 == pytest.approx(64.0**4 / 4.0, rel=1e-12)  # Simpson: exact for cubics
    assert weights @ np.exp(-lag) == pytest.approx(1.0, rel=5e-4)
    trapezoid = results.integral_weights(lag[:4], 1.5)
    assert trapezoid @ np.ones(4) == pytest.approx(1.5)


def test_normalized_vacf_of_an_ornstein_uhlenbeck_process():
    rng = np.random.default_rng(3)
    decay, steps, number = 0.95, 40, 20000
    velocity = np.empty((steps, number, 3))
    velocity[0] = rng.normal(size=(number, 3))
    for k in range(1, steps):
        noise = rng.normal(size=(number, 3))
        velocity[k] = decay * velocity[k - 1] + math.sqrt(1.0 - decay**2) * noise
    found = measure.normalized_vacf(velocity, 4)
    expected = decay ** np.arange(5)
    assert found[0] == 1.0
    # each step's noise enters once: the error of 1 - C is sqrt(2 (1 - C)/(3 N steps))
    error = np.sqrt(2.0 * (1.0 - expected[1:]) / (3.0 * number * steps)) * np.arange(1, 5)
    assert (abs(found[1:] - expected[1:]) < 4.0 * error).all()
    grown = velocity * np.linspace(1.0, 1.02, steps)[:, None, None]  # a drift of the temperature
    assert measure.normalized_vacf(grown, 4) == pytest.approx(found, abs=3e-6)


@pytest.mark.parametrize("case", WATER.values(), ids=lambda case: case.name)
def test_printed_columns_of_table_7_follow_from_its_inputs(case):
    again = diffusion.recomputed(case)
    assert again.mass_ratio == pytest.approx(case.published_mass_ratio, rel=0.005)
    assert again.size_ratio == pytest.approx(case.published_size_ratio, rel=0.006)
    assert again.bird == pytest.approx(case.published_bird, rel=0.005)
    # case 3 was computed with h = 1.8e-9 m
    factor = (1.9 / 1.8) ** 2 if case.number == 3 else 1.0
    assert again.support == pytest.approx(factor * case.published_support, rel=0.006)
    assert again.temperature == pytest.approx(300.0, rel=0.05)


@pytest.mark.parametrize("case", NITROGEN.values(), ids=lambda case: case.name)
def test_what_does_not_follow_in_table_8(case):
    again = diffusion.recomputed(case)
    assert again.size_ratio == pytest.approx(case.published_size_ratio, rel=1e-4)
    # printed: 2.15e25 molecules in a cubic metre, of 5.5e-26 kg; nitrogen's have 4.65e-26 kg
    assert case.published_mass_ratio / again.mass_ratio == pytest.approx(0.8450, rel=1e-3)
    assert 320.0 < again.temperature < 345.0


def synthetic(scene, plan, rate=None, noise=1e-4, drift=0.0, seed=1):
    """A sample with an exponential VACF, long-time D equal to the short-time one."""
    rng = np.random.default_rng(seed)
    rate = 1.0 / scene.friction_time if rate is None else rate
    variance, number = scene.thermal_energy / scene.particle_mass, scene.n_particles
    lag = plan.long * octaves(POINTS, plan.levels)
    short = plan.short * np.arange(measure.SLOPE_LAGS + 1.0)

    def blocks(curve, count=plan.blocks):
        return curve * (1.0 + noise * rng.normal(size=(count, 1)))

    step = (rate * plan.long) ** 2 / 12.0
    state = np.array([scene.fluid.temperature, scene.fluid.density, 1.0])
    ramp = 1.0 + drift * np.arange(plan.blocks)[:, None]
    return measure.Sample(
        state=state * ramp * (1.0 + noise * rng.normal(size=(plan.blocks, 3))),
        temperature_square=(1.0 + noise * rng.normal(size=plan.blocks)) / (1.5 * (number - 1.0)),
        rate=rate * (1.0 + noise * rng.normal(size=plan.blocks)),
        short_lag=short,
        short_vacf=np.exp(-blocks(short * rate / (1.0 - 1.0 / number), 2 * plan.blocks)),
        lag=lag,
        msd=blocks(6.0 * variance / rate * (1.0 + step) * lag),
        vacf=blocks(variance * np.exp(-rate * lag)),
        counts=np.ones((plan.blocks, lag.size)),
        seconds=1.0,
    )


@pytest.fixture(scope="module")
def small():
    case = WATER[3].resized(216)
    scene = case.scene()
    return case, scene, diffusion.quick_plan(scene)


def test_estimates_of_a_known_sample(small):
    _, scene, plan = small
    found = diffusion.evaluate(*small, [synthetic(scene, plan, seed=k) for k in (1, 2)])
    assert found.temperature_variance.value == pytest.approx(1.0, rel=1e-3)
    exact = scene.thermal_energy * scene.friction_time / scene.particle_mass
    for estimate in (found.short, found.exact, found.msd, found.integral):
        assert estimate.value == pytest.approx(exact, rel=1e-3)
        assert estimate.relative < 1e-3
    assert found.msd.n_effective == 2 * plan.blocks
    assert found.short.n_effective == 4 * plan.blocks
    assert found.schmidt(found.msd).value == pytest.approx(1e-6 / exact, rel=1e-3)
    assert found.step_bias / found.msd.value == pytest.approx(0.25 / 12.0, rel=0.01)
    assert diffusion.assess(found, diffusion.Limits()) == []


@pytest.mark.parametrize(
    ("change", "limits", "said"),
    [
        ({"noise": 0.5}, {}, "short-time D from the VACF has a standard error of"),
        ({"noise": 0.2}, {"short_error": 1.0}, "long-time D from the MSD has a standard error"),
        ({"drift": 0.01}, {}, "mean density drifts by"),
        ({"drift": 0.01}, {}, "the kinetic temperature is off by"),
    ],
)
def test_each_criterion_can_fail(small, change, limits, said):
    _, scene, plan = small
    bad = diffusion.evaluate(*small, [synthetic(scene, plan, **change)])
    limits = diffusion.Limits(**{"long_error": 0.01, **limits})
    assert any(said in line for line in diffusion.assess(bad, limits))


def test_a_wrong_rate_is_noticed(small):
    _, scene, plan = small
    sample = synthetic(scene, plan)
    wrong = dataclasses.replace(sample, rate=1.01 * sample.rate)
    found = diffusion.evaluate(*small, [wrong])
    assert found.deviation > 10.0
    lines = diffusion.assess(found, diffusion.Limits())
    assert any("standard errors from its exact prediction" in line for line in lines)


# --- mean field of collective motion ----------------------------------------------------------


def test_collective_theory_of_case_3():
    scene = WATER[3].scene()
    theory = diffusion.collective_theory(scene)
    # runs of 8000 tau at N = 3375: 1.107(1) D_K at short times
    assert theory.short / scene.self_diffusion_continuum == pytest.approx(1.107, rel=0.01)
    assert theory.gain == pytest.approx(0.093, abs=0.002)
    assert theory.loss == pytest.approx(0.050, abs=0.002)
    assert float(theory.remaining(0.0)) == pytest.approx(theory.loss)
    later = theory.remaining(np.array([10.0, 100.0, 1000.0]) * scene.friction_time)
    assert (np.diff(later) < 0.0).all()
    assert later[-1] < 0.01 * theory.loss
    assert theory.long == pytest.approx(theory.short * (1.0 + theory.gain - theory.loss))


def test_collective_gain_grows_with_the_box_and_caging_with_stiffness():
    gains = [diffusion.collective_theory(WATER[3].resized(n).scene()).gain for n in (216, 1000)]
    assert gains[0] < gains[1]
    losses = [
        diffusion.collective_theory(WATER[3].scene(sound_ratio=ratio)).loss for ratio in (5, 10, 20)
    ]
    assert losses == sorted(losses)
    assert losses[0] < losses[2]


def test_collective_theory_needs_a_cube():
    scene = WATER[3].scene()
    flat = scene.replace(box=sdpd.Box((1e-8, 1e-8, 2e-8)))
    with pytest.raises(ValueError, match=r"`scene\.box` must be a cube"):
        diffusion.collective_theory(flat)


# --- the study --------------------------------------------------------------------------------

ARGUMENTS = {"cases": [1, 9], "quick": True, "particles": 216, "seed": 5}


@pytest.fixture(scope="module")
def made():
    return diffusion.run_study(**ARGUMENTS, processes=1, progress=False)


def test_a_small_study_meets_theory(made):
    assert made.passed, made.failures
    for result, theory in zip(made.results, made.collective, strict=True):
        assert result.short.relative < 0.05
        assert result.exact.relative < 0.005
        assert result.msd.relative < 0.10
        assert result.integral.relative < 0.10
        assert abs(result.msd.value / result.integral.value - 1.0) < 0.15
        # mean field, good to a few per cent, and at lags where caging is not complete
        assert result.exact.value == pytest.approx(theory.short, rel=0.03)
        assert result.msd.value == pytest.approx(theory.long, rel=0.12)
        # every estimate lies far above the dissertation's formula
        assert result.msd.value > 2.3 * result.formulas.dissertation


def test_the_study_depends_on_no_number_of_processes(made):
    other = diffusion.run_study(**ARGUMENTS, processes=2, progress=False)
    for one, two in zip(made.results, other.results, strict=True):
        assert one.short == two.short
        assert one.msd == two.msd
        assert one.integral == two.integral
        assert one.exact == two.exact


def test_another_seed_is_another_run(made):
    arguments = {**ARGUMENTS, "cases": [9], "seed": 6}
    other = diffusion.run_study(**arguments, processes=1, progress=False)
    assert other.results[0].msd != made.results[1].msd


def test_report_says_everything(made):
    text = str(made)
    for part in (
        "Table 7",
        "artificial" if "artificial" in text else "rho0 c^2/2",
        "MSD lags",
        "drift density",
        "Schmidt number",
        "too low by a factor of 2.70",
        "20η/9",
        "cage",
        "2.12e-09",
        "2.5e-09",
        "PASS",
    ):
        assert part in text


def test_files(made, tmp_path):
    folder = tmp_path / "new" / "folder"
    paths = diffusion.write(made, folder) + diffusion.write_figures(made, folder)
    names = ["diffusion.csv", "diffusion.json", "diffusion.txt", "diffusion.png", "schmidt.png"]
    assert [path.name for path in paths] == names
    with paths[0].open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["case"] for row in table] == ["1", "9"]
    for row, result in zip(table, made.results, strict=True):
        assert float(row["D_long_msd_m2_s"]) == result.msd.value
        assert float(row["D_long_msd_m2_s_stderr"]) == result.msd.stderr
        assert float(row["D_short_exact_m2_s"]) == result.exact.value
        ratio = float(row["D_continuum_m2_s"]) / float(row["D_dissertation_m2_s"])
        assert ratio == pytest.approx(2.70)
        assert float(row["Sc_long_integral"]) == pytest.approx(1e-6 / result.integral.value)
    summary = json.loads(paths[1].read_text(encoding="utf-8"))
    assert summary["passed"] is True
    assert summary["seed"] == 5
    assert len(summary["cases"]) == 2
    for path in paths[3:]:
        assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_failing_study_says_why(made):
    strict = dataclasses.replace(made, limits=diffusion.Limits(short_error=1e-6))
    assert not strict.passed
    assert set(strict.failures) == {"water case 1", "water case 9"}
    assert "FAIL:\n  water case 1: short-time D from the VACF has a standard error" in str(strict)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"processes": 0}, "`processes` must be an integer >= 1, got 0"),
        ({"seed": -1}, "`seed` must be an integer >= 0, got -1"),
        ({"particles": 1}, "`particles` must be an integer >= 2, got 1"),
        ({"particles": 100}, "`box.lengths` must be >= two supports"),
        ({"sound_ratio": 0.0}, "`sound_ratio` must be finite and > 0"),
        ({"kernel": "gauss"}, "`kernel` must be one of"),
        ({"equation_of_state": "none"}, "`equation_of_state` must be one of"),
    ],
)
def test_bad_arguments_are_named(change, said):
    with pytest.raises(ValueError, match=said):
        diffusion.run_study(**{**ARGUMENTS, **change}, progress=False)


def test_an_error_in_a_worker_comes_back(small):
    case, scene, plan = small
    broken = dataclasses.replace(plan, short=-1.0)
    jobs = [study._Job(case, scene, plan)]
    tasks = [study._Task(0, scene, each, 1) for each in (broken, plan)]
    with (
        study._Bar(jobs, tasks, False) as bar,
        pytest.raises(ValueError, match="`dt` must be finite and > 0"),
    ):
        study._run(tasks, 2, bar)


def test_samples_and_results_travel(made):
    copy = pickle.loads(pickle.dumps(made))
    assert copy.results[0].msd == made.results[0].msd
    assert isinstance(copy.results[0].short, Estimate)
