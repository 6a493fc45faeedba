"""What the studies of Tables 7 and 8 of Yang (2013) must show, by z-score."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from sdpd.analysis import bonferroni
from sdpd.diffusion import Study, rows
from tests.validation import record

KEPT = (
    "temperature_K",
    "temperature_variance_over_exact",
    "density_kg_m3",
    "D_short_m2_s",
    "D_short_exact_m2_s",
    "D_long_msd_m2_s",
    "D_long_integral_m2_s",
    "Sc_short",
    "Sc_long_msd",
)
PLAIN = ("D_continuum_m2_s", "D_bird_m2_s", "D_dissertation_m2_s", "D_mean_field_m2_s")


def check_short_times(study: Study) -> None:
    """The slope of the VACF against the exact rate, case by case and all together."""
    z = np.array([result.deviation for result in study.results])
    for result in study.results:
        assert result.short.relative <= 0.02, "too few samples to see a fault"
    assert (np.abs(z) <= 3.0).all(), z
    # 31 degrees of freedom: the variance of t is 31/29
    assert stats.chi2.sf(float(z @ z) * 29.0 / 31.0, z.size) > 1e-3
    # The mean over cases sees a fault of all of them that none shows alone.
    errors = np.array([result.short.relative for result in study.results])
    assert math.sqrt(float(np.mean(errors**2)) / errors.size) < 0.004
    assert abs(float(z.mean())) * math.sqrt(z.size) < 3.3


def check_temperature(study: Study) -> None:
    """The mean and the variance in time of the kinetic temperature are exact at any step."""
    asked = study.results[0].scene.fluid.temperature
    means = [result.temperature for result in study.results]
    spreads = [result.temperature_variance for result in study.results]
    for mean, spread in zip(means, spreads, strict=True):
        assert mean.relative < 0.003 and spread.relative < 0.2
    p = [mean.p(asked) for mean in means] + [spread.p(1.0) for spread in spreads]
    assert not bonferroni(p, level=1e-3).rejected.any(), p


def check_long_times(study: Study) -> None:
    """Displacement and integral of the VACF."""
    for result in study.results:
        assert result.msd.relative <= 0.10 and result.integral.relative <= 0.10
        # Same trajectories, so the errors are correlated: a bound from above.
        assert abs(result.msd.z(result.integral)) < 4.0


def check_scaling(study: Study) -> None:
    """D goes as 1/dx at a given h/dx, and no formula of the dissertation has its size."""
    for result, theory in zip(study.results, study.collective, strict=True):
        lead, exact = result.formulas, result.exact.value
        assert math.isclose(lead.continuum / lead.dissertation, 2.7, rel_tol=1e-12)
        # discreteness: a particle has no friction with itself
        assert 1.05 < exact / lead.continuum < 1.25
        # mean field of the short-time coefficient, and of the way to long times
        assert abs(theory.short / exact - 1.0) < 0.015
        slack = 0.06 * exact + 4.0 * result.msd.stderr
        assert abs(result.msd.value - theory.long - _to_come(result, theory)) < slack
        assert result.msd.z(lead.dissertation) > 10.0 and result.msd.z(lead.bird) > 10.0


def _to_come(result: object, theory: object) -> float:
    """Caging that builds up beyond the lags of the displacement."""
    first = 0.0 if result.msd.window is None else result.msd.window[0]  # type: ignore[attr-defined]
    return float(theory.remaining(first)) * theory.short  # type: ignore[attr-defined]


def write_record(name: str, study: Study) -> None:
    """Numbers of all cases into results.json."""
    numbers = {}
    for row in rows(study):
        kept = {key: row[key] for key in (*KEPT, *PLAIN)}
        kept |= {f"{key}_stderr": row[f"{key}_stderr"] for key in KEPT}
        kept["z_short"] = row["short_deviation_in_standard_errors"]
        numbers[f"case {row['case']}"] = kept
    record.store(name, numbers)
    assert set(record.load()[name]["numbers"]) == set(numbers)
