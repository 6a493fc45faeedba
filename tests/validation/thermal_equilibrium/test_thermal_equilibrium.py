"""Temperatures, their variance, densities and energy of a gas with C = 295, 25 and 5 k_B."""

from __future__ import annotations

import pytest

from tests.validation import channel, record

CASE = "thermal_equilibrium"
NUMBERS: dict[str, object] = {}


@pytest.mark.parametrize("capacity", [295.0, 25.0, 5.0])
def test_equilibrium_at_the_default_step(capacity: float) -> None:
    found = channel.script("energy").equilibrium(capacity, 6000)
    mean, error = found.temperature
    assert error < 2e-4 and abs(mean - 1.0) < 3.0 * error + 2e-6
    assert found.kinetic[1] < 0.001 and abs(found.kinetic[0] - 1.0) < 0.002 + 2.0 * found.kinetic[1]
    assert found.variance[1] < 0.002
    assert abs(found.variance[0] - 1.0) < 0.005 + 2.0 * found.variance[1]
    assert abs(found.correlation[0]) < 0.004 + 2.0 * found.correlation[1]
    assert abs(found.density[0] - 1.0) < 0.05 + 2.0 * found.density[1]
    assert abs(found.energy) < 1e-9
    NUMBERS[f"C/k_B = {capacity:g}"] = {
        "temperature": found.temperature,
        "kinetic": found.kinetic,
        "variance": found.variance,
        "correlation": found.correlation,
        "density_variance": found.density,
        "energy_change_over_kinetic": found.energy,
        "refused": found.refused,
    }


def test_the_books_keep_the_energy() -> None:
    script = channel.script("energy")
    slope, error = script.slope(1_000_000)
    assert abs(slope) < 1e-9 and error < 1e-9
    NUMBERS["slope_per_1e5_steps"] = (slope, error)
    kept, lost = (script.drift(0.27, 20000, books=books)[0] for books in (True, False))
    assert abs(kept) < 1e-9 and lost > 0.3
    NUMBERS["drift_without_books"] = lost
    record.store(CASE, NUMBERS)
