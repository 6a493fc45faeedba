"""What a measured time belongs to: processor, versions, commit, date."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from sdpd import running

__all__ = ["Machine", "pinned"]

FLAGS = ("sse4_2", "avx2", "fma", "avx512f", "asimd", "sve")  # of vector units, as Linux names them


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Where and with what something was timed.

    Attributes
    ----------
    processor : str
    flags : tuple of str
        Those of `FLAGS` that it has, as far as the system tells.
    processors : int
        That this process may use.
    system, python, numpy, version : str
        Of the operating system, and versions; the last one of this package.
    commit : str
        Of the source tree, "+" if files in it were changed; "" if there is none.
    date : str
        UTC, ISO 8601.
    """

    processor: str
    flags: tuple[str, ...]
    processors: int
    system: str
    python: str
    numpy: str
    version: str
    commit: str
    date: str

    @classmethod
    def here(cls) -> Machine:
        """The one that runs, and the present date."""
        from sdpd import __version__

        known = _cpuinfo()
        names = known.get("flags", known.get("Features", "")).split()
        return cls(
            processor=known.get("model name") or platform.processor() or platform.machine(),
            flags=tuple(name for name in FLAGS if name in names),
            processors=running.available_threads(),
            system=f"{platform.system()} {platform.machine()}",
            python=platform.python_version(),
            numpy=np.__version__,
            version=__version__,
            commit=_commit(),
            date=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        )

    def __str__(self) -> str:
        flags = f" ({', '.join(self.flags)})" if self.flags else ""
        commit = f", commit {self.commit[:12]}{'+' * self.commit.endswith('+')}"
        return (
            f"{self.processor}{flags}, {self.processors} processor{'s' * (self.processors > 1)}; "
            f"sdpd {self.version}{commit * bool(self.commit)}, {self.date}"
        )


def _cpuinfo() -> dict[str, str]:
    """The first processor of /proc/cpuinfo; empty where there is no such file."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return {}
    lines = (line.partition(":") for line in text.split("\n\n")[0].splitlines())
    return {name.strip(): value.strip() for name, _, value in lines}


def _commit() -> str:
    """Of the tree that this package lies in as python/sdpd, if git knows it."""
    tree = Path(__file__).resolve().parents[3]
    if not (tree / ".git").exists():
        return ""
    try:
        head = _git(tree, "rev-parse", "HEAD")
        return head + "+" * bool(_git(tree, "status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.SubprocessError):
        return ""


def _git(tree: Path, *arguments: str) -> str:
    command = ["git", "-C", str(tree), *arguments]
    found = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    return found.stdout.strip()


@contextmanager
def pinned() -> Iterator[int | None]:
    """Keep this thread, and what it starts, on one core: the last one that it may use.

    Yields
    ------
    int or None
        The core; None where the system cannot pin.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield None
        return
    before = os.sched_getaffinity(0)
    core = max(before)
    os.sched_setaffinity(0, {core})
    try:
        yield core
    finally:
        os.sched_setaffinity(0, before)
