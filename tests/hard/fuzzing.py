"""The fuzz runs, of any length: scenes and checkpoints under drawn damage, counted by what came."""

from __future__ import annotations

import collections
import resource
import time
import warnings
from pathlib import Path

import hypothesis
from hypothesis import strategies as st

import sdpd

from . import mutations

SLOWEST = 5.0  # [s] of processor time for a file; a hang takes longer
GROWTH = 600.0  # [MB] of the whole run: a corrupt size must not be taken at its word


def _settings(examples: int) -> hypothesis.settings:
    return hypothesis.settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(hypothesis.HealthCheck),
        report_multiple_bugs=False,
    )


def _memory() -> float:
    """Peak memory of the process [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class Count:
    """Outcomes by name, the slowest file and the growth of memory."""

    def __init__(self) -> None:
        self.outcomes: collections.Counter[str] = collections.Counter()
        self.slowest = 0.0
        self.memory = _memory()

    def add(self, outcome: str, began: float) -> None:
        self.outcomes[outcome] += 1
        seconds = time.process_time() - began
        self.slowest = max(self.slowest, seconds)
        assert seconds < SLOWEST, f"{seconds:.1f} s for one file ({outcome})"

    def numbers(self) -> dict[str, float]:
        """What the run has found, and that its memory is in bounds."""
        growth = _memory() - self.memory
        assert growth < GROWTH, f"memory grew by {growth:.0f} MB"
        return {
            **{name: float(number) for name, number in sorted(self.outcomes.items())},
            "files": float(sum(self.outcomes.values())),
            "slowest_seconds": self.slowest,
            "memory_growth_megabytes": growth,
        }


def fuzz_scenes(examples: int) -> dict[str, float]:
    count = Count()

    @_settings(examples)
    @hypothesis.given(mutations.scene_texts(), st.integers(0, 3))
    def attempt(text: str, turn: int) -> None:
        began = time.process_time()
        count.add(mutations.read_scene(text, run=turn == 0), began)

    attempt()
    return count.numbers()


def fuzz_checkpoints(examples: int, folder: Path) -> dict[str, float]:
    files = mutations.saved(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
        victims = {name: sdpd.load(path, threads=1) for name, path in files.items()}
    count = Count()

    @_settings(examples)
    @hypothesis.given(mutations.checkpoints(files), st.sampled_from(sorted(victims)))
    def attempt(content: bytes, name: str) -> None:
        began = time.process_time()
        victim = {name: victims[name]}
        count.add(mutations.read_checkpoint(content, folder / "damaged.sdpd", victim), began)

    attempt()
    return count.numbers()
