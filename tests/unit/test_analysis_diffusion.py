"""Diffusion coefficients of processes whose answers are exact, judged by z and by their power."""

from dataclasses import replace

import numpy as np
import pytest

from sdpd import analysis


def brownian(rows, particles, dimension, diffusion, dt, seed):
    steps = np.random.default_rng(seed).normal(size=(rows, particles, dimension))
    return np.cumsum(np.sqrt(2.0 * diffusion * dt) * steps, axis=0)


def ornstein_uhlenbeck(rows, particles, dimension, dt, tau, seed, variance=1.0):
    keep = np.exp(-dt / tau)
    kicks = np.random.default_rng(seed).normal(size=(rows, particles, dimension))
    velocity = np.empty_like(kicks)
    velocity[0] = kicks[0]
    for t in range(1, rows):
        velocity[t] = keep * velocity[t - 1] + np.sqrt(1.0 - keep**2) * kicks[t]
    return np.sqrt(variance) * velocity


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("weights", ["brownian", "generalized", "uniform"])
def test_einstein_diffusion_of_brownian_walks(dimension, weights):
    diffusion, dt = 2.5e-9, 1e-12  # SI magnitudes
    walk = brownian(4000, 100, dimension, diffusion, dt, seed=21)
    curve = analysis.msd(walk, dt, max_lag=60)
    estimate = analysis.einstein_diffusion(curve, window=(10 * dt, 60 * dt), weights=weights)
    assert abs(estimate.z(diffusion)) < 4.0
    assert estimate.relative < 0.02
    assert estimate.window == pytest.approx((10 * dt, 60 * dt))
    assert estimate.n_effective == 32


@pytest.mark.parametrize("by", ["time", "particles"])
def test_einstein_error_is_calibrated(by):
    z = []
    for seed in range(50):
        curve = analysis.msd(brownian(640, 32, 2, 0.5, 1.0, 200 + seed), 1.0, max_lag=15, by=by)
        z.append(analysis.einstein_diffusion(curve, window=(3.0, 15.0)).z(0.5))
    assert 0.75 < np.std(z, ddof=1) < 1.4
    assert abs(np.mean(z)) < 4.0 / np.sqrt(50)


def test_covariance_weights_are_sharpest_on_a_brownian_walk():
    curve = analysis.msd(brownian(6400, 64, 3, 0.5, 1.0, 22), 1.0, max_lag=100)
    errors = [
        analysis.einstein_diffusion(curve, window=(1.0, 100.0), weights=w).stderr
        for w in ("generalized", "brownian", "uniform")
    ]
    assert errors[0] < errors[1] < errors[2]


def test_lags_need_not_be_equally_spaced():
    """The weights are those of the same lags, whatever lies between them."""
    curve = analysis.msd(brownian(2000, 20, 3, 0.5, 0.1, 23), 0.1, max_lag=32)
    kept = np.array([0, 1, 2, 4, 8, 16, 32])
    thinned = replace(
        curve,
        lag=curve.lag[kept],
        blocks=curve.blocks[:, kept],
        block_counts=curve.block_counts[:, kept],
    )
    n = kept[2:].astype(float)
    variance = n**2 + n * (n - 1) * (2 * n - 1) / 3
    found = analysis.einstein_diffusion(thinned, window=(0.2, 3.2)).value
    slope = np.polyfit(0.1 * n, curve.mean[kept[2:]], 1, w=variance**-0.5)[0]
    assert found == pytest.approx(slope / 6.0, rel=1e-9)


def test_slope_of_an_exact_line_is_exact():
    rows = np.arange(200.0)
    ballistic = np.stack([rows, 2.0 * rows], axis=1)[:, None, :] * np.ones((1, 4, 1))
    curve = analysis.msd(ballistic, 1.0, max_lag=9, n_blocks=4)
    assert curve.mean == pytest.approx(5.0 * np.arange(10.0) ** 2)
    for weights in ("brownian", "generalized", "uniform"):
        two = analysis.einstein_diffusion(curve, window=(4.0, 5.0), weights=weights)
        assert two.value == pytest.approx(5.0 * (25.0 - 16.0) / 4.0)
        assert two.stderr == pytest.approx(0.0, abs=1e-9)


def test_green_kubo_and_einstein_agree_on_ornstein_uhlenbeck():
    dt, tau, variance = 0.2, 1.0, 0.7
    velocity = ornstein_uhlenbeck(8000, 100, 3, dt, tau, seed=23, variance=variance)
    c = analysis.vacf(velocity, dt, max_lag=60)
    green_kubo = analysis.green_kubo_diffusion(c, cutoff=8.0)
    assert green_kubo.relative < 0.02
    assert abs(green_kubo.z(variance * tau * (1.0 - np.exp(-8.0)))) < 4.0
    assert green_kubo.window == pytest.approx((0.0, 8.0))
    running = analysis.running_diffusion(c)
    assert running.lag[-1] == pytest.approx(12.0)
    trapezoid = 1.0 + (dt / tau) ** 2 / 12.0
    exact = variance * tau * trapezoid * (1.0 - np.exp(-8.0))
    assert abs(running.at(40).z(exact)) < 4.0


