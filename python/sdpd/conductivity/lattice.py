r"""Conduction on the undisturbed lattice, without noise: a sum, and the decay of a wave."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from sdpd import kernels, validation
from sdpd.box import Box
from sdpd.equations_of_state import Linear
from sdpd.initial import LatticeStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene

__all__ = ["Decay", "check_conduction", "decay", "lattice_conductivity", "scene_step"]


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
        Of the fluid.
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
    check_conduction(scene)
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


def check_conduction(scene: Scene) -> None:
    """Refuse what is no scene with heat conduction."""
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

    check_conduction(scene)
    steps = validation.integer("steps", steps, minimum=1)
    d, spacing = scene.dimension, scene.spacing
    least = math.ceil(2.0 * scene.resolution.support * (1.0 + 1e-9))
    sides = (max(16, least), *[max(least, 4)] * (d - 1))
    box = Box(tuple(side * spacing for side in sides))
    effects = replace(
        scene.settled_effects,
        energy=True,
        fluctuations=False,
        body_force=None,
        variable_transport=None,
    )
    still = scene.replace(
        box=box,
        # A pressure that follows the temperature would set the particles moving, however weak the
        # wave: what decays then is sound as well, and heat at constant pressure.
        fluid=scene.fluid.replace(
            equation_of_state=Linear(sound_speed=scene.sound.speed),
            thermal_expansion=0.0,
            viscosity_exponent=0.0,
            conductivity_exponent=0.0,
        ),
        sound_speed=None,
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
    t0, rise = scene.fluid.temperature, 1e-6
    sim.temperatures = t0 * (1.0 + rise * wave)
    start = 2.0 * float(np.mean(wave * (np.asarray(sim.temperatures) / t0 - 1.0)))
    sim.run(steps=steps, progress=False)
    end = 2.0 * float(np.mean(wave * (np.asarray(sim.temperatures) / t0 - 1.0)))
    if not 0.0 < end < start:
        raise ValueError(f"`steps` must leave some of the wave, got {steps}; take fewer")
    rate = math.log(start / end) / sim.time
    capacity = scene.heat_capacity_number * scene.fluid.boltzmann_constant
    delivered = rate * capacity / (k**2 * spacing**d)
    asked = scene.fluid.thermal_conductivity or 0.0
    return Decay(delivered, lattice_conductivity(still, k), asked, sim.dt)


def scene_step(scene: Scene, dt: float | str) -> float:
    """The time step asked for, or that of the scene."""
    from sdpd import timestep

    if isinstance(dt, str):
        validation.choice("dt", dt, ("auto",))
        return timestep.auto_time_step(scene).value
    return validation.positive("dt", dt)
