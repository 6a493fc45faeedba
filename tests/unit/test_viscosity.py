"""`sdpd viscosity`: each way alone on systems with known answers, then all of them together."""

import csv
import dataclasses
import math

import numpy as np
import pytest

import sdpd
from sdpd import cli, kernels, viscosity
from sdpd.analysis import Correlation, Estimate
from sdpd.viscosity import Arrangement, Comparison, Method, Shell, judge, run_viscosity
from sdpd.viscosity.forcing import measure_forced
from sdpd.viscosity.predictions import friction_theory
from sdpd.viscosity.results import mean_of
from sdpd.viscosity.transverse import decay_rate, excess

from .scenes import reduced_scene, water_scene

STIFF = sdpd.Fluid(
    density=1.0,
    shear_viscosity=5.0,
    temperature=1.0,
    boltzmann_constant=1.0,
    equation_of_state=sdpd.eos.IdealGas(),
)


def small_scene(dimension=2, edge=10, eta=5.0, **changes):
    arguments = {
        "fluid": STIFF.replace(shear_viscosity=eta),
        "box": sdpd.Box((float(edge),) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
        "start": sdpd.RandomStart(),
        "sound_speed": 10.0,
        **changes,
    }
    return reduced_scene(dimension, **arguments)


@pytest.fixture(scope="module")
def quick_study():
    return run_viscosity(
        small_scene(), seed=3, quick=True, time_factor=0.15, progress=False, threads=1
    )


# --- parts ------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.3, 2.0, 20.0])
def test_rate_of_an_exponential_is_exact_on_any_lags(rate):
    lag = np.concatenate([np.arange(20) * 0.05, 1.0 + 0.1 * np.arange(10), [2.5, 3.5]])
    assert decay_rate(lag, 7.0 * np.exp(-rate * lag)) == pytest.approx(rate, rel=1e-8)


def test_rate_of_a_decayed_function_is_one_over_its_integral():
    lag = np.arange(4001) * 0.005
    values = 0.5 * np.exp(-lag) + 0.5 * np.exp(-3.0 * lag)
    assert decay_rate(lag, values) == pytest.approx(1.0 / (0.5 + 0.5 / 3.0), rel=1e-4)


def test_function_that_does_not_decay_is_refused():
    with pytest.raises(ValueError, match="`values` must decay within the lags"):
        decay_rate(np.arange(5.0), np.array([1.0, -1.0, 0.5, -0.5, 0.0]))


def test_excess_weighs_by_modes_and_shape():
    function = Correlation(
        lag=np.arange(2.0), blocks=np.ones((2, 2)), block_counts=np.ones((2, 2)), window=(0.0, 1.0)
    )

    def shell(value, modes):
        leave = value + np.array([-0.01, 0.01])
        found = Estimate(value, 0.1, 2.0)
        return Shell(
            wave_number=1.0,
            n_vectors=modes,
            correlation=function,
            viscosity=found,
            leave_one_out=leave,
        )

    exact = [shell(5.0 + 2.0 * s, 2) for s in (1.0, 0.5)]
    found, _, reach = excess(exact, [5.0, 5.0], [1.0, 0.5], [7.0, 6.0])
    assert found.value == pytest.approx(2.0) and found.stderr > 0.0
    assert 0.0 < reach < 1.0
    many = [shell(7.0, 10**8), shell(6.2, 1)]
    uneven, _, reach = excess(many, [5.0, 5.0], [1.0, 0.5], [7.0, 6.0])
    assert uneven.value == pytest.approx(2.0, rel=1e-6) and reach < 1e-6


@pytest.mark.parametrize("dimension", [2, 3])
def test_arrangement_on_the_lattice_has_the_lattice_sums(dimension):
    scene = small_scene(dimension, edge=8, start=sdpd.LatticeStart(), eta=20.0)
    sim = sdpd.Simulation(scene, threads=1)
    vectors = np.eye(dimension, dtype=int)
    tiny = Arrangement(scene, wave_vectors=vectors, dt=1e-6 * scene.friction_time, every=1)
    for _ in range(2):
        tiny.sample(sim)
    lattice = scene.fluid.shear_viscosity * scene.factors.viscosity
    assert tiny.friction.value == pytest.approx(lattice, rel=1e-12)
    assert tiny.random.value == pytest.approx(lattice, rel=1e-5)
    k = 2.0 * math.pi / 8.0
    rate = friction_theory(scene).lattice_plane_wave_rate(k * vectors[0], vectors[1], spacing=1.0)
    assert tiny.wave_number.tolist() == pytest.approx([k])
    assert tiny.waves[0].value == pytest.approx(rate / k**2, rel=1e-12)


def test_arrangement_against_a_double_loop():
    scene = small_scene(edge=6, eta=3.0, fluid=STIFF.replace(bulk_viscosity=2.0))
    sim = sdpd.Simulation(scene, threads=1, seed=4)
    dt, k = 0.05, 2.0 * np.pi / 6.0 * np.array([1.0, 1.0])
    measured = Arrangement(scene, wave_vectors=np.array([[1, 1]]), dt=dt, every=1)
    measured.sample(sim)
    measured.sample(sim)
    a, b = scene.friction_across, scene.friction_along
    side = np.array([1.0, -1.0]) / np.sqrt(2.0)
    plain, noise, wave = [], [], []
    for i in range(len(sim)):
        for j in range(i):
            r = sim.positions[i] - sim.positions[j]
            r -= 6.0 * np.rint(r / 6.0)
            distance = np.linalg.norm(r)
            if distance >= scene.support_radius:
                continue
            e = r / distance
            f = kernels.evaluate("wendland_c2", 2, distance, scene.support_radius)[1]
            g = float(f) / (sim.number_densities[i] * sim.number_densities[j])
            whole = g * (a * np.eye(2) + b * np.outer(e, e))
            # two half sweeps, reduced mass 1/2: Var = (1/2)(1 - exp(-2 G (dt/2)/(1/2))) each
            values, axes = np.linalg.eigh(whole)
            variance = axes @ np.diag(1.0 - np.exp(-2.0 * values * dt)) @ axes.T
            for p, u in ((0, 1), (1, 0)):
                plain.append(0.5 * r[p] ** 2 * whole[u, u])
                noise.append(0.5 * r[p] ** 2 * variance[u, u] / (2.0 * dt))
            wave.append((side @ whole @ side) * abs(np.exp(1j * k @ r) - 1.0) ** 2 / (k @ k))
    volume = 36.0
    assert measured.friction.value == pytest.approx(sum(plain) / volume, rel=1e-10)
    assert measured.random.value == pytest.approx(sum(noise) / volume, rel=1e-10)
    assert measured.waves[0].value == pytest.approx(sum(wave) / volume, rel=1e-10)


def test_random_stress_of_the_loop_is_the_exact_one():
    """Large steps, so that friction and noise of a sweep are far from their small-step limits."""
    scene, dt = small_scene(eta=40.0), 0.03
    sim = sdpd.Simulation(scene, threads=1, seed=2, dt=scene.friction_time)
    sim.dt = sim.dt
    with pytest.warns(sdpd.TimeStepWarning):
        sim.dt = dt
    sim.run(steps=200, progress=False)
    arrangement = Arrangement(scene, wave_vectors=np.array([[1, 0]]), dt=dt, every=50)
    stress = sdpd.StressCorrelator(every=1, points=2, levels=1, parts=True)
    sim.run(steps=4000, observe=[arrangement, stress], progress=False)
    increments = stress.increments(part="random", n_blocks=32)
    found = increments.at(1).scaled(1.0 / (2.0 * stress.volume * dt))
    assert found.relative < 0.03
    assert abs(found.z(arrangement.random.value)) < 4.0
    assert arrangement.random.value < 0.8 * arrangement.friction.value


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", ["lucy", "wendland_c2"])
def test_decay_on_the_lattice(dimension, kernel):
    resolution = sdpd.Resolution(spacing=1.0, kernel=kernel, support=2.65)
    scene = small_scene(dimension, resolution=resolution)
    tau = scene.friction_time
    small, large = (viscosity.measure_lattice(scene, x * tau) for x in (0.1, 4.0))
    assert small.factor.value == pytest.approx(1.0, abs=1e-4)
    assert small.factor.relative < 1e-4
    expected = sdpd.timestep.expected_errors(scene, 4.0 * tau).viscosity
    assert large.factor.value - 1.0 == pytest.approx(expected, rel=0.3)


def test_calibrated_scene_delivers_what_was_asked_on_the_lattice():
    scene = small_scene(calibrate=True)
    dt = 0.1 * scene.friction_time
    assert viscosity.measure_lattice(scene, dt).factor.value == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("ratio", [0.2, 2.0])
def test_force_without_noise_on_a_lattice(ratio):
    """The flow settles at the lattice sum's rate, with the steps' own factor."""
    scene = small_scene(
        3,
        edge=8,
        start=sdpd.LatticeStart(velocities="zero"),
        effects=sdpd.Effects(fluctuations=False),
        sound_speed=1e-3,
    )
    dt = ratio * scene.friction_time
    k = 2.0 * math.pi / 8.0
    rate = friction_theory(scene).lattice_plane_wave_rate(
        [0.0, k, 0.0], [1.0, 0.0, 0.0], spacing=1.0
    )
    settle = math.ceil(12.0 / rate / dt)
    plan = viscosity.plan_scene(small_scene(3, edge=8), dt=dt, quick=True)
    force = sdpd.SinusoidalForce(amplitude=1e-5, direction="x", along="y")
    plan = dataclasses.replace(
        plan, equilibration=settle, forced_steps=256, forced_every=1, force=force
    )
    found, amplitude, _ = measure_forced(scene, plan, seed=1, progress=False)
    factor = viscosity.measure_lattice(scene, dt).factor.value
    assert found.value == pytest.approx(rate / k**2 * factor, rel=2e-4 if ratio < 1.0 else 2e-3)
    assert amplitude.value == pytest.approx(1e-5 / rate, rel=0.05)


# --- plan and scenes --------------------------------------------------------------------------


def test_sample_of_a_large_scene_is_a_cube_of_the_same_fluid():
    scene = water_scene(
        box=sdpd.Box((2e-8, 1e-8, 1e-8)),
        resolution=sdpd.Resolution(particles=(40, 20, 20), kernel="lucy", support=2.64),
        body_force=sdpd.UniformForce((1e9, 0.0, 0.0)),
        effects=sdpd.Effects(body_force=True),
    )
    sample = viscosity.sample_scene(scene)
    assert sample.n_particles == 1000
    assert len(set(sample.box.lengths)) == 1
    assert sample.body_force is None and not sample.active_effects.body_force
    for name in ("spacing", "particle_mass", "stiffness", "friction_time", "reduced_viscosity"):
        assert getattr(sample, name) == pytest.approx(getattr(scene, name), rel=1e-9), name
    assert viscosity.sample_scene(scene, particles=512).n_particles == 512
    walled = small_scene(
        3,
        box=sdpd.Box((10.0,) * 3, periodic="xy"),
        walls=[sdpd.Plane(axis="z", at=0.0), sdpd.Plane(axis="z", at=10.0)],
    )
    bulk = viscosity.sample_scene(walled)
    assert bulk.n_particles == 1000 and not bulk.walls
    assert bulk.box.periodic_axes == "xyz"
    assert bulk.reduced_viscosity == pytest.approx(walled.reduced_viscosity, rel=0.02)
    small = small_scene(box=sdpd.Box((10.0, 12.0)))
    assert viscosity.sample_scene(small).box == small.box


def test_plan_follows_the_work_and_the_relaxation():
    scene = small_scene()
    plan = viscosity.plan_scene(scene)
    longer = viscosity.plan_scene(scene, time_factor=2.0)
    assert longer.steps == pytest.approx(2 * plan.steps, rel=0.01)
    assert plan.dt == pytest.approx(sdpd.timestep.auto_time_step(scene).value)
    theory = viscosity.viscosity_theory(scene, plan.dt)
    first, last = plan.stress_window
    assert first == pytest.approx(theory.relaxation_time(0.05)) and last == 2.0 * first
    assert 32 * last < plan.steps * plan.dt
    thick = viscosity.plan_scene(small_scene(eta=2000.0), quick=True)
    assert 32 * thick.stress_window[1] < thick.steps * thick.dt  # cut short by the work
    force = plan.force
    assert (force.along, force.direction) == ("x", "y")
    k = plan.forced_wave_number(scene)
    flow = force.amplitude / float(friction_theory(scene).plane_wave_rates(k)[0])
    assert flow * k * theory.stress_time <= 0.1 * (1.0 + 1e-9)
    with pytest.raises(ValueError, match="`dt` must be one of 'auto'"):
        viscosity.plan_scene(scene, dt="fast")
    with pytest.raises(ValueError, match="so that steps resolve the decay of the longest wave"):
        viscosity.plan_scene(small_scene(eta=80.0), dt=0.05)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"effects": sdpd.Effects(fluctuations=False)}, "must have thermal fluctuations"),
        ({"fluid": STIFF.replace(shear_viscosity=0.0)}, "must have a shear viscosity"),
    ],
)
def test_scenes_without_such_a_viscosity_are_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        run_viscosity(small_scene(**changes))


