"""Walls by images, over all pairs, written from the equations.

r_iJ^2 = r_ij^2 + 4 phi_i phi_j, w_ij = psi_i psi_j, psi = 1 + K h p(phi/h); an image over several
walls at right angles has the sum and the product over them. It moves with -v_j (relative to the
walls) where their number is odd, with +v_j where it is even. U = sum_i m e(d_i) with the images in
d_i; friction a I + b Ebar with Ebar the mean of e e and the same seen from the other end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .kernels import force_factor, kernel_value
from .noise import pair_variates
from .system import Forces, Indices, System

Array = NDArray[np.float64]
NO_EDGE = 1e300  # of an axis that is not periodic


class Stand(NamedTuple):
    """Where particles stand to a wall: distance (N,), normal, velocity of the wall (N, D)."""

    distance: Array
    normal: Array
    velocity: Array


@dataclass(frozen=True)
class Plane:
    """Through a point, with the normal into the fluid, sliding."""

    point: Array
    normal: Array
    velocity: Array

    curvature = 0.0

    def stand(self, positions: Array, box: Array) -> Stand:
        n = np.broadcast_to(self.normal, positions.shape)
        distance = (positions - self.point) @ self.normal
        return Stand(distance, n, np.broadcast_to(self.velocity, positions.shape))


@dataclass(frozen=True)
class Round:
    """A cylinder along `axis` (a circle in two dimensions: 2) or a sphere; side +1: outside."""

    centre: Array
    radius: float
    side: float
    axis: int | None
    velocity: Array
    spin: Array  # three components

    @property
    def curvature(self) -> float:
        return -self.side * (2.0 if self.axis is None else 1.0) / self.radius

    def stand(self, positions: Array, box: Array) -> Stand:
        r = positions - self.centre
        r = r - box * np.rint(r / box)
        dimension = positions.shape[1]
        if self.axis is not None and self.axis < dimension:
            r[:, self.axis] = 0.0
        length = np.sqrt(np.sum(r**2, axis=1))
        out = r / length[:, None]
        foot = np.zeros((len(r), 3))
        foot[:, :dimension] = self.radius * out
        turning = np.cross(self.spin, foot)[:, :dimension]
        return Stand(self.side * (length - self.radius), self.side * out, self.velocity + turning)


@dataclass(frozen=True)
class Shaped:
    """A wall of any shape: phi, psi and their gradients are given functions of space."""

    field: Any  # evaluate(points) -> phi (N,), gradient (N, D), psi (N,), gradient (N, D)
    centre: Array
    velocity: Array
    spin: Array  # three components

    curvature = 0.0

    def stand(self, positions: Array, box: Array) -> Stand:
        phi, gradient, _, _ = self.field.evaluate(positions)
        arm = positions - self.centre
        arm = arm - box * np.rint(arm / box)
        foot = np.zeros((len(arm), 3))
        square = np.sum(gradient**2, axis=1)
        foot[:, : arm.shape[1]] = arm - (phi / square)[:, None] * gradient
        turning = np.cross(self.spin, foot)[:, : arm.shape[1]]
        return Stand(phi, gradient, self.velocity + turning)


Wall = Plane | Round | Shaped
Weight = Callable[[Array], tuple[Array, Array]]


class Links(NamedTuple):
    """Links to images over one set of walls: from i to the image of j, i == j included."""

    i: Indices
    j: Indices
    walls: tuple[int, ...]
    label: int
    vector: Array  # r_ij
    distance: Array  # r_iJ
    weight: Array  # w_ij


@dataclass(frozen=True)
class WallSystem(System):
    """A `System` with walls; `images` are the sets of walls, in the order of their labels."""

    walls: tuple[Wall, ...] = ()
    images: tuple[tuple[int, ...], ...] = ()
    weight: Weight | None = None

    @cached_property
    def stands(self) -> list[Stand]:
        return [wall.stand(self.positions, self.box) for wall in self.walls]

    @cached_property
    def psi(self) -> list[tuple[Array, Array]]:
        """psi and its gradient, (N,) and (N, D), of each wall."""
        result = []
        for wall, stand in zip(self.walls, self.stands, strict=True):
            if isinstance(wall, Shaped):
                _, _, psi, climb = wall.field.evaluate(self.positions)
                result.append((psi, climb))
                continue
            one, none = np.ones(self.size), np.zeros_like(self.positions)
            if wall.curvature == 0.0:
                result.append((one, none))
                continue
            assert self.weight is not None
            p, slope = self.weight(stand.distance / self.support)
            k = wall.curvature
            result.append((one + k * self.support * p, k * slope[:, None] * stand.normal))
        return result

    @cached_property
    def links(self) -> list[Links]:
        i, j = np.triu_indices(self.size)  # with the diagonal: own images
        pairs = self.geometry(i, j)
        found = []
        for index, walls in enumerate(self.images):
            square, weight = pairs.distance**2, np.ones(len(i))
            for w in walls:
                phi, psi = self.stands[w].distance, self.psi[w][0]
                square = square + 4.0 * phi[i] * phi[j]
                weight = weight * psi[i] * psi[j]
            near = square < self.support**2
            found.append(
                Links(
                    i[near],
                    j[near],
                    walls,
                    index + 1,
                    pairs.vector[near],
                    np.sqrt(square[near]),
                    weight[near],
                )
            )
        return found

    @cached_property
    def number_densities(self) -> Array:
        total = np.array(System.number_densities.func(self))  # type: ignore[attr-defined]
        for link in self.links:
            w = link.weight * kernel_value(self.kernel, self.dimension, link.distance, self.support)
            np.add.at(total, link.i, w)
            other = link.i != link.j
            np.add.at(total, link.j[other], w[other])
        return total

    # --- forces ------------------------------------------------------------------------------

    def image_conservative(self) -> Array:
        """-dU/dr of what the images add, by the chain rule in phi and psi (grad phi = n)."""
        share = self.pressures / self.number_densities**2
        total = np.zeros_like(self.positions)
        for link in self.links:
            i, j = link.i, link.j
            w = kernel_value(self.kernel, self.dimension, link.distance, self.support)
            f = force_factor(self.kernel, self.dimension, link.distance, self.support)
            # U depends on W(r_iJ) w_ij through d_i and d_j (once through d_i for an own image)
            both = np.where(i == j, share[i], share[i] + share[j])
            # dW = -F r dr, r dr = r_ij.dr_ij + 2 (phi_i dphi_j + phi_j dphi_i)
            radial = both * link.weight * f
            np.add.at(total, i, radial[:, None] * link.vector)
            np.add.at(total, j, -radial[:, None] * link.vector)
            for wall in link.walls:
                stand, (psi, climb) = self.stands[wall], self.psi[wall]
                for a, b in ((i, j), (j, i)):
                    push = 2.0 * radial * stand.distance[b]
                    lift = -both * w * link.weight / psi[a]
                    force = push[:, None] * stand.normal[a] + lift[:, None] * climb[a]
                    np.add.at(total, a, force)
        return total

    def directions(self, link: Links) -> tuple[Array, Array, Array, Array]:
        """e_n and e_t of each link, unit vectors (0 if none) and their squared weights."""
        across, tangent = np.zeros_like(link.vector), np.array(link.vector)
        for wall in link.walls:
            stand = self.stands[wall]
            n = stand.normal[link.i] + stand.normal[link.j]
            straight = n / np.sqrt(np.sum(n**2, axis=1))[:, None]
            if any(isinstance(self.walls[w], Shaped) for w in link.walls):
                # nothing is left where the wall faces itself
                n = np.where((link.i == link.j)[:, None], straight, 0.5 * n)
            else:
                n = straight
            height = stand.distance[link.i] + stand.distance[link.j]
            across += height[:, None] * n
            tangent -= np.sum(link.vector * n, axis=1)[:, None] * n
        square = np.minimum(1.0, np.sum(across**2, axis=1) / link.distance**2)

        def unit(x: Array) -> Array:
            length = np.sqrt(np.sum(x**2, axis=1))
            far = length > 1e-12 * self.support
            return np.where(far[:, None], x / np.where(far, length, 1.0)[:, None], 0.0)

        along = unit(across)
        tangent -= np.sum(tangent * along, axis=1)[:, None] * along
        return along, square, unit(tangent), 1.0 - square

    def wall_velocity(self, link: Links) -> Array:
        """Mean of the walls' velocities at both feet."""
        total = np.zeros_like(link.vector)
        for wall in link.walls:
            v = self.stands[wall].velocity
            total += v[link.i] + v[link.j]
        return total / (2 * len(link.walls))

    def blocks(self, link: Links, function: Callable[[Array], Array]) -> Array:
        """function(a I + b Ebar) of each link (n, D, D)."""
        a, b = self.across_along
        n, n2, t, t2 = self.directions(link)

        def part(square: Array) -> Array:
            return (function(a + b * square) - function(np.full_like(square, a)))[:, None, None]

        identity = function(np.full_like(n2, a))[:, None, None] * np.eye(self.dimension)
        return (
            identity
            + part(n2) * n[:, :, None] * n[:, None, :]
            + part(t2) * t[:, :, None] * t[:, None, :]
        )

    def link_coupling(self, link: Links) -> Array:
        d = self.number_densities
        f = force_factor(self.kernel, self.dimension, link.distance, self.support)
        return link.weight * f / (d[link.i] * d[link.j])

    def scatter(self, link: Links, force: Array) -> Array:
        """Force of a link on both ends: the same for odd images, opposite for even ones."""
        total = np.zeros_like(self.positions)
        odd, own = len(link.walls) % 2 == 1, (link.i == link.j)[:, None]
        np.add.at(total, link.i, np.where(own & (not odd), 0.0, force))
        np.add.at(total, link.j, np.where(own, 0.0, force if odd else -force))
        return total

    def image_dissipative(self) -> Array:
        total = np.zeros_like(self.positions)
        for link in self.links:
            v = self.velocities
            if len(link.walls) % 2:
                # own image: 2 (v - v_w) = v_i + v_i - 2 v_w, as for any link
                u = v[link.i] + v[link.j] - 2.0 * self.wall_velocity(link)
            else:
                u = v[link.i] - v[link.j]
            g = self.link_coupling(link)[:, None]
            force = -g * np.einsum("nab,nb->na", self.blocks(link, lambda x: x), u)
            total += self.scatter(link, force)
        return total

    def image_variates(self, link: Links, step: int, stream: str, half: int) -> Array:
        ids = self.particle_ids
        a, b = ids[link.i], ids[link.j]
        draw = half + 2 * link.label
        xi = pair_variates(self.seed, stream, step, draw, a, b, self.noise, self.dimension)
        if len(link.walls) % 2 == 0:
            xi = np.where(a < b, 1.0, -1.0)[:, None] * xi
        return xi

    def image_random(self, step: int) -> Array:
        total = np.zeros_like(self.positions)
        if self.noise == "none" or self.friction == "none":
            return total
        for link in self.links:
            # variance 2 kT g (...) dt of a link, twice that of an own image
            twice = np.where(link.i == link.j, 2.0, 1.0)
            strength = np.sqrt(
                twice * 2.0 * self.thermal_energy * self.link_coupling(link) / self.dt
            )
            xi = self.image_variates(link, step, "pair_force", 0)
            root = self.blocks(link, lambda x: np.sqrt(np.maximum(x, 0.0)))
            total += self.scatter(link, strength[:, None] * np.einsum("nab,nb->na", root, xi))
        return total

    def forces(self, step: int = 0) -> Forces:
        direct = super().forces(step)
        return Forces(
            direct.conservative + self.image_conservative(),
            direct.dissipative + self.image_dissipative(),
            direct.random + self.image_random(step),
        )

    def friction_matrix(self) -> Array:
        """Gamma (N D, N D) with images; f = -Gamma v for walls at rest."""
        n, dim = self.size, self.dimension
        matrix = super().friction_matrix().reshape(n, dim, n, dim).transpose(0, 2, 1, 3).copy()
        for link in self.links:
            block = self.link_coupling(link)[:, None, None] * self.blocks(link, lambda x: x)
            own = link.i == link.j
            if len(link.walls) % 2:
                np.add.at(matrix, (link.i[own], link.i[own]), 2.0 * block[own])
                sign = 1.0
            else:
                sign = -1.0
            i, j, block = link.i[~own], link.j[~own], block[~own]
            np.add.at(matrix, (i, i), block)
            np.add.at(matrix, (j, j), block)
            np.add.at(matrix, (i, j), sign * block)
            np.add.at(matrix, (j, i), sign * block)
        return matrix.transpose(0, 2, 1, 3).reshape(n * dim, n * dim)

    def bounced(self) -> WallSystem:
        """What has crossed a wall is reflected, in position and in velocity to the wall."""
        system = self
        for _ in range(3):
            for index in range(len(self.walls)):
                stand = system.stands[index]
                # a given phi is a distance to first order only
                length = np.sqrt(np.sum(stand.normal**2, axis=1))
                if not isinstance(self.walls[index], Shaped):
                    length = np.ones_like(length)
                stand = Stand(
                    stand.distance / length, stand.normal / length[:, None], stand.velocity
                )
                out = np.minimum(stand.distance, 0.0)
                relative = np.sum((system.velocities - stand.velocity) * stand.normal, axis=1)
                turn = np.where(out < 0.0, np.minimum(relative, 0.0), 0.0)
                system = system.at(  # type: ignore[assignment]
                    positions=system.positions - 2.0 * out[:, None] * stand.normal,
                    velocities=system.velocities - 2.0 * turn[:, None] * stand.normal,
                )
        return system

    # --- the exact exchange ------------------------------------------------------------------

    def exchanged(
        self, links: NDArray[np.int64], step: int, half: int, time: float, backward: bool
    ) -> WallSystem:
        """Links (i, j, label) one after the other, own images last; backward from the end."""
        tables = {link.label: self._table(link, step, half, time) for link in self.links}
        v = np.array(self.velocities)
        order = [tuple(map(int, row)) for row in links]
        odd_labels = [link.label for link in self.links if len(link.walls) % 2]
        own = [(i, i, label) for i in range(self.size) for label in odd_labels]
        for i, j, label in (order + own)[:: -1 if backward else 1]:
            entry = tables[label].get((min(i, j), max(i, j)))
            if entry is None:
                continue
            decay, kick, wall, odd = entry
            if i == j:
                v[i] += decay @ (v[i] - wall) + kick
            elif odd:
                change = decay @ (v[i] + v[j] - 2.0 * wall) + kick
                v[i] += 0.5 * change
                v[j] += 0.5 * change
            else:
                first, second = min(i, j), max(i, j)
                change = decay @ (v[first] - v[second]) + kick
                v[first] += 0.5 * change
                v[second] -= 0.5 * change
        return self.at(velocities=v)  # type: ignore[return-value]

    def _table(
        self, link: Links, step: int, half: int, time: float
    ) -> dict[tuple[int, int], tuple[Array, Array, Array, bool]]:
        g = self.link_coupling(link)
        rate = 2.0 * g * time / self.mass
        decay = self.blocks(link, lambda x: np.expm1(-rate * x))
        own = link.i == link.j
        variance = np.where(own, 1.0, 2.0) * self.thermal_energy / self.mass
        root = self.blocks(link, lambda x: np.sqrt(variance * -np.expm1(-2.0 * rate * x)))
        kick = np.zeros_like(link.vector)
        if self.noise != "none":
            xi = self.image_variates(link, step, "pair_exchange", half)
            kick = np.einsum("nab,nb->na", root, xi)
        wall, odd = self.wall_velocity(link), len(link.walls) % 2 == 1
        keys = zip(link.i.tolist(), link.j.tolist(), strict=True)
        return {key: (decay[k], kick[k], wall[k], odd) for k, key in enumerate(keys)}


