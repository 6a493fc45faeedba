"""The thermal splitting, one step at a time.

A step is O(dt/2) - kick - drift - densities - kick - O(dt/2), the second O from the other end.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .system import Indices
from .thermal import ThermalSystem
from .thermal_sweep import Accounts, Sweep

Array = NDArray[np.float64]
Orders = tuple[list[Indices], Indices]  # pairs of each round, links

__all__ = ["ROUNDS", "Accounts", "Sweep", "exchanged", "thermal_splitting_step", "wall_round"]

ROUNDS = 8  # in which pairs and links have their turns


def exchanged(
    system: ThermalSystem,
    order: Orders,
    step: int,
    half: int,
    accounts: Accounts,
) -> ThermalSystem:
    """Half a step of exchanges; `order` holds the pairs (M, 2) of each round and all links.

    In each round walls come after the pairs, and given heat at the end; the second half is the
    first from its end. Links are (i, j, label).
    """
    sweep = Sweep(system, 0.5 * system.dt, accounts)
    walls = system.wall_contacts(order[1], step, half)
    ids = system.particle_ids
    turns = [wall_round(int(ids[c.i]), int(ids[c.j])) for c in walls]
    if half:
        sweep.heat_by_flux(walls)
    for number in reversed(range(ROUNDS)) if half else range(ROUNDS):
        listed = order[0][number] if number < len(order[0]) else np.zeros((0, 2), dtype=np.int64)
        pairs = system.direct_contacts(listed, step, half)
        links = [c for c, turn in zip(walls, turns, strict=True) if turn == number]
        for contacts in (links, pairs) if half else (pairs, links):
            sweep.run(contacts, backward=bool(half))
    if not half:
        sweep.heat_by_flux(walls)
    return sweep.end()


def wall_round(a: int, b: int) -> int:
    """The round in which a link between particles of those ids has its turn."""
    return fmix64(fmix64(min(a, b)) ^ max(a, b)) % ROUNDS


def fmix64(word: int) -> int:
    """Finaliser of MurmurHash3 (Appleby)."""
    full = 2**64 - 1
    word ^= word >> 33
    word = word * 0xFF51AFD7ED558CCD & full
    word ^= word >> 33
    word = word * 0xC4CEB9FE1A85EC53 & full
    return word ^ (word >> 33)


def kicked(system: ThermalSystem, accounts: Accounts) -> tuple[ThermalSystem, Array]:
    """Half a kick, and the work that each particle's pressure has done in it."""
    time = 0.5 * system.dt
    velocities = system.velocities + time / system.mass * system.conservative()
    mean = 0.5 * (velocities + system.velocities)
    if system.bookkeeping:
        accounts.body_work += time * float(np.sum(system.external_forces() * mean))
    return replace(system, velocities=velocities), time * system.pressure_work(mean)


def drifted(system: ThermalSystem, accounts: Accounts) -> ThermalSystem:
    """Half kick, drift with bounces, half kick: adiabats as predictor, then the books of the work.

    Work beyond what a particle has cannot be its own: there the adiabat stands.
    """
    entropies, energies = system.entropies, system.internal_energies
    fast, first = kicked(system, accounts)
    moved = replace(fast, positions=fast.positions + fast.dt * fast.velocities).bounced()
    assert isinstance(moved, ThermalSystem)
    rho = moved.densities
    adiabat = moved.caloric.temperature(rho, entropies / moved.mass)
    moved = replace(moved, temperatures=adiabat)
    moved, second = kicked(moved, accounts)
    if not moved.bookkeeping:
        return moved
    predicted = moved.thermal
    heat = energies - first - second - moved.mass * moved.caloric.cold(rho)
    stands = heat <= 0.0
    accounts.discarded += float(np.sum(np.where(stands, 0.0, predicted - heat)))
    return moved.heated(np.where(stands, predicted, heat))


def thermal_splitting_step(
    system: ThermalSystem,
    step: int,
    forward: Orders,
    backward: Orders,
    accounts: Accounts | None = None,
) -> ThermalSystem:
    """One step; `forward` and `backward` are the orders (pairs, links) listed before and after."""
    books = Accounts() if accounts is None else accounts
    for name in ("wall_heat", "wall_work"):
        if len(getattr(books, name)) != len(system.walls):
            setattr(books, name, np.zeros(len(system.walls)))
    moved = drifted(exchanged(system, forward, step, 0, books), books)
    return exchanged(moved, backward, step, 1, books)
