"""What a field is made from: the particles at one time, of a simulation, a trajectory or arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation
from sdpd.box import AXES

if TYPE_CHECKING:
    from sdpd.h5md import Frames
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["State"]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """Particles at one time.

    Parameters
    ----------
    positions : array_like, shape (N, D)
        Wrapped or not [length].
    box : Box or array_like, shape (D,)
        The box or its edge lengths [length].
    periodic : sequence of bool, length D, optional
        The periodic axes; those of the box, or all.
    velocities : array_like, shape (N, D), optional
        [length/time].
    mass : float or array_like, shape (N,)
        [mass].
    densities, pressures : array_like, shape (N,), optional
        Of the particles [mass/length^D], [energy/length^D].
    temperatures : array_like, shape (N,), optional
        Of particles with an energy [temperature].
    boltzmann_constant : float
        [energy/temperature].
    si : bool
        Whether units are those of the SI; for labels only.
    time : float
        [time].

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape or is not finite.
    """

    positions: Array
    box: Any
    periodic: tuple[bool, ...] | None = None
    velocities: Array | None = None
    mass: Any = 1.0
    densities: Array | None = None
    pressures: Array | None = None
    temperatures: Array | None = None
    boltzmann_constant: float = 1.0
    si: bool = False
    time: float = 0.0

    def __post_init__(self) -> None:
        points = validation.real_array("positions", self.positions, (None, None))
        count, dimension = points.shape
        if dimension not in (2, 3):
            raise ValueError(f"`positions` must have 2 or 3 columns, got {dimension}")
        lengths = getattr(self.box, "lengths", self.box)
        lengths = lengths.tolist() if isinstance(lengths, np.ndarray) else lengths
        edges = validation.vector("box", lengths, length=dimension)
        for axis, edge in enumerate(edges):
            validation.positive(f"box[{axis}]", edge)
        known = getattr(self.box, "periodic", AXES[:dimension])
        periodic: Sequence[bool] = self.periodic or [axis in known for axis in AXES[:dimension]]
        if len(periodic) != dimension:
            raise ValueError(f"`periodic` must have {dimension} entries, got {len(periodic)}")
        flags = [validation.boolean(f"periodic[{a}]", value) for a, value in enumerate(periodic)]
        given: dict[str, Any] = {"positions": points, "box": edges, "periodic": tuple(flags)}
        for name, shape in (
            ("velocities", (count, dimension)),
            ("densities", (count,)),
            ("pressures", (count,)),
            ("temperatures", (count,)),
        ):
            value = getattr(self, name)
            if value is not None:
                given[name] = validation.real_array(name, value, shape)
        mass = np.asarray(self.mass)
        given["mass"] = validation.real_array("mass", np.broadcast_to(mass, (count,)), (count,))
        for name, value in given.items():
            object.__setattr__(self, name, value)

    @property
    def dimension(self) -> int:
        """D."""
        return int(self.positions.shape[1])

    @classmethod
    def of(cls, sim: Simulation) -> State:
        """The present state of a simulation; its arrays are not copied."""
        fluid = sim.scene.fluid
        return cls(
            positions=sim.positions,
            box=sim.scene.box,
            velocities=sim.velocities,
            mass=sim.scene.particle_mass,
            densities=sim.densities,
            pressures=sim.pressures,
            temperatures=sim.temperatures if sim.scene.active_effects.energy else None,
            boltzmann_constant=fluid.boltzmann_constant,
            si=fluid.is_si,
            time=sim.time,
        )

    @classmethod
    def of_frames(cls, frames: Frames) -> Iterator[State]:
        """The states of a trajectory that `sdpd.h5md.read` returned."""
        from sdpd.scene import Scene

        scene: Scene = Scene.from_toml(frames.scene)

        def row(values: Array | None, index: int) -> ArrayLike | None:
            return None if values is None else values[index]

        for index in range(len(frames)):
            fields: dict[str, Any] = {
                name: row(getattr(frames, name), index)
                for name in ("velocities", "densities", "pressures", "temperatures")
            }
            yield cls(
                positions=frames.positions[index],
                box=scene.box,
                mass=frames.mass,
                boltzmann_constant=scene.fluid.boltzmann_constant,
                si=scene.fluid.is_si,
                time=float(frames.time[index]),
                **fields,
            )
