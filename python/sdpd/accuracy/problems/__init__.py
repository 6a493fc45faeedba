"""The ready problems: one file and one row each."""

from __future__ import annotations

from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems.couette import COUETTE
from sdpd.accuracy.problems.cylinder import CYLINDER
from sdpd.accuracy.problems.density_variance import DENSITY_VARIANCE
from sdpd.accuracy.problems.diffusion import DIFFUSION
from sdpd.accuracy.problems.energy_slope import ENERGY_SLOPE
from sdpd.accuracy.problems.poiseuille import POISEUILLE
from sdpd.accuracy.problems.shear_wave import SHEAR_WAVE
from sdpd.accuracy.problems.taylor_green import TAYLOR_GREEN
from sdpd.accuracy.problems.temperature import TEMPERATURE
from sdpd.accuracy.problems.temperature_variance import TEMPERATURE_VARIANCE
from sdpd.accuracy.problems.thermal_couette import THERMAL_COUETTE

__all__ = ["PROBLEMS"]

PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (
        POISEUILLE,
        COUETTE,
        CYLINDER,
        TAYLOR_GREEN,
        TEMPERATURE,
        DENSITY_VARIANCE,
        TEMPERATURE_VARIANCE,
        DIFFUSION,
        SHEAR_WAVE,
        THERMAL_COUETTE,
        ENERGY_SLOPE,
    )
}
