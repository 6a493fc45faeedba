"""Flow through a cylinder array: velocity, pressure, drag against Navier and Stokes."""

from __future__ import annotations

from typing import Any

import pytest

from sdpd.theory import cylinder_array_drag
from tests.validation import record
from tests.validation.channel import script

module = script("cylinder")
FOUND: dict[str, Any] = {}


def kept(name: str, flow: Any) -> Any:
    """What every run must do, and its numbers for the record."""
    # the wall takes what the body force gives: in the mean, and step by step to rounding
    assert flow.drag == pytest.approx(1.0, abs=0.01)
    assert flow.imbalance < 1e-9
    assert flow.mean_velocity_error < 0.005
    velocity, pressure = flow.deviations("velocity"), flow.deviations("pressure")
    FOUND[name] = {
        "particles": flow.particles,
        "mean_velocity": flow.mean_velocity,
        "mean_velocity_error": flow.mean_velocity_error,
        "delivered_viscosity": flow.delivered,
        "mean_velocity_at_delivered": flow.at_delivered,
        "drag": flow.drag,
        "imbalance": flow.imbalance,
        "velocity_rms_and_largest": list(velocity),
        "pressure_rms_and_largest": list(pressure),
    }
    return flow


def test_as_published_within_three_per_cent() -> None:
    flow = kept("published", module.measure(module.published_scene()))
    assert flow.particles == 17632
    assert flow.mean_velocity == pytest.approx(1.0, abs=0.03)
    assert flow.deviations("velocity")[0] < 0.03
    assert flow.deviations("pressure")[0] < 0.05


def test_in_two_dimensions_within_one_per_cent() -> None:
    flow = kept("finest", module.measure(module.plane_scene(*module.FINEST)))
    assert flow.mean_velocity == pytest.approx(1.0, abs=0.01)
    assert flow.deviations("velocity")[0] < 0.01
    assert flow.deviations("pressure")[0] < 0.05


def test_drag_at_a_small_reynolds_number_is_that_of_sangani_and_acrivos() -> None:
    flow = kept("slow", module.measure(module.plane_scene(51, 5.0, slower=module.SLOWER)))
    drag = module.slow_drag(flow)
    assert drag == pytest.approx(cylinder_array_drag(module.FRACTION), rel=0.03)
    FOUND["slow"]["drag_over_eta_u"] = drag


def test_the_record_is_written() -> None:
    assert len(FOUND) == 3, "a case failed"
    record.store("cylinder", FOUND)
