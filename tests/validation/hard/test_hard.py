"""The hard cases in full, but for the ten million steps, which have a record of their own."""

from __future__ import annotations

from typing import Any

import pytest

from tests.hard import flows, particles, steps
from tests.hard.case import CASES, judge
from tests.validation import record

LONG = "ten_million_steps"
FOUND: dict[str, Any] = {}
assert {f.__module__ for f in CASES.values()} == {m.__name__ for m in (flows, particles, steps)}


@pytest.mark.parametrize("name", sorted(set(CASES) - {LONG}))
def test_full(name: str) -> None:
    FOUND[name] = judge(name, full=True)


def test_the_record_is_written() -> None:
    assert set(FOUND) == set(CASES) - {LONG}, "a case failed"
    record.store("hard", FOUND)
