"""The table of nitrogen at equilibrium: its data, its predictions, a case, its files."""

from __future__ import annotations

import csv
import dataclasses
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


@pytest.fixture(scope="module")
def study() -> nitrogen.Study:
    return nitrogen.run_nitrogen([1], quick=True, threads=1)


def test_a_case_meets_what_is_exact(study: nitrogen.Study) -> None:
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
    # the random-phase estimate is 15 % off at this support, and says so
    assert rows["Var rho"].measured.value == pytest.approx(rows["Var rho"].expected, rel=0.25)
    assert rows["Var rho"].judged
    assert 0.1 < rows["Var rho"].accuracy / rows["Var rho"].expected < 0.3
    # pressure and density of a gas: R T apart, and thermal speeds of k_B T/m
    assert rows["P"].judged and rows["P"].measured.relative < 1e-4
    assert rows["P"].expected == pytest.approx(296.8 * 300.0 * rows["rho"].measured.value, rel=1e-3)
    assert rows["c_rms"].measured.value ** 2 == pytest.approx(
        rows["Var V"].measured.value, rel=1e-3
    )
    assert rows["rho"].measured.value == pytest.approx(rows["rho"].expected, rel=0.015)
    assert sum(row.judged for row in found.rows) == 12
    assert "gamma = 1.400" in str(study) and "lags of D long of" in str(study)
    assert "12 predictions were met: |t| < 4 beyond their accuracy" in str(study)
    assert [row.name for row in found.rows if row.rough] == ["Var rho"]
    assert "accuracy above 10%, which guard against gross faults only: 1\n" in str(study)
    assert not found.pairs and found.paired == 0.0


def test_transport_of_a_case(study: nitrogen.Study) -> None:
    found = study.cases[0]
    rows = {row.name: row for row in found.rows}
    transport = found.transport
    assert transport is not None
    # slope of the VACF against the friction on the particles, which is exact
    assert transport.short.relative < 0.03 and transport.exact.relative < 1e-3
    assert abs(transport.short.z(transport.exact)) < 4.0
    # 3D, zeta = 0: k_BT/m over the friction of the lattice; a fluid of these particles is rougher
    scene = found.scene
    lattice = scene.self_diffusion_continuum / scene.factors.friction
    assert transport.exact.value == pytest.approx(lattice, rel=0.02)
    # cages: less than at short times, but not by half at these lags
    assert 0.5 < transport.long.value / transport.exact.value < 1.0
    assert transport.long.relative < 0.05
    assert rows["eta"].measured.relative < 0.03 and rows["eta"].judged
    assert rows["eta"].measured.value == pytest.approx(transport.expected_viscosity, rel=0.1)
    assert rows["eta"].accuracy == pytest.approx(transport.viscosity_accuracy)
    # the asked ones, less what few neighbours and the time step cost
    assert transport.lattice_viscosity == pytest.approx(0.917 * 1.79e-5, rel=0.01)
    assert found.conducts
    assert transport.lattice_conductivity / transport.lattice_sum < 1.0
    # a flux of heat whose noise is known pair by pair
    assert transport.conductivity.relative < 0.02
    assert rows["kappa"].measured.value == pytest.approx(rows["kappa"].expected, rel=0.07)


def test_a_row_counts_what_is_beyond_its_accuracy() -> None:
    measured = sdpd.analysis.Estimate(1.10, 0.006, 32)

    def row(**changes) -> nitrogen.Row:
        return nitrogen.Row("x", "1", measured, 1.0, None, True, **changes)

    assert row().t == pytest.approx(0.1 / 0.006) and not row().passed
    assert row(accuracy=0.08).t == pytest.approx(0.02 / 0.006) and row(accuracy=0.08).passed
    assert row(accuracy=0.2).t == 0.0
    assert row(expected_stderr=0.008).t == pytest.approx(0.1 / 0.01)
    assert not row(accuracy=0.2, largest_error=0.005).passed  # too coarse to tell


