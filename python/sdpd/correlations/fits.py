"""Viscosity, sound speed and damping fitted to the correlation functions of one wave number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Correlation, Estimate
from sdpd.analysis.blocked import BlockedFunction
from sdpd.correlations.recorder import FUNCTIONS
from sdpd.correlations.wave import WavePrediction
from sdpd.theory.hydrodynamics import damped_wave

__all__ = ["Wave", "decay_rate", "derive", "fit_wave", "joined", "normalized_table", "spans_of"]

Array = NDArray[np.float64]

DECAYS = 1.5  # of what decays last in a function: where its fit ends
TURNS = 2.5  # periods after which the fit of a wave ends, whatever its decay
FEWEST = 5  # lags


@dataclass(frozen=True)
class Wave:
    """Linearised hydrodynamics fitted to one wave number.

    Attributes
    ----------
    viscosity, damping : Estimate
        nu(k) and Gamma(k) [length^2/time].
    sound_speed : Estimate
        c(k) [length/time].
    sum_rule : Estimate
        c(k)^2 m S(k)/(kB T) with the measured S(k) [1].
    """

    viscosity: Estimate
    damping: Estimate
    sound_speed: Estimate
    sum_rule: Estimate


def joined(functions: Mapping[str, Correlation]) -> BlockedFunction:
    """All functions side by side, so that what needs several has one jackknife."""
    members = list(functions.values())
    return BlockedFunction(
        blocks=np.concatenate([member.blocks for member in members], axis=1),
        block_counts=np.concatenate([member.block_counts for member in members], axis=1),
        window=members[0].window,
    )


def normalized_table(mean: Array, number: int = len(FUNCTIONS)) -> Array:
    """Functions over their value at zero lag, the crossed ones over the root of both.

    Parameters
    ----------
    mean : ndarray, shape (F L,)
        A row of what `joined` returns.
    number : int
        F: 5, or 8 with those of the energy.

    Returns
    -------
    ndarray, shape (F, L)
    """
    table = mean.reshape(number, -1)
    shear, sound, density = table[:3, 0]
    root = np.sqrt(sound * density)
    units = [shear, sound, density, root, root]
    if number > len(FUNCTIONS):
        energy = table[5, 0]
        units += [energy, np.sqrt(density * energy), np.sqrt(sound * energy)]
    return np.asarray(table / np.array(units)[:, None])


def fit_wave(
    functions: Mapping[str, Correlation], theory: WavePrediction, thermal_speed: float
) -> Wave:
    """Fit one exponential to the transverse current, and one wave to the other four functions.

    Parameters
    ----------
    functions : mapping of str to Correlation
        The five of one wave number.
    theory : WavePrediction
        Where the fits start, and how far they reach.
    thermal_speed : float
        sqrt(kB T/m) [length/time].
    """
    whole, lag = joined(functions), functions["density"].lag
    slowest = min(theory.sound_rate, theory.frequency**2 / theory.sound_rate)
    ends = (
        DECAYS / theory.shear_rate,
        min(DECAYS / slowest, TURNS * 2.0 * np.pi / theory.frequency),
    )
    last = lag[min(FEWEST, lag.size) - 1]
    shear, sound = (np.flatnonzero(lag <= max(end, last)) for end in ends)
    k, start = theory.wave_number, (theory.frequency, theory.sound_rate)

    def parameters(mean: Array) -> Array:
        table = normalized_table(mean)
        structure = mean.reshape(len(FUNCTIONS), -1)[FUNCTIONS.index("density"), 0]
        rate = decay_rate(lag[shear], table[0, shear], theory.shear_rate)
        frequency, damping = _wave(lag[sound], table[1:, sound], start)
        speed = frequency / k
        squared = (speed / thermal_speed) ** 2 * structure
        return np.array([rate / k**2, damping / k**2, speed, squared])

    spans = [(0.0, float(lag[part[-1]])) for part in (shear, sound, sound, sound)]
    return Wave(*derive(whole, parameters, spans))


def derive(
    whole: BlockedFunction,
    function: Callable[[Array], Array],
    windows: list[tuple[float, float]],
) -> list[Estimate]:
    """Several numbers from the mean function, by one jackknife over the blocks."""
    value, count = function(whole.mean), whole.n_blocks
    leave = np.array([function(row) for row in whole.leave_one_out()])
    error = np.sqrt((count - 1) / count * np.sum((leave - leave.mean(axis=0)) ** 2, axis=0))
    return [
        Estimate(float(v), float(e), float(count), window)
        for v, e, window in zip(value, error, windows, strict=True)
    ]


def decay_rate(time: Array, value: Array, guess: float) -> float:
    """Least squares of exp(-rate t), each lag with the length of time it stands for."""
    from scipy import optimize

    weight = np.sqrt(spans_of(time))

    def residual(p: Array) -> Array:
        return np.asarray(weight * (np.exp(-np.exp(p[0]) * guess * time) - value))

    return guess * float(np.exp(optimize.least_squares(residual, [0.0]).x[0]))


def _wave(time: Array, values: Array, guess: tuple[float, float]) -> Array:
    """Frequency w_k and damping rate from longitudinal, density and both crossed functions."""
    from scipy import optimize

    weight = np.sqrt(spans_of(time))
    start = np.array(guess)

    def residual(p: Array) -> Array:
        frequency, damping = start * np.exp(p)
        even, odd, _ = damped_wave(time, float(frequency), float(damping))
        rows = (even - damping * odd, even + damping * odd, frequency * odd, frequency * odd)
        return np.asarray((weight * (np.array(rows) - values)).ravel())

    return np.asarray(start * np.exp(optimize.least_squares(residual, [0.0, 0.0]).x))


def spans_of(time: Array) -> Array:
    """Share of the time axis that each lag stands for."""
    return np.asarray(np.gradient(time) / (time[-1] - time[0]))
