r"""One wave of a fluid of particles with an energy: sound and heat, coupled.

The wave of the energies, e_k = sum (C T_i + m v_i^2/2 - mean) exp(i k.r_i), has the variance N (kB
T)^2 (C + D kB/2)/kB and no correlation with the density. Density, current and energy, each over its
deviation, obey the equations of :class:`sdpd.theory.SoundAndHeat` with w_k^2 = k^2 kB T/(m S(k)),

    theta^2 = k^2 (kB T/m) [(b - 1) What(k) + 1]^2/(C/kB + D/2),     b = (dP/dT)_rho/(n kB),

P the virial pressure of the random-phase approximation: the kernel smears out both the pressure of
a warm wave and the heating of a compressed one; the particles' motion is an ideal gas of its own,
the 1. Then gamma(k) = 1 + theta^2/w_k^2. What diffuses heat
is conduction, friction (kinetic energy that one particle loses heats two), and the particles'
diffusion, which carries their energy along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import timestep
from sdpd.correlations.recorder import friction_conductivity, heat_coefficient
from sdpd.correlations.wave import WavePrediction
from sdpd.theory import FrictionTheory, SoundAndHeat, kernel_transform

if TYPE_CHECKING:
    from sdpd.fluctuations import DensityPrediction
    from sdpd.scene import Scene

__all__ = ["EnergyWavePrediction", "thermal_coupling", "with_energy"]

Array = NDArray[np.float64]

DIFFUSION = 0.5  # of what diffusion adds: the long-time coefficient is below the short-time one


@dataclass(frozen=True, kw_only=True)
class EnergyWavePrediction(WavePrediction):
    """A wave with an energy; `sound_speed` is the isothermal one.

    Parameters
    ----------
    coupling : float
        theta [1/time].
    conduction : float
        q(k), rate of the energy's wave at constant density, as delivered [1/time].
    diffusion : float
        Part of it by the particles' own diffusion [1/time].
    conduction_delivered : float
        Share of the conduction that the time step delivers [1].
    conduction_accuracy : float
        Relative [1].
    """

    coupling: float
    conduction: float
    diffusion: float
    conduction_delivered: float
    conduction_accuracy: float

    @property
    def system(self) -> SoundAndHeat:
        """The coupled equations."""
        return SoundAndHeat(
            frequency=self.frequency,
            coupling=self.coupling,
            damping=2.0 * self.sound_rate,
            conduction=self.conduction,
        )

    @property
    def adiabatic_frequency(self) -> float:
        """c_S(k) k [1/time]."""
        return self.system.adiabatic_frequency

    @property
    def adiabatic_speed(self) -> float:
        """c_S(k) [length/time]."""
        return self.adiabatic_frequency / self.wave_number

    @property
    def heat_ratio(self) -> float:
        """gamma(k) [1]."""
        return self.system.heat_ratio

    @property
    def overdamped(self) -> bool:
        """Whether there is no sound but two decays."""
        return self.system.sound_frequency == 0.0

    @property
    def slowest_rate(self) -> float:
        """Rate of what decays last [1/time]."""
        return min(self.shear_rate, float(np.min(-self.system.rates.real)))

    @property
    def fastest_rate(self) -> float:
        """Rate of what changes first [1/time]."""
        sound = 2.0 * self.sound_rate
        return max(self.shear_rate, sound, self.adiabatic_frequency, self.conduction)

    def with_conduction(self, rate: float) -> EnergyWavePrediction:
        """The same wave with another conduction, without a time step and without diffusion."""
        return replace(self, conduction=self.conduction_delivered * rate + self.diffusion)

    def faster(self, factor: float) -> EnergyWavePrediction:
        """The same wave with its sound so many times as fast."""
        coupling = factor * self.coupling
        return replace(self, sound_speed=factor * self.sound_speed, coupling=coupling)

    def function(self, name: str, time: ArrayLike) -> Array:
        """One of the eight by its name, at times [time]."""
        if name == "transverse":
            return self.transverse(time)
        places = {
            "density": (0, 0),
            "longitudinal": (1, 1),
            "cross": (0, 1),
            "reversed_cross": (0, 1),
            "energy": (2, 2),
            "density_energy": (0, 2),
            "energy_current": (2, 1),
        }
        return np.asarray(self.system.correlations(time)[places[name]])

    def density(self, time: ArrayLike) -> Array:
        """Density correlation at times [time], 1 at zero."""
        return self.function("density", time)

    def longitudinal(self, time: ArrayLike) -> Array:
        """Longitudinal current correlation at times [time], 1 at zero."""
        return self.function("longitudinal", time)

    def cross(self, time: ArrayLike) -> Array:
        """Im <rho_k(0)* j_k(t)> over the root of both variances at times [time], 0 at zero."""
        return self.function("cross", time)

    def accuracy(self, name: str, time: ArrayLike) -> Array:
        """How much a function moves at times [time] within the accuracies of its parameters [1]."""
        away = super().accuracy(name, time)
        if name == "transverse":
            return away
        centre = self.function(name, time)
        moved = np.zeros_like(centre)
        for sign in (-1.0, 1.0):
            rate = self.conduction * (1.0 + sign * self.conduction_accuracy)
            other = replace(self, conduction=rate).function(name, time)
            moved = np.maximum(moved, np.abs(other - centre))
        return np.asarray(away + moved)

    def probe_times(self, name: str) -> tuple[float, float]:
        """Two times at which a function says most [time]."""
        if name == "energy":
            return 0.5 / self.system.heat_rate, 1.0 / self.system.heat_rate
        return super().probe_times(name)


def thermal_coupling(scene: Scene, density: DensityPrediction, wave_number: float) -> float:
    """theta(k) of a scene [1/time]; 0 without an energy."""
    if not scene.active_effects.energy:
        return 0.0
    hot = density.virial_coefficient() - 1.0
    kernel, support = scene.resolution.kernel, scene.support_radius
    smear = float(kernel_transform(kernel, scene.dimension, np.array([wave_number * support]))[0])
    capacity = scene.heat_capacity_number + 0.5 * scene.dimension
    speed = scene.thermal_speed * math.sqrt(density.warmth)
    return wave_number * speed * abs(hot * smear + 1.0) / math.sqrt(capacity)


def with_energy(
    wave: WavePrediction, scene: Scene, coupling: float, dt: float
) -> EnergyWavePrediction:
    """A wave with heat, by the friction theory of the continuum.

    Parameters
    ----------
    wave : WavePrediction
        Isothermal.
    scene : Scene
        With an energy.
    coupling : float
        theta(k) [1/time].
    dt : float
        Time step of the pair splitting [time].
    """
    delivered = 1.0
    if dt > 0.0:
        ratio = dt / scene.conduction_time
        delivered -= timestep.splitting_loss(scene, ratio)
    diffusion = DIFFUSION * scene.self_diffusion * wave.wave_number**2
    theory = FrictionTheory(
        kernel=scene.resolution.kernel,
        dimension=scene.dimension,
        support=scene.support_radius,
        density=scene.fluid.density,
        shear_viscosity=1.0,
    )
    # over all directions of the velocity the friction is D a + b of that of a scalar
    across, along = theory.plane_wave_rates(wave.wave_number)
    a, b = theory.coefficients
    dimension = scene.dimension
    scalar = ((dimension - 1) * float(across) + float(along)) / (dimension * a + b)
    rate = heat_coefficient(scene) * scalar
    given = {field.name: getattr(wave, field.name) for field in fields(wave)}
    by_friction = friction_conductivity(scene)
    uncertain = 0.5 * by_friction / (by_friction + scene.conductivity)
    return EnergyWavePrediction(
        **given,
        coupling=coupling,
        conduction=delivered * rate + diffusion,
        diffusion=diffusion,
        conduction_delivered=delivered,
        conduction_accuracy=wave.viscosity_accuracy
        + uncertain
        + diffusion / (delivered * rate + diffusion),
    )
