"""The study as files: two CSV tables and the printed text."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.correlations.report import report

if TYPE_CHECKING:
    from sdpd.correlations.study import Study

__all__ = ["function_rows", "rows", "write"]


def rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict an item; all numbers are reduced [1]."""
    return [
        {
            "group": item.group,
            "name": item.name,
            "value": item.estimate.value,
            "stderr": item.estimate.stderr,
            "blocks": int(item.estimate.n_effective),
            "prediction": item.prediction,
            "accuracy": item.accuracy,
            "exact": item.exact,
            "z": item.z,
            "p": item.p,
            "agrees": agreed,
        }
        for item, agreed in zip(study.items, study.agreed, strict=True)
    ]


def function_rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict a lag of each normalised function; k [1/length] and t [time] of the scene."""
    found = []
    for shell in study.shells:
        for name in shell.functions:
            lag, mean, error = shell.normalized(name)
            theory = shell.prediction.function(name, lag)
            for row in zip(lag, mean, error, theory, strict=True):
                numbers = (float(x) for x in row)
                named = zip(("time", "value", "stderr", "theory"), numbers, strict=True)
                found.append({"wave_number": shell.wave_number, "function": name, **dict(named)})
    return found


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write correlations.csv, correlation_functions.csv and correlations.txt into a folder.

    The folder is made if need be.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    tables = {"correlations.csv": rows(study), "correlation_functions.csv": function_rows(study)}
    for name, table in tables.items():
        _write_table(target / name, table)
    text = target / "correlations.txt"
    text.write_text(report(study) + "\n", encoding="utf-8")
    return [*(target / name for name in tables), text]


def _write_table(path: Path, table: Sequence[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
