"""The smoothing kernels and what is known about each: constants, limits, Fourier transform.

W(r) = f(q) N_D / h^D with q = r/h, h the *full* support radius (papers differ), and F = -W'/r >= 0.
The values come from the compiled core, so there is one implementation; this module describes them.
Lucy: Lucy, Astron. J. 82 (1977) 1013. Quintic spline: Morris, Fox, Zhu, J. Comput. Phys. 136 (1997)
214. Wendland C2, C4: Wendland, Adv. Comput. Math. 4 (1995) 389; Dehnen and Aly, MNRAS 425 (2012)
1068, who show that a kernel whose Fourier transform stays positive does not pair.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

__all__ = [
    "KERNELS",
    "Kernel",
    "evaluate",
    "fourier_transform",
    "get",
    "names",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kernel:
    """Constants of one smoothing kernel; tuples hold the value for D = 2 and for D = 3.

    Attributes
    ----------
    name, title : str
        Key and display name.
    formula : str
        W h^D / N_D as a function of q = r/h.
    normalization : tuple of float
        N_D.
    profile_at_zero : float
        f(0), so that W(0) = N_D f(0) / h^D, the self term of the density.
    friction_integral : tuple of float
        I_F h^2, with I_F the integral of F over the support: the friction rate of a particle is
        (a + b/D) I_F / rho.
    pairing_limit : tuple of float
        Largest X = m c^2 / (k_B T) without pairing for a linear or ideal-gas pressure; inf if none.
    acoustic_factor : tuple of float
        s: the fastest sound-like mode has the frequency s c / h (P = c^2 rho), so a Verlet step
        needs dt < 2 h / (s c).
    reference : str
        Where the kernel comes from.
    """

    name: str
    title: str
    formula: str
    normalization: tuple[float, float]
    profile_at_zero: float
    friction_integral: tuple[float, float]
    pairing_limit: tuple[float, float]
    acoustic_factor: tuple[float, float]
    reference: str

    def self_value(self, dimension: int) -> float:
        """W(0) h^D [1]."""
        return self.normalization[_index(dimension)] * self.profile_at_zero

    def self_diffusion_factor(self, dimension: int) -> float:
        """K of D_self = K h^2 rho k_B T / (m eta) at zero bulk viscosity [1].

        K = 1 / ((a + b/D)/eta I_F h^2), with (a + b/D)/eta = 2 (D + 2)(D - 1)/D^2.
        """
        rate = 2.0 * (dimension + 2) * (dimension - 1) / dimension**2
        return 1.0 / (rate * self.friction_integral[_index(dimension)])

    def __str__(self) -> str:
        return f"{self.title} kernel: W h^D / N = {self.formula}, q = r/h < 1"


_PI = math.pi
KERNELS: dict[str, Kernel] = {
    kernel.name: kernel
    for kernel in (
        Kernel(
            name="lucy",
            title="Lucy",
            formula="(1 + 3q)(1 - q)^3",
            normalization=(5 / _PI, 105 / (16 * _PI)),
            profile_at_zero=1.0,
            friction_integral=(10.0, 21 / 2),
            pairing_limit=(7.8e3, 287.0),
            acoustic_factor=(3.57, 3.69),
            reference="Lucy, Astron. J. 82 (1977) 1013",
        ),
        Kernel(
            name="quintic_spline",
            title="quintic spline",
            formula="(3 - s)^5 - 6 (2 - s)^5 + 15 (1 - s)^5, s = 3q, each while positive",
            normalization=(63 / (478 * _PI), 9 / (40 * _PI)),
            profile_at_zero=66.0,
            friction_integral=(4158 / 239, 18.0),
            pairing_limit=(2.0e4, 2.3e4),
            acoustic_factor=(4.69, 4.77),
            reference="Morris, Fox and Zhu, J. Comput. Phys. 136 (1997) 214",
        ),
        Kernel(
            name="wendland_c2",
            title="Wendland C2",
            formula="(1 + 4q)(1 - q)^4",
            normalization=(7 / _PI, 21 / (2 * _PI)),
            profile_at_zero=1.0,
            friction_integral=(14.0, 14.0),
            pairing_limit=(math.inf, math.inf),
            acoustic_factor=(4.11, 4.18),
            reference="Wendland, Adv. Comput. Math. 4 (1995) 389",
        ),
        Kernel(
            name="wendland_c4",
            title="Wendland C4",
            formula="(1 + 6q + 35q^2/3)(1 - q)^6",
            normalization=(9 / _PI, 495 / (32 * _PI)),
            profile_at_zero=1.0,
            friction_integral=(18.0, 55 / 3),
            pairing_limit=(math.inf, math.inf),
            acoustic_factor=(4.72, 4.79),
            reference="Wendland, Adv. Comput. Math. 4 (1995) 389",
        ),
    )
}


def names() -> list[str]:
    """The keys of all kernels."""
    return list(KERNELS)


def get(name: str) -> Kernel:
    """The kernel of that name.

    Raises
    ------
    ValueError
        If there is no such kernel.
    """
    return KERNELS[validation.choice("kernel", name, list(KERNELS))]


def _index(dimension: int) -> int:
    if dimension not in (2, 3):
        raise ValueError(f"`dimension` must be 2 or 3, got {dimension!r}")
    return dimension - 2


def evaluate(
    name: str, dimension: int, distance: ArrayLike, support: float = 1.0
) -> tuple[Array, Array]:
    """W and F = -W'/r at the given distances.

    Parameters
    ----------
    name : str
        Key of the kernel.
    dimension : int
        2 or 3.
    distance : array_like of float, any shape
        r [length], >= 0.
    support : float
        h, the full support radius [length].

    Returns
    -------
    w, f : ndarray of float64, shape of `distance`
        W [1/length^D] and F [1/length^(D+2)], zero for r >= h.

    Raises
    ------
    ValueError
        If a distance is negative or not finite, or the kernel or dimension unknown.

    Examples
    --------
    >>> import sdpd
    >>> w, f = sdpd.kernels.evaluate("lucy", 3, [0.0, 0.5, 1.0])
    >>> float(w[2]), float(f[2])
    (0.0, 0.0)
    """
    from sdpd import _core

    kernel, _ = get(name), _index(dimension)
    h = validation.positive("support", support)
    r = np.asarray(distance, dtype=np.float64)
    if not np.all(np.isfinite(r) & (r >= 0.0)):
        raise ValueError("`distance` must be finite and >= 0")
    w, f = _core.kernel_profile(kernel.name, dimension, np.ascontiguousarray(r.ravel() / h))
    w = np.asarray(w).reshape(r.shape) / h**dimension
    f = np.asarray(f).reshape(r.shape) / h ** (dimension + 2)
    return w, f


@cache
def radial_nodes() -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on (0, 1) in three panels.

    Exact for the polynomial kernels, whose pieces (of the quintic) join at 1/3 and 2/3.
    """
    x, weight = np.polynomial.legendre.leggauss(32)
    q = np.concatenate([(panel + 0.5 * (x + 1.0)) / 3.0 for panel in range(3)])
    return q, np.tile(weight / 6.0, 3)


