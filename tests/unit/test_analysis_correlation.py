"""Correlation functions against O(T^2) loops, MDAnalysis and the Ornstein-Uhlenbeck process."""

from dataclasses import replace

import numpy as np
import pytest

from sdpd import analysis

RNG = np.random.default_rng(11)
WALK = np.cumsum(RNG.normal(size=(120, 6, 3)), axis=0)
NOISE = RNG.normal(size=(120, 6, 3))


def ornstein_uhlenbeck(rows, particles, dimension, dt, tau, seed):
    """Velocities of unit variance per component with C(t) = exp(-t/tau)."""
    keep = np.exp(-dt / tau)
    kicks = np.random.default_rng(seed).normal(size=(rows, particles, dimension))
    velocity = np.empty_like(kicks)
    velocity[0] = kicks[0]
    for t in range(1, rows):
        velocity[t] = keep * velocity[t - 1] + np.sqrt(1.0 - keep**2) * kicks[t]
    return velocity


def naive(product, rows, max_lag, blocks):
    """Mean of product(t0, t0 + lag), shape (T0, N), in each (rows, columns) block."""
    return np.array(
        [
            [
                np.mean(
                    [
                        product(t, t + lag)[columns].mean()
                        for t in range(part.start, min(part.stop, rows - lag))
                    ]
                )
                for lag in range(max_lag + 1)
            ]
            for part, columns in blocks
        ]
    )


TIME_BLOCKS = [(slice(30 * b, 30 * b + 30), slice(None)) for b in range(4)]
PARTICLE_BLOCKS = [(slice(0, 120), slice(2 * b, 2 * b + 2)) for b in range(3)]


@pytest.mark.parametrize(
    ("by", "n_blocks", "max_lag", "blocks"),
    [("time", 4, 20, TIME_BLOCKS), ("particles", 3, 100, PARTICLE_BLOCKS)],
)
class TestAgainstLoops:
    def test_vacf(self, by, n_blocks, max_lag, blocks):
        ours = analysis.vacf(NOISE, 0.5, max_lag=max_lag, n_blocks=n_blocks, by=by)
        loop = naive(lambda s, t: (NOISE[s] * NOISE[t]).mean(axis=1), 120, max_lag, blocks)
        assert ours.blocks == pytest.approx(loop, abs=1e-13)
        assert ours.lag == pytest.approx(0.5 * np.arange(max_lag + 1))

    def test_msd(self, by, n_blocks, max_lag, blocks):
        ours = analysis.msd(WALK, 0.5, max_lag=max_lag, n_blocks=n_blocks, by=by)
        loop = naive(lambda s, t: ((WALK[s] - WALK[t]) ** 2).sum(axis=1), 120, max_lag, blocks)
        assert ours.blocks == pytest.approx(loop, rel=1e-11, abs=1e-11)

    def test_cross(self, by, n_blocks, max_lag, blocks):
        first, second = WALK[..., 0], NOISE[..., 0]
        ours = analysis.cross_correlation(
            first, second, 0.5, max_lag=max_lag, n_blocks=n_blocks, by=by
        )
        loop = naive(lambda s, t: first[s] * second[t], 120, max_lag, blocks)
        assert ours.blocks == pytest.approx(loop, abs=1e-11)


def test_overall_mean_is_over_all_origins():
    ours = analysis.msd(WALK, 1.0, max_lag=20, n_blocks=4)
    for lag in (1, 7, 20):
        direct = ((WALK[lag:] - WALK[:-lag]) ** 2).sum(axis=2).mean()
        assert ours.mean[lag] == pytest.approx(direct, rel=1e-12)
    assert ours.counts[20] == 6 * 100
    assert ours.mean[0] == 0.0


def test_msd_agrees_with_mdanalysis():
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.analysis.msd import EinsteinMSD
    from MDAnalysis.coordinates.memory import MemoryReader

    universe = mda.Universe.empty(WALK.shape[1], trajectory=True)
    universe.load_new(WALK.astype(np.float32), format=MemoryReader, order="fac", dt=1.0)
    theirs = EinsteinMSD(universe, select="all", msd_type="xyz", fft=False).run()
    ours = analysis.msd(WALK.astype(np.float32), 1.0, max_lag=90, n_blocks=3, by="particles")
    assert ours.mean == pytest.approx(theirs.results.timeseries[:91], rel=1e-5, abs=1e-4)


