r"""Flows along walls in closed form: rectangular duct, turning cylinders, oscillating plate."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = [
    "duct_velocity",
    "oscillating_plate_velocity",
    "taylor_couette_torque",
    "taylor_couette_velocity",
]

Array = NDArray[np.float64]
_TERMS = 200


def duct_velocity(
    y: ArrayLike,
    z: ArrayLike,
    *,
    acceleration: float,
    kinematic_viscosity: float,
    width: float,
    height: float,
) -> Array:
    r"""Steady velocity along a duct of rectangular cross-section, with a wall on each side.

    Parameters
    ----------
    y, z : array_like
        Distances from two walls that meet, ``0 <= y <= width``, ``0 <= z <= height`` [length];
        they are broadcast.
    acceleration : float
        f along the duct [length/time^2].
    kinematic_viscosity : float
        nu [length^2/time].
    width, height : float
        W along y and H along z [length].

    Returns
    -------
    ndarray of float64
        [length/time].

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    .. math:: V = \frac f{2\nu} z (H - z) - \frac{4 f H^2}{\nu\pi^3}\sum_{n\,\mathrm{odd}}
        \frac1{n^3} \frac{\cosh(n\pi(y - W/2)/H)}{\cosh(n\pi W/2H)} \sin\frac{n\pi z}H

    References
    ----------
    .. [1] F. M. White, *Viscous Fluid Flow*, 3rd ed., 2006, eq. 3-48.

    Examples
    --------
    >>> from sdpd.theory import duct_velocity
    >>> square = dict(acceleration=1.0, kinematic_viscosity=1.0, width=1.0, height=1.0)
    >>> round(float(duct_velocity(0.5, 0.5, **square)), 6)
    0.073671
    """
    f = validation.finite("acceleration", acceleration)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    w, h = validation.positive("width", width), validation.positive("height", height)
    y, z = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(z, np.float64))
    n = 2.0 * np.arange(_TERMS) + 1.0
    a = n * np.pi / h
    from_middle = np.abs(y[..., None] - 0.5 * w)
    # the ratio of hyperbolic cosines, which would overflow one by one
    ratio = np.exp(a * (from_middle - 0.5 * w)) * (1.0 + np.exp(-2.0 * a * from_middle))
    ratio /= 1.0 + np.exp(-a * w)
    series = (ratio * np.sin(a * z[..., None]) / n**3).sum(axis=-1)
    plates = 0.5 * f / nu * z * (h - z)
    return np.asarray(plates - 4.0 * f * h**2 / (nu * np.pi**3) * series)


def taylor_couette_velocity(
    r: ArrayLike,
    *,
    inner_radius: float,
    outer_radius: float,
    inner_angular_velocity: float,
    outer_angular_velocity: float = 0.0,
) -> Array:
    r"""Azimuthal velocity between two concentric cylinders that turn.

    Parameters
    ----------
    r : array_like
        Distance from the axis [length].
    inner_radius, outer_radius : float
        R1 < R2 [length].
    inner_angular_velocity, outer_angular_velocity : float
        [1/time].

    Returns
    -------
    ndarray of float64, of the shape of `r`
        [length/time].

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    .. math:: V = A r + \frac Br,\quad A = \frac{\Omega_2 R_2^2 - \Omega_1 R_1^2}{R_2^2 - R_1^2},
        \quad B = \frac{(\Omega_1 - \Omega_2) R_1^2 R_2^2}{R_2^2 - R_1^2}

    Examples
    --------
    >>> from sdpd.theory import taylor_couette_velocity
    >>> cell = dict(inner_radius=1.0, outer_radius=2.0, inner_angular_velocity=3.0)
    >>> taylor_couette_velocity([1.0, 2.0], **cell).tolist()
    [3.0, 0.0]
    """
    r1, r2 = _radii(inner_radius, outer_radius)
    w1 = validation.finite("inner_angular_velocity", inner_angular_velocity)
    w2 = validation.finite("outer_angular_velocity", outer_angular_velocity)
    r = np.asarray(r, dtype=np.float64)
    gap = r2**2 - r1**2
    return np.asarray((w2 * r2**2 - w1 * r1**2) / gap * r + (w1 - w2) * (r1 * r2) ** 2 / gap / r)


def taylor_couette_torque(
    *,
    inner_radius: float,
    outer_radius: float,
    shear_viscosity: float,
    inner_angular_velocity: float,
    outer_angular_velocity: float = 0.0,
) -> float:
    r"""Torque of the fluid on the outer of two concentric cylinders per unit length.

    Parameters
    ----------
    inner_radius, outer_radius : float
        R1 < R2 [length].
    shear_viscosity : float
        eta [energy time/length^3], in a plane [energy time/length^2].
    inner_angular_velocity, outer_angular_velocity : float
        [1/time].

    Returns
    -------
    float
        [energy/length], in a plane [energy]; on the inner cylinder it is the opposite.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    .. math:: M = 4\pi\eta\,\frac{(\Omega_1 - \Omega_2) R_1^2 R_2^2}{R_2^2 - R_1^2}

    Examples
    --------
    >>> import math
    >>> from sdpd.theory import taylor_couette_torque
    >>> torque = taylor_couette_torque(
    ...     inner_radius=1.0, outer_radius=2.0, shear_viscosity=3.0, inner_angular_velocity=1.0
    ... )
    >>> round(torque / math.pi, 12)
    16.0
    """
    r1, r2 = _radii(inner_radius, outer_radius)
    eta = validation.positive("shear_viscosity", shear_viscosity)
    w1 = validation.finite("inner_angular_velocity", inner_angular_velocity)
    w2 = validation.finite("outer_angular_velocity", outer_angular_velocity)
    return float(4.0 * np.pi * eta * (w1 - w2) * (r1 * r2) ** 2 / (r2**2 - r1**2))


def _radii(inner: float, outer: float) -> tuple[float, float]:
    r1 = validation.positive("inner_radius", inner)
    r2 = validation.positive("outer_radius", outer)
    if r1 >= r2:
        raise ValueError(f"`outer_radius` must be > `inner_radius` = {r1:g}, got {r2:g}")
    return r1, r2


def oscillating_plate_velocity(
    z: ArrayLike,
    t: float,
    *,
    amplitude: float,
    angular_frequency: float,
    kinematic_viscosity: float,
    width: float = math.inf,
) -> Array:
    r"""Velocity above a plate that oscillates along itself (Stokes' second problem).

    Parameters
    ----------
    z : array_like
        Distance from the plate, ``0 <= z <= width`` [length].
    t : float
        Time [time]; the plate moves with :math:`V_0\cos\omega t`.
    amplitude : float
        V0 [length/time].
    angular_frequency : float
        omega [1/time].
    kinematic_viscosity : float
        nu [length^2/time].
    width : float
        L, distance of a plate at rest [length]; none by default.

    Returns
    -------
    ndarray of float64, of the shape of `z`
        [length/time], in the periodic state, when the start is forgotten.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    .. math:: V = V_0\,\mathrm{Re}\Big[e^{i\omega t}\,\frac{\sinh k(L - z)}{\sinh kL}\Big],
        \qquad k = \sqrt{i\omega/\nu},

    and :math:`V_0 e^{-z/\delta}\cos(\omega t - z/\delta)` with
    :math:`\delta = \sqrt{2\nu/\omega}` without the second plate.

    References
    ----------
    .. [1] L. D. Landau and E. M. Lifshitz, *Fluid Mechanics*, 2nd ed., 1987, sec. 24.

    Examples
    --------
    >>> import math
    >>> from sdpd.theory import oscillating_plate_velocity
    >>> plate = dict(amplitude=2.0, angular_frequency=2.0, kinematic_viscosity=1.0)
    >>> v = oscillating_plate_velocity([0.0, math.pi], 0.0, **plate)
    >>> [round(float(x), 6) for x in v / 2.0]
    [1.0, -0.043214]
    """
    z = np.asarray(z, dtype=np.float64)
    v0 = validation.finite("amplitude", amplitude)
    omega = validation.positive("angular_frequency", angular_frequency)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    k = np.sqrt(1j * omega / nu)
    shape = np.exp(-k * z)
    if width != math.inf:
        length = validation.positive("width", width)
        # by decaying exponentials only: sinh would overflow at high frequencies
        shape = (shape - np.exp(-k * (2.0 * length - z))) / (1.0 - np.exp(-2.0 * k * length))
    phase = np.exp(1j * omega * validation.finite("t", t))
    return np.asarray(v0 * (phase * shape).real)
