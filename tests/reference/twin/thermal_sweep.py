"""Half a step of exchanges of momentum and heat, one contact after the other.

E form of the Ito equations and the measure dS (Espanol and Revenga 2003): friction conserves
E_i + E_j + mu u^2/2, conduction E_i + E_j; both leave exp(sum S/k_B).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .acceptance import log_normal, log_relaxation
from .thermal import Contact, ThermalSystem, Vector

Array = NDArray[np.float64]


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
        self.heat = system.thermal.tolist()
        self.laws = system.caloric.laws(system.densities)

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

    def state(self, k: int, heat: float) -> tuple[float, float]:
        """T and C of a particle."""
        mass = self.system.mass
        t, capacity = self.laws[k].state(heat / mass)
        return t, mass * capacity

    def states(self, contact: Contact, heats: Vector) -> tuple[float, float, float]:
        """Both temperatures, and C with 2/C = 1/C_i + 1/C_j."""
        (ti, ci), (tj, cj) = map(self.state, (contact.i, contact.j), heats)
        return ti, tj, 2.0 * ci * cj / (ci + cj)

    def log_weight(self, contact: Contact, heats: Vector) -> float:
        """ln of exp((S_i + S_j)/k_B)/(T_i T_j)."""
        s, total = self.system, 0.0
        for k, heat in zip((contact.i, contact.j), heats, strict=True):
            total += s.mass * self.laws[k].entropy(heat / s.mass) / s.boltzmann_constant
            total -= math.log(self.state(k, heat)[0])
        return total

    # --- friction ------------------------------------------------------------------------------

    def share(self, ti: float, tj: float, capacity: float) -> float:
        """c_ij = Ti Tj/(Ti + Tj)^2 (k_B/C_i + k_B/C_j); it belongs to the noise."""
        s = self.system
        if not (s.noisy and s.heats):
            return 0.0
        return 2.0 * ti * tj / (ti + tj) ** 2 * s.boltzmann_constant / capacity

    def viscosity_factor(self, contact: Contact, heats: Vector, kinetic: float) -> float:
        """phi at an invariant of the exchange: the mean of T C/(C + D k_B/2n) at E + K/n.

        K is shared out among n = 2 particles, or 1 with an own image. Without noise k_B plays no
        part, and without heating no energy of motion: there it is the mean temperature itself.
        """
        s = self.system
        if not s.variable:
            return 1.0
        part = (1.0 if contact.own else 0.5) * (s.noisy and s.heats)
        freedom = 0.5 * part * s.dimension * s.boltzmann_constant
        mean = 0.0
        for k, heat in zip((contact.i, contact.j), heats, strict=True):
            t, capacity = self.state(k, heat + part * kinetic)
            mean += 0.5 * t * capacity / (capacity + freedom)
        return math.pow(mean / s.reference_temperature, s.exponents[0])

    def relaxation(self, contact: Contact, heats: Vector, kinetic: float) -> tuple[float, float]:
        """Rate of u per unit of a or b, and its stationary variance."""
        s, own = self.system, contact.own
        ti, tj, capacity = self.states(contact, heats)
        # the noise of an own image has the temperature of its particle: no c
        c = 0.0 if own else self.share(ti, tj, capacity)
        # drag on u: f = -g G u on each end of a link, twice that from an own image
        factor = self.viscosity_factor(contact, heats, kinetic)
        rate = 2.0 * contact.g / s.mass * factor * (1.0 - c)
        mean = 2.0 * ti * tj / (ti + tj)
        reduced = s.mass if own else 0.5 * s.mass
        return rate, s.boltzmann_constant * mean / (reduced * (1.0 - c))

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
        heats = [self.heat[contact.i], self.heat[contact.j]]
        rate, variance = self.relaxation(contact, heats, kinetic)
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
        moved = [x + d for x, d in zip(u, change, strict=True)]
        gain = (kinetic - 0.5 * reduced * sum(x * x for x in moved)) * (1.0 if own else 0.5)
        if s.heats:
            after = [heat + gain for heat in heats]
            if min(after) <= 0.0 or not self._accepts_friction(contact, [heats, after], [u, moved]):
                return self._refuse()
            self.heat[contact.i], self.heat[contact.j] = after
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

    def _accepts_friction(self, contact: Contact, heats: list[Vector], u: list[Vector]) -> bool:
        """Of states before and after."""
        if contact.chance is None:
            return True
        s, (a, b) = self.system, self.system.across_along

        def proposal(one: int, other: int) -> float:
            kinetic = 0.25 * s.mass * sum(x * x for x in u[one])
            rate, variance = self.relaxation(contact, heats[one], kinetic)
            rates = [rate * self.time * x for x in (a, a + b)]
            return log_relaxation(u[one], u[other], contact.axes[0][0], rates, variance)

        odds = self.log_weight(contact, heats[1]) - self.log_weight(contact, heats[0])
        return contact.chance[0] < odds + proposal(1, 0) - proposal(0, 1)

    # --- conduction ----------------------------------------------------------------------------

    def conduct(self, contact: Contact) -> None:
        if contact.bath is not None:
            self._bathe(contact, contact.bath)
        elif not contact.own:
            self._level(contact)

    def conductivity(self, temperature: float) -> float:
        """kappa; it is taken at an invariant of the exchange."""
        s = self.system
        if not s.variable:
            return s.conductivity
        return s.conductivity * math.pow(temperature / s.reference_temperature, s.exponents[1])

    def _conducted(self, contact: Contact, heats: Vector) -> tuple[float, float]:
        """Mean and variance of what i gets from j: the first two moments of x are exact.

        x = C (T_i - T_j)/2, of which dx = dE_i where dT = dE/C_i at the present C_i. Then
        dx = -r x dt + sqrt(4 kappa k_B g Ti Tj) dW, r = 4 kappa g/C and
        Ti Tj = (M^2/4 - x^2)/C^2 with M = C (T_i + T_j), which is taken as it is, give
        d<x^2> = (-2 r - r/k) <x^2> + r M^2/(4 k).
        """
        s = self.system
        ti, tj, capacity = self.states(contact, heats)
        total, x = capacity * (ti + tj), 0.5 * capacity * (ti - tj)
        k = capacity / s.boltzmann_constant
        half = 0.5 * sum(heats)
        mean = 0.5 * sum(self.state(n, half)[0] for n in (contact.i, contact.j))
        th = 4.0 * self.conductivity(mean) * contact.g * self.time / capacity
        rest = total**2 / (4.0 * (2.0 * k + 1.0))
        # <x'^2> - <x'>^2, without the cancellation at small th
        variance = -rest * math.expm1(-th * (2.0 + 1.0 / k))
        variance += x * x * math.exp(-2.0 * th) * math.expm1(-th / k)
        return x * math.expm1(-th), max(variance, 0.0)

    def _level(self, contact: Contact) -> None:
        heats = [self.heat[contact.i], self.heat[contact.j]]
        gain, variance = self._conducted(contact, heats)
        if contact.xi:
            gain += math.sqrt(variance) * contact.xi[3]
        after = [heats[0] + gain, heats[1] - gain]
        if min(after) <= 0.0 or not self._accepts_heat(contact, [heats, after], gain):
            return self._refuse()
        self.heat[contact.i], self.heat[contact.j] = after
        return None

    def _accepts_heat(self, contact: Contact, heats: list[Vector], gain: float) -> bool:
        """Of states before and after."""
        if contact.chance is None:
            return True
        there, back = (self._conducted(contact, pair) for pair in heats)
        odds = self.log_weight(contact, heats[1]) - self.log_weight(contact, heats[0])
        odds += log_normal(-gain, *back) - log_normal(gain, *there)
        return contact.chance[1] < odds

    def _bathe(self, contact: Contact, wall: float) -> None:
        """A bath of temperature T_w: M = L b b^T with b = (1/T_i, 1/T_j, -2) or (1/T_i, -1).

        L = 2 kappa g T_w Tm, twice that for an own image (with T_i for Tm), makes M dS/dx linear in
        T_w - Tm. With k_B div M and Ito's term of dE = T dS + (T/2C) dS^2,
        dE_i = dE_j = 4 kappa g (T_w (1 - c) - Tm) dt + sqrt(4 kappa k_B g T_w Tm) dW,
        dE = 4 kappa g (T_w - T) dt + sqrt(8 kappa k_B g T_w T) dW for an own image. Both are
        dy = r (y_0 - y) dt + sqrt(2 r k_B T_w y) dW, y = C (T_i + T_j) or C T_i, of which
        dy = dE_i + dE_j or dE_i at the present C, but for Tm/y, which is taken as it was.
        """
        s = self.system
        heats = [self.heat[contact.i], self.heat[contact.j]]
        ti, tj, capacity = self.states(contact, heats)
        rate = 4.0 * self.conductivity(wall) * contact.g / capacity
        if contact.own:
            y, aim = capacity * ti, capacity * wall
        else:
            y, part = capacity * (ti + tj), 4.0 * ti * tj / (ti + tj) ** 2
            # c without its condition: it comes from this noise, whatever friction does
            c = 0.5 * part * s.boltzmann_constant / capacity if s.noisy else 0.0
            rate, aim = rate * part, 2.0 * capacity * wall * (1.0 - c) / part
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
