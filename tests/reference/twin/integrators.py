"""Velocity Verlet with re-evaluated friction, and the exact pair splitting, one step at a time.

Yang 2013 Table 4 (steps S-1..S-8), Bian 2015 Appendix B (iterations = 0); the splitting is
O(dt/2) - kick - drift - kick - O(dt/2), the second O in the reverse pair order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .system import Indices, Pairs, System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """A state between two steps: system (unwrapped positions), force for the next step, index."""

    system: System
    force: Array
    step: int = 0

    @classmethod
    def start(cls, system: System, step: int = 0) -> Trajectory:
        """Verlet's start: the total force at `step`, its noise keyed by that step."""
        return cls(system, system.forces(step).total + system.external_forces(), step)


def velocity_verlet_step(state: Trajectory, iterations: int) -> Trajectory:
    """One step of velocity Verlet; the force at time index k carries the noise of step k."""
    old, half = state.system, 0.5 * state.system.dt / state.system.mass
    velocities = old.velocities + half * state.force
    step = state.step + 1
    new = old.at(positions=old.positions + old.dt * velocities, velocities=velocities)
    parts = new.forces(step)
    fixed = parts.conservative + parts.random + new.external_forces()
    force = fixed + parts.dissipative
    final = velocities + half * force
    for sweep in range(iterations):
        force = fixed + new.gather(new.pairs, new.at(velocities=final).pair_dissipative(new.pairs))
        if sweep < iterations - 1:
            final = velocities + half * force
    return Trajectory(new.at(velocities=final), force, step)


def exchange_terms(
    system: System, p: Pairs, step: int, draw: int, time: float
) -> tuple[Array, Array, Array]:
    """Decay of the relative velocity of pairs along and across, and its random change (n, D)."""
    a, b = system.across_along
    g = system.coupling(p)
    mass, variance = system.mass, system.thermal_energy / system.mass
    along = np.exp(-2.0 * (a + b) * g * time / mass)
    across = np.exp(-2.0 * a * g * time / mass)
    kick = np.zeros_like(p.vector)
    if system.noise != "none":
        xi = system.variates(p, step, "pair_exchange", draw)
        sigma_along = np.sqrt(2.0 * variance * -np.expm1(-4.0 * (a + b) * g * time / mass))
        sigma_across = np.sqrt(2.0 * variance * -np.expm1(-4.0 * a * g * time / mass))
        if system.friction == "central":
            kick = sigma_along[:, None] * xi * p.unit
        else:
            part = np.sum(p.unit * xi, axis=1, keepdims=True) * p.unit
            kick = sigma_along[:, None] * part + sigma_across[:, None] * (xi - part)
    return along, across, kick


def exchange_sweep(system: System, order: Indices, step: int, draw: int, time: float) -> System:
    """Exact Ornstein-Uhlenbeck update of each pair in `order` (M, 2), positions frozen."""
    p: Pairs = system.geometry(order[:, 0], order[:, 1])
    along, across, kick = exchange_terms(system, p, step, draw, time)
    velocities = system.velocities.tolist()  # plain floats: faster one pair at a time
    rows = zip(
        order.tolist(),
        p.unit.tolist(),
        (along - 1.0).tolist(),
        (across - 1.0).tolist(),
        kick.tolist(),
        strict=True,
    )
    for (i, j), e, fall_along, fall_across, push in rows:
        vi, vj = velocities[i], velocities[j]
        u = [x - y for x, y in zip(vi, vj, strict=True)]
        projection = sum(x * y for x, y in zip(e, u, strict=True))
        for axis, direction in enumerate(e):
            part = projection * direction
            change = fall_along * part + fall_across * (u[axis] - part) + push[axis]
            vi[axis] += 0.5 * change
            vj[axis] -= 0.5 * change
    return system.at(velocities=np.array(velocities))


def conservative_force(system: System) -> Array:
    """Force without friction and noise, body force included."""
    return system.gather(system.pairs, system.pair_conservative(system.pairs)) + (
        system.external_forces()
    )


def pair_splitting_drift(system: System) -> System:
    """Half kick, drift, half kick by the conservative and the body force."""
    half = 0.5 * system.dt / system.mass
    velocities = system.velocities + half * conservative_force(system)
    moved = system.at(positions=system.positions + system.dt * velocities, velocities=velocities)
    return moved.at(velocities=velocities + half * conservative_force(moved))


def pair_splitting_step(
    system: System, step: int, forward: Indices, backward: Indices, sweeps: int = 1
) -> System:
    """One step of the splitting; `forward` and `backward` are pair orders as they are swept.

    Half a step may be made in several `sweeps`, whose number stands in bits 40 to 47 of the step.
    """
    part = 0.5 * system.dt / sweeps
    for number in range(sweeps):
        system = exchange_sweep(system, forward, step + (number << 40), 0, part)
    system = pair_splitting_drift(system)
    for number in range(sweeps):
        system = exchange_sweep(system, backward, step + (number << 40), 1, part)
    return system
