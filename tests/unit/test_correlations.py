"""`sdpd correlations`: what is expected of a wave, what is fitted, and what is said of it."""

import csv
import dataclasses
import math

import numpy as np
import pytest

import sdpd
from sdpd import cli, correlations
from sdpd.analysis import Correlation
from sdpd.correlations import FUNCTIONS, Plan, plan_scene, predict, run_correlations
from sdpd.correlations.plan import check_waves
from sdpd.correlations.predictions import wave_numbers
from sdpd.correlations.recorder import FrictionSampler
from sdpd.correlations.results import assemble_shell
from sdpd.theory import FrictionTheory, HydrodynamicTheory

from .scenes import reduced_scene

FLUID = sdpd.Fluid(
    density=1.0,
    shear_viscosity=20.0,
    bulk_viscosity=10.0,
    temperature=1.0,
    boltzmann_constant=1.0,
    equation_of_state=sdpd.eos.IdealGas(),
)


def small_scene(dimension=2, edge=12, **changes):
    arguments = {
        "fluid": FLUID,
        "box": sdpd.Box((float(edge),) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="quintic_spline", support=3.0),
        "start": sdpd.RandomStart(),
        "sound_speed": 15.0,
        **changes,
    }
    return reduced_scene(dimension, **arguments)


def short_plan(**changes):
    plan = {"dt": 0.01, "equilibration": 4, "runs": 4, "steps": 24, "points": 16, "levels": 1}
    return Plan(**{**plan, **changes})


@pytest.fixture(scope="module")
def quick_study():
    return run_correlations(small_scene(), seed=3, quick=True, progress=False, threads=1)


def test_long_waves_are_hydrodynamic():
    """nu, Gamma_T = 3 nu/4 for zeta = eta/2 in 2D, and c^2 = c_eos^2 + kT/m as k h -> 0."""
    scene = small_scene()
    wave = predict(scene, 1e-3, 0.0)
    assert wave.viscosity == pytest.approx(20.0, rel=1e-5)
    assert wave.damping == pytest.approx(0.75 * 20.0, rel=1e-5)
    assert wave.sound_speed == pytest.approx(math.sqrt(15.0**2 + 1.0), rel=1e-5)
    assert wave.sum_rule == pytest.approx(1.0, rel=1e-12)
    assert not wave.overdamped
    theory = HydrodynamicTheory(
        dimension=2,
        density=1.0,
        shear_viscosity=20.0,
        bulk_viscosity=10.0,
        sound_speed=math.sqrt(226.0),
    )
    t = np.linspace(0.0, 300.0, 50)
    np.testing.assert_allclose(wave.transverse(t), theory.transverse(1e-3, t), rtol=1e-4)
    np.testing.assert_allclose(wave.density(t), theory.density_correlation(1e-3, t), rtol=1e-4)
    np.testing.assert_allclose(wave.longitudinal(t), theory.longitudinal(1e-3, t), rtol=1e-4)
    np.testing.assert_allclose(
        wave.cross(t), theory.cross_correlation(1e-3, t), rtol=1e-4, atol=1e-12
    )


def test_short_waves_have_the_rates_of_the_pair_friction():
    scene = small_scene()
    wave = predict(scene, 0.6, 0.0)
    friction = FrictionTheory(
        kernel="quintic_spline",
        dimension=2,
        support=3.0,
        density=1.0,
        shear_viscosity=20.0,
        bulk_viscosity=10.0,
    )
    across, along = friction.plane_wave_rates(0.6)
    assert wave.shear_rate == pytest.approx(float(across), rel=1e-12)
    assert wave.sound_rate == pytest.approx(0.5 * float(along), rel=1e-12)
    assert wave.viscosity < 0.97 * 20.0


