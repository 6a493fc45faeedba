"""Builds twins and Rust cores of one and the same problem from dimensionless parameters.

Reduced units: particle mass, lattice spacing dx and kT are 1. X = m c^2/kT (physics notation),
`viscosity` is eta in units sqrt(m kT)/dx^(D-1), `support` is h/dx.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .twin import System

Array = NDArray[np.float64]

DIMENSIONS = (2, 3)
FRICTIONS = ("general", "central")
SOUND_SPEED = 10.0

_NODES = np.array([0.84, 0.87, 0.92, 0.94, 0.97, 1.02, 1.06, 1.1])
EQUATIONS_OF_STATE: dict[str, list[float]] = {
    "artificial_compressibility": [1.0, SOUND_SPEED],
    "linear": [1.0, SOUND_SPEED, 3.0],
    "tait": [1.0, SOUND_SPEED, 7.0, 2.0],
    "ideal_gas": [SOUND_SPEED],
    "polynomial": [-20.0, 30.0, 40.0, 15.0, -2.0],
    # almost flat in the middle, so that the monotone limiter works; densities reach beyond
    "table": [*_NODES, *(100.0 * (_NODES - 0.099 * np.tanh(10.0 * (_NODES - 0.95))))],
}


def coefficients(friction: str, dimension: int, shear: float, bulk: float) -> tuple[float, float]:
    """a and b of f = -g (a v + b e e.v) for a shear and a bulk viscosity."""
    if friction == "none":
        return 0.0, 0.0
    if friction == "central":
        return 0.0, 2.0 * (dimension + 2) * shear
    a = shear * (1.0 + 2.0 / dimension) - bulk
    return a, (dimension + 2) * (bulk + shear * (1.0 - 2.0 / dimension))


def lattice(cells: Sequence[int], jitter: float, rng: np.random.Generator) -> Array:
    """A simple lattice of unit spacing, each coordinate moved by up to `jitter`, row order mixed.

    Mixed rows matter: with rows in space order a wrong id or row mapping can go unseen.
    """
    axes = [np.arange(n) + 0.5 for n in cells]
    sites = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(cells))
    moved = sites + rng.uniform(-jitter, jitter, sites.shape)
    return rng.permutation(np.mod(moved, np.asarray(cells, dtype=float)))


def maxwell(size: int, dimension: int, rng: np.random.Generator) -> Array:
    """Maxwellian velocities at kT/m = 1 with zero total momentum."""
    velocities = rng.standard_normal((size, dimension))
    return velocities - velocities.mean(axis=0)


def problem(
    dimension: int = 3,
    *,
    kernel: str = "lucy",
    eos: str = "linear",
    friction: str = "general",
    noise: str = "gaussian",
    support: float = 2.5,
    cells: Sequence[int] | None = None,
    viscosity: float = 20.0,
    bulk_viscosity: float = 4.0,
    dt: float = 0.002,
    seed: int = 2024,
    jitter: float = 0.3,
    body_force: Sequence[float] | None = None,
    body_wave: tuple[int, int] | None = None,
) -> System:
    """A jittered lattice with Maxwellian velocities; friction "none" silences the noise."""
    rng = np.random.default_rng([seed, dimension])
    if cells is None:
        cells = (9, 8) if dimension == 2 else (5, 6, 5)
    positions = lattice(cells, jitter, rng)
    a, b = coefficients(friction, dimension, viscosity, bulk_viscosity)
    return System(
        positions=positions,
        velocities=maxwell(len(positions), dimension, rng),
        box=np.asarray(cells, dtype=float),
        support=support,
        mass=1.0,
        thermal_energy=1.0,
        kernel=kernel,
        friction=friction,
        friction_across=a,
        friction_along=b,
        eos=(eos, EQUATIONS_OF_STATE[eos]),
        noise="none" if friction == "none" else noise,
        dt=dt,
        seed=seed,
        body_force=None if body_force is None else np.asarray(body_force, dtype=float),
        body_wave=body_wave,
    )


def rescaled(system: System, length: float, mass: float, time: float) -> System:
    """The same dimensionless problem in other units (linear equation of state only)."""
    kind, (rho0, c, p0) = system.eos
    if kind != "linear":
        raise ValueError(f"rescaling is written for the linear equation of state, got {kind!r}")
    velocity, dim = length / time, system.dimension
    density, energy = mass / length**dim, mass * velocity**2
    eta = mass / (length ** (dim - 2) * time)
    return system.at(
        positions=system.positions * length,
        velocities=system.velocities * velocity,
        box=system.box * length,
        support=system.support * length,
        mass=system.mass * mass,
        thermal_energy=system.thermal_energy * energy,
        friction_across=system.friction_across * eta,
        friction_along=system.friction_along * eta,
        eos=(kind, [rho0 * density, c * velocity, p0 * density * velocity**2]),
        dt=system.dt * time,
    )


def core_arguments(
    system: System,
    integrator: str = "velocity_verlet",
    *,
    iterations: int = 1,
    skin: float | None = None,
    threads: int = 1,
    precision: str = "double",
) -> dict[str, Any]:
    """Keyword arguments of `sdpd._core.Core` for a twin system."""
    return {
        "positions": system.positions,
        "velocities": system.velocities,
        "box": system.box,
        "support": system.support,
        "mass": system.mass,
        "thermal_energy": system.thermal_energy,
        "kernel": system.kernel,
        "friction": system.friction,
        "friction_across": system.friction_across,
        "friction_along": system.friction_along,
        "eos": system.eos,
        "noise": system.noise,
        "integrator": integrator,
        "iterations": iterations,
        "body_force": None
        if system.body_force is None
        else (list(system.body_force), system.body_wave),
        "dt": system.dt,
        "seed": system.seed,
        "skin": skin,
        "threads": threads,
        "precision": precision,
    }


def core(system: System, integrator: str = "velocity_verlet", **options: Any) -> Any:
    """The Rust core of a twin system."""
    from sdpd._core import Core

    arguments = core_arguments(system)
    unknown = {k: v for k, v in options.items() if k not in arguments}
    if unknown:
        raise TypeError(f"unknown core arguments {sorted(unknown)}")
    return Core(**{**core_arguments(system, integrator), **options})


def restated(sim: Any, **changes: Any) -> None:
    """Sets entries of a core's internal state: `step`, or `ids` in row order."""
    state = sim.state()
    if "step" in changes:
        state["step"] = changes["step"]
    if "ids" in changes:
        rows = np.frombuffer(state["row"], dtype=np.uint32)
        state["id"] = np.asarray(changes["ids"], dtype=np.uint64)[rows].tobytes()
    sim.set_state(state)
