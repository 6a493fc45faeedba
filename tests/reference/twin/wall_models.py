"""Wall models to compare with, over all pairs, written from the equations.

Own-foot images: Yang (2013), Table 3 and 2.59 to 2.64. Completion: Vazquez-Quesada (2009) and Yang
(2013), appendix B, with integrals by quadrature of the kernel. Frozen particles: Bian et al.
(2015), appendix G. All of them act on each particle on its own: nothing is symmetric in i and j.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .kernels import force_factor, kernel_value
from .noise import pair_variates
from .states import pressure
from .system import Forces, Indices, System
from .walls import WallSystem

Array = NDArray[np.float64]


class Seen(NamedTuple):
    """Points that particles see behind one wall: i sees point `k`."""

    wall: int
    i: Indices
    k: Indices
    vector: Array
    distance: Array
    unit: Array


def _links(
    system: WallSystem, wall: int, points: Array, exists: NDArray[np.bool_], normal: Array
) -> Seen:
    """What every particle sees of `points` within the support."""
    r = system.positions[:, None, :] - points[None, :, :]
    r = r - system.box * np.rint(r / system.box)
    distance = np.sqrt(np.sum(r**2, axis=2))
    i, k = np.nonzero((distance < system.support) & exists[None, :])
    far = distance[i, k] > 0.0
    length = np.where(far, distance[i, k], 1.0)[:, None]
    unit = np.where(far[:, None], r[i, k] / length, normal[i])
    return Seen(wall, i, k, r[i, k], distance[i, k], unit)


@dataclass(frozen=True)
class OwnFootSystem(WallSystem):
    """Each particle mirrored at its own foot."""

    noisy: bool = False
    least_distance: float = 0.0

    @cached_property
    def seen(self) -> list[Seen]:
        found = []
        for wall, stand in enumerate(self.stands):
            normal = stand.normal / np.linalg.norm(stand.normal, axis=1)[:, None]
            height = stand.distance / np.linalg.norm(stand.normal, axis=1)
            mirrored = self.positions - 2.0 * height[:, None] * normal
            exists = (height >= self.least_distance) & (height < self.support)
            found.append(_links(self, wall, mirrored, exists, normal))
        return found

    def value(self, s: Seen) -> Array:
        return kernel_value(self.kernel, self.dimension, s.distance, self.support)

    def slope(self, s: Seen) -> Array:
        return force_factor(self.kernel, self.dimension, s.distance, self.support)

    @cached_property
    def number_densities(self) -> Array:
        total = np.array(System.number_densities.func(self))  # type: ignore[attr-defined]
        for s in self.seen:
            np.add.at(total, s.i, self.value(s))
        return total

    def forces(self, step: int = 0) -> Forces:
        parts = [np.array(part) for part in System.forces(self, step)]
        share = self.pressures / self.number_densities**2
        a, b = self.across_along
        for s in self.seen:
            f = self.slope(s)
            np.add.at(parts[0], s.i, ((share[s.i] + share[s.k]) * f)[:, None] * s.vector)
            g = f / (self.number_densities[s.i] * self.number_densities[s.k])
            wall = self.stands[s.wall].velocity[s.k]
            u = self.velocities[s.i] - (2.0 * wall - self.velocities[s.k])
            along = np.sum(s.unit * u, axis=1, keepdims=True) * s.unit
            np.add.at(parts[1], s.i, -g[:, None] * (a * u + b * along))
            if self.noisy and self.noise != "none" and self.friction != "none":
                np.add.at(parts[2], s.i, self.kicks(s, g, step))
        return Forces(*parts)

    def kicks(self, s: Seen, g: Array, step: int) -> Array:
        """Of covariance 2 kT g (a I + b e e)/dt, as between particles, own image included."""
        a, b = self.across_along
        ids = self.particle_ids
        first, second = ids[s.i], ids[s.k]
        xi = np.zeros_like(s.vector)
        for late in (False, True):
            of = (first > second) == late
            label = 2 * s.wall + 1 + late
            xi[of] = pair_variates(
                self.seed,
                "pair_force",
                step,
                2 * label,
                first[of],
                second[of],
                self.noise,
                self.dimension,
            )
        size = np.sqrt(2.0 * self.thermal_energy * g / self.dt)[:, None]
        if self.friction == "central":
            return size * np.sqrt(b) * xi[:, :1] * s.unit
        along = np.sum(s.unit * xi, axis=1, keepdims=True) * s.unit
        return size * (np.sqrt(a) * (xi - along) + np.sqrt(a + b) * along)


def behind_a_plane(kernel: str, dimension: int, s: Array, points: int = 64) -> Array:
    """Delta, psi, psi1, psi1 + psi2 and C at distances s of a kernel of unit support, (n, 5).

    By quadrature over the solid beyond z = s in polar coordinates around the particle: angles to
    the normal up to arccos(s), r from s/cos(angle) to 1.
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    t, wt = 0.5 * (nodes + 1.0), 0.5 * weights
    near = np.clip(s, 0.0, 1.0)[:, None]
    # denser towards the largest angle, where s/cos(angle) rises steeply
    angle = np.arccos(near) * (1.0 - t**4)
    ring = np.arccos(near) * 4.0 * t**3 * wt
    ring = ring * (2.0 * np.pi * np.sin(angle) if dimension == 3 else 2.0)
    low = (near / np.cos(angle))[..., None]
    r = low + (1.0 - low) * t
    dr = (1.0 - low) * wt * r ** (dimension - 1)
    value = ring * np.sum(dr * kernel_value(kernel, dimension, r, 1.0), axis=2)
    # F (r.n), with e e along and, in the mean over directions, across the normal
    first = np.sum(dr * r * force_factor(kernel, dimension, r, 1.0), axis=2) * np.cos(angle)
    along = np.cos(angle) ** 2
    parts = [value, ring * first]
    parts += [ring * first * (1.0 - along) / (dimension - 1), ring * first * along]
    # a wall of curvature K rises by K q^2/4 in the mean over directions (K q^2/2 in the plane)
    q = np.sqrt(1.0 - near**2) * np.sin(0.5 * np.pi * t)
    dq = np.sqrt(1.0 - near**2) * np.cos(0.5 * np.pi * t) * 0.5 * np.pi * wt
    w = kernel_value(kernel, dimension, np.sqrt(near**2 + q**2), 1.0)
    parts.append(dq * w * (2.0 * np.pi * q**3 / 4.0 if dimension == 3 else q**2))
    return np.stack([part.sum(axis=1) for part in parts], axis=1)


