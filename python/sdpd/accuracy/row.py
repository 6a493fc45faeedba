"""One setting, run: error with its standard error, bias and sampling apart, time, steps, memory."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.errors import SimulationError

__all__ = ["Row", "run_setting"]


def _column(unit: str) -> Any:
    return field(metadata={"unit": unit})


@dataclass(frozen=True, kw_only=True)
class Row:
    """What one setting gives.

    Attributes
    ----------
    settings : Settings
    error : float
        Expected rms error of a single run: bias and sampling together [1]; inf if it failed.
    stderr : float
        Standard error of `error` [1].
    bias : float
        Mean deviation over all seeds, signed where the quantity is a number [1].
    bias_stderr : float
        Its standard error, that of the reference included [1].
    sampling : float
        Standard error that one run has by its finite length [1].
    seconds : float
        Processor time of a run on one thread, the smallest of all: what the clock shows where
        nothing else runs [s].
    slowest : float
        The largest of all [s].
    wall_seconds : float
        On the clock, the smallest of all [s].
    steps : int
    dt : float
        Time step [time of the scene].
    particles : int
    memory : int
        State and lists [byte].
    runs : int
        Seeds.
    note : str
        What went wrong, or "".
    """

    settings: Settings
    error: float = _column("1")
    stderr: float = _column("1")
    bias: float = _column("1")
    bias_stderr: float = _column("1")
    sampling: float = _column("1")
    seconds: float = _column("s")
    slowest: float = _column("s")
    wall_seconds: float = _column("s")
    steps: int = _column("1")
    dt: float = _column("time of the scene")
    particles: int = _column("1")
    memory: int = _column("byte")
    runs: int = _column("1")
    note: str = ""

    def record(self) -> dict[str, Any]:
        """Settings and results as one flat mapping."""
        found = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)[1:]}
        return {**dataclasses.asdict(self.settings), **found}


UNITS = {f.name: f.metadata["unit"] for f in dataclasses.fields(Row) if f.metadata}


def run_setting(
    problem: Problem,
    settings: Settings,
    *,
    seeds: Sequence[int],
    repeats: int = 1,
    finer: Estimate | None = None,
) -> Row:
    """Run a problem at a setting, once for each seed, and `repeats` times for the clock."""
    values: list[Estimate] = []
    clocks: list[tuple[float, float]] = []
    for seed, again in itertools.product(seeds, range(repeats)):
        try:
            sim = problem.simulation(settings, seed=seed)
        except ValueError as error:  # the scene refuses it
            return _failed(settings, str(error))
        began = time.process_time(), time.perf_counter()
        try:
            value = problem.measure(sim, settings)
        except SimulationError as error:
            return _failed(settings, str(error).splitlines()[0])
        clocks.append((time.process_time() - began[0], time.perf_counter() - began[1]))
        if again == 0:
            values.append(value)
    right = Estimate(0.0, 0.0) if finer is None else finer
    if callable(problem.reference):
        right = Estimate(problem.reference(sim.scene), 0.0)
    sizes = sim.statistics()
    processor, wall = zip(*clocks, strict=True)
    return Row(
        settings=settings,
        **_errors(values, right),
        seconds=min(processor),
        slowest=max(processor),
        wall_seconds=min(wall),
        steps=sim.step,
        dt=sim.dt,
        particles=sim.n_particles,
        memory=int(sizes["state_bytes"] + sizes["list_bytes"]),
        runs=len(values),
    )


def _failed(settings: Settings, note: str) -> Row:
    """A row without a result."""
    numbers: dict[str, Any] = dict.fromkeys(UNITS, 0) | {"error": math.inf, "bias": math.inf}
    return Row(settings=settings, note=note, **numbers)


def _errors(values: Sequence[Estimate], right: Estimate) -> dict[str, Any]:
    """Error, bias and sampling from the values of all seeds; relative unless right is 0."""
    unit = abs(right.value) or 1.0
    deviations = np.array([(each.value - right.value) / unit for each in values])
    variance = float(np.mean([(each.stderr / unit) ** 2 for each in values]))
    count = len(values)
    freedom = float(sum(min(each.n_effective, 1e6) - 1.0 for each in values if each.stderr))
    if count > 1:  # runs may differ by more than one run knows of itself: arrangements that stay
        between = float(np.var(deviations, ddof=1))
        if between > variance:
            variance, freedom = between, count - 1.0
    bias = float(deviations.mean())
    bias_stderr = math.hypot(math.sqrt(variance / count), right.stderr / unit)
    sampling = math.sqrt(variance)
    square = max(0.0, bias**2 - bias_stderr**2) + variance
    error = math.sqrt(square)
    stderr = 0.0
    if error > 0.0 and variance > 0.0:
        spread = variance / math.sqrt(2.0 * max(freedom, 1.0))
        stderr = math.hypot(bias * bias_stderr, spread) / error
    return {
        "error": error,
        "stderr": stderr,
        "bias": bias,
        "bias_stderr": bias_stderr,
        "sampling": sampling,
    }
