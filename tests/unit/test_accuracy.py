"""Studies of what accuracy costs: settings, rows, the front, files, tables, the command."""

import dataclasses
import json
import math
import sys

import numpy as np
import pytest

import sdpd
from sdpd import accuracy, cli
from sdpd.accuracy import PROBLEMS, Problem, Row, Settings
from sdpd.accuracy.row import _errors
from sdpd.analysis import Estimate

SMALL = {"across": (8, 12), "support": (2.4, 3.0)}


def row(seconds, error, stderr=0.0, **settings):
    return Row(
        settings=Settings(**settings),
        error=error,
        stderr=stderr,
        bias=error,
        bias_stderr=stderr,
        sampling=0.0,
        seconds=seconds,
        slowest=seconds,
        wall_seconds=seconds,
        steps=10,
        dt=0.1,
        particles=100,
        memory=1000,
        runs=1,
    )


# --- settings ---------------------------------------------------------------------------------


def test_grid_takes_all_combinations_in_order():
    found = accuracy.grid(Settings(kernel="lucy"), across=(8, 16), calibrate=(True, False))
    assert [(s.across, s.calibrate) for s in found] == [
        (8, True),
        (8, False),
        (16, True),
        (16, False),
    ]
    assert {s.kernel for s in found} == {"lucy"}


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"across": 1}, ValueError, "`across` must be"),
        ({"support": 0.9}, ValueError, "`support` must be > 1, got 0.9"),
        ({"kernel": "lucyy"}, ValueError, "did you mean 'lucy'"),
        ({"step": 0.0}, ValueError, "`step` must be"),
        ({"integrator": "euler"}, ValueError, "`integrator` must be one of"),
        ({"noise": "loud"}, ValueError, "`noise` must be one of"),
        ({"calibrate": 1}, TypeError, "`calibrate` must be"),
        ({"wall_model": "none"}, ValueError, "`wall_model` must be one of"),
        ({"precision": "half"}, ValueError, "`precision` must be one of"),
    ],
)
def test_bad_settings(change, error, text):
    with pytest.raises(error, match=text):
        Settings(**change)


def test_bad_grids():
    with pytest.raises(TypeError, match="got 'colour'"):
        accuracy.grid(colour=(1,))
    with pytest.raises(TypeError, match="`across` must be a sequence"):
        accuracy.grid(across=8)
    with pytest.raises(TypeError, match="`kernel` must be a sequence"):
        accuracy.grid(kernel="lucy")


def test_labels_name_what_differs():
    study = accuracy.Study(
        problem=PROBLEMS["poiseuille"],
        rows=(row(1.0, 0.1, across=8, kernel="lucy"), row(2.0, 0.05, across=16, kernel="lucy")),
    )
    assert study.varied == ("across",)
    assert [study.label(each) for each in study.rows] == ["8 across", "16 across"]


# --- the front --------------------------------------------------------------------------------


def test_front_of_exact_errors():
    rows = [row(3.0, 0.01), row(1.0, 0.1), row(2.0, 0.2), row(4.0, 0.01), row(0.5, math.inf)]
    assert [(r.seconds, r.error) for r in accuracy.pareto(rows)] == [(1.0, 0.1), (3.0, 0.01)]


def test_front_knows_errors_of_errors():
    """An error that is badly known is not taken for small."""
    rows = [row(1.0, 0.10, 0.01), row(2.0, 0.08, 0.05), row(3.0, 0.06, 0.01)]
    assert [r.seconds for r in accuracy.pareto(rows)] == [1.0, 3.0]
    assert [r.seconds for r in accuracy.pareto(rows, z=0.0)] == [1.0, 2.0, 3.0]
    assert accuracy.pareto([]) == ()
    with pytest.raises(ValueError, match="`z` must be"):
        accuracy.pareto(rows, z=-1.0)


# --- errors of a row --------------------------------------------------------------------------


