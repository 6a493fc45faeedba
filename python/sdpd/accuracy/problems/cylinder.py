"""Steady flow through a square array of cylinders (Yang 2013, section 3.3), in two dimensions."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sdpd import fluids
from sdpd.accuracy.problem import Problem
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate, block_average
from sdpd.box import Box
from sdpd.effects import Effects, UniformForce
from sdpd.initial import RandomStart
from sdpd.observers import Thermodynamics
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.theory import cylinder_array_flow
from sdpd.wall_models import MODELS
from sdpd.walls import Cylinder

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

LENGTH, RADIUS = 0.1, 0.02  # m
ACCELERATION = 1.5e-7  # m/s^2
WARM_UP, SAMPLED = 2500.0, 500.0  # s; the flow comes to rest with a time of about 450 s
BLOCKS = 8


def scene(settings: Settings) -> Scene:
    """Particles anywhere: a lattice would have to shear around the cylinder first."""
    return Scene(
        fluid=fluids.water().in_plane(1.0),
        box=Box((LENGTH, LENGTH)),
        walls=(Cylinder(radius=RADIUS, centre=(LENGTH / 2, LENGTH / 2)),),
        wall_model=MODELS[settings.wall_model](),
        resolution=Resolution(
            spacing=LENGTH / settings.across, support=settings.support, kernel=settings.kernel
        ),
        calibrate=settings.calibrate,
        start=RandomStart(),
        effects=Effects(fluctuations=False),
        body_force=UniformForce((ACCELERATION, 0.0)),
        sound_speed=1e-3,
        velocity_scale=1.2e-4,
    )


@lru_cache(maxsize=4)
def _exact(nu: float, density: float) -> float:
    """Mean velocity over the cell [m/s]."""
    return cylinder_array_flow(
        length=LENGTH,
        radius=RADIUS,
        acceleration=ACCELERATION,
        kinematic_viscosity=nu,
        density=density,
    ).mean_velocity


def reference(made: Scene) -> float:
    """Of the Navier-Stokes equations."""
    return _exact(made.fluid.kinematic_viscosity, made.nominal_density)


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """Mean velocity over the whole cell: momentum over the mass that would fill it [m/s]."""
    sim.run(time=WARM_UP, progress=False)
    thermo = Thermodynamics(every=5)
    sim.run(time=settings.length * SAMPLED, observe=thermo, progress=False)
    made = sim.scene
    mass = made.particle_mass * sim.n_particles
    share = made.fluid_volume / float(np.prod(made.box.lengths))
    return block_average(thermo["momentum_x"] / mass * share, n_blocks=BLOCKS)


CYLINDER = Problem(
    name="cylinder",
    title="flow through an array of cylinders",
    error_of="mean velocity",
    source="Navier-Stokes equations by spectral elements",
    scene=scene,
    measure=measure,
    reference=reference,
    base=Settings(across=24, support=4.0),
    takes=("across", "support", "kernel", "step", "calibrate", "wall_model", "precision", "length"),
    noisy=True,
)
