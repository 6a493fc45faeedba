"""`sdpd fluctuations`: what is summed, what is expected, and what is said of it."""

import csv
import dataclasses

import numpy as np
import pytest

import sdpd
from sdpd import cli, fluctuations
from sdpd.analysis import Estimate, cell_variance, structure_factor
from sdpd.fluctuations import DensityPrediction, Item, Plan, Sampler, judge, run_fluctuations
from sdpd.theory import DensityTheory, cell_count_variance, kernel_transform

from .scenes import reduced_scene, water_scene

STIFF = sdpd.Fluid(
    density=1.0,
    shear_viscosity=14.0,
    temperature=1.0,
    boltzmann_constant=1.0,
    equation_of_state=sdpd.eos.IdealGas(),
)


def small_scene(dimension=2, edge=12, **changes):
    resolution = sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65)
    arguments = {
        "fluid": STIFF,
        "box": sdpd.Box((float(edge),) * dimension),
        "resolution": resolution,
        "start": sdpd.RandomStart(),
        "sound_speed": 10.0,
        **changes,
    }
    return reduced_scene(dimension, **arguments)


def short_plan(**changes):
    return Plan(
        **{"dt": 0.03, "equilibration": 4, "blocks": 8, "samples": 2, "every": 2, **changes}
    )


@pytest.fixture(scope="module")
def quick_study():
    return run_fluctuations(
        small_scene(), seed=3, quick=True, time_factor=0.3, progress=False, threads=1
    )


class Frames(sdpd.Observer):
    """Everything a sampler sees, kept."""

    def __init__(self, **options):
        super().__init__(**options)
        self.frames = []

    def sample(self, sim):
        self.frames.append(
            (sim.positions.copy(), sim.velocities.copy(), sim.number_densities.copy())
        )


@pytest.mark.parametrize("dimension", [2, 3])
def test_sums_are_those_of_the_trajectory(dimension):
    """Against `sdpd.analysis` and plain NumPy on the same frames."""
    scene = small_scene(dimension, edge=8 if dimension == 2 else 6)
    sim = sdpd.Simulation(scene, dt=0.01, seed=2, threads=1)
    sampler, frames = Sampler(scene, samples=2, every=3), Frames(every=3)
    sim.run(steps=48, observe=[sampler, frames], progress=False)
    r, v, d = (np.stack(part) for part in zip(*frames.frames, strict=True))
    table, number = sampler.table, scene.n_particles
    assert len(table["square"]) == 8

    square = table["square"].mean(axis=0)
    assert square == pytest.approx(np.sum(v**2, axis=(0, 1)) / len(v) / (number - 1), rel=1e-12)
    reference = structure_factor(
        r, scene.box.lengths, max_wave_number=float(sampler.wave_number[-1])
    )
    np.testing.assert_allclose(reference.wave_number, sampler.wave_number, rtol=1e-12)
    np.testing.assert_allclose(table["structure"].mean(axis=0), reference.mean, rtol=1e-10)
    counted = cell_variance(r, scene.box.lengths, cells=(2,) * dimension, n_blocks=8)
    assert table["cells_2"][:, 0].mean() == pytest.approx(counted.value, rel=1e-12)
    assert table["density"][:, 0].mean() == pytest.approx(d.mean(), rel=1e-12)
    assert sampler.histogram.sum() == v.size

    gap = r[0][:, None] - r[0][None]
    gap -= np.asarray(scene.box.lengths) * np.rint(gap / np.asarray(scene.box.lengths))
    distance = np.sqrt(np.sum(gap**2, axis=2))[np.triu_indices(number, 1)]
    product = (v[0] @ v[0].T)[np.triu_indices(number, 1)] / dimension
    # pairs are summed in the first sample of each block, and divided by the samples of a block
    counts = np.histogram(distance, sampler.distance_edges)[0]
    sums = np.histogram(distance, sampler.distance_edges, weights=product)[0]
    np.testing.assert_allclose(table["pairs"][0, 1], counts / 2.0)
    np.testing.assert_allclose(table["pairs"][0, 0], sums / 2.0, atol=1e-10)


def test_currents_of_a_plane_wave():
    """All momentum in one mode: along k only the longitudinal current sees it."""
    scene = small_scene(edge=8)
    sim = sdpd.Simulation(scene, dt=0.01, seed=2, threads=1)
    sim.velocities[...] = 0.0
    sim.velocities[:, 0] = np.cos(2.0 * np.pi * sim.positions[:, 0] / 8.0)
    sim.refresh()
    sampler = Sampler(scene, samples=1)
    sampler.sample(sim)
    along, across = sampler.table["longitudinal"][0], sampler.table["transverse"][0]
    # of the two vectors of the first shell one is along the wave: |j_k|^2/N = N/4
    assert along[0] == pytest.approx(0.5 * scene.n_particles / 4.0, rel=0.1)
    assert across[0] < 0.1 * along[0]


