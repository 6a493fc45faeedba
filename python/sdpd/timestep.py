"""Every bound on the time step, each with its value and its reason.

Only effects that act give a bound. Accuracy bounds are where the error of a step reaches the asked
one; stability bounds are where a run blows up sooner or later. Measured numbers: docs/theory.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sdpd import structure, validation
from sdpd.integrators import Integrator, PairSplitting, VelocityVerlet, of_scene

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = [
    "ExpectedErrors",
    "TimeStep",
    "TimeStepBound",
    "acoustic_limit",
    "auto_time_step",
    "bounds",
    "check_time_step",
    "expected_errors",
]

ACOUSTIC_ACCURACY = 0.25  # of the explicit limit: density variance within 4 %
ACOUSTIC_STABILITY = 0.6  # of the explicit limit, itself an estimate
# Verlet: how much too cold per dt/tau, with 0, 1 and more re-evaluations of the friction: measured,
# and 0, 1/4 and 1/2 for one linear mode (docs/theory/time_integration).
VERLET_TEMPERATURE_SLOPE = (0.015, 0.27, 0.52)
# Verlet with energies: how much too cold per (dt/tau)^2, and too little Var T per (dt/tau_q)^2:
# measured, and 1/4 for one linear mode (docs/theory/energy).
VERLET_ENERGY_CURVATURE, VERLET_HEAT_CURVATURE = 0.4, 0.4
# Explicit friction and conduction: half of 2/lambda_max, which is 1.24 tau and 1.35 tau_q at least
# over kernels and supports.
STABLE_SHARE = 0.7
# Splitting: 1 - delivered over exact viscosity, times the effective number of partners that share
# the friction, against dt/tau: mean of nine kernels, supports and dimensions, each within 20 %
# (docs/theory/time_integration).
SPLITTING_LOSS = (
    (0.0, 0.5, 0.9, 1.3, 1.8, 2.6, 3.7, 5.2, 7.3, 11.0),
    (0.0, 0.0135, 0.043, 0.087, 0.163, 0.32, 0.58, 0.98, 1.52, 2.41),
)
# Up to this dt/tau a compensated fluid without order delivers its viscosity within 1.5 %
# (docs/guide/hard_cases).
COMPENSATED_RATIO = 10.0
# The same for the conductivity and dt/tau_q, over that of the viscosity at dt/tau, at most.
CONDUCTION_LOSS = 1.45
# Density variance too high by this times (dt / explicit limit)^2.
DENSITY_VARIANCE_SLOPE = 0.61


@dataclass(frozen=True)
class TimeStepBound:
    """One bound on the time step.

    Attributes
    ----------
    name : str
    value : float
        Largest dt [time].
    kind : str
        "accuracy" or "stability".
    formula, reason : str
        How it is computed, and what happens above it.
    """

    name: str
    value: float
    kind: str
    formula: str
    reason: str

    def __str__(self) -> str:
        return f"{self.name} ({self.kind}): dt <= {self.value:.4g} = {self.formula}; {self.reason}"


@dataclass(frozen=True)
class TimeStep:
    """A time step and the bound that set it.

    Attributes
    ----------
    value : float
        dt [time].
    bound : TimeStepBound
        The smallest of all.
    """

    value: float
    bound: TimeStepBound


@dataclass(frozen=True)
class ExpectedErrors:
    """What a time step is expected to do; None where it does not apply.

    Attributes
    ----------
    temperature : float or None
        Relative error of the kinetic temperature.
    viscosity : float or None
        Relative error of the delivered viscosity by the step alone, itself within 20 %.
    density_variance : float or None
        Relative error of the variance of the density.
    """

    temperature: float | None
    viscosity: float | None
    density_variance: float | None

    def __str__(self) -> str:
        named = (
            ("temperature", self.temperature),
            ("delivered viscosity", self.viscosity),
            ("density variance", self.density_variance),
        )
        shown = [f"{name} {value + 0.0:+.2%}" for name, value in named if value is not None]
        return ", ".join(shown) or "none known"


def acoustic_limit(
    scene: Scene,
    *,
    flow: float | None = None,
    density: float | None = None,
    hotter: float = 1.0,
) -> float:
    """2h/(s (c + V_0)), the explicit limit of the fastest sound-like mode [time].

    c and s are those of a locally compressed fluid, three rms density deviations above the mean, or
    at `density` where that is more: the artificial compressibility and Tait laws stiffen there.
    `flow` stands in for the flow speed of the scene, and c grows with the root of `hotter`.
    """
    state = scene.compressed_state if density is None else scene.compressed_to(density)
    resolution = scene.resolution
    s = structure.acoustic_wavenumber(resolution.kernel, scene.dimension, state.pressure_ratio)
    speed = (scene.flow_speed or 0.0) if flow is None else flow
    sound = state.sound_speed * math.sqrt(scene.stiffest_ratio * hotter)
    return 2.0 * scene.support_radius / (s * (sound + speed))


def _acoustic(scene: Scene) -> list[TimeStepBound]:
    limit = acoustic_limit(scene)
    return [
        TimeStepBound(
            "acoustic accuracy",
            ACOUSTIC_ACCURACY * limit,
            "accuracy",
            f"{ACOUSTIC_ACCURACY} x 2h/(s (c + V0))",
            "density fluctuations grow too large above it (4 % in variance at it)",
        ),
        TimeStepBound(
            "acoustic stability",
            ACOUSTIC_STABILITY * limit,
            "stability",
            f"{ACOUSTIC_STABILITY} x 2h/(s (c + V0))",
            "sound at the scale of the kernel is unstable above it",
        ),
    ]


def splitting_loss(scene: Scene, ratio: float) -> float:
    """1 - delivered over exact viscosity of the pair splitting at a dt/tau."""
    return float(np.interp(ratio, *SPLITTING_LOSS)) / scene.factors.partners


def _ratio_of_loss(scene: Scene, scale: float) -> float:
    """dt over friction or conduction time, at most 2, at which few partners lose 1 %."""
    ratios = np.linspace(0.0, 2.0, 81)
    loss = scale * np.interp(ratios, *SPLITTING_LOSS) / scene.factors.partners
    return float(ratios[loss <= 0.01][-1])


def _splitting_friction(
    scene: Scene, integrator: Integrator, resolve_vacf: bool
) -> list[TimeStepBound]:
    tau = scene.friction_time / scene.transport_factor(scene.fluid.viscosity_exponent)
    if resolve_vacf:
        return [
            TimeStepBound(
                "velocity autocorrelation",
                0.5 * tau,
                "accuracy",
                "tau/2",
                "the decay of the velocity autocorrelation is not resolved above it",
            )
        ]
    # Fluids with an energy are held to 1 % of their coefficients.
    ratio = _ratio_of_loss(scene, 1.0) if scene.active_effects.energy else 2.0
    reason = f"the delivered viscosity falls above it (by {splitting_loss(scene, ratio):.1%} at it)"
    if integrator.compensate:
        ratio = COMPENSATED_RATIO
        reason = "the compensated viscosity is right within 1.5 % up to it"
    elif not scene.active_effects.energy:
        reason += "; PairSplitting(compensate=True) or more of its `sweeps` give it back"
    sweeps = f"{integrator.sweeps} x " * (integrator.sweeps > 1)
    value, formula = ratio * integrator.sweeps * tau, f"{sweeps}{ratio:.3g} tau"
    return [TimeStepBound("friction", value, "accuracy", formula, reason)]


def _verlet_slope(integrator: Integrator) -> float:
    return VERLET_TEMPERATURE_SLOPE[min(integrator.iterations, len(VERLET_TEMPERATURE_SLOPE) - 1)]


def _verlet_friction(
    scene: Scene, integrator: Integrator, temperature_error: float, resolve_vacf: bool
) -> list[TimeStepBound]:
    factor = scene.transport_factor(scene.fluid.viscosity_exponent)
    tau = scene.friction_time / factor
    found = []
    if scene.active_effects.fluctuations:
        if scene.active_effects.energy:
            part = math.sqrt(temperature_error / VERLET_ENERGY_CURVATURE)
            formula = f"sqrt({temperature_error:g}/{VERLET_ENERGY_CURVATURE:g}) tau"
        else:
            slope = _verlet_slope(integrator)
            part, formula = temperature_error / slope, f"{temperature_error:g}/{slope:g} tau"
        found.append(
            TimeStepBound(
                "temperature accuracy",
                part * tau,
                "accuracy",
                formula,
                f"the kinetic temperature is off by more than {temperature_error:.2%} above it",
            )
        )
    if resolve_vacf:
        found += _splitting_friction(scene, integrator, True)
    # 0.03 h^2 rho/eta, measured for the Lucy kernel, is 0.7 of its tau; tau carries the other
    # kernels, the bulk viscosity and the central form
    eta = factor * scene.fluid.shear_viscosity / scene.calibration
    viscous = math.inf
    if eta > 0.0:
        viscous = 0.03 * scene.support_radius**2 * scene.fluid.density / eta
    value, formula = min(
        (viscous, "0.03 h^2 rho/eta"), (STABLE_SHARE * tau, f"{STABLE_SHARE:g} tau")
    )
    found.append(
        TimeStepBound(
            "viscous stability", value, "stability", formula, "friction is unstable above it"
        )
    )
    return found


def _splitting_conduction(scene: Scene, tau: float) -> list[TimeStepBound]:
    ratio = _ratio_of_loss(scene, CONDUCTION_LOSS)
    reason = "the delivered conductivity falls above it (by 1 % at most at it)"
    return [TimeStepBound("conduction", ratio * tau, "accuracy", f"{ratio:.3g} tau_q", reason)]


def _verlet_conduction(scene: Scene, tau: float, error: float) -> list[TimeStepBound]:
    found = [
        TimeStepBound(
            "conduction stability",
            STABLE_SHARE * tau,
            "stability",
            f"{STABLE_SHARE:g} tau_q",
            "heat conduction is unstable above it",
        )
    ]
    if scene.active_effects.fluctuations:
        found.append(
            TimeStepBound(
                "conduction",
                math.sqrt(error / VERLET_HEAT_CURVATURE) * tau,
                "accuracy",
                f"sqrt({error:g}/{VERLET_HEAT_CURVATURE:g}) tau_q",
                f"the variance of the temperatures is off by more than {error:.2%} above it",
            )
        )
    return found


def bounds(
    scene: Scene,
    integrator: Integrator | str | None = None,
    *,
    temperature_error: float = 0.005,
    resolve_vacf: bool = False,
) -> list[TimeStepBound]:
    """All bounds on the time step of a scene.

    Parameters
    ----------
    scene : Scene
    integrator : Integrator or str, optional
        The default for the scene if None.
    temperature_error : float
        Asked relative accuracy of the kinetic temperature [1], for velocity Verlet; with energies
        that of the variance of the particles' temperatures too.
    resolve_vacf : bool
        Whether the short-time velocity autocorrelation is to be resolved.

    Returns
    -------
    list of TimeStepBound
        Smallest first.
    """
    error = validation.positive("temperature_error", temperature_error)
    vacf = validation.boolean("resolve_vacf", resolve_vacf)
    active = scene.active_effects
    chosen = of_scene(scene, integrator)
    found = _acoustic(scene)
    if active.dissipation and isinstance(chosen, PairSplitting):
        found += _splitting_friction(scene, chosen, vacf)
    elif active.dissipation:
        found += _verlet_friction(scene, chosen, error, vacf)
    if active.conduction:
        factor = scene.transport_factor(scene.fluid.conductivity_exponent)
        tau = scene.conduction_time / factor
        if isinstance(chosen, PairSplitting):
            found += _splitting_conduction(scene, tau)
        else:
            found += _verlet_conduction(scene, tau, error)
    if active.body_force and scene.body_force is not None and scene.body_force.peak > 0.0:
        found.append(
            TimeStepBound(
                "body force",
                0.25 * math.sqrt(scene.support_radius / scene.body_force.peak),
                "accuracy",
                "0.25 sqrt(h/f)",
                "the body force moves a particle too far in one step above it",
            )
        )
    if scene.starts_thermal or active.fluctuations:
        found.append(
            TimeStepBound(
                "thermal motion",
                0.1 * scene.spacing / scene.hottest_speed,
                "accuracy",
                "0.1 dx/v_th",
                "a particle moves more than a tenth of the spacing in one step above it",
            )
        )
    return sorted(found, key=lambda bound: bound.value)


def auto_time_step(
    scene: Scene,
    integrator: Integrator | str | None = None,
    *,
    temperature_error: float = 0.005,
    resolve_vacf: bool = False,
) -> TimeStep:
    """The largest time step within every bound, and the bound that sets it; see `bounds`."""
    smallest = bounds(
        scene, integrator, temperature_error=temperature_error, resolve_vacf=resolve_vacf
    )[0]
    return TimeStep(smallest.value, smallest)


def check_time_step(
    scene: Scene,
    dt: float,
    integrator: Integrator | str | None = None,
    *,
    temperature_error: float = 0.005,
    resolve_vacf: bool = False,
) -> list[TimeStepBound]:
    """The bounds that a time step exceeds, stability bounds first; see `bounds`.

    Raises
    ------
    ValueError
        If `dt` is not finite and > 0.
    """
    step = validation.positive("dt", dt)
    found = bounds(
        scene, integrator, temperature_error=temperature_error, resolve_vacf=resolve_vacf
    )
    exceeded = [bound for bound in found if step > bound.value * (1.0 + 1e-12)]
    return sorted(exceeded, key=lambda bound: (bound.kind != "stability", bound.value))


def warning_text(dt: float, exceeded: list[TimeStepBound]) -> str:
    """What `sdpd.TimeStepWarning` says of the bounds a time step exceeds."""
    listed = "; ".join(
        f"{bound.name} ({bound.kind}) {bound.value:.4g} = {bound.formula}: {bound.reason}"
        for bound in exceeded
    )
    return f"`dt` = {dt:.4g} exceeds {listed}"


def expected_errors(
    scene: Scene, dt: float, integrator: Integrator | str | None = None
) -> ExpectedErrors:
    """The errors a time step is expected to cause, from measured curves.

    Raises
    ------
    ValueError
        If `dt` is not finite and > 0.
    """
    step = validation.positive("dt", dt)
    active = scene.active_effects
    chosen = of_scene(scene, integrator)
    temperature = viscosity = variance = None
    if active.dissipation:
        ratio = step / scene.friction_time
        if isinstance(chosen, PairSplitting):
            lost = splitting_loss(scene, ratio / chosen.sweeps)
            viscosity = 0.0 if chosen.compensate else -lost
            temperature = 0.0 if active.fluctuations else None
        elif isinstance(chosen, VelocityVerlet) and active.fluctuations:
            slow = VERLET_ENERGY_CURVATURE * ratio**2
            temperature = -slow if active.energy else -_verlet_slope(chosen) * ratio
    if active.fluctuations:
        variance = DENSITY_VARIANCE_SLOPE * (step / acoustic_limit(scene)) ** 2
    return ExpectedErrors(temperature, viscosity, variance)
