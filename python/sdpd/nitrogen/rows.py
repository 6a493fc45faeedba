"""Quantities of a case beside what is exact or expected, with the accuracy of what is expected."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis.estimate import Estimate
from sdpd.fluctuations.predictions import DensityPrediction
from sdpd.nitrogen.cases import FROZEN, PUBLISHED_PARTICLES, Case
from sdpd.nitrogen.transport import Transport
from sdpd.scene import Scene

__all__ = [
    "LARGEST_ERROR",
    "LARGEST_T",
    "QUICK_ERROR",
    "ROUGH",
    "Row",
    "means_and_variances",
    "transport",
]

Array = NDArray[np.float64]

# In standard errors, with 31 degrees of freedom: p = 4e-4. In the twelve cases whose particles move
# 147 rows are judged (viscosity in seven of them). T, T_kin, c_rms and Var V of a case are one
# statistic, as its energy is kept: 111 are left, and one of them is beyond with a probability of
# 0.04 (Bonferroni).
LARGEST_T = 4.0
LARGEST_ERROR = 0.007  # relative, of what is judged
QUICK_ERROR = 0.06  # likewise, in a quick run
ROUGH = 0.1  # accuracy beyond which a row guards against gross faults only


@dataclass(frozen=True)
class Row:
    """A quantity of a case beside what is expected and what was published.

    Attributes
    ----------
    name, unit : str
    measured : Estimate
    expected : float
        nan where there is no theory.
    published : float or None
    judged : bool
        Whether there is a prediction of stated accuracy, and particles move.
    analytical : float or None
        "Analytical" value of the dissertation.
    accuracy : float
        Of the expected value [as measured]; 0 where it is exact.
    expected_stderr : float
        Standard error of the expected value, where it is a mean over arrangements.
    largest_error : float
        Relative standard error up to which a verdict means something.
    """

    name: str
    unit: str
    measured: Estimate
    expected: float
    published: float | None
    judged: bool
    analytical: float | None = None
    accuracy: float = 0.0
    expected_stderr: float = 0.0
    largest_error: float = LARGEST_ERROR

    @property
    def t(self) -> float:
        """Distance beyond the accuracy of what is expected, in standard errors."""
        away = self.measured.value - self.expected
        beyond = math.copysign(max(0.0, abs(away) - self.accuracy), away)
        error = self._error
        if error == 0.0:
            return math.copysign(math.inf, beyond) if beyond else 0.0
        return beyond / error

    @property
    def _error(self) -> float:
        return math.hypot(self.measured.stderr, self.expected_stderr)

    @property
    def relative(self) -> float:
        """Standard error of the difference over what was measured [1]."""
        return self._error / abs(self.measured.value) if self.measured.value else math.inf

    @property
    def rough(self) -> bool:
        """Whether the accuracy is beyond `ROUGH` of what is expected."""
        return self.accuracy > ROUGH * abs(self.expected)

    @property
    def passed(self) -> bool:
        """Within `LARGEST_T` standard errors that are small enough to tell; else not judged."""
        if not self.judged:
            return True
        return abs(self.t) < LARGEST_T and self.relative <= self.largest_error


def means_and_variances(
    case: Case, scene: Scene, mean: float, dt: float, blocks: Array
) -> tuple[Row, ...]:
    """Rows of what is exact (T, V, P at the mean density) and of the density's random phases.

    `mean` is the temperature of the energy of the run, `blocks` are means of `measure._state`.
    """
    moves = scene.stiffness < FROZEN
    mass, boltzmann = scene.particle_mass, scene.fluid.boltzmann_constant
    number, k = scene.n_particles, scene.heat_capacity_number
    whole = number * k + 1.5 * (number - 1)
    gas = boltzmann / (scene.fluid.molecular_mass or 1.0)
    warm = (whole - k) / (k * (whole + 1.0))
    t, var_t, rho, var_rho, p, var_p, square = blocks.T
    density = float(rho.mean())
    expected, near, v, rough = _density(scene, dt, mean)
    pressure = _estimate(p)
    apart = _estimate(p - gas * rho * t)  # T and rho of a particle are independent
    unit = (density * gas * mean) ** 2
    scale = float(PUBLISHED_PARTICLES)
    return (
        Row("T", "K", _estimate(t), mean, case.temperature, moves),
        Row("T_kin", "K", _estimate(square * mass / boltzmann), mean, case.temperature, moves),
        Row(
            "c_rms",
            "m/s",
            _estimate(np.sqrt(3.0 * square)),
            math.sqrt(3.0 * boltzmann * mean / mass),
            case.speed,
            moves,
        ),
        Row(
            "rho",
            "kg/m^3",
            _estimate(rho),
            expected,
            case.density,
            moves and math.isfinite(expected),
            accuracy=near,
        ),
        Row(
            "P",
            "Pa",
            Estimate(pressure.value, apart.stderr, len(p)),
            pressure.value - apart.value,
            case.pressure,
            moves,
        ),
        Row(
            "Var T",
            "K^2",
            _estimate(var_t),
            warm * mean**2,
            scale * case.temperature_variance,
            moves,
            scale * case.box_temperature_variance,
        ),
        Row(
            "Var V",
            "m^2/s^2",
            _estimate(3.0 * square),
            3.0 * boltzmann * mean / mass,
            scale * case.velocity_variance,
            moves,
            scale * case.box_velocity_variance,
        ),
        Row(
            "Var rho",
            "kg^2/m^6",
            _estimate(var_rho),
            v * density**2,
            scale * case.density_variance,
            moves and math.isfinite(v),
            scale * case.box_density_variance,
            accuracy=rough * v * density**2,
        ),
        Row(
            "Var P",
            "Pa^2",
            _estimate(var_p),
            (warm + v + warm * v) * unit,
            scale * case.pressure_variance,
            moves and math.isfinite(v),
            scale * case.box_pressure_variance,
            accuracy=rough * v * (1.0 + warm) * unit,
        ),
    )


def transport(case: Case, scene: Scene, found: Transport) -> tuple[Row, ...]:
    """Rows of the coefficients."""
    moves = scene.stiffness < FROZEN
    caged = found.expected_long if moves else math.nan
    return (
        Row(
            "D short",
            "m^2/s",
            found.short,
            found.exact.value,
            None,
            moves,
            expected_stderr=found.exact.stderr,
        ),
        Row("D long", "m^2/s", found.long, caged, case.diffusion, False),
        Row(
            "eta",
            "Pa s",
            found.viscosity,
            found.expected_viscosity,
            case.viscosity,
            moves and found.stress_known,
            accuracy=found.viscosity_accuracy,
        ),
        Row("eta long", "Pa s", found.long_viscosity, math.nan, None, False),
        Row(
            "kappa",
            "W/(m K)",
            found.conductivity,
            found.expected_conductivity,
            None,
            moves,
            accuracy=found.conductivity_accuracy,
        ),
        *_waves(scene, found),
    )


def _waves(scene: Scene, found: Transport) -> tuple[Row, ...]:
    """Shear waves of equilibrium beside those put in, where particles are stiff and move."""
    if found.wave is None or found.wave_temperature is None or found.response is None:
        return ()
    put_in = found.response.viscosity
    return (
        Row("T wave", "K", found.wave_temperature, scene.fluid.temperature, None, True),
        Row(
            "eta wave",
            "Pa s",
            found.wave,
            put_in.value,
            None,
            found.flows,
            expected_stderr=put_in.stderr,
        ),
    )


def _estimate(series: Array) -> Estimate:
    error = float(series.std(ddof=1) / math.sqrt(len(series)))
    return Estimate(float(series.mean()), error, len(series))


def _density(scene: Scene, dt: float, mean: float) -> tuple[float, float, float, float]:
    """Mean over particles and its accuracy, relative variance and its relative accuracy.

    In the random-phase approximation at the step; nan beyond the pairing limit.
    """
    try:
        theory = DensityPrediction(scene, dt, mean)
    except ValueError:
        return math.nan, 0.0, math.nan, 0.0
    rho = scene.fluid.density
    return (
        rho * (1.0 + theory.bias),
        rho * theory.accuracy("mean"),
        theory.variance,
        theory.accuracy("variance"),
    )
