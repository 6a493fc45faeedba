"""Viscosities of stresses whose answers are exact: white noise, Ornstein-Uhlenbeck, both."""

import numpy as np
import pytest
from scipy import signal

from sdpd import analysis, theory

VOLUME, ENERGY = 30.0, 1.7
SMALL = np.random.default_rng(71).normal(size=(90, 3, 3))


def white(rows, dimension, dt, eta, seed):
    """Interval means of a delta-correlated stress of viscosity eta: variance 2 eta kB T/(V dt)."""
    scale = np.sqrt(2.0 * eta * ENERGY / (VOLUME * dt))
    return scale * np.random.default_rng(seed).normal(size=(rows, dimension, dimension))


def ornstein_uhlenbeck(rows, dimension, dt, tau, variance, seed):
    """Exact interval means of a stress with C(t) = variance exp(-t/tau) in every element."""
    x = dt / tau
    keep = np.exp(-x)
    first, second = np.random.default_rng(seed).normal(size=(2, rows, dimension, dimension))
    # Joint law of the value at the end and of the integral, given the value at the start.
    end = np.sqrt(1.0 - keep**2)
    joint = (1.0 - keep) ** 2 / end
    alone = np.sqrt(2.0 * x - 3.0 + 4.0 * keep - keep**2 - joint**2)
    begin = np.random.default_rng(seed + 1).normal(size=(1, dimension, dimension))
    driven = np.concatenate([begin, end * first[:-1]])
    start = signal.lfilter([1.0], [1.0, -keep], driven, axis=0)
    integral = (1.0 - keep) * start + joint * first + alone * second
    return np.sqrt(variance) * integral / x


def helfand_of_ou(lag, tau, variance):
    return 2.0 * (VOLUME * tau) ** 2 * variance * (lag / tau - 1.0 + np.exp(-lag / tau))


def means_of_ou(count, dt, tau, variance):
    """Autocorrelation of the interval means at lags 0 .. count - 1."""
    x = dt / tau
    later = (1.0 - np.exp(-x)) ** 2 * np.exp(-x * (np.arange(1, count) - 1.0))
    return variance / x**2 * np.concatenate([[2.0 * (x - 1.0 + np.exp(-x))], later])


def exact(lag, values):
    """A correlation function without noise, in two blocks."""
    return analysis.Correlation(
        lag=lag, blocks=np.stack([values] * 2), block_counts=np.ones((2, lag.size)), window=(0, 9)
    )


def columns(stress, component):
    dimension = stress.shape[1]
    if component == "shear":
        return [stress[:, a, b] for a in range(dimension) for b in range(dimension) if a != b]
    diagonal = [stress[:, a, a] for a in range(dimension)]
    if component == "trace":
        diagonal = [sum(diagonal) / dimension]
    return [series - series.mean() for series in diagonal]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("component", ["shear", "longitudinal", "trace"])
def test_increments_equal_loops(component, dimension):
    stress, dt = SMALL[:, :dimension, :dimension] + 3.0 * (component != "shear"), 0.2
    ours = analysis.helfand_increments(
        stress, dt, volume=VOLUME, component=component, max_lag=15, n_blocks=3
    )
    series = columns(stress, component)
    bounds = [round(91 * b / 3) for b in range(4)]  # 91 ends of intervals
    for block in range(3):
        for lag in range(16):
            squares = [
                (VOLUME * dt * column[start : start + lag].sum()) ** 2
                for column in series
                for start in range(bounds[block], min(bounds[block + 1], 91 - lag))
            ]
            bias = 1.0 if component == "shear" else 1.0 - lag / 90
            loop = np.mean(squares) / bias
            assert ours.blocks[block, lag] == pytest.approx(loop, rel=1e-10, abs=1e-10)
    assert ours.lag == pytest.approx(dt * np.arange(16))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("component", ["shear", "longitudinal", "trace"])
def test_autocorrelation_equals_loops(component, dimension):
    stress = SMALL[:, :dimension, :dimension] + 3.0 * (component != "shear")
    ours = analysis.stress_autocorrelation(stress, 0.2, component=component, max_lag=15, n_blocks=3)
    series = columns(stress, component)
    loop = np.array(
        [np.mean([c[s] * c[s + lag] for c in series for s in range(90 - lag)]) for lag in range(16)]
    )
    if component != "shear":
        loop += (loop[0] + 2.0 * loop[1:].sum()) / (90 - 31)
    assert ours.mean == pytest.approx(loop, abs=1e-12)


