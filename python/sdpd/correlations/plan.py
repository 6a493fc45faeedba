"""How many runs, how long, at which step, and how often the waves are looked at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sdpd import timestep, validation
from sdpd.correlations.predictions import predict, wave_numbers
from sdpd.fluctuations.plan import check_scene as check_equilibrium
from sdpd.scene import Scene

__all__ = ["WAVES", "Plan", "check_scene", "check_waves", "plan_scene"]

WAVES = (1, 2, 4)
RUNS, QUICK_RUNS = 16, 8
BLOCKS = 2  # of each run
# Decay times of the slowest mode: in a block, before the first sample, and in the longest lag.
LENGTH, QUICK_LENGTH = 12.0, 6.0
EQUILIBRATION = 6.0
REACH = 3.0
FRICTION_TIMES = 100.0  # of equilibration at least, for the cages of the particles
RESOLUTION = 0.15  # of the fastest mode's time between samples
POINTS = 64


@dataclass(frozen=True, kw_only=True)
class Plan:
    """An ensemble of independent runs.

    Parameters
    ----------
    dt : float
        Time step [time], > 0.
    equilibration : int
        Steps of each run before its first sample, >= 0.
    runs : int
        Number of runs, >= 1, with seeds of their own.
    blocks : int
        Blocks of a run behind the standard errors, >= 2; `runs` times `blocks` is at least 8.
    steps : int
        Steps of a block, >= 1.
    every : int
        Steps between samples, >= 1.
    points, levels : int
        Lags of the correlator: `points`, even, at every sample, then half as many on each further
        level, twice as far apart.
    """

    dt: float
    equilibration: int
    runs: int = RUNS
    blocks: int = BLOCKS
    steps: int
    every: int = 1
    points: int = POINTS
    levels: int = 1

    def __post_init__(self) -> None:
        validation.positive("dt", self.dt)
        validation.integer("equilibration", self.equilibration, minimum=0)
        validation.integer("runs", self.runs, minimum=1)
        validation.integer("blocks", self.blocks, minimum=2)
        validation.integer("steps", self.steps, minimum=1)
        validation.integer("every", self.every, minimum=1)
        validation.integer("points", self.points, minimum=8)
        validation.integer("levels", self.levels, minimum=1)
        if self.runs * self.blocks < 8:
            raise ValueError(
                f"`runs` x `blocks` must be >= 8 for a standard error, got {self.runs} x "
                f"{self.blocks}"
            )

    @property
    def run_steps(self) -> int:
        """Steps of one run, without its equilibration."""
        return self.blocks * self.steps

    @property
    def total_steps(self) -> int:
        """Steps of all runs, with their equilibration."""
        return self.runs * (self.equilibration + self.run_steps)

    @property
    def longest_lag(self) -> float:
        """[time]."""
        samples = (self.points - 1) * 2.0 ** (self.levels - 1)
        return samples * self.every * self.dt


def check_scene(scene: Scene) -> None:
    """Refuse a scene that has no linearised hydrodynamics at equilibrium.

    Raises
    ------
    ValueError
        Without noise or friction, with a body force, or beyond the pairing limit.
    """
    check_equilibrium(scene)
    if not scene.active_effects.dissipation or scene.fluid.shear_viscosity == 0.0:
        raise ValueError("`scene` must have friction, got one without")
    if scene.pairing[0] >= 1.0:
        raise ValueError(
            f"`scene` must be below its pairing limit, got X = {scene.stiffness:.4g}, where "
            "particles clump and S(k) has no prediction; take another kernel or a lower sound speed"
        )


def check_waves(scene: Scene, waves: Sequence[int] | None) -> tuple[int, ...]:
    """Waves along each axis: those asked for, or those of `WAVES` that the support resolves.

    Raises
    ------
    TypeError, ValueError
        If they are no positive integers, or a wave is shorter than two supports.
    """
    shortest = min(scene.box.lengths)
    most = int(shortest / (2.0 * scene.support_radius) * (1.0 + 1e-9))
    if waves is None:
        return tuple(number for number in WAVES if number <= most)
    numbers = tuple(
        validation.integer(f"waves[{index}]", number, minimum=1)
        for index, number in enumerate(waves)
    )
    if not numbers:
        raise ValueError("`waves` must not be empty")
    if max(numbers) > most:
        raise ValueError(
            f"`waves` must be at most {most} here, so that a wave is two supports long, got "
            f"{max(numbers)}"
        )
    return tuple(sorted(set(numbers)))


def plan_scene(
    scene: Scene,
    *,
    waves: Sequence[int] | None = None,
    runs: int | None = None,
    quick: bool = False,
) -> Plan:
    """Plan an ensemble from the rates of the waves, so that results do not depend on the clock.

    Parameters
    ----------
    scene : Scene
    waves : sequence of int, optional
        Wavelengths along each edge of the box; 1, 2 and 4 if None, as far as resolved.
    runs : int, optional
        Independent runs; 16, or 8 with `quick`, if None.
    quick : bool
        A quarter of the work.

    Returns
    -------
    Plan
        At the largest time step within all bounds.
    """
    check_scene(scene)
    dt = timestep.auto_time_step(scene, "pair_splitting").value
    shells = wave_numbers(scene, check_waves(scene, waves))
    found = [predict(scene, wave_number, dt) for wave_number, _ in shells]
    slowest = min(wave.slowest_rate for wave in found)
    fastest = max(wave.fastest_rate for wave in found)
    every = max(1, int(RESOLUTION / (fastest * dt)))
    number = validation.integer("runs", runs, minimum=1) if runs is not None else 0
    number = number or (QUICK_RUNS if quick else RUNS)
    length = (QUICK_LENGTH if quick else LENGTH) / (slowest * dt)
    wanted = REACH / (slowest * dt * every)
    settle = EQUILIBRATION / slowest + FRICTION_TIMES * scene.friction_time
    return Plan(
        dt=dt,
        equilibration=math.ceil(settle / dt),
        runs=number,
        blocks=max(BLOCKS, math.ceil(8 / number)),
        steps=every * math.ceil(length / every),
        every=every,
        levels=1 + max(0, math.ceil(math.log2(wanted / (POINTS - 1)))),
    )
