"""Thermal Couette flow of nitrogen: profiles, stress and heat against the closed form, absolute."""

from __future__ import annotations

import pytest

from tests.validation import channel, record

CASE = "thermal_couette"


def test_profiles_stress_and_heat() -> None:
    script = channel.script("thermal_couette")
    found = {
        name: script.measure(*arguments, script.BINS, 1200, 400)
        for name, arguments in script.CASES.items()
    }
    published, heated = found["published"], found["heated"]
    assert published.exact.stress == pytest.approx(5.557, abs=5e-4)
    assert max(published.errors) < 0.01
    assert max(heated.errors) < 0.025
    for case in found.values():
        assert case.stress == pytest.approx(case.exact.stress, rel=0.02)
        assert case.heat == pytest.approx(case.exact.heat, rel=0.02)
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
