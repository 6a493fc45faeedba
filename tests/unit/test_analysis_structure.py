"""Structure in real space: independent points, brute force, MDAnalysis, a known random field."""

import numpy as np
import pytest

from sdpd import analysis, theory

BOX3 = np.array([6.0, 7.0, 8.0])
BOX2 = np.array([6.0, 7.0])


def poisson(rows, count, box, seed):
    return np.random.default_rng(seed).uniform(0.0, 1.0, size=(rows, count, len(box))) * box


def brute_distances(position, box):
    separation = position[:, None] - position[None]
    separation -= box * np.round(separation / box)
    return np.sqrt(np.sum(separation**2, axis=2))


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_independent_points_have_g_of_one(box):
    g = analysis.radial_distribution(poisson(200, 150, box, 31), box, bins=10)
    p = [g.at(k).p(1.0) for k in range(10)]
    assert analysis.bonferroni(p).smallest > 1e-3
    assert g.stderr[-1] < 0.01
    assert g.window == (0.0, 199.0)


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_histogram_equals_brute_force(box):
    position = poisson(3, 60, box, 32) + 40.0 * box  # wrapping is ours
    limits = np.array([0.1, 0.5, 1.3, 2.9])
    g = analysis.radial_distribution(position, box, bins=limits)
    volume = np.diff(limits ** len(box)) * (np.pi if len(box) == 2 else 4.0 * np.pi / 3.0)
    for frame in range(3):
        distance = brute_distances(position[frame], box)[~np.eye(60, dtype=bool)]
        expected = np.histogram(distance, limits)[0] / (60 * 59 * volume / np.prod(box))
        assert g.blocks[frame] == pytest.approx(expected)


def test_one_frame_has_a_value_and_no_error():
    g = analysis.radial_distribution(poisson(1, 60, BOX3, 33)[0], BOX3, bins=5)
    assert np.isfinite(g.mean).all()
    assert np.isnan(g.stderr).all()


def test_many_particles_are_taken_in_pieces(monkeypatch):
    from sdpd.analysis import structure

    position = poisson(2, 200, BOX3, 34)
    whole = analysis.radial_distribution(position, BOX3, bins=7)
    monkeypatch.setattr(structure, "_CHUNK", 1000)
    assert analysis.radial_distribution(position, BOX3, bins=7).mean == pytest.approx(whole.mean)


def test_agrees_with_mdanalysis():
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.analysis.rdf import InterRDF
    from MDAnalysis.coordinates.memory import MemoryReader

    position = poisson(5, 120, BOX3, 35).astype(np.float32)
    universe = mda.Universe.empty(120, trajectory=True)
    cell = np.array([*BOX3, 90.0, 90.0, 90.0], dtype=np.float32)
    universe.load_new(position, format=MemoryReader, order="fac", dimensions=cell)
    theirs = InterRDF(
        universe.atoms, universe.atoms, nbins=20, range=(0.0, 3.0), exclusion_block=(1, 1)
    ).run()
    ours = analysis.radial_distribution(position, BOX3, bins=20)
    assert ours.mean == pytest.approx(theirs.results.rdf, rel=1e-6)


def test_velocities_are_correlated_only_with_themselves():
    generator = np.random.default_rng(36)
    position = poisson(150, 100, BOX3, 37)
    velocity = generator.normal(size=position.shape)
    c = analysis.spatial_correlation(position, BOX3, velocity, bins=6)
    assert abs(c.local.z(1.0)) < 4.0
    assert c.local.relative < 0.02
    p = [c.at(k).p(0.0) for k in range(6)]
    assert analysis.bonferroni(p).smallest > 1e-3


def test_zero_total_momentum_is_shared_by_all_pairs():
    generator = np.random.default_rng(38)
    box = np.array([4.0, 4.0])
    position = poisson(400, 20, box, 39)
    velocity = generator.normal(size=position.shape)
    velocity -= velocity.mean(axis=1, keepdims=True)
    c = analysis.spatial_correlation(position, box, velocity, bins=1)
    assert abs(c.at(0).z(-c.local.value / 19.0)) < 4.0
    assert abs(c.at(0).z(0.0)) > 8.0