@dataclass(frozen=True)
class CompletionSystem(WallSystem):
    """Closed forms behind walls; pressure of symmetric images, or of the completed density."""

    exact: bool = False
    least_distance: float = 0.0

    def integrals(self, height: Array) -> Array:
        """(N, 5) at distances; 0 beyond the support."""
        return behind_a_plane(self.kernel, self.dimension, height / self.support)

    @cached_property
    def missing(self) -> list[Array]:
        """Delta + K C of each wall (N,)."""
        result = []
        for index, wall in enumerate(self.walls):
            rows = self.integrals(self.stands[index].distance)
            result.append(rows[:, 0] + wall.curvature * self.support * rows[:, 4])
        return result

    @cached_property
    def number_densities(self) -> Array:
        total = np.array(System.number_densities.func(self))  # type: ignore[attr-defined]
        for missing in self.missing:
            total = total / (1.0 - missing)
        return total

    def grips(self, wall: int) -> tuple[Array, Array]:
        """Friction coefficients with a wall across and along its normal, (N,) each."""
        a, b = self.across_along
        height = np.maximum(self.stands[wall].distance, self.least_distance)
        rows = self.integrals(height)
        # F dV (r.n) / (d h_i) with F of a kernel of support h: psi/h
        scale = 1.0 / (self.number_densities * height * self.support)
        return (
            scale * (a * rows[:, 1] + b * rows[:, 2]),
            scale * (a * rows[:, 1] + b * rows[:, 3]),
        )

    def wall_kicks(self, wall: int, stream: str, step: int, half: int) -> Array:
        ids = self.particle_ids
        draw = half + 2 * (wall + 1)
        return pair_variates(self.seed, stream, step, draw, ids, ids, self.noise, self.dimension)

    def forces(self, step: int = 0) -> Forces:
        parts = [np.array(part) for part in System.forces(self, step)]
        if not self.exact:
            parts[0] = parts[0] + self.image_conservative()
        else:
            parts[0] = self.completed_conservative()
        for wall, stand in enumerate(self.stands):
            n, grips = stand.normal, self.grips(wall)
            u = self.velocities - stand.velocity
            along = np.sum(n * u, axis=1, keepdims=True) * n
            parts[1] -= grips[0][:, None] * (u - along) + grips[1][:, None] * along
            if self.noise != "none" and self.friction != "none":
                xi = self.wall_kicks(wall, "pair_force", step, 0)
                along = np.sum(n * xi, axis=1, keepdims=True) * n
                sizes = [
                    np.sqrt(2.0 * self.thermal_energy * grip / self.dt)[:, None] for grip in grips
                ]
                parts[2] += sizes[0] * (xi - along) + sizes[1] * along
        return Forces(*parts)

    def completed_conservative(self) -> Array:
        """-dU/dr of U = sum m e(d_i): by differences of the missing volume, exact otherwise."""
        share = self.pressures / self.number_densities**2
        factor = np.ones(self.size)
        for missing in self.missing:
            factor = factor / (1.0 - missing)
        p = self.pairs
        f = force_factor(self.kernel, self.dimension, p.distance, self.support)
        both = (share * factor)[p.i] + (share * factor)[p.j]
        total = self.gather(p, (both * f)[:, None] * p.vector)
        for index, wall in enumerate(self.walls):
            stand, step = self.stands[index], 1e-4 * self.support
            ends = []
            for sign in (-2.0, -1.0, 1.0, 2.0):
                rows = self.integrals(stand.distance + sign * step)
                ends.append(rows[:, 0] + wall.curvature * self.support * rows[:, 4])
            slope = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * step)
            push = -share * self.number_densities * slope / (1.0 - self.missing[index])
            total += push[:, None] * stand.normal
        return total


