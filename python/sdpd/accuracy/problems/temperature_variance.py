"""Variance of the particles' temperatures in equilibrium, where they have an energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.equilibrium import box, sampled
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.scene import Scene
from sdpd.theory import EnergyShell

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

CAPACITY = 25.0  # kB a particle
TIME = 1000.0  # friction times


def scene(settings: Settings) -> Scene:
    """In two dimensions."""
    return box(settings, capacity=CAPACITY, dimension=2)


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Mean of Var T_i over the square of the temperature at the energy of the run."""
    shell = _shell(sim.scene)

    def sample(now: Simulation) -> float:
        heat = shell.heat_capacity * float(np.sum(now.temperatures)) + now.kinetic_energy
        return float(np.mean((now.temperatures * shell.freedom / heat - 1.0) ** 2))

    return sampled(sim, settings.length * TIME, sample)


def _shell(made: Scene) -> EnergyShell:
    return EnergyShell(particles=made.n_particles, dimension=made.dimension, heat_capacity=CAPACITY)


TEMPERATURE_VARIANCE = Problem(
    name="temperature_variance",
    title="temperature fluctuations",
    error_of="variance of the particles' temperatures, C = 25 kB",
    source="exact, at constant energy",
    scene=scene,
    measure=measure,
    reference=lambda made: _shell(made).variance,
    base=Settings(across=16, support=2.65, kernel="lucy", integrator="pair_splitting"),
    takes=("support", "kernel", "step", "integrator", "bookkeeping", "length"),
    noisy=True,
)
