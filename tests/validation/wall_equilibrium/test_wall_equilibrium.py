"""Temperature, density, current and torque next to walls, with noise: planes, corners, R = 5h."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation import record
from tests.validation.channel import script

module = script("wall_equilibrium")
# Allowed deviation of the temperature in a layer of one spacing, and of the density.
LIMITS = {
    "slab": 0.005,
    "duct": 0.005,
    "pipe": 0.01,
    "wide pipe": 0.01,
    "post": 0.01,
    "sphere": 0.01,
    "wide sphere": 0.01,
}
DENSITY = 0.005
FOUND: dict[str, dict[str, list[float]]] = {}


@pytest.mark.parametrize("kind", LIMITS)
def test_equilibrium(kind: str) -> None:
    found = module.measure(kind)
    limit = LIMITS[kind]
    assert np.all(found.temperature_error < 0.4 * limit), "too few samples to see a fault"
    off = np.abs(found.temperature - 1.0)
    assert np.all(off < limit)
    assert np.all(off / found.temperature_error < 4.5)
    assert np.all(found.density_error < 0.2 * DENSITY)
    assert np.all(np.abs(found.density - 1.0) < DENSITY)
    assert found.current < 5.0
    assert found.torque < 4.5
    FOUND[kind] = {
        "temperature": found.temperature.tolist(),
        "temperature_error": found.temperature_error.tolist(),
        "density_over_mean": found.density.tolist(),
        "density_error": found.density_error.tolist(),
    }


def test_the_record_is_written() -> None:
    assert set(FOUND) == set(LIMITS), "a case failed"
    record.store("wall_equilibrium", FOUND)
