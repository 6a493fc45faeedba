"""Densities and quantiles of known distributions; replicas of correlated series judge errors."""

import numpy as np
import pytest
from scipy import stats

from sdpd import analysis


def ar1(rows, columns, keep, seed):
    noise = np.random.default_rng(seed).normal(size=(rows, columns))
    series = np.empty_like(noise)
    series[0] = noise[0]
    for t in range(1, rows):
        series[t] = keep * series[t - 1] + np.sqrt(1.0 - keep**2) * noise[t]
    return series


def test_quantiles_of_a_normal_sample_lie_on_the_line():
    sample = np.random.default_rng(6).normal(1.0, 2.0, size=(200, 100))
    data = analysis.quantiles(sample, mean=1.0, deviation=2.0, count=99)
    assert np.abs(data.z).max() < 4.0
    assert data.n_effective == sample.size
    wrong = analysis.quantiles(sample, mean=1.0, deviation=2.1, count=99)
    assert np.abs(wrong.z).max() > 4.0


def test_fitted_mean_and_deviation():
    sample = np.random.default_rng(7).normal(1.0, 2e-9, size=5000) * 1e-3
    data = analysis.quantiles(sample, mean=None, deviation=None, count=9)
    assert data.theoretical[4] == pytest.approx(sample.mean(), rel=1e-12)
    assert data.theoretical[8] - data.theoretical[4] == pytest.approx(
        stats.norm.ppf(0.9) * sample.std()
    )
    assert np.abs(data.z).max() < 4.0


def test_speeds_against_the_maxwell_distribution():
    velocity = np.random.default_rng(8).normal(0.0, 0.7, size=(400, 60, 3))
    speed = np.linalg.norm(velocity, axis=2)
    data = analysis.quantiles(speed, distribution=stats.maxwell(scale=0.7), count=49)
    assert np.abs(data.z).max() < 4.0
    normal = analysis.quantiles(speed, mean=None, deviation=None, count=49)
    assert np.abs(normal.z).max() > 8.0  # speeds are skewed


def test_blocked_errors_of_a_correlated_sample_are_right():
    z, naive = [], []
    for seed in range(60):
        sample = ar1(1600, 2, 0.9, 80 + seed)
        z.append(analysis.quantiles(sample, count=3, n_blocks=16).z)
        naive.append(analysis.quantiles(sample, count=3).z)
    assert np.std(z, axis=0, ddof=1) == pytest.approx(np.ones(3), abs=0.4)
    assert np.all(np.std(naive, axis=0, ddof=1) > 2.5)  # as if independent: errors far too small


def test_density_of_a_normal_sample():
    sample = np.random.default_rng(9).normal(size=(640, 50))
    limits = np.linspace(-3.0, 3.0, 25)
    density = analysis.probability_density(sample, bins=limits)
    exact = np.diff(stats.norm.cdf(limits)) / np.diff(limits)
    p = [density.at(k).p(exact[k]) for k in range(24)]
    assert analysis.bonferroni(p).smallest > 1e-3
    assert density.stderr[12] / density.mean[12] < 0.02
    assert density.mean == pytest.approx(
        np.histogram(sample, limits)[0] / sample.size / np.diff(limits)
    )
    assert np.sum(density.mean * np.diff(limits)) == pytest.approx(np.mean(np.abs(sample) < 3.0))
    assert density.window == (0.0, 639.0)


def test_density_over_the_range_of_the_sample():
    sample = np.array([1.0, 2.0, 4.0, 5.0])
    density = analysis.probability_density(sample, bins=2, n_blocks=2)
    assert density.edges == pytest.approx([1.0, 3.0, 5.0])
    assert density.mean == pytest.approx([0.25, 0.25])
    assert density.blocks == pytest.approx(np.array([[0.5, 0.0], [0.0, 0.5]]))
    constant = analysis.probability_density(np.full(8, 3.0), bins=3)
    assert np.sum(constant.mean * np.diff(constant.edges)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: analysis.quantiles([1.0, 2.0], deviation=0.0), ValueError, "`deviation`"),
        (lambda: analysis.quantiles([1.0]), ValueError, "at least 2 values, got 1"),
        (lambda: analysis.quantiles([1.0, np.inf]), ValueError, "`samples` must be finite"),
        (lambda: analysis.quantiles([1.0, 2.0], count=0), ValueError, "`count` must be >= 1"),
        (lambda: analysis.quantiles([1.0, 2.0], n_blocks=3), ValueError, "`n_blocks` must be betw"),
        (lambda: analysis.quantiles([1.0, 2.0], distribution="x"), ValueError, "`distribution`"),
        (lambda: analysis.quantiles([1.0, 2.0], distribution=3), TypeError, "`ppf` and `pdf`"),
        (lambda: analysis.probability_density(["a"]), TypeError, "`samples` must be an array of"),
        (lambda: analysis.probability_density([1.0, 2.0], bins=0), ValueError, "`bins` must"),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()
