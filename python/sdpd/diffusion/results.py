"""From the samples of all replicas of a case to numbers with standard errors, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis.correlation import Correlation
from sdpd.analysis.diffusion import short_time_diffusion
from sdpd.analysis.estimate import Estimate
from sdpd.diffusion.cases import Case, Formulas, formulas
from sdpd.diffusion.measure import SLOPE_LAGS, STATE, Sample
from sdpd.diffusion.plan import Plan
from sdpd.scene import Scene

__all__ = ["CaseResult", "Limits", "assess", "evaluate", "integral_weights", "slope_weights"]

Array = NDArray[np.float64]

SLOPE_ORDER = 2


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a case must reach.

    Attributes
    ----------
    short_error, long_error : float
        Largest relative standard error of the short-time and of both long-time coefficients.
    deviation : float
        Largest distance of the short-time coefficient from its exact prediction [standard errors].
    temperature : float
        Largest relative deviation of the temperature, where three standard errors are less.
    drift_level : float
        Smallest p-value of a drift of temperature, density or pressure over the blocks.
    """

    short_error: float = 0.02
    long_error: float = 0.10
    deviation: float = 3.0
    temperature: float = 0.005
    drift_level: float = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """One case, measured.

    Attributes
    ----------
    case, scene, plan, formulas
        What was run and what formulas say.
    temperature, density, pressure : Estimate
        Kinetic temperature, mean density and pressure of the particles.
    temperature_variance : Estimate
        Of the kinetic temperature in time, over 2 T^2/(3 (N - 1)), that of free velocities [1].
    drifts : dict of Estimate
        Change of each of these from the first to the last block, relative to its mean.
    rate, exact_rate : Estimate
        Initial decay rate of the VACF, measured, and <sum_j g_ij (a + b/D)>/m [1/time].
    short, exact : Estimate
        Short-time self-diffusion coefficient (k_B T/m) / rate of both [length^2/time].
    msd, integral : Estimate
        Long-time self-diffusion from the mean-square displacement and from the VACF's integral;
        ``window`` is the lags used.
    slopes : tuple of Estimate
        As `msd`, from the first and from the second half of the window.
    step_bias : float
        What the finite step added to the slope of the displacement, taken off [length^2/time].
    lag, msd_curve, vacf_curve : ndarray, shape (L,)
        Means over all blocks; the VACF over k_B T/m [time, length^2, 1].
    seconds : float
        Wall time of all replicas together [s].
    """

    case: Case
    scene: Scene
    plan: Plan
    formulas: Formulas
    temperature: Estimate
    density: Estimate
    pressure: Estimate
    temperature_variance: Estimate
    drifts: dict[str, Estimate]
    rate: Estimate
    exact_rate: Estimate
    short: Estimate
    exact: Estimate
    msd: Estimate
    integral: Estimate
    slopes: tuple[Estimate, Estimate]
    step_bias: float
    lag: Array
    msd_curve: Array
    vacf_curve: Array
    seconds: float

    @property
    def deviation(self) -> float:
        """Short-time coefficient minus its exact prediction in standard errors."""
        return self.short.z(self.exact)

    @property
    def friction_time(self) -> float:
        """tau as measured [time]."""
        return 1.0 / self.exact_rate.value

    def is_steady(self, level: float) -> bool:
        """Whether no drift is significant at that level, of all drifts together."""
        return all(drift.p(0.0) >= level / len(self.drifts) for drift in self.drifts.values())

    def schmidt(self, diffusion: Estimate) -> Estimate:
        """eta/(rho D) at the mean density of the fluid."""
        return diffusion.reciprocal(self.scene.fluid.kinematic_viscosity)


def slope_weights(lag: Array, dt: float, window: tuple[float, float]) -> Array:
    """Weights w of ``w @ msd``: slope of a straight line with intercept over the lags in `window`.

    Each lag counts by the inverse variance that overlapping displacements of a Brownian walk have,
    lag (2 lag^2 + 1) in units of dt.
    """
    inside = (lag >= window[0] * (1.0 - 1e-9)) & (lag <= window[1] * (1.0 + 1e-9))
    if inside.sum() < 2:
        raise ValueError(f"`window` must hold at least 2 lags, got {window}")
    steps = lag / dt
    weight = np.where(inside, 1.0 / np.maximum(steps * (2.0 * steps**2 + 1.0), 1.0), 0.0)
    weight /= weight.sum()
    centered = lag - weight @ lag
    return np.asarray(weight * centered / (weight @ centered**2))


def integral_weights(lag: Array, cutoff: float) -> Array:
    """Weights w of ``w @ vacf``: Simpson's rule from 0 to `cutoff` over lags in octaves.

    The spacing of the lags must double at most after an even number of intervals.
    """
    weight = np.zeros_like(lag)
    last = int(np.searchsorted(lag, cutoff * (1.0 + 1e-9))) - 1
    for k in range(0, last - 1, 2):
        width = lag[k + 2] - lag[k]
        if abs(lag[k + 1] - lag[k] - 0.5 * width) > 1e-9 * width:
            raise ValueError(f"`lag` must be even in pairs of intervals, got {lag[k : k + 3]}")
        weight[k : k + 3] += width / 6.0 * np.array([1.0, 4.0, 1.0])
    if last % 2:
        weight[last - 1 : last + 1] += 0.5 * (lag[last] - lag[last - 1])
    return weight


