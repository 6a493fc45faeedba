"""Checkpoints: one file with everything a simulation needs to go on bit for bit.

A file is an uncompressed zip archive: ``header.json`` (format, versions, scene, integrator,
settings of the core, clock, a SHA-256 of it all) and the internal arrays as ``.npy`` members, which
``numpy.load`` opens as well. It is written aside, flushed to the disk and renamed, so that a crash
leaves the old file whole; reading checks everything before anything is changed.
"""

from __future__ import annotations

import errno
import hashlib
import io
import json
import math
import os
import platform
import secrets
import sys
import warnings
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import initial, integrators, running, timestep, validation, wall_motion
from sdpd.adaptive import AdaptiveStep
from sdpd.errors import CheckpointError, SdpdWarning, silenced
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["load", "read_header", "restore", "save"]

FORMAT = "sdpd checkpoint"
SCHEMA = 1
_HEADER = "header.json"
_CLOCK = ("step", "base_step", "base_time", "dt")
# Name -> dtype and columns of the core's arrays, N rows each (0: one-dimensional).
_ARRAYS: dict[str, tuple[str, int]] = {
    "position": ("<f8", 4),
    "velocity": ("<f8", 4),
    "force": ("<f8", 4),
    "id": ("<u8", 0),
    "row": ("<u4", 0),
    "image": ("<i4", 3),
    "grid_reference": ("<f8", 3),
    "list_reference": ("<f8", 3),  # or no rows at all
}

# Of particles with an energy.
_ENERGY: dict[str, tuple[str, int]] = {"thermal_energy": ("<f8", 0)}

Blobs = dict[str, NDArray[Any]]


def _arrays(energy: bool) -> dict[str, tuple[str, int]]:
    return {**_ARRAYS, **_ENERGY} if energy else _ARRAYS


def _machine() -> dict[str, str]:
    return {"architecture": platform.machine(), "byteorder": sys.byteorder, "precision": "float64"}


def _version() -> str:
    import sdpd

    return sdpd.__version__


def _plain(value: Any) -> Any:
    """Tuples as lists, which is what JSON returns."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value


def _written(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings of the core as a file has them: without fields of walls and frozen particles, which
    follow from the scene.
    """
    follow = ("fields", "frozen")
    return _plain({key: value for key, value in settings.items() if key not in follow})  # type: ignore[no-any-return]


def _digest(header: dict[str, Any], arrays: Blobs) -> str:
    """SHA-256 of the header (less this entry) and of all arrays."""
    total = hashlib.sha256()
    rest = {key: value for key, value in header.items() if key != "digest"}
    total.update(json.dumps(rest, sort_keys=True).encode())
    for name in sorted(arrays):
        total.update(name.encode())
        total.update(np.ascontiguousarray(arrays[name]).tobytes())
    return total.hexdigest()


# --- writing ---------------------------------------------------------------------------------


def _contents(sim: Simulation) -> tuple[dict[str, Any], Blobs]:
    state = sim._core.state()
    arrays: Blobs = {}
    for name, (kind, columns) in _arrays(sim.scene.active_effects.energy).items():
        flat = np.frombuffer(state[name], dtype=kind)
        arrays[name] = flat.reshape(-1, columns) if columns else flat
    header: dict[str, Any] = {
        "format": FORMAT,
        "schema": SCHEMA,
        "sdpd": _version(),
        "machine": _machine(),
        "particles": sim.n_particles,
        "scene": sim.scene.to_toml(),
        "integrator": {"name": sim.integrator.name, **vars(sim.integrator)},
        "accuracy": dict(sim._accuracy),
        "dt": sim.dt,
        "adaptive": None if sim.adaptive is None else dict(vars(sim.adaptive)),
        "settings": _written(sim._settings),
        "clock": {name: state[name] for name in _CLOCK},
        "list_travel": float(state["list_travel"]),
        "list_widths": [float(x) for x in state["list_widths"]],
        "wall_force": [float(x) for x in state["wall_force"]],
        "wall_motions": [wall_motion.motion(wall) for wall in sim.walls],
    }
    if sim.walls:
        header["wall_impulse"] = [float(x) for x in state["wall_impulse"]]
        header["wall_crossings"] = int(state["wall_crossings"])
    if "accounts" in state:
        header["accounts"] = [float(x) for x in state["accounts"]]
    header["digest"] = _digest(header, arrays)
    return header, arrays


