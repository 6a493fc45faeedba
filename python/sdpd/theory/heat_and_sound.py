r"""Linearised fluctuating hydrodynamics with an energy: sound, heat and what they do to each other.

One wave vector of a quiescent fluid has a density, a longitudinal velocity and a temperature. Each
over its standard deviation at equilibrium, x = (rho, i u, T), they obey

    x' = M x + noise,    M = (   0      w      0    )     w^2 = c_T^2 k^2
                             (  -w   -lambda -theta )     theta^2 = (gamma - 1) w^2
                             (   0    theta   -q    )     lambda = 2 Gamma_T k^2
                                                          q = gamma chi k^2

with Gamma_T = [eta (2 - 2/D) + zeta]/(2 rho) and chi = kappa/(rho c_p). The noise balances the
diagonal, so that the covariance is the unit matrix and the correlation functions are exp(M t): no
expansion in k. As k -> 0 the eigenvalues are those of heat, -chi k^2, and of sound, -Gamma k^2 +- i
c_S k with c_S^2 = gamma c_T^2 and Gamma = Gamma_T + (gamma - 1) chi/2.
Landau and Lifshitz, *Statistical Physics, Part 2*, 1980, secs. 88 and 89; Hansen and McDonald,
*Theory of Simple Liquids*, 4th ed., 2013, sec. 8.5; Landau and Placzek, Phys. Z. Sowjetunion 5, 172
(1934).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = ["SoundAndHeat", "ThermalHydrodynamicTheory"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WORST = 1e7  # condition of the eigenvectors beyond which two modes count as one


@dataclass(frozen=True, kw_only=True)
class SoundAndHeat:
    """One wave vector.

    Parameters
    ----------
    frequency : float
        w = c_T k, of undamped isothermal sound [1/time], > 0.
    coupling : float
        theta, between velocity and temperature [1/time], >= 0.
    damping : float
        lambda, rate of a longitudinal wave of velocity by friction [1/time], >= 0.
    conduction : float
        q, rate of a wave of temperature at constant density [1/time], >= 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    frequency: float
    coupling: float
    damping: float
    conduction: float

    def __post_init__(self) -> None:
        validation.positive("frequency", self.frequency)
        for name in ("coupling", "damping", "conduction"):
            validation.non_negative(name, getattr(self, name))

    @property
    def adiabatic_frequency(self) -> float:
        """sqrt(w^2 + theta^2) = c_S k [1/time]."""
        return math.hypot(self.frequency, self.coupling)

    @property
    def heat_ratio(self) -> float:
        """gamma = 1 + theta^2/w^2 [1]."""
        return 1.0 + (self.coupling / self.frequency) ** 2

    @property
    def matrix(self) -> Array:
        """M, shape (3, 3) [1/time]."""
        w, theta = self.frequency, self.coupling
        return np.array(
            [[0.0, w, 0.0], [-w, -self.damping, -theta], [0.0, theta, -self.conduction]]
        )

    @cached_property
    def rates(self) -> Complex:
        """Eigenvalues of M, shape (3,): heat, then the two of sound [1/time].

        Heat is the real one that has most of the entropy; of three real ones (overdamped sound) the
        others follow by ascending decay.
        """
        found, vectors = np.linalg.eig(self.matrix)
        entropy = np.array([-self.coupling, 0.0, self.frequency]) / self.adiabatic_frequency
        share = np.abs(entropy @ vectors) / np.linalg.norm(vectors, axis=0)
        share = np.where(np.abs(found.imag) <= 1e-12 * np.abs(found), share, -1.0)
        heat = int(np.argmax(share))
        rest = np.delete(found, heat)
        rest = rest[np.lexsort((-rest.imag, -rest.real))]
        return np.concatenate([[found[heat]], rest]).astype(np.complex128)

    @property
    def heat_rate(self) -> float:
        """Decay rate of the heat mode, chi k^2 as k -> 0 [1/time]."""
        return float(-self.rates[0].real)

    @property
    def sound_rate(self) -> float:
        """Decay rate of sound, Gamma k^2 as k -> 0; mean of both where overdamped [1/time]."""
        return float(-0.5 * (self.rates[1] + self.rates[2]).real)

    @property
    def sound_frequency(self) -> float:
        """Angular frequency of damped sound, 0 where overdamped [1/time]."""
        return float(abs(self.rates[1].imag))

    def correlations(self, time: ArrayLike) -> Array:
        """exp(M t) at times [time] of shape (...), shape (3, 3, ...).

        Element (a, b) is <x_a(t) x_b(0)>, in the order density, velocity, temperature.
        """
        t = np.asarray(time, dtype=np.float64)
        if not np.all(np.isfinite(t) & (t >= 0.0)):
            raise ValueError("`time` must be finite and >= 0")
        rates, vectors = np.linalg.eig(self.matrix)
        if np.linalg.cond(vectors) > WORST:
            from scipy.linalg import expm

            each = np.array([expm(self.matrix * moment) for moment in t.ravel()])
            return np.moveaxis(each.reshape(*t.shape, 3, 3), (-2, -1), (0, 1))
        parts = np.exp(np.multiply.outer(rates, t))
        inverse = np.linalg.inv(vectors)
        return np.asarray(np.einsum("am,mb,m...->ab...", vectors, inverse, parts).real)

    def function(self, first: ArrayLike, second: ArrayLike, time: ArrayLike) -> Array:
        """<b(0) a(t)> of a = `second` . x and b = `first` . x, each of 3 numbers, any times."""
        a, b = np.asarray(second, dtype=np.float64), np.asarray(first, dtype=np.float64)
        return np.asarray(np.einsum("a,ab...,b->...", a, self.correlations(time), b))

    @property
    def pressure(self) -> Array:
        """The pressure over its standard deviation, of (rho, i u, T)."""
        return np.array([self.frequency, 0.0, self.coupling]) / self.adiabatic_frequency

    @property
    def entropy(self) -> Array:
        """The entropy per mass over its standard deviation, of (rho, i u, T)."""
        return np.array([-self.coupling, 0.0, self.frequency]) / self.adiabatic_frequency

    def spectrum(self, angular_frequency: ArrayLike) -> Array:
        r"""S(k, omega)/S(k) at angular frequencies [1/time], any shape; its integral is 1 [time].

        .. math:: \frac{S(k,\omega)}{S(k)} = \frac1\pi\,\mathrm{Re}\,
                  \big[(i\omega - \mathsf M)^{-1}\big]_{\rho\rho}
        """
        omega = np.asarray(angular_frequency, dtype=np.float64)
        system = 1j * omega[..., None, None] * np.eye(3) - self.matrix
        return np.asarray(np.linalg.inv(system)[..., 0, 0].real / np.pi)


