"""Conductivity of the thermal fluid: equilibrium, imposed gradient and lattice beside each other.

m = dx = k_B = T_0 = 1, X = 100, Lucy 2.64: fluids in which conduction rules and fluids in which
friction and motion carry much of the heat, in two and three dimensions.
"""

from __future__ import annotations

from functools import cache

import pytest

from sdpd.conductivity import Study
from tests.validation import channel, record

SCRIPT = channel.script("conductivity")


@cache
def study_of(name: str) -> Study:
    found: Study = SCRIPT.study(name)
    return found


@pytest.mark.parametrize("name", SCRIPT.CASES)
def test_ways_agree(name: str) -> None:
    study = study_of(name)
    assert study.passed, str(study)
    # in the thin fluid particles carry their energy far, which is the noisiest part
    assert study.equilibrium.helfand.relative < (0.03 if name == "liquid, thin" else 0.015)
    assert study.gradient.relative < 0.02
    assert abs(study.comparisons[0].z) < 3.0


@pytest.mark.parametrize("name", SCRIPT.CASES)
def test_parts_are_those_of_mean_field(name: str) -> None:
    study = study_of(name)
    found, expected = study.equilibrium, study.prediction
    conduction = found.shares["conduction"]
    # lattice and time step, and what disorder takes
    left = conduction.value / (expected.conduction * study.step_factor)
    assert 0.95 < left < 1.0
    friction = found.shares["friction"]
    # beyond the few per cent of the time step and of the arrangement
    assert abs(friction.value / expected.friction - 1.0) < 0.1 + 4.0 * friction.relative
    assert 0.4 < found.shares["convection"].value / expected.convection < 2.5


def test_record() -> None:
    record.store(
        "conductivity",
        {
            name: {
                "asked": study.asked,
                "lattice_decay": study.decay.delivered,
                "helfand": study.equilibrium.helfand.value,
                "helfand_stderr": study.equilibrium.helfand.stderr,
                "green_kubo": study.equilibrium.green_kubo.value,
                "green_kubo_stderr": study.equilibrium.green_kubo.stderr,
                "imposed_gradient": study.gradient.value,
                "imposed_gradient_stderr": study.gradient.stderr,
                "mean_field": study.prediction.total,
                "z": study.comparisons[0].z,
                **{f"{part}_alone": e.value for part, e in study.equilibrium.shares.items()},
            }
            for name, study in ((name, study_of(name)) for name in SCRIPT.CASES)
        },
    )
