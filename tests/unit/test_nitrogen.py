"""The table of nitrogen at equilibrium: its data, its predictions, a case, its files."""

from __future__ import annotations

import csv
import math

import pytest

import sdpd
from sdpd import nitrogen
from sdpd.cli import main


def test_the_cases_are_those_of_the_tables() -> None:
    assert sorted(nitrogen.CASES) == list(range(1, 21))
    for case in nitrogen.CASES.values():
        # the spacing is the edge over 15, 3375 particles
        assert case.edge / case.spacing == pytest.approx(15.0, rel=0.003)
        # thermal speeds of the mass of a particle
        mass = 1.184 * case.spacing**3
        speed = math.sqrt(3.0 * 1.380649e-23 * 300.0 / mass)
        assert case.speed == pytest.approx(speed, rel=0.1)
        # three velocities of variance kT/m each, over 3375 as printed
        assert 3375 * case.velocity_variance == pytest.approx(speed**2, rel=0.1)


def test_a_case_meets_what_is_exact() -> None:
    study = nitrogen.run_nitrogen([1], quick=True, threads=1)
    assert study.passed
    found = study.cases[0]
    assert abs(found.energy_change) < 1e-12
    rows = {row.name: row for row in found.rows}
    molecules = found.scene.particle_mass / sdpd.fluids.nitrogen().molecular_mass
    assert rows["Var T"].expected == pytest.approx(300.0**2 / (2.5 * molecules), rel=0.005)
    assert rows["Var V"].expected == pytest.approx(
        3 * 1.380649e-23 * 300.0 / found.scene.particle_mass, rel=1e-3
    )
    # C = 3/2 N k_B of the dissertation makes its variance of T larger by 5/3
    assert rows["Var T"].published / rows["Var T"].expected == pytest.approx(5 / 3, rel=0.03)
    # the random-phase estimate is 15 % off at this support
    assert rows["Var rho"].measured.value == pytest.approx(rows["Var rho"].expected, rel=0.25)
    assert not rows["Var rho"].judged
    assert "gamma = 1.400" in str(study)


def test_files_and_figure(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    options = ["--cases", "5", "--quick", "--heat-capacity", "1.5", "--particles", "216"]
    assert main(["nitrogen", *options, "-o", str(tmp_path)]) in (0, 1)  # too few to judge by
    assert "energy held to" in capsys.readouterr().out
    with (tmp_path / "nitrogen.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8 and {row["case"] for row in rows} == {"5"}
    variance = next(row for row in rows if row["quantity"] == "Var T")
    # with its heat capacity the dissertation's variance of T comes out
    assert float(variance["measured"]) == pytest.approx(float(variance["published"]), rel=0.04)
    assert (tmp_path / "nitrogen.png").exists() and (tmp_path / "nitrogen.txt").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cases": [21]}, "`cases` must be"),
        ({"cases": []}, "`cases` must name at least one"),
        ({"cases": [1], "kernel": "gauss"}, "`kernel` must be one of"),
        ({"cases": [1], "heat_capacity": -1.0}, "`heat_capacity` must be"),
        ({"cases": [1], "particles": 2}, "`particles` must be"),
    ],
)
def test_bad_arguments_are_named(arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        nitrogen.run_nitrogen(**arguments)
