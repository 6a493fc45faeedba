"""Self-diffusion at short times: kT/m over the friction rate of a particle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.equilibrium import TAKES, box, sampled
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

TIME = 100.0  # friction times


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Mean of kT/(m rate) over the places that the particles visit."""
    unit = sim.scene.thermal_energy / sim.scene.particle_mass
    return sampled(sim, settings.length * TIME, lambda now: unit / now.friction_rate())


DIFFUSION = Problem(
    name="diffusion",
    title="self-diffusion at short times",
    error_of="D of the initial slope",
    source="many neighbours",
    scene=box,
    measure=measure,
    reference=lambda made: made.self_diffusion_continuum,
    base=Settings(across=10, support=2.65, kernel="lucy", integrator="pair_splitting"),
    takes=TAKES,
    noisy=True,
)
