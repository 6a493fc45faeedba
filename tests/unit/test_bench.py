"""The benchmarks: what they give and print, their verdicts, what they refuse."""

import json
import math
import os
import stat
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import sdpd
from sdpd import bench, cli
from sdpd.bench import fluid, lammps, peer
from sdpd.bench.peak import work
from sdpd.bench.turns import Lists, Runs, Spread, take_turns


def difference(without, with_it):
    return bench.Difference.of("x", "y", without, with_it)


# --- turns and verdicts -----------------------------------------------------------------------


def test_spread_is_median_and_quartiles() -> None:
    spread = Spread.of([4.0, 1.0, 2.0, 3.0, 5.0])
    assert spread == Spread(3.0, 2.0, 4.0)
    assert spread.scaled(2.0) == Spread(6.0, 4.0, 8.0)
    assert spread.inverse(12.0) == Spread(4.0, 3.0, 6.0)
    assert spread.shown(".0f") == "3 (2-4)"
    assert Spread(-1.0, -2.0, 3.0).shown("+.0f") == "-1 (-2 to +3)"


def test_turns_alternate_their_order() -> None:
    seen = []
    cases = {name: lambda name=name: seen.append(name) or float(len(seen)) for name in "ab"}
    times = take_turns(cases, 3)
    assert "".join(seen) == "abbaab"
    assert times == {"a": [1.0, 4.0, 5.0], "b": [2.0, 3.0, 6.0]}


def test_lists_count_with_their_share() -> None:
    lists = Lists(interval=10.0, cost=30.0, step=3.0)
    # 10 steps of 3 ns and one list of 30 ns: twice the time of the steps
    assert lists.share(10, 1) == 2.0
    assert Lists(math.inf, 0.0, 3.0).share(10, 0) == 1.0


def test_a_turn_without_its_list_is_corrected(monkeypatch) -> None:
    scene = bench.water(8, 2.4)
    sim = sdpd.Simulation(scene, threads=1, positions=bench.liquid(scene, settling=1))
    lists = Lists(interval=10.0, cost=30.0, step=3.0)
    runs = Runs(sim, 0.0, lists=lists)
    clock = iter([0.0, 2 * 512 * 3e-9])  # two steps at 3 ns a particle
    fake = SimpleNamespace(perf_counter=lambda: next(clock))
    monkeypatch.setattr("sdpd.bench.turns.time", fake)
    monkeypatch.setattr("sdpd.bench.turns._builds", lambda _: 0)
    assert runs() == pytest.approx(3.0 + 30.0 / 10.0)


def test_sides_are_the_same_unless_every_turn_says_otherwise() -> None:
    base = [100.0, 101.0, 99.0, 100.0, 102.0, 98.0, 100.0, 100.0, 100.0]
    shifted = [x + 5.0 for x in base]
    assert bench.same(difference(base, base)) is True
    assert bench.same(difference(base, shifted)) is False
    assert bench.same(difference(shifted, base)) is False
    # below one per cent: where arrays lie in memory may do that
    assert bench.same(difference(base, [x + 0.5 for x in base])) is True
    # one turn of nine contradicts
    assert bench.same(difference(base, [base[0] - 1.0, *shifted[1:]])) is True


def test_no_verdict_from_few_or_noisy_turns() -> None:
    base = [100.0] * 9
    assert bench.same(difference(base[:5], [105.0] * 5)) is None
    noisy = [100.0 + 10.0 * (-1) ** k for k in range(9)]
    assert bench.same(difference(base, noisy)) is None


def test_a_failed_check_fails_the_study() -> None:
    good, bad = difference([100.0] * 9, [100.0] * 9), difference([100.0] * 9, [110.0] * 9)
    arguments = {
        "machine": bench.Machine.here(),
        "threads": 1,
        "rounds": 9,
        "seconds": 1.0,
        "particles": 512,
        "support": 2.4,
        "effects": (good,),
    }
    assert bench.EffectCosts(**arguments, absent=(good,)).passed
    study = bench.EffectCosts(**arguments, absent=(good, bad))
    assert not study.passed
    assert "NOT the same" in str(study)
    assert [entry["same"] for entry in study.document()["absent"]] == [True, False]


# --- the fluid --------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
def test_liquid_is_a_pattern_side_by_side(dimension) -> None:
    scene = bench.water(16 if dimension == 3 else 40, 2.4, dimension=dimension)
    points = bench.liquid(scene, settling=1)
    assert points.shape == (scene.n_particles, dimension)
    edge = scene.box.lengths[0]
    sim = sdpd.Simulation(scene, threads=1, positions=points)
    # as even as a fluid: no two particles on top of each other, density within a few per cent
    assert np.abs(sim.densities / scene.fluid.density - 1.0).max() < 0.3
    assert sim.positions.min() >= 0.0 and sim.positions.max() < edge


