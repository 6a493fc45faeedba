"""What is measured of a scene: chosen by what is in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd.box import AXES
from sdpd.effects import SinusoidalForce, UniformForce
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["OF_ENERGY", "Sampling", "blocks_of", "direction", "unit_of"]

Array = NDArray[np.float64]
BLOCKS, PER_BLOCK = 8, 16
WAVE_BINS = 32
OF_ENERGY = ("temperature", "Var T/T^2")  # constants of a fluid without one


@dataclass(frozen=True)
class Sampling:
    """When a run is looked at: in its second half, in blocks.

    Attributes
    ----------
    settling : int
        Steps before.
    every : int
        Steps between samples.
    per_block : int
        Samples in each of 8 blocks.
    """

    settling: int
    every: int
    per_block: int

    @classmethod
    def of(cls, steps: int) -> Sampling:
        """Of a run of at least 16 steps."""
        half = steps // 2
        per_block = max(1, min(PER_BLOCK, half // BLOCKS))
        every = half // (BLOCKS * per_block)
        settling = max(0, steps // every - BLOCKS * per_block) * every
        return cls(settling, every, per_block)

    @property
    def measured(self) -> int:
        """Steps that are looked at."""
        return BLOCKS * self.per_block * self.every


def direction(scene: Scene) -> int | None:
    """Axis of the flow, as a number: that of the force, else of a wall's velocity."""
    force = scene.body_force
    if isinstance(force, SinusoidalForce):
        return AXES.index(force.direction)
    vectors = [force.acceleration] if isinstance(force, UniformForce) else []
    vectors += [getattr(wall, "velocity", None) or () for wall in scene.walls]
    for vector in vectors:
        if any(vector):
            return int(np.argmax(np.abs(vector)))
    return None


def unit_of(name: str, scene: Scene) -> str:
    """SI unit of an observable, "" of pure numbers and in other units."""
    if not scene.fluid.is_si or "/" in name:
        return ""
    force, pressure = ("N", "Pa") if scene.dimension == 3 else ("N", "N/m")
    kinds = {"temperature": "K", "pressure": pressure, "velocity": "m/s", "heat": "W"}
    kinds |= {"force": force, "wave": "m/s"}
    return next((unit for kind, unit in kinds.items() if kind in name), "")


def blocks_of(sim: Simulation, sampling: Sampling, *, noisy: bool) -> dict[str, Array]:
    """Run a simulation and give the means of each observable in blocks, (blocks,).

    The kinetic temperature is of interest where one side is `noisy`. An isothermal fluid has its
    temperature by definition.
    """
    from sdpd.observers import Profile, Thermodynamics, WallForces

    scene, axis = sim.scene, direction(sim.scene)
    sim.run(sampling.settling, progress=False)
    thermo, walls = Thermodynamics(every=sampling.every), WallForces(every=sampling.every)
    flow = None if axis is None else _flow_profile(scene, sampling, Profile)
    observers: list[Any] = [thermo, *([walls] if scene.walls else [])]
    observers += [] if flow is None else [flow]
    sim.run(sampling.measured, observe=observers, progress=False)
    found = _state(scene, thermo)
    if noisy:
        name = "kinetic temperature" + (", flow included" if axis is not None else "")
        found = {name: thermo["temperature"], **found}
    if axis is not None and (scene.walls or isinstance(scene.body_force, UniformForce)):
        name = AXES[axis]
        mass = sim.n_particles * scene.particle_mass
        found[f"mean velocity {name}"] = thermo[f"momentum_{name}"] / mass
    if scene.walls:
        for index in range(len(scene.walls)):
            if axis is not None:
                found[f"force on wall {index}, {AXES[axis]}"] = walls.force[:, index, axis]
            if scene.active_effects.energy:
                found[f"heat into wall {index}"] = walls.heat[:, index]
    blocks = {name: series.reshape(BLOCKS, -1).mean(axis=1) for name, series in found.items()}
    if flow is not None:
        assert axis is not None
        blocks |= _flow(scene, flow.series("velocity")[:, :, axis], AXES[axis])
    return blocks


def _state(scene: Scene, thermo: Any) -> dict[str, Array]:
    rho, temperature = scene.fluid.density, scene.fluid.temperature
    spread = thermo["mean_square_density"] - thermo["mean_density"] ** 2
    found = {"pressure": thermo["mean_pressure"], "Var rho/rho^2": spread / rho**2}
    if scene.active_effects.energy:
        mean = thermo["internal_temperature"]
        found["temperature"] = mean
        spread = thermo["square_internal_temperature"] - mean**2
        found["Var T/T^2"] = spread / temperature**2
    else:
        found["temperature"] = np.full(len(thermo), temperature)
        found["Var T/T^2"] = np.zeros(len(thermo))
    return found


def _flow_profile(scene: Scene, sampling: Sampling, kind: Any) -> Any:
    """Across a channel in thirds, or along a wave; None where neither is."""
    force = scene.body_force
    if isinstance(force, SinusoidalForce):
        bins, axis = WAVE_BINS, force.along
    else:
        closed = [a for a in AXES[: scene.dimension] if a not in scene.box.periodic_axes]
        if len(closed) != 1:
            return None
        bins, axis = 3, closed[0]
    return kind(axis=axis, bins=bins, samples_per_block=sampling.per_block, every=sampling.every)


def _flow(scene: Scene, velocity: Array, axis: str) -> dict[str, Array]:
    """Of the means in bins, (blocks, bins): the middle third, or the amplitude of the wave."""
    force = scene.body_force
    if not isinstance(force, SinusoidalForce):
        return {f"velocity {axis}, middle third": velocity[:, 1]}
    places = (np.arange(WAVE_BINS) + 0.5) / WAVE_BINS
    wave = np.sin(2.0 * np.pi * force.wavenumber * places)
    seen = np.isfinite(velocity)
    amplitude = np.sum(np.where(seen, velocity, 0.0) * wave, axis=1) / np.sum(
        np.where(seen, wave**2, 0.0), axis=1
    )
    return {f"wave of velocity {axis}": amplitude}
