"""Viscosity from transverse currents: their decay at each wave number, carried on to k = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Correlation, CurrentCorrelations, Estimate, jackknife

__all__ = ["Shell", "decay_rate", "excess", "shell_viscosities"]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Shell:
    """Transverse currents of one wave number.

    Attributes
    ----------
    wave_number : float
        [1/length].
    n_vectors : int
        Wave vectors averaged.
    correlation : Correlation
        C(t) [length^2/time^2].
    viscosity : Estimate
        eta(k) [pressure x time]; ``window`` is the lags used.
    leave_one_out : ndarray, shape (B,)
        The same without each block.
    """

    wave_number: float
    n_vectors: int
    correlation: Correlation
    viscosity: Estimate
    leave_one_out: Array


def decay_rate(lag: Array, values: Array) -> float:
    """Rate of the exponential that has the sum of a correlation function over its lags [1/time].

    Parameters
    ----------
    lag, values : ndarray, shape (L,)
        From lag 0, not necessarily equally spaced.

    Returns
    -------
    float
        The l whose exp(-l t) has the trapezoidal sum that ``values/values[0]`` has. For a function
        that has decayed this is one over its integral, without the error of the trapezoidal rule;
        what an exponential still has beyond the last lag is allowed for.

    Raises
    ------
    ValueError
        If no exponential has that sum.
    """
    from scipy import optimize

    width = np.diff(lag)
    weight = 0.5 * (np.append(width, 0.0) + np.insert(width, 0, 0.0))
    area = float(weight @ values) / float(values[0])
    if not weight[0] < area < weight.sum():
        raise ValueError(
            "`values` must decay within the lags, and not at once: no exponential has their sum"
        )
    low = math.log(1e-6 / lag[-1])
    high = math.log(700.0 / lag[1])

    def difference(log: float) -> float:
        return float(weight @ np.exp(-math.exp(log) * lag)) - area

    return math.exp(optimize.brentq(difference, low, high, xtol=1e-9))


def shell_viscosities(
    currents: Sequence[CurrentCorrelations], *, density: float, last: float
) -> list[Shell]:
    """eta(k) = rho l/k^2 at each wave number.

    Parameters
    ----------
    currents : sequence of CurrentCorrelations
    density : float
        Mass density [mass/length^D].
    last : float
        Last lag of the integral [time].
    """
    shells = []
    for each in currents:
        function, k = each.transverse, each.wave_number
        count = max(3, int(np.searchsorted(function.lag, last * (1.0 + 1e-9))))
        lag = function.lag[:count]
        unit = density / k**2
        leave = np.array([unit * decay_rate(lag, r[:count]) for r in function.leave_one_out()])
        # one over an integral is too high by its relative variance: the jackknife takes that off
        value, stderr = jackknife(leave, unit * decay_rate(lag, function.mean[:count]))
        span = (0.0, float(lag[-1]))
        estimate = Estimate(value, stderr, float(leave.size), span)
        shells.append(
            Shell(
                wave_number=k,
                n_vectors=len(each.wave_vectors),
                correlation=function,
                viscosity=estimate,
                leave_one_out=leave,
            )
        )
    return shells


def excess(
    shells: Sequence[Shell],
    base: Sequence[float],
    shape: Sequence[float],
    expected: Sequence[float],
) -> tuple[Estimate, Array, float]:
    """What the fluid adds to its friction at k = 0, from all wave numbers together.

    Parameters
    ----------
    shells : sequence of Shell
        Of one run.
    base : sequence of float
        Viscosity by friction alone at each wave number [pressure x time].
    shape : sequence of float
        What is added at each wave number, over that at k = 0 [1].
    expected : sequence of float
        Viscosity at each wave number, roughly [pressure x time]: relative errors go with the
        number of modes, and weights by errors that were themselves measured would favour small
        values.

    Returns
    -------
    excess : Estimate
        At k = 0, by least squares [pressure x time].
    leave_one_out : ndarray, shape (B,)
        The same without each block.
    reach : float
        How far the shells are from k = 0: the share of it that the shape adds to what was measured
        [1].
    """
    form = np.asarray(shape)
    modes = np.array([shell.n_vectors for shell in shells])
    weight = modes * form / np.asarray(expected) ** 2
    weight /= float(weight @ form)
    added = np.array([shell.viscosity.value for shell in shells]) - np.asarray(base)
    leave = np.stack([shell.leave_one_out for shell in shells], axis=1) @ weight
    leave = leave - float(weight @ np.asarray(base))
    _, stderr = jackknife(leave, float(leave.mean()))
    window = shells[0].viscosity.window
    found = Estimate(float(weight @ added), stderr, float(leave.size), window)
    return found, leave, float(weight.sum()) - 1.0
