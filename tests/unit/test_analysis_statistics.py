"""Standard errors of correlated series: AR(1) has exact answers, replicas judge the errors."""

import math

import numpy as np
import pytest

from sdpd import analysis

PHI = 0.8
TAU = 0.5 * (1.0 + PHI) / (1.0 - PHI)  # 1/2 + sum of PHI^t


def ar1(rows, columns=1, phi=PHI, seed=1):
    """Stationary AR(1) series of unit variance, shape (rows, columns)."""
    noise = np.random.default_rng(seed).normal(size=(rows, columns))
    series = np.empty_like(noise)
    series[0] = noise[0]
    for t in range(1, rows):
        series[t] = phi * series[t - 1] + math.sqrt(1.0 - phi**2) * noise[t]
    return series


def exact_stderr(rows, phi=PHI):
    lag = np.arange(1, rows)
    return math.sqrt((1.0 + 2.0 * np.sum((1.0 - lag / rows) * phi**lag)) / rows)


def test_autocorrelation_time_of_ar1():
    series = ar1(20000, 8)
    tau = analysis.integrated_autocorrelation_time(series)
    assert tau.converged
    assert tau.stderr < 0.03 * TAU
    assert abs(tau.value - TAU) < 4.0 * tau.stderr
    assert tau.n_effective == pytest.approx(series.size / (2.0 * tau.value))


def test_autocorrelation_time_of_white_noise_is_one_half():
    tau = analysis.integrated_autocorrelation_time(ar1(50000, phi=0.0)[:, 0])
    assert abs(tau.value - 0.5) < 4.0 * tau.stderr


def test_too_short_a_series_says_so():
    assert not analysis.integrated_autocorrelation_time(np.arange(12.0)).converged


def test_tau_is_distributed_as_its_error_says():
    taus = [analysis.integrated_autocorrelation_time(column) for column in ar1(4000, 40).T]
    z = np.array([(t.value - TAU) / t.stderr for t in taus])
    assert 0.6 < z.std(ddof=1) < 1.6


@pytest.mark.parametrize("method", ["block_average", "blocking", "autocorrelation"])
def test_standard_error_of_the_mean_is_right(method):
    rows = 8192
    estimator = {
        "block_average": analysis.block_average,
        "blocking": lambda s: analysis.time_average(s, method="blocking"),
        "autocorrelation": analysis.time_average,
    }[method]
    estimates = [estimator(column) for column in ar1(rows, 60, seed=2).T]
    mean_error = np.mean([e.stderr for e in estimates])
    assert mean_error == pytest.approx(exact_stderr(rows), rel=0.12)
    z = np.array([e.z(0.0) for e in estimates])
    assert 0.7 < z.std(ddof=1) < 1.4
    assert all(e.window == (0.0, rows - 1.0) for e in estimates)


def test_blocking_levels_rise_to_a_plateau():
    result = analysis.blocking(ar1(2**14, seed=3)[:, 0])
    assert result.plateau is not None
    assert result.stderr[0] == pytest.approx(1.0 / math.sqrt(2**14), rel=0.1)
    assert abs(result.stderr[result.plateau] - exact_stderr(2**14)) < (
        4.0 * result.stderr_error[result.plateau]
    )
    assert np.array_equal(result.block_length, 2.0 ** np.arange(result.stderr.size))


def test_constant_series_has_no_error():
    assert analysis.time_average(np.full(16, 2.0)).stderr == 0.0
    assert analysis.blocking(np.full(16, 2.0)).estimate.stderr == 0.0


def test_z_and_student_p():
    estimate = analysis.Estimate(1.5, 0.25, n_effective=32)
    assert estimate.z(1.0) == pytest.approx(2.0)
    assert analysis.Estimate(4.0, 1.0, n_effective=32).p(0.0) == pytest.approx(3.65e-4, rel=2e-3)
    assert analysis.Estimate(4.0, 1.0).p(0.0) == pytest.approx(6.33e-5, rel=2e-3)
    assert not estimate.agrees(10.0)
    low, high = estimate.interval(0.95)
    assert high - 1.5 == pytest.approx(2.0395 * 0.25, rel=1e-4)
    assert low + high == pytest.approx(3.0)


def test_two_estimates_compare_by_welch():
    a, b = analysis.Estimate(1.0, 0.3, 10), analysis.Estimate(2.0, 0.4, 20)
    assert a.z(b) == pytest.approx(-2.0)
    from scipy import stats

    freedom = 0.25**2 / (0.09**2 / 9 + 0.16**2 / 19)
    assert a.p(b) == pytest.approx(2.0 * stats.t.sf(2.0, freedom))


def test_scaling_and_reciprocal():
    estimate = analysis.Estimate(4.0, 0.2, 8, (0.0, 1.0))
    assert estimate.scaled(-2.0) == analysis.Estimate(-8.0, 0.4, 8, (0.0, 1.0))
    inverse = estimate.reciprocal(8.0)
    assert (inverse.value, inverse.stderr) == pytest.approx((2.0, 0.1))
    assert estimate.relative == pytest.approx(0.05)
    assert str(estimate) == "4 +- 0.2"


