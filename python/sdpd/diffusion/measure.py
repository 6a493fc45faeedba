"""One replica of a case: run it and bring back sums by block, small enough to send around."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.diffusion.plan import POINTS, Plan
from sdpd.errors import TimeStepWarning
from sdpd.scene import Scene

__all__ = ["STATE", "Sample", "normalized_vacf", "replica_seed", "run_replica"]

Array = NDArray[np.float64]
Report = Callable[[int, str], None]

STATE = ("temperature", "mean_density", "mean_pressure")
SLOPE_LAGS = 4
SLOPE_PARTS = 2  # of a short block, each a sample of its own: more freedom behind the error
CHUNK_PAIRS = 3e6  # pairs between two reports of progress


@dataclass(frozen=True, kw_only=True, eq=False)
class Sample:
    """What one replica measured; B blocks.

    Attributes
    ----------
    state : ndarray, shape (B, 3)
        Kinetic temperature [temperature], mean density [mass/length^D], mean pressure
        [energy/length^D] of each long block.
    temperature_square : ndarray, shape (B,)
        Mean square of T_kin/T - 1 in each long block [1].
    rate : ndarray, shape (B,)
        Exact initial decay rate of the VACF in each short block [1/time].
    short_lag, short_vacf : ndarray, shape (S,), (2 B, S)
        Lags [time] and VACF over its value at lag 0 [1] of the halves of the short blocks.
    lag, msd, vacf, counts : ndarray, shape (L,), (B, L), (B, L), (B, L)
        Mean-square displacement [length^2] and VACF of the long blocks, per component
        [length^2/time^2], and their time origins.
    seconds : float
        Wall time [s].
    """

    state: Array
    temperature_square: Array
    rate: Array
    short_lag: Array
    short_vacf: Array
    lag: Array
    msd: Array
    vacf: Array
    counts: Array
    seconds: float


def replica_seed(seed: int, fluid: str, case: int, replica: int) -> int:
    """Seed of a replica: the same for the same arguments, unrelated to that of any other."""
    key = (seed, sum(fluid.encode()), case, replica)
    return int(np.random.SeedSequence(key).generate_state(1, np.uint64)[0])


def run_replica(scene: Scene, plan: Plan, seed: int, report: Report | None = None) -> Sample:
    """Equilibrate a scene and sample it block by block, on one thread.

    Parameters
    ----------
    scene : Scene
    plan : Plan
    seed : int
        0 <= seed < 2**64.
    report : callable, optional
        Called with the number of steps just done and what they were for.

    Returns
    -------
    Sample

    Raises
    ------
    SimulationError
        If the run blows up.
    """
    runner = _Runner(scene, plan, seed, report)
    began = time.perf_counter()
    for share, steps in zip((1.0, 0.5, 0.25), plan.equilibration, strict=True):
        runner.run(share * plan.large, steps, "equilibration")
    for block in range(plan.blocks):
        runner.block(f"block {block + 1} of {plan.blocks}")
    return runner.sample(time.perf_counter() - began)


def normalized_vacf(velocities: Array, lags: int) -> Array:
    """VACF over the mean square of the same velocities, for lags 0 .. `lags` rows.

    Parameters
    ----------
    velocities : ndarray, shape (T, N, D)
        Consecutive velocities [length/time].
    lags : int
        < T.

    Returns
    -------
    ndarray, shape (lags + 1,)
        ``2 sum v(0).v(t) / sum (v(0)^2 + v(t)^2)`` over all origins: what the kinetic energy does
        between the ends of the series cancels, so that short series serve.
    """
    result = np.ones(lags + 1)
    for lag in range(1, lags + 1):
        early, late = velocities[:-lag], velocities[lag:]
        product = np.einsum("tnd,tnd->", early, late)
        squares = np.einsum("tnd,tnd->", early, early) + np.einsum("tnd,tnd->", late, late)
        result[lag] = 2.0 * product / squares
    return result


class _Runner:
    """A simulation on its way through a plan."""

    def __init__(self, scene: Scene, plan: Plan, seed: int, report: Report | None) -> None:
        from sdpd.simulation import Simulation

        self.plan = plan
        self.report = report
        # Most steps are long ones: lists are laid out for them.
        self.simulation = Simulation(
            scene, integrator="pair_splitting", dt=plan.long, seed=seed, threads=1
        )
        self.chunk = max(1, int(CHUNK_PAIRS / (scene.n_particles * scene.pairs_per_particle)))
        self.states: list[Array] = []
        self.squares: list[float] = []
        self.rates: list[float] = []
        self.short: list[Array] = []
        self.long: list[NDArray[np.void]] = []

    def run(self, dt: float, steps: int, what: str, observe: tuple[object, ...] = ()) -> None:
        """So many steps of dt, larger than the bounds for the VACF where that is meant."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TimeStepWarning)
            self.simulation.dt = dt
        while steps > 0:
            number = min(steps, self.chunk)
            self.simulation.run(steps=number, observe=observe, progress=False)  # type: ignore[arg-type]
            steps -= number
            if self.report is not None:
                self.report(number, what)

    def block(self, what: str) -> None:
        """Renew the arrangement, then sample the long lags and the slope.

        The slope comes last and after some steps of its own: large steps leave stiff modes a little
        too hot, and a mode that cools still weighs wrongly in the slope.
        """
        from sdpd.observers import Correlator, Thermodynamics

        plan = self.plan
        for share, steps in zip((1.0, 0.25), plan.renewal, strict=True):
            self.run(share * plan.large, steps, what)
        thermo = Thermodynamics(every=4)
        correlator = Correlator(every=1, points=POINTS, levels=plan.levels)
        self.run(plan.long, plan.long_steps, what, (thermo, correlator))
        self.states.append(np.array([thermo[name].mean() for name in STATE]))
        asked = self.simulation.scene.fluid.temperature
        self.squares.append(float(np.mean((thermo["temperature"] / asked - 1.0) ** 2)))
        self.long.append(correlator.data)
        self.run(plan.short, plan.settling, what)
        rates, velocities = [], []
        for step in range(plan.short_steps):
            if step % 8 == 0:
                rates.append(self.simulation.friction_rate())
            self.run(plan.short, 1, what)
            velocities.append(self.simulation.velocities.copy())
        self.rates.append(float(np.mean(rates)))
        for part in np.array_split(np.stack(velocities), SLOPE_PARTS):
            self.short.append(normalized_vacf(part, SLOPE_LAGS))

    def sample(self, seconds: float) -> Sample:
        """What was measured."""
        return Sample(
            state=np.stack(self.states),
            temperature_square=np.array(self.squares),
            rate=np.array(self.rates),
            short_lag=self.plan.short * np.arange(SLOPE_LAGS + 1.0),
            short_vacf=np.stack(self.short),
            lag=self.long[0]["time"],
            msd=np.stack([data["msd"] for data in self.long]),
            vacf=np.stack([data["vacf"] for data in self.long]),
            counts=np.stack([data["origins"] for data in self.long]).astype(np.float64),
            seconds=seconds,
        )
