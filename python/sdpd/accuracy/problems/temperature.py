"""Kinetic temperature in equilibrium."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.equilibrium import TAKES, box, mean, settle
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.observers import Thermodynamics

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

TIME = 1000.0  # friction times


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Its mean."""
    tau = settle(sim)
    every = max(1, round(0.5 * tau / sim.dt))
    thermo = Thermodynamics(every=every)
    sim.run(time=settings.length * TIME * tau, observe=thermo, progress=False)
    return mean(thermo["temperature"])


TEMPERATURE = Problem(
    name="temperature",
    title="temperature in equilibrium",
    error_of="kinetic temperature",
    source="that of the fluid",
    scene=box,
    measure=measure,
    reference=lambda made: made.fluid.temperature,
    base=Settings(across=8, support=2.65, kernel="lucy", integrator="pair_splitting"),
    takes=TAKES,
    noisy=True,
)
