"""Fields on fixed bins: brute force, independent particles, a known profile."""

import numpy as np
import pytest

from sdpd import analysis, theory

BOX2, BOX3 = np.array([6.0, 8.0]), np.array([6.0, 4.0, 8.0])


def poisson(rows, count, box, seed):
    return np.random.default_rng(seed).uniform(0.0, 1.0, size=(rows, count, len(box))) * box


@pytest.mark.parametrize(("box", "cells"), [(BOX2, (3, 4)), (BOX3, (3, 2, 4))], ids=["2D", "3D"])
def test_correlation_equals_brute_force(box, cells):
    position = poisson(4, 50, box, 91) - 5.0 * box
    one, two = np.random.default_rng(92).normal(size=(2, 4, 50, 2))
    ours = analysis.cell_correlation(position, box, one, two, cells=cells, n_blocks=2)
    centers = np.stack(
        np.meshgrid(
            *[np.arange(n) * e / n for n, e in zip(cells, box, strict=True)], indexing="ij"
        ),
        axis=-1,
    ).reshape(-1, len(box))
    between = centers[:, None] - centers
    between -= box * np.round(between / box)
    distance = np.linalg.norm(between, axis=2)
    volume = np.prod(box / cells)
    frames = []
    for frame in range(4):
        folded = position[frame] - box * np.floor(position[frame] / box)
        index = np.ravel_multi_index(tuple((folded / box * cells).astype(int).T), cells)
        fields = np.zeros((2, len(centers), 2))
        for field, value in zip(fields, (one, two), strict=True):
            np.add.at(field, index, value[frame] / volume)
            field -= field.mean(axis=0)
        product = np.einsum("ac,bc->ab", *fields) / 2.0
        frames.append([product[np.isclose(distance, d)].mean() for d in ours.distance])
    frames = np.array(frames)
    assert ours.mean == pytest.approx(frames.mean(axis=0), abs=1e-12)
    assert ours.blocks[0] == pytest.approx(frames[:2].mean(axis=0), abs=1e-12)
    assert ours.distance[0] == 0.0
    assert ours.distance[-1] <= 0.5 * box.min()
    for d, number in zip(ours.distance, ours.n_offsets, strict=True):
        assert np.isclose(distance[0], d).sum() == number


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_momentum_is_a_delta_in_space(box):
    position = poisson(600, 90, box, 93)
    momentum = 2.0 * np.random.default_rng(94).normal(size=position.shape)
    cells = (6, 8) if len(box) == 2 else (3, 2, 4)
    c = analysis.cell_correlation(position, box, momentum, cells=cells)
    total, volume = np.prod(cells), np.prod(box)
    local = 4.0 * 90 / volume * (total / volume) * (1.0 - 1.0 / total)
    p = [c.at(0).p(local)]
    p += [c.at(k).p(-local / (total - 1.0)) for k in range(1, c.distance.size)]
    assert analysis.bonferroni(p).smallest > 1e-3
    assert c.at(0).relative < 0.02
    assert c.stderr[1:].max() < 0.02 * local


def test_density_and_momentum_are_not_correlated():
    position = poisson(400, 60, BOX2, 95)
    momentum = np.random.default_rng(96).normal(size=(400, 60))
    c = analysis.cell_correlation(position, BOX2, np.ones((400, 60)), momentum, cells=(3, 4))
    assert analysis.bonferroni([c.at(k).p(0.0) for k in range(c.distance.size)]).smallest > 1e-3
    density = analysis.cell_correlation(position, BOX2, cells=(3, 4))
    variance = theory.cell_count_variance(
        np.ones_like, box=BOX2, cell=(2.0, 2.0), n_particles=60, max_wave_number=3.0
    )
    assert abs(density.at(0).z(variance / 4.0**2)) < 4.0
    assert density.at(0).relative < 0.03


def test_profile_of_density_and_velocity():
    generator = np.random.default_rng(97)
    height = BOX3[2] * generator.beta(2.0, 1.0, size=(400, 80))  # density 2 z/L
    position = poisson(400, 80, BOX3, 98)
    position[..., 2] = height + 3.0 * BOX3[2]
    velocity = 0.5 * height + generator.normal(size=(400, 80))
    limits = np.array([0.0, 2.0, 4.0, 5.0, 8.0])
    density = analysis.local_profile(position, axis=2, bins=limits, box=BOX3)
    exact = 80 * np.diff((limits / 8.0) ** 2) / (24.0 * np.diff(limits))
    flow = analysis.local_profile(position, velocity, axis=2, bins=limits, box=BOX3)
    mean = 0.5 * 2.0 / 3.0 * np.diff(limits**3) / np.diff(limits**2)
    p = [density.at(k).p(exact[k]) for k in range(4)] + [flow.at(k).p(mean[k]) for k in range(4)]
    assert analysis.bonferroni(p).smallest > 1e-3
    assert (density.stderr / density.mean)[1:].max() < 0.02
    assert flow.stderr.max() < 0.05
    one = analysis.local_profile(position[0], velocity[0], axis=2, bins=2, box=BOX3)
    upper = (height[0] >= 4.0) & (height[0] < 8.0)
    assert one.mean[1] == pytest.approx(velocity[0, upper].mean())


def test_profile_counts_a_particle_at_the_edge_once():
    position = np.array([[[0.0, 0.0], [6.0, 0.0], [-1e-20, 0.0]]])
    density = analysis.local_profile(position, axis=0, bins=3, box=BOX2)
    assert density.mean * 16.0 == pytest.approx([3.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p: analysis.local_profile(p, axis=2, bins=3, box=BOX2), "`axis` must be between"),
        (
            lambda p: analysis.local_profile(p, axis=0, bins=[0, 7], box=BOX2),
            "`bins` must lie betw",
        ),
        (lambda p: analysis.local_profile(p, p, axis=0, bins=3, box=BOX2), "one number per partic"),
        (
            lambda p: analysis.local_profile(p, p[:1, :, 0], axis=0, bins=3, box=BOX2),
            "`value` must start with shape",
        ),
        (lambda p: analysis.cell_correlation(p, BOX2, cells=(1, 1)), "`cells` must be 2 counts"),
        (
            lambda p: analysis.cell_correlation(p, BOX2, p, p[..., 0], cells=(2, 1)),
            "`second` must have the shape of `first`",
        ),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call(poisson(2, 10, BOX2, 99))
