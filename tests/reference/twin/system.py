"""Densities, pair forces, energies and stress of isothermal SDPD over all pairs.

Espanol and Revenga, Phys. Rev. E 67 (2003) 026705; friction
f_i = -sum_j g_ij [a v_ij + b e e.v_ij], g_ij = F_ij/(d_i d_j); noise covariance
<dF dF^T> = 2 kT g (a I + b e e) dt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdpd import _core

from .kernels import force_factor, kernel_value
from .noise import force_variates, pair_variates, particle_words
from .states import pressure, specific_potential

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Pairs(NamedTuple):
    """Pairs i, j (index arrays) with r_ij (n, D), its length, and the unit vector e_ij."""

    i: Indices
    j: Indices
    vector: Array
    distance: Array
    unit: Array


class Forces(NamedTuple):
    """Force parts (N, D) on each particle [mass length/time^2]."""

    conservative: Array
    dissipative: Array
    random: Array

    @property
    def total(self) -> Array:
        return self.conservative + self.dissipative + self.random


@dataclass(frozen=True)
class System:
    """A periodic box of particles and its physics; positions and velocities are (N, D)."""

    positions: Array
    velocities: Array
    box: Array
    support: float
    mass: float
    thermal_energy: float
    kernel: str
    friction: str
    friction_across: float
    friction_along: float
    eos: tuple[str, list[float]]
    noise: str
    dt: float
    seed: int
    body_force: Array | None = None
    body_wave: tuple[int, int] | None = None
    ids: NDArray[np.uint64] | None = None

    def at(self, **changes: Any) -> System:
        """The same system with other positions, velocities, ..."""
        return replace(self, **changes)

    @property
    def size(self) -> int:
        return self.positions.shape[0]

    @property
    def dimension(self) -> int:
        return self.positions.shape[1]

    @property
    def particle_ids(self) -> NDArray[np.uint64]:
        return np.arange(self.size, dtype=np.uint64) if self.ids is None else self.ids

    @property
    def across_along(self) -> tuple[float, float]:
        """a and b, zero without friction; the central form has a = 0 whatever is given."""
        if self.friction == "none":
            return 0.0, 0.0
        return (0.0 if self.friction == "central" else self.friction_across), self.friction_along

    def geometry(self, i: Indices, j: Indices) -> Pairs:
        """Minimum image vectors of the given pairs."""
        vector = self.positions[i] - self.positions[j]
        vector = vector - self.box * np.rint(vector / self.box)
        distance = np.sqrt(np.sum(vector**2, axis=1))
        unit = vector / np.where(distance > 0.0, distance, 1.0)[:, None]
        return Pairs(i, j, vector, distance, unit)

    @cached_property
    def pairs(self) -> Pairs:
        """All pairs i < j nearer than the support."""
        every = self.geometry(*np.triu_indices(self.size, 1))
        near = every.distance < self.support
        return Pairs(*(part[near] for part in every))

    @cached_property
    def number_densities(self) -> Array:
        """d_i = W(0) + sum_j W(r_ij)."""
        p = self.pairs
        w = kernel_value(self.kernel, self.dimension, p.distance, self.support)
        total = np.full(
            self.size,
            float(kernel_value(self.kernel, self.dimension, np.zeros(1), self.support)[0]),
        )
        np.add.at(total, p.i, w)
        np.add.at(total, p.j, w)
        return total

    @property
    def densities(self) -> Array:
        return self.mass * self.number_densities

    @property
    def pressures(self) -> Array:
        return pressure(*self.eos, self.densities)

    def coupling(self, p: Pairs) -> Array:
        """g_ij = F_ij / (d_i d_j)."""
        d = self.number_densities
        f = force_factor(self.kernel, self.dimension, p.distance, self.support)
        return f / (d[p.i] * d[p.j])

    def potential_energy(self, reference: float) -> float:
        """U = sum_i m e(rho_i), e counted from the mass density `reference`."""
        return float(self.mass * np.sum(specific_potential(*self.eos, self.densities, reference)))

    def kinetic_energy(self) -> float:
        return float(0.5 * self.mass * np.sum(self.velocities**2))

    def variates(self, p: Pairs, step: int, stream: str, draw: int) -> Array:
        """xi_ij (n, D), antisymmetric in the ends; central friction: z0 (n, 1), symmetric."""
        ids = self.particle_ids
        a, b = ids[p.i], ids[p.j]
        if stream == "pair_force":
            # Normal ones are those of the core, which have a test of their own: they are drawn in
            # single precision, and no two machines round alike.
            draw = force_variates if self.noise == "uniform" else _core.force_variates
            xi = draw(self.seed, step, a, b, self.noise, self.dimension)
            if self.friction == "central":
                word = particle_words(self.seed, step, ids)
                return np.where(word[p.i] > word[p.j], -1.0, 1.0)[:, None] * xi[:, :1]
            return xi
        xi = pair_variates(self.seed, stream, step, draw, a, b, self.noise, self.dimension)
        if self.friction == "central":
            return xi[:, :1]
        return np.where(a < b, 1.0, -1.0)[:, None] * xi

    def pair_conservative(self, p: Pairs) -> Array:
        d = self.number_densities
        share = self.pressures / d**2
        f = force_factor(self.kernel, self.dimension, p.distance, self.support)
        return ((share[p.i] + share[p.j]) * f)[:, None] * p.vector

    def pair_dissipative(self, p: Pairs) -> Array:
        a, b = self.across_along
        g = self.coupling(p)[:, None]
        v = self.velocities[p.i] - self.velocities[p.j]
        along = np.sum(p.unit * v, axis=1, keepdims=True)
        return -g * (a * v + b * along * p.unit)

    def pair_random(self, p: Pairs, step: int) -> Array:
        if self.noise == "none" or self.friction == "none":
            return np.zeros_like(p.vector)
        a, b = self.across_along
        amplitude = np.sqrt(2.0 * self.thermal_energy * self.coupling(p) / self.dt)[:, None]
        xi = self.variates(p, step, "pair_force", 0)
        if self.friction == "central":
            return amplitude * np.sqrt(b) * xi * p.unit
        along = np.sum(p.unit * xi, axis=1, keepdims=True)
        return amplitude * (np.sqrt(a) * xi + (np.sqrt(a + b) - np.sqrt(a)) * along * p.unit)

    def gather(self, p: Pairs, pair_force: Array) -> Array:
        """Sum pair forces (on i, minus on j) to (N, D)."""
        total = np.zeros_like(self.positions)
        np.add.at(total, p.i, pair_force)
        np.add.at(total, p.j, -pair_force)
        return total

    def forces(self, step: int = 0) -> Forces:
        """The three parts of the pair forces."""
        p = self.pairs
        return Forces(
            self.gather(p, self.pair_conservative(p)),
            self.gather(p, self.pair_dissipative(p)),
            self.gather(p, self.pair_random(p, step)),
        )

    def external_forces(self) -> Array:
        """Body force: mass times an acceleration, uniform or a sine of (axis, waves)."""
        if self.body_force is None:
            return np.zeros_like(self.positions)
        field = np.broadcast_to(self.mass * np.asarray(self.body_force), self.positions.shape)
        if self.body_wave is None:
            return field
        axis, waves = self.body_wave
        phase = 2.0 * np.pi * waves * self.positions[:, axis] / self.box[axis]
        return field * np.sin(phase)[:, None]

    def friction_rates(self) -> Array:
        """Sum_j g_ij (a + b/D) / m per particle [1/time]; its mean is the slope of the VACF."""
        a, b = self.across_along
        p = self.pairs
        rate = self.coupling(p) * (a + b / self.dimension) / self.mass
        total = np.zeros(self.size)
        np.add.at(total, p.i, rate)
        np.add.at(total, p.j, rate)
        return total

    def friction_matrix(self) -> Array:
        """Gamma (N D, N D) with f = -Gamma v; symmetric, positive semidefinite."""
        a, b = self.across_along
        p = self.pairs
        n, dim = self.size, self.dimension
        block = self.coupling(p)[:, None, None] * (
            a * np.eye(dim) + b * p.unit[:, :, None] * p.unit[:, None, :]
        )
        matrix = np.zeros((n, n, dim, dim))
        np.add.at(matrix, (p.i, p.i), block)
        np.add.at(matrix, (p.j, p.j), block)
        np.add.at(matrix, (p.i, p.j), -block)
        np.add.at(matrix, (p.j, p.i), -block)
        return matrix.transpose(0, 2, 1, 3).reshape(n * dim, n * dim)

    def virial_stress(self, pair_force: Array) -> Array:
        """-(1/V) sum_pairs r_ij (x) f_ij (D, D): first index r, second f; not symmetrised."""
        return -np.einsum("pa,pb->ab", self.pairs.vector, pair_force) / float(np.prod(self.box))
