"""The main job at full length: self-diffusion of water against size (Yang 2013, table 7)."""

from __future__ import annotations

import pytest

from sdpd.diffusion.files import rows
from sdpd.diffusion.study import Study, run_study
from tests.validation import record

KEPT = ("temperature_K", "density_kg_m3", "D_short_m2_s", "D_short_exact_m2_s", "D_long_msd_m2_s")


@pytest.fixture(scope="module")
def study() -> Study:
    return run_study(progress=False)


def test_every_case_reaches_its_limits(study: Study) -> None:
    assert study.passed, study.failures


def test_short_time_diffusion_is_the_exact_one(study: Study) -> None:
    for result in study.results:
        assert result.short.relative <= 0.02, "too few samples to see a fault"
        assert abs(result.deviation) <= 3.0


def test_both_long_time_estimates_agree(study: Study) -> None:
    for result in study.results:
        assert result.msd.relative <= 0.10 and result.integral.relative <= 0.10
        # Same trajectories, so the errors are correlated: a bound from above.
        assert abs(result.msd.z(result.integral)) < 4.0


def test_the_record_is_written(study: Study) -> None:
    numbers = {}
    for row in rows(study):
        kept = {name: row[name] for name in KEPT} | {
            f"{n}_stderr": row[f"{n}_stderr"] for n in KEPT
        }
        kept["D_long_integral_m2_s"] = row["D_long_integral_m2_s"]
        kept["D_long_integral_m2_s_stderr"] = row["D_long_integral_m2_s_stderr"]
        kept["z_short"] = row["short_deviation_in_standard_errors"]
        numbers[f"case {row['case']}"] = kept
    record.store("diffusion_water", numbers)
    assert set(record.load()["diffusion_water"]["numbers"]) == set(numbers)