def test_the_water_is_that_of_the_peer() -> None:
    """P = B ((rho/rho_0)^7 - 1) with B = c^2 rho_0/7, as LAMMPS has it."""
    scene = bench.water(8, 2.4)
    rho = np.array([990.0, 1000.0, 1020.0])
    found = scene.fluid.equation_of_state.pressure(
        rho, reference_density=1000.0, sound_speed=scene.sound.speed
    )
    assert scene.sound.speed == 1.2
    stiffness = 1.2**2 * 1000.0 / 7.0
    np.testing.assert_allclose(found, stiffness * ((rho / 1000.0) ** 7 - 1.0), atol=1e-9)
    assert scene.spacing == pytest.approx(1e-6 / 15)
    assert not scene.active_effects.energy


# --- speed and effects ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def speed() -> bench.Speed:
    return bench.run_speed((512, 729), supports=(2.4,), rounds=2, quick=True, progress=False)


def test_speed_of_steps(speed) -> None:
    assert len(speed.rows) == 2 * 6
    row = speed.rows[0]
    assert (row.particles, row.support, row.kernel) == (512, 2.4, "lucy")
    assert row.rate.median == pytest.approx(1e9 / row.time.median)
    assert row.time_per_pair.median == pytest.approx(row.time.median / row.pairs)
    assert row.time.lower <= row.time.median <= row.time.upper
    assert 300.0 < row.bytes_per_particle < 2000.0
    assert all(ratio >= 1.0 for ratio in speed.flatness().values())
    assert {part.name for part in speed.parts} >= {"friction", "uniform noise"}
    assert row.listed >= row.near >= 0.99 * row.pairs
    # a step does some hundred operations a pair, and no more than the machine can
    assert 100.0 < row.work.flops / row.pairs < 300.0
    shares = speed.shares()
    assert len(shares) == len(speed.rows) and {len(share) for share in shares} == {7}
    assert all(0.0 <= float(share[4]) < 150.0 for share in shares if "mixed" not in share[2])
    text = str(speed)
    assert "at best" in text and "% of best" in text
    assert "flatness in N" in text and "pair splitting" in text and speed.machine.date in text


def test_more_work_is_counted_as_more() -> None:
    least = work(50.0, 52.0, 60.0, noise="none", splitting=False)
    noisy = work(50.0, 52.0, 60.0, noise="uniform", splitting=False)
    gaussian = work(50.0, 52.0, 60.0, noise="gaussian", splitting=False)
    splitting = work(50.0, 52.0, 60.0, noise="gaussian", splitting=True)
    assert least.flops < noisy.flops < gaussian.flops < splitting.flops
    assert least.bytes == noisy.bytes < splitting.bytes


def test_the_best_of_the_machine() -> None:
    found = bench.Peak.measure()
    assert found.threads == 1 and 1e9 < found.flops < 1e12 and 1e8 < found.bandwidth < 1e13
    assert "one thread at best" in str(found) and "GFlop/s" in str(found)
    with pytest.raises(ValueError, match="`threads`"):
        bench.Peak.measure(0)


def test_document_is_json(speed, tmp_path) -> None:
    document = json.loads(bench.write_json(speed, tmp_path / "a" / "b.json").read_text())
    assert document["kind"] == "speed" and document["threads"] == 1 and document["rounds"] == 2
    assert set(document["machine"]) == {
        *("processor", "flags", "processors", "system", "python", "numpy", "version"),
        *("commit", "date"),
    }
    assert {"particles", "time", "lists", "bytes_per_particle"} <= set(document["rows"][0])
    quiet = [row for row in document["rows"] if row["step"] == "Verlet, no noise"]
    assert quiet[0]["lists"]["interval"] is None  # infinite: nothing moves
    assert len(document["flatness"]) == 6