def test_errors_without_noise():
    found = _errors([Estimate(1.02, 0.0)], Estimate(1.0, 0.0))
    assert found["error"] == pytest.approx(0.02)
    assert found["bias"] == pytest.approx(0.02)
    assert found["stderr"] == found["sampling"] == found["bias_stderr"] == 0.0
    assert _errors([Estimate(-3e-4, 0.0)], Estimate(0.0, 0.0))["bias"] == -3e-4


def test_errors_with_noise_are_bias_and_sampling_apart():
    """Of synthetic runs with known bias and spread: the error is their root of squares."""
    random = np.random.default_rng(5)
    bias, spread, errors, told = 0.03, 0.04, [], []
    for _ in range(800):
        runs = [Estimate(1.0 + bias + spread * random.normal(), spread, 33.0) for _ in range(4)]
        found = _errors(runs, Estimate(1.0, 0.0))
        assert found["bias_stderr"] >= 0.5 * spread - 1e-12
        errors.append(found["error"])
        told.append(found["stderr"])
    true = math.hypot(bias, spread)
    stderr = np.std(errors) / math.sqrt(800.0)
    # runs that happen to differ more count with what they show: some per cent on the safe side
    assert stderr < 0.01 * true
    assert 0.0 <= np.mean(errors) / true - 1.0 < 0.15
    assert 1.0 <= np.mean(told) / np.std(errors) < 1.4  # on the safe side, too


def test_error_of_the_reference_counts():
    found = _errors([Estimate(1.1, 0.0)], Estimate(1.0, 0.02))
    assert found["bias_stderr"] == pytest.approx(0.02)


# --- studies ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def couette():
    return accuracy.study("couette", SMALL, repeats=2)


def test_a_study_tells_errors_and_costs(couette):
    assert len(couette) == 4
    for each in couette.rows:
        assert 1e-4 < each.error < 0.02
        assert 0.0 < each.seconds <= each.slowest
        assert each.steps > 0 and each.particles > 0 and each.memory > 1000
    by = {(r.settings.across, r.settings.support): r for r in couette.rows}
    assert by[12, 3.0].error < by[8, 3.0].error
    assert by[8, 2.4].error > 2.0 * by[8, 3.0].error  # the floor of a small support
    assert by[12, 3.0].particles > by[8, 3.0].particles
    assert couette.passed and "8 across, h/dx 3" in str(couette)


def test_errors_repeat_bit_for_bit(couette):
    again = accuracy.study("couette", {"across": (8,), "support": (3.0,)})
    assert again.rows[0].error == couette.rows[1].error


def test_a_finer_run_is_a_reference():
    base = PROBLEMS["couette"]
    profile = Problem(
        name="momentum",
        title="momentum of a channel",
        error_of="momentum",
        source="finer run",
        scene=base.scene,
        measure=lambda sim, settings: Estimate(_momentum(sim), 0.0),
        reference={"across": lambda across: 2 * across},
        base=Settings(across=8, calibrate=True),
        takes=("across",),
    )
    found = accuracy.study(profile, {"across": (8, 16)})
    assert 0.0 < found.rows[1].error < found.rows[0].error < 0.05


def _momentum(sim):
    sim.run(time=0.1, progress=False)
    return float(sim.velocities[:, 0].mean())


def test_what_fails_is_told_and_the_rest_goes_on():
    found = accuracy.study("poiseuille", {"across": (8,), "step": (1.0, 8.0)})
    good, bad = found.rows
    assert good.error < 0.1 and not good.note
    assert math.isinf(bad.error) and bad.note
    assert found.pareto() == (good,)
    assert not found.passed and bad.note in str(found)


def test_what_a_scene_refuses_is_told():
    base = Settings(across=16, support=4.0)  # a support longer than the cylinder's radius
    (refused,) = accuracy.study("cylinder", [base]).rows
    assert "radius of at least one support" in refused.note


def test_settings_for_another_integrator_are_told():
    axes = {"iterations": (1,), "integrator": ("pair_splitting",)}
    (refused,) = accuracy.study("temperature", axes).rows
    assert "must not be given for the pair splitting" in refused.note


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        (("poise", SMALL), ValueError, "`problem` must be one of"),
        ((3, SMALL), TypeError, "`problem` must be"),
        (("couette", []), ValueError, "`settings` must be at least one"),
        (("couette", {"iterations": (1,)}), ValueError, "`iterations` must be 0"),
        (("couette", [3]), TypeError, "`settings` must be"),
    ],
)
def test_bad_studies(arguments, error, text):
    with pytest.raises(error, match=text):
        accuracy.study(*arguments)


