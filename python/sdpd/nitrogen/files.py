"""Files of a study of nitrogen."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sdpd.nitrogen.study import Study

__all__ = ["write"]

COLUMNS = (
    "case",
    "quantity",
    "unit",
    "measured",
    "stderr",
    "expected",
    "judged",
    "published",
    "published_analytical",
    "first_lag_s",
    "last_lag_s",
)


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write nitrogen.csv, a row for each case and quantity, and nitrogen.txt, the table."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"nitrogen.{ending}" for ending in ("csv", "txt")]
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for found in study.cases:
            for row in found.rows:
                window = row.measured.window or ("", "")
                values = [row.measured.value, row.measured.stderr, row.expected, row.judged]
                printed = ["" if x is None else x for x in (row.published, row.analytical)]
                writer.writerow([found.case.number, row.name, row.unit, *values, *printed, *window])
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths
