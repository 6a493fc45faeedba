"""The velocity autocorrelation in 3D falls as t^(-3/2), with the amplitude of mode coupling.

Reduced units m = dx = kB T = 1. The fluid is as thin as it gets (eta* = 1, X = 10, Lucy,
h/dx = 2.2): the smaller nu + D_s, the more steps the momentum of a particle takes to spread over
some supports. A large box shows the power law before sound and shear come round; a small one shows
how the box cuts it off. Viscosity and diffusion are measured, nothing is fitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy import optimize

import sdpd
from sdpd import theory
from sdpd.analysis import Correlation, Estimate, einstein_diffusion
from sdpd.viscosity import run_viscosity
from tests.validation import record

ETA, STIFFNESS, SUPPORT = 1.0, 10.0, 2.2
# edge of the box, time sampled, lags compared
# The friction of the particle itself, exp(-t/tau), is over at some 10 tau = 2.6.
LARGE, SMALL = (32, 560.0, (2.8, 7.5)), (12, 5000.0, (2.8, 8.0))


def scene_of(edge: int) -> sdpd.Scene:
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=ETA,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    return sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=SUPPORT),
        start=sdpd.RandomStart(),
        sound_speed=math.sqrt(STIFFNESS),
    )


@dataclass(frozen=True)
class Tail:
    """One box: the VACF within the window of lags, and what theory makes of it."""

    vacf: Correlation
    window: tuple[float, float]
    free: np.ndarray  # t^(-3/2), infinite fluid
    modes: np.ndarray  # the waves of the box
    open_modes: np.ndarray  # the same with the momentum of the box free
    amplitude: Estimate  # measured over modes
    by_viscosity: float  # its relative error by that of the viscosity
    exponent: Estimate  # of the measured VACF, momentum of the box free
    modes_exponent: float  # that theory has in the same window


@cache
def delivered() -> Estimate:
    study = run_viscosity(
        scene_of(12), particles=1000, seed=3, time_factor=0.8, threads=1, progress=False
    )
    assert study.passed, str(study)
    found = study.viscosity
    slack = max(method.accuracy for method in study.methods)
    return Estimate(found.value, math.hypot(found.stderr, slack), found.n_effective)


@cache
def run(edge: int, time: float) -> tuple[Correlation, Estimate]:
    sim = sdpd.Simulation(scene_of(edge), seed=edge)
    sim.run(steps=250, progress=False)
    observer = sdpd.Correlator(every=3, points=36, levels=1)
    sim.run(steps=math.ceil(time / sim.dt), observe=observer, progress=False)
    diffusion = einstein_diffusion(observer.correlation("msd"), window=(3.0, 9.0))
    return observer.correlation("vacf"), diffusion


@cache
def tail_of(edge: int, time: float, window: tuple[float, float]) -> Tail:
    vacf, diffusion = run(edge, time)
    inside = (vacf.lag >= window[0]) & (vacf.lag <= window[1])
    t = vacf.lag[inside]
    number = edge**3

    def expected(viscosity: float, *, at_rest: bool = True) -> np.ndarray:
        return theory.vacf_modes(
            t,
            fluid=hydrodynamics(viscosity),
            friction=friction(),
            thermal_energy=1.0,
            self_diffusion=diffusion.value,
            box=(float(edge),) * 3,
            at_rest=at_rest,
        )

    eta = delivered()
    modes, open_modes = expected(eta.value), expected(eta.value, at_rest=False)
    amplitude = vacf.derive(
        lambda mean: float(mean[inside] @ modes / (modes @ modes)), window=window
    )
    more = expected(eta.value + eta.stderr)
    by_viscosity = abs(float(more @ modes / (modes @ modes)) - 1.0)
    exponent = vacf.derive(lambda mean: power(t, mean[inside] + 1.0 / number), window=window)
    free = theory.vacf_tail(
        t,
        fluid=hydrodynamics(eta.value),
        thermal_energy=1.0,
        self_diffusion=diffusion.value,
    )
    return Tail(
        vacf,
        window,
        free,
        modes,
        open_modes,
        amplitude,
        by_viscosity,
        exponent,
        power(t, open_modes),
    )


def hydrodynamics(viscosity: float) -> theory.HydrodynamicTheory:
    return theory.HydrodynamicTheory(
        dimension=3,
        density=1.0,
        shear_viscosity=viscosity,
        sound_speed=theory.isothermal_sound_speed(
            math.sqrt(STIFFNESS), thermal_energy=1.0, mass=1.0
        ),
    )


def friction() -> theory.FrictionTheory:
    return theory.FrictionTheory(
        kernel="lucy", dimension=3, support=SUPPORT, density=1.0, shear_viscosity=ETA
    )


def power(t: np.ndarray, values: np.ndarray) -> float:
    """p of A t^(-p), least squares of equal weights: the noise is the same at all lags."""
    scale = float(values[0])
    fit, _ = optimize.curve_fit(
        lambda x, log_a, p: np.exp(log_a) * x**-p, t / t[0], values / scale, p0=[0.0, 1.5]
    )
    return float(fit[1])


def test_power_law() -> None:
    tail = tail_of(*LARGE)
    assert tail.exponent.stderr < 0.15
    assert abs(tail.exponent.z(1.5)) < 3.5
    assert abs(tail.exponent.z(tail.modes_exponent)) < 3.5
    # What friction alone would leave has long died out.
    tau = scene_of(LARGE[0]).friction_time
    assert math.exp(-tail.window[0] / tau) < 0.1 * tail.free[0] * tail.amplitude.value
    assert math.sqrt(4.0 * delivered().value * tail.window[0]) > SUPPORT


@pytest.mark.parametrize("box", [LARGE, SMALL], ids=["large box", "small box"])
def test_amplitude(box: tuple[int, float, tuple[float, float]]) -> None:
    """Against the waves of the box with the measured viscosity and diffusion."""
    tail = tail_of(*box)
    error = math.hypot(tail.amplitude.stderr, tail.by_viscosity)
    assert error < 0.06
    # Mean field of independent waves: its next order is unknown, a few per cent.
    assert abs(tail.amplitude.value - 1.0) < 3.5 * error + 0.05


def test_box_cuts_the_tail() -> None:
    """Beyond L^2/(4 pi^2 (nu + D)) the small box has lost what the infinite fluid keeps."""
    tail = tail_of(*SMALL)
    inside = (tail.vacf.lag >= tail.window[0]) & (tail.vacf.lag <= tail.window[1])
    cut = tail.modes < (2.0 / 3.0) * tail.free  # where theory says that a third is lost
    assert cut.sum() >= 6
    form = np.where(cut, tail.free, 0.0) / (tail.free[cut] @ tail.free[cut])
    share = tail.vacf.derive(lambda mean: float(mean[inside] @ form), window=tail.window)
    assert share.stderr < 0.12
    assert share.z(1.0) < -4.0
    assert abs(share.z(float(form @ tail.modes))) < 3.5


def test_the_record_is_written() -> None:
    eta = delivered()
    numbers = {"eta_delivered": eta.value, "eta_delivered_stderr": eta.stderr, "eta_asked": ETA}
    for name, box in (("large", LARGE), ("small", SMALL)):
        tail, (vacf, diffusion) = tail_of(*box), run(*box[:2])
        inside = (vacf.lag >= 0.25) & (vacf.lag <= 1.5 * box[2][1])
        lags = (vacf.lag >= box[2][0]) & (vacf.lag <= box[2][1])

        def short(values: np.ndarray) -> list[float]:
            return [float(f"{value:.4g}") for value in values]

        numbers[name] = {
            "edge": box[0],
            "time": box[1],
            "window": list(box[2]),
            "self_diffusion": diffusion.value,
            "self_diffusion_stderr": diffusion.stderr,
            "exponent": tail.exponent.value,
            "exponent_stderr": tail.exponent.stderr,
            "exponent_modes": tail.modes_exponent,
            "amplitude": tail.amplitude.value,
            "amplitude_stderr": tail.amplitude.stderr,
            "amplitude_error_by_viscosity": tail.by_viscosity,
            "lag": short(vacf.lag[inside]),
            "vacf": short(vacf.mean[inside]),
            "stderr": short(vacf.stderr[inside]),
            "window_lag": short(vacf.lag[lags]),
            "window_modes": short(tail.modes),
        }
    record.store("long_time_tail", numbers)
    assert "long_time_tail" in record.load()
