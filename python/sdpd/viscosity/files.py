"""The study as files: CSV and the printed text."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.viscosity.report import report

if TYPE_CHECKING:
    from sdpd.analysis import Estimate
    from sdpd.viscosity.study import Study

__all__ = ["rows", "write"]


def rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict a value; viscosities in the unit of the fluid's [pressure x time]."""
    small, step = study.lattice
    found = [
        _row("asked", study.asked),
        _row("lattice sum", study.on_lattice),
        _row("lattice decay, small dt", small.factor.scaled(study.on_lattice)),
        _row("lattice decay, this dt", step.factor.scaled(study.on_lattice)),
        _row("friction as particles lie, this dt", study.friction),
        _row("kinetic, mean field", study.theory.kinetic),
        _row("conservative, mean field", study.theory.configurational()),
    ]
    for method in study.methods:
        found.append(_row(method.name, method.viscosity, method.accuracy))
    found.append(_row("all", study.viscosity))
    found.append(_row("Green-Kubo", study.stress.green_kubo))
    for name, estimate in study.stress.shares.items():
        found.append(_row(f"{name} stress alone", estimate))
    for shell in study.shells:
        found.append(_row("transverse currents at k", shell.viscosity, k=shell.wave_number))
    forced = study.methods[-1]
    found.append(_row("sinusoidal force at k", forced.measured, k=forced.wave_number))
    return found


def _row(
    name: str, value: Estimate | float, accuracy: float = 0.0, *, k: float = 0.0
) -> dict[str, Any]:
    number, stderr = (
        (value, 0.0) if isinstance(value, (int, float)) else (value.value, value.stderr)
    )
    return {
        "name": name,
        "wave_number": k,
        "viscosity": number,
        "stderr": stderr,
        "accuracy": accuracy,
    }


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write viscosity.csv and viscosity.txt; the folder is made if need be."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"viscosity.{ending}" for ending in ("csv", "txt")]
    table = rows(study)
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    paths[1].write_text(report(study) + "\n", encoding="utf-8")
    return paths