def test_bad_options_of_a_study():
    with pytest.raises(ValueError, match="`seeds` must be different"):
        accuracy.study("couette", SMALL, seeds=(1, 1))
    with pytest.raises(ValueError, match="`repeats` must be"):
        accuracy.study("couette", SMALL, repeats=0)


def test_bad_problems():
    base = PROBLEMS["couette"]
    with pytest.raises(TypeError, match="`measure` must be callable"):
        dataclasses.replace(base, measure=3)
    with pytest.raises(ValueError, match="`takes` must be one of"):
        dataclasses.replace(base, takes=("colour",))
    with pytest.raises(TypeError, match="`reference` must be"):
        dataclasses.replace(base, reference=1.0)
    with pytest.raises(ValueError, match="`length` must be"):
        dataclasses.replace(base, reference={"length": 2.0})


# --- files ------------------------------------------------------------------------------------


def counted(problem):
    """The problem, and a list that grows with each run."""
    runs = []

    def measure(sim, settings):
        runs.append(settings)
        return problem.measure(sim, settings)

    return dataclasses.replace(problem, measure=measure), runs


def test_a_stopped_study_goes_on(tmp_path):
    problem, runs = counted(PROBLEMS["couette"])
    first = accuracy.study(problem, {"across": (8, 12)}, folder=tmp_path)
    assert len(runs) == 2
    path = tmp_path / "couette.jsonl"
    path.write_text(path.read_text() + '{"row": {"settings"', encoding="utf-8")  # killed here
    whole = accuracy.study(problem, {"across": (8, 12, 16)}, folder=tmp_path)
    assert len(runs) == 3
    assert whole.rows[:2] == first.rows
    assert len(path.read_text().splitlines()) == 3
    accuracy.study(problem, {"across": (8,)}, folder=tmp_path, repeats=2)  # another clock
    assert len(runs) == 5


def test_rows_that_failed_are_kept(tmp_path):
    problem, runs = counted(PROBLEMS["poiseuille"])
    axes = {"across": (8,), "step": (8.0,)}
    bad = accuracy.study(problem, axes, folder=tmp_path).rows
    assert accuracy.study(problem, axes, folder=tmp_path).rows == bad
    assert len(runs) == 1 and math.isinf(bad[0].error)


@pytest.mark.parametrize("text", ["no json\n", '{"row": 3}\n', '{"row": {"settings": {}}}\n'])
def test_a_strange_file_is_refused(tmp_path, text):
    (tmp_path / "couette.jsonl").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"couette.jsonl, line 1: expected a row of a study"):
        accuracy.study("couette", {"across": (8,)}, folder=tmp_path)


def test_tables(couette, tmp_path):
    record = couette.records()[0]
    assert record["across"] == 8 and record["error"] == couette.rows[0].error
    assert set(accuracy.UNITS) <= set(record)
    paths = accuracy.write(couette, tmp_path)
    assert paths[0].read_text(encoding="utf-8").count("\n") == 5
    assert "worth its time" in paths[1].read_text(encoding="utf-8")
    json.dumps(couette.records())


def test_data_frames(couette):
    pytest.importorskip("pandas")
    frame = couette.to_pandas()
    assert frame.loc[frame.across == 12, "error"].min() > 0.0
    assert frame.attrs["units"]["seconds"] == "s"


def test_data_sets(couette):
    pytest.importorskip("xarray")
    data = couette.to_xarray()
    assert data["error"].dims == ("setting",) and data["support"].values.tolist()[0] == 2.4
    assert data["seconds"].attrs["units"] == "s"