def test_the_stress_is_not_symmetrized():
    """An antisymmetric stress has a viscosity; its symmetric part would have none."""
    stress = white(400, 3, 0.1, 1.0, seed=72)
    swapped = np.swapaxes(stress, 1, 2)
    arguments = {"volume": VOLUME, "max_lag": 3, "n_blocks": 8}
    whole = analysis.helfand_increments(stress, 0.1, **arguments).mean[1]
    even, odd = (
        analysis.helfand_increments(0.5 * (stress + s * swapped), 0.1, **arguments).mean[1]
        for s in (1.0, -1.0)
    )
    assert whole == pytest.approx(even + odd)
    assert odd > 0.4 * whole


def test_green_kubo_of_means_is_the_slope_of_the_moment():
    dt, tau, variance = 0.7, 1.3, 2.1
    lag = dt * np.arange(12)
    c = exact(lag, means_of_ou(12, dt, tau, variance))
    moment = helfand_of_ou(dt * np.arange(13), tau, variance)
    slope = np.diff(moment) / (2.0 * VOLUME * ENERGY * dt)
    running = analysis.running_viscosity(c, volume=VOLUME, thermal_energy=ENERGY)
    assert running.mean == pytest.approx(slope, rel=1e-12)
    for n in (0, 4, 11):
        eta = analysis.green_kubo_viscosity(
            c, volume=VOLUME, thermal_energy=ENERGY, cutoff=lag[n] or 1e-3
        )
        assert eta.value == pytest.approx(slope[n], rel=1e-12)
        assert eta.window == pytest.approx((0.0, lag[n]))


def test_helfand_slope_of_a_closed_form_on_uneven_lags():
    tau, variance = 1.3, 2.1
    lag = np.concatenate([np.arange(16.0), 8.0 * 2.0 ** np.arange(1, 6)]) * 0.1
    lag = np.unique(np.round(np.append(lag, [20.0, 24.0, 28.0]), 9))
    eta = analysis.einstein_viscosity(
        exact(lag, helfand_of_ou(lag, tau, variance)),
        volume=VOLUME,
        thermal_energy=ENERGY,
        window=(12.0, 28.0),
    )
    assert eta.value == pytest.approx(VOLUME * variance * tau / ENERGY, rel=1e-3)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("component", ["shear", "longitudinal", "trace"])
def test_white_stress_has_its_viscosity_at_every_lag(component, dimension):
    dt, eta = 1e-12, 8.9e-4  # SI magnitudes
    stress = white(40_000, dimension, dt, eta, seed=73)
    expected = eta / dimension if component == "trace" else eta
    moment = analysis.helfand_increments(stress, dt, volume=VOLUME, component=component, max_lag=60)
    c = analysis.stress_autocorrelation(stress, dt, component=component, max_lag=20)
    cell = {"volume": VOLUME, "thermal_energy": ENERGY}
    family = [
        analysis.einstein_viscosity(moment, window=(0.0, 10 * dt), **cell),
        analysis.einstein_viscosity(moment, window=(5 * dt, 60 * dt), **cell),
        analysis.green_kubo_viscosity(c, cutoff=0.5 * dt, **cell),
        analysis.green_kubo_viscosity(c, **cell),
    ]
    assert analysis.bonferroni([e.p(expected) for e in family]).smallest > 1e-3
    assert family[0].relative < 0.02
    assert family[2].relative < 0.015
    assert family[3].relative < 0.08
    assert family[0].n_effective == 32


def test_ornstein_uhlenbeck_and_a_mix_of_both():
    dt, tau, variance, delta = 0.5, 1.0, 0.08, 0.6
    slow = ornstein_uhlenbeck(60_000, 3, dt, tau, variance, seed=74)
    both = slow + white(60_000, 3, dt, delta, seed=75)
    slow_eta = VOLUME * variance * tau / ENERGY
    cell = {"volume": VOLUME, "thermal_energy": ENERGY}
    p = []
    for stress, extra in ((slow, 0.0), (both, delta)):
        moment = analysis.helfand_increments(stress, dt, volume=VOLUME, max_lag=40)
        curve = helfand_of_ou(moment.lag, tau, variance)
        curve += 2.0 * VOLUME * ENERGY * extra * moment.lag
        p += [moment.at(n).p(curve[n]) for n in (1, 2, 5, 20)]
        c = analysis.stress_autocorrelation(stress, dt, max_lag=30)
        means = means_of_ou(31, dt, tau, variance)
        means[0] += 2.0 * extra * ENERGY / (VOLUME * dt)
        p += [c.at(n).p(means[n]) for n in (0, 1, 4, 10)]
        long = analysis.einstein_viscosity(moment, window=(8.0, 20.0), **cell)
        green_kubo = analysis.green_kubo_viscosity(c, cutoff=8.0, **cell)
        assert long.relative < 0.04
        assert green_kubo.relative < 0.03
        p += [long.p(slow_eta + extra), green_kubo.p(slow_eta + extra)]
    # the slope at the first lags has the delta part and a little of the rest
    first = analysis.einstein_viscosity(moment, window=(0.0, dt), **cell)
    p.append(first.p(curve[1] / (2.0 * VOLUME * ENERGY * dt)))
    assert analysis.bonferroni(p).smallest > 1e-3
    assert max(long.stderr, green_kubo.stderr) < 0.2 * delta  # the delta part is seen


