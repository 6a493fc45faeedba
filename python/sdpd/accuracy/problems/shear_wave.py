"""A small shear wave on a lattice at rest: the viscosity that particles deliver."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.box import Box
from sdpd.effects import Effects
from sdpd.fluids import Fluid
from sdpd.initial import LatticeStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

AMPLITUDE = 1e-6  # of the velocity, in edges of the box over the time of the decay
SOFTNESS = 1e-3  # sound over the decay: a lattice has a shear modulus of its own


def scene(settings: Settings) -> Scene:
    """Density, viscosity and edge of the box are 1."""
    n = settings.across
    return Scene(
        fluid=Fluid(density=1.0, shear_viscosity=1.0, temperature=1.0, boltzmann_constant=1.0),
        box=Box((1.0, 1.0, 1.0)),
        resolution=Resolution(
            particles=(n, n, n), support=settings.support, kernel=settings.kernel
        ),
        calibrate=settings.calibrate,
        start=LatticeStart(velocities="zero"),
        effects=Effects(fluctuations=False),
        sound_speed=SOFTNESS * 2.0 * math.pi,
        velocity_scale=AMPLITUDE,
    )


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Decay rate over nu k^2."""
    k = 2.0 * math.pi
    wave = np.sin(k * sim.positions[:, 0])
    velocities = np.zeros_like(sim.velocities)
    velocities[:, 1] = AMPLITUDE * wave
    sim.velocities = velocities
    sim.run(time=0.5 / k**2, progress=False)
    left = float(sim.velocities[:, 1] @ wave) / float(velocities[:, 1] @ wave)
    return Estimate(-math.log(left) / (k**2 * sim.time), 0.0)


SHEAR_WAVE = Problem(
    name="shear_wave",
    title="decay of a shear wave in three dimensions",
    error_of="decay rate",
    source="nu k^2",
    scene=scene,
    measure=measure,
    reference=lambda made: 1.0,
    base=Settings(across=12, integrator="pair_splitting"),
    takes=("across", "support", "kernel", "step", "integrator", "calibrate", "precision"),
)
