"""Linearised hydrodynamics of one wave number as numbers: what fits are set beside."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd.theory.hydrodynamics import damped_wave

__all__ = ["WavePrediction"]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class WavePrediction:
    """Linearised hydrodynamics of one wave number.

    Attributes
    ----------
    wave_number : float
        k [1/length].
    structure_factor : float
        S(k) in the random-phase approximation at this time step [1].
    viscosity, damping : float
        nu(k) and Gamma(k) by the friction, as delivered at this time step [length^2/time].
    delivered : float
        Share of the friction that the pair splitting delivers at this time step [1].
    lattice_viscosity, lattice_damping : float
        The same where the particles sit on a lattice [length^2/time].
    sound_speed : float
        c(k) [length/time].
    sum_rule : float
        c(k)^2 m S(k)/(kB T); 1 but for the time step [1].
    structure_accuracy, friction_accuracy, viscosity_accuracy, sound_accuracy : float
        Relative accuracies of S(k); of the continuum for the friction; of the friction for what is
        fitted, nu(k) and Gamma(k); and of c(k) [1].
    """

    wave_number: float
    structure_factor: float
    viscosity: float
    damping: float
    delivered: float
    lattice_viscosity: float
    lattice_damping: float
    sound_speed: float
    sum_rule: float
    structure_accuracy: float
    friction_accuracy: float
    viscosity_accuracy: float
    sound_accuracy: float

    def with_friction(self, viscosity: float, damping: float) -> WavePrediction:
        """The same wave with nu(k) and Gamma(k) of another friction, without a time step."""
        kept = self.delivered
        return replace(self, viscosity=kept * viscosity, damping=kept * damping)

    def faster(self, factor: float) -> WavePrediction:
        """The same wave with its sound so many times as fast."""
        return replace(self, sound_speed=factor * self.sound_speed)

    @property
    def shear_rate(self) -> float:
        """Decay rate of a transverse wave, nu(k) k^2 [1/time]."""
        return self.viscosity * self.wave_number**2

    @property
    def sound_rate(self) -> float:
        """Gamma(k) k^2 [1/time]."""
        return self.damping * self.wave_number**2

    @property
    def frequency(self) -> float:
        """w_k = c(k) k, without the damping [1/time]."""
        return self.sound_speed * self.wave_number

    @property
    def adiabatic_frequency(self) -> float:
        """Of sound without damping and conduction [1/time]; `frequency` without an energy."""
        return self.frequency

    @property
    def overdamped(self) -> bool:
        """Whether the density relaxes without a wave, Gamma(k) k > c(k)."""
        return self.sound_rate > self.frequency

    @property
    def slowest_rate(self) -> float:
        """Rate of what decays last [1/time]."""
        square = self.sound_rate**2 - self.frequency**2
        sound = self.sound_rate
        if square > 0.0:
            sound = self.frequency**2 / (self.sound_rate + math.sqrt(square))
        return min(self.shear_rate, sound)

    @property
    def fastest_rate(self) -> float:
        """Rate of what changes first [1/time]."""
        return max(self.shear_rate, 2.0 * self.sound_rate, self.frequency)

    def transverse(self, time: ArrayLike) -> Array:
        """Transverse current correlation at times [time], 1 at zero."""
        return np.asarray(np.exp(-self.shear_rate * np.asarray(time, dtype=np.float64)))

    def density(self, time: ArrayLike) -> Array:
        """Density correlation at times [time], 1 at zero."""
        even, odd = self._wave(time)
        return np.asarray(even + self.sound_rate * odd)

    def longitudinal(self, time: ArrayLike) -> Array:
        """Longitudinal current correlation at times [time], 1 at zero."""
        even, odd = self._wave(time)
        return np.asarray(even - self.sound_rate * odd)

    def cross(self, time: ArrayLike) -> Array:
        """Im <rho_k(0)* j_k(t)> over the root of both variances at times [time], 0 at zero.

        Im <j_k(0)* rho_k(t)> is the same, as equilibrium has no direction of time.
        """
        return np.asarray(self.frequency * self._wave(time)[1])

    def function(self, name: str, time: ArrayLike) -> Array:
        """One of the four by its name; "reversed_cross" is the other order of "cross"."""
        shapes = {
            "transverse": self.transverse,
            "density": self.density,
            "longitudinal": self.longitudinal,
            "cross": self.cross,
            "reversed_cross": self.cross,
        }
        return shapes[name](time)

    def accuracy(self, name: str, time: ArrayLike) -> Array:
        """How much a function moves at times [time] within the accuracies of its parameters [1]."""
        centre = self.function(name, time)
        share, sound = self.viscosity_accuracy, self.sound_accuracy
        away = np.zeros_like(centre)
        for sign in (-1.0, 1.0):
            thick = replace(
                self,
                viscosity=self.viscosity * (1.0 + sign * share),
                damping=self.damping * (1.0 + sign * share),
            )
            fast = self.faster(1.0 + sign * sound)
            moved = np.abs(thick.function(name, time) - centre)
            if name != "transverse":
                moved = moved + np.abs(fast.function(name, time) - centre)
            away = np.maximum(away, moved)
        return np.asarray(away)

    def probe_times(self, name: str) -> tuple[float, float]:
        """Two times at which a function says most, about a half and one decay or turn [time]."""
        if name == "transverse":
            return 0.5 / self.shear_rate, 1.0 / self.shear_rate
        turn = math.pi / max(self.adiabatic_frequency, self.sound_rate)
        first = 0.25 if "cross" in name else 0.5
        return first * turn, 2.0 * first * turn

    def _wave(self, time: ArrayLike) -> tuple[Array, Array]:
        t = np.asarray(time, dtype=np.float64)
        even, odd, _ = damped_wave(t, self.frequency, self.sound_rate)
        return even, odd