def test_a_stress_of_which_there_is_no_theory_is_not_judged() -> None:
    """Case 9: stiff particles, m c^2/kT = 7553."""
    case = nitrogen.CASES[9]
    scene = nitrogen.scene_of(case, kernel="wendland_c2", heat_capacity=2.5, particles=None)
    plan = nitrogen.Plan(equilibration=50, steps=5, stretches=2, starts=2, largest_error=0.5)
    found = nitrogen.measure(case, scene, plan, seed=1, threads=1)
    rows = {row.name: row for row in found.rows}
    assert found.transport is not None and not found.transport.stress_known
    assert not rows["eta"].judged and rows["kappa"].judged
    # the lattice is giving way: waves have no viscosity yet
    assert found.transport.moved < 0.1 and not found.transport.flows
    assert rows["T wave"].judged and not rows["eta wave"].judged
    assert rows["eta wave"].relative > rows["eta wave"].measured.relative
    assert math.isnan(rows["D long"].expected)  # cages take too much for a mean field
    text = str(nitrogen.Study((found,), 0.0))
    assert "case 9: eta is reported, not judged: the mean field" in text
    assert "case 9: no viscosity at this time scale, eta wave is not judged" in text


def test_figures_of_transport(study: nitrogen.Study, tmp_path) -> None:
    pytest.importorskip("matplotlib")
    assert nitrogen.write_figure(study, tmp_path).exists()
    bare = nitrogen.Study((dataclasses.replace(study.cases[0], transport=None),), 0.0)
    with pytest.raises(ValueError, match="`study` must have transport coefficients"):
        nitrogen.plot_transport(bare)


def test_particles_that_pair_are_told() -> None:
    """Case 6 with the published kernel: m c^2/kT = 1258 where 287 is the limit."""
    case = nitrogen.CASES[6]
    start = sdpd.RandomStart(relax_steps=20)
    scene = nitrogen.scene_of(case, kernel="lucy", heat_capacity=2.5, particles=216, start=start)
    plan = nitrogen.Plan(equilibration=400, steps=5, stretches=0)
    found = nitrogen.measure(case, scene, plan, seed=1, threads=1)
    assert found.paired > 0.1 and found.pairs and found.transport is None
    rows = {row.name: row for row in found.rows}
    assert math.isnan(rows["rho"].expected) and math.isnan(rows["Var rho"].expected)
    text = str(nitrogen.Study((found,), 0.0))
    assert f"particles pair, {found.paired:.0%} have another one within half a spacing" in text


def test_files_and_figure(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    options = ["--cases", "5", "--quick", "--heat-capacity", "1.5", "--particles", "216"]
    options.append("--no-transport")
    assert main(["nitrogen", *options, "-o", str(tmp_path)]) in (0, 1)  # too few to judge by
    assert "energy held to" in capsys.readouterr().out
    with (tmp_path / "nitrogen.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9 and {row["case"] for row in rows} == {"5"}
    variance = next(row for row in rows if row["quantity"] == "Var T")
    # with its heat capacity the dissertation's variance of T comes out
    assert float(variance["measured"]) == pytest.approx(float(variance["published"]), rel=0.04)
    assert (tmp_path / "nitrogen.png").exists() and (tmp_path / "nitrogen.txt").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cases": [21]}, "`cases` must be"),
        ({"cases": []}, "`cases` must name at least one"),
        ({"cases": 5}, "`cases` must be a sequence"),
        ({"cases": [1], "kernel": "gauss"}, "`kernel` must be one of"),
        ({"cases": [1], "heat_capacity": -1.0}, "`heat_capacity` must be"),
        ({"cases": [1], "particles": 2}, "`particles` must be"),
    ],
)
def test_bad_arguments_are_named(arguments, message) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        nitrogen.run_nitrogen(**arguments)


def test_all_cases_or_some(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["nitrogen", "--all", "--cases", "1"])
    assert "not allowed with argument" in capsys.readouterr().err
