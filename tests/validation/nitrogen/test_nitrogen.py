"""Tables 9 to 11 of Yang (2013): all cases whose particles move, every prediction judged."""

from __future__ import annotations

import math
from functools import cache

import pytest

from sdpd import nitrogen
from tests.validation import record

CASE = "nitrogen"
MOVING = tuple(range(1, 13))
UNKNOWN_STRESS = tuple(range(5, 13))  # stiff
FLOWING = (7, 8, 12)  # of those, with one viscosity at first and twenty times later
SOLID = (9, 10)  # a glass and a crystal
ROUGH_DIFFUSION = (9,)  # a glass: an error of 0.7 % would take a run thirteen times as long
JUDGED = 12 * len(MOVING) + len(FLOWING)  # eta of the others gives way to T wave
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
    # 0.7 % are asked for; the error is itself known to a fifth
    assert transport.long.relative < (0.04 if number in ROUGH_DIFFUSION else 0.0085)


@pytest.mark.parametrize("number", UNKNOWN_STRESS)
def test_waves_of_equilibrium_die_like_waves_put_in(number: int) -> None:
    """Onsager's regression, exact in every state; a viscosity only where it stays one."""
    transport = study().cases[MOVING.index(number)].transport
    assert transport is not None and transport.wave is not None
    response = transport.response
    assert response is not None
    assert abs(transport.wave.z(response.viscosity)) < 4.0
    assert transport.wave.relative < 0.01 and response.viscosity.relative < 0.004
    assert transport.flows == (number in FLOWING)
    # particles leave their places in the run, or stay where they are, as in solids
    if number in FLOWING:
        assert transport.moved > 1.0
    if number in SOLID:
        assert transport.moved < 0.4 and response.growth.value > 2.0


def test_all_that_is_predicted_is_judged() -> None:
    rows = [row for found in study().cases for row in found.rows]
    assert sum(row.judged for row in rows) == JUDGED
    free = {row.name for row in rows if not row.judged}
    assert free == {"D long", "eta", "eta long", "eta wave"}
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
                "expected": _finite(row.expected),
                "expected_stderr": row.expected_stderr,
                "accuracy": row.accuracy,
                "t": row.t if row.judged else None,
            }
            for row in found.rows
        }
        for found in study().cases
    }
    for found in study().cases:
        transport = found.transport
        assert transport is not None
        more: dict[str, float | None] = {"moved": transport.moved}
        if transport.response is not None:
            growth = transport.response.growth
            more |= {"growth": _finite(growth.value), "stderr": _finite(growth.stderr)}
        numbers[f"case {found.case.number}"]["flow"] = more
    record.store(CASE, numbers)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