def save(sim: Simulation, path: str | os.PathLike[str]) -> None:
    """Write a simulation to a file, atomically; what `Simulation.save` calls.

    Parameters
    ----------
    sim : Simulation
        May have been written to; is left as it is.
    path : path
        An existing file is replaced once the new one is complete.

    Raises
    ------
    OSError
        If the file cannot be written; an existing one is untouched.
    """
    header, arrays = _contents(sim)
    target = Path(path)
    name = target.parent / f".{target.name}.{secrets.token_hex(8)}"
    try:
        with name.open("xb") as file:  # with the permissions of any new file
            _write(file, header, arrays)
            file.flush()
            os.fsync(file.fileno())
        with suppress(OSError):
            name.chmod(target.stat().st_mode & 0o777)  # of the file to be replaced
        os.replace(name, target)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise
    _flush_folder(target.parent)


def _write(file: Any, header: dict[str, Any], arrays: Blobs) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(_HEADER, json.dumps(header, indent=1))
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


def _flush_folder(folder: Path) -> None:
    """Make the renaming itself last, where the system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


# --- reading ---------------------------------------------------------------------------------


class _Reader:
    """Reads and checks a file; every complaint names it."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    def fail(self, reason: str) -> CheckpointError:
        return CheckpointError(f"{self.path} cannot be loaded: {reason}")

    def header(self, archive: zipfile.ZipFile) -> dict[str, Any]:
        if _HEADER not in archive.namelist():
            raise self.fail("it is an archive, but not a checkpoint of sdpd (no header)")
        try:
            header = json.loads(self.member(archive, _HEADER))
        except ValueError as error:
            raise self.fail(f"its header is not readable ({error})") from None
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise self.fail("it is not a checkpoint of sdpd (its header says otherwise)")
        schema = header.get("schema")
        if schema != SCHEMA:
            written = header.get("sdpd", "unknown")
            raise self.fail(
                f"its schema is {schema!r}, this version of sdpd reads {SCHEMA}; it was written by "
                f"sdpd {written}"
            )
        return header

    def member(self, archive: zipfile.ZipFile, name: str) -> bytes:
        """A member as it lies in the file: what is packed may unpack to any size."""
        info = archive.getinfo(name)
        if info.compress_type != zipfile.ZIP_STORED or info.file_size != info.compress_size:
            raise self.fail(f"its part {name!r} is compressed, which sdpd never writes")
        if info.file_size > self.path.stat().st_size:
            raise self.fail(
                f"it is truncated or damaged: its part {name!r} is larger than the file"
            )
        return archive.read(info)

    def check_size(self, name: str, content: bytes) -> None:
        """An array must be as large as it says, before memory is asked for."""
        file = io.BytesIO(content)
        readers = {(1, 0): np.lib.format.read_array_header_1_0}
        version = np.lib.format.read_magic(file)
        if version not in readers:
            raise self.fail(f"its array {name!r} is of the unknown format {version}")
        shape, _, kind = readers[version](file)
        rest = len(content) - file.tell()
        if math.prod(shape) * kind.itemsize != rest:
            raise self.fail(
                f"its array {name!r} has {rest} bytes, but says that it has shape {shape} of {kind}"
            )

    def read(self) -> tuple[dict[str, Any], Blobs]:
        """Header and arrays, complete and unaltered."""
        try:
            with self.path.open("rb") as file, zipfile.ZipFile(file) as archive:
                header = self.header(archive)
                names = _arrays("accounts" in header)
                arrays = {name: self.array(archive, name, header) for name in names}
        except zipfile.BadZipFile as error:
            raise self.fail(f"it is damaged, truncated or not a checkpoint ({error})") from None
        except (EOFError, zlib.error, NotImplementedError, RuntimeError) as error:
            raise self.fail(f"it is damaged ({error})") from None
        except OSError as error:
            if error.errno != errno.EINVAL:  # a place before its beginning
                raise
            raise self.fail("it is damaged (its parts are not where it says)") from None
        if header.get("digest") != _digest(header, arrays):
            raise self.fail("it was altered after it was written (its digest differs)")
        return header, arrays

    def array(self, archive: zipfile.ZipFile, name: str, header: dict[str, Any]) -> NDArray[Any]:
        kind, columns = _arrays(True)[name]
        try:
            content = self.member(archive, f"{name}.npy")
            self.check_size(name, content)
            array = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
        except KeyError:
            raise self.fail(f"its array {name!r} is missing") from None
        except ValueError as error:
            raise self.fail(f"its array {name!r} is not readable ({error})") from None
        number = header.get("particles")
        tail = (columns,) if columns else ()
        lengths = (number, 0) if name == "list_reference" else (number,)
        if array.dtype != np.dtype(kind) or array.shape not in [(n, *tail) for n in lengths]:
            raise self.fail(
                f"its array {name!r} must hold {number} rows of {max(1, columns)} {kind}, got "
                f"shape {array.shape} of {array.dtype}"
            )
        return np.asarray(array)


