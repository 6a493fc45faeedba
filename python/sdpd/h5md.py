"""Trajectories in H5MD, the HDF5 layout of de Buyl et al. 2014, which MDAnalysis opens.

Particles are in ``/particles/trajectory`` (positions, images, velocities, box, by choice forces,
densities and pressures), box averages in ``/observables``. MDAnalysis wants three dimensions: files
of 2D scenes have z = 0 and a layer one spacing thick.

Scenes in SI units are written in nm, ps, nm/ps, kJ/(mol nm), with unit attributes: the H5MD units
that MDAnalysis knows, and ``MDAnalysis.Universe("water.h5md")`` opens them (by this extension).
Scenes in other units are written as they are, without unit attributes; open those with
``MDAnalysis.Universe(path, convert_units=False, n_atoms=N)``. `read` gives back the scene's units.

References: P. de Buyl, P. H. Colberg, F. Hoefling, Comput. Phys. Commun. 185 (2014) 1546;
https://nongnu.org/h5md/h5md.html
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import optional, validation
from sdpd.box import AXES
from sdpd.observers import Observer

if TYPE_CHECKING:
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["Frames", "Trajectory", "read"]

Array = NDArray[np.float64]

GROUP = "particles/trajectory"  # the name from which MDAnalysis guesses the number of particles
_PRECISIONS = {"float32": np.float32, "float64": np.float64}
_AVOGADRO = 6.02214076e23
_CHUNK_BYTES = 2**16
_LARGEST_ATTRIBUTE = 60_000  # bytes; HDF5 holds no longer ones beside an object


@dataclass(frozen=True)
class _Kind:
    """How one quantity is stored: its unit where the scene is in the SI, and that unit's worth."""

    unit: str | None
    per_si: float
    rank: int  # 1: a vector for each particle, 0: a number


_KINDS = {
    "position": _Kind("nm", 1e9, 1),
    "velocity": _Kind("nm ps-1", 1e-3, 1),
    "force": _Kind("kJ mol-1 nm-1", _AVOGADRO * 1e-12, 1),
    "density": _Kind("kg m-3", 1.0, 0),
    "pressure": _Kind("Pa", 1.0, 0),
    "temperature": _Kind("K", 1.0, 0),
    "time": _Kind("ps", 1e12, 0),
}
# /observables: name -> unit in the SI.
_OBSERVABLES = {
    "temperature": "K",
    "potential_energy": "J",
    "internal_energy": "J",
    "kinetic_energy": "J",
}


def _observables(sim: Simulation) -> list[str]:
    absent = "potential_energy" if sim.scene.active_effects.energy else "internal_energy"
    return [name for name in _OBSERVABLES if name != absent]


