"""The models of walls beside each other: what each of them gets right, and what it does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.validation import record
from tests.validation.channel import script

module = script("wall_models")
FOUND: dict[str, dict[str, Any]] = {name: {} for name in module.MODELS}
# Kinetic temperature of the layer along the wall and across, over that of the bath: within these.
# Noise and drag are in balance with symmetric images, completion and frozen particles; the force of
# the completed density with the pressure of images is no gradient and heats.
TEMPERATURES = {
    "symmetric": ((0.99, 1.01), (0.985, 1.015)),
    "own foot": ((0.62, 0.74), (0.53, 0.65)),
    "own foot, noise": ((0.92, 0.97), (0.89, 0.95)),
    "completion": ((0.995, 1.04), (0.99, 1.04)),
    "completion, own pressure": ((0.98, 1.04), (0.97, 1.04)),
    "frozen": ((0.99, 1.01), (0.985, 1.015)),
}

pytestmark = pytest.mark.filterwarnings("ignore::sdpd.TimeStepWarning")


@pytest.mark.parametrize("name", module.MODELS)
def test_energy(name: str) -> None:
    """Conserved to second order where the force is a gradient; else it never comes to rest."""
    coarse, fine = (module.energy_error(name, dt) for dt in (0.01, 0.005))
    if name == "symmetric":
        assert fine < 0.2 and 2.0 < coarse / fine < 6.0
    elif name == "frozen":
        assert fine < 0.5
    else:
        assert fine > 5.0 and coarse / fine < 3.0
    FOUND[name]["energy"] = [coarse, fine]


def test_the_energy_error_is_a_hundredth_of_that_of_own_foot_images() -> None:
    errors = {name: found["energy"][1] for name, found in FOUND.items()}
    assert errors["own foot"] > 100.0 * errors["symmetric"]


def test_density_in_the_mean_field() -> None:
    """At a cylinder of R = 5h own-foot images are off by 4.9 %, symmetric ones by 0.03 %."""
    heights = np.linspace(0.0, 0.98, 25)

    def largest(name: str) -> float:
        return max(np.abs(module.mean_field(name, side, heights)).max() for side in (-1.0, 1.0))

    assert 0.045 < largest("own foot") < 0.052
    assert largest("symmetric") < 3e-4
    assert largest("completion") < 6e-4


@pytest.mark.parametrize("name", module.MODELS)
def test_temperature_and_crossings(name: str) -> None:
    found = module.layer(name)
    for part, (low, high) in zip(("along", "across"), TEMPERATURES[name], strict=True):
        value, error = found[part]
        assert error < 0.006, "too few samples to see a fault"
        assert low < value < high, part
        if name in ("symmetric", "frozen"):
            assert abs(value - 1.0) < 4.5 * error, part
    FOUND[name] |= found


@pytest.mark.parametrize("kind", ["pipe", "post"])
@pytest.mark.parametrize("name", module.MODELS)
def test_density_at_round_walls(name: str, kind: str) -> None:
    """Of a fluid that moves: the pressure levels the density that particles feel, not theirs."""
    value, error = module.wall_density(name, kind)
    assert error < 0.002
    off = abs(value - 1.0)
    if name == "symmetric":
        assert off < 0.01
    elif name == "completion, own pressure":
        assert off > 0.05  # particles sit on the wall
    FOUND[name][kind] = [value, error]


@pytest.mark.parametrize("name", module.MODELS)
def test_slip(name: str) -> None:
    found = module.slip(name)
    assert abs(found) < (0.001 if name in ("symmetric", "own foot") else 0.02)
    FOUND[name]["slip"] = found


def test_particles_cross_where_the_pressure_is_that_of_the_completion() -> None:
    assert FOUND["completion, own pressure"]["crossings"] > 5.0 * FOUND["symmetric"]["crossings"]


def test_the_record_is_written() -> None:
    for name, ratio in module.cost().items():
        FOUND[name]["cost"] = ratio
    parts = {"energy", "along", "across", "crossings", "pipe", "post", "slip", "cost"}
    assert all(set(found) == parts for found in FOUND.values()), "a case failed"
    record.store("wall_models", FOUND)
