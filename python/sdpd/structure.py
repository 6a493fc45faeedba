"""The fluid of particles in the random-phase approximation: what it does to density and sound.

The conservative energy U = sum_i m e(rho_i) gives 1/S(k) = 1 + 2 Y What + (X - 2Y) What^2 with
X = m c^2/(k_B T) and Y = P/(n k_B T) at the mean density. From it follow the density fluctuations,
the fastest sound-like mode (the limit of an explicit step) and whether particles clump in pairs.
Within 15 % of simulation at h/dx = 2.2, 4 % at 2.65 and above, for X <= 100.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sdpd import kernels

__all__ = ["acoustic_wavenumber", "density_deviation", "pairing_susceptibility"]

Array = NDArray[np.float64]


@cache
def _transform(name: str, dimension: int) -> tuple[Array, Array]:
    kh = np.linspace(0.05, 40.0, 800)
    return kh, kernels.fourier_transform(name, dimension, kh)


def _excess(w: Array, stiffness: float, pressure: float) -> Array:
    """1/S(k) - 1."""
    with np.errstate(over="ignore", invalid="ignore"):  # a scene checks its magnitudes
        return 2.0 * pressure * w + (stiffness - 2.0 * pressure) * w**2


def pairing_susceptibility(
    name: str, dimension: int, stiffness: float, pressure: float
) -> tuple[float, float]:
    """How close a uniform fluid of particles is to clumping.

    Parameters
    ----------
    name : str
        Key of the kernel.
    dimension : int
        2 or 3.
    stiffness : float
        X [1].
    pressure : float
        Y [1]; equal to X for P = c^2 rho, zero for artificial compressibility at rho_0.

    Returns
    -------
    susceptibility : float
        Largest fall of 1/S(k) below one, >= 0: below 1 the fluid is stable, above it clumps.
    kh : float
        Wavenumber of that fall times the support [1].
    """
    kh, w = _transform(name, dimension)
    excess = _excess(w, stiffness, pressure)
    worst = int(np.argmin(excess))
    return max(0.0, -float(excess[worst])), float(kh[worst])


def acoustic_wavenumber(name: str, dimension: int, pressure_ratio: float) -> float:
    """s = h omega_max / c, the fastest density mode; an explicit step needs dt < 2 h/(s c).

    Parameters
    ----------
    name : str
        Key of the kernel.
    dimension : int
        2 or 3.
    pressure_ratio : float
        Y/X = P/(rho c^2) of the state: 1 for P = c^2 rho, which gives the kernel's
        `acoustic_factor`.

    Returns
    -------
    float
    """
    kh, w = _transform(name, dimension)
    square = np.clip(_excess(w, 1.0, pressure_ratio), 0.0, None)
    return float(np.max(kh * np.sqrt(square)))


def density_deviation(
    name: str, dimension: int, support: float, stiffness: float, pressure: float
) -> float | None:
    """Relative rms deviation of the summed density at a point, in equilibrium.

    Parameters
    ----------
    name : str
        Key of the kernel.
    dimension : int
        2 or 3.
    support : float
        h/dx [1].
    stiffness, pressure : float
        X and Y [1].

    Returns
    -------
    float or None
        sqrt(Var d)/n; None if the fluid clumps.

    Notes
    -----
    Var d = n int d^Dk/(2 pi)^D What^2 S.
    """
    kh, w = _transform(name, dimension)
    inverse = 1.0 + _excess(w, stiffness, pressure)
    if float(inverse.min()) <= 0.0:
        return None
    shell = kh**2 / (2.0 * np.pi**2) if dimension == 3 else kh / (2.0 * np.pi)
    step = float(kh[1] - kh[0])
    variance = float(np.sum(shell * w**2 / inverse)) * step / support**dimension
    return math.sqrt(variance)
