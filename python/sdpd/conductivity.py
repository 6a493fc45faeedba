r"""The thermal conductivity that a fluid of particles delivers, measured in two ways.

`decay`: a wave of temperature on the undisturbed lattice, without noise: exact, and to be compared
with the sum over the lattice. `imposed_gradient`: heat through a slab between plates of different
temperatures, with the noise of the scene: what the fluid delivers as it moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from sdpd import kernels, validation
from sdpd.analysis.estimate import Estimate
from sdpd.box import AXES, Box
from sdpd.initial import LatticeStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.wall_heat import Isothermal
from sdpd.walls import Plane

__all__ = ["Decay", "decay", "imposed_gradient", "lattice_conductivity"]


@dataclass(frozen=True)
class Decay:
    """Conductivities from the decay of a wave [energy/(time temperature length^(D-2))].

    Attributes
    ----------
    delivered : float
        At the time step of the scene.
    lattice : float
        Of the sum over the lattice at this wavelength: what a short step delivers.
    asked : float
        Of the scene.
    dt : float
        The time step [time].
    """

    delivered: float
    lattice: float
    asked: float
    dt: float


def lattice_conductivity(scene: Scene, wavenumber: float) -> float:
    r"""kappa of a wave of temperature along an axis of the undisturbed lattice, exact.

    Parameters
    ----------
    scene : Scene
        Of a fluid with heat conduction.
    wavenumber : float
        k [1/length], > 0.

    Returns
    -------
    float
        [energy/(time temperature length^(D-2))].

    Notes
    -----
    .. math:: \kappa(k) = \frac{2\kappa\,n}{k^2} \sum_j g_{0j} (1 - \cos k x_{0j})
    """
    _check(scene)
    k, d = validation.positive("wavenumber", wavenumber), scene.dimension
    spacing, support = scene.spacing, scene.support_radius
    reach = math.ceil(scene.resolution.support)
    line = np.arange(-reach, reach + 1) * spacing
    sites = np.stack(np.meshgrid(*[line] * d, indexing="ij"), axis=-1).reshape(-1, d)
    r = np.linalg.norm(sites, axis=1)
    near = (r > 0.0) & (r < support)
    name = scene.resolution.kernel
    w, _ = kernels.evaluate(name, d, np.append(r[near], 0.0), support)
    _, f = kernels.evaluate(name, d, r[near], support)
    g = f / float(w.sum()) ** 2
    total = float((g * (1.0 - np.cos(k * sites[near, 0]))).sum())
    return 2.0 * scene.conductivity * total / (k**2 * spacing**d)


def _check(scene: Scene) -> None:
    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    if not scene.active_effects.conduction:
        raise ValueError(
            "`scene` must have heat conduction, got one without: effects=sdpd.Effects(energy=True) "
            "and a fluid with a thermal_conductivity"
        )


def decay(scene: Scene, *, dt: float | str = "auto", steps: int = 40) -> Decay:
    """The conductivity by which a wave of temperature dies out on the lattice, without noise.

    Parameters
    ----------
    scene : Scene
        Its fluid, kernel, support and spacing count; the box is one of 16 spacings (two supports at
        least).
    dt : float or "auto"
        [time].
    steps : int
        To look at.

    Returns
    -------
    Decay

    Raises
    ------
    TypeError, ValueError
        If the fluid does not conduct, or an argument is out of range.

    Examples
    --------
    >>> import sdpd
    >>> from sdpd import conductivity
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.nitrogen(),
    ...     box=sdpd.Box((3e-7, 3e-7, 3e-7)),
    ...     resolution=sdpd.Resolution(spacing=3e-8, support=3.0),
    ...     effects=sdpd.Effects(energy=True),
    ... )
    >>> found = conductivity.decay(scene)
    >>> abs(found.delivered / found.lattice - 1.0) < 0.01
    True
    """
    from sdpd.simulation import Simulation

    _check(scene)
    steps = validation.integer("steps", steps, minimum=1)
    d, spacing = scene.dimension, scene.spacing
    least = math.ceil(2.0 * scene.resolution.support * (1.0 + 1e-9))
    sides = (max(16, least), *[max(least, 4)] * (d - 1))
    box = Box(tuple(side * spacing for side in sides))
    effects = replace(
        scene.effects, energy=True, fluctuations=False, body_force=None, variable_transport=None
    )
    still = scene.replace(
        box=box,
        fluid=scene.fluid.replace(viscosity_exponent=0.0, conductivity_exponent=0.0),
        resolution=Resolution(
            particles=sides, support=scene.resolution.support, kernel=scene.resolution.kernel
        ),
        start=LatticeStart(velocities="zero"),
        effects=effects,
        body_force=None,
        walls=(),
    )
    sim = Simulation(still, dt=scene_step(scene, dt), threads=1)
    k = 2.0 * math.pi / box.lengths[0]
    wave = np.cos(k * np.asarray(sim.positions[:, 0]))
    t0, rise = scene.fluid.temperature, 1e-6  # so small that nothing moves by its pressure
    sim.temperatures = t0 * (1.0 + rise * wave)
    start = 2.0 * float(np.mean(wave * (np.asarray(sim.temperatures) / t0 - 1.0)))
    sim.run(steps=steps, progress=False)
    end = 2.0 * float(np.mean(wave * (np.asarray(sim.temperatures) / t0 - 1.0)))
    if not 0.0 < end < start:
        raise ValueError(f"`steps` must leave some of the wave, got {steps}; take fewer")
    rate = math.log(start / end) / sim.time
    capacity = scene.heat_capacity_number * scene.fluid.boltzmann_constant
    delivered = rate * capacity / (k**2 * spacing**d)
    return Decay(delivered, lattice_conductivity(still, k), scene.conductivity, sim.dt)


def scene_step(scene: Scene, dt: float | str) -> float:
    """The time step asked for, or that of the scene."""
    from sdpd import timestep

    if isinstance(dt, str):
        validation.choice("dt", dt, ("auto",))
        return timestep.auto_time_step(scene).value
    return validation.positive("dt", dt)


def imposed_gradient(
    scene: Scene,
    *,
    difference: float = 0.1,
    layers: int = 12,
    times: float = 8.0,
    seed: int = 1,
    n_blocks: int = 32,
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

    _check(scene)
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
    sim = Simulation(slab, seed=seed, threads=1)
    z = np.asarray(sim.positions[:, d - 1]) / width
    sim.temperatures = t0 * (1.0 + share * (z - 0.5))
    sim.run(time=whole, progress=False)
    every = max(1, round(whole / sim.dt / blocks))
    forces = WallForces(every=every)
    sim.run(steps=blocks * every, observe=forces, progress=False)
    flux = 0.5 * (forces.heat_flux[-blocks:, 0] - forces.heat_flux[-blocks:, 1])
    kappa = flux * width / (share * t0)
    return Estimate(float(kappa.mean()), float(kappa.std(ddof=1) / math.sqrt(blocks)), blocks)
