r"""Heat between plates: conduction, and shear flow with viscous heating, in closed form.

Viscosity and conductivity go as the same power of the temperature, (T/T_0)^n, so that their ratio
is a constant. Then temperature is a parabola in the *velocity* whatever n is,

.. math:: T(u) = T_0 + (T_1 - T_0)\,\frac{u}{V} + \frac{\eta_0}{2\kappa_0}\,u\,(V - u),

and the height follows from :math:`\tau z = \int_0^u \eta(T(u'))\,du'` (e.g. White, *Viscous Fluid
Flow*, 3rd ed., 2006, sec. 3-2.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = ["HeatedShear", "conduction_profile", "thermal_couette", "transient_conduction"]

Array = NDArray[np.float64]
_POINTS = 4001


def conduction_profile(
    height: ArrayLike, *, width: float, temperatures: tuple[float, float], exponent: float = 0.0
) -> Array:
    """Steady temperature between plates of given temperatures with kappa ~ T^n.

    Parameters
    ----------
    height : array_like
        Heights z [length], 0 to `width`.
    width : float
        Distance of the plates [length].
    temperatures : tuple of float
        At z = 0 and at z = `width` [temperature].
    exponent : float
        n [1], > -1.

    Returns
    -------
    ndarray
        T [temperature]: T^(n+1) is linear in z.
    """
    z = np.asarray(height, dtype=np.float64) / validation.positive("width", width)
    low, high = (
        validation.positive("temperatures", value) ** (1.0 + exponent) for value in temperatures
    )
    return np.asarray((low + (high - low) * z) ** (1.0 / (1.0 + exponent)))


def transient_conduction(
    height: ArrayLike,
    time: float,
    *,
    width: float,
    temperatures: tuple[float, float],
    start: float,
    diffusivity: float,
    terms: int = 200,
) -> Array:
    """Temperature between plates that have taken their temperatures at t = 0.

    Parameters
    ----------
    height : array_like
        Heights z [length], 0 to `width`.
    time : float
        t [time], > 0.
    width : float
        Distance of the plates [length].
    temperatures : tuple of float
        Of the plates from t = 0 on [temperature].
    start : float
        Of the fluid before [temperature].
    diffusivity : float
        kappa/(rho c_v) [length^2/time], a constant.
    terms : int
        Of the Fourier series (Carslaw and Jaeger, *Conduction of Heat in Solids*, 1959, sec. 3.4).

    Returns
    -------
    ndarray
        T [temperature].
    """
    z = np.asarray(height, dtype=np.float64) / validation.positive("width", width)
    low, high = temperatures
    n = np.arange(1, terms + 1)
    wave = np.sin(np.pi * n * z[..., None])
    decay = np.exp(-diffusivity * (np.pi * n / width) ** 2 * validation.positive("time", time))
    sign = np.where(n % 2 == 0, 1.0, -1.0)
    amplitude = 2.0 / (np.pi * n) * ((high - start) * sign - (low - start))
    return np.asarray(low + (high - low) * z + wave @ (amplitude * decay))


@dataclass(frozen=True)
class HeatedShear:
    """Steady shear flow between plates with viscous heating, see `thermal_couette`.

    Attributes
    ----------
    height, velocity, temperature : ndarray
        Profiles at the same points [length], [length/time], [temperature].
    stress : float
        tau on the plates [energy/length^D].
    heat : tuple of float
        Heat that the plates at z = 0 and z = width receive [energy/(time length^(D-1))]; their sum
        is the work tau V.
    """

    height: Array
    velocity: Array
    temperature: Array
    stress: float
    heat: tuple[float, float]

    def at(self, height: ArrayLike) -> tuple[Array, Array]:
        """Velocity and temperature at given heights."""
        z = np.asarray(height, dtype=np.float64)
        return (
            np.interp(z, self.height, self.velocity),
            np.interp(z, self.height, self.temperature),
        )


def thermal_couette(
    *,
    width: float,
    speed: float,
    temperatures: tuple[float, float],
    shear_viscosity: float,
    thermal_conductivity: float,
    exponent: float = 0.0,
    reference: float = 1.0,
) -> HeatedShear:
    """Shear flow between a plate at rest at z = 0 and one that moves, each with its temperature.

    Parameters
    ----------
    width : float
        Distance of the plates [length].
    speed : float
        V of the plate at z = `width` [length/time].
    temperatures : tuple of float
        Of the plates [temperature].
    shear_viscosity, thermal_conductivity : float
        At the temperature `reference`.
    exponent : float
        n of both [1].
    reference : float
        [temperature].

    Returns
    -------
    HeatedShear

    Examples
    --------
    Yang (2013), section 4.2: nitrogen between plates of 300 K and 330 K.

    >>> from sdpd.theory import thermal_couette
    >>> flow = thermal_couette(
    ...     width=1e-4, speed=30.0, temperatures=(300.0, 330.0), shear_viscosity=1.79e-5,
    ...     thermal_conductivity=0.026, exponent=0.7, reference=300.0,
    ... )
    >>> round(flow.stress, 3)
    5.557
    """
    low, high = (validation.positive("temperatures", value) for value in temperatures)
    eta = validation.positive("shear_viscosity", shear_viscosity)
    kappa = validation.positive("thermal_conductivity", thermal_conductivity)
    span, v = validation.positive("width", width), validation.positive("speed", speed)
    t0 = validation.positive("reference", reference)
    u = np.linspace(0.0, v, _POINTS)
    temperature = low + (high - low) * u / v + 0.5 * eta / kappa * u * (v - u)
    viscosity = eta * (temperature / t0) ** exponent
    steps = 0.5 * (viscosity[1:] + viscosity[:-1]) * np.diff(u)
    height = np.concatenate([[0.0], np.cumsum(steps)])
    stress = float(height[-1] / span)
    # kappa dT/dz = (kappa/eta) tau dT/du
    slope = kappa / eta * stress
    ends = (high - low) / v + 0.5 * eta / kappa * v, (high - low) / v - 0.5 * eta / kappa * v
    return HeatedShear(
        height=height / stress,
        velocity=u,
        temperature=temperature,
        stress=stress,
        heat=(slope * ends[0], -slope * ends[1]),
    )
