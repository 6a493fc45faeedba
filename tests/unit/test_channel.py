"""`sdpd channel`: transient flow between plates, its table, files and verdict."""

import math

import numpy as np
import pytest

from sdpd import channel, cli
from sdpd.theory import couette_velocity, poiseuille_velocity


def test_moments_hold_the_closed_forms():
    for kind in channel.KINDS:
        study = channel.run_channel(kind, times=(0.01, 0.02), quick=True, progress=False)
        assert study.scene.resolution.particles == (20, 6, 20)
        assert [moment.time for moment in study.moments] == pytest.approx([0.01, 0.02])
        assert study.largest_velocity == pytest.approx(1.25e-5, rel=1e-9)
        moment = study.moments[1]
        options = {"kinematic_viscosity": 1e-6, "width": 1e-3}
        if kind == "poiseuille":
            exact = poiseuille_velocity(moment.z, 0.02, acceleration=1e-4, **options)
        else:
            exact = couette_velocity(moment.z, 0.02, wall_velocity=1.25e-5, **options)
        assert moment.expected == pytest.approx(exact, rel=1e-9, abs=1e-14)
        rms, largest = study.errors(moment)
        assert rms == pytest.approx(np.sqrt(np.mean((moment.velocity - exact) ** 2)) / 1.25e-5)
        assert rms < largest < 0.03
        assert study.passed is (max(study.errors(m)[0] for m in study.moments) < 0.01)


def test_times_must_increase():
    with pytest.raises(ValueError, match="`kind` must be one of 'poiseuille', 'couette'"):
        channel.run_channel("pipe")
    for times in ((), (0.2, 0.1), (0.0, 1.0)):
        with pytest.raises(ValueError, match="`times` must be > 0 and increase"):
            channel.run_channel(times=times)


def test_command_writes_table_and_figure(tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(
        channel.run_channel,
        "__kwdefaults__",
        {**channel.run_channel.__kwdefaults__, "times": (0.005, 0.01)},
    )
    options = ["--quick", "--no-progress", "--threads", "1", "-o", str(tmp_path)]
    assert cli.main(["channel", "poiseuille", *options]) == 0
    shown = capsys.readouterr().out
    assert "Poiseuille flow from rest: 2400 particles" in shown
    assert "rms errors are below 1%" in shown
    assert (tmp_path / "poiseuille.png").stat().st_size > 10_000
    assert (tmp_path / "poiseuille.txt").read_text(encoding="utf-8").strip() in shown
    table = np.genfromtxt(tmp_path / "poiseuille.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time", "z", "velocity", "closed_form")
    assert len(table) == 2 * 2400
    steady = math.sqrt(np.mean((table["velocity"] - table["closed_form"]) ** 2)) / 1.25e-5
    assert steady < 0.01
