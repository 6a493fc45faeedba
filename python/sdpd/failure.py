"""What to tell of a run that blew up: the likely cause and where the last good state is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd import timestep, validation
from sdpd.errors import SimulationError

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["check_on_error", "describe", "likely_cause", "rescue"]

# A density or a speed this far off in the last good state is worth a word.
CROWDED = 2.0
FAST = 8.0
# A time step this far below its tightest bound is beyond what it can be good for.
TINY = 1e-9


def likely_cause(sim: Simulation, dt: float) -> str:
    """From the bounds on the time step, then from the last good state."""
    exceeded = timestep.check_time_step(sim.scene, dt, sim.integrator)
    stability = [bound for bound in exceeded if bound.kind == "stability"]
    if exceeded:
        return timestep.warning_text(dt, stability or exceeded)
    tightest = sim.bounds[0]
    if dt < TINY * tightest.value:
        return (
            f"a tiny time step: dt = {dt:.4g} is {dt / tightest.value:.2g} of the tightest bound "
            f"({tightest.name}, {tightest.value:.4g}), and random forces, which go as 1/sqrt(dt), "
            "are beyond double precision; choose a larger one"
        )
    nearest = next(b for b in sim.bounds if b.kind == "stability")
    within = f"dt = {dt:.4g} is within every bound ({nearest.name} is {nearest.value:.4g})"
    scene = sim.scene
    crowding = float(sim.densities.max()) / scene.fluid.density
    if crowding > CROWDED:
        return (
            f"overlapping particles: the density reaches {crowding:.3g} times that of the fluid, "
            f"so that particles are pushed apart violently; {within}, but begin with a smaller one "
            "or with a relaxed start"
        )
    with np.errstate(over="ignore"):
        speed = float(np.sqrt((sim.velocities**2).sum(axis=1).max()))
    typical = max(scene.thermal_speed if scene.starts_thermal else 0.0, scene.sound.speed / 10.0)
    if speed > FAST * typical:
        return (
            f"a particle at speed {speed:.4g}, {speed / typical:.3g} times what the time step was "
            f"chosen for; {within}, but choose a smaller one or give the scene its velocity_scale"
        )
    if float(sim.pressures.min()) < 0.0:
        return (
            "negative pressure, which pulls particles together (see the equation of state and its "
            f"background pressure); {within}"
        )
    return f"unknown: {within}; try a smaller one"


def describe(sim: Simulation, error: SimulationError, dt: float) -> SimulationError:
    """The core's error with cause, the last good state, and the attributes of the class."""
    good_step, good_time = sim.step, sim.time
    described = SimulationError(
        f"{error}; likely cause: {likely_cause(sim, dt)}. The arrays show the last good state, "
        f"step {good_step}, time {good_time:.6g}"
    )
    described.step, described.particle, described.dt = error.step, error.particle, dt
    steps = 0 if error.step is None else max(0, error.step - good_step)
    described.time = good_time + steps * dt
    return described


def check_on_error(value: Any) -> str | Path:
    """What to do at an error: "raise", "checkpoint" or the path of a file.

    Raises
    ------
    TypeError, ValueError
        If it is none of them, or the folder of the file is not there.
    """
    if isinstance(value, os.PathLike):
        path = Path(value)
        if not path.parent.is_dir():
            raise ValueError(f"`on_error` must be in a folder that exists, got {str(path)!r}")
        return path
    return str(validation.choice("on_error", value, ("raise", "checkpoint")))


def rescue(sim: Simulation, error: SimulationError, on_error: str | Path) -> SimulationError:
    """Write the last good state if that was asked for; the error with the name of the file."""
    if on_error == "raise":
        return error
    path = _unused(sim) if on_error == "checkpoint" else Path(on_error)
    saved = SimulationError(f"{error}. It was saved in {path}: sdpd.load() goes on from there")
    try:
        sim.save(path)
    except (OSError, TypeError) as refused:  # a full disk; a wall that is a function
        saved = SimulationError(f"{error}. It could not be saved in {path}: {refused}")
    else:
        saved.checkpoint = str(path)
    saved.step, saved.particle, saved.time, saved.dt = (
        error.step,
        error.particle,
        error.time,
        error.dt,
    )
    return saved


def _unused(sim: Simulation) -> Path:
    """A file of the working directory that is not there yet."""
    stem = f"sdpd-step-{sim.step}"
    names = (Path(f"{stem}{f'-{n}' * (n > 1)}.sdpd") for n in range(1, validation.LARGEST))
    return next(name for name in names if not name.exists())
