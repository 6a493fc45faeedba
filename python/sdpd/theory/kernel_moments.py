r"""Integrals of a kernel: Fourier transform, friction integral, angular means.

With q = r/h, h the full support: W = w(q)/h^D and F = -W'/r = f(q)/h^(D+2). All integrals use
Gauss-Legendre panels joined at q = 1/3 and 2/3 (the knots of the quintic spline), on which every
kernel is a polynomial, so they are exact to rounding.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels

__all__ = ["friction_integral", "kernel_square_integral", "kernel_transform"]

Array = NDArray[np.float64]


def kernel_transform(kernel: str, dimension: int, kh: ArrayLike) -> Array:
    r"""Fourier transform of a kernel, 1 at k = 0.

    Parameters
    ----------
    kernel : str
        ``"lucy"``, ``"quintic_spline"``, ``"wendland_c2"`` or ``"wendland_c4"``.
    dimension : int
        2 or 3.
    kh : array_like, any shape
        Wave number times support [1], finite and >= 0.

    Returns
    -------
    ndarray of float64, shape of `kh`

    Raises
    ------
    ValueError
        If the kernel or the dimension is unknown, or `kh` is negative or not finite.

    Notes
    -----
    .. math:: \hat W(k) = \int W(r) \cos(\mathbf k\cdot\mathbf r)\,d^Dr
              = \Omega_D\int_0^1 w(q)\,c_D(khq)\,q^{D-1}dq

    with :math:`c_2 = J_0`, :math:`c_3(x) = \sin(x)/x`.
    """
    x = np.asarray(kh, dtype=np.float64)
    if not np.all(np.isfinite(x) & (x >= 0.0)):
        raise ValueError("`kh` must be finite and >= 0")
    order = 32 + 16 * int(np.max(x, initial=0.0) / 48.0)  # nodes a panel: resolves cos(kh q)
    q, weight, w, _ = nodes(kernel, dimension, order)
    flat = x.reshape(-1)
    result = np.empty_like(flat)
    for start in range(0, flat.size, 4096):
        part = slice(start, start + 4096)
        result[part] = mean_cosine(dimension, flat[part, None] * q) @ (weight * w)
    return result.reshape(x.shape)


def friction_integral(kernel: str, dimension: int) -> float:
    """Return I_F h^2, the integral of F over the support times h^2 [1].

    Parameters
    ----------
    kernel : str
        Name of the kernel.
    dimension : int
        2 or 3.

    Returns
    -------
    float
        Lucy 10 | 21/2, quintic 4158/239 | 18, Wendland C2 14 | 14, C4 18 | 55/3 (2D | 3D).
    """
    _, weight, _, f = nodes(kernel, dimension)
    return float(weight @ f)


def kernel_square_integral(kernel: str, dimension: int) -> float:
    """Return the integral of W^2 times h^D [1]."""
    _, weight, w, _ = nodes(kernel, dimension)
    return float(weight @ w**2)


@lru_cache(maxsize=64)
def nodes(kernel: str, dimension: int, order: int = 32) -> tuple[Array, Array, Array, Array]:
    """Quadrature of radial functions over the support: q, weight (with surface), w, f."""
    if dimension not in (2, 3):
        raise ValueError(f"`dimension` must be 2 or 3, got {dimension!r}")
    x, panel = np.polynomial.legendre.leggauss(order)
    q = np.concatenate([(start + 0.5 * (x + 1.0)) / 3.0 for start in range(3)])
    surface = 2.0 * np.pi * q if dimension == 2 else 4.0 * np.pi * q**2
    w, f = kernels.evaluate(kernel, dimension, q)
    arrays = (q, np.tile(panel / 6.0, 3) * surface, w, f)
    for array in arrays:
        array.setflags(write=False)
    return arrays


def mean_cosine(dimension: int, x: Array) -> Array:
    """Mean of cos(x e_1) over directions e."""
    if dimension == 3:
        return np.asarray(np.sinc(x / np.pi))
    from scipy import special

    return np.asarray(special.j0(x))


def one_minus_cosine(dimension: int, x: Array) -> tuple[Array, Array]:
    """Means over directions e of 1 - cos(x e_1) and of e_2^2 (1 - cos(x e_1)), e_2 across e_1.

    The mean of e_1^2 (1 - cos) is the first minus (D - 1) times the second. Power series below
    x = 1 avoid the cancellation.
    """
    small = np.minimum(x, 1.0)
    plain, across = np.zeros_like(x), np.zeros_like(x)
    term = np.ones_like(x)
    for power in range(1, 10):  # mean of e_1^(2p) is (2p-1)!! / (D (D+2) ... (D+2p-2))
        term = -term * small**2 / ((2 * power) * (dimension + 2 * power - 2))
        plain -= term
        across -= term / (dimension + 2 * power)
    large = x > 1.0
    if large.any():
        y = x[large]
        if dimension == 3:
            cosine = np.sin(y) / y
            first = (cosine - np.cos(y)) / y**2  # j_1(y) / y
        else:
            from scipy import special

            cosine, first = special.j0(y), special.j1(y) / y
        plain[large] = 1.0 - cosine
        across[large] = 1.0 / dimension - first
    return plain, across
