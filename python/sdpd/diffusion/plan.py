"""How many steps of which size a case runs, from its size alone: never from the clock.

A case runs as independent replicas, each of them: equilibration with large steps; then, for each
block, some large steps to renew the arrangement of the particles, long steps for the integral of
the velocity autocorrelation (VACF) and the displacements, and short ones for its initial slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sdpd import timestep, validation
from sdpd.scene import Scene

__all__ = ["CORE_MINUTES", "PAIRS_PER_SECOND", "Plan", "plan_case", "quick_plan"]

# Pairs per second of one ordinary core with the pair splitting: only to turn minutes into steps.
PAIRS_PER_SECOND = 1.2e7
# Per case: five cases on two cores take about three and a half minutes.
CORE_MINUTES = 1.2
POINTS = 32  # lags on each level of the correlator


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Steps of one case.

    Attributes
    ----------
    large, short, long : float
        Time steps [time]: for equilibration, for the slope of the VACF, for its integral and the
        mean-square displacement.
    replicas : int
        Independent runs of the case.
    blocks : int
        Blocks of each replica; standard errors are between all blocks.
    equilibration : tuple of int
        Steps at the large dt, half of it and a quarter of it, before the first block.
    renewal : tuple of int
        Steps at the large dt and a quarter of it before each block.
    settling, short_steps, long_steps : int
        Of each block; short steps before those that are sampled.
    """

    large: float
    short: float
    long: float
    replicas: int
    blocks: int
    equilibration: tuple[int, int, int]
    renewal: tuple[int, int]
    short_steps: int
    long_steps: int
    settling: int = 16

    @property
    def replica_steps(self) -> int:
        """Steps of one replica."""
        block = sum(self.renewal) + self.settling + self.short_steps + self.long_steps
        return sum(self.equilibration) + self.blocks * block

    @property
    def steps(self) -> int:
        """Steps of all replicas."""
        return self.replicas * self.replica_steps

    @property
    def levels(self) -> int:
        """Levels of the correlator that reach the length of a block."""
        return max(1, math.ceil(math.log2(self.long_steps / (POINTS - 1))) + 1)

    @property
    def window(self) -> tuple[float, float]:
        """Lags of the fit to the mean-square displacement [time]."""
        length = self.long_steps * self.long
        return 0.4 * length, 0.9 * length

    @property
    def cutoff(self) -> float:
        """Last lag of the integral of the VACF [time]: a power of two below the end of a block."""
        octaves = max(0, math.floor(math.log2(0.9 * self.long_steps / POINTS)))
        return float(POINTS * 2**octaves * self.long)

    @property
    def sampled(self) -> float:
        """Simulated time of all long blocks together [time]."""
        return self.replicas * self.blocks * self.long_steps * self.long


def _steps(scene: Scene) -> tuple[float, float, float]:
    """The large, short and long time step."""
    friction = ("friction", "velocity autocorrelation")
    bounds = [b.value for b in timestep.bounds(scene, "pair_splitting") if b.name not in friction]
    tau, large = scene.friction_time, min(bounds)
    return large, min(0.05 * tau, large), min(0.5 * tau, large)


def _renewal(scene: Scene) -> int:
    """Large steps after which the density has forgotten: four times its measured memory."""
    return round(40.0 * max(1.0, math.sqrt(scene.stiffness / 100.0)))


def plan_case(scene: Scene, *, core_minutes: float = CORE_MINUTES) -> Plan:
    """Plan a case that takes about so many minutes of one core.

    Parameters
    ----------
    scene : Scene
    core_minutes : float
        Of all replicas together; a lower limit of steps keeps it meaningful.

    Returns
    -------
    Plan
        Two replicas of eight blocks. The time goes into the length of the blocks.
    """
    minutes = validation.positive("core_minutes", core_minutes)
    pairs = scene.n_particles * scene.pairs_per_particle
    replicas, blocks, short_steps = 2, 8, 40
    equilibration, renewal = (300, 60, 60), (_renewal(scene), 8)
    total = 60.0 * minutes * PAIRS_PER_SECOND / pairs / replicas
    other = sum(renewal) + Plan.settling + short_steps
    length = (total - sum(equilibration)) / blocks - other
    large, short, long = _steps(scene)
    return Plan(
        large=large,
        short=short,
        long=long,
        replicas=replicas,
        blocks=blocks,
        equilibration=equilibration,
        renewal=renewal,
        short_steps=short_steps,
        long_steps=max(2 * POINTS, int(length)),
    )


def quick_plan(scene: Scene) -> Plan:
    """Plan for a look in seconds, with errors of up to ten times those of `plan_case`."""
    large, short, long = _steps(scene)
    return Plan(
        large=large,
        short=short,
        long=long,
        replicas=1,
        blocks=8,
        equilibration=(160, 20, 20),
        renewal=(16, 4),
        short_steps=24,
        long_steps=2 * POINTS,
    )