@pytest.mark.parametrize("wave_number", [0.3, 0.9])
def test_functions_obey_the_equations_of_motion(wave_number):
    """The density's rate is the current, and the current's the pressure and the drag."""
    wave = predict(small_scene(sound_speed=10.0), wave_number, 0.0)
    assert wave.overdamped == (wave_number > 0.8)
    step = 1e-5 / wave.fastest_rate
    t = np.linspace(0.1, 3.0, 30) / wave.frequency

    def slope(name):
        ahead, behind = wave.function(name, t + step), wave.function(name, t - step)
        return (ahead - behind) / (2.0 * step)

    w, damping = wave.frequency, 2.0 * wave.sound_rate
    np.testing.assert_allclose(slope("density"), -w * wave.cross(t), atol=1e-6 * w)
    np.testing.assert_allclose(
        slope("cross"), w * wave.density(t) - damping * wave.cross(t), atol=1e-6 * w
    )
    np.testing.assert_allclose(
        slope("longitudinal"), -w * wave.cross(t) - damping * wave.longitudinal(t), atol=1e-5 * w
    )
    np.testing.assert_array_equal(wave.function("reversed_cross", t), wave.cross(t))


def test_a_step_weakens_friction_and_pressure():
    scene = small_scene()
    exact, stepped = (predict(scene, 0.5, dt) for dt in (0.0, 0.03))
    loss = -sdpd.timestep.expected_errors(scene, 0.03, "pair_splitting").viscosity
    assert stepped.viscosity == pytest.approx((1.0 - loss) * exact.viscosity)
    square = (exact.frequency * 0.03) ** 2
    assert stepped.structure_factor > exact.structure_factor
    assert stepped.sum_rule == pytest.approx(1.0 + square / 3.0, rel=0.01)
    assert stepped.frequency == pytest.approx(exact.frequency * (1.0 + square / 24.0), rel=1e-4)


def test_accuracy_is_that_of_the_parameters():
    wave = predict(small_scene(), 0.5, 0.0)
    t = 1.0 / wave.shear_rate
    expected = math.exp(-1.0) * wave.viscosity_accuracy
    assert wave.accuracy("transverse", t) == pytest.approx(expected, rel=0.1)
    assert wave.accuracy("density", 0.0) == 0.0
    assert wave.accuracy("cross", 0.5 * math.pi / wave.frequency) > 0.0


def test_wave_numbers_are_grouped_by_length():
    scene = small_scene(box=sdpd.Box((24.0, 12.0)))
    found = wave_numbers(scene, (1, 2))
    assert [k * 12.0 / (2.0 * math.pi) for k, _ in found] == pytest.approx([0.5, 1.0, 2.0])
    assert [group.tolist() for _, group in found] == [[[1, 0]], [[2, 0], [0, 1]], [[0, 2]]]


