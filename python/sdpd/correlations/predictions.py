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

import numpy as np
from numpy.typing import NDArray

from sdpd import timestep
from sdpd.correlations.energy_wave import thermal_coupling, with_energy
from sdpd.correlations.wave import WavePrediction
from sdpd.fluctuations import DensityPrediction
from sdpd.scene import Scene
from sdpd.theory import FrictionTheory, viscosities

__all__ = ["predict", "wave_numbers"]

# Accuracies, measured (docs/guide/correlations): of the continuum for the friction among the
# particles, by the lattice's factor of the friction rate and the excess of the mean density; of
# that friction for the viscosities, to which moving particles and the forces between them add up to
# 0.1 c dx/nu; of S(k) for the sound speed, which they raise.
FRICTION = (0.02, 0.2, 2.0)
VISCOSITY = (0.03, 0.1)
SOUND = (0.02, 0.2)
SPLITTING = 0.3  # of the loss of the pair splitting


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


def predict(
    scene: Scene, wave_number: float, dt: float, *, temperature: float | None = None
) -> WavePrediction:
    """Linearised hydrodynamics of one wave number, along an axis of the box.

    Parameters
    ----------
    scene : Scene
        With friction and noise, below its pairing limit.
    wave_number : float
        k [1/length], > 0.
    dt : float
        Time step of the pair splitting [time]; 0 for none.
    temperature : float, optional
        T of a fluid with an energy [temperature]; that of the fluid if None.

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
    density = DensityPrediction(scene, dt, temperature)
    plain = float(DensityPrediction(scene, 0.0, temperature).structure_factor(wave_number))
    structure = float(density.structure_factor(wave_number))
    loss = 0.0
    if dt > 0.0:
        loss = -(timestep.expected_errors(scene, dt, "pair_splitting").viscosity or 0.0)
    kept = 1.0 - loss
    if scene.active_effects.energy:
        kept *= 1.0 - 0.5 / scene.heat_capacity_number  # fluctuations of the pair's temperatures
    transverse, longitudinal = (float(rate) for rate in friction.plane_wave_rates(wave_number))
    axes = np.eye(scene.dimension)
    lattice = [
        friction.lattice_plane_wave_rate(wave_number * axes[0], axis, spacing=scene.spacing)
        for axis in (axes[1], axes[0])
    ]
    square = wave_number**2
    speed = scene.thermal_speed * math.sqrt(density.warmth)
    frequency = wave_number * speed / math.sqrt(plain)
    coupling = thermal_coupling(scene, density, wave_number)
    stretch = verlet_stretch(math.hypot(frequency, coupling), dt)
    moved = stretch * frequency
    excess = abs(density.bias)
    sonic = scene.sound.speed * scene.spacing / scene.fluid.kinematic_viscosity
    found = WavePrediction(
        wave_number=wave_number,
        structure_factor=structure,
        viscosity=kept * transverse / square,
        damping=0.5 * kept * longitudinal / square,
        delivered=kept,
        lattice_viscosity=kept * lattice[0] / square,
        lattice_damping=0.5 * kept * lattice[1] / square,
        sound_speed=moved / wave_number,
        sum_rule=structure * (moved / wave_number / speed) ** 2,
        structure_accuracy=density.accuracy("structure"),
        friction_accuracy=FRICTION[0]
        + FRICTION[1] * abs(1.0 - scene.factors.friction)
        + FRICTION[2] * excess,
        viscosity_accuracy=VISCOSITY[0] + VISCOSITY[1] * sonic + SPLITTING * loss,
        sound_accuracy=SOUND[0]
        + SOUND[1] / scene.reduced_viscosity
        + 0.5 * density.accuracy("structure"),
    )
    if not scene.active_effects.energy:
        return found
    return with_energy(found, scene, stretch * coupling, dt)


def verlet_stretch(frequency: float, dt: float) -> float:
    """Frequency of velocity Verlet over that of the mode [1]."""
    half = 0.5 * frequency * dt
    return math.asin(min(1.0, half)) / half if half > 0.0 else 1.0
