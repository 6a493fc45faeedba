"""Profiles of the force of virtual particles, from a wall into the fluid (Yang's Figure 15)."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sdpd import validation
from sdpd.box import AXES

from .base import Array, Observer

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["WallForceProfile"]

PARTS = ("conservative", "dissipative")


class WallForceProfile(Observer):
    """Mean force of what is behind the walls on a particle, by its distance from one of them.

    Forces of virtual particles (images, a completion, frozen particles) alone, without those of the
    fluid: what holds the particles off the wall and makes them stick to it.

    Parameters
    ----------
    wall : int
        Index of the wall.
    bins : int
        Of equal width, from the wall to a support away from it.
    every : int, optional
        Steps between samples; that of the run if None. A sample costs about two steps.

    Notes
    -----
    Errors are those of independent samples: let the fluid forget in between.

    Examples
    --------
    >>> import sdpd
    >>> box = sdpd.Box((1e-8, 1e-8), periodic="x")
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=box,
    ...     walls=sdpd.walls.slab(box, "y"),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> profile = sdpd.WallForceProfile(wall=0, bins=4, every=10)
    >>> sdpd.Simulation(scene, seed=1).run(steps=40, observe=profile)
    >>> profile.normal("conservative").shape
    (4,)
    """

    may_write: ClassVar[bool] = False

    def __init__(self, *, wall: int, bins: int = 20, every: int | None = None) -> None:
        super().__init__(every=every)
        self.wall = validation.integer("wall", wall, minimum=0)
        self.bins = validation.integer("bins", bins, minimum=1, maximum=10**6)
        self._support = 0.0
        self._dimension = 0
        self._samples: list[Array] = []  # (bins, 1 + parts (1 + D)) sums over particles
        self._steps: list[int] = []

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse a scene without that wall."""
        super().check(sim, every, dt)
        number = len(sim.scene.walls)
        if self.wall >= number:
            raise ValueError(f"`wall` must be the index of one of {number} walls, got {self.wall}")

    def sample(self, sim: Simulation) -> None:
        """Add the present forces."""
        scene = sim.scene
        self._support, self._dimension = scene.support_radius, scene.dimension
        wall, points = scene.walls[self.wall], np.asarray(sim.positions)
        distance = wall.distance(points, scene.box)
        near = (distance >= 0.0) & (distance < self._support)
        normals = wall.normals_at(points[near], scene.box)
        layer = np.minimum((distance[near] / self._support * self.bins).astype(int), self.bins - 1)
        forces = sim.force_parts(walls_only=True)
        columns = [np.ones(len(layer))]
        for part in PARTS:
            force = forces[part][near]
            normal = np.einsum("ij,ij->i", force, normals)
            columns += [normal, *(force - normal[:, None] * normals).T]
        sums = [np.bincount(layer, values, minlength=self.bins) for values in columns]
        self._samples.append(np.stack(sums, axis=1))
        self._steps.append(sim.step)

    def begin(self, sim: Simulation, every: int) -> None:
        """Forget samples later than the state a run begins with: that was restored."""
        kept = sum(taken <= sim.step for taken in self._steps)
        del self._samples[kept:], self._steps[kept:]

    def __len__(self) -> int:
        return len(self._samples)

    @property
    def centers(self) -> Array:
        """Middles of the bins: distances from the wall, (bins,) [length]; after a run."""
        return np.asarray((np.arange(self.bins) + 0.5) * (self._support / self.bins))

    @property
    def counts(self) -> Array:
        """Mean number of particles in each bin, (bins,)."""
        return np.asarray(self._table()[:, :, 0].mean(axis=0))

    def normal(self, part: str) -> Array:
        """Mean force along the normal into the fluid, (bins,) [mass length/time^2].

        Parameters
        ----------
        part : {"conservative", "dissipative"}
        """
        return self._mean(self._column(part))

    def tangential(self, part: str) -> Array:
        """Mean force along the wall, (bins, D) [mass length/time^2]; `part` as for `normal`."""
        first = self._column(part) + 1
        return np.stack([self._mean(first + k) for k in range(self._dimension)], axis=1)

    def error(self, part: str) -> Array:
        """Standard error of the normal force, (bins,) [mass length/time^2]; NaN for one sample."""
        return self._error(self._column(part))

    def tangential_error(self, part: str) -> Array:
        """Standard error of the force along the wall, (bins, D) [mass length/time^2]."""
        first = self._column(part) + 1
        return np.stack([self._error(first + k) for k in range(self._dimension)], axis=1)

    def _table(self) -> Array:
        if not self._samples:
            raise ValueError("a WallForceProfile has no samples before a run")
        return np.stack(self._samples)

    def _column(self, part: str) -> int:
        return 1 + PARTS.index(validation.choice("part", part, PARTS)) * (1 + self._dimension)

    def _mean(self, column: int) -> Array:
        table = self._table()
        count = table[:, :, 0].sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(table[:, :, column].sum(axis=0) / count)

    def _error(self, column: int) -> Array:
        table, mean = self._table(), self._mean(column)
        number, count = len(table), table[:, :, 0]
        if number < 2:
            return np.full(self.bins, np.nan)
        # a quotient of sums: each sample by how far it is from the mean it would have to have
        residual = table[:, :, column] - count * mean
        with np.errstate(invalid="ignore", divide="ignore"):
            spread = np.sqrt((residual**2).sum(axis=0) * number / (number - 1.0))
            return np.asarray(spread / count.sum(axis=0))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the profiles as CSV: distance, particles, and each force with its error."""
        axes = AXES[: self._dimension]
        names, columns = ["distance", "particles"], [self.centers, self.counts]
        for part in PARTS:
            names += [f"{part}_normal", f"{part}_normal_error"]
            columns += [self.normal(part), self.error(part)]
            along, error = self.tangential(part), self.tangential_error(part)
            for k, axis in enumerate(axes):
                names += [f"{part}_{axis}", f"{part}_{axis}_error"]
                columns += [along[:, k], error[:, k]]
        table = np.stack(columns, axis=1)
        np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")

    def __repr__(self) -> str:
        return f"<sdpd.WallForceProfile of wall {self.wall}: {len(self)} samples>"
