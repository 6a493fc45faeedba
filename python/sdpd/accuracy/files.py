"""Finished settings of a study, a line of JSON each, so that a stopped study goes on."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sdpd.accuracy.row import Row
from sdpd.accuracy.settings import Settings

__all__ = ["Store"]


class Store:
    """Rows of one problem in a file that only grows.

    Parameters
    ----------
    folder : path
        Made if need be.
    name : str
        Of the problem.
    seeds, repeats
        Rows of others are not taken.

    Raises
    ------
    ValueError
        If the file holds something else than rows of a study.
    """

    def __init__(
        self, folder: str | os.PathLike[str], name: str, *, seeds: Sequence[int], repeats: int
    ) -> None:
        from sdpd import __version__

        self.path = Path(folder) / f"{name}.jsonl"
        self._common = {"version": __version__, "seeds": list(seeds), "repeats": repeats}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._rows = self._read()

    def _read(self) -> dict[Settings, Row]:
        if not self.path.exists():
            return {}
        text = self.path.read_text(encoding="utf-8")
        whole, _, broken = text.rpartition("\n")
        if broken:  # the writer was stopped in the middle of it
            self.path.write_text(whole + "\n" * bool(whole), encoding="utf-8")
        found = {}
        for number, line in enumerate(filter(None, whole.splitlines()), start=1):
            try:
                document = json.loads(line)
                row = _row(document["row"])
                same = {name: document[name] for name in self._common} == self._common
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise ValueError(
                    f"{self.path}, line {number}: expected a row of a study, got {line[:40]!r} "
                    f"({error})"
                ) from error
            if same:
                found[row.settings] = row
        return found

    def get(self, settings: Settings) -> Row | None:
        """The row of a setting that was finished before."""
        return self._rows.get(settings)

    def add(self, row: Row) -> None:
        """Write it, down to the disk."""
        document = {**self._common, "row": _plain(dataclasses.asdict(row))}
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(document) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self._rows[row.settings] = row


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    """Infinities as text, which JSON has not."""
    return {
        key: "inf" if isinstance(value, float) and math.isinf(value) else value
        for key, value in row.items()
    }


def _row(document: dict[str, Any]) -> Row:
    values: dict[str, Any] = {
        key: math.inf if value == "inf" else value for key, value in document.items()
    }
    return Row(**{**values, "settings": Settings(**document["settings"])})
