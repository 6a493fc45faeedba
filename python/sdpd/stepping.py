"""How a run goes: calls of the core, between which observers and the user have their turns."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sdpd import compensation, failure, running
from sdpd.cost import pairs_per_second
from sdpd.errors import SimulationError
from sdpd.observers import LoopObserver, Observer
from sdpd.progress import RunProgress

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["detach", "march"]


def march(
    sim: Simulation,
    plan: running.Plan,
    every: int,
    callback: Callable[[Simulation], object] | None,
    observers: list[Observer],
    progress: bool | None,
) -> None:
    """Alternate between the core and whoever is due."""
    sim.refresh()  # derived arrays must fit the positions if the first call fails
    _attach(sim, observers, every, plan.dt)
    python = [(o, o.every or every) for o in observers if not isinstance(o, LoopObserver)]
    turns = [turn for _, turn in python] + ([every] if callback is not None else [])
    pairs = sim.n_particles * sim._scene.pairs_per_particle
    chunk = running.chunk_steps(pairs, pairs_per_second(sim._scene, sim._integrator, sim.precision))
    hidden = 0  # steps that the arrays do not show yet
    begun: list[Observer] = []
    ahead = _March(plan, sim)
    with (
        running.Interruptions() as interruptions,
        RunProgress(plan.steps, sim.n_particles, progress) as bar,
    ):
        try:
            for observer, turn in python:
                begun.append(observer)
                observer.begin(sim, turn)
            while not ahead.is_over:
                due = [running.steps_to_next(sim.step, turn) for turn in turns]
                number, dt = ahead.next(min([chunk, *due]))
                hidden += number
                seen = sim._adaptive is not None or number in due or ahead.is_over
                seen = seen or hidden >= running.STEPS_BETWEEN_VIEWS
                _advance(sim, number, dt, first=hidden == number, show=seen)
                hidden = 0 if seen else hidden
                bar.update(number, sim.time)
                for observer, turn in python:
                    if sim.step % turn == 0:
                        observer.sample(sim)
                        if observer.may_write:
                            sim.refresh()  # for whoever looks next
                if callback is not None and sim.step % every == 0:
                    interruptions.check()
                    with interruptions.allowed():
                        callback(sim)
                    sim.refresh()
                interruptions.check()
        finally:
            try:
                sim._core.show()
            finally:
                for observer in begun:
                    observer.end(sim)


class _March:
    """The next steps of a run and their dt, until the planned ones or the planned time are over."""

    def __init__(self, plan: running.Plan, sim: Simulation) -> None:
        self.sim, self.plan, self.left = sim, plan, plan.steps
        self.end = math.inf if plan.time is None else sim.time + plan.time

    @property
    def is_over(self) -> bool:
        """Whether the run is complete."""
        if self.plan.time is None:
            return self.left <= 0
        return self.end - self.sim.time <= running.ROUNDING * max(self.plan.time, abs(self.end))

    def next(self, most: int) -> tuple[int, float]:
        """Number of steps, `most` at most, and their dt."""
        sim = self.sim
        if sim.adaptive is None:
            number = min(self.left, most)
            self.left -= number
            return number, self.plan.dt
        _choose_dt(sim)
        number = min(most, running.steps_to_next(sim.step, sim.adaptive.every))
        if self.plan.time is None:
            number = min(self.left, number)
            self.left -= number
            return number, sim.dt
        remaining = self.end - sim.time
        needed = max(1, math.ceil(remaining / sim.dt * (1.0 - running.ROUNDING)))
        return (number, sim.dt) if needed > number else (needed, remaining / needed)


def _advance(sim: Simulation, steps: int, dt: float, *, first: bool, show: bool) -> None:
    """Some steps; `first` after the arrays were shown, to which a failure returns."""
    if first:
        for observer, _, _ in sim._attached:
            observer.mark()
    if sim._integrator.compensate and dt != sim._compensated:
        _compensate(sim, dt)
    try:
        sim._core.run(steps, dt, show)
    except SimulationError as error:
        detach(sim, rewind=True)
        raise failure.describe(sim, error, dt) from None


def _compensate(sim: Simulation, dt: float) -> None:
    """Give the core the friction that delivers the viscosity at this step."""
    scene, sweeps = sim._scene, sim._integrator.sweeps
    if scene.active_effects.dissipation:
        scale = compensation.friction_scale(scene, dt, sweeps=sweeps)
        sim._core.set_friction(scale * scene.friction_across, scale * scene.friction_along)
    sim._compensated = dt


def _choose_dt(sim: Simulation) -> None:
    """A new time step, if it is adaptive and a choice is due."""
    chosen = sim._adaptive
    if chosen is None or sim.step % chosen.every:
        return
    try:
        sim._dt = chosen.choose(sim)
    except ArithmeticError as error:
        detach(sim, rewind=True)
        failed = SimulationError(str(error))
        fastest = int(np.argmax(np.einsum("ij,ij->i", sim.velocities, sim.velocities)))
        failed.step, failed.particle = sim.step, int(sim.ids[fastest])
        raise failure.describe(sim, failed, sim._dt) from None


def _attach(sim: Simulation, observers: list[Observer], every: int, dt: float) -> None:
    """Attach the observers of the loop, or leave them if they are the same."""
    wanted = [(o, o.every or every, dt) for o in observers if isinstance(o, LoopObserver)]
    if wanted != sim._attached:
        detach(sim)
        for observer, turn, step in wanted:
            observer.attach(sim, turn, step)
            sim._attached.append((observer, turn, step))
    for each in observers:
        each.adopt(sim)


def detach(sim: Simulation, *, rewind: bool = False) -> None:
    """Detach the observers of the loop; `rewind`: they forget what came after the present step."""
    for observer, _, _ in sim._attached:
        if rewind:
            observer.rewind(sim.step)
        else:
            observer.detach()
    sim._attached = []
    sim._core.detach_all()
