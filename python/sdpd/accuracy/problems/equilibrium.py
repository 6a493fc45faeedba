"""A periodic box in equilibrium, in units of spacing, particle mass and kT."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate, block_average
from sdpd.box import Box
from sdpd.effects import Effects
from sdpd.equations_of_state import IdealGas
from sdpd.fluids import Fluid
from sdpd.initial import RandomStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["TAKES", "box", "mean", "sampled", "settle"]

TAKES = ("support", "kernel", "step", "integrator", "iterations", "noise", "precision", "length")
VISCOSITY = 20.0
SOUND_SPEED = 10.0  # X = 100
SETTLING = 60.0  # friction times


def box(
    settings: Settings,
    *,
    viscosity: float = VISCOSITY,
    capacity: float | None = None,
    dimension: int = 3,
) -> Scene:
    """A cube; with a heat capacity [kB a particle] its particles have an energy."""
    n = settings.across
    fluid = Fluid(
        density=1.0,
        shear_viscosity=viscosity,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=IdealGas(),
    )
    if capacity is not None:
        conductivity = 1.11 * viscosity * capacity
        fluid = fluid.replace(heat_capacity=capacity, thermal_conductivity=conductivity)
    return Scene(
        fluid=fluid,
        box=Box((float(n),) * dimension),
        resolution=Resolution(spacing=1.0, support=settings.support, kernel=settings.kernel),
        start=RandomStart(relax_steps=100),
        sound_speed=SOUND_SPEED,
        effects=Effects(energy=True) if capacity is not None else Effects(),
    )


def settle(sim: Simulation) -> float:
    """Run until the start is forgotten; friction time [time]."""
    tau = sim.scene.friction_time
    sim.run(time=SETTLING * tau, progress=False)
    return tau


def sampled(sim: Simulation, span: float, sample: Callable[[Simulation], float]) -> Estimate:
    """Mean of what `sample` gives once a friction time, over so many of them."""
    tau = settle(sim)
    found: list[float] = []
    sim.run(
        time=span * tau,
        every=max(1, round(tau / sim.dt)),
        callback=lambda now: found.append(sample(now)),
        progress=False,
    )
    return mean(found)


def mean(series: Sequence[float] | NDArray[np.float64]) -> Estimate:
    """Of a series in time, by 32 blocks where there are as many values."""
    return block_average(series, n_blocks=min(32, len(series)))
