"""Self-diffusion of water against size: every case of Table 7 of Yang (2013)."""

from __future__ import annotations

import pytest

from sdpd.diffusion import TABLES, Study, run_study
from tests.validation import diffusion_claims as claims

CORE_MINUTES = 1.0


@pytest.fixture(scope="module")
def study() -> Study:
    return run_study(cases=tuple(TABLES["water"]), core_minutes=CORE_MINUTES, progress=False)


def test_every_case_reaches_its_limits(study: Study) -> None:
    assert len(study.results) == 10
    assert study.passed, study.failures


def test_short_time_diffusion_is_the_exact_one(study: Study) -> None:
    claims.check_short_times(study)


def test_temperature_and_its_variance(study: Study) -> None:
    claims.check_temperature(study)


def test_both_long_time_estimates_agree(study: Study) -> None:
    claims.check_long_times(study)


def test_scaling_with_size(study: Study) -> None:
    claims.check_scaling(study)


def test_the_record_is_written(study: Study) -> None:
    claims.write_record("diffusion_water", study)
