"""Each hard case in its reduced form: within the limits of its row, or refused beforehand."""

from __future__ import annotations

import pytest

from . import flows, particles, steps
from .case import CASES, judge, rows

TEXTS = ("title", "hard", "others", "ours", "conserved")


def test_cases_and_rows_are_the_same() -> None:
    modules = {function.__module__ for function in CASES.values()}
    assert modules == {module.__name__ for module in (flows, particles, steps)}
    assert set(CASES) == set(rows())


def test_rows_are_complete() -> None:
    for row in rows().values():
        assert all(row[text] for text in TEXTS)
        for form in ("reduced", "full"):
            assert set(row[form]) == {"particles", "steps", "seconds", "limits"}
            assert row[form]["limits"]
        assert set(row["reduced"]["limits"]) <= set(row["full"]["limits"])


@pytest.mark.parametrize("name", CASES)
def test_reduced(name: str) -> None:
    judge(name, full=False)