def solve_curvature_weight(kernel: str, dimension: int, points: int = 400) -> tuple[Array, Array]:
    """s and p(s) of psi = 1 + K h p(phi/h), by damped iteration on a uniform grid.

    p(s) M(s) + int w1(s + s') p(s') ds' = int s' w1(s + s') ds', with the trapezoidal rule for
    everything (all integrands vanish smoothly at the end).
    """
    s = np.linspace(0.0, 1.0, points + 1)
    fine = np.linspace(0.0, 1.0, 4 * points + 1)
    w1 = np.zeros(points + 1)
    for k, z in enumerate(s[:-1]):
        q = fine * np.sqrt(1.0 - z * z)
        value = kernel_value(kernel, dimension, np.sqrt(z * z + q * q), 1.0)
        w1[k] = np.trapezoid(value * (2.0 * np.pi * q if dimension == 3 else 2.0), q)
    index = np.arange(points + 1)
    table = np.where(index[:, None] + index <= points, 1.0, 0.0)
    w = table * w1[np.minimum(index[:, None] + index, points)]
    w[:, 0] *= 0.5
    mass = w.sum(axis=1)
    solvable = mass > 1e-14 * mass[0]
    mean = w[solvable] / mass[solvable, None]
    p = np.zeros(points + 1)
    for _ in range(200):
        new = mean @ (s - p)
        p[solvable] = 0.5 * (p[solvable] + new)
    return s[solvable], p[solvable]
