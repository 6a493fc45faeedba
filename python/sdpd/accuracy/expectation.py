"""What error a scene is expected to have at given settings, and which study says so."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sdpd import timestep
from sdpd.accuracy.orders import Orders, Point, load_orders, sampling_constant
from sdpd.box import AXES
from sdpd.effects import SinusoidalForce, UniformForce
from sdpd.integrators import Integrator, PairSplitting
from sdpd.wall_models import SymmetricImages
from sdpd.walls import Plane

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["QUANTITIES", "Expected", "bias_of", "flow_orders", "flow_point", "sampled_time"]

# of a scene in equilibrium, and of a flow
QUANTITIES = ("temperature", "density_variance", "temperature_variance", "diffusion", "flow")


@dataclass(frozen=True, kw_only=True)
class Expected:
    """An expected bias.

    Attributes
    ----------
    bias : float
        Relative error that no longer run lowers [1].
    factor : float
        Within which 19 of 20 settings that were not fitted lie [1].
    source : str
        What it was fitted on.
    """

    bias: float
    factor: float
    source: str


def flow_problem(scene: Scene) -> tuple[str, float]:
    """Name of the study that is nearest to a flow, and the length its errors go with [length]."""
    radii = [wall.radius_of_curvature for wall in scene.walls if not isinstance(wall, Plane)]
    if scene.active_effects.energy:
        if not scene.walls:
            raise ValueError(
                "`scene` must have walls, or noise and no flow, where its fluid has an energy: no "
                "study of other flows has been fitted"
            )
        return "thermal_couette", scene.flow_length
    if radii:
        return "cylinder", min([r for r in radii if r is not None] or [scene.flow_length])
    if scene.walls:
        driven = scene.active_effects.body_force
        return ("poiseuille" if driven else "couette"), scene.flow_length
    if isinstance(scene.body_force, SinusoidalForce):
        return "shear_wave", scene.flow_length
    return "taylor_green", scene.flow_length


def flow_orders(scene: Scene) -> tuple[str, float, dict[str, Orders]]:
    """Problem, length and fitted orders by kernel, for a flow.

    Raises
    ------
    ValueError
        If no study says anything about such a scene.
    """
    if scene.walls and scene.wall_model != SymmetricImages():
        raise ValueError(
            "`scene.wall_model` must be SymmetricImages, of which alone studies have been fitted, "
            f"got {scene.wall_model!r}"
        )
    name, length = flow_problem(scene)
    return name, length, load_orders(name)


def flow_point(scene: Scene, length: float, dt: float, integrator: Integrator) -> Point:
    """A scene as its fit sees it; what a large step takes from the viscosity counts like the rest.

    Parameters
    ----------
    scene : Scene
    length : float
        That `flow_orders` gives [length].
    dt : float
        Time step [time].
    integrator : Integrator

    Returns
    -------
    Point
    """
    lost = timestep.expected_errors(scene, dt, integrator).viscosity or 0.0
    return Point(
        deficit=1.0 - scene.factors.viscosity / scene.calibration * (1.0 + lost),
        reach=scene.support_radius / length,
        support=scene.resolution.support,
    )


def bias_of(scene: Scene, quantity: str, dt: float, integrator: Integrator) -> Expected:
    """Expected bias of a quantity of equilibrium at a time step.

    Raises
    ------
    ValueError
        If the scene does not have it.
    """
    active = scene.active_effects
    errors = timestep.expected_errors(scene, dt, integrator)
    if quantity == "temperature":
        return Expected(bias=abs(errors.temperature or 0.0), factor=1.5, source="measured curves")
    if quantity == "density_variance":
        bias = abs(errors.density_variance or 0.0)
        return Expected(bias=bias, factor=2.0, source="measured curves")
    if quantity == "temperature_variance":
        if not active.energy:
            raise ValueError("`quantity` must be another where the particles have no energy")
        split = isinstance(integrator, PairSplitting)
        size = dt / scene.conduction_time
        bias = 0.0 if split else timestep.VERLET_HEAT_CURVATURE * size**2
        return Expected(bias=bias, factor=2.0, source="measured curves")
    bias = abs(1.0 / scene.factors.friction - 1.0)
    return Expected(bias=bias, factor=1.1, source="the sums over a lattice")


def sampled_time(scene: Scene, quantity: str, dt: float, error: float) -> tuple[float, float]:
    """Time to sample until the standard error is `error`, and the factor by which it is off.

    Parameters
    ----------
    scene : Scene
    quantity : str
    dt : float
        Time step [time].
    error : float
        Relative standard error [1], > 0.

    Returns
    -------
    time : float
        [time].
    factor : float
        [1].

    Notes
    -----
    The mean of N particles over a time t has the variance V 2 theta/t, with V the variance of one
    sample and theta its correlation time; both are exact for the temperature and the flow, up to
    the fitted constant for the others. That of the density is for fluids whose arrangement does not
    outlive the run.
    """
    if quantity == "flow":
        return _flow_time(scene, error), 1.5
    number, d, tau = scene.n_particles, scene.dimension, scene.friction_time
    constant, factor = sampling_constant(quantity)
    if quantity == "temperature":  # v^2 forgets itself with tau/2; steps beyond that are samples
        variance, theta = 2.0 / (d * number), 0.5 * dt / math.tanh(dt / tau)
    elif quantity == "density_variance":
        variance, theta = 2.0 / number, scene.support_radius / scene.sound.speed
    elif quantity == "temperature_variance":
        variance, theta = 2.0 / number, scene.conduction_time
    else:
        variance, theta = 1.0 / number, tau
    return float(2.0 * variance * constant**2 * theta / error**2), factor**2


def _flow_time(scene: Scene, error: float) -> float:
    """Until the mean velocity in the middle of a channel, or the amplitude of a wave, is known.

    kT L^2/(2 M nu t) and 4 kT/(M nu k^2 t): sums over the modes of Stokes flow.
    """
    speed = scene.flow_speed
    if speed is None:
        raise ValueError(
            "`scene` must have a flow, or `velocity_scale`, for the error of its velocity"
        )
    mass = scene.n_particles * scene.particle_mass
    unit = scene.thermal_energy / (mass * scene.fluid.kinematic_viscosity * speed**2)
    length = scene.flow_length
    across = 0.5 if scene.walls else 4.0 / (2.0 * math.pi) ** 2
    return across * unit * length**2 / error**2


def default_quantity(scene: Scene) -> str:
    """A flow where there is one, else the temperature."""
    active = scene.active_effects
    driven = isinstance(scene.body_force, (UniformForce, SinusoidalForce)) and active.body_force
    if not active.fluctuations or scene.flow_speed is not None or driven:
        return "flow"
    return "temperature"


def edge_axis(scene: Scene) -> str:
    """The axis along which particles are counted: the one across the flow."""
    if scene.walls:
        closed = [a for a in AXES[: scene.dimension] if a not in scene.box.periodic_axes]
        if closed:
            return closed[-1]
    if isinstance(scene.body_force, SinusoidalForce):
        return scene.body_force.along
    return AXES[scene.dimension - 1]