def test_msd_keeps_its_digits_far_from_the_origin():
    near = analysis.msd(1e-10 * WALK, 1e-12, max_lag=20, n_blocks=4)
    far = analysis.msd(1e-10 * WALK + 1e-6, 1e-12, max_lag=20, n_blocks=4)
    assert far.mean[1:] == pytest.approx(near.mean[1:], rel=1e-9, abs=0.0)


def test_single_precision_input_is_summed_in_double():
    single = analysis.vacf(NOISE.astype(np.float32), 1.0, max_lag=5, n_blocks=4)
    assert single.mean.dtype == np.float64
    assert single.mean == pytest.approx(
        analysis.vacf(NOISE, 1.0, max_lag=5, n_blocks=4).mean, abs=1e-6
    )


def test_ornstein_uhlenbeck_vacf_and_its_error():
    dt, tau = 0.1, 0.5
    velocity = ornstein_uhlenbeck(6400, 64, 2, dt, tau, seed=12)
    c = analysis.vacf(velocity, dt, max_lag=40)
    exact = np.exp(-c.lag / tau)
    family = [c.at(k).p(exact[k]) for k in range(0, 41, 5)]
    assert analysis.bonferroni(family).smallest > 1e-3
    assert c.stderr[0] < 0.005
    ratio, error = c.normalized()
    assert error[0] == 0.0
    assert abs(ratio[5] - exact[5]) < 4.5 * error[5]
    assert error[1] < 0.5 * c.stderr[1]  # C(0) and C(dt) fluctuate together
    assert c.window == pytest.approx((0.0, 639.9))


def test_error_bars_are_calibrated():
    z = []
    for seed in range(40):
        velocity = ornstein_uhlenbeck(1600, 4, 1, 1.0, 3.0, seed=100 + seed)
        z.append(analysis.vacf(velocity, 1.0, max_lag=6).at(3).z(np.exp(-1.0)))
    assert 0.75 < np.std(z, ddof=1) < 1.4
    assert abs(np.mean(z)) < 4.0 / np.sqrt(40)


def test_series_of_other_shapes():
    flat = analysis.autocorrelation(NOISE[:, 0, 0], 1.0, max_lag=3, n_blocks=4)
    table = analysis.autocorrelation(NOISE[:, :, 0], 1.0, max_lag=3, n_blocks=4)
    vectors = analysis.autocorrelation(NOISE, 1.0, max_lag=3, n_blocks=4)
    assert flat.mean[0] == pytest.approx(np.mean(NOISE[:, 0, 0] ** 2))
    assert table.mean[0] == pytest.approx(np.mean(NOISE[:, :, 0] ** 2))
    assert vectors.mean == pytest.approx(analysis.vacf(NOISE, 1.0, max_lag=3, n_blocks=4).mean)


def test_subtract_mean():
    shifted = analysis.autocorrelation(
        NOISE[:, 0, 0] + 5.0, 1.0, max_lag=3, n_blocks=4, subtract_mean=True
    )
    assert shifted.mean[0] == pytest.approx(NOISE[:, 0, 0].var())


def test_merge_pools_the_blocks_of_replicas():
    parts = [analysis.vacf(NOISE * s, 1.0, max_lag=5, n_blocks=4) for s in (1.0, 2.0)]
    both = analysis.Correlation.merge(parts)
    assert both.n_blocks == 8
    assert both.mean == pytest.approx(0.5 * (parts[0].mean + parts[1].mean))
    with pytest.raises(ValueError, match="same lags"):
        analysis.Correlation.merge([parts[0], analysis.vacf(NOISE, 2.0, max_lag=5, n_blocks=4)])


def test_integral_and_derive():
    c = analysis.vacf(NOISE, 0.5, max_lag=6, n_blocks=4)
    running = c.integral()
    assert running.mean[-1] == pytest.approx(np.trapezoid(c.mean, c.lag))
    estimate = c.derive(lambda mean: float(np.trapezoid(mean, dx=0.5)))
    assert estimate.value == pytest.approx(running.mean[-1])
    assert estimate.window == (0.0, 59.5)


