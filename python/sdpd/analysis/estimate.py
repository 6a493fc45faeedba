"""An estimate is a number with its standard error; families of estimates are judged together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, choice, finite, integer, real_array

__all__ = [
    "Bonferroni",
    "Estimate",
    "Homogeneity",
    "bonferroni",
    "combine",
    "ensemble",
    "homogeneity",
    "jackknife",
]


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error.

    Attributes
    ----------
    value : float
        The estimate, in the unit of the quantity.
    stderr : float
        Standard error of `value` (one standard deviation), same unit.
    n_effective : float
        Number of independent samples (blocks, replicas) behind `stderr`; the Student t test
        has ``n_effective - 1`` degrees of freedom.
    window : tuple of float or None
        What was sampled: (start, stop) of the lags or of the times used.
    """

    value: float
    stderr: float
    n_effective: float = math.inf
    window: tuple[float, float] | None = None

    @property
    def relative(self) -> float:
        """Standard error over the magnitude of the value."""
        return self.stderr / abs(self.value) if self.value else math.inf

    def z(self, expected: float | Estimate) -> float:
        """Distance from `expected` in standard errors (both errors count for an Estimate)."""
        other, variance = _value_and_variance(expected)
        total = math.sqrt(self.stderr**2 + variance)
        difference = self.value - other
        if total == 0.0:
            return 0.0 if difference == 0.0 else math.copysign(math.inf, difference)
        return difference / total

    def p(self, expected: float | Estimate) -> float:
        """Two-sided probability of a distance at least as large, by Student's t."""
        from scipy import stats

        z = abs(self.z(expected))
        freedom = self._freedom(expected)
        return float(2.0 * (stats.t.sf(z, freedom) if math.isfinite(freedom) else stats.norm.sf(z)))

    def agrees(self, expected: float | Estimate, *, level: float = 1e-3) -> bool:
        """Whether `expected` is not rejected at the significance `level`."""
        return self.p(expected) >= level

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Confidence interval by Student's t."""
        from scipy import stats

        if not 0.0 < finite("confidence", confidence) < 1.0:
            raise ValueError(f"`confidence` must lie between 0 and 1, got {confidence}")
        freedom = self._freedom(0.0)
        tail = 0.5 * (1.0 - confidence)
        factor = stats.t.isf(tail, freedom) if math.isfinite(freedom) else stats.norm.isf(tail)
        return self.value - float(factor) * self.stderr, self.value + float(factor) * self.stderr

    @classmethod
    def merge(cls, members: Sequence[Estimate], *, weights: str = "equal") -> Estimate:
        """Pool estimates of independent runs: :func:`sdpd.analysis.combine`."""
        return combine(members, weights=weights)

    def scaled(self, factor: float) -> Estimate:
        """Multiply by an exactly known factor."""
        return replace(self, value=self.value * factor, stderr=self.stderr * abs(factor))

    def reciprocal(self, numerator: float = 1.0) -> Estimate:
        """``numerator / value`` with the error carried to first order."""
        value = numerator / self.value
        return replace(self, value=value, stderr=abs(value) * self.relative)

    def _freedom(self, expected: float | Estimate) -> float:
        own = max(self.n_effective - 1.0, 1.0)
        if not isinstance(expected, Estimate) or expected.stderr == 0.0:
            return own
        other = max(expected.n_effective - 1.0, 1.0)
        weights = (self.stderr**4 / own) + (expected.stderr**4 / other)  # Welch-Satterthwaite
        return (self.stderr**2 + expected.stderr**2) ** 2 / weights if weights else math.inf

    def __str__(self) -> str:
        return f"{self.value:.6g} +- {self.stderr:.2g}"


@dataclass(frozen=True)
class Bonferroni:
    """A family of tests judged together.

    Attributes
    ----------
    adjusted : ndarray, shape (M,)
        ``min(1, M p)``.
    rejected : ndarray of bool, shape (M,)
        Which tests fail at the family's level.
    smallest : float
        Smallest adjusted p-value.
    """

    adjusted: Array
    rejected: NDArray[np.bool_]
    smallest: float


@dataclass(frozen=True)
class Homogeneity:
    """Whether independent estimates agree with each other.

    Attributes
    ----------
    chi_square : float
        Sum of the squared distances from the mean weighted by inverse variances, in standard
        errors [1].
    freedom : int
        Its expectation where all agree, one less than there are estimates.
    p : float
        Probability of a spread at least as large, by Welch's test: errors are themselves estimates.
    mean : float
        The weighted mean.
    """

    chi_square: float
    freedom: int
    p: float
    mean: float

    def agrees(self, *, level: float = 1e-3) -> bool:
        """Whether agreement is not rejected at the significance `level`."""
        return self.p >= level


def ensemble(
    values: ArrayLike | Sequence[Estimate], *, window: tuple[float, float] | None = None
) -> Estimate:
    """Mean over independent replicas with the standard error of their spread.

    Parameters
    ----------
    values : array_like, shape (R,), or sequence of Estimate
        One number per replica, R >= 2, any unit. The replicas' own errors are not used: see
        :func:`homogeneity` for whether they explain the spread.
    window : tuple of float, optional
        Sampling window to carry along.

    Returns
    -------
    Estimate

    Raises
    ------
    ValueError
        If fewer than two finite values are given.
    """
    numbers: Any = values
    members = [v for v in values if isinstance(v, Estimate)] if isinstance(values, Sequence) else []
    if members and len(members) == len(numbers):
        windows = {member.window for member in members}
        window = windows.pop() if window is None and len(windows) == 1 else window
        numbers = [member.value for member in members]
    data = real_array("values", numbers, 1).astype(np.float64)
    if data.size < 2:
        raise ValueError(f"`values` must hold at least 2 replicas, got {data.size}")
    stderr = float(data.std(ddof=1)) / math.sqrt(data.size)
    return Estimate(float(data.mean()), stderr, float(data.size), window)