@dataclass(frozen=True, kw_only=True)
class ThermalHydrodynamicTheory:
    """Linearised hydrodynamics of a fluid with an energy.

    Parameters
    ----------
    dimension : int
        2 or 3.
    density : float
        Mass density rho [mass/length^D], > 0.
    shear_viscosity, bulk_viscosity : float
        eta > 0 and zeta >= 0 [pressure x time].
    sound_speed : float
        c_T, *isothermal* and total [length/time], > 0.
    heat_ratio : float
        gamma = c_p/c_v [1], >= 1.
    thermal_diffusivity : float
        chi = kappa/(rho c_p) [length^2/time], >= 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Examples
    --------
    >>> from sdpd.theory import ThermalHydrodynamicTheory
    >>> air = ThermalHydrodynamicTheory(
    ...     dimension=3, density=1.18, shear_viscosity=1.8e-5, sound_speed=293.0,
    ...     heat_ratio=1.4, thermal_diffusivity=2.2e-5,
    ... )
    >>> round(air.adiabatic_sound_speed), round(air.landau_placzek_ratio, 3)
    (347, 0.4)
    """

    dimension: int
    density: float
    shear_viscosity: float
    sound_speed: float
    heat_ratio: float
    thermal_diffusivity: float
    bulk_viscosity: float = 0.0

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise ValueError(f"`dimension` must be 2 or 3, got {self.dimension!r}")
        for name in ("density", "shear_viscosity", "sound_speed"):
            validation.positive(name, getattr(self, name))
        for name in ("bulk_viscosity", "thermal_diffusivity"):
            validation.non_negative(name, getattr(self, name))
        if validation.finite("heat_ratio", self.heat_ratio) < 1.0:
            raise ValueError(f"`heat_ratio` must be >= 1, got {self.heat_ratio:g}")

    @property
    def kinematic_viscosity(self) -> float:
        """Return nu = eta/rho [length^2/time]."""
        return self.shear_viscosity / self.density

    @property
    def adiabatic_sound_speed(self) -> float:
        """Return c_S = sqrt(gamma) c_T [length/time]."""
        return math.sqrt(self.heat_ratio) * self.sound_speed

    @property
    def viscous_damping(self) -> float:
        """Return Gamma_T, the damping of isothermal sound [length^2/time]."""
        longitudinal = self.shear_viscosity * (2.0 - 2.0 / self.dimension) + self.bulk_viscosity
        return longitudinal / (2.0 * self.density)

    @property
    def sound_damping(self) -> float:
        """Return Gamma = Gamma_T + (gamma - 1) chi/2, for long waves [length^2/time]."""
        return self.viscous_damping + 0.5 * (self.heat_ratio - 1.0) * self.thermal_diffusivity

    @property
    def landau_placzek_ratio(self) -> float:
        """Intensity of the Rayleigh line over that of both Brillouin lines, gamma - 1 [1]."""
        return self.heat_ratio - 1.0

    def wave(self, wave_number: float) -> SoundAndHeat:
        """The three coupled equations of one wave number [1/length]."""
        k = validation.positive("wave_number", wave_number)
        frequency = self.sound_speed * k
        return SoundAndHeat(
            frequency=frequency,
            coupling=math.sqrt(self.heat_ratio - 1.0) * frequency,
            damping=2.0 * self.viscous_damping * k**2,
            conduction=self.heat_ratio * self.thermal_diffusivity * k**2,
        )

    def transverse(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised transverse current correlation at times [time], any shape."""
        k = validation.positive("wave_number", wave_number)
        return np.asarray(np.exp(-self.kinematic_viscosity * k**2 * np.asarray(time)))

    def density_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised density correlation F(k, t)/S(k) at times [time], any shape."""
        return np.asarray(self.wave(wave_number).correlations(time)[0, 0])

    def longitudinal(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised longitudinal current correlation at times [time], any shape."""
        return np.asarray(self.wave(wave_number).correlations(time)[1, 1])

    def temperature_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised temperature correlation at times [time], any shape."""
        return np.asarray(self.wave(wave_number).correlations(time)[2, 2])

    def pressure_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised pressure correlation at times [time], any shape."""
        wave = self.wave(wave_number)
        return wave.function(wave.pressure, wave.pressure, time)

    def entropy_correlation(self, wave_number: float, time: ArrayLike) -> Array:
        """Normalised correlation of the entropy per mass at times [time], any shape."""
        wave = self.wave(wave_number)
        return wave.function(wave.entropy, wave.entropy, time)

    def dynamic_structure_factor(self, wave_number: float, angular_frequency: ArrayLike) -> Array:
        """S(k, omega)/S(k) [time] at angular frequencies [1/time]; see `SoundAndHeat`."""
        return self.wave(wave_number).spectrum(angular_frequency)

    def long_wave_structure_factor(self, wave_number: float, angular_frequency: ArrayLike) -> Array:
        r"""The three Lorentz lines that `dynamic_structure_factor` tends to as k -> 0 [time].

        .. math:: \frac1\pi\Big[\frac{\gamma-1}\gamma\frac{\chi k^2}{\omega^2+(\chi k^2)^2}
                  + \frac1{2\gamma}\sum_\pm\frac{\Gamma k^2}{(\omega\pm c_Sk)^2+(\Gamma k^2)^2}\Big]
        """
        k = validation.positive("wave_number", wave_number)
        omega = np.asarray(angular_frequency, dtype=np.float64)
        heat, sound = self.thermal_diffusivity * k**2, self.sound_damping * k**2
        turn, gamma = self.adiabatic_sound_speed * k, self.heat_ratio
        lines = (gamma - 1.0) / gamma * heat / (omega**2 + heat**2)
        for sign in (-1.0, 1.0):
            lines = lines + 0.5 / gamma * sound / ((omega + sign * turn) ** 2 + sound**2)
        return np.asarray(lines / np.pi)
