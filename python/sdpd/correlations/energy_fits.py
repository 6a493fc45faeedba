"""Sound and heat fitted together to the functions of one wave number of a fluid with an energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Correlation, Estimate
from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.correlations.fits import (
    DECAYS,
    FEWEST,
    TURNS,
    Wave,
    decay_rate,
    derive,
    joined,
    normalized_table,
    spans_of,
)
from sdpd.correlations.recorder import ENERGY_FUNCTIONS, FUNCTIONS
from sdpd.theory import SoundAndHeat

__all__ = ["EnergyWave", "fit_energy_wave"]

Array = NDArray[np.float64]

NUMBER = len(FUNCTIONS) + len(ENERGY_FUNCTIONS)
SOUND = slice(1, NUMBER)  # all but the transverse current
HEAT = [2, 5, 6]  # density, energy, and the two together: what heat leaves when sound is gone


@dataclass(frozen=True)
class EnergyWave(Wave):
    """Coupled sound and heat fitted to one wave number; `sound_speed` is the isothermal one.

    Attributes
    ----------
    adiabatic_speed : Estimate
        c_S(k) = sqrt(gamma(k)) c(k) [length/time].
    heat_ratio : Estimate
        gamma(k) [1].
    conduction : Estimate
        q(k)/k^2, thermal diffusivity at constant density [length^2/time].
    heat_rate : Estimate
        Decay of the heat mode over k^2, chi as k -> 0 [length^2/time].
    sound_rate : Estimate
        Decay of sound over k^2, Gamma with the share of conduction [length^2/time].
    """

    adiabatic_speed: Estimate
    heat_ratio: Estimate
    conduction: Estimate
    heat_rate: Estimate
    sound_rate: Estimate


def fit_energy_wave(
    functions: Mapping[str, Correlation], theory: EnergyWavePrediction, thermal_speed: float
) -> EnergyWave:
    """Fit one exponential to the transverse current, and sound and heat to the other seven.

    Parameters
    ----------
    functions : mapping of str to Correlation
        The eight of one wave number.
    theory : EnergyWavePrediction
        Where the fits start, and how far they reach.
    thermal_speed : float
        sqrt(kB T/m) [length/time].
    """
    whole, lag = joined(functions), functions["density"].lag
    system, k = theory.system, theory.wave_number
    turns = TURNS * 2.0 * np.pi / system.adiabatic_frequency
    slowest = float(np.min(-system.rates[1:].real))
    ends = (DECAYS / theory.shear_rate, min(DECAYS / slowest, turns), DECAYS / system.heat_rate)
    last = lag[min(FEWEST, lag.size) - 1]
    shear, sound, heat = (np.flatnonzero(lag <= max(end, last)) for end in ends)
    start = np.array([system.frequency, system.coupling, system.damping, system.conduction])

    def parameters(mean: Array) -> Array:
        table = normalized_table(mean, NUMBER)
        structure = mean.reshape(NUMBER, -1)[FUNCTIONS.index("density"), 0]
        rate = decay_rate(lag[shear], table[0, shear], theory.shear_rate)
        found = _system(lag, table, (sound, heat), start)
        squared = (found.frequency / k / thermal_speed) ** 2 * structure
        return np.array(
            [
                rate / k**2,
                0.5 * found.damping / k**2,
                found.frequency / k,
                squared,
                found.adiabatic_frequency / k,
                found.heat_ratio,
                found.conduction / k**2,
                found.heat_rate / k**2,
                found.sound_rate / k**2,
            ]
        )

    spans = [(0.0, float(lag[part[-1]])) for part in (shear, *[sound] * 5, heat, heat, sound)]
    return EnergyWave(*derive(whole, parameters, spans))


def _system(
    lag: Array, table: Array, parts: tuple[NDArray[np.int64], NDArray[np.int64]], start: Array
) -> SoundAndHeat:
    """Least squares, each lag with the length of time it stands for."""
    from scipy import optimize

    sound, heat = parts
    scale = np.where(start > 0.0, start, start[0])
    weights = np.sqrt(spans_of(lag[sound])), np.sqrt(spans_of(lag[heat]))

    def system(p: Array) -> SoundAndHeat:
        w, theta, damping, conduction = scale * np.exp(p)
        return SoundAndHeat(
            frequency=float(w),
            coupling=float(theta),
            damping=float(damping),
            conduction=float(conduction),
        )

    def residual(p: Array) -> Array:
        c = system(p).correlations(lag)
        rows = np.array([c[1, 1], c[0, 0], c[0, 1], c[0, 1], c[2, 2], c[0, 2], c[2, 1]])
        away = rows - table[SOUND]
        early = away[:, sound] * weights[0]
        late = away[np.array(HEAT) - 1][:, heat] * weights[1]
        return np.concatenate([early.ravel(), late.ravel()])

    first = np.where(start > 0.0, 0.0, -3.0)
    return system(optimize.least_squares(residual, first, bounds=(-6.0, 3.0)).x)
