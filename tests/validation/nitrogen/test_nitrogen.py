"""Tables 9 to 11 of Yang (2013): all cases whose particles move, with their transport."""

from __future__ import annotations

import pytest

from sdpd import nitrogen
from tests.validation import record

CASE = "nitrogen"
MOVING = tuple(range(1, 13))


def test_the_cases_that_move() -> None:
    study = nitrogen.run_nitrogen(MOVING, quick=True, threads=1)
    numbers = {}
    for found in study.cases:
        name = f"case {found.case.number}"
        assert found.moves and found.passed, name
        assert abs(found.energy_change) < 1e-12
        transport = found.transport
        assert transport is not None
        assert 0.3 < transport.long.value / transport.exact.value < 1.02, name
        if found.case.support > 2.7 * found.case.spacing:
            # the finest supports have a stress that outlasts the window
            assert transport.viscosity.relative < 0.03, name
            away = transport.viscosity.value / transport.expected_viscosity - 1.0
            assert abs(away) < 0.03 + 3.0 * transport.viscosity.relative, name
        conducted = next(row for row in found.rows if row.name == "kappa")
        assert conducted.measured.relative < 0.06 and abs(conducted.t) < 4.0, name
        numbers[name] = {
            row.name: {
                "measured": row.measured.value,
                "stderr": row.measured.stderr,
                "expected": row.expected if row.expected == row.expected else None,
            }
            for row in found.rows
        }
    assert study.passed
    # the variance of T is the published one with C = 3/2 N k_B
    first = next(row for row in study.cases[0].rows if row.name == "Var T")
    assert (first.published or 0.0) / first.measured.value == pytest.approx(5 / 3, rel=0.03)
    record.store(CASE, numbers)