def angular_mean_cosine(dimension: int, u: Array) -> Array:
    """Mean of cos(u e_z) over directions e: J_0(u) for D = 2, sin(u)/u for D = 3."""
    if dimension == 3:
        return np.sinc(u / np.pi)
    # midpoint rule of (1/pi) int_0^pi cos(u sin t) dt: exact to rounding while u < 100
    angle = (np.arange(96) + 0.5) * (np.pi / 96)
    return np.asarray(np.cos(u[..., None] * np.sin(angle)).mean(axis=-1))


@cache
def _radial_weight(name: str, dimension: int) -> tuple[Array, Array]:
    q, weight = radial_nodes()
    w, _ = evaluate(name, dimension, q)
    sphere = 4.0 * np.pi * q**2 if dimension == 3 else 2.0 * np.pi * q
    return q, weight * sphere * w


def fourier_transform(name: str, dimension: int, kh: ArrayLike) -> Array:
    """Fourier transform of the kernel, normalised to 1 at k = 0.

    Parameters
    ----------
    name : str
        Key of the kernel.
    dimension : int
        2 or 3.
    kh : array_like of float
        Wavenumber times support radius [1], ``0 <= kh <= 100``.

    Returns
    -------
    ndarray of float64, shape of `kh`
    """
    k = np.asarray(kh, dtype=np.float64)
    if not np.all((k >= 0.0) & (k <= 100.0)):
        raise ValueError("`kh` must be >= 0 and <= 100")
    q, weight = _radial_weight(get(name).name, dimension)
    return np.asarray(angular_mean_cosine(dimension, k[..., None] * q) @ weight)
