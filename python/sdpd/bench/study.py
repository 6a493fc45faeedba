"""What all benchmarks have in common: a machine, a verdict, a document."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from sdpd.bench.machine import Machine

__all__ = ["Study", "write", "write_json"]


@dataclass(frozen=True, kw_only=True)
class Study:
    """Base of the benchmarks.

    Attributes
    ----------
    machine : Machine
    threads, rounds : int
        Of each simulation, and turns of each case.
    seconds : float
        That the benchmark took [s].
    """

    kind: ClassVar[str] = ""

    machine: Machine
    threads: int
    rounds: int
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether every check was met; True where there is none."""
        return True

    def document(self) -> dict[str, Any]:
        """Everything as plain data; numbers that are not finite become None."""
        found: dict[str, Any] = _plain({"kind": self.kind, **asdict(self), "passed": self.passed})
        return found

    def _foot(self) -> str:
        threads = f"{self.threads} thread{'s' * (self.threads > 1)}"
        return (
            f"medians and quartiles of {self.rounds} turns, {threads}, {self.seconds:.0f} s\n"
            f"{self.machine}"
        )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_json(study: Study, path: str | os.PathLike[str]) -> Path:
    """Write the document of a benchmark; folders are made if need be."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(study.document(), indent=1) + "\n", encoding="utf-8")
    return target


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write bench_KIND.json and bench_KIND.txt, what is printed."""
    target = Path(folder)
    paths = [write_json(study, target / f"bench_{study.kind}.json")]
    paths.append(target / f"bench_{study.kind}.txt")
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths
