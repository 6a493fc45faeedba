"""The speed of sound of a scene: how stiff the fluid of particles is to be.

The true speed of a liquid is far above every other speed, so a step that follows it is wasteful and
the fluid of particles freezes. Y 2.54 with delta = 0.01, the thermal speed added:
c = max(10 V0, sqrt(nu V0/(L0 delta)), sqrt(f L0/delta), 10 v_th), at most the true one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["COMPRESSIBILITY", "CompressedState", "SoundSpeed", "choose_sound_speed"]

COMPRESSIBILITY = 0.01  # delta: relative density variation allowed to the flow


@dataclass(frozen=True)
class SoundSpeed:
    """The speed of sound of a scene and why.

    Attributes
    ----------
    speed : float
        c [length/time] at the density of the fluid.
    reason : str
        The term that won, or who gave it.
    terms : tuple of (str, float)
        All the terms of the rule [length/time].
    """

    speed: float
    reason: str
    terms: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class CompressedState:
    """The fluid where it is compressed by three rms density deviations.

    Attributes
    ----------
    density : float
        [mass/length^D].
    sound_speed : float
        [length/time].
    pressure_ratio : float
        P/(rho c^2) [1].
    """

    density: float
    sound_speed: float
    pressure_ratio: float


def choose_sound_speed(
    *,
    thermal_speed: float,
    kinematic_viscosity: float,
    flow_speed: float | None,
    length_scale: float,
    peak_force: float,
    true_speed: float | None,
) -> SoundSpeed:
    """Apply the rule; terms without their inputs are absent."""
    terms = [("10 v_th", 10.0 * thermal_speed)]
    if flow_speed:
        terms.append(("10 V0", 10.0 * flow_speed))
        viscous = kinematic_viscosity * flow_speed / (length_scale * COMPRESSIBILITY)
        terms.append(("sqrt(nu V0/(L0 delta))", math.sqrt(viscous)))
    if peak_force > 0.0:
        terms.append(("sqrt(f L0/delta)", math.sqrt(peak_force * length_scale / COMPRESSIBILITY)))
    reason, speed = max(terms, key=lambda term: term[1])
    if true_speed is not None and true_speed < speed:
        capped = f"true speed of sound of the fluid, below {reason} = {speed:.4g}"
        return SoundSpeed(true_speed, capped, tuple(terms))
    return SoundSpeed(speed, f"largest term: {reason}", tuple(terms))
