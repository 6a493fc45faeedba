"""Flow between plates driven by the upper one, from rest (Yang 2013, section 3.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.channel import TAKES, WIDTH, channel, rms_error
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.scene import Scene
from sdpd.theory import couette_velocity

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

SPEED = 1.25e-5  # m/s
TIME = 0.1  # s; the steady profile does not feel the viscosity


def scene(settings: Settings) -> Scene:
    """The upper plate moves."""
    return channel(settings, plate=(SPEED, 0.0))


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """rms error over the speed of the plate."""
    nu = sim.scene.fluid.kinematic_viscosity
    return rms_error(
        sim,
        TIME,
        lambda y, t: couette_velocity(
            y, t, wall_velocity=SPEED, kinematic_viscosity=nu, width=WIDTH
        ),
        SPEED,
    )


COUETTE = Problem(
    name="couette",
    title="Couette flow from rest",
    error_of="velocity, rms over the speed of the plate, after 0.1 s",
    source="series",
    scene=scene,
    measure=measure,
    takes=TAKES,
)
