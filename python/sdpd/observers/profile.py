"""Profiles in bins, along an axis or from a wall into the fluid, measured in the loop."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpd import validation
from sdpd.box import AXES

from .base import Array, LoopObserver

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Profile"]

GROUPS = 32  # stretches of time behind a standard error, at most


class Profile(LoopObserver):
    """Mean velocity, temperature, density and pressure in bins.

    Parameters
    ----------
    bins : int
        Bins of equal width.
    axis : str, optional
        "x", "y" or "z": along it. Exactly one of `axis` and `wall`.
    wall : int, optional
        Index of a wall of the scene: along the distance from it.
    range : tuple of two float, optional
        Ends of the first and the last bin [length]; by default from end to end of the box or, for
        a wall, five supports.
    samples_per_block : int
        So many samples make a block; means are over blocks and their errors from their spread.
        With 1 every sample is a block of its own, and `series` a movie.
    every : int, optional
        Steps between samples; that of the run if None.

    Notes
    -----
    Only whole blocks count. Errors are those of independent blocks, or of 32 stretches of time
    where there are more: blocks or stretches should be longer than the flow remembers.

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
    >>> profile = sdpd.Profile(axis="y", bins=5, every=2, samples_per_block=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=profile)
    >>> profile.velocity.shape, profile.blocks
    ((5, 2), 2)
    """

    def __init__(
        self,
        *,
        bins: int,
        axis: str | None = None,
        wall: int | None = None,
        range: tuple[float, float] | None = None,  # noqa: A002
        samples_per_block: int = 1,
        every: int | None = None,
    ) -> None:
        super().__init__(every=every)
        self.bins = validation.integer("bins", bins, minimum=1, maximum=10**7)
        if (axis is None) == (wall is None):
            got = "neither" if axis is None else "both"
            raise ValueError(f"exactly one of `axis` and `wall` must be given, got {got}")
        if axis is not None:
            validation.choice("axis", axis, tuple(AXES))
        else:
            wall = validation.integer("wall", wall, minimum=0)
        self.axis, self.wall = axis, wall
        if range is not None:
            low, high = validation.vector("range", range)
            if not low < high:
                raise ValueError(f"`range` must have its ends in order, got {range}")
            range = (low, high)  # noqa: A001
        self.range = range
        self.samples_per_block = validation.integer(
            "samples_per_block", samples_per_block, minimum=1, maximum=validation.LARGEST
        )
        self._scale = 1.0
        self._dimension, self._energy = 0, False

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse a scene without that axis or wall."""
        super().check(sim, every, dt)
        scene = sim.scene
        if self.axis is not None and self.axis not in AXES[: scene.dimension]:
            raise ValueError(
                f"`axis` must be an axis of the box ({AXES[: scene.dimension]!r}), got "
                f"{self.axis!r}"
            )
        if self.wall is not None and self.wall >= len(scene.walls):
            raise ValueError(
                f"`wall` must be the index of one of {len(scene.walls)} walls, got {self.wall}"
            )

    def _attach(self, sim: Simulation, every: int) -> Any:
        scene = sim.scene
        self._dimension = scene.dimension
        self._energy = scene.active_effects.energy
        self._scale = scene.particle_mass / scene.fluid.boltzmann_constant
        if self.axis is not None:
            index = AXES.index(self.axis)
            whole = (0.0, scene.box.lengths[index])
        else:
            assert self.wall is not None
            index, whole = self.wall, (0.0, 5.0 * scene.support_radius)
        if self.range is None:
            self.range = whole
        return sim._core.attach_profile(
            every,
            self.wall is not None,
            index,
            self.range,
            self.bins,
            self.samples_per_block,
        )

    def rewind(self, step: int) -> None:
        """End the segment without the blocks that the failed run completed."""
        self.detach()

    def _rows(self) -> Array:
        tables = self._tables()
        return np.concatenate(tables) if tables else np.zeros((0, 2 + self.bins * self._width))

    def _sums(self) -> Array:
        """(blocks, bins, number of sums)."""
        rows = self._rows()
        return rows[:, 2:].reshape(len(rows), self.bins, self._width)

    @property
    def _width(self) -> int:
        return 3 + 2 * self._dimension + self._energy

    @property
    def names(self) -> tuple[str, ...]:
        """What there are profiles of."""
        own = ("internal_temperature",) if self._energy else ()
        return ("velocity", "temperature", "density", "pressure", *own)

    @property
    def blocks(self) -> int:
        """Number of whole blocks."""
        return len(self._rows())

    @property
    def centers(self) -> Array:
        """Middles of the bins, (bins,) [length]."""
        if self.range is None:
            raise ValueError("`range` is known once the profile has been measured")
        low, high = self.range
        return np.asarray(low + (np.arange(self.bins) + 0.5) * ((high - low) / self.bins))

    @property
    def times(self) -> Array:
        """Time of the last sample of each block, (blocks,) [time]."""
        return np.asarray(self._rows()[:, 0])

    @property
    def counts(self) -> Array:
        """Mean number of particles in each bin, (bins,)."""
        rows = self._rows()
        return np.asarray(self._sums()[:, :, 0].sum(axis=0) / max(1.0, rows[:, 1].sum()))

    def series(self, name: str) -> Array:
        """A profile block by block; NaN where a bin was empty.

        Parameters
        ----------
        name : str
            One of `names`.

        Returns
        -------
        ndarray of float64, shape (blocks, bins) or (blocks, bins, D)
        """
        validation.choice("name", name, self.names)
        return self._quantity(name, self._sums())

    def _quantity(self, name: str, sums: Array) -> Array:
        d = self._dimension
        number = np.where(sums[..., 0] > 0.0, sums[..., 0], np.nan)
        if name == "velocity":
            return np.asarray(sums[..., 1 : 1 + d] / number[..., None])
        if name == "density":
            return np.asarray(sums[..., 1 + 2 * d] / number)
        if name == "pressure":
            return np.asarray(sums[..., 2 + 2 * d] / number)
        if name == "internal_temperature":
            return np.asarray(sums[..., 3 + 2 * d] / number)
        mean = sums[..., 1 : 1 + d] / number[..., None]
        # The mean of all blocks: that of a block would take its own share of the fluctuations.
        if mean.ndim == 3:
            total = sums.sum(axis=0)
            whole = np.where(total[:, 0] > 0.0, total[:, 0], np.nan)
            mean = np.broadcast_to(total[:, 1 : 1 + d] / whole[:, None], mean.shape)
        square = sums[..., 1 + d : 1 + 2 * d] / number[..., None]
        speed = sums[..., 1 : 1 + d] / number[..., None]
        return np.asarray(self._scale * (square - 2.0 * speed * mean + mean**2))

    def _mean(self, name: str) -> Array:
        return self._quantity(name, self._sums().sum(axis=0))

    def error(self, name: str) -> Array:
        """Standard error of the mean of a profile, from its blocks; NaN below two.

        More than 32 blocks are joined to so many stretches of time first, which tell more of what
        the flow remembers; each counts by the particles it has seen in a bin.

        Parameters
        ----------
        name : str
            One of `names`.

        Returns
        -------
        ndarray of float64, shape (bins,) or (bins, D)
        """
        validation.choice("name", name, self.names)
        sums = self._sums()
        groups = min(GROUPS, len(sums))
        starts = np.arange(groups) * len(sums) // max(1, groups)
        sums = np.add.reduceat(sums, starts, axis=0) if groups else np.zeros((1, *sums.shape[1:]))
        series, mean = self._quantity(name, sums), self._mean(name)
        weight = sums[..., 0].reshape(sums.shape[:2] + (1,) * (series.ndim - 2))
        seen = np.sum(weight > 0.0, axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = weight / weight.sum(axis=0)
            square = np.nansum((share * (series - mean)) ** 2, axis=0) * seen / (seen - 1.0)
        return np.asarray(np.where(seen > 1, np.sqrt(np.where(seen > 1, square, 0.0)), np.nan))

    @property
    def velocity(self) -> Array:
        """Mean velocity of the particles in each bin, (bins, D) [length/time]."""
        return self._mean("velocity")

    @property
    def temperature(self) -> Array:
        """m <(v - <v>)^2>/k_B by component, about the mean of the bin, (bins, D) [temperature]."""
        return self._mean("temperature")

    @property
    def internal_temperature(self) -> Array:
        """Mean of the particles' own temperatures, of a fluid with an energy, (bins,)."""
        validation.choice("name", "internal_temperature", self.names)
        return self._mean("internal_temperature")

    @property
    def density(self) -> Array:
        """Mean summed mass density of the particles, (bins,) [mass/length^D]."""
        return self._mean("density")

    @property
    def pressure(self) -> Array:
        """Mean pressure of the equation of state, (bins,) [energy/length^D]."""
        return self._mean("pressure")

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all blocks as CSV, one line for each block and bin."""
        blocks, d = self.blocks, self._dimension
        axes = AXES[:d]
        names = ["time", self.axis or "distance", "particles", *(f"velocity_{a}" for a in axes)]
        columns = [
            np.repeat(self.times, self.bins),
            np.tile(self.centers, blocks),
            (self._sums()[:, :, 0] / self._rows()[:, 1, None]).ravel(),
            *self.series("velocity").reshape(-1, d).T,
        ]
        for name in ("density", "pressure", *self.names[4:]):
            names.append(name)
            columns.append(self.series(name).ravel())
        table = np.stack(columns, axis=1)
        np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")

    def __repr__(self) -> str:
        along = f"along {self.axis}" if self.axis else f"from wall {self.wall}"
        every = self._every or self.every
        return f"<sdpd.Profile {along}, {self.bins} bins, every {every}: {self.blocks} blocks>"