def test_combine_equal_and_by_variance():
    members = [analysis.Estimate(1.0, 0.1, 20), analysis.Estimate(2.0, 0.2, 20)]
    equal = analysis.combine(members)
    assert (equal.value, equal.stderr) == pytest.approx((1.5, math.sqrt(0.05) / 2.0))
    weighted = analysis.combine(members, weights="inverse_variance")
    assert (weighted.value, weighted.stderr) == pytest.approx((1.2, 1.0 / math.sqrt(125.0)))
    alike = analysis.combine([analysis.Estimate(0.0, 1.0, 11)] * 4)
    assert alike.n_effective == pytest.approx(41.0)


def test_ensemble_of_replicas():
    values = np.random.default_rng(4).normal(3.0, 2.0, size=400)
    estimate = analysis.ensemble(values, window=(0.0, 5.0))
    assert estimate.stderr == pytest.approx(values.std(ddof=1) / 20.0)
    assert abs(estimate.z(3.0)) < 4.0
    assert estimate.window == (0.0, 5.0)


def test_ensemble_of_estimates():
    members = [analysis.Estimate(v, 0.1, 32, (0.0, 2.0)) for v in (1.0, 1.3, 0.8)]
    assert analysis.ensemble(members) == analysis.ensemble([1.0, 1.3, 0.8], window=(0.0, 2.0))
    assert analysis.Estimate.merge(members) == analysis.combine(members)
    other = [*members, analysis.Estimate(1.0, 0.1, 32, (0.0, 3.0))]
    assert analysis.ensemble(other).window is None


def test_homogeneity_of_exactly_known_errors_is_chi_square():
    from scipy import stats

    members = [analysis.Estimate(v, e) for v, e in ((1.0, 0.1), (1.2, 0.2), (0.7, 0.15))]
    test = analysis.homogeneity(members)
    weights = np.array([0.1, 0.2, 0.15]) ** -2.0
    mean = weights @ [1.0, 1.2, 0.7] / weights.sum()
    chi_square = weights @ (np.array([1.0, 1.2, 0.7]) - mean) ** 2
    assert (test.mean, test.chi_square, test.freedom) == pytest.approx((mean, chi_square, 2))
    assert test.p == pytest.approx(stats.chi2.sf(chi_square, 2))
    two = analysis.homogeneity([analysis.Estimate(1.0, 0.3, 10), analysis.Estimate(2.0, 0.4, 20)])
    welch = analysis.Estimate(1.0, 0.3, 10).p(analysis.Estimate(2.0, 0.4, 20))
    assert two.p == pytest.approx(welch)


def test_homogeneity_is_calibrated_and_sees_a_stray_run():
    generator = np.random.default_rng(7)
    samples = generator.normal(size=(4000, 6, 12)) * np.array([1, 1, 2, 2, 3, 3])[:, None]
    samples[2000:, 0] += 2.0
    values, errors = samples.mean(axis=2), samples.std(axis=2, ddof=1) / math.sqrt(12)
    p = np.array(
        [
            analysis.homogeneity([analysis.Estimate(v, e, 12) for v, e in zip(*row, strict=True)]).p
            for row in zip(values, errors, strict=True)
        ]
    )
    fair, stray = p[:2000], p[2000:]
    assert np.mean(fair < 0.05) == pytest.approx(0.05, abs=4.0 * math.sqrt(0.05 * 0.95 / 2000))
    assert np.mean(stray < 0.05) > 0.95


def test_jackknife_of_a_mean_is_the_standard_error():
    x = np.random.default_rng(5).normal(size=20)
    leave = (x.sum() - x) / 19.0
    value, stderr = analysis.jackknife(leave, float(x.mean()))
    assert value == pytest.approx(x.mean())
    assert stderr == pytest.approx(x.std(ddof=1) / math.sqrt(20.0))


def test_bonferroni_family():
    verdict = analysis.bonferroni([0.5, 2e-4, 0.03], level=1e-3)
    assert verdict.adjusted == pytest.approx([1.0, 6e-4, 0.09])
    assert verdict.rejected.tolist() == [False, True, False]
    assert verdict.smallest == pytest.approx(6e-4)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: analysis.block_average([1.0, np.nan]), ValueError, "`series` must be finite"),
        (lambda: analysis.block_average(["a"]), TypeError, "`series` must be an array of real"),
        (lambda: analysis.block_average(np.ones((2, 2))), ValueError, "`series` must be 1-d"),
        (lambda: analysis.block_average(np.ones(8)), ValueError, "`n_blocks` must be between 2"),
        (lambda: analysis.block_average(np.ones(8), n_blocks=2.0), TypeError, "`n_blocks`"),
        (lambda: analysis.blocking([1.0, 2.0]), ValueError, "at least 8 samples, got 2"),
        (lambda: analysis.integrated_autocorrelation_time(np.ones(9)), ValueError, "constant"),
        (lambda: analysis.time_average(np.ones(9), method="guess"), ValueError, "`method` must"),
        (lambda: analysis.ensemble([1.0]), ValueError, "at least 2 replicas, got 1"),
        (lambda: analysis.combine([]), ValueError, "`estimates` must not be empty"),
        (
            lambda: analysis.homogeneity([analysis.Estimate(1.0, 1.0)]),
            ValueError,
            "at least 2, got",
        ),
        (
            lambda: analysis.homogeneity([analysis.Estimate(1.0, 0.0)] * 2),
            ValueError,
            "`estimates` must all have stderr > 0",
        ),
        (lambda: analysis.bonferroni([1.5]), ValueError, "`p_values` must lie"),
        (lambda: analysis.Estimate(1.0, 1.0).interval(2.0), ValueError, "`confidence`"),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()