def test_simpson_removes_the_error_of_the_trapezoid():
    lag = 0.5 * np.arange(41)
    exact = np.exp(-lag)
    c = analysis.Correlation(
        lag=lag,
        blocks=np.stack([exact, exact]),
        block_counts=np.ones((2, 41)),
        window=(0.0, 100.0),
    )
    assert analysis.green_kubo_diffusion(c).value == pytest.approx(1.0, abs=4e-4)
    assert analysis.running_diffusion(c).mean[-1] == pytest.approx(1.0 + 0.25 / 12.0, abs=1e-3)


def test_short_time_diffusion_of_ornstein_uhlenbeck():
    dt, tau = 0.25, 1.0
    velocity = ornstein_uhlenbeck(8000, 200, 3, dt, tau, seed=24)
    c = analysis.vacf(velocity, dt, max_lag=8)
    short = analysis.short_time_diffusion(c, n_lags=4, order=2)
    assert short.rate.relative < 0.01
    assert abs(short.rate.z(1.0 / tau)) < 4.0
    assert abs(short.diffusion.z(tau)) < 4.0
    assert short.rate_at_lag == pytest.approx(np.ones(4), abs=0.02)
    assert short.diffusion.window == pytest.approx((0.0, 1.0))
    known = analysis.short_time_diffusion(c, velocity_variance=1.0)
    assert known.diffusion.value == pytest.approx(1.0 / known.rate.value, rel=1e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_extrapolation_removes_the_curvature(order):
    lag = 0.1 * np.arange(6)
    exact = np.exp(-2.0 * lag - 3.0 * lag**2 + (5.0 * lag**3 if order == 2 else 0.0))
    c = analysis.Correlation(
        lag=lag, blocks=np.stack([exact] * 2), block_counts=np.ones((2, 6)), window=(0.0, 1.0)
    )
    short = analysis.short_time_diffusion(c, n_lags=4, order=order)
    assert short.rate.value == pytest.approx(2.0, rel=1e-10)
    assert short.diffusion.value == pytest.approx(0.5, rel=1e-10)
    plain = analysis.short_time_diffusion(c, n_lags=4, order=0)
    assert plain.rate.value > 2.2


def test_local_diffusivity_finds_a_fast_and_a_slow_half():
    generator = np.random.default_rng(25)
    rows, count, box = 2000, 200, np.array([10.0, 10.0])
    position = np.empty((rows, count, 2))
    position[0] = generator.uniform(0.0, 10.0, size=(count, 2))
    half = (np.arange(count) % 2).astype(float)  # x stays put, y diffuses: 0.1 left, 0.4 right
    position[0, :, 0] = 2.0 + 5.0 * half
    diffusion = np.where(half > 0, 0.4, 0.1)
    kicks = generator.normal(size=(rows, count)) * np.sqrt(2.0 * diffusion * 0.5)
    position[:, :, 0] = position[0, :, 0]
    position[1:, :, 1] = position[0, :, 1] + np.cumsum(kicks[1:], axis=0)
    position[..., 0] -= 20.0  # unwrapped, two boxes away
    profile = analysis.local_diffusivity(
        position, 0.5, axis=0, bins=2, lag=5, box=box, components=(1,)
    )
    assert profile.centers == pytest.approx([2.5, 7.5])
    for index, exact in enumerate((0.1, 0.4)):
        assert abs(profile.at(index).z(exact)) < 4.0
        assert profile.at(index).relative < 0.02
    both = analysis.local_diffusivity(position, 0.5, axis=0, bins=2, lag=5, box=box)
    assert both.mean == pytest.approx(0.5 * profile.mean)
    assert profile.window == (2.5, 2.5)


def test_empty_bins_are_nan():
    walk = brownian(64, 4, 2, 0.5, 1.0, 26)
    profile = analysis.local_diffusivity(
        walk, 1.0, axis=0, bins=[-1e3, 1e3, 2e3], lag=1, n_blocks=4
    )
    assert np.isfinite(profile.mean[0])
    assert np.isnan(profile.mean[1])
    assert profile.counts.tolist() == [4 * 63, 0]


CURVE = analysis.msd(brownian(64, 4, 2, 0.5, 1.0, 27), 1.0, max_lag=10, n_blocks=4)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: analysis.einstein_diffusion(CURVE, window=(5.0, 50.0)), ValueError, "`window`"),
        (lambda: analysis.einstein_diffusion(CURVE, window=(5.0, 5.5)), ValueError, "2 lags"),
        (lambda: analysis.einstein_diffusion(CURVE, window=3.0), TypeError, "`window` must be a"),
        (
            lambda: analysis.einstein_diffusion(CURVE, window=(1.0, 5.0), weights="best"),
            ValueError,
            "`weights` must be one of",
        ),
        (lambda: analysis.green_kubo_diffusion(CURVE, cutoff=99.0), ValueError, "`cutoff` must"),
        (lambda: analysis.green_kubo_diffusion(CURVE, cutoff=1.0), ValueError, "at least 3 lags"),
        (lambda: analysis.short_time_diffusion(CURVE), ValueError, "VACF is positive"),
        (lambda: analysis.short_time_diffusion(CURVE, n_lags=2), ValueError, "`order` must"),
        (lambda: analysis.short_time_diffusion(CURVE, n_lags=99), ValueError, "`n_lags` must"),
        (
            lambda: analysis.local_diffusivity(np.ones((9, 2, 2)), 1.0, axis=2, bins=2, lag=1),
            ValueError,
            "`axis` must be between 0 and 1, got 2",
        ),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()
