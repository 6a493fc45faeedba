"""Time series of temperature, energies, momentum, densities and pressure."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

from .base import Array, LoopObserver

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Thermodynamics"]


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
            "square_internal_temperature": "K^2",
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
            "square_internal_temperature": "temperature^2",
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
        [energy/length^D], over particles. Of a fluid with an energy ``internal_energy`` takes the
        place of the potential one, and ``internal_temperature`` [temperature] and
        ``square_internal_temperature`` [its square] are means over the particles' own temperatures.
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
