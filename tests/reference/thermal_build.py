"""Builds thermal twins and Rust cores of one and the same problem.

Reduced units as in build.py: m, dx and k_B T at the reference state are 1, k = C/k_B.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdpd
from sdpd._core import Core

from .build import problem
from .test_walls_against_twin import EDGE, Geometry, numbers
from .test_walls_against_twin import problem as wall_problem
from .twin import System
from .twin.caloric import Caloric
from .twin.table import Table
from .twin.thermal import ThermalSystem, WallHeat
from .twin.thermal_splitting import Accounts, thermal_splitting_step
from .twin.walls import NO_EDGE, Shaped

Array = NDArray[np.float64]

GAS_CONSTANT = 60.0  # X = m c^2/kT of the isotherm
EXCHANGES = ("full", "heating", "conduction", "bath", "bath_conduction", "adiabatic")
FOLLOWING = ("variable", "general", "metropolis")
VARIABLE = ("full_variable", "heating_variable", "conduction_variable")


def helmholtz(rho: Array, t: Array, capacity: float) -> Array:
    """f of c_v = k (1 + T)(1 + 1.2 ln rho)/2; P has 60 rho T and what c_v(rho) brings along."""
    warming = 0.5 * capacity * (1.0 + 1.2 * np.log(rho))
    return warming * (t - 0.5 * t * t - t * np.log(t)) + GAS_CONSTANT * t * np.log(rho)


@functools.cache
def tabulated(capacity: float) -> Table:
    """A table of `helmholtz`, coarse so that particles find themselves in many of its meshes."""
    law = sdpd.eos.EnergyTable.from_helmholtz(
        lambda rho, t: helmholtz(rho, t, capacity),
        densities=(0.5, 2.2),
        temperatures=(0.1, 4.0),
        points=(16, 24),
    )
    return Table("table", law._numbers())


def caloric(kind: str, capacity: float) -> Caloric:
    """An ideal gas, or a liquid that expands, C/k_B per particle; or a table."""
    if kind == "table":
        return tabulated(capacity)
    if kind == "ideal_gas":
        return Caloric("ideal_gas", [GAS_CONSTANT, capacity, 0.3])
    return Caloric("liquid", [capacity, 5.0, 1.1, 1.0, 9.0, 7.0, 2.0], "tait")


def warmed(
    system: System,
    *,
    exchanges: str = "full",
    capacity: float = 25.0,
    conductivity: float = 300.0,
    eos: str = "ideal_gas",
    spread: float = 0.2,
    exponents: tuple[float, float] = (0.7, 0.9),
    bookkeeping: bool = True,
    heat: Sequence[WallHeat] = (),
) -> ThermalSystem:
    """A system of `build` or of the wall tests with temperatures spread about 1."""
    known = {part.name: getattr(system, part.name) for part in fields(system)}
    rubs = not exchanges.startswith(("conduction", "adiabatic"))
    follows = exchanges.endswith(FOLLOWING) and not exchanges.startswith("bath")
    known["friction"] = system.friction if rubs else "none"
    known["noise"] = "none" if exchanges == "adiabatic" else system.noise
    rng = np.random.default_rng([system.seed, 99])
    return ThermalSystem(
        **known,
        temperatures=1.0 + spread * rng.uniform(-1.0, 1.0, system.size),
        caloric=caloric(eos, capacity),
        conductivity=conductivity if "cond" in exchanges or "full" in exchanges else 0.0,
        exponents=exponents if follows else (0.0, 0.0),
        reference_temperature=1.2,
        exchanges=exchanges,
        bookkeeping=bookkeeping,
        heat=tuple(heat),
    )


def thermal_problem(
    dimension: int,
    *,
    kernel: str = "lucy",
    friction: str = "general",
    noise: str = "none",
    cells: Sequence[int] | None = None,
    support: float = 2.5,
    body_force: Sequence[float] | None = None,
    body_wave: tuple[int, int] | None = None,
    dt: float = 0.005,
    **thermal: Any,
) -> ThermalSystem:
    """A jittered lattice in a periodic box."""
    base = problem(
        dimension,
        kernel=kernel,
        friction=friction,
        noise=noise,
        cells=cells,
        support=support,
        body_force=body_force,
        body_wave=body_wave,
        dt=dt,
    )
    return warmed(base, **thermal)


def thermal_wall_problem(
    geometry: Geometry,
    dimension: int,
    heat: Sequence[WallHeat],
    *,
    kernel: str = "lucy",
    friction: str = "general",
    noise: str = "none",
    dt: float = 0.004,
    **thermal: Any,
) -> ThermalSystem:
    """Particles between walls; `heat` is repeated until every wall has a condition."""
    base = wall_problem(geometry, dimension, kernel=kernel, friction=friction, noise=noise)
    conditions = [heat[k % len(heat)] for k in range(len(base.walls))]
    return warmed(base.at(dt=dt), heat=conditions, **thermal)


def thermal_core(system: ThermalSystem, **options: Any) -> Any:
    """The Rust core of a thermal twin."""
    law = system.caloric
    arguments: dict[str, Any] = {
        "positions": system.positions,
        "velocities": system.velocities,
        "box": np.where(system.box == NO_EDGE, EDGE, system.box).tolist(),
        "periodic": [bool(edge != NO_EDGE) for edge in system.box],
        "walls": [
            (kind, [*values[:-1], float(k in system.slips)])
            for k, (kind, values) in enumerate(
                numbers(wall, system.dimension) for wall in system.walls
            )
        ],
        "fields": [wall.field for wall in system.walls if isinstance(wall, Shaped)],
        "support": system.support,
        "mass": system.mass,
        "thermal_energy": system.thermal_energy,
        "kernel": system.kernel,
        "friction": system.friction,
        "friction_across": system.friction_across,
        "friction_along": system.friction_along,
        "eos": ("ideal_gas", [(system.thermal_energy / system.mass * 60.0) ** 0.5]),
        "noise": system.noise,
        "integrator": "pair_splitting",
        "iterations": 0,
        "body_force": None
        if system.body_force is None
        else (list(system.body_force), system.body_wave),
        "dt": system.dt,
        "seed": system.seed,
        "skin": None,
        "threads": 1,
        "exchanges": system.exchanges,
        "thermal": {
            "eos": (law.kind, law.parameters, law.isotherm),
            "boltzmann_constant": system.boltzmann_constant,
            "conductivity": system.conductivity,
            "exponents": list(system.exponents),
            "reference_temperature": system.reference_temperature,
            "bookkeeping": system.bookkeeping,
            "walls": list(system.heat),
        },
        "temperatures": system.temperatures,
    }
    return Core(**{**arguments, **options})


def orders(sim: Any) -> tuple[list[NDArray[np.int64]], NDArray[np.int64]]:
    """Pairs round by round, and links, of the core in the order of a forward sweep."""
    pairs = np.asarray(sim.pair_order(), dtype=np.int64).reshape(-1, 2)
    rounds = np.split(pairs, np.cumsum(sim.pairs_by_round())[:-1])
    return rounds, np.asarray(sim.wall_link_order(), dtype=np.int64).reshape(-1, 3)


def advanced(
    sim: Any, system: ThermalSystem, steps: int, accounts: Accounts, first: int = 0
) -> ThermalSystem:
    """The twin after `steps` steps along with the core, in the orders that the core reports."""
    for step in range(first, first + steps):
        forward = orders(sim)
        sim.run(1, system.dt)
        system = thermal_splitting_step(system, step, forward, orders(sim), accounts)
    return system


def differences(sim: Any, system: ThermalSystem) -> dict[str, float]:
    """Largest deviations of the core from the twin, in units of box, thermal speed, T."""
    way = np.asarray(sim.positions) - system.positions
    finite = np.where(system.box == NO_EDGE, EDGE, system.box)
    turns = np.where(system.box == NO_EDGE, 0.0, np.rint(way / finite))
    speed = np.sqrt(system.thermal_energy / system.mass)
    return {
        "positions": float(np.abs((way - finite * turns) / system.support).max()),
        "velocities": float(np.abs(sim.velocities - system.velocities).max() / speed),
        "temperatures": float(np.abs(sim.temperatures / system.temperatures - 1.0).max()),
    }


def core_energy(sim: Any, mass: float = 1.0) -> float:
    """Kinetic and internal energy as the core shows them."""
    energies = sim.internal_energies
    assert energies is not None
    return float(0.5 * mass * np.sum(np.asarray(sim.velocities) ** 2) + energies.sum())


__all__ = [
    "EXCHANGES",
    "VARIABLE",
    "advanced",
    "core_energy",
    "differences",
    "helmholtz",
    "orders",
    "replace",
    "thermal_core",
    "thermal_problem",
    "thermal_wall_problem",
    "warmed",
]