def evaluate(case: Case, scene: Scene, plan: Plan, samples: Sequence[Sample]) -> CaseResult:
    """Combine the replicas of a case.

    The blocks of all replicas are the samples behind every standard error.
    """
    variance = scene.thermal_energy / scene.particle_mass
    number = scene.n_particles
    state = np.concatenate([sample.state for sample in samples])
    temperature, density, pressure = (_mean(state[:, k]) for k in range(len(STATE)))
    spread = _mean(np.concatenate([sample.temperature_square for sample in samples]))
    drifts = {
        name: _drift([sample.state[:, k] for sample in samples]) for k, name in enumerate(STATE)
    }
    slope = _slope(samples)
    measured = short_time_diffusion(slope, n_lags=SLOPE_LAGS, order=SLOPE_ORDER)
    # C(0) is (1 - 1/N) k_B T/m at zero total momentum, its slope is not diminished
    rate = measured.rate.scaled(1.0 - 1.0 / number)
    exact_rate = _mean(np.concatenate([sample.rate for sample in samples]))
    msd, vacf = _long(samples, "msd"), _long(samples, "vacf")
    bias = variance * exact_rate.value * plan.long**2 / 12.0
    first, last = plan.window
    middle = math.sqrt(first * last)
    windows = ((first, last), (first, middle), (middle, last))
    slopes = [_einstein(msd, plan.long, window, bias) for window in windows]
    end = min(plan.cutoff, float(msd.lag[-1]))
    weights = integral_weights(vacf.lag, end)
    return CaseResult(
        case=case,
        scene=scene,
        plan=plan,
        formulas=formulas(scene),
        temperature=temperature,
        density=density,
        pressure=pressure,
        temperature_variance=spread.scaled(1.5 * (number - 1.0)),
        drifts=drifts,
        rate=rate,
        exact_rate=exact_rate,
        short=rate.reciprocal(variance),
        exact=exact_rate.reciprocal(variance),
        msd=slopes[0],
        integral=vacf.derive(lambda mean: float(weights @ mean), window=(0.0, end)),
        slopes=(slopes[1], slopes[2]),
        step_bias=bias,
        lag=msd.lag,
        msd_curve=msd.mean,
        vacf_curve=vacf.mean / variance,
        seconds=sum(sample.seconds for sample in samples),
    )


def assess(result: CaseResult, limits: Limits) -> list[str]:
    """What fails, one sentence each; empty if the case passes."""
    failures = []
    for label, estimate, limit in (
        ("short-time D from the VACF", result.short, limits.short_error),
        ("long-time D from the MSD", result.msd, limits.long_error),
        ("long-time D from the VACF integral", result.integral, limits.long_error),
    ):
        if not estimate.relative <= limit:
            failures.append(
                f"{label} has a standard error of {estimate.relative:.1%}, more than {limit:.0%}"
            )
    if not abs(result.deviation) <= limits.deviation:
        failures.append(
            f"short-time D is {result.deviation:+.1f} standard errors from its exact prediction, "
            f"more than {limits.deviation:g}"
        )
    asked = result.scene.fluid.temperature
    off = result.temperature.value / asked - 1.0
    if not abs(off) <= max(limits.temperature, 3.0 * result.temperature.relative):
        failures.append(f"the kinetic temperature is off by {off:+.2%}")
    for name, drift in result.drifts.items():
        if drift.p(0.0) < limits.drift_level / len(result.drifts):
            failures.append(
                f"{name.replace('_', ' ')} drifts by {drift.value:+.2%} over the blocks "
                f"({drift.z(0.0):+.1f} standard errors): not equilibrated"
            )
    return failures


def _slope(samples: Sequence[Sample]) -> Correlation:
    """Normalised VACF of the short blocks of all replicas."""
    blocks = np.concatenate([sample.short_vacf for sample in samples])
    lag = samples[0].short_lag
    return Correlation(
        lag=lag, blocks=blocks, block_counts=np.ones_like(blocks), window=(0.0, float(lag[-1]))
    )


def _long(samples: Sequence[Sample], name: str) -> Correlation:
    """A function of the long lags from the blocks of all replicas."""
    lag = samples[0].lag
    return Correlation(
        lag=lag,
        blocks=np.concatenate([getattr(sample, name) for sample in samples]),
        block_counts=np.concatenate([sample.counts for sample in samples]),
        window=(0.0, float(lag[-1])),
        dimension=3,
    )


def _einstein(msd: Correlation, dt: float, window: tuple[float, float], bias: float) -> Estimate:
    """Slope/6 of the displacement without what the finite step adds."""
    weights = slope_weights(msd.lag, dt, window)
    used = msd.lag[weights != 0.0]
    return msd.derive(
        lambda mean: float(weights @ mean) / 6.0 - bias, window=(float(used[0]), float(used[-1]))
    )


def _mean(values: Array) -> Estimate:
    """Mean of block means that are independent of each other."""
    stderr = float(values.std(ddof=1)) / math.sqrt(values.size)
    return Estimate(float(values.mean()), stderr, float(values.size))


def _drift(series: Sequence[Array]) -> Estimate:
    """Relative change over the blocks: a common slope, each replica with its own mean."""
    length = series[0].size
    index = np.tile(np.arange(length) - 0.5 * (length - 1), len(series))
    residual = np.concatenate([values - values.mean() for values in series])
    square = float(index @ index)
    slope = float(index @ residual) / square
    freedom = index.size - len(series) - 1
    left = residual - slope * index
    error = math.sqrt(float(left @ left) / freedom / square)
    scale = (length - 1) / abs(float(np.concatenate(series).mean()))
    return Estimate(slope * scale, error * scale, freedom + 1.0)
