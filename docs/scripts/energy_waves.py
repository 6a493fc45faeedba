"""Waves of fluids with an energy: adiabatic sound and heat, beside the same fluids without one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from report import Report, grid, shown, subplots

import sdpd
from sdpd import correlations
from sdpd.correlations.energy_fits import EnergyWave
from sdpd.correlations.energy_wave import EnergyWavePrediction

BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"


@dataclass(frozen=True)
class Case:
    """A fluid with m = dx = k_B = T_0 = 1, X = 100, and gamma and Prandtl number of a real one."""

    name: str
    heat_ratio: float
    prandtl: float
    capacity: float  # C/k_B
    ideal: bool

    def scene(self, edge: int, *, energy: bool) -> sdpd.Scene:
        """In the plane, a wave as long as the box."""
        stiffness, eta = 100.0, 14.0
        slope = math.sqrt((self.heat_ratio - 1.0) * self.capacity * stiffness)
        law = sdpd.eos.IdealGas() if self.ideal else sdpd.eos.Linear(background_pressure=stiffness)
        fluid = sdpd.Fluid(
            density=1.0,
            shear_viscosity=eta,
            temperature=1.0,
            boltzmann_constant=1.0,
            heat_capacity=self.capacity,
            thermal_conductivity=eta * self.heat_ratio * self.capacity / self.prandtl,
            thermal_expansion=0.0 if self.ideal else slope / stiffness,
            equation_of_state=law,
        )
        return sdpd.Scene(
            fluid=fluid,
            box=sdpd.Box((float(edge), float(edge))),
            resolution=sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.65),
            start=sdpd.RandomStart(relax_steps=100),
            sound_speed=math.sqrt(stiffness),
            effects=sdpd.Effects(energy=energy),
        )


SIZE = {False: (12, 80), True: (8, 4)}  # particles along an edge, runs; by quick
CASES = (
    Case("gas like nitrogen", 1.4, 0.72, 250.0, True),
    Case("liquid like water", 1.05, 7.0, 50.0, False),
)


@cache
def study(case: Case, *, energy: bool, quick: bool = False) -> correlations.Study:
    """The longest wave of the box."""
    edge, runs = SIZE[quick]
    return correlations.run_correlations(
        case.scene(edge, energy=energy),
        waves=(1,),
        seed=1,
        runs=runs,
        quick=True,
        threads=1,
        progress=False,
    )


@dataclass(frozen=True)
class Found:
    """What was fitted to a case and what was expected: value, error, theory [1]."""

    rows: dict[str, tuple[float, float, float]]
    passed: bool


def numbers(warm: correlations.Study, cold: correlations.Study) -> Found:
    """Squared speeds over kT/m and diffusivities over nu."""
    [with_energy], [without] = warm.shells, cold.shells
    fit, theory = with_energy.fit, with_energy.prediction
    assert isinstance(fit, EnergyWave)
    assert isinstance(theory, EnergyWavePrediction)
    square, nu = theory.wave_number**2, warm.scene.fluid.kinematic_viscosity
    ratio = (fit.adiabatic_speed.value / without.fit.sound_speed.value) ** 2
    spread = (
        2.0 * ratio * math.hypot(fit.adiabatic_speed.relative, without.fit.sound_speed.relative)
    )
    wanted = (theory.adiabatic_speed / without.prediction.sound_speed) ** 2
    system = theory.system

    def row(estimate: sdpd.analysis.Estimate, expected: float) -> tuple[float, float, float]:
        return estimate.value, estimate.stderr, expected

    rows = {
        "$c_S$ with an energy": row(fit.adiabatic_speed, theory.adiabatic_speed),
        "$c$ without": row(without.fit.sound_speed, without.prediction.sound_speed),
        "$(c_S/c)^2$": (ratio, spread, wanted),
        "$\\gamma(k)$ of the coupled fit": row(fit.heat_ratio, theory.heat_ratio),
        "decay of heat over $\\nu k^2$": row(
            fit.heat_rate.scaled(1.0 / nu), system.heat_rate / square / nu
        ),
        "decay of sound over $\\nu k^2$": row(
            fit.sound_rate.scaled(1.0 / nu), system.sound_rate / square / nu
        ),
        "the same without an energy": row(
            without.fit.damping.scaled(1.0 / nu), without.prediction.damping / nu
        ),
    }
    return Found(rows, warm.passed and cold.passed)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("energy_waves", __doc__, argv)
    edge, runs = SIZE[report.quick]
    tables = []
    for case in CASES:
        warm, cold = (study(case, energy=e, quick=report.quick) for e in (True, False))
        found = numbers(warm, cold)
        cells = [
            [name, shown(value, error), f"{theory:.3f}", f"{(value - theory) / error:+.1f}"]
            for name, (value, error, theory) in found.rows.items()
        ]
        made = warm.scene
        length = warm.shells[0].wave_number * made.support_radius
        title = (
            f"**{case.name}**, $\\gamma={case.heat_ratio:g}$, Pr = {case.prandtl:g}, "
            f"$C={case.capacity:g}\\,k_B$, $kh={length:.2f}$"
        )
        tables += [title, grid(["", "measured", "theory", "SE off"], cells)]
        if case.ideal:
            report.figure(_draw(case, warm, cold))
    report.document(
        *tables,
        f"{edge**2} particles in the plane, {runs} runs each, $X=100$, $\\eta^*=14$, Wendland C2, "
        "$h/\\Delta x=2.65$; one standard error. Figure: functions over their value at $t=0$, "
        "that of energy with current over the root of both.",
    )


def _draw(case: Case, warm: correlations.Study, cold: correlations.Study) -> Any:
    """Density, current and energy against time."""
    figure, axes = subplots(3, width=9.6)
    gamma = f"$\\gamma={case.heat_ratio:g}$"
    figure.suptitle(f"{case.name}, {gamma}: measured (points) and theory (lines)", fontsize=10)
    drawn = (("density", warm, BLUE, "with an energy"), ("density", cold, VERMILION, "without"))
    _curves(axes[0], drawn, "density")
    drawn = (("longitudinal", warm, BLUE, ""), ("longitudinal", cold, VERMILION, ""))
    _curves(axes[1], drawn, "longitudinal current")
    drawn = (("energy", warm, GREEN, "energy"), ("energy_current", warm, BLUE, "with current"))
    _curves(axes[2], drawn, "energy, energy and current")
    axes[0].set_ylabel("correlation over its value at $t=0$")
    return figure


def _curves(axes: Any, drawn: Sequence[tuple[str, Any, str, str]], title: str) -> None:
    for name, found, colour, label in drawn:
        [shell] = found.shells
        unit = found.scene.sound.speed * shell.wave_number
        lag, mean, error = shell.normalized(name)
        inside = np.flatnonzero(lag * unit <= 9.0)[:: max(1, len(lag) // 40)]
        time = np.linspace(0.0, 9.0, 200)
        axes.plot(time, shell.prediction.function(name, time / unit), color=colour, linewidth=1.2)
        axes.errorbar(
            lag[inside] * unit,
            mean[inside],
            yerr=error[inside],
            fmt="o",
            markersize=3,
            color=colour,
            linewidth=0.8,
            label=label or None,
        )
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    axes.set(xlabel="$c_T\\,k\\,t$", title=title)
    if any(label for *_, label in drawn):
        axes.legend(fontsize=8)


if __name__ == "__main__":
    main()
