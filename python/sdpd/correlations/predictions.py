r"""What linearised fluctuating hydrodynamics expects of one wave of a fluid of particles.

Transverse currents decay with lambda_T(k), longitudinal ones with lambda_L(k) = 2 Gamma(k) k^2: the
rates of plane waves by the pair friction (:class:`sdpd.theory.FrictionTheory`). For the density the
second frequency moment is exact in any classical fluid, <|d rho_k/dt|^2>/<|rho_k|^2> =
k^2 kB T/(m S(k)), so that with a damping without memory

    rho'' + lambda_L rho' + w_k^2 rho = noise,    w_k^2 = k^2 kB T/(m S(k)),    c(k) = w_k/k,

and c(k)^2 -> c^2 + kB T/m as k -> 0. Hansen and McDonald, *Theory of Simple Liquids*, 4th ed.,
2013, secs. 7.4, 8.5 and 9.3. At a finite step the pair splitting delivers a little less friction,
and velocity Verlet within it moves a mode with w_dt = (2/dt) asin(w_k dt/2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import timestep
from sdpd.fluctuations import DensityPrediction
from sdpd.scene import Scene
from sdpd.theory import FrictionTheory, viscosities
from sdpd.theory.hydrodynamics import damped_wave

__all__ = ["WavePrediction", "predict", "wave_numbers"]

Array = NDArray[np.float64]

# Accuracies, measured (docs/guide/correlations): of the continuum for the friction among the
# particles, by the lattice's factor of the friction rate and the excess of the mean density; of
# that friction for the viscosities, to which moving particles and the forces between them add up to
# 0.1 c dx/nu; of S(k) for the sound speed, which they raise.
FRICTION = (0.02, 0.2, 2.0)
VISCOSITY = (0.03, 0.1)
SOUND = (0.02, 0.2)
SPLITTING = 0.3  # of the loss of the pair splitting


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
            fast = replace(self, sound_speed=self.sound_speed * (1.0 + sign * sound))
            moved = np.abs(thick.function(name, time) - centre)
            if name != "transverse":
                moved = moved + np.abs(fast.function(name, time) - centre)
            away = np.maximum(away, moved)
        return np.asarray(away)

    def probe_times(self, name: str) -> tuple[float, float]:
        """Two times at which a function says most, about a half and one decay or turn [time]."""
        if name == "transverse":
            return 0.5 / self.shear_rate, 1.0 / self.shear_rate
        turn = math.pi / max(self.frequency, self.sound_rate)
        first = 0.25 if "cross" in name else 0.5
        return first * turn, 2.0 * first * turn

    def _wave(self, time: ArrayLike) -> tuple[Array, Array]:
        t = np.asarray(time, dtype=np.float64)
        even, odd, _ = damped_wave(t, self.frequency, self.sound_rate)
        return even, odd


def wave_numbers(scene: Scene, waves: tuple[int, ...]) -> list[tuple[float, NDArray[np.int64]]]:
    """|k| [1/length], ascending, and the integer vectors of that length, shape (K, D).

    They lie along the axes, `waves` wavelengths to an edge.
    """
    box = scene.box.lengths
    chosen = [(number / edge, axis, number) for number in waves for axis, edge in enumerate(box)]
    found: list[tuple[float, list[NDArray[np.int64]]]] = []
    for inverse, axis, number in sorted(chosen):
        vector = number * np.eye(len(box), dtype=np.int64)[axis]
        if found and inverse <= found[-1][0] * (1.0 + 1e-9):
            found[-1][1].append(vector)
        else:
            found.append((inverse, [vector]))
    return [(2.0 * math.pi * inverse, np.array(group)) for inverse, group in found]


def predict(scene: Scene, wave_number: float, dt: float) -> WavePrediction:
    """Linearised hydrodynamics of one wave number, along an axis of the box.

    Parameters
    ----------
    scene : Scene
        With friction and noise, below its pairing limit.
    wave_number : float
        k [1/length], > 0.
    dt : float
        Time step of the pair splitting [time]; 0 for none.

    Returns
    -------
    WavePrediction
    """
    eta, zeta = viscosities(scene.friction_across, scene.friction_along, scene.dimension)
    friction = FrictionTheory(
        kernel=scene.resolution.kernel,
        dimension=scene.dimension,
        support=scene.support_radius,
        density=scene.fluid.density,
        shear_viscosity=eta,
        bulk_viscosity=zeta,
    )
    density = DensityPrediction(scene, dt)
    plain = float(DensityPrediction(scene, 0.0).structure_factor(wave_number))
    structure = float(density.structure_factor(wave_number))
    loss = 0.0
    if dt > 0.0:
        loss = -(timestep.expected_errors(scene, dt, "pair_splitting").viscosity or 0.0)
    kept = 1.0 - loss
    transverse, longitudinal = (float(rate) for rate in friction.plane_wave_rates(wave_number))
    axes = np.eye(scene.dimension)
    lattice = [
        friction.lattice_plane_wave_rate(wave_number * axes[0], axis, spacing=scene.spacing)
        for axis in (axes[1], axes[0])
    ]
    square = wave_number**2
    frequency = wave_number * scene.thermal_speed / math.sqrt(plain)
    moved = 2.0 / dt * math.asin(min(1.0, 0.5 * frequency * dt)) if dt > 0.0 else frequency
    excess = abs(density.bias)
    sonic = scene.sound.speed * scene.spacing / scene.fluid.kinematic_viscosity
    return WavePrediction(
        wave_number=wave_number,
        structure_factor=structure,
        viscosity=kept * transverse / square,
        damping=0.5 * kept * longitudinal / square,
        delivered=kept,
        lattice_viscosity=kept * lattice[0] / square,
        lattice_damping=0.5 * kept * lattice[1] / square,
        sound_speed=moved / wave_number,
        sum_rule=structure * (moved / wave_number / scene.thermal_speed) ** 2,
        structure_accuracy=density.accuracy("structure"),
        friction_accuracy=FRICTION[0]
        + FRICTION[1] * abs(1.0 - scene.factors.friction)
        + FRICTION[2] * excess,
        viscosity_accuracy=VISCOSITY[0] + VISCOSITY[1] * sonic + SPLITTING * loss,
        sound_accuracy=SOUND[0]
        + SOUND[1] / scene.reduced_viscosity
        + 0.5 * density.accuracy("structure"),
    )
