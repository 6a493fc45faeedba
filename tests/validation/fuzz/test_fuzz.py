"""A hundred thousand damaged files: each is read whole or refused by an error that says where."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.hard import fuzzing
from tests.validation import record

SCENES, CHECKPOINTS = 70_000, 30_000
FOUND: dict[str, Any] = {}


def test_scenes() -> None:
    FOUND["scenes"] = fuzzing.fuzz_scenes(SCENES)


def test_checkpoints(tmp_path: Path) -> None:
    FOUND["checkpoints"] = fuzzing.fuzz_checkpoints(CHECKPOINTS, tmp_path)


def test_the_record_is_written() -> None:
    assert set(FOUND) == {"scenes", "checkpoints"}, "a case failed"
    record.store("fuzz", FOUND)
