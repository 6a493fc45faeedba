"""Transient channel flow with noise: means over 50 runs agree with the closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.validation import record
from tests.validation.channel import script

module = script("channel_noise")
FOUND: dict[str, Any] = {}


@pytest.mark.parametrize("kind", ["poiseuille", "couette"])
def test_the_ensemble_mean_is_the_closed_form(kind: str) -> None:
    moments = module.measure(kind, module.RUNS)
    freedom = module.RUNS - 1
    # Student's t for a fault in 200 bins of both flows; t^2 has the mean f/(f - 2)
    limit = stats.t.isf(0.5e-3 / 200.0, freedom)
    mean = module.BINS * freedom / (freedom - 2.0)
    for moment in moments:
        assert moment.error.max() < 0.02 * module.TOP, "too few runs to see a fault"
        assert np.abs(moment.from_quiet).max() < limit
        assert np.sum(moment.from_quiet**2) < mean + 5.0 * np.sqrt(2.0 * mean)
        ratio, error = moment.mean_flow
        assert error < 0.015
        # the step of the splitting and 20 layers take 0.8 % of the viscosity, with or without noise
        assert abs(ratio - 1.0) < 0.01 + 4.0 * error
        assert np.abs(moment.deviation).max() < limit
    FOUND[kind] = {
        f"{moment.time:g} s": {
            "chi_square": float(np.sum(moment.deviation**2)),
            "chi_square_without_noise": float(np.sum(moment.from_quiet**2)),
            "largest_z": float(np.abs(moment.deviation).max()),
            "error_over_maximum": float(moment.error.mean() / module.TOP),
            "mean_flow": list(moment.mean_flow),
        }
        for moment in moments
    }


def test_the_record_is_written() -> None:
    assert len(FOUND) == 2, "a case failed"
    record.store("channel_noise", {**FOUND, "runs": module.RUNS, "bins": module.BINS})
