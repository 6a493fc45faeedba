"""Decay of a shear wave on a lattice at rest, without noise: what kernel and step deliver."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace

import numpy as np

from sdpd import equations_of_state as eos
from sdpd import validation
from sdpd.analysis import Estimate, ensemble
from sdpd.box import Box
from sdpd.errors import ResolutionWarning, TimeStepWarning
from sdpd.initial import LatticeStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.viscosity.predictions import friction_theory

__all__ = ["LatticeDecay", "measure_lattice"]

FEWEST_EDGE = {2: 16, 3: 8}  # particles along an edge
FEWEST_STEPS = 4
SOFTNESS = 1e-3  # sound over the decay of the wave: the lattice has a shear modulus of its own
DISPLACEMENT = 1e-6  # of a particle, in spacings, while the wave decays


@dataclass(frozen=True, kw_only=True)
class LatticeDecay:
    """Measured decay over the exact lattice sum.

    Attributes
    ----------
    dt : float
        Time step [time].
    edge : int
        Particles along an edge of the lattice, one wave long.
    factor : Estimate
        Delivered viscosity over that of the lattice sum at the same wave number [1]; the error is
        the spread over directions of wave and velocity.
    """

    dt: float
    edge: int
    factor: Estimate


def measure_lattice(scene: Scene, dt: float, *, threads: int | None = None) -> LatticeDecay:
    """Let a shear wave decay on the undisturbed lattice, along every axis.

    Parameters
    ----------
    scene : Scene
        Its kernel, support, friction and spacing are used.
    dt : float
        Time step of the pair splitting [time], > 0.
    threads : int, optional
        Changes no bit of the result.

    Returns
    -------
    LatticeDecay
    """
    step = validation.positive("dt", dt)
    edge = max(FEWEST_EDGE[scene.dimension], math.ceil(2.0 * scene.resolution.support))
    lattice = _lattice_scene(scene, edge)
    axes = range(scene.dimension)
    found = [_decay(lattice, step, a, b, threads) for a in axes for b in axes if a != b]
    return LatticeDecay(dt=step, edge=edge, factor=ensemble(found))


def _lattice_scene(scene: Scene, edge: int) -> Scene:
    """A cube of lattice without noise, too soft for sound or elasticity."""
    spacing = scene.spacing
    length = edge * spacing
    speed = SOFTNESS * scene.fluid.kinematic_viscosity * 2.0 * math.pi / length
    with warnings.catch_warnings():  # the scene itself has warned
        warnings.simplefilter("ignore", ResolutionWarning)
        return scene.replace(
            fluid=scene.fluid.replace(equation_of_state=eos.IdealGas()),
            box=Box((length,) * scene.dimension),
            resolution=Resolution(
                particles=(edge,) * scene.dimension,
                kernel=scene.resolution.kernel,
                support=scene.resolution.support,
            ),
            start=LatticeStart(velocities="zero"),
            effects=replace(
                scene.settled_effects,
                fluctuations=False,
                body_force=None,
                energy=False,
                viscous_heating=None,
                conduction=None,
                variable_transport=None,
            ),
            body_force=None,
            walls=(),
            sound_speed=speed,
        )


def _decay(scene: Scene, dt: float, axis: int, component: int, threads: int | None) -> float:
    """Decay rate of one wave over that of the lattice sum."""
    from sdpd.simulation import Simulation

    k = np.zeros(scene.dimension)
    k[axis] = 2.0 * math.pi / scene.box.lengths[axis]
    direction = np.eye(scene.dimension)[component]
    exact = friction_theory(scene).lattice_plane_wave_rate(k, direction, spacing=scene.spacing)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        sim = Simulation(scene, integrator="pair_splitting", dt=dt, threads=threads)
    wave = np.sin(sim.positions @ k)
    velocities = np.zeros_like(sim.velocities)
    velocities[:, component] = DISPLACEMENT * scene.spacing * exact * wave
    start = float(velocities[:, component] @ wave)
    sim.velocities = velocities
    steps = max(FEWEST_STEPS, round(1.0 / exact / dt))
    sim.run(steps, progress=False)
    left = float(sim.velocities[:, component] @ wave) / start
    return -math.log(left) / (steps * dt * exact)
