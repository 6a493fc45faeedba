"""Tables 9 to 11 of Yang (2013): all cases whose particles move, every prediction judged."""

from __future__ import annotations

from functools import cache

import pytest

from sdpd import nitrogen
from tests.validation import record

CASE = "nitrogen"
MOVING = tuple(range(1, 13))
UNKNOWN_STRESS = tuple(range(5, 13))  # stiff
JUDGED = 12 * len(MOVING) - len(UNKNOWN_STRESS)
ROUGH = {(number, "Var rho") for number in (1, 2, 5, 9, 10)}  # gross faults only


@cache
def study() -> nitrogen.Study:
    return nitrogen.run_nitrogen(MOVING, threads=1)


@pytest.mark.parametrize("number", MOVING)
def test_a_case_that_moves(number: int) -> None:
    found = study().cases[MOVING.index(number)]
    assert found.moves and abs(found.energy_change) < 1e-12
    for row in found.rows:
        # |t| < 4 beyond the stated accuracy, at standard errors below 0.7 %
        assert row.passed, f"{row.name}: t = {row.t:+.1f}, error {row.measured.relative:.2%}"
    assert found.passed
    transport = found.transport
    assert transport is not None
    assert transport.stress_known == (number not in UNKNOWN_STRESS)
    assert 0.3 < transport.long.value / transport.exact.value < 1.02


def test_all_that_is_predicted_is_judged() -> None:
    rows = [row for found in study().cases for row in found.rows]
    assert sum(row.judged for row in rows) == JUDGED
    free = {row.name for row in rows if not row.judged}
    assert free == {"D long", "eta", "eta long"}
    rough = {
        (each.case.number, row.name) for each in study().cases for row in each.rows if row.rough
    }
    assert rough == ROUGH


def test_variances_of_the_dissertation() -> None:
    """The published variance of T is that of C = 3/2 N k_B."""
    first = next(row for row in study().cases[0].rows if row.name == "Var T")
    assert (first.published or 0.0) / first.measured.value == pytest.approx(5 / 3, rel=0.03)


def test_record() -> None:
    numbers = {
        f"case {found.case.number}": {
            row.name: {
                "measured": row.measured.value,
                "stderr": row.measured.stderr,
                "expected": row.expected if row.expected == row.expected else None,
                "accuracy": row.accuracy,
                "t": row.t if row.judged else None,
            }
            for row in found.rows
        }
        for found in study().cases
    }
    record.store(CASE, numbers)