def test_clumping_fluid_is_refused():
    with pytest.warns(sdpd.PairingWarning):
        scene = small_scene(
            3,
            edge=6,
            resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.65),
            sound_speed=18.0,
        )
    with pytest.raises(ValueError, match="within the pairing limit"):
        run_viscosity(scene)


def test_methods_of_one_run_share_their_blocks():
    """What two methods have in common drops out of their difference and stays in their mean."""
    rng = np.random.default_rng(3)
    blocks = 4000
    common, one, two = rng.normal(size=(3, blocks))

    def method(values, *, shared):
        leave = (values.sum() - values) / (blocks - 1)
        error = float(values.std(ddof=1)) / math.sqrt(blocks)
        return Method(
            name="m",
            viscosity=Estimate(float(values.mean()), error, float(blocks)),
            accuracy=0.0,
            wave_number=0.0,
            measured=Estimate(0.0, error, float(blocks)),
            leave_one_out=leave if shared else None,
        )

    a, b = method(2.0 * common + one, shared=True), method(2.0 * common + two, shared=True)
    c = method(two, shared=False)
    unit = 1.0 / math.sqrt(blocks)
    assert mean_of((a, b), (1.0, -1.0)).stderr == pytest.approx(math.sqrt(2.0) * unit, rel=0.05)
    assert mean_of((a, b), (0.5, 0.5)).stderr == pytest.approx(math.sqrt(4.5) * unit, rel=0.05)
    assert mean_of((a, c), (1.0, -1.0)).stderr == pytest.approx(math.sqrt(6.0) * unit, rel=0.05)
    assert mean_of((a, c), (0.25, 0.75)).value == pytest.approx(
        0.25 * a.viscosity.value + 0.75 * c.viscosity.value
    )


