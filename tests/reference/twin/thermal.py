"""Particles with temperatures, and the contacts along which they exchange momentum and heat.

Everything is in the user's units: m, k_B, C = m c_v and temperatures appear as such.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .caloric import Caloric
from .kernels import force_factor, kernel_value
from .noise import pair_variates, pair_words
from .system import Indices, System
from .walls import Links, WallSystem

Array = NDArray[np.float64]
Vector = list[float]
WallHeat = tuple[str, list[float]]


class Contact(NamedTuple):
    """A pair, a link to an image or an own image, as an exchange of momentum and heat sees it."""

    i: int
    j: int
    sign: float  # of v_j in u: -1 for direct pairs and even images
    g: float
    axes: list[tuple[Vector, float]]  # unit vectors and the share of b along each
    wall: Vector  # velocity of the wall
    xi: Vector  # four variates, none without noise
    bath: float | None = None  # temperature of the bath behind an isothermal wall
    walls: tuple[int, ...] = ()
    rough: bool = True  # is there friction?
    chance: Vector | None = None  # ln of what decides about friction and conduction

    @property
    def own(self) -> bool:
        return self.i == self.j


@dataclass(frozen=True)
class ThermalSystem(WallSystem):
    """A `WallSystem` (perhaps without walls) whose particles have temperatures (N,)."""

    temperatures: Array = field(default_factory=lambda: np.ones(0))
    caloric: Caloric = field(default_factory=lambda: Caloric("ideal_gas", [1.0, 1.0, 0.0]))
    boltzmann_constant: float = 1.0
    conductivity: float = 0.0
    exponents: tuple[float, float] = (0.0, 0.0)
    reference_temperature: float = 1.0
    exchanges: str = "full"
    bookkeeping: bool = True
    heat: tuple[WallHeat, ...] = ()
    slips: tuple[int, ...] = ()  # walls on which the fluid slips

    @property
    def capacity(self) -> float:
        """C of a particle, where all have the same."""
        return self.mass * self.caloric.heat_capacity

    @cached_property
    def capacities(self) -> Array:
        """C of each particle."""
        rho = self.densities
        return self.mass * self.caloric.states(rho, self.thermal / self.mass)[1]

    @property
    def variable(self) -> bool:
        """Do viscosity and conductivity follow the temperature?"""
        return self.exchanges.endswith(("variable", "general", "metropolis"))

    @property
    def decides(self) -> bool:
        """Are exchanges accepted or rejected?"""
        return self.exchanges.endswith("metropolis")

    @property
    def rubs(self) -> bool:
        return self.exchanges.startswith(("full", "heating", "bath"))

    @property
    def heats(self) -> bool:
        """Does friction heat (and its noise cool)?"""
        return self.exchanges.startswith(("full", "heating"))

    @property
    def conducts(self) -> bool:
        return "full" in self.exchanges or "conduction" in self.exchanges

    @property
    def noisy(self) -> bool:
        return self.noise != "none"

    @property
    def pressures(self) -> Array:
        return self.caloric.pressure(self.densities, self.temperatures)

    @cached_property
    def thermal(self) -> Array:
        """Energies without the cold one, C T where C is a constant."""
        return self.mass * self.caloric.heats(self.densities, self.temperatures)

    @property
    def internal_energies(self) -> Array:
        return self.mass * self.caloric.cold(self.densities) + self.thermal

    @property
    def entropies(self) -> Array:
        return self.mass * self.caloric.entropy(self.densities, self.temperatures)

    def total_energy(self) -> float:
        return self.kinetic_energy() + float(self.internal_energies.sum())

    def heated(self, heat: Array) -> ThermalSystem:
        """The same with thermal energies `heat`."""
        return replace(self, temperatures=self.caloric.states(self.densities, heat / self.mass)[0])

    def conservative(self) -> Array:
        """Forces of the pressure, the body force included."""
        direct = System.gather(self, self.pairs, self.pair_conservative(self.pairs))
        return direct + self.image_conservative() + self.external_forces()

    def density_rates(self, velocities: Array) -> Array:
        """Rate of change of all number densities if the particles move so."""
        p = self.pairs
        u = velocities[p.i] - velocities[p.j]
        f = force_factor(self.kernel, self.dimension, p.distance, self.support)
        rate = -f * np.sum(p.vector * u, axis=1)
        total = np.zeros(self.size)
        np.add.at(total, p.i, rate)
        np.add.at(total, p.j, rate)
        for link in self.links:
            i, j = link.i, link.j
            w = kernel_value(self.kernel, self.dimension, link.distance, self.support)
            f = force_factor(self.kernel, self.dimension, link.distance, self.support)
            approach = np.sum(link.vector * (velocities[i] - velocities[j]), axis=1)
            growth = np.zeros(len(i))
            for wall in link.walls:
                stand, (psi, climb) = self.stands[wall], self.psi[wall]
                lift = np.sum(stand.normal * velocities, axis=1)
                swell = np.sum(climb * velocities, axis=1) / psi
                approach += 2.0 * (stand.distance[i] * lift[j] + stand.distance[j] * lift[i])
                growth += swell[i] + swell[j]
            rate = link.weight * (w * growth - f * approach)
            np.add.at(total, i, rate)
            np.add.at(total, j, np.where(i == j, 0.0, rate))
        return total

    def pressure_work(self, velocities: Array) -> Array:
        """Power that each particle loses to the motion of all, P dV/dt with V = 1/d."""
        return -self.pressures / self.number_densities**2 * self.density_rates(velocities)

    # --- contacts ----------------------------------------------------------------------------

    def four(self, i: Indices, j: Indices, step: int, draw: int) -> Array:
        """Four variates of each pair or link, (n, 4); empty without noise."""
        if not self.noisy:
            return np.zeros((len(i), 0))
        a, b = self.particle_ids[i], self.particle_ids[j]
        return pair_variates(self.seed, "pair_thermal", step, draw, a, b, self.noise, 4)

    def direct_contacts(self, order: Indices, step: int, half: int) -> list[Contact]:
        """Pairs of `order` (M, 2) within the support, in that order."""
        p = self.geometry(order[:, 0], order[:, 1])
        ids = self.particle_ids
        sign = np.where(ids[p.i] < ids[p.j], 1.0, -1.0)[:, None]
        xi = (sign * self.four(p.i, p.j, step, half)).tolist()
        g, units, still = self.coupling(p).tolist(), p.unit.tolist(), [0.0] * self.dimension
        near = np.flatnonzero(p.distance < self.support).tolist()
        contacts = [
            Contact(int(p.i[k]), int(p.j[k]), -1.0, g[k], [(units[k], 1.0)], still, xi[k])
            for k in near
        ]
        if not self.decides:
            return contacts
        words = pair_words(self.seed, "pair_acceptance", step, half, ids[p.i], ids[p.j])
        chance = np.log((words[near, :2] + 0.5) * 2.0**-32).tolist()
        return [c._replace(chance=x) for c, x in zip(contacts, chance, strict=True)]

    def wall_contacts(self, order: NDArray[np.int64], step: int, half: int) -> list[Contact]:
        """Links (i, j, label) in that order, then own images, those of a particle by label."""
        tables = {link.label: self._contacts(link, step, half) for link in self.links}
        rows = [tuple(map(int, row)) for row in order]
        rows += [(i, i, label) for i in range(self.size) for label in sorted(tables)]
        found = (tables[label].get((min(i, j), max(i, j))) for i, j, label in rows)
        return [contact for contact in found if contact is not None]

    def _contacts(self, link: Links, step: int, half: int) -> dict[tuple[int, int], Contact]:
        odd = len(link.walls) % 2 == 1
        ids = self.particle_ids
        turn = np.where(ids[link.i] < ids[link.j], 1.0, -1.0)[:, None]
        xi = np.array(self.four(link.i, link.j, step, half + 2 * link.label))
        baths = self.bath_temperatures(link)
        if not odd:
            xi[:, :3] *= turn
        if baths is None:
            xi[:, 3:] *= turn
        n, n2, t, t2 = self.directions(link)
        wall, g = self.wall_velocity(link), self.link_coupling(link)
        contacts = {}
        for k, key in enumerate(zip(link.i.tolist(), link.j.tolist(), strict=True)):
            axes = [(n[k].tolist(), float(n2[k])), (t[k].tolist(), float(t2[k]))]
            bath = None if baths is None else float(baths[k])
            contacts[key] = Contact(
                *key,
                1.0 if odd else -1.0,
                float(g[k]),
                axes,
                wall[k].tolist(),
                xi[k].tolist(),
                bath,
                link.walls,
                not any(w in self.slips for w in link.walls),
            )
        return contacts

    def bath_temperatures(self, link: Links) -> Array | None:
        """Of the bath seen through a link, at the mean of both feet; None: the image has T_j.

        Each isothermal wall mirrors T to 2 T_w - T; over two of them, in both orders, T is left.
        """
        values = []
        for wall in link.walls:
            kind, numbers = self.heat[wall]
            if kind != "isothermal":
                continue
            stand = self.stands[wall]
            feet = self.positions - stand.distance[:, None] * stand.normal
            t = numbers[0] + feet @ np.array(numbers[1:])
            values.append(0.5 * (t[link.i] + t[link.j]))
        return np.mean(values, axis=0) if len(values) % 2 else None
