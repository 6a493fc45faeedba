"""Viscosity from the flow that answers a weak sinusoidal force."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sdpd.analysis import Estimate, ensemble
from sdpd.box import AXES
from sdpd.errors import ResolutionWarning, TimeStepWarning
from sdpd.observers import Observer
from sdpd.scene import Scene
from sdpd.viscosity.plan import Plan
from sdpd.viscosity.thermostat import Thermostat

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["measure_forced"]


class _Amplitude(Observer):
    """2/N sum v_x sin(k y): the amplitude of the flow that has the shape of the force."""

    may_write: ClassVar[bool] = False

    def __init__(self, k: float, *, direction: int, along: int, every: int) -> None:
        super().__init__(every=every)
        self._k, self._direction, self._along = k, direction, along
        self.values: list[float] = []

    def sample(self, sim: Simulation) -> None:
        """Add the present amplitude."""
        wave = np.sin(self._k * sim.positions[:, self._along])
        self.values.append(2.0 * float(np.mean(sim.velocities[:, self._direction] * wave)))


def measure_forced(
    scene: Scene,
    plan: Plan,
    *,
    seed: int,
    threads: int | None = None,
    progress: bool | None = None,
) -> tuple[Estimate, Estimate, float]:
    r"""Drive a shear wave and measure it.

    Parameters
    ----------
    scene : Scene
        From `sample_scene`.
    plan : Plan
    seed, threads, progress
        As in `sdpd.Simulation`.

    Returns
    -------
    viscosity, amplitude : Estimate
        eta(k) at the wave number of the force [pressure x time], and the amplitude V of the flow
        [length/time].
    heating : float
        Of a fluid with an energy: what the force would have raised its temperature by, over T, had
        it not been taken out of all particles alike [1]; else 0.

    Notes
    -----
    A mode that decays at the rate l and gets a kick f dt in the middle of every step settles at
    V = f dt/(2 sinh(l dt/2)) at the end of steps; eta = rho l/k^2.
    """
    from sdpd.simulation import Simulation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResolutionWarning)  # one wave in a small box
        driven = scene.replace(body_force=plan.force)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        sim = Simulation(
            driven, integrator="pair_splitting", dt=plan.dt, seed=seed, threads=threads
        )
    thermostat = Thermostat(sim, seed=seed)
    thermostat.run(plan.equilibration, every=plan.forced_every, progress=progress)
    k = plan.forced_wave_number(scene)
    observer = _Amplitude(
        k,
        direction=AXES.index(plan.force.direction),
        along=AXES.index(plan.force.along),
        every=plan.forced_every,
    )
    thermostat.run(plan.forced_steps, every=plan.forced_every, observe=observer, progress=progress)
    values = np.asarray(observer.values)
    length = values.size // plan.blocks
    means = values[: plan.blocks * length].reshape(plan.blocks, length).mean(axis=1)
    span = (0.0, plan.forced_steps * plan.dt)
    amplitude = ensemble(means, window=span)
    kick = plan.force.amplitude * plan.dt
    rate = 2.0 / plan.dt * math.asinh(0.5 * kick / amplitude.value)
    viscosity = scene.fluid.density * rate / k**2
    found = Estimate(viscosity, viscosity * amplitude.relative, plan.blocks, span)
    return found, amplitude, thermostat.heating
