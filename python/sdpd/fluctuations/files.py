"""The study as files: CSV and the printed text."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.fluctuations.report import report

if TYPE_CHECKING:
    from sdpd.fluctuations.study import Study

__all__ = ["rows", "write"]


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


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write fluctuations.csv and fluctuations.txt; the folder is made if need be."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"fluctuations.{ending}" for ending in ("csv", "txt")]
    table = rows(study)
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    paths[1].write_text(report(study) + "\n", encoding="utf-8")
    return paths