class _Content:
    """What a file describes, in the terms of the package."""

    def __init__(self, reader: _Reader) -> None:
        self.reader = reader
        self.header, self.arrays = reader.read()
        try:
            with silenced():  # was given when the scene was made
                self.scene = Scene.from_toml(self.header["scene"])
            choice = dict(self.header["integrator"])
            self.integrator = integrators.INTEGRATORS[choice.pop("name")](**choice)
            self.settings = _core_settings(self.header["settings"])
            self.dt = validation.positive("dt", self.header["dt"])
            adaptive = self.header.get("adaptive")
            self.adaptive = None if adaptive is None else AdaptiveStep(**adaptive)
            self.accuracy: dict[str, Any] = dict(self.header["accuracy"])
            self.machine: dict[str, Any] = dict(self.header["machine"])
            timestep.bounds(self.scene, self.integrator, **self.accuracy)
            self.state: dict[str, Any] = {name: self.header["clock"][name] for name in _CLOCK}
            self.state["wall_force"] = [float(x) for x in self.header["wall_force"]]
            if "list_travel" in self.header:  # or the file is older, and gets lists of its own
                self.state["list_travel"] = float(self.header["list_travel"])
                self.state["list_widths"] = [float(x) for x in self.header["list_widths"]]
            if self.scene.walls:
                self.state["wall_impulse"] = [float(x) for x in self.header["wall_impulse"]]
                self.state["wall_crossings"] = int(self.header["wall_crossings"])
            if self.scene.active_effects.energy:
                self.state["accounts"] = [float(x) for x in self.header["accounts"]]
            self.walls = wall_motion.with_motions(
                self.scene.walls, self.header["wall_motions"], self.scene.box
            )
        except KeyError as error:
            raise reader.fail(f"its header lacks {error} or has an unknown one") from None
        except (TypeError, ValueError, OverflowError) as error:
            raise reader.fail(f"its header is not valid: {error}") from None
        self.state.update({name: array.tobytes() for name, array in self.arrays.items()})
        self._check_settings()

    def _check_settings(self) -> None:
        """The settings of the core must follow from the scene (to rounding: versions differ)."""
        if self.header["particles"] != self.scene.n_particles:
            raise self.reader.fail(
                f"it holds {self.header['particles']} particles, its scene {self.scene.n_particles}"
            )
        expected = {**self.scene.core_arguments(), "integrator": self.integrator.name}
        expected = integrators.with_integrator(expected, self.integrator)
        for name, value in _written(expected).items():
            its = self.header["settings"].get(name)
            if not _agree(its, value):
                raise self.reader.fail(
                    f"`{name}` of its simulation is {its!r}, but its scene says {value!r}"
                )

    def warn_of_other_bits(self) -> None:
        """Where the trajectory goes on, but not necessarily with the same bits."""
        mine = {"sdpd": _version(), **_machine()}
        its = {"sdpd": self.header.get("sdpd"), **self.machine}
        other = [
            f"{key} {its.get(key)} (here {mine[key]})" for key in mine if its.get(key) != mine[key]
        ]
        if other:
            warnings.warn(
                f"{self.reader.path} was written by {', '.join(other)}: the simulation continues, "
                "but not necessarily bit for bit",
                SdpdWarning,
                stacklevel=4,
            )

    def positions(self) -> NDArray[np.float64]:
        """Positions by row, in the user's units."""
        dimension = self.scene.dimension
        result = np.zeros((self.scene.n_particles, dimension))
        scaled = self.arrays["position"][:, :dimension] * self.settings["support"]
        try:
            result[self.arrays["row"]] = scaled
        except IndexError as error:
            raise self.reader.fail(f"its rows are not valid ({error})") from None
        return result


