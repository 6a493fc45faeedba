"""Force and torque of the fluid on each wall, measured in the loop."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd.box import AXES

from .base import Array, LoopObserver

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["WallForces"]


class WallForces(LoopObserver):
    """Mean force and torque on each wall between samples.

    The force is all momentum that a wall has received since the sample before, over the time
    between: pressure, friction, noise and bounces. The momentum of the fluid changes by just that,
    and by the body force.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.

    Notes
    -----
    The general form of friction does not conserve angular momentum: the traction it exerts on a
    wall has dv/dr where that of a viscous fluid has dv/dr - v/r (the part with a). Forces, and the
    torque on a body at rest in a wide fluid, are right; for the torque on a turning body use
    ``Effects(central_friction=True)``.

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
    >>> forces = sdpd.WallForces(every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=forces)
    >>> forces.force.shape
    (4, 2, 2)
    """

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._dimension = 0
        self._areas: list[float] = []

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse a simulation without walls."""
        super().check(sim, every, dt)
        if not sim.scene.walls:
            raise ValueError("`observe` must not hold a WallForces where the scene has no walls")

    def _attach(self, sim: Simulation, every: int) -> Any:
        self._dimension = sim.scene.dimension
        self._areas = [sim.scene.geometry.area(index) for index in range(len(sim.scene.walls))]
        return sim._core.attach_wall_forces(every)

    def rewind(self, step: int) -> None:
        """End the segment without the samples after `step`."""
        self.detach()
        if self._segments:
            last = self._segments[-1]
            self._segments[-1] = last[last[:, 0] <= step]

    def _table(self) -> Array:
        tables = self._tables()
        return np.concatenate(tables) if tables else np.zeros((0, 2 + 6 * len(self._areas)))

    @property
    def step(self) -> NDArray[np.int64]:
        """Steps at the samples, (T,)."""
        return self._table()[:, 0].astype(np.int64)

    @property
    def time(self) -> Array:
        """Times of the samples, (T,) [time]."""
        return np.asarray(self._table()[:, 1])

    def _wrenches(self) -> Array:
        table = self._table()
        return table[:, 2:].reshape(len(table), len(self._areas), 6)

    @property
    def force(self) -> Array:
        """Force on each wall, (T, walls, D) [mass length/time^2]."""
        return np.asarray(self._wrenches()[:, :, : self._dimension])

    @property
    def torque(self) -> Array:
        """Torque about the centre of each wall, (T, walls, 3) [energy]; 0 for planes.

        In two dimensions its third component. Of a cylinder only the one along its axis has a
        meaning.
        """
        return np.asarray(self._wrenches()[:, :, 3:])

    @property
    def stress(self) -> Array:
        """Force over the area of each wall in the box, (T, walls, D) [energy/length^D].

        Of a plane at right angles to an axis: pressure along its normal, shear stress along the
        wall.
        """
        return np.asarray(self.force / np.asarray(self._areas)[:, None])

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all samples as CSV: step, time, and force and torque by wall."""
        walls = len(self._areas)
        names = ["step", "time"]
        for k in range(walls):
            names += [f"force_{axis}_{k}" for axis in AXES] + [f"torque_{a}_{k}" for a in AXES]
        np.savetxt(path, self._table(), delimiter=",", header=",".join(names), comments="")

    def __len__(self) -> int:
        return len(self._table())

    def __repr__(self) -> str:
        return f"<sdpd.WallForces every {self._every or self.every}: {len(self)} samples>"