def combine(estimates: Sequence[Estimate], *, weights: str = "equal") -> Estimate:
    """One estimate from several independent ones.

    Parameters
    ----------
    estimates : sequence of Estimate
        At least one; independent of each other.
    weights : {"equal", "inverse_variance"}
        Equal weights are unbiased whatever the errors; inverse variances are sharper when
        every error is itself well known.

    Returns
    -------
    Estimate
        Error from the members' own errors; ``n_effective`` by Welch-Satterthwaite.

    Raises
    ------
    ValueError
        If `estimates` is empty, or a zero error meets inverse-variance weights.
    """
    choice("weights", weights, ("equal", "inverse_variance"))
    members = list(estimates)
    if not members:
        raise ValueError("`estimates` must not be empty")
    values = np.array([e.value for e in members])
    errors = np.array([e.stderr for e in members])
    if weights == "inverse_variance":
        if not (errors > 0.0).all():
            raise ValueError("`estimates` must all have stderr > 0 for inverse-variance weights")
        share = errors**-2.0 / np.sum(errors**-2.0)
    else:
        share = np.full(len(members), 1.0 / len(members))
    terms = (share * errors) ** 2
    variance = float(terms.sum())
    freedoms = np.array([max(e.n_effective - 1.0, 1.0) for e in members])
    spread = float(np.sum(terms**2 / freedoms))
    windows = {e.window for e in members}
    return Estimate(
        float(np.sum(share * values)),
        math.sqrt(variance),
        variance**2 / spread + 1.0 if spread > 0.0 else math.inf,
        windows.pop() if len(windows) == 1 else None,
    )


def homogeneity(estimates: Sequence[Estimate]) -> Homogeneity:
    """Test whether independent estimates of one quantity agree with each other.

    Parameters
    ----------
    estimates : sequence of Estimate
        At least two, each with ``stderr > 0``; independent of each other.

    Returns
    -------
    Homogeneity

    Raises
    ------
    ValueError
        If there are fewer than two, or one has no error.

    Notes
    -----
    With exactly known errors the sum of squares is a chi-square. Errors from B blocks make its tail
    heavier, which Welch's F accounts for [1]_; it is the chi-square test as all B grow. Runs whose
    errors come from blocks too short for their correlation time fail here.

    References
    ----------
    .. [1] Welch, Biometrika 38, 330 (1951).

    Examples
    --------
    >>> from sdpd.analysis import Estimate, homogeneity
    >>> test = homogeneity([Estimate(1.0, 0.1, 32), Estimate(1.1, 0.1, 32), Estimate(0.9, 0.1, 32)])
    >>> round(test.chi_square, 9), test.freedom, test.agrees()
    (2.0, 2, True)
    """
    from scipy import stats

    members = list(estimates)
    count = len(members)
    if count < 2:
        raise ValueError(f"`estimates` must hold at least 2, got {count}")
    values = np.array([e.value for e in members])
    errors = np.array([e.stderr for e in members])
    if not (errors > 0.0).all():
        raise ValueError("`estimates` must all have stderr > 0")
    share = errors**-2.0 / np.sum(errors**-2.0)
    mean = float(share @ values)
    chi_square = float(np.sum(((values - mean) / errors) ** 2))
    freedoms = np.array([max(e.n_effective - 1.0, 1.0) for e in members])
    looseness = float(np.sum((1.0 - share) ** 2 / freedoms))
    if looseness == 0.0:
        p = float(stats.chi2.sf(chi_square, count - 1))
    else:
        ratio = chi_square / (count - 1)
        ratio /= 1.0 + 2.0 * (count - 2) / (count**2 - 1.0) * looseness
        p = float(stats.f.sf(ratio, count - 1, (count**2 - 1.0) / (3.0 * looseness)))
    return Homogeneity(chi_square, count - 1, p, mean)


def jackknife(leave_one_out: ArrayLike, value: float) -> tuple[float, float]:
    """Bias-corrected value and standard error from delete-one values.

    Parameters
    ----------
    leave_one_out : array_like, shape (B,)
        The statistic with block b left out, B >= 2.
    value : float
        The statistic from all blocks.

    Returns
    -------
    value, stderr : float
    """
    data = real_array("leave_one_out", leave_one_out, 1).astype(np.float64)
    count = integer("len(leave_one_out)", data.size, low=2)
    mean = float(data.mean())
    stderr = math.sqrt((count - 1) / count * float(np.sum((data - mean) ** 2)))
    return count * value - (count - 1) * mean, stderr


def bonferroni(p_values: ArrayLike, *, level: float = 1e-3) -> Bonferroni:
    """Judge a family of tests at one family-wise significance level.

    Parameters
    ----------
    p_values : array_like, shape (M,)
        Two-sided p-values, each between 0 and 1.
    level : float
        Probability of any false rejection in the whole family, between 0 and 1.

    Returns
    -------
    Bonferroni

    Raises
    ------
    ValueError
        If a p-value or `level` lies outside [0, 1].
    """
    p = real_array("p_values", p_values, 1).astype(np.float64)
    if (p < 0.0).any() or (p > 1.0).any():
        raise ValueError("`p_values` must lie between 0 and 1")
    if not 0.0 < finite("level", level) < 1.0:
        raise ValueError(f"`level` must lie between 0 and 1, got {level}")
    adjusted = np.minimum(1.0, p * p.size)
    return Bonferroni(adjusted, adjusted < level, float(adjusted.min()))


def _value_and_variance(expected: float | Estimate) -> tuple[float, float]:
    if isinstance(expected, Estimate):
        return expected.value, expected.stderr**2
    return finite("expected", expected), 0.0