@pytest.mark.parametrize("dimension", [2, 3])
def test_bulk_is_what_longitudinal_waves_have_beyond_shear(dimension):
    """Noise of pairs, <P_ab P_cd> ~ a d_ac d_bd + b/(D + 2) (d d + d d + d d): not the trace."""
    eta, zeta, dt, rows = 1.3, 0.5, 1.0, 40_000
    across, along = theory.friction_coefficients(eta, zeta, dimension)
    one, two = np.random.default_rng(77).normal(size=(2, rows, dimension, dimension))
    symmetric = np.sqrt(along / (dimension + 2.0)) * (one + np.swapaxes(one, 1, 2)) / np.sqrt(2.0)
    trace = np.random.default_rng(78).normal(size=(rows, 1, 1)) * np.eye(dimension)
    symmetric += np.sqrt(along / (dimension + 2.0)) * trace
    stress = np.sqrt(ENERGY / (VOLUME * dt)) * (np.sqrt(across) * two + symmetric)
    cell = {"volume": VOLUME, "thermal_energy": ENERGY}
    expected = {
        "shear": eta,
        "bulk": zeta,
        "longitudinal": zeta + eta * (2.0 - 2.0 / dimension),
        "trace": (across + along) / (2.0 * dimension),
    }
    p = []
    for component, exact_value in expected.items():
        moment = analysis.helfand_increments(
            stress, dt, volume=VOLUME, component=component, max_lag=20
        )
        c = analysis.stress_autocorrelation(stress, dt, component=component, max_lag=5)
        estimates = (
            analysis.einstein_viscosity(moment, window=(0.0, 10.0), **cell),
            analysis.green_kubo_viscosity(c, cutoff=2.0, **cell),
        )
        p += [e.p(exact_value) for e in estimates]
        assert max(e.stderr for e in estimates) < 0.06
    assert analysis.bonferroni(p).smallest > 1e-3
    assert abs(expected["trace"] - zeta) > 0.3


def test_taking_the_mean_off_does_not_bias():
    """Short runs: without the correction the answers are 12 and 24 % low."""
    dt, eta, rows, lags = 1.0, 1.0, 240, 28
    cell = {"volume": VOLUME, "thermal_energy": ENERGY}
    slopes, sums, raw = [], [], []
    for seed in range(400):
        stress = white(rows, 2, dt, eta, seed=1000 + seed) + 5.0
        arguments = {"component": "longitudinal", "n_blocks": 8}
        moment = analysis.helfand_increments(stress, dt, volume=VOLUME, max_lag=lags, **arguments)
        slopes.append(
            analysis.einstein_viscosity(moment, window=(0.0, 28.0), weights="uniform", **cell)
        )
        c = analysis.stress_autocorrelation(stress, dt, max_lag=lags, **arguments)
        sums.append(analysis.green_kubo_viscosity(c, **cell))
        plain = analysis.autocorrelation(
            np.diagonal(stress, axis1=1, axis2=2), dt, max_lag=lags, n_blocks=8, subtract_mean=True
        )
        raw.append(analysis.green_kubo_viscosity(plain, **cell))
    slope, whole, biased = (analysis.ensemble([e.value for e in x]) for x in (slopes, sums, raw))
    assert abs(slope.z(eta)) < 4.0
    assert slope.relative < 0.03
    assert abs(whole.z(eta)) < 4.0
    assert whole.relative < 0.04
    assert biased.z(eta) < -5.0


def test_error_bars_are_calibrated():
    z = []
    for seed in range(60):
        stress = white(3200, 2, 1.0, 1.0, seed=2000 + seed)
        moment = analysis.helfand_increments(stress, 1.0, volume=VOLUME, max_lag=20)
        z.append(
            analysis.einstein_viscosity(
                moment, volume=VOLUME, thermal_energy=ENERGY, window=(2.0, 20.0)
            ).z(1.0)
        )
    assert 0.75 < np.std(z, ddof=1) < 1.35
    assert abs(np.mean(z)) < 4.0 / np.sqrt(60)