# Settings that files of earlier versions do not have.
_DEFAULTS = {"precision": "double"}


def _core_settings(plain: dict[str, Any]) -> dict[str, Any]:
    """Arguments of the core from their JSON form, which has no tuples."""
    settings = {**_DEFAULTS, **plain}
    kind, parameters = settings["eos"]
    settings["eos"] = (kind, parameters)
    if settings["body_force"] is not None:
        amplitude, wave = settings["body_force"]
        settings["body_force"] = (amplitude, None if wave is None else tuple(wave))
    if "walls" in settings:
        settings["walls"] = [(kind, numbers) for kind, numbers in settings["walls"]]
    if "thermal" in settings:
        thermal = dict(settings["thermal"])
        thermal["eos"] = tuple(thermal["eos"])
        thermal["walls"] = [(kind, numbers) for kind, numbers in thermal["walls"]]
        settings["thermal"] = thermal
    return settings


def _agree(one: Any, other: Any) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_agree, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_agree(one[key], other[key]) for key in one)
    numbers = (int, float)
    if isinstance(one, numbers) and isinstance(other, numbers):
        with suppress(OverflowError):  # an integer beyond any float
            return math.isclose(one, other, rel_tol=1e-9)
    return bool(one == other)


def read_header(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a checkpoint says of itself: versions, machine, scene (TOML), settings, clock.

    Raises
    ------
    CheckpointError
        If the file is not a whole and valid checkpoint.
    """
    return _Reader(path).read()[0]


def load(path: str | os.PathLike[str], *, threads: int | None = None) -> Simulation:
    """A simulation from a file that `save` wrote; also ``Simulation.load``.

    Parameters
    ----------
    path : path
    threads : int, optional
        As for a new simulation; changes no bit of what follows.

    Returns
    -------
    Simulation

    Raises
    ------
    CheckpointError
        If the file is truncated, altered, foreign or of an unknown version, with the reason.
    OSError
        If there is no such file or it cannot be read.

    Warns
    -----
    SdpdWarning
        If another version of the package or another class of machine wrote it: the simulation
        continues, but not necessarily bit for bit.

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
    ...     sim.save(os.path.join(folder, "water.sdpd"))
    ...     again = sdpd.load(os.path.join(folder, "water.sdpd"))
    >>> sim.run(steps=10)
    >>> again.run(steps=10)
    >>> bool((again.positions == sim.positions).all())
    True
    """
    from sdpd import simulation

    reader = _Reader(path)
    content = _Content(reader)
    count = running.choose_threads(threads, content.scene.n_particles)
    points = content.positions()
    try:
        with silenced():  # was given when the scene was made
            scene = content.scene
            settings = {**content.settings, **scene.field_arguments(), **scene.model_arguments()}
        sim = simulation._restored(
            scene=content.scene,
            integrator=content.integrator,
            settings=settings,
            threads=count,
            core=simulation._new_core(
                points,
                np.zeros_like(points),
                settings,
                count,
                initial.temperatures(content.scene, None),
            ),
            dt=content.dt,
            accuracy=content.accuracy,
            state=content.state,
            walls=content.walls,
            adaptive=content.adaptive,
        )
    except (TypeError, ValueError, OverflowError) as error:
        raise reader.fail(f"its state is not valid: {error}") from None
    content.warn_of_other_bits()
    return sim


def restore(sim: Simulation, path: str | os.PathLike[str]) -> None:
    """Bring a simulation back to the state in a file of its own; what `Simulation.restore` calls.

    Raises
    ------
    CheckpointError
        As for `load`, and if the file belongs to another simulation; nothing has changed.
    RuntimeError
        If the simulation is running.
    """
    sim._refuse_restore()
    reader = _Reader(path)
    content = _Content(reader)
    if content.scene != sim.scene:
        raise reader.fail("it belongs to another scene; sdpd.load() makes a new simulation of it")
    for name, value in _written(sim._settings).items():
        its = content.header["settings"].get(name, _DEFAULTS.get(name))
        if its != value:
            raise reader.fail(
                f"`{name}` of its simulation is {its!r}, of this one {value!r}; sdpd.load() makes "
                "a new simulation of it"
            )
    try:
        sim._set_state(content.state, content.dt, content.walls, content.adaptive)
    except (TypeError, ValueError, OverflowError) as error:
        raise reader.fail(f"its state is not valid: {error}") from None
    content.warn_of_other_bits()
