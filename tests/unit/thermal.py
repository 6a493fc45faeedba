"""Scenes of fluids with an energy that several test files build on: m = dx = k_B = T_0 = 1."""

from __future__ import annotations

from typing import Any

import numpy as np

import sdpd


def fluid(capacity: float = 50.0, **changes: Any) -> sdpd.Fluid:
    """A liquid whose pressure does not go with the temperature, unless told otherwise."""
    constants: dict[str, Any] = {
        "density": 1.0,
        "shear_viscosity": 20.0,
        "temperature": 1.0,
        "boltzmann_constant": 1.0,
        "heat_capacity": capacity,
        "thermal_conductivity": 10.0 * capacity,
        "equation_of_state": sdpd.eos.Linear(background_pressure=100.0),
    }
    return sdpd.Fluid(**{**constants, **changes})


def gas(capacity: float = 25.0, **changes: Any) -> sdpd.Fluid:
    """An ideal gas with X = m c^2/kT = R = 100."""
    return fluid(capacity, equation_of_state=sdpd.eos.IdealGas(), **changes)


def scene(of: sdpd.Fluid | None = None, edge: float = 8.0, **changes: Any) -> sdpd.Scene:
    arguments: dict[str, Any] = {
        "fluid": of or fluid(),
        "box": sdpd.Box((edge,) * 3),
        "resolution": sdpd.Resolution(spacing=1.0, support=2.64, kernel="lucy"),
        "sound_speed": 10.0,
        "effects": sdpd.Effects(energy=True),
    }
    return sdpd.Scene(**{**arguments, **changes})


def slab(
    lower: sdpd.Plane | Any,
    upper: Any,
    *,
    of: sdpd.Fluid | None = None,
    speed: float = 0.0,
    height: float = 12.0,
    edge: float = 6.0,
    noise: bool = False,
    **changes: Any,
) -> sdpd.Scene:
    """Plates at z = 0 and z = height with given thermal conditions; the upper one may move."""
    walls = (
        sdpd.Plane(axis="z", at=0.0, heat=lower),
        sdpd.Plane(axis="z", at=height, velocity=(speed, 0.0, 0.0), heat=upper),
    )
    return scene(
        of,
        box=sdpd.Box((edge, edge, height), periodic="xy"),
        walls=walls,
        effects=sdpd.Effects(energy=True, fluctuations=noise),
        **changes,
    )


def layers(sim: sdpd.Simulation, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean height and mean value in layers along z."""
    z = np.asarray(sim.positions[:, 2])
    layer = np.clip((z / sim.scene.box.lengths[2] * bins).astype(int), 0, bins - 1)
    count = np.bincount(layer, minlength=bins)
    return (
        np.bincount(layer, z, minlength=bins) / count,
        np.bincount(layer, np.asarray(values), minlength=bins) / count,
    )
