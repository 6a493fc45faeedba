"""Thermal Couette flow of nitrogen: profiles, stress and heat against the closed form, absolute."""

from __future__ import annotations

import pytest

from tests.validation import channel, record

CASE = "thermal_couette"


def test_profiles_stress_and_heat() -> None:
    script = channel.script("thermal_couette")
    found = {name: script.run(flow) for name, flow in script.CASES.items()}
    assert found["published"].exact.stress == pytest.approx(5.557, abs=5e-4)
    assert script.CASES["heated"].brinkman > 30.0
    assert script.CASES["Re = 198"].reynolds == pytest.approx(198.0, rel=0.01)
    for name, case in found.items():
        power = case.exact.stress * script.CASES[name].speed
        assert max(case.errors) < 0.01, name
        assert case.stress == pytest.approx(case.exact.stress, rel=0.02)
        # one of the two may all but vanish where conduction and friction balance
        assert case.heat == pytest.approx(case.exact.heat, rel=0.02, abs=0.005 * power)
        assert abs(case.balance) < 1e-12
    record.store(
        CASE,
        {
            name: {
                "velocity_error": case.errors[0],
                "temperature_error": case.errors[1],
                "stress_over_exact": case.stress / case.exact.stress,
                "heat_over_exact": [a / b for a, b in zip(case.heat, case.exact.heat, strict=True)],
                "energy_balance": case.balance,
            }
            for name, case in found.items()
        },
    )
