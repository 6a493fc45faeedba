"""Noise of velocity Verlet: pairs draw from words of their particles, and yet each on its own.

What such a scheme could get wrong is what pairs have in common: a particle, a step, a ring of
particles along which sums of words cancel. All of it is compared with independent numbers.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from sdpd import _core

Array = NDArray[np.float64]

N = 400_000
VARIATES = ("gaussian", "uniform")
# Some 250 numbers are judged in this file: 4.8 sigma is one false alarm in 2,500 runs.
SIGMAS = 4.8
LAW = {"gaussian": stats.norm(), "uniform": stats.uniform(-(3**0.5), 2 * 3**0.5)}


def draw(variate: str, a: int, b: int, step: int = 0, seed: int = 7) -> Array:
    """(N, 3) for the pairs of particle 8 n + a and 8 n + b."""
    first = 8 * np.arange(N, dtype=np.uint64)
    ends = [first + np.uint64(end) for end in (a, b)]
    return np.asarray(_core.force_variates(seed, step, ends[0], ends[1], variate, 3))


def assert_zero(products: Array, what: str) -> None:
    """Means of columns of numbers with mean 0, each with its own standard error."""
    products = products.reshape(N, -1)
    error = products.std(axis=0) / np.sqrt(N)
    z = products.mean(axis=0) / error
    assert np.all(np.abs(z) < SIGMAS), f"{what}: z = {z}"


def products(x: Array, y: Array) -> Array:
    """All products of the components of two pairs (N, 9)."""
    return (x[:, :, None] * y[:, None, :]).reshape(N, 9)


@pytest.mark.parametrize("variate", VARIATES)
def test_one_pair(variate: str) -> None:
    x, law = draw(variate, 0, 1), LAW[variate]
    assert_zero(x, "mean")
    assert_zero(x**2 - 1.0, "variance")
    assert_zero(x**4 - (3.0 + law.stats("k")), "fourth moment")
    for column in x.T:
        assert stats.kstest(column, law.cdf).pvalue > 1e-5
    both = products(x, x)[:, [1, 2, 5]]
    assert_zero(both, "components")
    squares = products(x**2 - 1.0, x**2 - 1.0)[:, [1, 2, 5]]
    assert_zero(squares, "squares of components")
    assert both.std() / np.sqrt(N) < 2e-3  # fine enough to see a correlation of one per cent


@pytest.mark.parametrize("variate", VARIATES)
@pytest.mark.parametrize(
    "other",
    [
        {"a": 0, "b": 2},  # a particle in common
        {"a": 2, "b": 0},
        {"a": 1, "b": 2},
        {"a": 0, "b": 1, "step": 1},  # the same pair, a step later
        {"a": 0, "b": 1, "step": 2**32},
        {"a": 0, "b": 1, "seed": 8},
        {"a": 2, "b": 3},
    ],
)
def test_two_pairs(variate: str, other: dict[str, int]) -> None:
    x, y = draw(variate, 0, 1), draw(variate, **other)
    assert_zero(products(x, y), "numbers")
    assert_zero(products(x**2 - 1.0, y**2 - 1.0), "squares")


@pytest.mark.parametrize("variate", VARIATES)
def test_rings(variate: str) -> None:
    """Words add up to the same both ways across a ring of four; what is drawn must not show it."""
    ab, bc, cd, da = (draw(variate, *ends) for ends in ((0, 1), (1, 2), (2, 3), (3, 0)))
    assert_zero(ab * bc * cd * da, "ring of four")
    assert_zero((ab + cd) * (bc + da), "opposite sides")
    even = [x**2 - 1.0 for x in (ab, bc, cd, da)]
    assert_zero(even[0] * even[1] * even[2] * even[3], "squares of a ring of four")
    ac = draw(variate, 0, 2)
    assert_zero(ab * bc * ac, "triangle")
    assert_zero((ab**2 - 1.0) * (bc**2 - 1.0) * (ac**2 - 1.0), "squares of a triangle")


@pytest.mark.parametrize("variate", VARIATES)
def test_sum_of_the_pairs_of_a_particle(variate: str) -> None:
    """57 partners of 7,000 particles: as many independent numbers."""
    partners, particles = 57, 7000
    a = np.repeat(100 * np.arange(particles, dtype=np.uint64), partners)
    b = a + np.tile(np.arange(1, partners + 1, dtype=np.uint64), particles)
    xi = np.asarray(_core.force_variates(3, 11, a, b, variate, 3))
    total = xi.reshape(particles, partners, 3).sum(axis=1) / np.sqrt(partners)
    for column in total.T:
        assert abs(column.mean()) * np.sqrt(particles) < SIGMAS
        excess = LAW[variate].stats("k") / partners
        error = np.sqrt((2.0 + excess) / particles)
        assert error < 0.02
        assert abs(column.var() - 1.0) < SIGMAS * error
        assert stats.kstest(column, stats.norm().cdf).pvalue > 1e-5


def test_bits_of_uniform_variates() -> None:
    """Each of the ten bits is set half of the time, and no two go together."""
    x = draw("uniform", 0, 1)
    steps = x / np.sqrt(12.0 / (1.0 - 2.0**-20)) * 2.0**10 + 511.5
    fields = np.rint(steps).astype(np.int64)
    assert np.abs(steps - fields).max() < 1e-9  # 1024 levels, the outermost ones included
    assert fields.min() == 0
    assert fields.max() == 1023
    bits = np.concatenate([(fields >> k) & 1 for k in range(10)], axis=1).astype(float) - 0.5
    z = bits.mean(axis=0) * 2.0 * np.sqrt(N)
    assert np.abs(z).max() < SIGMAS
    cross = 4.0 * (bits.T @ bits) / np.sqrt(N)
    np.fill_diagonal(cross, 0.0)
    assert np.abs(cross).max() < 5.0  # of 435
