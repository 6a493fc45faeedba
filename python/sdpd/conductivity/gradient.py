"""Conductivity by the heat through a slab between plates of different temperatures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sdpd import validation
from sdpd.analysis.estimate import Estimate
from sdpd.box import AXES, Box
from sdpd.conductivity.lattice import check_conduction, scene_step
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.wall_heat import Isothermal
from sdpd.walls import Plane

__all__ = ["imposed_gradient"]


def imposed_gradient(
    scene: Scene,
    *,
    difference: float = 0.1,
    layers: int = 12,
    times: float = 8.0,
    seed: int = 1,
    n_blocks: int = 32,
    dt: float | str = "auto",
) -> Estimate:
    """The conductivity from the heat that passes between plates of different temperatures.

    Parameters
    ----------
    scene : Scene
        Its fluid, kernel, support, spacing, start and effects count.
    difference : float
        Of the temperatures of the plates, over that of the fluid [1].
    layers : int
        Spacings between the plates, four supports at least.
    times : float
        How long to measure, in times L^2/(pi^2 kappa/(rho c_v)) of the slab; as long again is taken
        for the steady state.
    seed : int
    n_blocks : int
        Of time, for the error.
    dt : float or "auto"
        [time].

    Returns
    -------
    Estimate
        kappa at the temperature of the fluid [energy/(time temperature length^(D-2))]. Both plates
        count; their difference is in the error.

    Raises
    ------
    TypeError, ValueError
        If the fluid does not conduct, or an argument is out of range.
    """
    from sdpd.observers import WallForces
    from sdpd.simulation import Simulation

    check_conduction(scene)
    share = validation.positive("difference", difference)
    if share >= 1.0:
        raise ValueError(f"`difference` must be below 1, got {share:g}")
    blocks = validation.integer("n_blocks", n_blocks, minimum=2)
    d, spacing, support = scene.dimension, scene.spacing, scene.resolution.support
    across = max(validation.integer("layers", layers, minimum=2), math.ceil(4.0 * support))
    side = math.ceil(2.0 * support * (1.0 + 1e-9))
    sides = (*[side] * (d - 1), across)
    box = Box(tuple(n * spacing for n in sides), periodic=AXES[: d - 1])
    axis, width, t0 = AXES[d - 1], across * spacing, scene.fluid.temperature
    cold, hot = (Isothermal(t0 * (1.0 + sign * share / 2.0)) for sign in (-1.0, 1.0))
    slab = scene.replace(
        box=box,
        resolution=Resolution(particles=sides, support=support, kernel=scene.resolution.kernel),
        effects=replace(scene.effects, body_force=None),
        body_force=None,
        walls=(Plane(axis=axis, at=0.0, heat=cold), Plane(axis=axis, at=width, heat=hot)),
        velocity_scale=None,
    )
    fluid = slab.fluid
    diffusivity = slab.conductivity / (fluid.density * (fluid.heat_capacity or 1.0))
    whole = width**2 / (math.pi**2 * diffusivity) * validation.positive("times", times)
    sim = Simulation(slab, dt=scene_step(slab, dt), seed=seed, threads=1)
    z = np.asarray(sim.positions[:, d - 1]) / width
    sim.temperatures = t0 * (1.0 + share * (z - 0.5))
    sim.run(time=whole, progress=False)
    every = max(1, round(whole / sim.dt / blocks))
    forces = WallForces(every=every)
    sim.run(steps=blocks * every, observe=forces, progress=False)
    flux = 0.5 * (forces.heat_flux[-blocks:, 0] - forces.heat_flux[-blocks:, 1])
    kappa = flux * width / (share * t0)
    return Estimate(float(kappa.mean()), float(kappa.std(ddof=1) / math.sqrt(blocks)), blocks)
