r"""What theory expects of the density at a finite time step.

The pair splitting is O/2 - velocity Verlet - O/2. In a harmonic mode of frequency w velocity Verlet
keeps p^2/2m + (1 - w^2 dt^2/4) m w^2 x^2/2 and O the Maxwell distribution, so that the product is
stationary whatever the friction: velocities are exact, and the response R(k) = 1/S(k) - 1 is
weakened by 1 - w^2 dt^2/4 with w^2 = R k^2 kB T/m.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import timestep
from sdpd.scene import Scene
from sdpd.theory import DensityTheory, cell_count_variance, kernel_transform

__all__ = ["DensityPrediction"]

Array = NDArray[np.float64]

# Accuracy of the approximation in units of the mean density's excess <d_i>/n - 1, which measures
# the fluctuations it is of first order in; for P > rho c^2/2 and below, with the smallest value
# stated. From simulations at X = 100 and 400 (docs/guide/fluctuations).
LIMITS = {
    "structure": (4.0, 20.0, 0.03),
    "variance": (12.0, 12.0, 0.03),
    "cells": (15.0, 15.0, 0.05),
    "mean": (0.3, 0.3, 5e-4),
}
# The more order, the less that measures: particles on a lattice have no waves beyond the Debye wave
# number, and the density of its sums. So the variance is known no better than these multiples of
# the share of such waves, for P > rho c^2/2 and below, and the mean no better than the lattice's is
# near n. From fluids at X = 200 to 10^4, h/dx 2.2 to 4.2 (docs/scripts/density_accuracy.py): up to
# 2.0 and 6.7 shares, and up to 0.7 of the lattice's distance.
SHORT_WAVES = (2.5, 7.0)


class DensityPrediction:
    """Random-phase approximation of a scene's density in its closed box, at one time step.

    Sums over the waves of the box are integrals without the wave k = 0, which a fixed number of
    particles does not have; that is S(0)/N of variance and bias.

    Parameters
    ----------
    scene : Scene
    dt : float
        Time step of the pair splitting [time]; 0 for the exact canonical distribution.
    temperature : float, optional
        T of a fluid with an energy [temperature]; that of the fluid if None.

    Raises
    ------
    ValueError
        If the fluid is beyond its pairing limit, or the step is unstable.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=1000, kernel="wendland_c2", support=2.65),
    ... )
    >>> exact = sdpd.fluctuations.DensityPrediction(scene, 0.0)
    >>> exact.variance > 0.0
    True
    """

    def __init__(self, scene: Scene, dt: float, temperature: float | None = None) -> None:
        self._scene, self._dt = scene, dt
        self._warmth = 1.0 if temperature is None else temperature / scene.fluid.temperature
        stiffness, number = self._state()
        self._theory = DensityTheory(
            kernel=scene.resolution.kernel,
            dimension=scene.dimension,
            support=scene.support_radius,
            number_density=scene.n_particles / scene.box.volume,
            stiffness=stiffness,
            compressibility_factor=number,
        )
        self.variance, self.bias = self._theory.variance(), self._theory.bias()
        missing = float(self._theory.structure_factor(0.0)) / scene.n_particles
        self.variance -= missing
        self.bias -= missing
        if dt > 0.0:
            self._add_step()

    def _state(self) -> tuple[float, float]:
        """X and P/(n kB T) at the temperature of the fluid."""
        scene = self._scene
        if not scene.active_effects.energy:
            return scene.stiffness, scene.pressure_number
        unit = scene.particle_mass / (scene.thermal_energy * self._warmth)
        pressure, slope = self.caloric([scene.fluid.density])
        return float(slope[0]) * unit, float(pressure[0]) / scene.fluid.density * unit

    @property
    def warmth(self) -> float:
        """Temperature over that of the fluid [1]."""
        return self._warmth

    @property
    def stiffness(self) -> float:
        """X = m c_T^2/(kB T) at this temperature [1]."""
        return self._theory.stiffness

    def pressure_coefficient(self, share: float = 1.0) -> float:
        """(dP/dT)_rho of a fluid with an energy, at a share of its density.

        [energy/(length^D temperature)].
        """
        from sdpd import _core

        scene, kelvin = self._scene, self._scene.fluid.temperature
        rho, t = np.full(2, share * scene.fluid.density), kelvin * np.array([1.0, 2.0])
        cold, warm = _core.caloric_evaluate(scene.caloric, rho, t)[0]
        return float(warm - cold) / kelvin

    def virial_coefficient(self) -> float:
        """(dP/dT)_rho/(n kB) of the virial pressure, motion and fluctuations included (RPA) [1]."""
        shift = 0.01
        cold, warm = (self._virial(self._warmth * (1.0 + s)) for s in (-shift, shift))
        return (warm - cold) / (2.0 * shift * self._warmth)

    def _virial(self, warmth: float) -> float:
        """P/(n kB T_0) at a temperature over T_0."""
        scene, strain = self._scene, 1e-4
        other = DensityPrediction(scene, 0.0, warmth * scene.fluid.temperature)
        _, slopes = other.caloric(scene.fluid.density * (1.0 + strain * np.array([-1.0, 1.0])))
        change = float(slopes[1] - slopes[0]) / (2.0 * strain)
        energy = scene.thermal_energy * warmth
        pressure = other._theory.virial_pressure(
            thermal_energy=energy, stiffness_slope=change * scene.particle_mass / energy
        )
        return pressure * scene.box.volume / (scene.n_particles * scene.thermal_energy)

    @property
    def step_error(self) -> float:
        """Relative excess of the density's variance by the time step [1]."""
        if self._dt == 0.0:
            return 0.0
        found = timestep.expected_errors(self._scene, self._dt, "pair_splitting")
        return found.density_variance or 0.0

    def caloric(self, densities: ArrayLike) -> tuple[Array, Array]:
        """P and (dP/drho)_T of a fluid with an energy at mass densities and its temperature."""
        from sdpd import _core

        rho = np.asarray(densities, dtype=np.float64)
        kelvin = np.full(rho.shape, self._scene.fluid.temperature * self._warmth)
        found = _core.caloric_evaluate(self._scene.caloric, rho, kelvin)
        return np.asarray(found[0]), np.asarray(found[3])

    def structure_factor(self, wave_number: ArrayLike) -> Array:
        """S(k) at wave numbers [1/length], any shape."""
        k = np.asarray(wave_number, dtype=np.float64)
        plain = self._theory.structure_factor(k)
        response = 1.0 / plain - 1.0
        square = response * self._warmth * (k * self._scene.thermal_speed * self._dt) ** 2
        return np.asarray(1.0 / (1.0 + response * (1.0 - 0.25 * square)))

    def cell_variance(self, parts: int) -> float:
        """Variance of the number of particles in a cell, 1/`parts` of each edge of the box."""
        scene = self._scene
        return cell_count_variance(
            self.structure_factor,
            box=scene.box.lengths,
            cell=[length / parts for length in scene.box.lengths],
            n_particles=scene.n_particles,
            max_wave_number=25.0 / scene.support_radius,
        )

    @property
    def pressure(self) -> float:
        """Mean over particles of P(rho_i)/(rho c^2), to second order in the fluctuations [1]."""
        scene = self._scene
        rho, strain = scene.fluid.density, 0.01
        law = scene.fluid.equation_of_state
        density = rho * (1.0 + self.bias + strain * np.array([-1.0, 0.0, 1.0]))
        if scene.active_effects.energy:
            low, mid, high = self.caloric(density)[0]
        else:
            low, mid, high = law.pressure(
                density, reference_density=rho, sound_speed=scene.sound.speed
            )
        curvature = float(low - 2.0 * mid + high) / strain**2
        unit = scene.stiffness * scene.thermal_energy * scene.n_particles / scene.box.volume
        return (float(mid) + 0.5 * curvature * self.variance) / unit

    def accuracy(self, quantity: str) -> float:
        """Stated accuracy for a quantity of `LIMITS`, relative but for "mean" [1]."""
        stiff, soft, smallest = LIMITS[quantity]
        low = self._theory.compressibility_factor <= 0.5 * self._theory.stiffness
        known = max(smallest, (soft if low else stiff) * abs(self.bias))
        if quantity == "variance":
            return max(known, SHORT_WAVES[low] * self.short_waves)
        if quantity == "mean":
            return max(known, abs(self._scene.factors.density - 1.0))
        return known

    @property
    def short_waves(self) -> float:
        """Share of the variance by waves beyond the Debye wave number [1]."""
        kh, weight, transform = _waves(self._scene.resolution.kernel, self._scene.dimension)
        k = kh / self._scene.support_radius
        square = weight * transform**2 * self._theory.structure_factor(k)
        dense = self._scene.n_particles / self._scene.box.volume
        two = self._scene.dimension == 2
        debye = math.sqrt(4.0 * np.pi * dense) if two else (6.0 * np.pi**2 * dense) ** (1.0 / 3.0)
        return float(square[k > debye].sum() / square.sum())

    def _add_step(self) -> None:
        scene = self._scene
        kh, weight, transform = _waves(scene.resolution.kernel, scene.dimension)
        k = kh / scene.support_radius
        shift = self.structure_factor(k) - self._theory.structure_factor(k)
        change = weight * shift / self._theory.neighbors
        self.variance += float(change @ transform**2)
        self.bias += float(change @ transform)


@lru_cache(maxsize=16)
def _waves(kernel: str, dimension: int) -> tuple[Array, Array, Array]:
    """kh, its weight with the surface, over (2 pi)^D, and the transform of the kernel."""
    width = 64.0 / 4096
    kh = np.asarray((np.arange(4096) + 0.5) * width, dtype=np.float64)
    surface = kh / (2.0 * np.pi) if dimension == 2 else kh**2 / (2.0 * np.pi**2)
    return kh, np.asarray(surface * width), kernel_transform(kernel, dimension, kh)
