"""Temperature, density, current and torque next to walls, with noise: planes, corners, R = 5h."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation import record
from tests.validation.channel import script

module = script("wall_equilibrium")
# Allowed deviation of the temperature in the first layer, and its largest standard error.
LIMITS = {"slab": 0.005, "duct": 0.005, "pipe": 0.01, "post": 0.01, "sphere": 0.01}
FOUND: dict[str, dict[str, list[float]]] = {}


@pytest.mark.parametrize("kind", LIMITS)
def test_equilibrium(kind: str) -> None:
    found = module.measure(kind)
    limit = LIMITS[kind]
    assert np.all(found.temperature_error < 0.5 * limit), "too few samples to see a fault"
    # within the limit, or a deviation that noise explains
    off = np.abs(found.temperature - 1.0)
    assert np.all(off < np.maximum(limit, 3.5 * found.temperature_error))
    assert np.all(off / found.temperature_error < 4.5)
    assert np.all(np.abs(found.density - 1.0) < 0.02)
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
