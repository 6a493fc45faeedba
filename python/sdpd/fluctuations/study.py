"""Run a scene in equilibrium and set every fluctuation beside its prediction."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.analysis import Estimate
from sdpd.errors import TimeStepWarning
from sdpd.fluctuations.energy_sums import draw_temperatures
from sdpd.fluctuations.plan import Plan, check_scene, plan_scene
from sdpd.fluctuations.predictions import DensityPrediction
from sdpd.fluctuations.results import Item, compare, drift, judge
from sdpd.fluctuations.sampler import Sampler
from sdpd.scene import Scene

__all__ = ["Study", "run_fluctuations"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Fluctuations of a scene, measured.

    Attributes
    ----------
    scene, plan, seed
        As run.
    sampler : Sampler
        Sums by block.
    items : tuple of Item
    agreed : tuple of bool
        Verdict on each.
    prediction : DensityPrediction or None
        None beyond the pairing limit, where the approximation does not exist.
    drift : Estimate
        Relative change of the density variance from the first half to the second.
    seconds : float
        Wall time [s].
    energy_change : float
        Of a fluid with an energy, over the kinetic energy [1].
    stayed : float
        Share of the particles that ended within half a spacing of where they began [1].
    """

    scene: Scene
    plan: Plan
    seed: int
    sampler: Sampler
    items: tuple[Item, ...]
    agreed: tuple[bool, ...]
    prediction: DensityPrediction | None
    drift: Estimate
    seconds: float
    energy_change: float = 0.0
    stayed: float = 0.0

    @property
    def steady(self) -> bool:
        """Whether the two halves of the run agree, so that the start is forgotten."""
        return self.drift.agrees(0.0, level=1e-3)

    @property
    def passed(self) -> bool:
        """Whether every item agrees and the run is steady."""
        return all(self.agreed) and self.steady

    def __str__(self) -> str:
        from sdpd.fluctuations.report import report

        return report(self)


def run_fluctuations(
    scene: Scene,
    *,
    seed: int = 1,
    time_factor: float = 1.0,
    quick: bool = False,
    plan: Plan | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Equilibrate a scene, sample it and compare with theory.

    Parameters
    ----------
    scene : Scene
        In equilibrium: fluctuations on, no body force.
    seed : int
        Key of all randomness.
    time_factor : float
        Longer or shorter than the default, > 0.
    quick : bool
        Seconds, with larger errors.
    plan : Plan, optional
        Instead of the one that `time_factor` and `quick` make.
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
        If the run blows up.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=216, kernel="wendland_c2", support=2.65),
    ...     start=sdpd.RandomStart(),
    ... )
    >>> study = sdpd.fluctuations.run_fluctuations(scene, quick=True, time_factor=0.1)
    >>> study.items[0].name, study.items[0].exact
    ('variance of v_x over kT/m, N - 1', True)
    """
    from sdpd.simulation import Simulation

    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    check_scene(scene)
    seed = validation.integer("seed", seed, minimum=0)
    chosen = plan_scene(scene, time_factor=time_factor, quick=quick) if plan is None else plan
    began = time.perf_counter()
    sampler = Sampler(scene, samples=chosen.samples, every=chosen.every)
    with warnings.catch_warnings():  # above the bound for the viscosity, which is not measured
        warnings.simplefilter("ignore", TimeStepWarning)
        simulation = Simulation(
            scene, integrator="pair_splitting", dt=chosen.dt, seed=seed, threads=threads
        )
    if scene.active_effects.energy:
        simulation.temperatures = draw_temperatures(scene, seed)
    first = simulation.positions.copy()
    energy = simulation.total_energy if scene.active_effects.energy else 0.0
    if chosen.equilibration:
        simulation.run(steps=chosen.equilibration, progress=progress)
    ahead = -simulation.step % chosen.every  # the first block begins on a multiple of `every`
    simulation.run(steps=chosen.steps + ahead, observe=sampler, progress=progress)
    change = 0.0
    if scene.active_effects.energy:
        change = (simulation.total_energy - energy) / simulation.kinetic_energy
    prediction = _prediction(scene, chosen.dt, sampler)
    items = compare(scene, sampler, prediction)
    return Study(
        scene=scene,
        plan=chosen,
        seed=seed,
        sampler=sampler,
        items=items,
        agreed=judge(items),
        prediction=prediction,
        drift=drift(sampler),
        seconds=time.perf_counter() - began,
        energy_change=change,
        stayed=_stayed(scene, simulation.positions - first),
    )


def _stayed(scene: Scene, moved: NDArray[np.float64]) -> float:
    """Share of displacements below half a spacing."""
    box = np.asarray(scene.box.lengths)
    away = np.linalg.norm(moved - box * np.rint(moved / box), axis=1)
    return float(np.mean(away < 0.5 * scene.spacing))


def _prediction(scene: Scene, dt: float, sampler: Sampler) -> DensityPrediction | None:
    if scene.pairing[0] >= 1.0:
        return None
    if sampler.energy is None:
        return DensityPrediction(scene, dt)
    return DensityPrediction(scene, dt, float(np.mean(sampler.energy.temperatures)))