def test_virial_pressure_by_parts():
    generator = np.random.default_rng(76)
    kinds = [(name, float, (2, 2)) for name in ("kinetic", "conservative", "dissipative", "random")]
    data = np.zeros(3200, dtype=[("step", int), *kinds])
    for name, mean in (("kinetic", 2.0), ("conservative", 7.0)):
        data[name] = mean * np.eye(2)
    for name, _, _ in kinds:
        data[name] += generator.normal(size=(3200, 2, 2))
    data["random"] -= data["dissipative"]  # parts may be correlated: the total knows
    pressure = analysis.virial_pressure(data)
    for name, exact_mean in (
        ("kinetic", 2),
        ("conservative", 7),
        ("dissipative", 0),
        ("random", 0),
    ):
        estimate = getattr(pressure, name)
        assert abs(estimate.z(exact_mean)) < 4.0
        assert estimate.value == pytest.approx(np.trace(data[name].mean(axis=0)) / 2.0, abs=1e-12)
    assert pressure.total.value == pytest.approx(
        pressure.kinetic.value
        + pressure.conservative.value
        + pressure.dissipative.value
        + pressure.random.value
    )
    assert pressure.total.stderr == pytest.approx(np.sqrt(1.5 / 3200), rel=0.35)
    named = analysis.virial_pressure({name: data[name] for name, _, _ in kinds})
    assert named == pressure


OU = exact(np.arange(5.0), np.ones(5))
CELL = {"volume": 1.0, "thermal_energy": 1.0}


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (
            lambda: analysis.helfand_increments(SMALL[:, 0], 1.0, volume=1.0, max_lag=3),
            ValueError,
            "`stress` must be 3-d",
        ),
        (
            lambda: analysis.helfand_increments(SMALL[:, :2], 1.0, volume=1.0, max_lag=3),
            ValueError,
            r"`stress` must have shape \(T, D, D\)",
        ),
        (
            lambda: analysis.helfand_increments(SMALL, 1.0, volume=0.0, max_lag=3),
            ValueError,
            "`volume` must be finite and > 0",
        ),
        (
            lambda: analysis.helfand_increments(SMALL, -1.0, volume=1.0, max_lag=3),
            ValueError,
            "`dt` must be finite and > 0",
        ),
        (
            lambda: analysis.helfand_increments(SMALL, 1.0, volume=1.0, max_lag=30, n_blocks=4),
            ValueError,
            "`max_lag` must be < T // n_blocks",
        ),
        (
            lambda: analysis.stress_autocorrelation(SMALL, 1.0, component="xy", max_lag=3),
            ValueError,
            "`component` must be one of",
        ),
        (
            lambda: analysis.green_kubo_viscosity(OU, volume=1.0, thermal_energy=-1.0),
            ValueError,
            "`thermal_energy` must be",
        ),
        (
            lambda: analysis.green_kubo_viscosity(OU, cutoff=5.0, **CELL),
            ValueError,
            "`cutoff` must be <= the last lag 4",
        ),
        (
            lambda: analysis.green_kubo_viscosity(OU.at_lags([0, 1, 3]), **CELL),
            ValueError,
            "`lag` must be equally spaced",
        ),
        (
            lambda: analysis.running_viscosity(OU.at_lags([1, 2, 3]), **CELL),
            ValueError,
            "`lag` must begin at 0, got 1",
        ),
        (
            lambda: analysis.einstein_viscosity(OU, window=(0.2, 0.9), **CELL),
            ValueError,
            "`window` must hold at least 2 lags",
        ),
        (
            lambda: analysis.bulk_component(OU, OU.at_lags([0, 1]), dimension=3),
            ValueError,
            "`shear` must have the lags",
        ),
        (
            lambda: analysis.bulk_component(OU, OU, dimension=4),
            ValueError,
            "`dimension` must be between 2 and 3",
        ),
        (lambda: analysis.virial_pressure({"kinetic": SMALL}), ValueError, "must have the parts"),
        (lambda: analysis.virial_pressure(SMALL), ValueError, "must have the parts"),
        (
            lambda: analysis.virial_pressure(
                {
                    "kinetic": SMALL,
                    "conservative": SMALL[:9],
                    "dissipative": SMALL,
                    "random": SMALL,
                }
            ),
            ValueError,
            "parts of equal length, got",
        ),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()
