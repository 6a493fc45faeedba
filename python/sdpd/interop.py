"""States and trajectories for other programs: MDAnalysis and ASE, imported when they are used.

Scenes in SI units (k_B has its SI value) are converted to the units these programs work in:
angstrom and ps (MDAnalysis), angstrom, eV, u and the time unit they imply (ASE). Scenes in other
units keep their numbers. Two-dimensional scenes get z = 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import optional, validation
from sdpd.box import AXES, Box
from sdpd.scene import Scene

if TYPE_CHECKING:
    from ase import Atoms
    from MDAnalysis import Universe

    from sdpd.simulation import Simulation

__all__ = ["InitialState", "box_from_ase", "from_ase", "to_ase", "to_mdanalysis"]

Array = NDArray[np.float64]

_AVOGADRO = 6.02214076e23
# A cell that differs more than this from the box is another box: files round.
_CELL_TOLERANCE = 1e-5


class InitialState(NamedTuple):
    """A state to begin from.

    Attributes
    ----------
    positions : ndarray, shape (N, D)
        [length].
    velocities : ndarray, shape (N, D), or None
        [length/time]; None if the source has none.
    temperatures : ndarray, shape (N,), or None
        Of particles with an energy [temperature]; None if the source has none.
    """

    positions: Array
    velocities: Array | None
    temperatures: Array | None = None


def _three(values: Array, scale: float) -> Array:
    """Scaled vectors with a third component."""
    scaled = np.asarray(values) * scale
    missing = 3 - scaled.shape[-1]
    return np.pad(scaled, [(0, 0)] * (scaled.ndim - 1) + [(0, missing)])


# --- MDAnalysis ------------------------------------------------------------------------------


def _trajectory(name: str, value: ArrayLike, scene: Scene, frames: int | None) -> Array:
    array: Array = validation.real_array(name, value, (frames, scene.n_particles, scene.dimension))
    if len(array) == 0:
        raise ValueError(f"`{name}` must hold at least one frame, got shape {array.shape}")
    return array


def to_mdanalysis(
    sim: Simulation,
    *,
    positions: ArrayLike | None = None,
    velocities: ArrayLike | None = None,
    dt: float | None = None,
) -> Universe:
    """An MDAnalysis Universe of the present state, or of a trajectory of that simulation.

    Parameters
    ----------
    sim : Simulation
        Gives box, masses and ids, and the state if no arrays are given.
    positions, velocities : array_like, shape (T, N, D), optional
        A trajectory [length], [length/time], for instance of `h5md.read`.
    dt : float, optional
        Time between its frames [time]; needed with `positions`.

    Returns
    -------
    MDAnalysis.Universe
        In memory, single precision; lengths in angstrom, times in ps, masses in u, forces in
        kJ/(mol angstrom) if the scene is in SI units, else in the scene's units.

    Raises
    ------
    TypeError, ValueError
        If an array has another shape or is not finite.
    ImportError
        If MDAnalysis is not installed.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> universe = sdpd.Simulation(scene, seed=1).to_mdanalysis()
    >>> universe.dimensions[:3].tolist()
    [100.0, 100.0, 100.0]
    """
    mda = optional.need("MDAnalysis", "io", "for to_mdanalysis()")
    scene = sim.scene
    si = scene.fluid.is_si
    length, speed, moment = (1e10, 1e-2, 1e12) if si else (1.0, 1.0, 1.0)
    fields: dict[str, Any] = {}
    if positions is None:
        if velocities is not None or dt is not None:
            raise ValueError("`positions` must be given with `velocities` or `dt`, got None")
        force = _AVOGADRO * 1e-13 if si else 1.0
        points, speeds = sim.positions[None], sim.velocities[None]
        fields["forces"] = _three(sim.forces[None], force).astype(np.float32)
        between, offset = sim.dt, sim.time
    else:
        points = _trajectory("positions", positions, scene, None)
        speeds = None
        if velocities is not None:
            speeds = _trajectory("velocities", velocities, scene, len(points))
        between, offset = validation.positive("dt", dt), 0.0
    if speeds is not None:
        fields["velocities"] = _three(speeds, speed).astype(np.float32)
    edges = np.full(3, scene.spacing)
    edges[: scene.dimension] = scene.box.lengths
    universe = mda.Universe.empty(sim.n_particles, trajectory=False)
    universe.add_TopologyAttr("ids", sim.ids.astype(np.int64))
    mass = scene.particle_mass * (_AVOGADRO * 1e3 if si else 1.0)
    universe.add_TopologyAttr("masses", np.full(sim.n_particles, mass))
    universe.add_TopologyAttr("types", np.full(sim.n_particles, "sdpd"))
    universe.load_new(
        _three(points, length).astype(np.float32),
        format=mda.coordinates.memory.MemoryReader,
        order="fac",
        dimensions=np.array([*(edges * length), 90.0, 90.0, 90.0], dtype=np.float32),
        dt=between * moment,
        time_offset=offset * moment,
        **fields,
    )
    return universe


# --- ASE -------------------------------------------------------------------------------------


def _ase_units(si: bool) -> tuple[float, float, float]:
    """A length, a velocity and a mass of the scene in ASE's units."""
    if not si:
        return 1.0, 1.0, 1.0
    units = optional.need("ase.units", "io", "for the exchange with ASE")
    return float(units.m), float(units.m / units.s), float(units.kg)


