"""Water between plates 1 mm apart, from rest, in two dimensions and without noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd import fluids, walls
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.box import Box
from sdpd.effects import BodyForce, Effects
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.wall_models import MODELS

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["SOUND_SPEED", "TAKES", "WIDTH", "channel", "rms_error"]

Array = NDArray[np.float64]
TAKES = ("across", "support", "kernel", "step", "calibrate", "wall_model", "precision")
WIDTH = 1e-3  # m
SOUND_SPEED = 1.25e-4  # m/s, ten times the fastest flow


def channel(
    settings: Settings, *, force: BodyForce | None = None, plate: tuple[float, float] | None = None
) -> Scene:
    """Plates at y = 0 and y = 1 mm, as long as the supports need."""
    columns = math.ceil(2.0 * settings.support) + 1
    box = Box((columns * WIDTH / settings.across, WIDTH), periodic="x")
    return Scene(
        fluid=fluids.water().in_plane(1e-4),
        box=box,
        walls=walls.slab(box, "y", upper_velocity=plate),
        wall_model=MODELS[settings.wall_model](),
        resolution=Resolution(
            particles=(columns, settings.across),
            support=settings.support,
            kernel=settings.kernel,
        ),
        calibrate=settings.calibrate,
        effects=Effects(fluctuations=False),
        body_force=force,
        sound_speed=SOUND_SPEED,
    )


def rms_error(
    sim: Simulation, time: float, expected: Callable[[Array, float], Array], scale: float
) -> Estimate:
    """Run for a time; rms deviation of all particles' velocities along x over `scale`."""
    sim.run(time=time, progress=False)
    error = sim.velocities[:, 0] - expected(np.array(sim.positions[:, 1]), sim.time)
    return Estimate(float(np.sqrt(np.mean(error**2))) / scale, 0.0)
