r"""Flow between two parallel plates from rest: closed forms.

The plates are at z = 0 and z = L, no slip. Yang (2013), eqs. 3.1 and 3.2; 3.1 is printed there with
the opposite sign.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = ["couette_velocity", "pipe_velocity", "poiseuille_velocity"]

Array = NDArray[np.float64]
_TERMS = 200


def _series(z: Array, t: float, nu: float, length: float, n: Array, amplitudes: Array) -> Array:
    k = n * np.pi / length
    decay = np.exp(-nu * k**2 * t)
    return np.asarray((amplitudes * decay * np.sin(k * z[..., None])).sum(axis=-1))


def poiseuille_velocity(
    z: ArrayLike, t: float, *, acceleration: float, kinematic_viscosity: float, width: float
) -> Array:
    r"""Velocity of a fluid driven from rest by a uniform acceleration along resting plates.

    Parameters
    ----------
    z : array_like
        Distance from one plate [length].
    t : float
        Time since the start [time], >= 0; ``math.inf`` for the steady flow.
    acceleration : float
        f [length/time^2].
    kinematic_viscosity : float
        nu [length^2/time].
    width : float
        L [length].

    Returns
    -------
    ndarray of float64, of the shape of `z`
        [length/time].

    Notes
    -----
    .. math:: V = \frac{f}{2\nu} z (L - z) - \sum_{n\,\mathrm{odd}} \frac{4 f L^2}{\nu\pi^3 n^3}
        \sin\frac{n\pi z}{L}\, e^{-n^2\pi^2\nu t/L^2}

    Examples
    --------
    >>> import math
    >>> from sdpd.theory import poiseuille_velocity
    >>> constants = dict(acceleration=8.0, kinematic_viscosity=1.0, width=1.0)
    >>> float(poiseuille_velocity(0.5, math.inf, **constants))
    1.0
    >>> abs(float(poiseuille_velocity(0.5, 0.0, **constants))) < 1e-5
    True
    """
    z = np.asarray(z, dtype=np.float64)
    f = validation.finite("acceleration", acceleration)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    length = validation.positive("width", width)
    steady = np.asarray(f / (2.0 * nu) * z * (length - z), dtype=np.float64)
    if t == np.inf:
        return np.asarray(steady)
    n: Array = 2.0 * np.arange(_TERMS, dtype=np.float64) + 1.0
    amplitudes: Array = 4.0 * f * length**2 / (nu * np.pi**3 * n**3)
    return np.asarray(
        steady - _series(z, validation.non_negative("t", t), nu, length, n, amplitudes)
    )


def couette_velocity(
    z: ArrayLike, t: float, *, wall_velocity: float, kinematic_viscosity: float, width: float
) -> Array:
    r"""Velocity of a fluid at rest whose plate at z = L begins to move.

    Parameters
    ----------
    z : array_like
        Distance from the plate at rest [length].
    t : float
        Time since the start [time], > 0; ``math.inf`` for the steady flow.
    wall_velocity : float
        V0 [length/time].
    kinematic_viscosity : float
        nu [length^2/time].
    width : float
        L [length].

    Returns
    -------
    ndarray of float64, of the shape of `z`
        [length/time].

    Notes
    -----
    .. math:: V = V_0 \frac zL + \sum_{n\ge1} \frac{2 V_0}{n\pi} (-1)^n
        \sin\frac{n\pi z}{L}\, e^{-n^2\pi^2\nu t/L^2}

    Examples
    --------
    >>> import math
    >>> from sdpd.theory import couette_velocity
    >>> constants = dict(wall_velocity=2.0, kinematic_viscosity=1.0, width=1.0)
    >>> float(couette_velocity(0.5, math.inf, **constants))
    1.0
    """
    z = np.asarray(z, dtype=np.float64)
    speed = validation.finite("wall_velocity", wall_velocity)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    length = validation.positive("width", width)
    steady = speed * z / length
    if t == np.inf:
        return np.asarray(steady)
    n = np.arange(1.0, _TERMS + 1.0)
    amplitudes = 2.0 * speed / (n * np.pi) * np.where(n % 2 == 1.0, -1.0, 1.0)
    return np.asarray(steady + _series(z, validation.positive("t", t), nu, length, n, amplitudes))


def pipe_velocity(
    r: ArrayLike, *, acceleration: float, kinematic_viscosity: float, radius: float
) -> Array:
    r"""Steady velocity in a round pipe, f (R^2 - r^2)/(4 nu).

    Parameters
    ----------
    r : array_like
        Distance from the axis [length].
    acceleration : float
        f along the axis [length/time^2].
    kinematic_viscosity : float
        nu [length^2/time].
    radius : float
        R [length].

    Returns
    -------
    ndarray of float64, of the shape of `r`
        [length/time].
    """
    r = np.asarray(r, dtype=np.float64)
    f = validation.finite("acceleration", acceleration)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    return np.asarray(f / (4.0 * nu) * (validation.positive("radius", radius) ** 2 - r**2))
