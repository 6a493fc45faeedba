"""Run a scene with each effect on and off, from the same seeds, and set both side by side."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd import running, timestep, validation
from sdpd.bench.effects import Difference
from sdpd.bench.fluid import simulation
from sdpd.bench.turns import Runs, take_turns
from sdpd.effects_study.observables import BLOCKS, OF_ENERGY, Sampling, blocks_of, unit_of
from sdpd.effects_study.results import Change, Comparison, Study, estimate
from sdpd.effects_study.variants import EFFECTS, Variant, variants
from sdpd.initial import RandomStart
from sdpd.integrators import of_scene
from sdpd.progress import bar
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["compare_effects"]

Array = NDArray[np.float64]
WORK, QUICK_WORK = 5e7, 4e6  # pairs that a run works off
FEWEST, MOST = 256, 20_000  # steps
LEAST = 2 * BLOCKS
SEEDS = 4
ROUNDS, TURN = 7, 0.05  # turns of each side, and their length [s]


def compare_effects(
    scene: Scene,
    *,
    steps: int | None = None,
    time: float | None = None,
    seeds: int = SEEDS,
    effects: Sequence[str] = EFFECTS,
    quick: bool = False,
    threads: int = 1,
    progress: bool | None = None,
) -> Study:
    """What each effect changes in a scene, and what it costs.

    Parameters
    ----------
    scene : Scene
    steps : int, optional
        Length of each run in steps that the scene takes by itself, at least 16; some seconds a run
        by default. The second half is measured.
    time : float, optional
        The same as a simulated time [time]; at most one of both.
    seeds : int
        Runs of each side, with the same seeds; one where neither noise nor the start depends on it.
    effects : sequence of str
        Of `EFFECTS`.
    quick : bool
        Short runs, and timing of a few steps only.
    threads : int
        Of each simulation; changes no bit of what is measured.
    progress : bool, optional
        Show a progress bar; None: where somebody is likely to look.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    SimulationError
        If a run blows up.

    Notes
    -----
    Both sides of a comparison have the same integrator and the same time step, the smaller of the
    two that they would take. Standard errors are those of 8 blocks of time of each run; blocks of
    the same seed and time are compared with each other, so that a flow that is still starting does
    not count as a difference.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=64),
    ...     start=sdpd.RandomStart(),
    ... )
    >>> study = sdpd.effects_study.compare_effects(
    ...     scene, effects=["fluctuations"], steps=64, quick=True, progress=False
    ... )
    >>> [change.observable for change in study["fluctuations"].changes][:2]
    ['kinetic temperature', 'pressure']
    """
    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    number = validation.integer("seeds", seeds, minimum=1, maximum=10_000)
    if isinstance(effects, str):
        raise TypeError(f"`effects` must be a sequence of names, got the str {effects!r}")
    quick = validation.boolean("quick", quick)
    began = perf_counter()
    dt = timestep.auto_time_step(scene, of_scene(scene)).value
    span = _steps(scene, steps, time, dt, quick) * dt
    pairs, left_out = variants(scene, tuple(dict.fromkeys(effects)))
    bench = _Bench(
        scene, span, number, running.choose_threads(threads, scene.n_particles), quick=quick
    )
    reasons = {each.effect: each.reason for each in scene.regime().decisions}
    found = []
    with bar(total=len(pairs), progress=progress, unit="effect") as shown:
        for each in pairs:
            found.append(bench.compare(each, reasons.get(each.effect, "")))
            shown.update()
    return Study(
        scene=scene,
        seeds=tuple(range(1, number + 1)),
        comparisons=tuple(found),
        left_out=left_out,
        seconds=perf_counter() - began,
    )


def _steps(scene: Scene, steps: int | None, time: float | None, dt: float, quick: bool) -> int:
    if steps is None and time is None:
        work = (QUICK_WORK if quick else WORK) / (scene.n_particles * scene.pairs_per_particle)
        return int(min(max(work, LEAST if quick else FEWEST), MOST))
    plan = running.plan_steps(steps, time, dt)
    if plan.steps < LEAST:
        raise ValueError(f"`steps` must be >= {LEAST}, or `time` as long, got {plan.steps} steps")
    return plan.steps


class _Bench:
    """Runs both sides of each comparison; those of the scene itself only once."""

    def __init__(self, scene: Scene, span: float, seeds: int, threads: int, *, quick: bool) -> None:
        self._scene, self._span, self._seeds = scene, span, seeds
        self._threads, self._quick = threads, quick
        self._known: dict[tuple[str, float, bool], tuple[dict[str, Array], Simulation]] = {}

    def compare(self, pair: Variant, reason: str) -> Comparison:
        """Run and time an effect."""
        sides = (pair.off, pair.on)
        own_steps = [timestep.auto_time_step(side, pair.integrator).value for side in sides]
        dt = min(own_steps)
        steps = max(LEAST, round(self._span / dt))
        noisy = any(side.active_effects.fluctuations or side.starts_thermal for side in sides)
        warm = any(side.active_effects.energy for side in sides)
        (off, off_sim), (on, on_sim) = (self._side(side, pair, dt, steps, noisy) for side in sides)
        turn = 0.0 if self._quick else TURN
        runs = {0: Runs(off_sim, turn), 1: Runs(on_sim, turn)}
        times = take_turns(runs, 2 if self._quick else ROUNDS)
        changes = [
            Change(
                observable=name,
                unit=unit_of(name, self._scene),
                off=estimate(off[name], noisy=noisy),
                on=estimate(on[name], noisy=noisy),
                difference=estimate(on[name] - off[name], noisy=noisy),
            )
            for name in off
            if name in on and (warm or name not in OF_ENERGY)
        ]
        return Comparison(
            effect=pair.effect,
            own=pair.own,
            noisy=noisy,
            changes=tuple(changes),
            cost=Difference.of(pair.effect, pair.integrator.title, times[0], times[1]),
            dt=dt,
            steps=steps,
            dt_off=own_steps[0],
            dt_on=own_steps[1],
            reason=reason,
        )

    def _side(
        self, scene: Scene, pair: Variant, dt: float, steps: int, noisy: bool
    ) -> tuple[dict[str, Array], Simulation]:
        """Blocks of each observable, (seeds, blocks), and the last simulation."""
        key = (pair.integrator.name, dt, noisy)
        own = scene is self._scene
        if own and key in self._known:
            return self._known[key]
        random = scene.active_effects.fluctuations or scene.starts_thermal
        random = random or isinstance(scene.start, RandomStart)
        sampling, tables = Sampling.of(steps), []
        for seed in range(1, self._seeds + 1 if random else 2):
            sim = simulation(
                scene, integrator=pair.integrator, dt=dt, seed=seed, threads=self._threads
            )
            tables.append(blocks_of(sim, sampling, noisy=noisy))
        found = {name: np.array([table[name] for table in tables]) for name in tables[0]}
        if own:
            self._known[key] = (found, sim)
        return found, sim
