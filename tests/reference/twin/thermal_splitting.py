"""The thermal splitting, one exchange and one step at a time.

E form of the Ito equations and the measure dS (Espanol and Revenga 2003): friction conserves
E_i + E_j + mu u^2/2, conduction E_i + E_j; both leave exp(sum S/k_B). A step is
O(dt/2) - kick - drift - densities - kick - O(dt/2), the second O from the other end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .system import Indices
from .thermal import Contact, ThermalSystem

Array = NDArray[np.float64]
Orders = tuple[list[Indices], Indices]  # pairs of each round, links

ROUNDS = 8  # in which pairs and links have their turns


@dataclass
class Accounts:
    """Energies exchanged since the start, by wall where there are walls."""

    body_work: float = 0.0
    discarded: float = 0.0
    unbooked: float = 0.0
    refused: int = 0
    wall_heat: Array = field(default_factory=lambda: np.zeros(0))
    wall_work: Array = field(default_factory=lambda: np.zeros(0))


class Sweep:
    """Exchanges over the time `time` (half a step), one contact after the other."""

    def __init__(self, system: ThermalSystem, time: float, accounts: Accounts) -> None:
        self.system, self.time, self.accounts = system, time, accounts
        self.velocities = system.velocities.tolist()  # plain floats: faster one at a time
        self.heat = (system.capacity * system.temperatures).tolist()

    def end(self) -> ThermalSystem:
        """The system after the sweep."""
        return replace(
            self.system.heated(np.array(self.heat)), velocities=np.array(self.velocities)
        )

    def run(self, contacts: Sequence[Contact], backward: bool) -> None:
        s = self.system
        for contact in reversed(contacts) if backward else contacts:
            if backward and s.conducts:
                self.conduct(contact)
            if s.rubs:
                self.rub(contact)
            if not backward and s.conducts:
                self.conduct(contact)

    def _refuse(self) -> None:
        self.accounts.refused += 1

    # --- friction ------------------------------------------------------------------------------

    def share(self, ti: float, tj: float) -> float:
        """c_ij for two particles of the same heat capacity; it belongs to the noise."""
        s = self.system
        if not (s.noisy and s.heats):
            return 0.0
        return 2.0 * ti * tj / (ti + tj) ** 2 * s.boltzmann_constant / s.capacity

    def viscosity_factor(self, contact: Contact, kinetic: float) -> float:
        """phi at an invariant of the exchange: (E_i + E_j + K)/2 of a pair, E + K of an own image.

        Without noise k_B plays no part, and it is the mean temperature itself.
        """
        s = self.system
        if not s.exchanges.endswith("variable"):
            return 1.0
        part = 1.0 if contact.own else 0.5
        mean = 0.5 * (self.heat[contact.i] + self.heat[contact.j])
        freedom = 0.5 * part * s.dimension * s.boltzmann_constant
        if not s.noisy:
            part = freedom = 0.0
        scale = s.reference_temperature * (s.capacity + freedom)
        return math.pow((mean + part * kinetic) / scale, s.exponents[0])

    def rub(self, contact: Contact) -> None:
        s, own = self.system, contact.own
        if not contact.rough or (own and contact.sign < 0.0):
            return None  # the image of an image moves with its particle
        vi, vj = self.velocities[contact.i], self.velocities[contact.j]
        if own:
            u = [x - w for x, w in zip(vi, contact.wall, strict=True)]
            reduced = s.mass
        else:
            u = [x + contact.sign * y for x, y in zip(vi, vj, strict=True)]
            if contact.sign > 0.0:
                u = [x - 2.0 * w for x, w in zip(u, contact.wall, strict=True)]
            reduced = 0.5 * s.mass
        kinetic = 0.5 * reduced * sum(x * x for x in u)
        ti, tj = (self.heat[k] / s.capacity for k in (contact.i, contact.j))
        # the noise of an own image has the temperature of its particle: no c
        c = 0.0 if own else self.share(ti, tj)
        # drag on u: f = -g G u on each end of a link, twice that from an own image
        rate = 2.0 * contact.g / s.mass * self.viscosity_factor(contact, kinetic) * (1.0 - c)
        mean = 2.0 * ti * tj / (ti + tj)
        variance = s.boltzmann_constant * mean / (reduced * (1.0 - c))
        a, b = s.across_along

        def decay(x: float) -> float:
            return math.expm1(-rate * x * self.time)

        def spread(x: float) -> float:
            return math.sqrt(variance * -math.expm1(-2.0 * rate * max(x, 0.0) * self.time))

        change = [decay(a) * x for x in u]
        noise = contact.xi[: s.dimension]
        for k, x in enumerate(noise):
            change[k] += spread(a) * x
        for e, part in contact.axes:
            more = (decay(a + b * part) - decay(a)) * sum(map(float.__mul__, e, u))
            if noise:
                more += (spread(a + b * part) - spread(a)) * sum(map(float.__mul__, e, noise))
            for k, direction in enumerate(e):
                change[k] += more * direction
        after = 0.5 * reduced * sum((x + d) ** 2 for x, d in zip(u, change, strict=True))
        gain = (kinetic - after) * (1.0 if own else 0.5)
        ends = {contact.i, contact.j}
        if s.heats:
            if any(self.heat[k] + gain <= 0.0 for k in ends):
                return self._refuse()
            for k in ends:
                self.heat[k] += gain
        for k, d in enumerate(change):
            if own:
                vi[k] += d
            else:
                vi[k] += 0.5 * d
                vj[k] += 0.5 * contact.sign * d
        if contact.sign > 0.0:
            work = s.mass * sum(map(float.__mul__, change, contact.wall))
            for wall in contact.walls:
                self.accounts.wall_work[wall] += work / len(contact.walls)
        return None

    # --- conduction ----------------------------------------------------------------------------

    def conduct(self, contact: Contact) -> None:
        if contact.bath is not None:
            self._bathe(contact, contact.bath)
        elif not contact.own:
            self._level(contact)

    def conductivity(self, temperature: float) -> float:
        """kappa; it is taken at an invariant of the exchange."""
        s = self.system
        if not s.exchanges.endswith("variable"):
            return s.conductivity
        return s.conductivity * math.pow(temperature / s.reference_temperature, s.exponents[1])

    def _level(self, contact: Contact) -> None:
        """The first two moments of x = (E_i - E_j)/2 are exact.

        dx = -r x dt + sqrt(4 kappa k_B g Ti Tj) dW, Ti Tj = ((E_i + E_j)^2/4 - x^2)/C^2 and
        r = 4 kappa g/C give d<x^2> = (-2 r - r/k) <x^2> + r (E_i + E_j)^2/(4 k).
        """
        s = self.system
        ei, ej = self.heat[contact.i], self.heat[contact.j]
        total, x = ei + ej, 0.5 * (ei - ej)
        k = s.capacity / s.boltzmann_constant
        kappa = self.conductivity(0.5 * total / s.capacity)
        th = 4.0 * kappa * contact.g * self.time / s.capacity
        after = x * math.exp(-th)
        if contact.xi:
            rest = total**2 / (4.0 * (2.0 * k + 1.0))
            # <x'^2> - <x'>^2, without the cancellation at small th
            variance = -rest * math.expm1(-th * (2.0 + 1.0 / k))
            variance += x * x * math.exp(-2.0 * th) * math.expm1(-th / k)
            after += math.sqrt(max(variance, 0.0)) * contact.xi[3]
        if abs(after) >= 0.5 * total:
            return self._refuse()
        self.heat[contact.i], self.heat[contact.j] = 0.5 * total + after, 0.5 * total - after
        return None

    def _bathe(self, contact: Contact, wall: float) -> None:
        """A bath of temperature T_w: M = L b b^T with b = (1/T_i, 1/T_j, -2) or (1/T_i, -1).

        L = 2 kappa g T_w Tm, twice that for an own image (with T_i for Tm), makes M dS/dx linear in
        T_w - Tm. With k_B div M and Ito's term of dE = T dS + (T/2C) dS^2,
        dE_i = dE_j = 4 kappa g (T_w (1 - c) - Tm) dt + sqrt(4 kappa k_B g T_w Tm) dW,
        dE = 4 kappa g (T_w - T) dt + sqrt(8 kappa k_B g T_w T) dW for an own image. Both are
        dy = r (y_0 - y) dt + sqrt(2 r k_B T_w y) dW, y = E_i + E_j or E_i, but for Tm/y, which is
        taken as it was.
        """
        s = self.system
        ei, ej = self.heat[contact.i], self.heat[contact.j]
        rate = 4.0 * self.conductivity(wall) * contact.g / s.capacity
        if contact.own:
            y, aim = ei, s.capacity * wall
        else:
            y, part = ei + ej, 4.0 * ei * ej / (ei + ej) ** 2
            # c without its condition: it comes from this noise, whatever friction does
            c = 0.5 * part * s.boltzmann_constant / s.capacity if s.noisy else 0.0
            rate, aim = rate * part, 2.0 * s.capacity * wall * (1.0 - c) / part
        kept = math.exp(-rate * self.time)
        lost = -math.expm1(-rate * self.time)
        after = y * kept + aim * lost
        if contact.xi:
            variance = s.boltzmann_constant * wall * (2.0 * y * kept * lost + aim * lost**2)
            after += math.sqrt(max(variance, 0.0)) * contact.xi[3]
        ends = {contact.i, contact.j}
        gain = (after - y) / len(ends)
        if any(self.heat[k] + gain <= 0.0 for k in ends):
            return self._refuse()
        for k in ends:
            self.heat[k] += gain
        baths = [wall for wall in contact.walls if s.heat[wall][0] == "isothermal"]
        for wall in baths:
            self.accounts.wall_heat[wall] += (y - after) / len(baths)
        return None

    def heat_by_flux(self, contacts: Sequence[Contact]) -> None:
        """A given power, in proportion to sum_J g_iJ phi_j over the images behind that wall.

        It is what the images of a gradient would give, over those of an adiabatic wall.
        """
        s = self.system
        for wall, (kind, numbers) in enumerate(s.heat):
            if kind != "flux":
                continue
            share, phi = np.zeros(s.size), s.stands[wall].distance
            for contact in contacts:
                if contact.walls == (wall,):
                    share[contact.i] += contact.g * phi[contact.j]
                    if not contact.own:
                        share[contact.j] += contact.g * phi[contact.i]
            energy = numbers[0] * self.time
            self.heat = (np.array(self.heat) + energy * share / share.sum()).tolist()
            self.accounts.wall_heat[wall] -= energy


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
    heat = energies - first - second - moved.mass * moved.caloric.cold(rho)
    stands = heat <= 0.0
    accounts.discarded += float(np.sum(np.where(stands, 0.0, moved.capacity * adiabat - heat)))
    return replace(moved, temperatures=np.where(stands, adiabat, heat / moved.capacity))


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
