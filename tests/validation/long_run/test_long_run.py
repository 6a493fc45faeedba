"""Ten million steps of equilibrium: nothing drifts."""

from __future__ import annotations

from tests.hard import steps
from tests.hard.case import judge
from tests.validation import record


def test_ten_million_steps() -> None:
    name = steps.ten_million_steps.__name__
    record.store("long_run", {name: judge(name, full=True)})