class Trajectory(Observer):
    """Writes frames of a running simulation to an H5MD file.

    Parameters
    ----------
    path : path
        The file is made by the first run; that and later runs of the same simulation append.
    every : int, optional
        Steps between frames; that of the run if None. The first frame is the state in which the
        first run begins, if its step is a multiple.
    velocities, forces, densities, pressures : bool
        What to store beside positions and images (and, of a fluid with an energy, the temperatures
        of the particles).
    precision : {"float32", "float64"}
        Of positions, velocities and forces. In single precision positions are good to 6e-8 of the
        box.
    compression : int, optional
        Of zlib, 1 (fast) to 9; None stores plainly.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    FileExistsError
        If the file exists and `overwrite` is False.
    ImportError
        If h5py is not installed.

    Notes
    -----
    The file is closed between runs and flushed after each frame, so it can be read while the
    simulation lives, and holds whole frames only.

    Examples
    --------
    >>> import os, tempfile
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> sim = sdpd.Simulation(scene, seed=1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "water.h5md")
    ...     sim.run(steps=20, observe=sdpd.Trajectory(path, every=10))
    ...     frames = sdpd.h5md.read(path)
    >>> frames.step.tolist(), frames.positions.shape
    ([0, 10, 20], (3, 100, 2))
    """

    may_write: ClassVar[bool] = False

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        every: int | None = None,
        velocities: bool = True,
        forces: bool = False,
        densities: bool = True,
        pressures: bool = False,
        precision: str = "float32",
        compression: int | None = None,
        overwrite: bool = False,
    ) -> None:
        super().__init__(every=every)
        self.path = Path(path)
        chosen = {
            "velocity": validation.boolean("velocities", velocities),
            "force": validation.boolean("forces", forces),
            "density": validation.boolean("densities", densities),
            "pressure": validation.boolean("pressures", pressures),
        }
        self._stored = ("position", *(name for name, wanted in chosen.items() if wanted))
        self._type = _PRECISIONS[validation.choice("precision", precision, list(_PRECISIONS))]
        self._compression = compression
        if compression is not None:
            self._compression = validation.integer("compression", compression, minimum=1)
            if self._compression > 9:
                raise ValueError(f"`compression` must be 1 to 9, got {self._compression}")
        self._overwrite = validation.boolean("overwrite", overwrite)
        if self.path.exists() and not self._overwrite:
            raise FileExistsError(
                f"{self.path} exists; choose another path or overwrite=True (a Trajectory goes on "
                "over several runs, but does not append to the file of an earlier one)"
            )
        optional.need("h5py", "io", "to write H5MD trajectories")
        self._file: Any = None
        self._created = False
        self._si = False
        self._frames = 0

    @property
    def frames(self) -> int:
        """Frames written."""
        return self._frames

    def __len__(self) -> int:
        return self._frames

    def begin(self, sim: Simulation, every: int) -> None:
        """Open the file; at first write the state in which the run begins, if it is due."""
        import h5py

        if self._created:
            self._file = h5py.File(self.path, "r+")
            self._trim(sim.step)
        else:
            self._file = h5py.File(self.path, "w" if self._overwrite else "x")
            self._created = True
            self._create(sim)
        if self._frames == 0 and sim.step % every == 0:
            self.sample(sim)

    def end(self, sim: Simulation) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    # --- layout ------------------------------------------------------------------------------

    def _create(self, sim: Simulation) -> None:
        import sdpd

        file, scene = self._file, sim.scene
        root = file.create_group("h5md")
        root.attrs["version"] = np.array([1, 1])
        root.create_group("author").attrs["name"] = "unknown"
        creator = root.create_group("creator")
        creator.attrs["name"], creator.attrs["version"] = "sdpd", sdpd.__version__
        notes = file.create_group("parameters/sdpd")
        _write_scene(notes, scene)
        notes.attrs["seed"] = np.uint64(sim.seed)
        notes.attrs["dimension"] = scene.dimension
        notes.attrs["si"] = scene.fluid.is_si
        self._si = scene.fluid.is_si
        if scene.active_effects.energy:
            self._stored = (*self._stored, "temperature")
        group = file.create_group(GROUP)
        for name in self._stored:
            self._create_element(group, name, sim)
        self._create_image(group, sim)
        self._create_box(group, sim)
        self._create_constants(group, sim)
        self._create_observables(sim)

    def _worth(self, name: str) -> float:
        return _KINDS[name].per_si if self._si else 1.0

    def _label(self, dataset: Any, unit: str | None) -> None:
        if self._si and unit is not None:
            dataset.attrs["unit"] = unit

    def _dataset(self, group: Any, name: str, tail: tuple[int, ...], kind: Any) -> Any:
        row = int(np.prod(tail, dtype=int)) * np.dtype(kind).itemsize
        rows = max(1, min(1024, _CHUNK_BYTES // row))
        options: dict[str, Any] = {}
        if self._compression is not None and tail:
            options = {"compression": "gzip", "compression_opts": self._compression}
        return group.create_dataset(
            name,
            shape=(0, *tail),
            maxshape=(None, *tail),
            dtype=kind,
            chunks=(rows, *tail),
            **options,
        )

    def _share_steps(self, element: Any) -> None:
        """Every element has step and time; all are hard links to the same two datasets."""
        group = self._file[GROUP]
        if "step" in group.get("position", ()):
            element["step"], element["time"] = group["position/step"], group["position/time"]
            return
        self._dataset(element, "step", (), np.int64)
        self._label(self._dataset(element, "time", (), np.float64), _KINDS["time"].unit)

    def _create_element(self, group: Any, name: str, sim: Simulation) -> None:
        kind, scene = _KINDS[name], sim.scene
        element = group.create_group(name)
        tail = (scene.n_particles, 3) if kind.rank else (scene.n_particles,)
        unit = kind.unit
        if scene.dimension == 2 and name in ("density", "pressure"):
            unit = {"density": "kg m-2", "pressure": "N m-1"}[name]
        self._label(self._dataset(element, "value", tail, self._type), unit)
        self._share_steps(element)

    def _create_image(self, group: Any, sim: Simulation) -> None:
        element = group.create_group("image")
        self._dataset(element, "value", (sim.n_particles, 3), np.int32)
        self._share_steps(element)

    def _create_box(self, group: Any, sim: Simulation) -> None:
        box = group.create_group("box")
        box.attrs["dimension"] = 3
        turns = sim.scene.box.periodic_axes
        periodic = ["periodic" if axis in turns else "none" for axis in AXES]
        box.attrs["boundary"] = np.array(periodic, dtype="S8")
        edges = box.create_group("edges")
        self._label(self._dataset(edges, "value", (3,), np.float64), "nm")
        self._share_steps(edges)

    def _create_constants(self, group: Any, sim: Simulation) -> None:
        group["id"] = sim.ids.copy()
        group["species"] = np.zeros(sim.n_particles, dtype=np.int32)
        mass = np.full(sim.n_particles, sim.scene.particle_mass)
        group["mass"] = mass * (_AVOGADRO * 1e3 if self._si else 1.0)
        self._label(group["mass"], "u")

    def _create_observables(self, sim: Simulation) -> None:
        observables = self._file.create_group("observables")
        for name in _observables(sim):
            element = observables.create_group(name)
            self._label(self._dataset(element, "value", (), np.float64), _OBSERVABLES[name])
            self._share_steps(element)
        # MDAnalysis shows what is below /observables in ts.data
        for name in ("density", "pressure"):
            if name in self._stored:
                observables[name] = self._file[f"{GROUP}/{name}"]

    # --- frames ------------------------------------------------------------------------------

    def _elements(self) -> list[Any]:
        """Every group with step, time and value, once."""
        group, observables = self._file[GROUP], self._file["observables"]
        elements = [group[name] for name in (*self._stored, "image")]
        present = [observables[name] for name in _OBSERVABLES if name in observables]
        return [*elements, group["box/edges"], *present]

    def _trim(self, step: int) -> None:
        """Cut off what an interrupted frame left, and frames later than a restored simulation."""
        group = self._file[GROUP]
        steps = group["position/step"][: self._frames]
        self._frames = int(np.searchsorted(steps, step, side="right"))
        for element in self._elements():
            element["value"].resize(self._frames, axis=0)
        for name in ("step", "time"):
            group[f"position/{name}"].resize(self._frames, axis=0)

    def sample(self, sim: Simulation) -> None:
        """Append the present state."""
        group, scene = self._file[GROUP], sim.scene
        sources = {
            "position": sim.positions,
            "velocity": sim.velocities,
            "force": sim.forces,
            "density": sim.densities,
            "pressure": sim.pressures,
        }
        if "temperature" in self._stored:
            sources["temperature"] = sim.temperatures
        for name in self._stored:
            self._append(group[name]["value"], _three(sources[name] * self._worth(name)))
        self._append(group["image/value"], _three(sim.images))
        edges = np.full(3, scene.spacing)
        edges[: scene.dimension] = scene.box.lengths
        self._append(group["box/edges/value"], edges * self._worth("position"))
        for name in _observables(sim):
            self._append(self._file[f"observables/{name}/value"], getattr(sim, name))
        # step and time come last: a frame without them does not count
        self._append(group["position/time"], sim.time * self._worth("time"))
        self._append(group["position/step"], sim.step)
        self._frames += 1
        self._file.flush()

    def _append(self, dataset: Any, value: Any) -> None:
        dataset.resize(self._frames + 1, axis=0)
        dataset[self._frames] = value

    def __repr__(self) -> str:
        return f"<sdpd.Trajectory {str(self.path)!r}: {self._frames} frames>"


def _three(values: NDArray[Any]) -> NDArray[Any]:
    """Vectors with a third component, numbers as they are."""
    if values.ndim == 1 or values.shape[1] == 3:
        return values
    return np.pad(values, ((0, 0), (0, 1)))


@dataclass(frozen=True, eq=False)
class Frames:
    """A trajectory in memory, in the units of its scene; T frames of N particles.

    Its arrays are what :mod:`sdpd.analysis` takes, e.g. ``analysis.msd(frames.unwrapped, frames.dt,
    max_lag=100)`` or ``analysis.structure_factor(frames.positions, frames.box, ...)``.

    Attributes
    ----------
    step : ndarray of int64, shape (T,)
    time : ndarray, shape (T,)
        [time].
    box : ndarray, shape (D,)
        Edge lengths [length].
    positions : ndarray, shape (T, N, D)
        Inside the box [length].
    unwrapped : ndarray, shape (T, N, D)
        Positions that went on through the boundaries [length].
    velocities, forces : ndarray, shape (T, N, D), or None
        [length/time], [mass length/time^2].
    densities, pressures : ndarray, shape (T, N), or None
        [mass/length^D], [energy/length^D].
    temperatures : ndarray, shape (T, N), or None
        Of particles with an energy [temperature].
    mass : ndarray, shape (N,)
        [mass].
    scene : str
        TOML of the scene, for ``sdpd.Scene.from_toml``.
    """

    step: NDArray[np.int64]
    time: Array
    box: Array
    positions: Array
    unwrapped: Array
    velocities: Array | None
    forces: Array | None
    densities: Array | None
    pressures: Array | None
    mass: Array
    scene: str
    temperatures: Array | None = None

    def __len__(self) -> int:
        return len(self.step)

    @property
    def dt(self) -> float:
        """Time between frames [time], as :mod:`sdpd.analysis` wants it.

        Raises
        ------
        ValueError
            If there are fewer than two frames or they are not equally spaced.
        """
        spacing = np.diff(self.time)
        if not spacing.size:
            raise ValueError(f"`dt` needs at least 2 frames, got {len(self)}")
        if not np.allclose(spacing, spacing[0], rtol=1e-6, atol=0.0):
            raise ValueError(
                f"`dt` needs equally spaced frames, got spacings from {spacing.min():.6g} to "
                f"{spacing.max():.6g}"
            )
        return float((self.time[-1] - self.time[0]) / spacing.size)


def _write_scene(notes: Any, scene: Scene) -> None:
    """TOML of the scene, or where it has none (a wall given by a function) what it prints."""
    try:
        text = scene.to_toml()
    except TypeError:
        text = str(scene)
    if len(text.encode()) < _LARGEST_ATTRIBUTE:
        notes.attrs["scene"] = text
    else:  # with a mesh of triangles
        notes.create_dataset("scene", data=text)


def _read_scene(notes: Any) -> str:
    if "scene" in notes:
        return str(notes["scene"].asstr()[()])
    return str(notes.attrs["scene"])


def read(path: str | os.PathLike[str]) -> Frames:
    """Read a trajectory that `Trajectory` wrote into memory.

    Parameters
    ----------
    path : path

    Returns
    -------
    Frames
        In the units of the scene.

    Raises
    ------
    ValueError
        If the file is not an H5MD file of this package.
    OSError
        If it cannot be opened or is no HDF5 file.
    """
    h5py = optional.need("h5py", "io", "to read H5MD trajectories")
    with h5py.File(path, "r") as file:
        if "parameters/sdpd" not in file or GROUP not in file:
            raise ValueError(f"`path` must be an H5MD file written by sdpd, got {str(path)!r}")
        notes, group = file["parameters/sdpd"].attrs, file[GROUP]
        dimension, si = int(notes["dimension"]), bool(notes["si"])
        number = len(group["position/step"])

        def values(name: str) -> Array | None:
            if name not in group:
                return None
            worth = _KINDS[name].per_si if si else 1.0
            stored = group[name]["value"][:number].astype(np.float64) / worth
            return np.asarray(stored[..., :dimension] if _KINDS[name].rank else stored)

        length, moment = (_KINDS[k].per_si if si else 1.0 for k in ("position", "time"))
        positions = values("position")
        assert positions is not None
        box = np.asarray(group["box/edges/value"][0, :dimension]) / length
        images = group["image/value"][:number, :, :dimension]
        return Frames(
            step=group["position/step"][:],
            time=group["position/time"][:] / moment,
            box=box,
            positions=positions,
            unwrapped=positions + images * box,
            velocities=values("velocity"),
            forces=values("force"),
            densities=values("density"),
            pressures=values("pressure"),
            mass=group["mass"][:] / (_AVOGADRO * 1e3 if si else 1.0),
            scene=_read_scene(file["parameters/sdpd"]),
            temperatures=values("temperature"),
        )