def test_prediction_without_a_step_is_the_theory():
    scene = small_scene(3, edge=6)
    plain, stepped = DensityPrediction(scene, 0.0), DensityPrediction(scene, 0.03)
    theory = DensityTheory(
        kernel="wendland_c2",
        dimension=3,
        support=2.65,
        number_density=1.0,
        stiffness=100.0,
        compressibility_factor=100.0,
    )
    missing = float(theory.structure_factor(0.0)) / 216
    assert plain.variance == pytest.approx(theory.variance() - missing, rel=1e-12)
    assert plain.bias == pytest.approx(theory.bias() - missing, rel=1e-12)
    k = np.array([0.5, 1.0, 2.0])
    np.testing.assert_allclose(plain.structure_factor(k), theory.structure_factor(k), rtol=1e-12)
    assert plain.cell_variance(2) == pytest.approx(
        cell_count_variance(
            theory.structure_factor,
            box=(6.0,) * 3,
            cell=(3.0,) * 3,
            n_particles=216,
            max_wave_number=25.0 / 2.65,
        )
    )
    response = 1.0 / theory.structure_factor(k) - 1.0
    weakened = response * (1.0 - 0.25 * response * (0.03 * k) ** 2)
    np.testing.assert_allclose(stepped.structure_factor(k), 1.0 / (1.0 + weakened), rtol=1e-12)
    # the measured slope of timestep.DENSITY_VARIANCE_SLOPE
    limit = sdpd.timestep.acoustic_limit(scene)
    slope = (stepped.variance / plain.variance - 1.0) / (0.03 / limit) ** 2
    assert slope == pytest.approx(sdpd.timestep.DENSITY_VARIANCE_SLOPE, rel=0.25)


@pytest.mark.parametrize(("kernel", "loss"), [("lucy", 0.06), ("wendland_c2", 0.03)])
def test_density_variance_is_the_sum_over_the_waves_of_the_box(kernel, loss):
    """Sum of S(k) w(kh)^2/N over k = 2 pi n/L without n = 0, where w has died out at the end."""
    resolution = sdpd.Resolution(spacing=1.0, kernel=kernel, support=2.65)
    scene = small_scene(3, edge=6, resolution=resolution)
    prediction = DensityPrediction(scene, 0.0)
    n = np.arange(-24, 25)
    square = np.sum(np.stack(np.meshgrid(n, n, n)) ** 2, axis=0).ravel()
    k = 2.0 * np.pi / 6.0 * np.sqrt(square[square > 0])
    transform = kernel_transform(kernel, 3, k * scene.support_radius)
    terms = prediction.structure_factor(k) * transform**2 / scene.n_particles
    assert prediction.variance == pytest.approx(terms.sum(), rel=1e-3)
    missing = float(prediction.structure_factor(0.0)) / scene.n_particles
    assert missing > loss * prediction.variance  # far more than the test's tolerance


def test_linear_law_has_the_pressure_of_its_mean_density():
    prediction = DensityPrediction(small_scene(), 0.0)
    assert prediction.pressure == pytest.approx(1.0 + prediction.bias, rel=1e-12)


def test_item_counts_only_what_is_beyond_its_accuracy():
    estimate = Estimate(1.10, 0.01, 32.0)
    exact = Item(group="a", name="b", estimate=estimate, prediction=1.0)
    loose = dataclasses.replace(exact, accuracy=0.08)
    inside = dataclasses.replace(exact, accuracy=0.2)
    assert exact.exact and not loose.exact
    assert exact.z == loose.z == pytest.approx(10.0)
    assert exact.p < 1e-9 < loose.p < 0.06 and inside.p == 1.0
    assert loose.p == pytest.approx(Estimate(1.02, 0.01, 32.0).p(1.0))
    assert exact.visible(4.0) == pytest.approx(0.04)
    assert loose.visible(4.0) == pytest.approx(0.12)
    assert dataclasses.replace(exact, prediction=-0.01, unit=1.0).visible(4.0) == pytest.approx(
        0.04
    )
    assert judge((exact, loose, inside)) == (False, True, True)


def test_quick_study_agrees(quick_study):
    assert quick_study.passed, str(quick_study)
    assert sum(item.exact for item in quick_study.items) > 20
    text = str(quick_study)
    assert "PASS" in text and "of the acoustic limit" in text and "0.25" in text
    assert max(map(len, text.splitlines())) <= 120


def test_a_lattice_that_has_not_melted_is_told(quick_study):
    assert 0.0 <= quick_study.stayed <= 1.0
    solid = dataclasses.replace(quick_study, stayed=0.92)
    assert "92% of the particles are within half a spacing of where they began" in str(solid)
    fluid = dataclasses.replace(quick_study, stayed=0.1)
    assert "half a spacing" not in str(fluid)


