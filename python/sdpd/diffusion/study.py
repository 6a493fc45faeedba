"""The study: all cases side by side, one process a core, with one progress bar."""

from __future__ import annotations

import math
import os
import queue
import signal
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sdpd import progress as bars
from sdpd import validation
from sdpd.diffusion.cases import Case, get_cases
from sdpd.diffusion.collective import CollectiveTheory, collective_theory
from sdpd.diffusion.measure import Sample, replica_seed, run_replica
from sdpd.diffusion.plan import CORE_MINUTES, Plan, plan_case, quick_plan
from sdpd.diffusion.results import CaseResult, Limits, assess, evaluate
from sdpd.scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["QUICK_PARTICLES", "Study", "run_study"]

QUICK_PARTICLES = 343
QUICK_LIMITS = Limits(short_error=0.10, long_error=0.30, deviation=4.0, temperature=0.05)


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """All cases, measured.

    Attributes
    ----------
    fluid, kernel, sound_ratio, seed, quick, processes
        As asked for.
    limits : Limits
        What every case must reach.
    results : tuple of CaseResult
    collective : tuple of CollectiveTheory
        Mean-field estimates of each.
    seconds : float
        Wall time [s].
    """

    fluid: str
    kernel: str
    sound_ratio: float
    seed: int
    quick: bool
    processes: int
    limits: Limits
    results: tuple[CaseResult, ...]
    collective: tuple[CollectiveTheory, ...]
    seconds: float
    failures: dict[str, list[str]] = field(init=False)

    def __post_init__(self) -> None:
        found = {result.case.name: assess(result, self.limits) for result in self.results}
        object.__setattr__(self, "failures", {name: f for name, f in found.items() if f})

    @property
    def passed(self) -> bool:
        """Whether every case reaches the limits."""
        return not self.failures

    def __str__(self) -> str:
        from sdpd.diffusion.report import report

        return report(self)