def test_friction_on_a_lattice_is_the_lattice_sum():
    scene = small_scene(start=sdpd.LatticeStart())
    sim = sdpd.Simulation(scene, dt=1e-3, threads=1)
    groups = [group for _, group in wave_numbers(scene, (1, 2))]
    sampler = FrictionSampler(scene, groups, every=1)
    sampler.sample(sim)
    for rates, number in zip(sampler.rates, (1, 2), strict=True):
        wave = predict(scene, 2.0 * math.pi * number / 12.0, 0.0)
        assert rates[0] == pytest.approx(wave.lattice_viscosity * wave.wave_number**2, rel=1e-9)
        assert rates[1] == pytest.approx(2.0 * wave.lattice_damping * wave.wave_number**2, rel=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_friction_in_place_is_what_the_drag_takes(dimension):
    """Against the sum over all pairs: the power of the drag in a plane wave of velocity."""
    scene = small_scene(dimension, edge=8 if dimension == 2 else 6)
    sim = sdpd.Simulation(scene, dt=1e-3, seed=4, threads=1)
    box, count = np.asarray(scene.box.lengths), scene.n_particles
    groups = [group for _, group in wave_numbers(scene, (1,))]
    sampler = FrictionSampler(scene, groups, every=1)
    sampler.sample(sim)
    gap = sim.positions[:, None] - sim.positions[None]
    gap -= box * np.rint(gap / box)
    distance = np.sqrt(np.sum(gap**2, axis=2)) + np.eye(count)
    d = sim.number_densities
    _, f = sdpd.kernels.evaluate("quintic_spline", dimension, distance, 3.0)
    g = f / np.multiply.outer(d, d) * (1.0 - np.eye(count))
    expected = np.zeros(2)
    for axis in range(dimension):
        phase = np.exp(2.0j * np.pi * sim.positions[:, axis] / box[axis])
        square = np.abs(phase[:, None] - phase[None]) ** 2 / (2.0 * count)
        for way in range(dimension):
            share = scene.friction_across + scene.friction_along * (gap[..., way] / distance) ** 2
            rate = np.sum(g * share * square) / scene.particle_mass
            if way == axis:
                expected[1] += rate / dimension
            else:
                expected[0] += rate / (dimension * (dimension - 1))
    np.testing.assert_allclose(sampler.rates[0], expected, rtol=1e-9)


def synthetic_members(wave, runs=4):
    """Functions of the theory itself, two blocks a run, and different amplitudes."""
    lag = np.linspace(0.0, 3.0 / wave.slowest_rate, 200)
    root = {"transverse": 1.0, "longitudinal": 1.0, "density": 4e-3}
    root |= dict.fromkeys(("cross", "reversed_cross"), math.sqrt(4e-3))
    members = []
    for run in range(runs):
        scale = 1.0 + 0.01 * (run - 1.5)
        members.append(
            {
                name: Correlation(
                    lag=lag,
                    blocks=np.tile(scale * root[name] * wave.function(name, lag), (2, 1)),
                    block_counts=np.ones((2, lag.size)),
                    window=(0.0, 1.0),
                )
                for name in FUNCTIONS
            }
        )
    return members


@pytest.mark.parametrize("wave_number", [0.3, 0.9])
def test_fits_return_what_was_put_in(wave_number):
    """Also where the wave is overdamped, and from a wrong guess."""
    scene = small_scene(sound_speed=10.0)
    wave = predict(scene, wave_number, 0.0)
    right = dataclasses.replace(
        wave,
        viscosity=1.13 * wave.viscosity,
        damping=0.87 * wave.damping,
        sound_speed=1.08 * wave.sound_speed,
    )
    members = synthetic_members(right)
    vectors = np.array([[1, 0], [0, 1]])
    rates = np.ones((4, 2)) * wave.shear_rate
    shell = assemble_shell(scene, vectors, members, rates, wave)
    assert shell.fit.viscosity.value == pytest.approx(right.viscosity, rel=1e-6)
    assert shell.fit.damping.value == pytest.approx(right.damping, rel=1e-5)
    assert shell.fit.sound_speed.value == pytest.approx(right.sound_speed, rel=1e-6)
    assert shell.friction[0].value == pytest.approx(wave.viscosity)
    lag, mean, error = shell.normalized("reversed_cross")
    np.testing.assert_allclose(mean, right.cross(lag), atol=1e-12)
    assert error.max() < 1e-12  # the amplitude cancels


def test_quick_study_agrees(quick_study):
    assert quick_study.passed, str(quick_study)
    assert [shell.vectors.tolist() for shell in quick_study.shells] == [
        [[1, 0], [0, 1]],
        [[2, 0], [0, 2]],
    ]
    for shell in quick_study.shells:
        assert shell.fit.sound_speed.relative < 0.06, "too few samples to see a fault"
        assert shell.fit.viscosity.relative < 0.12
        assert shell.friction[0].relative < 2e-3
    text = str(quick_study)
    assert "PASS" in text and "in place" in text and "independent runs" in text
    assert max(map(len, text.splitlines())) <= 120


def test_a_wrong_damping_would_be_seen(quick_study):
    """B 21 with 2 nu/3 and without the terms of Gamma k/c fails where the right theory passes."""
    shell = quick_study.shells[1]
    lag, mean, error = shell.normalized("longitudinal")
    wave = shell.prediction
    wrong = np.exp(-8.0 / 9.0 * wave.sound_rate * lag) * np.cos(wave.frequency * lag)
    inside = (error > 0.0) & (lag * wave.slowest_rate < 2.0)
    right = np.abs(mean - wave.longitudinal(lag))[inside] / error[inside]
    assert np.max(np.abs(mean - wrong)[inside] / error[inside]) > 8.0
    assert np.max(right) < 6.0


def test_same_seed_same_numbers():
    one, two = (
        run_correlations(
            small_scene(edge=8), seed=4, plan=short_plan(), progress=False, threads=threads
        )
        for threads in (1, 2)
    )
    assert [i.estimate.value for i in one.items] == [i.estimate.value for i in two.items]
    other = run_correlations(small_scene(edge=8), seed=5, plan=short_plan(), progress=False)
    assert other.items[0].estimate.value != one.items[0].estimate.value
    assert one.blocks == 8


def test_plan_follows_the_rates():
    scene = small_scene()
    plan, quick = plan_scene(scene), plan_scene(scene, quick=True)
    assert plan.dt == sdpd.timestep.auto_time_step(scene, "pair_splitting").value
    assert quick.total_steps < 0.4 * plan.total_steps
    wave = predict(scene, 2.0 * math.pi / 12.0, plan.dt)
    assert plan.longest_lag >= 3.0 / wave.slowest_rate
    assert plan.steps * plan.dt >= 12.0 / wave.slowest_rate
    assert plan_scene(scene, runs=2).blocks == 4
    # twice the box: waves half as fast, sound, or a quarter, friction
    assert plan_scene(small_scene(edge=24)).steps > 1.9 * plan.steps
    assert check_waves(scene, None) == (1, 2)
    assert check_waves(small_scene(edge=24), None) == (1, 2, 4)
    assert check_waves(scene, [2, 1, 2]) == (1, 2)


def test_what_has_no_linear_hydrodynamics_is_refused():
    still = small_scene(effects=sdpd.Effects(fluctuations=False))
    with pytest.raises(ValueError, match="must have thermal fluctuations"):
        run_correlations(still)
    driven = small_scene(body_force=sdpd.UniformForce((1.0, 0.0)))
    with pytest.raises(ValueError, match="must be in equilibrium, got one with a body force"):
        run_correlations(driven)
    with pytest.warns(sdpd.PairingWarning):
        pairing = small_scene(
            3,
            edge=6,
            resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.65),
            sound_speed=20.0,
        )
    with pytest.raises(ValueError, match="must be below its pairing limit, got X = 400"):
        run_correlations(pairing)
    with pytest.raises(TypeError, match="`scene` must be"):
        run_correlations("scene.toml")
    with pytest.raises(ValueError, match="`waves` must be at most 2 here"):
        run_correlations(small_scene(), waves=(1, 3))
    with pytest.raises(ValueError, match=r"`waves\[0\]`"):
        run_correlations(small_scene(), waves=(0,))
    with pytest.raises(ValueError, match="`waves` must not be empty"):
        run_correlations(small_scene(), waves=())
    with pytest.raises(ValueError, match="`runs`"):
        run_correlations(small_scene(), runs=0)
    with pytest.raises(ValueError, match="`runs` x `blocks` must be >= 8"):
        short_plan(runs=2)


