"""Run the ensemble of a scene and set its correlation functions beside linearised theory."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.analysis import Correlation
from sdpd.correlations.plan import Plan, check_scene, check_waves, plan_scene
from sdpd.correlations.predictions import predict, wave_numbers
from sdpd.correlations.recorder import FrictionSampler, correlator, function_names, functions
from sdpd.correlations.results import Shell, assemble_shell, compare
from sdpd.errors import TimeStepWarning
from sdpd.fluctuations.energy_sums import draw_temperatures, shell_temperature
from sdpd.fluctuations.results import Item, judge
from sdpd.scene import Scene

__all__ = ["Study", "run_correlations", "run_seed"]

FRICTION_SAMPLES = 4  # of each run


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Correlation functions of a scene, measured.

    Attributes
    ----------
    scene, plan, waves, seed
        As run.
    shells : tuple of Shell
        By ascending wave number.
    items : tuple of Item
    agreed : tuple of bool
        Verdict on each.
    seconds : float
        Wall time [s].
    """

    scene: Scene
    plan: Plan
    waves: tuple[int, ...]
    seed: int
    shells: tuple[Shell, ...]
    items: tuple[Item, ...]
    agreed: tuple[bool, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether every item agrees."""
        return all(self.agreed)

    @property
    def blocks(self) -> int:
        """Blocks behind the standard errors."""
        return self.shells[0].functions["density"].n_blocks

    def __str__(self) -> str:
        from sdpd.correlations.report import report

        return report(self)


def run_seed(seed: int, run: int) -> int:
    """Seed of one run of the ensemble."""
    return int(np.random.SeedSequence([seed, run]).generate_state(1, np.uint64)[0] >> 1)


def run_correlations(
    scene: Scene,
    *,
    waves: Sequence[int] | None = None,
    seed: int = 1,
    runs: int | None = None,
    quick: bool = False,
    plan: Plan | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Run independent simulations of a scene and compare its waves with linearised theory.

    Parameters
    ----------
    scene : Scene
        In equilibrium: fluctuations and friction on, no body force.
    waves : sequence of int, optional
        Wavelengths along each edge of the box; 1, 2 and 4 if None, as far as two supports long.
    seed : int
        Key of all randomness; each run has a seed of its own made from it.
    runs : int, optional
        Independent runs.
    quick : bool
        A quarter of the work, larger errors.
    plan : Plan, optional
        Instead of the one that `runs` and `quick` make.
    threads : int, optional
        Changes no bit of the result.
    progress : bool, optional
        Show a progress bar; None: on a terminal or in a notebook.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        For a bad argument or a scene without such an equilibrium.
    SimulationError
        If a run blows up.
    """
    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    check_scene(scene)
    numbers = check_waves(scene, waves)
    seed = validation.integer("seed", seed, minimum=0)
    chosen = plan_scene(scene, waves=numbers, runs=runs, quick=quick) if plan is None else plan
    began = time.perf_counter()
    groups = wave_numbers(scene, numbers)
    vectors = [group for _, group in groups]
    members, rates, kelvin = [], [], []
    for run in range(chosen.runs):
        found, friction, warm = _run(scene, chosen, vectors, run_seed(seed, run), threads, progress)
        members.append(found)
        rates.append(friction)
        kelvin.append(warm)
    temperature = float(np.mean(kelvin)) if scene.active_effects.energy else None
    warmth = 1.0 if temperature is None else temperature / scene.fluid.temperature
    shells = tuple(
        assemble_shell(
            scene,
            group,
            [member[index] for member in members],
            np.array(rates)[:, index],
            predict(scene, wave_number, chosen.dt, temperature=temperature),
            warmth=warmth,
        )
        for index, (wave_number, group) in enumerate(groups)
    )
    items = compare(scene, shells)
    return Study(
        scene=scene,
        plan=chosen,
        waves=numbers,
        seed=seed,
        shells=shells,
        items=items,
        agreed=judge(items),
        seconds=time.perf_counter() - began,
    )


def _run(
    scene: Scene,
    plan: Plan,
    vectors: list[NDArray[np.int64]],
    seed: int,
    threads: int | None,
    progress: bool | None,
) -> tuple[list[dict[str, Correlation]], NDArray[np.float64], float]:
    """Functions of each wave number, friction in place (wave numbers, 2 or 3) and T of one run."""
    from sdpd.simulation import Simulation

    with warnings.catch_warnings():  # a plan may exceed a bound that does not matter here
        warnings.simplefilter("ignore", TimeStepWarning)
        simulation = Simulation(
            scene, integrator="pair_splitting", dt=plan.dt, seed=seed, threads=threads
        )
    energy = scene.active_effects.energy
    if energy:
        simulation.temperatures = draw_temperatures(scene, seed)
    simulation.run(steps=plan.equilibration, progress=progress)
    recorder = correlator(vectors, plan)
    friction = FrictionSampler(scene, vectors, every=max(1, plan.run_steps // FRICTION_SAMPLES))
    simulation.run(steps=plan.run_steps, observe=[recorder, friction], progress=progress)
    temperature = shell_temperature(simulation) if energy else scene.fluid.temperature
    return functions(recorder, plan, function_names(scene)), friction.rates, temperature