def run_study(
    *,
    fluid: str = "water",
    cases: Sequence[int] | None = None,
    kernel: str = "lucy",
    equation_of_state: str | None = None,
    sound_ratio: float = 10.0,
    seed: int = 1,
    core_minutes: float = CORE_MINUTES,
    quick: bool = False,
    particles: int | None = None,
    processes: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Measure self-diffusion against particle size.

    Parameters
    ----------
    fluid : {"water", "nitrogen"}
        Table 7 or Table 8 of Yang (2013).
    cases : sequence of int, optional
        Cases of the table; 1, 3, 5, 9, 10 or all of nitrogen if None.
    kernel, equation_of_state : str
        Instead of the dissertation's, see `Case.scene`.
    sound_ratio : float
        c/v_th.
    seed : int
        Key of all randomness; results depend on nothing else but the arguments above and below,
        neither on the number of processes nor on the clock.
    core_minutes : float
        Work a case, in minutes of one ordinary core.
    quick : bool
        Small boxes and short runs: seconds, with larger errors and limits.
    particles : int, optional
        Number of particles of every case instead of the table's, at the same size of particles.
    processes : int, optional
        Run side by side; the processors at hand if None. With 1 everything happens here.
    progress : bool, optional
        Show a progress bar; None: on a terminal or in a notebook.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        For a bad argument.
    SimulationError
        If a run blows up.

    Notes
    -----
    With more than one process, call it below ``if __name__ == "__main__":`` in a script.
    """
    chosen = get_cases(fluid, None if cases is None else tuple(cases))
    seed = validation.integer("seed", seed, minimum=0)
    number = None if particles is None else validation.integer("particles", particles, minimum=2)
    number = QUICK_PARTICLES if quick and number is None else number
    if number is not None:
        chosen = [case.resized(number) for case in chosen]
    jobs = []
    for case in chosen:
        scene = case.scene(
            kernel=kernel, equation_of_state=equation_of_state, sound_ratio=sound_ratio
        )
        plan = quick_plan(scene) if quick else plan_case(scene, core_minutes=core_minutes)
        jobs.append(_Job(case, scene, plan))
    tasks = [
        _Task(k, job.scene, job.plan, replica_seed(seed, fluid, job.case.number, replica))
        for k, job in enumerate(jobs)
        for replica in range(job.plan.replicas)
    ]
    if processes is None:
        at_hand = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
        processes = at_hand or os.cpu_count() or 1
    processes = min(validation.integer("processes", processes, minimum=1), len(tasks))
    began = time.perf_counter()
    with _Bar(jobs, tasks, progress) as bar:
        samples = _run(tasks, processes, bar)
    results = [
        evaluate(job.case, job.scene, job.plan, [s for t, s in samples if t.job == k])
        for k, job in enumerate(jobs)
    ]
    return Study(
        fluid=fluid,
        kernel=kernel,
        sound_ratio=sound_ratio,
        seed=seed,
        quick=quick,
        processes=processes,
        limits=QUICK_LIMITS if quick else Limits(),
        results=tuple(results),
        collective=tuple(collective_theory(job.scene) for job in jobs),
        seconds=time.perf_counter() - began,
    )


@dataclass(frozen=True)
class _Job:
    case: Case
    scene: Scene
    plan: Plan


@dataclass(frozen=True)
class _Task:
    """One replica of a job."""

    job: int
    scene: Scene
    plan: Plan
    seed: int

    @property
    def pairs(self) -> float:
        """Pairs it will visit."""
        scene = self.scene
        return self.plan.replica_steps * scene.n_particles * scene.pairs_per_particle


class _Bar:
    """Progress over all tasks, in pairs visited."""

    def __init__(self, jobs: list[_Job], tasks: list[_Task], progress: bool | None) -> None:
        self._jobs = jobs
        self._pairs = [job.scene.n_particles * job.scene.pairs_per_particle for job in jobs]
        self._scale = 1000.0 / math.fsum(task.pairs for task in tasks)
        self._done = 0.0
        self._now: dict[int, str] = {}
        self._bar = None
        if bars.wanted(progress):
            self._bar = bars.bar(
                total=1000,
                progress=progress,
                mininterval=0.2 if sys.stderr.isatty() else 5.0,
                bar_format="{percentage:3.0f}% |{bar}| {elapsed}, {remaining} left{postfix}",
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def update(self, job: int, steps: int, what: str) -> None:
        """Count steps of a job."""
        if self._bar is None:
            return
        self._done += steps * self._pairs[job] * self._scale
        self._now.pop(job, None)
        self._now[job] = what  # the latest last
        shown = list(self._now.items())[-2:]
        text = "; ".join(f"case {self._jobs[k].case.number}: {w}" for k, w in sorted(shown))
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(int(self._done) - self._bar.n)


def _run(tasks: list[_Task], processes: int, bar: _Bar) -> list[tuple[_Task, Sample]]:
    """Samples in the order of the tasks."""
    if processes == 1:
        return [
            (task, run_replica(task.scene, task.plan, task.seed, _reporter(task, bar.update)))
            for task in tasks
        ]
    import multiprocessing

    # a forked child would inherit the threads of the core: start afresh
    context = multiprocessing.get_context("spawn")
    channel = (context.Queue(), context.Event())
    with ProcessPoolExecutor(
        processes, mp_context=context, initializer=_adopt, initargs=channel
    ) as pool:
        # the longest first, so that none is left over at the end
        order = sorted(range(len(tasks)), key=lambda k: -tasks[k].pairs)
        submitted = {k: pool.submit(_work, tasks[k]) for k in order}
        futures = [submitted[k] for k in range(len(tasks))]
        try:
            _watch(futures, channel[0], bar)
            return [(task, future.result()) for task, future in zip(tasks, futures, strict=True)]
        except BaseException:
            channel[1].set()  # the others stop at their next report
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _watch(futures: list[Future[Sample]], reports: Any, bar: _Bar) -> None:
    """Pass on progress until all are done; raise the first error."""
    left = set(futures)
    while left:
        done, left = wait(left, timeout=0.1, return_when=FIRST_COMPLETED)
        for future in done:
            future.result()
        try:
            while True:
                bar.update(*reports.get_nowait())
        except queue.Empty:
            pass


def _reporter(task: _Task, put: Callable[[int, int, str], None]) -> Callable[[int, str], None]:
    return lambda steps, what: put(task.job, steps, what)


class _StoppedError(RuntimeError):
    """Raised in a worker when another one has failed or Ctrl-C was pressed."""


_channel: Any = None


def _adopt(reports: Any, stop: Any) -> None:
    """In a worker: where to report to, and when to stop. Ctrl-C is for the parent."""
    global _channel
    _channel = reports, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _work(task: _Task) -> Sample:
    """In a worker: run one replica."""
    reports, stop = _channel

    def put(*report: Any) -> None:
        if stop.is_set():
            raise _StoppedError
        reports.put(report)

    return run_replica(task.scene, task.plan, task.seed, _reporter(task, put))
