"""Drift of the total energy of an isolated fluid: a conservation law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.equilibrium import settle
from sdpd.accuracy.problems.temperature_variance import scene
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate, block_average

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

PERIOD = 100.0  # friction times over which the drift is told
PERIODS = 10.0
BLOCKS = 20


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Change of the total energy in `PERIOD` friction times over the kinetic energy."""
    tau = settle(sim)
    energies = [sim.total_energy]
    for _ in range(BLOCKS):
        sim.run(time=settings.length * PERIODS * PERIOD / BLOCKS * tau, progress=False)
        energies.append(sim.total_energy)
    kinetic = 0.5 * sim.scene.dimension * sim.scene.n_particles * sim.scene.thermal_energy
    periods = settings.length * PERIODS / BLOCKS
    return block_average(np.diff(energies) / kinetic / periods, n_blocks=BLOCKS)


ENERGY_SLOPE = Problem(
    name="energy_slope",
    title="drift of the total energy",
    error_of="energy gained in 100 friction times, over the kinetic energy",
    source="conservation of energy",
    scene=scene,
    measure=measure,
    base=Settings(across=16, support=2.65, kernel="lucy", integrator="pair_splitting"),
    takes=("support", "kernel", "step", "integrator", "bookkeeping", "length"),
    noisy=True,
)