@pytest.mark.parametrize(
    ("stiffness", "support", "pressure", "shares"),
    [(100.0, 2.65, True, 2.5), (7500.0, 2.25, True, 2.5), (2500.0, 3.2, False, 7.0)],
)
def test_order_bounds_the_accuracy_of_the_density(stiffness, support, pressure, shares):
    """Of a stiff fluid the excess is small, and the random phases are not better for that."""
    resolution = sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=support)
    law = sdpd.eos.IdealGas() if pressure else sdpd.eos.ArtificialCompressibility()
    fluid = STIFF.replace(equation_of_state=law)
    speed = stiffness**0.5
    scene = small_scene(3, 10, fluid=fluid, resolution=resolution, sound_speed=speed)
    theory = DensityPrediction(scene, 0.0)
    excess = abs(theory.bias)
    assert 0.0 < theory.short_waves < 0.2
    assert theory.accuracy("variance") == pytest.approx(
        max(0.03, 12.0 * excess, shares * theory.short_waves)
    )
    ordered = abs(scene.factors.density - 1.0)
    assert theory.accuracy("mean") == pytest.approx(max(5e-4, 0.3 * excess, ordered))
    assert (shares * theory.short_waves > 12.0 * excess) == (stiffness > 1000.0)


def test_same_seed_same_numbers():
    one, two = (
        run_fluctuations(small_scene(edge=8), seed=4, plan=short_plan(), progress=False, threads=n)
        for n in (1, 2)
    )
    assert [i.estimate.value for i in one.items] == [i.estimate.value for i in two.items]
    other = run_fluctuations(small_scene(edge=8), seed=5, plan=short_plan(), progress=False)
    assert other.items[0].estimate.value != one.items[0].estimate.value


def test_units_do_not_matter():
    """The same scene in SI and in reduced units gives the same items to rounding in theory."""
    water = sdpd.fluids.water()
    fluid = dataclasses.replace(water, equation_of_state=sdpd.eos.IdealGas())
    scene = water_scene(
        fluid=fluid, resolution=sdpd.Resolution(particles=512, kernel="lucy", support=2.65)
    )
    reduced = small_scene(
        3,
        edge=8,
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.65),
    )
    assert scene.stiffness == pytest.approx(100.0, rel=1e-6)
    one, two = DensityPrediction(scene, 0.0), DensityPrediction(reduced, 0.0)
    assert one.variance == pytest.approx(two.variance, rel=1e-5)
    assert one.pressure == pytest.approx(two.pressure, rel=1e-5)
    k = np.array([1.0, 2.0])
    np.testing.assert_allclose(
        one.structure_factor(k / scene.spacing), two.structure_factor(k), rtol=1e-5
    )


def test_plan_ignores_friction_and_grows_with_the_factor():
    scene = small_scene()
    plan, longer = fluctuations.plan_scene(scene), fluctuations.plan_scene(scene, time_factor=2.0)
    assert plan.dt == pytest.approx(0.25 * sdpd.timestep.acoustic_limit(scene))
    assert longer.steps == pytest.approx(2 * plan.steps, rel=0.3)
    assert fluctuations.plan_scene(scene, quick=True).steps < 0.2 * plan.steps
    thick = small_scene(fluid=dataclasses.replace(STIFF, shear_viscosity=200.0))
    assert fluctuations.plan_scene(thick).dt == plan.dt


def test_scenes_without_such_an_equilibrium_are_refused():
    still = small_scene(effects=sdpd.Effects(fluctuations=False))
    with pytest.raises(ValueError, match="must have thermal fluctuations"):
        run_fluctuations(still)
    driven = small_scene(body_force=sdpd.UniformForce((1.0, 0.0)))
    with pytest.raises(ValueError, match="must be in equilibrium, got one with a body force"):
        run_fluctuations(driven)
    with pytest.raises(TypeError, match="`scene` must be"):
        run_fluctuations("scene.toml")
    with pytest.raises(ValueError, match="`time_factor`"):
        run_fluctuations(small_scene(), time_factor=0.0)
    with pytest.raises(ValueError, match="`blocks`"):
        short_plan(blocks=4)


def test_beyond_the_pairing_limit_the_density_is_left_out():
    with pytest.warns(sdpd.PairingWarning):
        scene = small_scene(
            3,
            edge=6,
            resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.65),
            sound_speed=20.0,
        )
    study = run_fluctuations(scene, plan=short_plan(dt=0.01), progress=False, threads=1)
    assert study.prediction is None
    assert all(item.exact for item in study.items)
    assert "beyond the pairing limit" in str(study)


def test_files_and_figure(quick_study, tmp_path):
    table, text = fluctuations.write(quick_study, tmp_path / "new")
    with table.open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(quick_study.items)
    assert float(lines[0]["value"]) == quick_study.items[0].estimate.value
    assert text.read_text(encoding="utf-8") == str(quick_study) + "\n"
    picture = fluctuations.write_figure(quick_study, tmp_path)
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_command(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    small_scene(edge=8).to_toml(path)
    arguments = ["fluctuations", str(path), "--quick", "--time-factor", "0.05", "--no-progress"]
    code = cli.main([*arguments, "-o", str(tmp_path / "out")])
    printed = capsys.readouterr().out
    assert code == 0, printed
    assert "PASS" in printed and "fluctuations.png" in printed
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "fluctuations.csv",
        "fluctuations.txt",
        "fluctuations.png",
    }
    assert cli.main(["fluctuations", str(tmp_path / "none.toml")]) == 2