def test_comparison_counts_only_what_is_beyond_the_accuracy():
    apart = Comparison(
        first="a", second="b", difference=Estimate(0.5, 0.1, 40.0), accuracy=0.0, unit=5.0
    )
    close = dataclasses.replace(apart, accuracy=0.45)
    assert apart.z == pytest.approx(5.0) and apart.p < 1e-4 < close.p
    assert apart.visible(3.0) == pytest.approx(0.06)
    assert judge((apart, close)) == (False, True)


# --- the study --------------------------------------------------------------------------------


def test_quick_study_agrees(quick_study):
    assert quick_study.passed, str(quick_study)
    assert [m.name for m in quick_study.methods] == [
        "Helfand moment",
        "transverse currents",
        "sinusoidal force",
    ]
    assert quick_study.viscosity.relative < 0.03
    theory = quick_study.theory
    expected = quick_study.friction + theory.configurational() + theory.kinetic
    assert quick_study.viscosity.value == pytest.approx(expected, rel=0.12)
    text = str(quick_study)
    assert "PASS" in text and max(map(len, text.splitlines())) <= 110


def test_same_seed_same_numbers():
    scene = small_scene(edge=8)
    one, two = (
        run_viscosity(scene, seed=4, quick=True, time_factor=0.05, progress=False, threads=n)
        for n in (1, 2)
    )
    assert [m.viscosity for m in one.methods] == [m.viscosity for m in two.methods]


def test_files_and_figure(quick_study, tmp_path):
    paths = [*viscosity.write(quick_study, tmp_path), viscosity.write_figure(quick_study, tmp_path)]
    assert [path.name for path in paths] == ["viscosity.csv", "viscosity.txt", "viscosity.png"]
    with paths[0].open(encoding="utf-8") as file:
        table = {row["name"]: row for row in csv.DictReader(file)}
    assert float(table["asked"]["viscosity"]) == 5.0
    helfand = quick_study.methods[0].viscosity
    assert float(table["Helfand moment"]["stderr"]) == helfand.stderr


def test_command(tmp_path, capsys):
    small_scene(edge=8).to_toml(tmp_path / "scene.toml")
    arguments = ["viscosity", str(tmp_path / "scene.toml"), "--quick", "--time-factor", "0.05"]
    status = cli.main([*arguments, "--no-progress", "-o", str(tmp_path / "out")])
    shown = capsys.readouterr()
    assert status == 0, shown.out
    assert "Delivered viscosity: 64 particles in 2D" in shown.out
    assert (tmp_path / "out" / "viscosity.png").exists()
    assert cli.main([*arguments, "--dt", "-1"]) == 2
    assert "`dt` must be finite and > 0" in capsys.readouterr().err