def to_ase(sim: Simulation) -> Atoms:
    """The present state as ASE Atoms.

    Parameters
    ----------
    sim : Simulation

    Returns
    -------
    ase.Atoms
        Symbols "X"; positions, velocities (as momenta), masses and cell in ASE's units if the scene
        is in SI units, else in the scene's. ``atoms.arrays`` holds ``ids``, ``densities`` and
        ``pressures`` and ``atoms.info`` the ``step`` and ``time``, in the scene's units. The
        extended XYZ format keeps all of it (to 8 decimals), ASE's own .traj drops the arrays.

    Raises
    ------
    ImportError
        If ASE is not installed.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> sim = sdpd.Simulation(scene, seed=1)
    >>> atoms = sim.to_ase()
    >>> state = sdpd.interop.from_ase(atoms, scene)
    >>> bool(abs(state.positions - sim.positions).max() < 1e-20)
    True
    """
    ase = optional.need("ase", "io", "for to_ase()")
    scene = sim.scene
    length, speed, mass = _ase_units(scene.fluid.is_si)
    cell, periodic = np.zeros(3), np.zeros(3, dtype=bool)
    cell[: scene.dimension] = np.asarray(scene.box.lengths) * length
    periodic[:] = [axis in scene.box.periodic_axes for axis in AXES]
    atoms = ase.Atoms(
        numbers=np.zeros(sim.n_particles, dtype=int),
        positions=_three(sim.positions, length),
        masses=np.full(sim.n_particles, scene.particle_mass * mass),
        velocities=_three(sim.velocities, speed),
        cell=cell,
        pbc=periodic,
        info={"step": sim.step, "time": sim.time, "dimension": scene.dimension},
    )
    atoms.set_array("ids", sim.ids.astype(np.int64))
    atoms.set_array("densities", sim.densities.copy())
    atoms.set_array("pressures", sim.pressures.copy())
    if scene.active_effects.energy:
        atoms.set_array("temperatures", sim.temperatures.copy())
    return atoms


def _check_atoms(atoms: Any) -> None:
    if not all(hasattr(atoms, name) for name in ("get_positions", "get_velocities", "cell")):
        raise TypeError(f"`atoms` must be ase.Atoms, got {type(atoms).__name__}")


def _edges(atoms: Any) -> Array:
    """Edge lengths of an orthorhombic cell in ASE's units."""
    cell = np.asarray(atoms.cell)
    if np.any(cell != np.diag(np.diagonal(cell))):
        raise ValueError(
            f"`atoms` must have a rectangular cell along the axes, got {cell.tolist()}"
        )
    return np.asarray(np.diagonal(cell))


def box_from_ase(atoms: Atoms, *, si: bool = True) -> Box:
    """The box of ASE Atoms; of two dimensions if the third cell vector is zero.

    Parameters
    ----------
    atoms : ase.Atoms
    si : bool
        Whether the scene to be made is in SI units (the cell then is in angstrom).

    Returns
    -------
    Box

    Raises
    ------
    TypeError, ValueError
        If it is not Atoms or the cell is not rectangular.
    """
    _check_atoms(atoms)
    edges = _edges(atoms) / _ase_units(validation.boolean("si", si))[0]
    dimension = 2 if edges[2] == 0.0 else 3
    return Box(tuple(float(edge) for edge in edges[:dimension]))


def from_ase(atoms: Atoms, scene: Scene) -> InitialState:
    """Positions and velocities of ASE Atoms, to begin a simulation with; see `Simulation`.

    Parameters
    ----------
    atoms : ase.Atoms
        As many as the scene has particles, in a cell like its box.
    scene : Scene

    Returns
    -------
    InitialState
        ``positions``, wrapped into the box, and ``velocities`` in the scene's units; the latter
        None if the Atoms have no momenta.

    Raises
    ------
    TypeError, ValueError
        If number or cell differ from those of the scene or a value is not finite.
    """
    _check_atoms(atoms)
    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    from sdpd import initial

    length, speed, _ = _ase_units(scene.fluid.is_si)
    dimension = scene.dimension
    if len(atoms) != scene.n_particles:
        raise ValueError(
            f"`atoms` must be as many as the scene has particles, {scene.n_particles}, got "
            f"{len(atoms)}"
        )
    edges = _edges(atoms) / length
    for axis, edge, expected in zip(AXES, edges, scene.box.lengths, strict=False):
        if abs(edge - expected) > _CELL_TOLERANCE * expected:
            raise ValueError(
                f"`atoms` must have the cell of the scene's box, {expected:g} along {axis}, got "
                f"{edge:g}"
            )
    points = initial.check_positions(scene, atoms.get_positions()[:, :dimension] / length)
    heat = None
    if scene.active_effects.energy and atoms.has("temperatures"):
        heat = initial.check_temperatures(scene, atoms.get_array("temperatures"))
    if not atoms.has("momenta"):
        return InitialState(points, None, heat)
    speeds = initial.check_velocities(scene, atoms.get_velocities()[:, :dimension] / speed)
    return InitialState(points, speeds, heat)
