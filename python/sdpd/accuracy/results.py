"""The table of a study: records, data frames, the front, text and files."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.accuracy.front import pareto
from sdpd.accuracy.problem import Problem
from sdpd.accuracy.row import UNITS, Row
from sdpd.accuracy.settings import NAMES
from sdpd.agreement import columns
from sdpd.optional import need

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

__all__ = ["Study", "write"]

_MAIN = ("across", "support", "kernel", "step", "integrator", "bookkeeping", "calibrate")


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Errors and costs of settings; ``print`` shows the table.

    Attributes
    ----------
    problem : Problem
    rows : tuple of Row
        In the order of the settings.
    """

    problem: Problem
    rows: tuple[Row, ...]

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Names of the settings that differ between rows."""
        return tuple(
            name for name in NAMES if len({getattr(row.settings, name) for row in self.rows}) > 1
        )

    def label(self, row: Row) -> str:
        """What sets a row apart, in words: the main settings, and others where they are unusual."""
        base = self.problem.base
        return row.settings.label(
            name
            for name in self.varied
            if name in _MAIN or getattr(row.settings, name) != getattr(base, name)
        )

    def pareto(self, *, z: float = 1.0) -> tuple[Row, ...]:
        """Settings worth their time, cheapest first; see :func:`sdpd.accuracy.pareto`."""
        return pareto(self.rows, z=z)

    @property
    def passed(self) -> bool:
        """Whether no setting failed."""
        return not any(row.note for row in self.rows)

    def records(self) -> list[dict[str, Any]]:
        """A mapping for each row: settings and results; units in ``sdpd.accuracy.UNITS``."""
        return [row.record() for row in self.rows]

    def to_pandas(self) -> DataFrame:
        """A row for each setting; units in ``attrs["units"]``.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        pandas = need("pandas", "pandas", "for data frames")
        frame = pandas.DataFrame(self.records())
        frame.attrs["units"] = UNITS
        return frame

    def to_xarray(self) -> Dataset:
        """Along the dimension "setting"; settings are coordinates.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        xarray = need("xarray", "xarray", "for data sets")
        records = self.records()
        table = {name: ("setting", [record[name] for record in records]) for name in records[0]}
        dataset = xarray.Dataset(
            {name: (*table[name], {"units": UNITS[name]}) for name in UNITS},
            {name: table[name] for name in self.varied},
        )
        dataset.attrs["problem"] = self.problem.title
        return dataset

    def plot(self, axes: Any = None, *, z: float = 1.0) -> Any:
        """Error against seconds with the front; see :func:`sdpd.accuracy.plot`."""
        from sdpd.accuracy.figures import plot

        return plot(self, axes, z=z)

    def __str__(self) -> str:
        front = self.pareto()
        problem = self.problem
        lines = [["settings", "error", "SE", "bias", "sampling", "seconds", "steps", "memory", ""]]
        for row in sorted(self.rows, key=lambda row: row.seconds):
            lines.append(
                [
                    self.label(row) or "as given",
                    f"{row.error:.3g}",
                    f"{row.stderr:.1g}",
                    f"{row.bias:+.3g} ± {row.bias_stderr:.1g}",
                    f"{row.sampling:.1g}",
                    f"{row.seconds:.3g} s",
                    f"{row.steps}",
                    f"{row.memory / 1e3:.0f} kB",
                    "*" if row in front else ("failed" if row.note else ""),
                ]
            )
        return (
            f"{problem.title}: error of {problem.error_of}, against {problem.source}\n\n"
            f"{columns(lines)}\n\n"
            + "".join(f"{self.label(row)}: {row.note}\n\n" for row in self.rows if row.note)
            + "error: bias and sampling of one run, relative; SE: its standard error; seconds: of "
            "one\nrun on one thread, the least of all repeats; *: worth its time (no cheaper "
            "setting is as good)"
        )


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write accuracy_NAME.csv and accuracy_NAME.txt; the folder is made if need be."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"accuracy_{study.problem.name}.{ending}" for ending in ("csv", "txt")]
    records = study.records()
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(records[0]))
        writer.writeheader()
        writer.writerows(records)
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths
