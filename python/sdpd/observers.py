"""Observers sample a running simulation: some inside the compiled loop, some between its calls."""

from __future__ import annotations

import csv
import os
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Correlator", "LoopObserver", "Observer", "Thermodynamics", "check_observers"]

Array = NDArray[np.float64]


class Observer:
    """Base of the observers; derive from it and override `sample` to sample in Python.

    An observer belongs to the first simulation it is used with and goes on over several runs. Its
    arrays are live: copy what is to be kept.

    Parameters
    ----------
    every : int, optional
        Steps between samples, which are taken when ``sim.step`` is a multiple; that of the run if
        None.

    Examples
    --------
    >>> import sdpd
    >>> class Fastest(sdpd.Observer):
    ...     def __init__(self, **options):
    ...         super().__init__(**options)
    ...         self.values = []
    ...
    ...     def sample(self, sim):
    ...         self.values.append(abs(sim.velocities).max())
    """

    may_write: ClassVar[bool] = True  # whether `sample` may write positions and velocities

    def __init__(self, *, every: int | None = None) -> None:
        self.every: int | None = None
        if every is not None:
            every = validation.integer("every", every, minimum=1, maximum=validation.LARGEST)
            self.every = every
        self._owner: weakref.ref[Simulation] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_owner": None}

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse a run this observer cannot follow; changes nothing.

        Raises
        ------
        ValueError
            If it belongs to another simulation.
        """
        if self._owner is not None and self._owner() is not sim:
            raise ValueError(
                f"`observe` must hold observers of this simulation, got a {type(self).__name__} "
                "that already belongs to another one; make one for each"
            )

    def adopt(self, sim: Simulation) -> None:
        """Become an observer of that simulation."""
        self._owner = weakref.ref(sim)

    def begin(self, sim: Simulation, every: int) -> None:
        """Called when a run begins that takes a sample every so many steps."""

    def sample(self, sim: Simulation) -> None:
        """Called after each step whose number is a multiple of `every`.

        May write positions and velocities: derived arrays are fresh again before the next observer.
        """

    def end(self, sim: Simulation) -> None:
        """Called when a run ends, however it ends."""


class LoopObserver(Observer):
    """Base of the observers that the core runs inside its loop, without Python.

    What the core collects between attaching and detaching is a *segment*; results join them.
    """

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._every: int | None = None
        self._dt = 0.0
        self._handle: Any = None
        self._segments: list[Array] = []

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "_handle": None, "_segments": self._tables()}

    def _attach(self, sim: Simulation, every: int) -> Any:
        raise NotImplementedError

    def attach(self, sim: Simulation, every: int, dt: float) -> None:
        """Begin a segment."""
        self._every, self._dt = every, dt
        self._handle = self._attach(sim, every)

    def detach(self) -> None:
        """End the segment."""
        if self._handle is not None:
            self._segments.append(self._handle.table())
            self._handle = None

    def mark(self) -> None:
        """Remember the present state: a failing run comes back to it."""

    def rewind(self, step: int) -> None:
        """End the segment without what came after the last mark, at `step`."""
        self.detach()

    def _tables(self) -> list[Array]:
        present = [] if self._handle is None else [np.asarray(self._handle.table())]
        return [*self._segments, *present]


class Thermodynamics(LoopObserver):
    """Time series of temperature, energies, momentum, densities and pressure of the box.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> thermo = sdpd.Thermodynamics(every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=thermo)
    >>> thermo["step"].tolist()
    [5, 10, 15, 20]
    >>> thermo.names[:3]
    ('step', 'time', 'temperature')
    """

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._columns: list[str] = []
        self._boltzmann = 1.0
        self._si = False
        self._dimension = 0

    def _attach(self, sim: Simulation, every: int) -> Any:
        handle = sim._core.attach_thermodynamics(every)
        self._columns = list(handle.columns)
        self._boltzmann = sim.scene.fluid.boltzmann_constant
        self._si, self._dimension = sim.scene.fluid.is_si, sim.scene.dimension
        return handle

    def rewind(self, step: int) -> None:
        """End the segment without the samples after `step`."""
        self.detach()
        if self._segments:
            last = self._segments[-1]
            self._segments[-1] = last[last[:, 0] <= step]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns; empty before the first run."""
        if not self._columns:
            return ()
        renamed = (name.replace("thermal_energy", "temperature") for name in self._columns)
        names = list(renamed)
        return (*names[:2], "temperature", *names[2:])

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column: of the SI if the scene is in it, else its dimension."""
        d = self._dimension
        per_volume = "m^3" if d == 3 else "m^2"
        si = {
            "step": "1",
            "time": "s",
            "temperature": "K",
            "energy": "J",
            "momentum": "kg m/s",
            "density": f"kg/{per_volume}",
            "square_density": f"kg^2/{'m^6' if d == 3 else 'm^4'}",
            "pressure": "Pa" if d == 3 else "N/m",
        }
        reduced = {
            "step": "1",
            "time": "time",
            "temperature": "temperature",
            "energy": "energy",
            "momentum": "mass length/time",
            "density": f"mass/length^{d}",
            "square_density": f"mass^2/length^{2 * d}",
            "pressure": f"energy/length^{d}",
        }
        table = si if self._si else reduced
        kinds = sorted(table, key=len, reverse=True)
        return {name: table[next(k for k in kinds if k in name)] for name in self.names}

    @property
    def data(self) -> NDArray[np.void]:
        """All samples, one row each: a structured array, ready for ``pandas.DataFrame``.

        Fields are ``step`` [1], ``time`` [time], ``temperature`` and ``temperature_x``...: kinetic
        temperature m sum |v - <v>|^2/(N - 1)/k_B, mean and by component; ``kinetic_energy``,
        ``potential_energy`` [energy]; ``momentum_x``... [mass length/time]; ``mean_density``
        [mass/length^D], ``mean_square_density`` [its square] and ``mean_pressure``
        [energy/length^D], over particles.
        """
        names = self.names
        kinds = [(name, np.int64 if name == "step" else np.float64) for name in names]
        tables = self._tables()
        result = np.zeros(sum(len(table) for table in tables), dtype=kinds)
        if not names or len(result) == 0:
            return result
        columns = dict(zip(self._columns, np.concatenate(tables).T, strict=True))
        thermal = [name for name in self._columns if name.startswith("thermal_energy")]
        for name in self._columns:
            scale = self._boltzmann if name in thermal else 1.0
            result[name.replace("thermal_energy", "temperature")] = columns[name] / scale
        result["temperature"] = np.mean([columns[name] for name in thermal], axis=0)
        result["temperature"] /= self._boltzmann
        return result

    def __getitem__(self, name: str) -> Array:
        validation.choice("name", name, self.names)
        return np.asarray(self.data[name])

    def __len__(self) -> int:
        return sum(len(table) for table in self._tables())

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all samples as CSV, names and units in the first line."""
        units = self.units
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([f"{name} [{units[name]}]" for name in self.names])
            writer.writerows(self.data.tolist())

    def __repr__(self) -> str:
        return f"<sdpd.Thermodynamics every {self._every or self.every}: {len(self)} samples>"


