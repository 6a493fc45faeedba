"""Duct, pipe, Taylor-Couette cell, Stokes' plate and plug flow against their closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.validation import record
from tests.validation.channel import script

module = script("wall_flows")
FOUND: dict[str, Any] = {}


def kept(name: str, flow: Any) -> Any:
    """Numbers of a steady flow, kept for the record."""
    FOUND[name] = {
        "particles": flow.particles,
        "rms_error": flow.profile.rms,
        "largest_error": flow.profile.worst,
        "delivered_viscosity": flow.delivered,
        **flow.integrals,
    }
    return flow


def test_square_duct_is_its_series_within_one_per_cent() -> None:
    flow = kept("duct", module.duct(24))
    assert flow.profile.rms < 0.005 and flow.profile.worst < 0.01
    assert flow.integrals["mean velocity"] == pytest.approx(1.0, abs=0.015)
    assert flow.integrals["drag of four walls"] == pytest.approx(1.0, abs=1e-3)


def test_round_pipe_is_parabolic_within_one_and_a_half_per_cent() -> None:
    flow = kept("pipe", module.pipe(31))
    assert flow.profile.rms < 0.01 and flow.profile.worst < 0.015
    assert flow.integrals["mean velocity"] == pytest.approx(1.0, abs=0.02)
    assert flow.integrals["drag of the wall"] == pytest.approx(1.0, abs=1e-3)


def test_torques_of_a_taylor_couette_cell_balance_and_converge() -> None:
    coarse = kept("taylor_couette_41", module.taylor_couette(41))
    fine = kept("taylor_couette_81", module.taylor_couette(81))
    for flow, limit in ((coarse, 0.09), (fine, 0.05)):
        inner, outer = flow.integrals["torque, inner"], flow.integrals["torque, outer"]
        assert inner == pytest.approx(outer, rel=2e-3)
        assert inner == pytest.approx(1.0, abs=limit)
    # first order in h/R: half the support, half the error, with some room
    error = [1.0 - flow.integrals["torque, inner"] for flow in (coarse, fine)]
    assert error[1] < 0.7 * error[0]
    assert fine.profile.rms < 0.7 * coarse.profile.rms
    assert fine.profile.rms < 0.02


def test_general_friction_has_the_flow_but_not_the_torque_of_the_turning_body() -> None:
    """(dv/dr)/(dv/dr - v/r) of the torque at the inner wall: 5/8 for twice the radius."""
    flow = kept("taylor_couette_general", module.taylor_couette(81, central=False))
    assert flow.profile.rms < 0.005 and flow.profile.worst < 0.01
    assert flow.integrals["torque, outer"] == pytest.approx(1.0, abs=0.04)
    assert flow.integrals["torque, inner"] == pytest.approx(0.625, abs=0.04)


def test_an_oscillating_plate_drives_stokes_layer() -> None:
    plate = module.oscillating_plate(48, 3.6)
    assert plate.rms < 0.002
    assert max(p.worst for p in plate.profiles.values()) < 0.01
    assert plate.amplitude == pytest.approx(1.0, abs=0.005)
    assert abs(plate.phase) < 0.5
    FOUND["oscillating_plate"] = {
        "particles": plate.particles,
        "rms_error": plate.rms,
        "stress_amplitude": plate.amplitude,
        "stress_phase_degrees": plate.phase,
    }


def test_plug_flow_between_slipping_plates_keeps_its_momentum() -> None:
    plug = module.plug_flow(1600)
    assert plug.momentum_change < 1e-13
    assert plug.quiet_spread < 1e-12
    # ten bins of one ensemble: flat within its noise
    assert np.abs(plug.z).max() < 4.5
    FOUND["plug_flow"] = {
        "momentum_change": plug.momentum_change,
        "quiet_spread": plug.quiet_spread,
        "largest_z": float(np.abs(plug.z).max()),
    }


def test_the_record_is_written() -> None:
    assert len(FOUND) == 7, "a case failed"
    record.store("wall_flows", FOUND)