def test_effects(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "effects.json"
    options = ["--sizes", "512", "--supports", "2.4", "--rounds", "1", "--quick", "--no-progress"]
    found = cli.main(["bench", "effects", *options, "--json", str(path), "-o", str(tmp_path)])
    assert found == 0  # one turn judges nothing
    shown = capsys.readouterr().out
    assert "switched off, against absent" in shown and "cannot tell" in shown
    document = json.loads(path.read_text())
    names = {entry["name"] for entry in document["effects"]}
    assert {
        *("friction", "fluctuations, uniform", "bulk viscosity", "energy, heating", "conduction"),
        *("coefficients of T", "two walls", "stress observer", "Correlator", "StressCorrelator"),
        *("quintic_spline", "wendland_c2", "wendland_c4", "pair splitting", "D = 3"),
    } <= names
    assert {entry["name"] for entry in document["absent"]} >= {"bulk viscosity", "energy"}
    assert all(entry["without"]["median"] > 0.0 for entry in document["effects"])
    assert {each.name for each in tmp_path.iterdir()} == {
        *("effects.json", "bench_effects.json", "bench_effects.txt", "bench_effects.png"),
    }


def test_figure_of_sizes(speed, tmp_path) -> None:
    pytest.importorskip("matplotlib")
    assert bench.write_figure(speed, tmp_path).name == "bench_speed.png"
    with pytest.raises(TypeError, match="`study` must be a benchmark"):
        bench.plot(object())


def test_command(capsys) -> None:
    options = ["--sizes", "512", "--supports", "2.4", "--rounds", "1", "--quick", "--no-progress"]
    assert cli.main(["bench", *options, "--kernels", "wendland_c2"]) == 0
    assert "wendland_c2" in capsys.readouterr().out


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--sizes", "1000,1001"], "`sizes` must be cubes of integers >= 8"),
        (["--sizes", "343"], "`sizes` must be cubes of integers >= 8"),
        (["--supports", "-1"], "`supports` must be finite and > 0"),
        (["--kernels", "gauss"], "`kernels` must be one of"),
        (["--rounds", "0"], "`rounds` must be an integer >= 1"),
        (["--threads", "0"], "`threads` must be an integer >= 1"),
        (["effects", "--sizes", "512,1000"], "`--sizes` must be one number with effects"),
        (["effects", "--kernels", "lucy"], "`--kernels` and `effects` exclude each other"),
        (["effects", "--peer", "lammps"], "`effects` and `--peer` exclude each other"),
        (["--lammps", "lmp"], "`--lammps` and `a benchmark without --peer` exclude"),
        (["--peer", "lammps", "--lammps", "no/lmp"], "`lammps` must be an executable"),
    ],
)
def test_bad_arguments_return_2(arguments, said, capsys) -> None:
    assert cli.main(["bench", *arguments, "--no-progress"]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("sdpd bench: ") and said in shown


def test_numbers_that_are_none(capsys) -> None:
    with pytest.raises(SystemExit):
        cli.main(["bench", "--supports", "2.4,x"])
    assert "expected numbers like 2.4,3.0, got '2.4,x'" in capsys.readouterr().err


def test_no_lammps_is_told(monkeypatch, capsys) -> None:
    monkeypatch.setattr(lammps.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setattr(lammps.shutil, "which", lambda _: None)
    assert cli.main(["bench", "--peer", "lammps"]) == 2
    shown = capsys.readouterr().err
    assert "LAMMPS is not here" in shown and "pip install lammps mpich" in shown


# --- LAMMPS, or what passes for it ------------------------------------------------------------

FAKE = """#!/bin/sh
if [ "$1" = "-h" ]; then
  echo "Large-scale Atomic/Molecular Massively Parallel Simulator - 1 Jan 2026"
  echo "{styles}"
  exit 0
fi
while read -r line; do
  case "$line" in
    print*) echo sdpd-bench-done;;
    run*) echo "   Step          Temp"; echo "0 300"; echo "1 296"; echo "2 298"
          echo "Loop time of 0.004 on 1 procs for 2 steps with 512 atoms";;
    bad*) echo "ERROR: unknown command"; exit 1;;
    quit*) exit 0;;
  esac
done
"""


@pytest.fixture
def fake(tmp_path) -> Path:
    if os.name != "posix":
        pytest.skip("needs a shell")
    path = tmp_path / "lmp"
    path.write_text(FAKE.format(styles=" ".join(lammps.NEEDED)))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_lammps_is_found_with_its_library(fake, monkeypatch) -> None:
    (fake.parent / "lib").mkdir()
    (fake.parent / "lib" / "libmpi.so.12").touch()
    monkeypatch.setattr(lammps.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setenv("PATH", str(fake.parent), prepend=os.pathsep)
    found = lammps.find()
    assert found.executable == str(fake) and found.version == "1 Jan 2026"
    assert found.environment["LD_LIBRARY_PATH"].split(os.pathsep)[0] == str(fake.parent / "lib")
    assert found.environment["OMP_NUM_THREADS"] == "1"


def test_lammps_without_its_packages_is_refused(fake) -> None:
    fake.write_text(FAKE.format(styles="lj/cut"))
    with pytest.raises(ValueError, match="packages SPH and DPD-SMOOTH"):
        lammps.find(fake)
    fake.write_text("#!/bin/sh\necho libmpi.so is missing >&2; exit 127\n")
    with pytest.raises(ValueError, match=r"does not start: .*libmpi.so is missing"):
        lammps.find(fake)


def test_input_of_lammps(tmp_path) -> None:
    scene = bench.water(8, 2.4)
    lines = lammps.commands(scene, dt=1e-10, seed=5, noise=True)
    h, rho, c = scene.support_radius, 1000.0, 1.2
    assert any(
        line.endswith("sph/rhosum 1 sdpd/taitwater/isothermal 300.0 0.001 5") for line in lines
    )
    assert f"pair_coeff * * sdpd/taitwater/isothermal {rho!r} {c!r} {h!r}" in lines
    quiet = lammps.commands(scene, dt=1e-10, seed=5, noise=False)
    assert f"pair_coeff * * sph/taitwater/morris {rho!r} {c!r} 0.001 {h!r}" in quiet
    points = np.random.default_rng(1).random((3, 3))
    lammps.write_particles(tmp_path / "x", scene, points, -points)
    text = (tmp_path / "x").read_text().splitlines()
    atoms = text.index("Atoms # sph") + 2
    assert [float(x) for x in text[atoms].split()] == [1, 1, rho, 0, 1, *points[0]]
    assert [float(x) for x in text[text.index("Velocities") + 4].split()] == [3, *-points[2]]


def test_session(fake) -> None:
    scene = bench.water(8, 2.4)
    points = np.zeros((512, 3))
    with lammps.Session(lammps.find(fake), scene, points, points, dt=1e-10) as session:
        found = session.run(2)
        assert (found.seconds, found.steps) == (0.004, 2)
        assert found.temperatures.tolist() == [296.0, 298.0]
        with pytest.raises(ChildProcessError, match="LAMMPS has stopped: ERROR: unknown command"):
            session.send("bad thing")


def test_side_by_side(fake, tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    options = ["--sizes", "512", "--supports", "2.4", "--rounds", "2", "--quick", "--no-progress"]
    arguments = ["bench", "--peer", "lammps", "--lammps", str(fake), *options]
    before = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    assert cli.main([*arguments, "-o", str(tmp_path / "out")]) == 0
    if before is not None:
        assert os.sched_getaffinity(0) == before  # no longer pinned
    shown = capsys.readouterr().out
    assert "LAMMPS (1 Jan 2026)" in shown and "297.0" in shown
    document = json.loads((tmp_path / "out" / "bench_peer.json").read_text())
    assert [row["step"] for row in document["contests"]] == list(peer.OURS)
    contest = document["contests"][0]
    # the fake takes 0.004 s for the 4 steps of a turn
    assert contest["theirs"]["median"] == pytest.approx(512 * 4 / 0.004, rel=1e-9)
    assert contest["lowest"] <= contest["ratio"]["median"] <= contest["highest"]
    codes = [row["code"] for row in document["journeys"]]
    assert codes == [
        "LAMMPS",
        "sdpd, splitting",
        "sdpd, splitting, mixed precision",
        "sdpd, Verlet",
    ]
    assert 0.0 < document["journeys"][0]["dt"] < 1e-9
    assert -0.03 < document["journeys"][1]["shear_error"] < 0.0
    assert abs(document["journeys"][1]["diffusion_error"]) < 0.03
    assert (tmp_path / "out" / "bench_peer.png").exists()


def test_error_of_a_temperature_has_a_floor() -> None:
    scene = bench.water(8, 2.4)
    span = 50.0 * scene.friction_time
    least = 300.0 * math.sqrt(2.0 / (3 * 512) / 50.0)
    still = bench.Temperature.of([300.0, 300.0, 300.0], scene, span)
    assert (still.mean, still.stderr) == (300.0, pytest.approx(least))
    moving = bench.Temperature.of([290.0, 310.0], scene, span)
    assert (moving.mean, moving.stderr) == (300.0, pytest.approx(10.0))


def test_pinned_is_one_core() -> None:
    from sdpd.bench.machine import pinned

    with pinned() as core:
        if core is not None:
            assert os.sched_getaffinity(0) == {core}


def test_edges_need_a_size() -> None:
    assert fluid.edges([3375, 32768]) == (15, 32)
    with pytest.raises(ValueError, match="at least one number of particles"):
        fluid.edges([])
    with pytest.raises(TypeError, match="`sizes` must be an integer"):
        fluid.edges([3375.0])