def in_loop_lags(points, levels, dt):
    """Lags of a correlator inside the loop: linear first, then every 2^l of them."""
    lags = [np.arange(points)]
    lags += [np.arange(points // 2, points) * 2**level for level in range(1, levels)]
    return dt * np.concatenate(lags)


def exact(lag, values):
    return analysis.Correlation(
        lag=lag,
        blocks=np.stack([values, values]),
        block_counts=np.ones((2, lag.size)),
        window=(0.0, 1e3),
    )


@pytest.mark.parametrize("dt", [0.05, 5e-14])
def test_lags_of_unequal_spacing(dt):
    lag = in_loop_lags(16, 5, dt)
    tau = 20.0 * dt
    c = exact(lag, np.exp(-lag / tau))
    assert c.resolution == pytest.approx(dt)
    assert not c.is_uniform
    with pytest.raises(ValueError, match="`lag` must be equally spaced"):
        c.step  # noqa: B018
    whole = tau * (1.0 - np.exp(-lag[-1] / tau))
    assert analysis.green_kubo_diffusion(c).value == pytest.approx(whole, rel=2e-4)
    assert c.integral().mean[-1] == pytest.approx(whole, rel=6e-3)
    assert c.integral().mean == pytest.approx(
        [np.trapezoid(c.mean[: n + 1], lag[: n + 1]) for n in range(lag.size)]
    )
    linear = c.between(0.0, 15.0 * dt)
    assert linear.is_uniform
    assert linear.step == pytest.approx(dt)
    assert linear.mean == pytest.approx(c.mean[:16])
    assert c.at_lags([0, 3]).lag == pytest.approx([0.0, 3.0 * dt])
    line = exact(lag, 6.0 * 0.3 * lag)
    for weights in ("brownian", "generalized", "uniform"):
        assert analysis.einstein_diffusion(
            replace(line, dimension=3), window=(5.0 * dt, lag[-1]), weights=weights
        ).value == pytest.approx(0.3)


def test_lags_that_do_not_begin_at_zero_are_refused_where_it_matters():
    late = exact(0.1 * np.arange(1.0, 9.0), np.ones(8))
    for call in (
        late.normalized,
        late.integral,
        lambda: analysis.green_kubo_diffusion(late),
        lambda: analysis.short_time_diffusion(late),
        lambda: analysis.fit_transverse(late, 1.0),
        lambda: analysis.fit_sound(late, 1.0),
    ):
        with pytest.raises(ValueError, match=r"`lag` must begin at 0, got 0\.1"):
            call()


def test_merge_tells_short_lags_apart():
    """An absolute tolerance would call all picoseconds equal."""
    one, two = (exact(dt * np.arange(4.0), np.ones(4)) for dt in (1e-12, 2e-12))
    with pytest.raises(ValueError, match="same lags"):
        analysis.Correlation.merge([one, two])


def test_transformed_keeps_the_blocks_behind_the_error():
    c = analysis.vacf(NOISE, 0.5, max_lag=6, n_blocks=4)
    thrice = c.transformed(lambda mean: 3.0 * mean)
    assert thrice.mean == pytest.approx(3.0 * c.mean)
    assert thrice.stderr[0] == pytest.approx(3.0 * c.stderr[0])
    assert thrice.stderr == pytest.approx(3.0 * c.stderr, rel=0.03)  # the last block counts less
    assert c.scaled(3.0).blocks == pytest.approx(3.0 * c.blocks)
    assert c.scaled(c.lag).mean == pytest.approx(c.lag * c.mean)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: analysis.vacf(NOISE[:, 0], 1.0, max_lag=2), ValueError, "`velocity` must be 3-d"),
        (lambda: analysis.vacf(NOISE, -0.1, max_lag=2, n_blocks=4), ValueError, "`dt` must be fin"),
        (lambda: analysis.vacf(NOISE, "1", max_lag=2, n_blocks=4), TypeError, "`dt` must be"),
        (lambda: analysis.vacf(NOISE, 1.0, max_lag=40, n_blocks=4), ValueError, "by=.particles"),
        (lambda: analysis.vacf(NOISE, 1.0, max_lag=0, n_blocks=4), ValueError, "`max_lag` must"),
        (lambda: analysis.vacf(NOISE, 1.0, max_lag=2.5, n_blocks=4), TypeError, "`max_lag` must"),
        (lambda: analysis.vacf(NOISE, 1.0, max_lag=2, n_blocks=1), ValueError, "`n_blocks` must"),
        (lambda: analysis.vacf(NOISE, 1.0, max_lag=2, by="rows"), ValueError, "`by` must be one"),
        (lambda: analysis.msd(WALK * np.inf, 1.0, max_lag=2), ValueError, "`position` must be fin"),
        (lambda: analysis.msd(WALK > 0, 1.0, max_lag=2), TypeError, "`position` must be an array"),
        (
            lambda: analysis.cross_correlation(NOISE, NOISE[:, :2], 1.0, max_lag=2),
            ValueError,
            "`second` must have the shape",
        ),
        (
            lambda: analysis.vacf(NOISE[:, :1], 1.0, max_lag=2, by="particles"),
            ValueError,
            "at least 2 blocks by particles",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()
