"""Parts of a step, from outside: differences of full steps that do without one thing each.

They tell friction from noise, which share the phases that `Simulation.profile` has.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sdpd.bench.fluid import liquid, simulation, water
from sdpd.bench.turns import Runs, Spread, take_turns
from sdpd.effects import Effects
from sdpd.integrators import Integrator, VelocityVerlet

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Part", "measure_parts"]

QUIET = Effects(fluctuations=False)
BARE = Effects(fluctuations=False, dissipation=False)
# part of a step -> steps with it and without it
PARTS = {
    "density, pressure force, motion": ("bare", None),
    "friction": ("quiet", "bare"),
    "uniform noise": ("uniform", "quiet"),
    "Gaussian noise": ("gaussian", "quiet"),
    "friction once more": ("again", "uniform"),
}
STEP = 0.05  # of the friction time: as many lists with noise as without


@dataclass(frozen=True, kw_only=True)
class Part:
    """Cost of a part of a step.

    Attributes
    ----------
    name : str
    particles : int
    support : float
        h/dx [1].
    pairs : float
        A particle.
    time : Spread
        Of a particle, each time it is done [ns].
    """

    name: str
    particles: int
    support: float
    pairs: float
    time: Spread

    def cells(self) -> list[str]:
        """Nanoseconds a particle and a pair, for a table."""
        return [self.time.shown(".0f"), f"{self.time.median / self.pairs:.2f}"]


def measure_parts(
    edge: int, support: float, *, threads: int, rounds: int, turn: float
) -> list[Part]:
    """Sweeps of a Verlet step, for Lucy.

    Parameters
    ----------
    edge : int
        Particles along an edge of the box.
    support : float
        h/dx [1].
    threads, rounds : int
    turn : float
        Wall time of a turn [s].
    """
    scene = water(edge, support)
    start = liquid(scene)

    def ready(effects: Effects | None = None, integrator: Integrator | None = None) -> Simulation:
        case = scene if effects is None else water(edge, support, effects=effects)
        return simulation(
            case,
            integrator=integrator or VelocityVerlet(),
            dt=STEP * water(8, support).friction_time,
            threads=threads,
            positions=start,
        )

    runs = {
        "bare": Runs(ready(BARE), turn),
        "quiet": Runs(ready(QUIET), turn),
        "uniform": Runs(ready(), turn),
        "gaussian": Runs(ready(None, VelocityVerlet(noise="gaussian")), turn),
        "again": Runs(ready(None, VelocityVerlet(iterations=1)), turn),
    }
    times = take_turns(runs, rounds)
    found = {
        name: Spread.of(
            times[more]
            if less is None
            else [a - b for a, b in zip(times[more], times[less], strict=True)]
        )
        for name, (more, less) in PARTS.items()
    }
    pairs = scene.pairs_per_particle
    return [
        Part(name=name, particles=edge**3, support=support, pairs=pairs, time=time)
        for name, time in found.items()
    ]