def test_spatial_correlation_and_semivariogram_equal_brute_force():
    generator = np.random.default_rng(40)
    position = poisson(2, 50, BOX3, 41)
    value, other = generator.normal(size=(2, 2, 50)) + 3.0
    limits = np.linspace(0.0, 3.0, 5)
    c = analysis.spatial_correlation(position, BOX3, value, other, bins=limits)
    gamma = analysis.semivariogram(position, BOX3, value, bins=limits)
    for frame in range(2):
        distance = brute_distances(position[frame], BOX3)
        np.fill_diagonal(distance, -1.0)
        product = np.outer(value[frame], other[frame])
        half = 0.5 * np.subtract.outer(value[frame], value[frame]) ** 2
        for k in range(4):
            pairs = (distance >= limits[k]) & (distance < limits[k + 1])
            assert c.blocks[frame, k] == pytest.approx(product[pairs].mean())
            assert gamma.blocks[frame, k] == pytest.approx(half[pairs].mean())
    shifted = analysis.spatial_correlation(
        position, BOX3, value + 7.0, other, bins=limits, subtract_mean=True
    )
    plain = analysis.spatial_correlation(
        position, BOX3, value - value.mean(), other - other.mean(), bins=limits
    )
    assert shifted.mean == pytest.approx(plain.mean)


def test_semivariogram_of_a_spherical_field_gives_back_its_range_and_sill():
    generator = np.random.default_rng(42)
    box, reach, sill = np.array([10.0, 10.0]), 3.0, 2.0
    position = poisson(1, 150, box, 43)[0]
    x = np.minimum(brute_distances(position, box) / reach, 1.0)
    covariance = sill * (1.0 - 1.5 * x + 0.5 * x**3)
    value, vector = np.linalg.eigh(covariance)
    root = vector * np.sqrt(np.maximum(value, 0.0))
    field = generator.normal(size=(400, 150)) @ root.T
    frames = np.broadcast_to(position, (400, 150, 2))
    gamma = analysis.semivariogram(frames, box, field, bins=25)
    fit = analysis.fit_spherical_model(gamma)
    assert abs(fit.sill.z(sill)) < 4.0
    assert abs(fit.range.z(reach)) < 4.0
    assert fit.range.relative < 0.02
    assert fit.sill.relative < 0.02
    held = analysis.fit_spherical_model(gamma, sill=sill)
    assert held.sill.value == sill
    assert abs(held.range.z(reach)) < 4.0
    jump = analysis.fit_spherical_model(gamma, nugget=True)
    assert jump.nugget.value < 0.1
    assert fit(np.array([0.0, 99.0])) == pytest.approx([0.0, fit.sill.value])


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_counts_of_independent_points_are_binomial(box):
    position = poisson(800, 120, box, 44)
    cells = [2, 3] if len(box) == 2 else [2, 3, 1]
    variance = analysis.cell_variance(position, box, cells=cells)
    exact = theory.cell_count_variance(
        np.ones_like, box=box, cell=box / cells, n_particles=120, max_wave_number=4.0
    )
    assert exact == pytest.approx(120 / 6 * 5 / 6)
    assert abs(variance.z(exact)) < 4.0
    assert variance.relative < 0.05


def test_cell_momentum_of_free_particles():
    generator = np.random.default_rng(45)
    position = poisson(600, 100, BOX2, 46)
    velocity = generator.normal(size=position.shape)
    variance = analysis.cell_variance(position, BOX2, cells=(2, 2), value=velocity)
    # about the mean of the four cells, not about zero: E[sum^2/4] (1 - 1/4)
    assert abs(variance.z(25.0 * 0.75)) < 4.0
    assert variance.relative < 0.05


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda p: analysis.radial_distribution(p, (6.0, 7.0)), ValueError, "`box` must have 3"),
        (lambda p: analysis.radial_distribution(p, (6.0, -7.0, 8.0)), ValueError, "`box` must be"),
        (
            lambda p: analysis.radial_distribution(p, BOX3, max_distance=3.1),
            ValueError,
            "half the shortest box edge, 3",
        ),
        (lambda p: analysis.radial_distribution(p, BOX3, bins=0), ValueError, "`bins` must"),
        (lambda p: analysis.radial_distribution(p, BOX3, bins=[1, 0]), ValueError, "`bins` must"),
        (lambda p: analysis.radial_distribution(p[:, :1], BOX3), ValueError, "at least 2 part"),
        (
            lambda p: analysis.spatial_correlation(p, BOX3, np.ones((2, 9))),
            ValueError,
            "`first` must start with shape",
        ),
        (lambda p: analysis.semivariogram(p, BOX3, p), ValueError, "one number per particle"),
        (lambda p: analysis.cell_variance(p, BOX3, cells=(2, 2)), ValueError, "`cells` must"),
        (lambda p: analysis.cell_variance(p, BOX3, cells=(2, 2, 1)), ValueError, "`n_blocks`"),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call(poisson(2, 10, BOX3, 47))
