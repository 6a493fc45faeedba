r"""Linearised isothermal fluctuating hydrodynamics: sound, damping, correlation functions.

Of a wave vector k of a quiescent fluid, with rho_k = sum m exp(i k.r) and j_k = sum m v exp(i k.r):

    transverse current    C_T(t) = exp(-nu k^2 t)
    density               exp(-G t) [cos w t + (G/w) sin w t],    G = Gamma_T k^2
    longitudinal current  exp(-G t) [cos w t - (G/w) sin w t],    w^2 = c_T^2 k^2 - G^2

with Gamma_T = [eta (2 - 2/D) + zeta]/(2 rho) and c_T the isothermal sound speed *with* the kinetic
part kB T/m. All are normalised to 1 at t = 0. Overdamped waves (w^2 < 0) use cosh and sinh.
Hansen and McDonald, *Theory of Simple Liquids*, 4th ed., 2013, ch. 8; Bian et al., Phys. Rev. E
(2015) eq. 21, whose 2D damping is not 2 nu/3 but 3 nu/4 for his coefficients (zeta = eta/2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = ["HydrodynamicTheory", "isothermal_sound_speed"]

Array = NDArray[np.float64]


def isothermal_sound_speed(sound_speed: float, *, thermal_energy: float, mass: float) -> float:
    """Sound speed of the fluid of particles, sqrt(c^2 + kB T/m) [length/time].

    Parameters
    ----------
    sound_speed : float
        c of the equation of state [length/time], >= 0.
    thermal_energy : float
        kB T [energy], >= 0.
    mass : float
        Mass of a particle [mass], > 0.
    """
    validation.non_negative("sound_speed", sound_speed)
    validation.non_negative("thermal_energy", thermal_energy)
    return math.sqrt(sound_speed**2 + thermal_energy / validation.positive("mass", mass))


@dataclass(frozen=True, kw_only=True)
class HydrodynamicTheory:
    """Linearised isothermal hydrodynamics of one fluid.

    Parameters
    ----------
    dimension : int
        2 or 3.
    density : float
        Mass density rho [mass/length^D], > 0.
    shear_viscosity : float
        eta [pressure x time], > 0.
    bulk_viscosity : float
        zeta [pressure x time], >= 0.
    sound_speed : float
        c_T, isothermal and total (:func:`isothermal_sound_speed`) [length/time], > 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    dimension: int
    density: float
    shear_viscosity: float
    sound_speed: float
    bulk_viscosity: float = 0.0

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise ValueError(f"`dimension` must be 2 or 3, got {self.dimension!r}")
        validation.positive("density", self.density)
        validation.positive("shear_viscosity", self.shear_viscosity)
        validation.non_negative("bulk_viscosity", self.bulk_viscosity)
        validation.positive("sound_speed", self.sound_speed)

    @property
    def kinematic_viscosity(self) -> float:
        """Return nu = eta/rho [length^2/time]."""
        return self.shear_viscosity / self.density

    @property
    def sound_damping(self) -> float:
        """Return Gamma_T [length^2/time]."""
        longitudinal = self.shear_viscosity * (2.0 - 2.0 / self.dimension) + self.bulk_viscosity
        return longitudinal / (2.0 * self.density)

    def transverse(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised transverse current correlation at times [time], any shape."""
        k, t = self._arguments(wave_number, time)
        return np.asarray(np.exp(-self.kinematic_viscosity * k**2 * t))

    def density_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised density correlation F(k, t)/S(k) at times [time], any shape."""
        k, t = self._arguments(wave_number, time)
        even, odd, damping = damped_wave(t, self.sound_speed * k, self.sound_damping * k**2)
        return even + damping * odd

    def longitudinal(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised longitudinal current correlation at times [time], any shape."""
        k, t = self._arguments(wave_number, time)
        even, odd, damping = damped_wave(t, self.sound_speed * k, self.sound_damping * k**2)
        return even - damping * odd

    def cross_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Imaginary part of <rho_k(0)* j_k(t)> over sqrt(<|rho_k|^2> <|j_k|^2>), longitudinal j.

        With rho_k = sum m exp(i k.r), d rho_k/dt = i k j_k, so the function starts as c k t. The
        reversed order <j_k(0)* rho_k(t)> has the same imaginary part.
        """
        k, t = self._arguments(wave_number, time)
        frequency = self.sound_speed * k
        _, odd, _ = damped_wave(t, frequency, self.sound_damping * k**2)
        return np.asarray(frequency * odd)

    def _arguments(self, wave_number: float, time: ArrayLike) -> tuple[float, Array]:
        k = validation.positive("wave_number", wave_number)
        t = np.asarray(time, dtype=np.float64)
        if not np.all(np.isfinite(t) & (t >= 0.0)):
            raise ValueError("`time` must be finite and >= 0")
        return k, t


def damped_wave(time: Array, frequency: float, damping: float) -> tuple[Array, Array, float]:
    """exp(-G t) cos(w t), exp(-G t) sin(w t)/w and G, with w^2 = frequency^2 - G^2 of any sign."""
    square = frequency**2 - damping**2
    root = math.sqrt(abs(square))
    if root < 1e-8 * max(frequency, damping):
        decay = np.exp(-damping * time)
        return decay, decay * time, damping
    if square > 0.0:
        decay = np.exp(-damping * time)
        return decay * np.cos(root * time), decay * np.sin(root * time) / root, damping
    slow, fast = np.exp((root - damping) * time), np.exp(-(root + damping) * time)
    return 0.5 * (slow + fast), 0.5 * (slow - fast) / root, damping
