"""Taylor-Green vortices that decay in two dimensions, without noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.box import Box
from sdpd.effects import Effects
from sdpd.equations_of_state import Tait
from sdpd.fluids import Fluid
from sdpd.initial import LatticeStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

Array = NDArray[np.float64]
REYNOLDS, MACH = 10.0, 0.05  # of the vortices' speed, and of the edge of the box
DECAY = 1.0  # e-foldings of the velocity


def scene(settings: Settings) -> Scene:
    """Density, speed of the vortices and edge of the box are 1."""
    return Scene(
        fluid=Fluid(
            density=1.0,
            shear_viscosity=1.0 / REYNOLDS,
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=Tait(),
        ),
        box=Box((1.0, 1.0)),
        resolution=Resolution(
            particles=(settings.across,) * 2, support=settings.support, kernel=settings.kernel
        ),
        calibrate=settings.calibrate,
        start=LatticeStart(velocities="zero"),
        effects=Effects(fluctuations=False),
        sound_speed=1.0 / MACH,
        velocity_scale=1.0,
    )


def flow(positions: Array) -> Array:
    """The vortices at the start."""
    x, y = 2.0 * math.pi * positions.T
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)], axis=1)


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """rms error of the velocities over the rms velocity left."""
    sim.velocities = flow(np.array(sim.positions))
    rate = 2.0 * sim.scene.fluid.kinematic_viscosity * (2.0 * math.pi) ** 2
    sim.run(time=DECAY / rate, progress=False)
    exact = math.exp(-rate * sim.time) * flow(np.array(sim.positions))
    error = np.sqrt(np.mean((sim.velocities - exact) ** 2) / np.mean(exact**2))
    return Estimate(float(error), 0.0)


TAYLOR_GREEN = Problem(
    name="taylor_green",
    title="decay of Taylor-Green vortices at Re = 10",
    error_of="velocity, rms over the rms velocity left after one e-folding",
    source="closed form",
    scene=scene,
    measure=measure,
    base=Settings(across=32),
    takes=("across", "support", "kernel", "step", "integrator", "calibrate", "precision"),
)
