"""The command `sdpd`: what each subcommand prints, writes and returns."""

import json

import pytest

import sdpd
from sdpd import cli, diffusion
from tests.unit.scenes import water_scene


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "scene.toml"
    scene = water_scene(
        box=sdpd.Box((4e-9,) * 3), resolution=sdpd.Resolution(particles=216, kernel="lucy")
    )
    scene.to_toml(path)
    return path


def test_version(capsys):
    assert cli.main(["version"]) == 0
    assert capsys.readouterr().out == f"sdpd {sdpd.__version__}\n"


def test_kernels(capsys):
    assert cli.main(["kernels", "--dimension", "2"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("2D")
    assert all(name in shown for name in sdpd.kernels.names())


def test_regime(scene_file, capsys):
    assert cli.main(["regime", str(scene_file)]) == 0
    shown = capsys.readouterr().out
    assert "water" in shown
    assert "Sc" in shown


def test_cost(scene_file, capsys):
    assert cli.main(["cost", str(scene_file), "--integrator", "velocity_verlet"]) == 0
    shown = capsys.readouterr().out
    assert "bounds on the time step" in shown
    assert "temperature accuracy" in shown


def test_run(scene_file, tmp_path, capsys):
    folder = tmp_path / "out"
    arguments = ["run", str(scene_file), "-o", str(folder), "--steps", "20", "--every", "10"]
    assert cli.main([*arguments, "--seed", "3", "--no-progress"]) == 0
    lines = (folder / "thermodynamics.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("step [1],time [s],temperature [K]")
    assert len(lines) == 3
    assert sdpd.h5md.read(folder / "trajectory.h5md").step.tolist() == [0, 10, 20]
    assert sdpd.load(folder / "final.sdpd").step == 20
    assert "written:" in capsys.readouterr().out
    assert cli.main([*arguments, "--no-progress"]) == 2  # does not overwrite
    assert "trajectory.h5md" in capsys.readouterr().err


def test_run_needs_a_duration(scene_file, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["run", str(scene_file), "-o", str(tmp_path)])
    assert stopped.value.code == 2
    assert "--steps --time" in capsys.readouterr().err


DIFFUSION = ["diffusion", "--quick", "--cases", "3", "--processes", "1", "--no-progress"]


def test_diffusion(tmp_path, capsys):
    assert cli.main([*DIFFUSION, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr()
    assert "PASS" in shown.out
    assert "too low by a factor of 2.70" in shown.out
    assert shown.err == ""
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "diffusion.csv",
        "diffusion.json",
        "diffusion.txt",
        "diffusion.png",
        "schmidt.png",
    }
    summary = json.loads((tmp_path / "diffusion.json").read_text(encoding="utf-8"))
    assert [case["case"] for case in summary["cases"]] == [3]


def test_diffusion_fails_with_status_1(monkeypatch, capsys):
    limits = diffusion.Limits(short_error=1e-6)
    monkeypatch.setattr("sdpd.diffusion.study.QUICK_LIMITS", limits)
    assert cli.main(DIFFUSION) == 1
    assert "FAIL:\n  water case 3: short-time D from the VACF" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["diffusion", "--cases", "11"], "`cases` must be among"),
        (["diffusion", "--cases", "1", "--full"], "exclude each other"),
        (["diffusion", "--core-minutes", "-1"], "`core_minutes` must be finite and > 0"),
        (["regime", "missing.toml"], "missing.toml"),
    ],
)
def test_bad_arguments_return_2_without_a_traceback(arguments, said, capsys):
    assert cli.main(arguments) == 2
    shown = capsys.readouterr().err
    assert shown.startswith(f"sdpd {arguments[0]}: ")
    assert said in shown


def test_numbers_that_are_none(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["diffusion", "--cases", "1,x"])
    assert stopped.value.code == 2
    assert "expected numbers like 1,3,5, got '1,x'" in capsys.readouterr().err


def test_warnings_are_one_line(scene_file, capsys):
    arguments = [*DIFFUSION[:4], "--eos", "ideal_gas", "--sound-ratio", "20", "--processes", "0"]
    assert cli.main(arguments) == 2
    assert "sdpd: PairingWarning: particles will clump" in capsys.readouterr().err


def test_a_run_that_blows_up_returns_1(monkeypatch, capsys):
    def blow_up(**_):
        raise sdpd.SimulationError("step 3: particle 7 ran away")

    monkeypatch.setattr("sdpd.diffusion.run_study", blow_up)
    assert cli.main(DIFFUSION) == 1
    assert "the run blew up: step 3" in capsys.readouterr().err


def test_interruption_returns_130(monkeypatch, capsys):
    def interrupt(**_):
        raise KeyboardInterrupt

    monkeypatch.setattr("sdpd.diffusion.run_study", interrupt)
    assert cli.main(DIFFUSION) == 130
    assert capsys.readouterr().err == "sdpd diffusion: interrupted\n"