@dataclass(frozen=True)
class FrozenSystem(WallSystem):
    """Particles that do not move behind walls; `places` (M, D) go deeper than a support."""

    places: Array = field(default_factory=lambda: np.zeros((0, 3)))
    least_distance: float = 0.0

    @cached_property
    def depths(self) -> tuple[Array, Indices]:
        """How far behind which wall each place is."""
        phi = np.stack([wall.stand(self.places, self.box).distance for wall in self.walls])
        return -phi.min(axis=0), phi.argmin(axis=0)

    @cached_property
    def near(self) -> Indices:
        """Places within a support of the wall: these are frozen particles."""
        return np.flatnonzero(self.depths[0] < self.support)

    @cached_property
    def seen(self) -> Seen:
        points = self.places[self.near]
        exists = np.ones(len(points), dtype=bool)
        return _links(self, 0, points, exists, np.zeros_like(self.positions))

    @cached_property
    def number_densities(self) -> Array:
        total = np.array(System.number_densities.func(self))  # type: ignore[attr-defined]
        w = kernel_value(self.kernel, self.dimension, self.seen.distance, self.support)
        np.add.at(total, self.seen.i, w)
        return total

    @cached_property
    def frozen_densities(self) -> Array:
        r = self.places[self.near][:, None, :] - self.places[None, :, :]
        r = r - self.box * np.rint(r / self.box)
        distance = np.sqrt(np.sum(r**2, axis=2))
        w = kernel_value(self.kernel, self.dimension, distance.ravel(), self.support)
        total = np.asarray(w.reshape(distance.shape).sum(axis=1))
        s = self.seen
        w = kernel_value(self.kernel, self.dimension, s.distance, self.support)
        np.add.at(total, s.k, w)
        return total

    def links(self) -> tuple[Array, Array]:  # type: ignore[override]
        """g alpha of what is seen, and the velocity relative to the wall."""
        s = self.seen
        depth, wall = (part[self.near][s.k] for part in self.depths)
        height = np.stack([stand.distance for stand in self.stands])[wall, s.i]
        alpha = 1.0 + depth / np.maximum(height, self.least_distance)
        f = force_factor(self.kernel, self.dimension, s.distance, self.support)
        g = alpha * f / (self.number_densities[s.i] * self.frozen_densities[s.k])
        moving = np.stack([stand.velocity for stand in self.stands])[wall, s.i]
        return g, self.velocities[s.i] - moving

    def forces(self, step: int = 0) -> Forces:
        parts = [np.array(part) for part in System.forces(self, step)]
        s = self.seen
        share = self.pressures / self.number_densities**2
        of_frozen = pressure(*self.eos, self.mass * self.frozen_densities)
        of_frozen = of_frozen / self.frozen_densities**2
        f = force_factor(self.kernel, self.dimension, s.distance, self.support)
        both = (share[s.i] + of_frozen[s.k]) * f
        np.add.at(parts[0], s.i, both[:, None] * s.vector)
        a, b = self.across_along
        g, u = self.links()
        along = np.sum(s.unit * u, axis=1, keepdims=True) * s.unit
        np.add.at(parts[1], s.i, -g[:, None] * (a * u + b * along))
        if self.noise != "none" and self.friction != "none":
            size = np.sqrt(2.0 * self.thermal_energy * g / self.dt)[:, None]
            xi = self.frozen_variates("pair_force", step, 0)
            if self.friction == "central":
                kick = size * np.sqrt(b) * xi[:, :1] * s.unit
            else:
                along = np.sum(s.unit * xi, axis=1, keepdims=True) * s.unit
                kick = size * (np.sqrt(a) * (xi - along) + np.sqrt(a + b) * along)
            np.add.at(parts[2], s.i, kick)
        return Forces(*parts)

    def frozen_variates(self, stream: str, step: int, half: int) -> Array:
        """One draw for each (particle, frozen particle): two labels tell (3, 5) from (5, 3)."""
        s, ids = self.seen, self.particle_ids
        first, second = ids[s.i], s.k.astype(np.uint64)
        xi = np.zeros((len(s.i), self.dimension))
        for late in (False, True):
            of = (first > second) == late
            draw = half + 2 * (126 + late)
            xi[of] = pair_variates(
                self.seed, stream, step, draw, first[of], second[of], self.noise, self.dimension
            )
        return xi
