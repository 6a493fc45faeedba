r"""What a kernel and its support deliver on discrete particles: sums over a lattice.

f_i = -sum_j g_ij [a v_ij + b e e.v_ij], g = F/(d_i d_j), becomes the Navier-Stokes equation where
sums become integrals. On the simple cubic (square) lattice the sums are exact and give the bias of
the density (d/n), of the viscosity (the decay of a long shear wave) and of the friction rate of a
particle; a fluid of particles differs a little.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels, validation

__all__ = [
    "DiscreteFactors",
    "KernelRow",
    "continuum_rate",
    "discrete_factors",
    "kernel_table",
    "lattice_rates",
    "pairs_per_particle",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DiscreteFactors:
    """Lattice sums over their continuum values, 1 for infinitely many neighbours.

    Attributes
    ----------
    density : float
        d/n: summed over mean number density, self term included.
    viscosity : float
        eta_eff/eta, of a long shear wave along a lattice axis.
    friction : float
        Friction rate of a particle over (a + b/D) I_F / rho.
    conductivity : float
        kappa_eff/kappa, of a long wave of temperature along a lattice axis.
    partners : float
        Effective number of partners that share the friction of a particle, (sum g)^2/sum g^2.
    """

    density: float
    viscosity: float
    friction: float
    partners: float
    conductivity: float = 1.0


def pairs_per_particle(dimension: int, support: float) -> float:
    """Mean number of pairs a particle counts, half its neighbours, for h/dx = `support`."""
    ball = math.pi if dimension == 2 else 4.0 * math.pi / 3.0
    return 0.5 * ball * support**dimension


def _offsets(dimension: int, support: float) -> Array:
    """Lattice vectors within the support, in units of the spacing, without the origin."""
    reach = math.ceil(support)
    axis = np.arange(-reach, reach + 1, dtype=np.float64)
    grid = np.stack(np.meshgrid(*[axis] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    square = np.einsum("ij,ij->i", grid, grid)
    return np.asarray(grid[(square > 0.0) & (square < support**2)])


@lru_cache(maxsize=256)
def _lattice(kernel: str, dimension: int, support: float) -> tuple[Array, Array, float]:
    """Lattice vectors, g = F/d^2 there and d, for unit spacing (n = 1)."""
    offsets = _offsets(dimension, support)
    distance = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
    w, f = kernels.evaluate(kernel, dimension, distance, support)
    own, _ = kernels.evaluate(kernel, dimension, 0.0, support)
    density = float(own) + float(w.sum())
    return offsets, f / density**2, density


def discrete_factors(
    kernel: str, dimension: int, support: float, *, across: float, along: float
) -> DiscreteFactors:
    """Lattice factors of one kernel and support.

    Parameters
    ----------
    kernel : str
        Key of the kernel.
    dimension : int
        2 or 3.
    support : float
        h/dx [1].
    across, along : float
        a and b of the friction, in any common unit; zero bulk viscosity has a = eta (1 + 2/D),
        b = (D + 2)(1 - 2/D) eta.

    Returns
    -------
    DiscreteFactors
    """
    offsets, g, density = _lattice(kernel, dimension, support)
    square = np.einsum("ij,ij->i", offsets, offsets)
    # shear wave along axis 0, velocity along axis 1: nu k^2 = sum_j g (a + b e_y^2)(1 - cos k x)/m
    x2, y2 = offsets[:, 0] ** 2, offsets[:, 1] ** 2
    with np.errstate(over="ignore", invalid="ignore"):  # a scene checks its magnitudes
        delivered = 0.5 * float(np.sum(g * x2 * (across + along * y2 / square)))
    eta = 0.5 * across + 0.5 * along / (dimension + 2)
    mean_field = kernels.get(kernel).friction_integral[dimension - 2] / support**2
    return DiscreteFactors(
        density=density,
        viscosity=delivered / eta if eta > 0.0 else 1.0,
        friction=float(g.sum()) / mean_field,
        partners=float(g.sum()) ** 2 / float(g @ g),
        conductivity=float(np.sum(g * x2)),
    )


def lattice_rates(
    kernel: str,
    dimension: int,
    support: float,
    wavevector: ArrayLike,
    *,
    spacing: float,
    across: float,
    along: float,
    mass: float,
) -> Array:
    r"""Decay-rate matrix of a plane wave of velocity on the undisturbed lattice, exact.

    Parameters
    ----------
    kernel : str
        Key of the kernel.
    dimension : int
        2 or 3.
    support : float
        h/dx [1].
    wavevector : array_like of float, shape (D,)
        k [1/length].
    spacing, mass : float
        dx [length] and m [mass].
    across, along : float
        a and b [mass/(length^(D-2) time)].

    Returns
    -------
    ndarray of float64, shape (D, D)
        Lambda [1/time]: without noise and pressure v_k' = -Lambda v_k.

    Notes
    -----
    .. math:: \Lambda(k) = \frac1m \sum_j g_{0j} (a I + b\, e e)(1 - \cos k \cdot r_{0j})
    """
    k = np.asarray(wavevector, dtype=np.float64)
    if k.shape != (dimension,):
        raise ValueError(f"`wavevector` must have shape ({dimension},), got {k.shape}")
    offsets, g, _ = _lattice(kernel, dimension, support)
    square = np.einsum("ij,ij->i", offsets, offsets)
    # g carries length^(D-2) (F/d^2) and is for unit spacing
    weight = g * spacing ** (dimension - 2) / mass * (1.0 - np.cos(offsets @ k * spacing))
    outer = np.einsum("i,ij,ik->jk", weight / square, offsets, offsets)
    return np.asarray(across * weight.sum() * np.eye(dimension) + along * outer)


def continuum_rate(
    kernel: str,
    dimension: int,
    wavenumber: ArrayLike,
    *,
    support_radius: float,
    density: float,
    across: float,
    along: float,
    longitudinal: bool = False,
) -> Array:
    r"""Decay rate of a plane wave of velocity in the limit of many neighbours.

    Parameters
    ----------
    kernel : str
        Key of the kernel.
    dimension : int
        2 or 3.
    wavenumber : array_like of float
        k [1/length], ``k h <= 100``.
    support_radius, density : float
        h [length] and rho [mass/length^D].
    across, along : float
        a and b [mass/(length^(D-2) time)].
    longitudinal : bool
        Velocity along k instead of across.

    Returns
    -------
    ndarray of float64, shape of `wavenumber`
        lambda(k) [1/time], -> nu k^2 for a transverse wave.

    Notes
    -----
    .. math:: \lambda_T(k) = \frac1\rho \int F(r) (a + b\, e_x^2)(1 - \cos k \cdot r)\, dV

    where x is the direction of the velocity.
    """
    q, weight = kernels.radial_nodes()
    _, f = kernels.evaluate(kernel, dimension, q)
    sphere = 4.0 * np.pi * q**2 if dimension == 3 else 2.0 * np.pi * q
    kh = np.asarray(wavenumber, dtype=np.float64) * validation.positive(
        "support_radius", support_radius
    )
    u = kh[..., None] * q
    # polar angle to k: mean over directions of (1 - cos u c) and of c^2 (1 - cos u c), c = e.k/k
    if dimension == 3:
        c, share = np.polynomial.legendre.leggauss(128)
        share = 0.5 * share
    else:
        c = np.cos((np.arange(256) + 0.5) * np.pi / 256)
        share = np.full(256, 1.0 / 256)
    wave = 1.0 - np.cos(u[..., None] * c)
    plain = wave @ share
    parallel = wave @ (share * c**2)
    weighted = parallel if longitudinal else (plain - parallel) / (dimension - 1)
    radial = (across * plain + along * weighted) @ (weight * sphere * f)
    return np.asarray(radial / (density * support_radius**2))


@dataclass(frozen=True)
class KernelRow:
    """One row of `kernel_table`: what a kernel and support deliver, and what they cost."""

    kernel: str
    support: float
    pairs: float
    density: float
    viscosity: float
    friction: float
    pairing_limit: float

    def as_dict(self) -> dict[str, Any]:
        """Plain dict, for a CSV file or a data frame."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def kernel_table(
    *,
    dimension: int = 3,
    supports: Iterable[float] = (2.05, 2.2, 2.4, 2.64, 3.0, 3.5, 4.0),
    names: Iterable[str] | None = None,
) -> list[KernelRow]:
    """Lattice factors of every kernel and support, at zero bulk viscosity.

    Parameters
    ----------
    dimension : int
        2 or 3.
    supports : iterable of float
        h/dx [1].
    names : iterable of str, optional
        Kernels; all if None.

    Returns
    -------
    list of KernelRow

    Examples
    --------
    >>> import sdpd
    >>> row = sdpd.discretization.kernel_table(supports=[2.64], names=["lucy"])[0]
    >>> round(row.density, 3), round(row.viscosity, 3), round(row.friction, 2)
    (0.998, 0.991, 0.9)
    """
    across, along = 1.0 + 2.0 / dimension, (dimension + 2.0) * (1.0 - 2.0 / dimension)
    rows = []
    for name in kernels.names() if names is None else names:
        for support in supports:
            factors = discrete_factors(name, dimension, support, across=across, along=along)
            rows.append(
                KernelRow(
                    kernel=name,
                    support=support,
                    pairs=pairs_per_particle(dimension, support),
                    density=factors.density,
                    viscosity=factors.viscosity,
                    friction=factors.friction,
                    pairing_limit=kernels.get(name).pairing_limit[dimension - 2],
                )
            )
    return rows
