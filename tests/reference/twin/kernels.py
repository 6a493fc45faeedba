"""Smoothing kernels W and F = -W'/r, with the full support h.

Lucy 1977; Morris, Fox and Zhu 1997 (quintic spline); Wendland 1995 (C2, C4). The normalisations
for D = 2, 3 are checked by quadrature in test_twin_self.py, F by a complex step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KERNELS = ("lucy", "quintic_spline", "wendland_c2", "wendland_c4")

_NORMALISATION = {
    "lucy": {2: 5.0 / np.pi, 3: 105.0 / (16.0 * np.pi)},
    "quintic_spline": {2: 63.0 / (478.0 * np.pi), 3: 9.0 / (40.0 * np.pi)},
    "wendland_c2": {2: 7.0 / np.pi, 3: 21.0 / (2.0 * np.pi)},
    "wendland_c4": {2: 9.0 / np.pi, 3: 495.0 / (32.0 * np.pi)},
}


def _quintic_sum(s: Array, power: int) -> Array:
    """(3-s)^p - 6 (2-s)_+^p + 15 (1-s)_+^p for 0 <= s < 3."""
    total = (3.0 - s) ** power
    total = total - 6.0 * np.where(s.real < 2.0, 2.0 - s, 0.0) ** power
    return total + 15.0 * np.where(s.real < 1.0, 1.0 - s, 0.0) ** power


def profile(name: str, dimension: int, q: Array) -> Array:
    """Dimensionless kernel W h^D at q = r/h (complex q allowed, for the complex step)."""
    q = np.asarray(q)
    if name == "lucy":
        shape = (1.0 + 3.0 * q) * (1.0 - q) ** 3
    elif name == "quintic_spline":
        shape = _quintic_sum(3.0 * q, 5)
    elif name == "wendland_c2":
        shape = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    elif name == "wendland_c4":
        shape = (1.0 - q) ** 6 * (1.0 + 6.0 * q + 35.0 * q * q / 3.0)
    else:
        raise ValueError(f"unknown kernel {name!r}")
    return np.where(q.real < 1.0, _NORMALISATION[name][dimension] * shape, 0.0)


def force_profile(name: str, dimension: int, q: Array) -> Array:
    """Dimensionless F h^(D+2) at q = r/h, finite at q = 0."""
    q = np.asarray(q, dtype=float)
    if name == "lucy":
        shape = 12.0 * (1.0 - q) ** 2
    elif name == "quintic_spline":
        # -dW/dq / q = 15 [..]^4 / q; for s = 3q < 1 the bracket is 24 s - 24 s^3 + 10 s^4 (its
        # constant 81 - 96 + 15 cancels exactly), so divide by q before rounding spoils it.
        s = 3.0 * q
        safe = np.where(s < 1.0, 1.0, q)
        shape = 15.0 * np.where(
            s < 1.0, 3.0 * (24.0 - 24.0 * s**2 + 10.0 * s**3), _quintic_sum(s, 4) / safe
        )
    elif name == "wendland_c2":
        shape = 20.0 * (1.0 - q) ** 3
    elif name == "wendland_c4":
        shape = 56.0 / 3.0 * (1.0 - q) ** 5 * (1.0 + 5.0 * q)
    else:
        raise ValueError(f"unknown kernel {name!r}")
    return np.where(q < 1.0, _NORMALISATION[name][dimension] * shape, 0.0)


def kernel_value(name: str, dimension: int, r: Array, support: float) -> Array:
    """Kernel W(r) [1/length^D]."""
    return profile(name, dimension, np.asarray(r) / support) / support**dimension


def force_factor(name: str, dimension: int, r: Array, support: float) -> Array:
    """F(r) = -W'(r)/r [1/length^(D+2)]."""
    return force_profile(name, dimension, np.asarray(r) / support) / support ** (dimension + 2)
