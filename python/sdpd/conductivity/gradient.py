"""Conductivity by the heat through a slab between plates of different temperatures."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sdpd import validation
from sdpd.analysis.estimate import Estimate, jackknife
from sdpd.box import AXES, Box
from sdpd.conductivity.lattice import check_conduction, scene_step
from sdpd.errors import TimeStepWarning
from sdpd.observers.base import Observer
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.wall_heat import Isothermal
from sdpd.walls import Plane

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["imposed_gradient"]

SLOPE_EVERY = 5  # steps between two looks at the temperatures


def imposed_gradient(
    scene: Scene,
    *,
    difference: float = 0.1,
    layers: int = 12,
    times: float = 8.0,
    seed: int = 1,
    n_blocks: int = 32,
    dt: float | str = "auto",
    work: float = 0.0,
    threads: int | None = 1,
    progress: bool | None = False,
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
    work : float
        Pairs of particles to visit at least while measuring, however short `times` may be.
    threads : int, optional
        Changes no bit of the result.
    progress : bool, optional
        Show progress bars; None: on a terminal or in a notebook.

    Returns
    -------
    Estimate
        kappa at the temperature of the fluid [energy/(time temperature length^(D-2))]: mean heat
        through both plates over the gradient in the middle half of the slab; where kappa goes as
        T^n, over that of T0/(n + 1) (T/T0)^(n + 1) of the mean temperature.

    Raises
    ------
    TypeError, ValueError
        If the fluid does not conduct, or an argument is out of range.

    Notes
    -----
    Where friction carries much of the heat the fluid is warmer or colder than its plates: friction
    with the image of a wall at rest hands over no energy, so that conduction alone crosses the last
    half of a support.
    """
    from sdpd.observers import WallForces
    from sdpd.simulation import Simulation

    check_conduction(scene)
    share = validation.positive("difference", difference)
    if share >= 1.0:
        raise ValueError(f"`difference` must be below 1, got {share:g}")
    blocks = validation.integer("n_blocks", n_blocks, minimum=2)
    least = validation.non_negative("work", work)
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
        effects=replace(scene.settled_effects, body_force=None),
        body_force=None,
        walls=(Plane(axis=axis, at=0.0, heat=cold), Plane(axis=axis, at=width, heat=hot)),
        velocity_scale=None,
    )
    fluid = slab.fluid
    diffusivity = slab.conductivity / (fluid.density * (fluid.heat_capacity or 1.0))
    whole = width**2 / (math.pi**2 * diffusivity) * validation.positive("times", times)
    step = scene_step(slab, dt)
    with warnings.catch_warnings():
        if step <= scene_step(scene, "auto") * (1.0 + 1e-9):
            # right at the mean temperature, which is what counts: the hot plate asks for less
            warnings.simplefilter("ignore", TimeStepWarning)
        sim = Simulation(slab, dt=step, seed=seed, threads=threads)
    z = np.asarray(sim.positions[:, d - 1]) / width
    sim.temperatures = t0 * (1.0 + share * (z - 0.5))
    sim.run(time=whole, progress=progress)
    number = max(whole / sim.dt, least / (slab.n_particles * slab.pairs_per_particle))
    every = max(SLOPE_EVERY, round(number / blocks / SLOPE_EVERY) * SLOPE_EVERY)
    active = slab.active_effects
    exponent = fluid.conductivity_exponent if active.variable_transport else 0.0
    spread = _spread(exponent + 1.0, slab.heat_capacity_number) if active.fluctuations else 1.0
    inside = _Slope(d - 1, width, reference=t0, exponent=exponent, every=SLOPE_EVERY)
    forces = WallForces(every=every)
    sim.run(steps=blocks * every, observe=[forces, inside], progress=progress)
    table = np.asarray(forces.heat_flux[-blocks:])
    flux = 0.5 * (table[:, 0] - table[:, 1])
    slope = np.asarray(inside.values).reshape(blocks, -1).mean(axis=1) / spread
    value = float(flux.mean() / slope.mean())
    left = [float(np.delete(flux, b).mean() / np.delete(slope, b).mean()) for b in range(blocks)]
    return Estimate(*jackknife(left, value), blocks)


def _spread(power: float, k: float) -> float:
    """<T^power>/<T>^power of particles in local equilibrium: T is Gamma distributed, k = C/k_B."""
    return math.exp(math.lgamma(k + power) - math.lgamma(k) - power * math.log(k))


class _Slope(Observer):
    """Gradient of theta in the middle half of the slab.

    theta = T0/(n + 1) (T/T0)^(n + 1), by Kirchhoff: kappa(T0) theta' is the flux of heat where
    kappa goes as T^n, whatever the difference; n = 0 is the temperature itself.
    """

    may_write: ClassVar[bool] = False

    def __init__(
        self, axis: int, width: float, *, reference: float, exponent: float, every: int
    ) -> None:
        super().__init__(every=every)
        self._axis, self._width = axis, width
        self._reference, self._power = reference, exponent + 1.0
        self.values: list[float] = []

    def sample(self, sim: Simulation) -> None:
        z = np.asarray(sim.positions[:, self._axis]) / self._width
        middle = np.abs(z - 0.5) < 0.25
        place = z[middle] - z[middle].mean()
        warm = (np.asarray(sim.temperatures)[middle] / self._reference) ** self._power
        warm *= self._reference / self._power
        self.values.append(float(place @ warm / (place @ place)) / self._width)