def test_files_and_figure(quick_study, tmp_path):
    table, functions, text = correlations.write(quick_study, tmp_path / "new")
    with table.open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(quick_study.items)
    assert float(lines[0]["value"]) == quick_study.items[0].estimate.value
    with functions.open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    shell = quick_study.shells[0]
    lag, mean, _ = shell.normalized("transverse")
    assert [float(line["value"]) for line in lines[: lag.size]] == mean.tolist()
    assert {line["function"] for line in lines} == set(FUNCTIONS)
    assert text.read_text(encoding="utf-8") == str(quick_study) + "\n"
    pytest.importorskip("matplotlib")
    picture = correlations.write_figure(quick_study, tmp_path)
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_command(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    small_scene(edge=8).to_toml(path)
    arguments = ["correlations", str(path), "--quick", "--waves", "1", "--runs", "4"]
    code = cli.main([*arguments, "--no-progress", "-o", str(tmp_path / "out")])
    printed = capsys.readouterr().out
    assert code == 0, printed
    assert "PASS" in printed and "correlations.png" in printed
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "correlations.csv",
        "correlation_functions.csv",
        "correlations.txt",
        "correlations.png",
    }
    assert cli.main(["correlations", str(tmp_path / "none.toml")]) == 2
    assert cli.main([*arguments[:-4], "--waves", "9"]) == 2
    assert "`waves` must be at most 1 here" in capsys.readouterr().err
