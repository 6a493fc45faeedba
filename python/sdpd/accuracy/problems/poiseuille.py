"""Flow between plates driven by a body force, from rest (Yang 2013, section 3.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.channel import TAKES, WIDTH, channel, rms_error
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.effects import UniformForce
from sdpd.scene import Scene
from sdpd.theory import poiseuille_velocity

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

ACCELERATION = 1e-4  # m/s^2
TIME = 0.5  # s, when the flow is within 1 % of the steady one
FASTEST = 1.25e-5  # m/s, of the steady flow


def scene(settings: Settings) -> Scene:
    """The plates at rest."""
    return channel(settings, force=UniformForce((ACCELERATION, 0.0)))


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """rms error over the steady maximum."""
    nu = sim.scene.fluid.kinematic_viscosity
    return rms_error(
        sim,
        TIME,
        lambda y, t: poiseuille_velocity(
            y, t, acceleration=ACCELERATION, kinematic_viscosity=nu, width=WIDTH
        ),
        FASTEST,
    )


POISEUILLE = Problem(
    name="poiseuille",
    title="Poiseuille flow from rest",
    error_of="velocity, rms over the steady maximum, after 0.5 s",
    source="series",
    scene=scene,
    measure=measure,
    takes=TAKES,
)