@pytest.mark.parametrize(("module", "name"), [("pandas", "to_pandas"), ("xarray", "to_xarray")])
def test_missing_libraries(couette, monkeypatch, module, name):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=rf"{module} is needed .* 'sdpd\[{module}\]'"):
        getattr(couette, name)()


def test_figure(couette, tmp_path):
    pytest.importorskip("matplotlib")
    axes = couette.plot()
    assert axes.get_xscale() == axes.get_yscale() == "log"
    labels = {text.get_text() for text in axes.texts}
    assert {couette.label(each) for each in couette.pareto()} == labels
    assert accuracy.write_figure(couette, tmp_path).stat().st_size > 5000


# --- the ready problems -----------------------------------------------------------------------


@pytest.mark.parametrize("name", [n for n, p in PROBLEMS.items() if not p.noisy])
def test_flows_are_right_within_a_few_per_cent(name):
    changes = {"across": 16, "support": 3.0}
    if "calibrate" in PROBLEMS[name].takes:
        changes["calibrate"] = True
    if name == "thermal_couette":
        changes["across"] = 10
    (found,) = accuracy.study(name, [PROBLEMS[name].base.replace(**changes)]).rows
    assert found.error < 0.06


@pytest.mark.parametrize("name", ["temperature", "temperature_variance", "diffusion"])
def test_equilibria_are_right_within_their_errors(name):
    """Bias within four standard errors of what is known, and those small enough to see faults."""
    expected = {"temperature": 0.0, "temperature_variance": 0.0, "diffusion": 0.117}
    settings = PROBLEMS[name].base.replace(length=0.5 if name == "diffusion" else 0.2)
    (found,) = accuracy.study(name, [settings]).rows
    limit = 0.005 if name == "diffusion" else 4.0 * found.bias_stderr
    assert found.bias_stderr < {"temperature": 6e-3, "diffusion": 1e-3}.get(name, 0.015)
    assert abs(found.bias - expected[name]) < limit


def test_energy_drifts_without_books_only():
    axes = {"bookkeeping": (True, False), "step": (2.0,), "length": (0.1,)}
    kept, lost = accuracy.study("energy_slope", axes).rows
    assert kept.error < 1e-12
    assert lost.bias > 1e-3


def test_density_varies_more_at_large_steps():
    """0.61 of the square of dt over the acoustic limit: 0.5 of it, beside 0.125 of it."""
    coarser = {"step": 0.5, "length": lambda length: 2.0 * length}
    problem = dataclasses.replace(PROBLEMS["density_variance"], reference=coarser)
    (found,) = accuracy.study(problem, {"step": (2.0,), "length": (0.2,)}).rows
    assert found.bias_stderr < 0.03
    assert abs(found.bias - 0.61 * (0.25 - 0.0156)) < 3.0 * found.bias_stderr + 0.03


# --- the command ------------------------------------------------------------------------------


def test_command_lists_problems(capsys):
    assert cli.main(["accuracy"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in PROBLEMS)


def test_command_runs_a_study(tmp_path, capsys):
    options = ["--across", "8,12", "--calibrate", "yes,no", "--no-progress"]
    folders = ["-o", str(tmp_path), "--store", str(tmp_path / "kept")]
    assert cli.main(["accuracy", "couette", *options, *folders]) == 0
    assert "8 across, calibrated" in capsys.readouterr().out
    assert (tmp_path / "accuracy_couette.csv").exists()
    assert (tmp_path / "kept" / "couette.jsonl").exists()
    assert cli.main(["accuracy", "poiseuille", "--across", "8", "--step", "8"]) == 1
    assert cli.main(["accuracy", "couete"]) == 2
    with pytest.raises(SystemExit):
        cli.main(["accuracy", "couette", "--across", "8,x"])
    assert "expected values like 8,16" in capsys.readouterr().err


def test_problems_need_not_be_loaded_for_the_command_line():
    import subprocess

    code = "import sys, sdpd.commands.accuracy; print('sdpd.accuracy.problems' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    assert "study" in dir(sdpd.accuracy)
    with pytest.raises(AttributeError, match=r"'sdpd\.accuracy' has no attribute 'studies'"):
        accuracy.studies  # noqa: B018