class Correlator(LoopObserver):
    """Mean-square displacement and velocity autocorrelation on logarithmic lags.

    No trajectory is kept: level l holds the last `points` samples taken every 2^l samples, so both
    functions are exact at every lag, at 48 `levels` `points` bytes a particle.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.
    points : int
        Lags on the first level, even; half as many on each further one.
    levels : int
        The longest lag is ``(points - 1) 2^(levels - 1)`` samples.

    Notes
    -----
    Consecutive runs with the same observers and the same dt continue. After a run without it, with
    other observers, or after `Simulation.restore`, new time origins are taken: no lag spans the
    gap.

    References
    ----------
    .. [1] J. Ramirez et al., J. Chem. Phys. 133 (2010) 154103.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> correlator = sdpd.Correlator(every=1, points=4, levels=2)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=correlator)
    >>> correlator.data["lag"].tolist()
    [0, 1, 2, 3, 4, 6]
    """

    def __init__(self, *, every: int | None = None, points: int = 16, levels: int = 10) -> None:
        super().__init__(every=every)
        self.points = validation.integer("points", points, minimum=2, maximum=2**48)
        if self.points % 2:
            raise ValueError(f"`points` must be even, got {self.points}")
        self.levels = validation.integer("levels", levels, minimum=1)
        if self.levels > 40:
            raise ValueError(f"`levels` must be at most 40, got {self.levels}")
        self._dimension = 1
        self._marked: Array | None = None

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse another simulation, and other lags than those of the samples at hand."""
        super().check(sim, every, dt)
        if not self._tables():
            return
        cures = ("use steps= (run(time=) adjusts dt) or a new Correlator", "use a new Correlator")
        pairs = (("dt", dt, self._dt), ("every", every, self._every))
        for (name, mine, its), cure in zip(pairs, cures, strict=True):
            if mine != its:
                raise ValueError(
                    f"`{name}` must be that of the samples a Correlator holds, {its:.10g}, got "
                    f"{mine:.10g}; {cure}"
                )

    def _attach(self, sim: Simulation, every: int) -> Any:
        self._dimension = sim.scene.dimension
        return sim._core.attach_correlator(every, self.points, self.levels)

    def mark(self) -> None:
        """Remember the sums: a failing run comes back to them."""
        self._marked = np.asarray(self._handle.table())

    def rewind(self, step: int) -> None:
        """End the segment with the sums at the last mark."""
        self._handle = None
        if self._marked is not None:
            self._segments.append(self._marked)
            self._marked = None

    @property
    def data(self) -> NDArray[np.void]:
        """The functions so far, one row for each lag that has samples: a structured array.

        Fields are ``lag`` (in steps) [1], ``time`` of the lag [time], ``origins`` (number of time
        origins) [1], ``msd`` <|r(t) - r(0)|^2> summed over the components [length^2], ``vacf``
        <v(t).v(0)>/D [length^2/time^2].
        """
        kinds = [("lag", np.int64), ("time", float), ("origins", np.int64)]
        kinds += [("msd", float), ("vacf", float)]
        tables = self._tables()
        if not tables:
            return np.zeros(0, dtype=kinds)
        sums = np.sum([table[:, 1:] for table in tables], axis=0)
        seen = sums[:, 0] > 0
        sums, steps = sums[seen], tables[0][seen, 0] * (self._every or 1)
        result = np.zeros(len(sums), dtype=kinds)
        result["lag"], result["origins"] = steps, sums[:, 0]
        result["time"] = steps * self._dt
        result["msd"] = sums[:, 1] / sums[:, 0]
        result["vacf"] = sums[:, 2] / sums[:, 0] / self._dimension
        return result

    @property
    def time(self) -> Array:
        """Lags [time]."""
        return np.asarray(self.data["time"])

    @property
    def msd(self) -> Array:
        """Mean-square displacement at each lag [length^2]."""
        return np.asarray(self.data["msd"])

    @property
    def vacf(self) -> Array:
        """Velocity autocorrelation at each lag [length^2/time^2]."""
        return np.asarray(self.data["vacf"])

    def __repr__(self) -> str:
        every = self._every or self.every
        return (
            f"<sdpd.Correlator every {every}, {self.points} points on {self.levels} levels: "
            f"{len(self.data)} lags>"
        )


def check_observers(observe: Any) -> list[Observer]:
    """The observers of a run, each once."""
    if isinstance(observe, Observer):
        return [observe]
    if not isinstance(observe, Sequence) or isinstance(observe, str):
        kind = type(observe).__name__
        raise TypeError(f"`observe` must be an observer or a sequence of them, got {kind}")
    for index, observer in enumerate(observe):
        expected = "an observer, e.g. sdpd.Thermodynamics()"
        validation.instance(f"observe[{index}]", observer, Observer, expected)
    if len({id(observer) for observer in observe}) != len(observe):
        raise ValueError("`observe` must hold each observer once, got one twice")
    return list(observe)
