"""Variance of the particles' densities in equilibrium, by the time step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.equilibrium import TAKES, box, sampled
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

VISCOSITY = 2.0  # thin: at 20 the arrangement of the particles outlives the runs
TIME = 300.0  # friction times
FINE = 0.2  # of the default step, for the reference
LONGER = 2.0  # so that the reference adds little to the errors


def scene(settings: Settings) -> Scene:
    """A thin fluid."""
    return box(settings, viscosity=VISCOSITY)


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Its mean."""
    return sampled(sim, settings.length * TIME, lambda now: float(np.var(now.number_densities)))


DENSITY_VARIANCE = Problem(
    name="density_variance",
    title="density fluctuations",
    error_of="variance of the particles' densities",
    source="the same fluid at a fifth of the step",
    scene=scene,
    measure=measure,
    reference={
        "step": FINE,
        "length": lambda length: LONGER * length,
        "integrator": "pair_splitting",
    },
    base=Settings(across=8, support=2.65, kernel="lucy", integrator="pair_splitting"),
    takes=TAKES,
    noisy=True,
)
