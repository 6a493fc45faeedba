"""The conductivity that a fluid delivers: on the lattice, between plates, in equilibrium."""

from __future__ import annotations

import csv
import warnings
from pathlib import Path

import pytest

import sdpd
from sdpd import cli, conductivity
from sdpd.conductivity.predictions import warm_pairs

from .thermal import fluid, gas, scene


@pytest.mark.parametrize(
    ("kernel", "support"), [("lucy", 2.64), ("wendland_c2", 3.0), ("wendland_c2", 2.3)]
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_decay_is_that_of_the_lattice_sum(kernel: str, support: float, dimension: int) -> None:
    made = scene(
        box=sdpd.Box((10.0,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, support=support, kernel=kernel),
    )
    found = conductivity.decay(made)
    assert found.asked == 500.0 and found.dt == pytest.approx(sdpd.Simulation(made).dt)
    assert found.delivered == pytest.approx(found.lattice, rel=0.01)
    short = conductivity.decay(made, dt=0.05 * found.dt, steps=200)
    assert short.delivered == pytest.approx(found.lattice, rel=5e-4)
    # a long wave feels the factor of the discretisation
    long = conductivity.lattice_conductivity(made, 1e-3)
    assert long == pytest.approx(500.0 * made.factors.conductivity, rel=1e-3)


def test_decay_is_that_of_particles_at_rest_in_a_gas_too() -> None:
    """gamma = 5: a pressure that follows the temperature would make sound of half the wave."""
    made = scene(gas(25.0, dimension=2), box=sdpd.Box((10.0, 10.0)))
    found = conductivity.decay(made, steps=60)
    assert found.delivered == pytest.approx(found.lattice, rel=0.01)


def test_an_imposed_gradient_without_noise_is_the_lattice_too() -> None:
    made = scene(effects=sdpd.Effects(energy=True, fluctuations=False))
    found = conductivity.imposed_gradient(made, times=2.0, n_blocks=4)
    assert found.value == pytest.approx(500.0 * made.factors.conductivity, rel=0.01)


def test_an_imposed_gradient_with_noise() -> None:
    made = scene(fluid(200.0), start=sdpd.RandomStart(relax_steps=50))
    found = conductivity.imposed_gradient(made, difference=0.9, times=5.0)
    assert found.relative < 0.04
    # a fluid that moves delivers what the lattice does, to a few per cent
    assert abs(found.value / (2000.0 * made.factors.conductivity) - 1.0) < 0.03 + 3 * found.relative


def test_fluctuating_temperatures_conduct_more_where_conduction_grows_with_them() -> None:
    # n = 1: <T_i T_j (T_i + T_j)/2> is (1 + 1/k) T^3
    assert warm_pairs(0.0, 7.0) == pytest.approx(1.0, rel=1e-12)
    assert warm_pairs(1.0, 7.0) == pytest.approx(1.0 + 1.0 / 7.0, rel=1e-12)
    flat, steep = (scene(gas(25.0, conductivity_exponent=n)) for n in (0.0, 0.7))
    ratio = conductivity.predict(steep).conduction / conductivity.predict(flat).conduction
    assert ratio == pytest.approx(warm_pairs(0.7, 25.0), rel=1e-12)


def test_the_step_of_the_fluid_is_right_for_its_slab() -> None:
    """Its hot plate would ask for less, and a warning that nobody can heed."""
    made = scene(gas(25.0), effects=sdpd.Effects(energy=True, fluctuations=False))
    with warnings.catch_warnings():
        warnings.simplefilter("error", sdpd.TimeStepWarning)
        conductivity.imposed_gradient(made, difference=0.8, times=0.02, n_blocks=2)
        conductivity.imposed_gradient(
            made, difference=0.8, times=0.02, n_blocks=2, dt=sdpd.Simulation(made).dt
        )


def test_what_is_asked_is_that_of_the_fluid_where_it_is_calibrated() -> None:
    made = scene(calibrate=True)
    assert conductivity.decay(made).asked == made.fluid.thermal_conductivity != made.conductivity


def test_bad_arguments_are_named() -> None:
    plain = scene(effects=sdpd.Effects())
    for measure in (conductivity.decay, conductivity.imposed_gradient):
        with pytest.raises(ValueError, match="`scene` must have heat conduction"):
            measure(plain)
    with pytest.raises(ValueError, match="`difference` must be below 1"):
        conductivity.imposed_gradient(scene(), difference=1.5)
    with pytest.raises(ValueError, match="`steps` must be"):
        conductivity.decay(scene(), steps=0)
    with pytest.raises(ValueError, match="`wavenumber` must be"):
        conductivity.lattice_conductivity(scene(), -1.0)
    with pytest.raises(TypeError, match="`quick` must be True or False"):
        conductivity.run_conductivity(scene(), quick="yes")


# --- in equilibrium, and all ways together ------------------------------------------------------


@pytest.fixture(scope="module")
def study() -> conductivity.Study:
    made = scene(fluid(50.0, thermal_conductivity=100.0, dimension=2), box=sdpd.Box((12.0, 12.0)))
    return conductivity.run_conductivity(
        made, seed=2, quick=True, time_factor=0.1, threads=1, progress=False
    )


def test_parts_of_the_conductivity_are_those_of_mean_field(study: conductivity.Study) -> None:
    found, expected = study.equilibrium, study.prediction
    assert found.asked == study.asked == 100.0
    assert found.temperature.value == pytest.approx(1.0, abs=0.02)
    assert expected.friction == pytest.approx(20.0, rel=0.02)  # eta kB/m; (5/3) eta kB/m in three
    assert conductivity.predict(found.sample).convection < expected.convection  # short steps
    # the noise of conduction and friction, less what a step of two friction times takes
    assert 0.9 < found.noise.value / (expected.conduction + expected.friction) < 1.0
    friction = found.shares["friction"]
    assert abs(friction.value - expected.friction) < 0.1 * expected.friction + 4.0 * friction.stderr
    convection = found.shares["convection"]
    assert 0.5 < convection.value / expected.convection < 2.5  # an order of magnitude
    # Green-Kubo is the same data
    assert found.green_kubo.value == pytest.approx(found.helfand.value, rel=0.05)
    assert found.helfand.relative < 0.05


def test_ways_agree_and_say_so(study: conductivity.Study, tmp_path: Path) -> None:
    assert study.passed, str(study)
    text = str(study)
    for words in ("Helfand moment", "imposed gradient", "lattice decay", "PASS", "friction alone"):
        assert words in text
    paths = conductivity.write(study, tmp_path)
    table = list(csv.DictReader(paths[0].read_text().splitlines()))
    assert {row["name"] for row in table} >= {"asked", "Green-Kubo", "imposed gradient"}
    assert float(table[0]["conductivity"]) == 100.0
    pytest.importorskip("matplotlib")
    assert conductivity.write_figure(study, tmp_path).stat().st_size > 1e4


def test_what_equilibrium_cannot_measure_is_refused() -> None:
    with pytest.raises(ValueError, match="`scene` must have heat conduction"):
        conductivity.equilibrium(scene(effects=sdpd.Effects()))
    with pytest.raises(ValueError, match="`scene` must have thermal fluctuations"):
        conductivity.equilibrium(scene(effects=sdpd.Effects(energy=True, fluctuations=False)))
    with pytest.raises(ValueError, match="`scene` must have viscous heating"):
        conductivity.equilibrium(scene(effects=sdpd.Effects(energy=True, viscous_heating=False)))
    with pytest.raises(ValueError, match="`window` must ascend"):
        conductivity.equilibrium(scene(), window=(2.0, 1.0))
    with pytest.raises(ValueError, match="`steps` must be"):
        conductivity.equilibrium(scene(), steps=10)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    scene(effects=sdpd.Effects()).to_toml(path)
    assert cli.main(["conductivity", str(path)]) == 2
    assert "`scene` must have heat conduction" in capsys.readouterr().err
