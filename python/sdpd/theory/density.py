r"""Equilibrium density fluctuations of the particle fluid in the random-phase approximation (RPA).

The potential energy is U = sum_i u(d_i) with u'(d) = P/d^2, so with X = m c^2/(kB T) and
Z = P/(n kB T) at the mean number density n

    1/S(k) = 1 + n beta (2 u' What + n u'' What^2) = 1 + 2 Z What + (X - 2 Z) What^2.

P = c^2 rho (ideal gas) has Z = X and gives X (2 What - What^2); the artificial compressibility
P = rho0 c^2/2 ((rho/rho0)^2 - 1) has Z = 0 at rho0 and gives X What^2. RPA is a mean-field theory:
against simulation it is within 15 % at h/dx = 2.2 and 4 % at h/dx >= 2.65 for X <= 100, and it
means nothing beyond the pairing limit. Hansen and McDonald, *Theory of Simple Liquids*, 4th ed.,
2013, sec. 3.5 (RPA); Español and Revenga, Phys. Rev. E 67, 026705 (2003) (the particle model).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels, validation

from .kernel_moments import kernel_square_integral, kernel_transform, mean_cosine

__all__ = [
    "DensityTheory",
    "cell_count_variance",
    "pairing_limit",
    "reduced_equation_of_state",
    "stiffness_slope",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class DensityTheory:
    """RPA of the density fluctuations of one fluid of particles.

    Parameters
    ----------
    kernel : str
        Name of the kernel.
    dimension : int
        2 or 3.
    support : float
        h, full support radius [length], > 0.
    number_density : float
        n [1/length^D], > 0.
    stiffness : float
        X = m c^2/(kB T), c the sound speed of the equation of state at n [1], >= 0.
    compressibility_factor : float
        Z = P/(n kB T) at n [1]; X for P = c^2 rho, 0 for the artificial compressibility at rho0.

    Raises
    ------
    ValueError
        If a parameter is out of range, or the fluid is beyond its pairing limit.

    Examples
    --------
    >>> from sdpd.theory import DensityTheory
    >>> fluid = DensityTheory(kernel="lucy", dimension=3, support=2.65, number_density=1.0,
    ...                       stiffness=100.0, compressibility_factor=100.0)
    >>> f"{fluid.variance():.2e} {fluid.bias():.2%}"
    '6.89e-04 0.57%'
    """

    kernel: str
    dimension: int
    support: float
    number_density: float
    stiffness: float
    compressibility_factor: float

    def __post_init__(self) -> None:
        kernels.get(self.kernel)
        if self.dimension not in (2, 3):
            raise ValueError(f"`dimension` must be 2 or 3, got {self.dimension!r}")
        validation.positive("support", self.support)
        validation.positive("number_density", self.number_density)
        validation.non_negative("stiffness", self.stiffness)
        validation.finite("compressibility_factor", self.compressibility_factor)
        margin = float(np.min(1.0 + self._response(_grid(self.kernel, self.dimension)[2])))
        if margin <= 0.0:
            raise ValueError(
                f"`stiffness` {self.stiffness:.4g} is beyond the pairing limit of the "
                f"{self.kernel} kernel in {self.dimension}D: 1/S(k) reaches {margin:.3g}"
            )

    @property
    def neighbors(self) -> float:
        """Return n h^D [1]."""
        return self.number_density * self.support**self.dimension

    def structure_factor(self, wave_number: ArrayLike) -> Array:
        """S(k) at wave numbers k [1/length], any shape; 1 for an ideal gas of free particles."""
        k = np.asarray(wave_number, dtype=np.float64)
        transform = kernel_transform(self.kernel, self.dimension, k * self.support)
        return np.asarray(1.0 / (1.0 + self._response(transform)))

    def variance(self) -> float:
        """Var d / n^2 of the kernel density at a point of space (not at a particle) [1]."""
        _, weight, transform = _grid(self.kernel, self.dimension)
        excess = 1.0 / (1.0 + self._response(transform)) - 1.0
        whole = kernel_square_integral(self.kernel, self.dimension)
        return float(whole + weight @ (transform**2 * excess)) / self.neighbors

    def bias(self) -> float:
        """<d_i>/n - 1, the mean over particles of the kernel density with its self term [1]."""
        _, weight, transform = _grid(self.kernel, self.dimension)
        excess = 1.0 / (1.0 + self._response(transform)) - 1.0
        itself = kernels.get(self.kernel).self_value(self.dimension)
        return float(itself + weight @ (transform * excess)) / self.neighbors

    def landau_lifshitz_ratio(self) -> float:
        """Variance over that of a sharp cell of volume 1/n without the kinetic part, 1/X [1]."""
        return self.variance() * self.stiffness

    def correlation(self, distance: ArrayLike) -> Array:
        """Correlation coefficient of the kernel density of two points at a distance [length]."""
        r = np.asarray(distance, dtype=np.float64)
        if not np.all(np.isfinite(r) & (r >= 0.0)):
            raise ValueError("`distance` must be finite and >= 0")
        x, weight, transform = _grid(self.kernel, self.dimension)
        spectrum = weight * transform**2 / (1.0 + self._response(transform))
        waves = mean_cosine(self.dimension, (r[..., None] / self.support) * x)
        return np.asarray(waves @ spectrum / spectrum.sum())

    def virial_pressure(self, *, thermal_energy: float, stiffness_slope: float) -> float:
        r"""Mean pressure, as the virial or a wall measures it [energy/length^D].

        Parameters
        ----------
        thermal_energy : float
            kB T [energy], > 0.
        stiffness_slope : float
            n dX/dn at n (:func:`stiffness_slope`): 0 for P = c^2 rho, X for the artificial
            compressibility, (gamma - 1) X for Tait's [1].

        Returns
        -------
        float

        Notes
        -----
        .. math:: \frac{P}{n k_BT} = 1 + Z + \frac1{2n}\int\frac{d^Dk}{(2\pi)^D}\Big[
                  n\frac{\partial R}{\partial n} S(k) - \ln(1 + R)\Big],\qquad S = 1/(1+R)

        the kinetic part, the equation of state at n, and the share of the density fluctuations
        (from the free energy kB T/2 sum_k ln(1 + R)). This is the order of RPA: simulations at X
        of 50 to 100 gave that share as 2 to 11 % larger in size (Lucy and Wendland C2 at h/dx
        2.65, Lucy and the quintic spline at 3).
        """
        validation.positive("thermal_energy", thermal_energy)
        slope = validation.finite("stiffness_slope", stiffness_slope)
        _, weight, transform = _grid(self.kernel, self.dimension)
        response = self._response(transform)
        x, z = self.stiffness, self.compressibility_factor
        change = 2.0 * (x - z) * transform + (slope - 2.0 * (x - z)) * transform**2
        share = 0.5 * float(weight @ (change / (1.0 + response) - np.log1p(response)))
        return self.number_density * thermal_energy * (1.0 + z + share / self.neighbors)

    def acoustic_factor(self) -> float:
        """S of the fastest density mode s c/h; velocity Verlet needs dt < 2 h/(s c) [1]."""
        if self.stiffness == 0.0:
            raise ValueError("`stiffness` must be > 0 for a sound speed")
        x, _, transform = _grid(self.kernel, self.dimension)
        square = self._response(transform) / self.stiffness
        return float(np.max(x * np.sqrt(np.maximum(square, 0.0))))

    def _response(self, transform: Array) -> Array:
        z = self.compressibility_factor
        return 2.0 * z * transform + (self.stiffness - 2.0 * z) * transform**2


def reduced_equation_of_state(
    kind: str,
    parameters: Sequence[float],
    *,
    density: float,
    mass: float,
    thermal_energy: float,
) -> tuple[float, float]:
    """Return X = m c^2/(kB T) and Z = P m/(rho kB T) of an equation of state at one density.

    Parameters
    ----------
    kind : str
        Kind of equation of state, as the core names it.
    parameters : sequence of float
        Its parameters in the core's order.
    density : float
        Mass density rho [mass/length^D], > 0.
    mass : float
        Mass of a particle [mass], > 0.
    thermal_energy : float
        kB T [energy], > 0.

    Returns
    -------
    stiffness, compressibility_factor : float
        [1].

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """
    from sdpd import _core

    validation.positive("density", density)
    validation.positive("mass", mass)
    validation.positive("thermal_energy", thermal_energy)
    at = np.array([density], dtype=np.float64)
    pressure, speed_squared, _ = _core.eos_evaluate(kind, list(parameters), at)
    unit = mass / thermal_energy
    return float(speed_squared[0]) * unit, float(pressure[0]) / density * unit


def stiffness_slope(
    kind: str,
    parameters: Sequence[float],
    *,
    density: float,
    mass: float,
    thermal_energy: float,
) -> float:
    """Return n dX/dn of an equation of state at one density, by a central difference [1].

    Parameters
    ----------
    kind, parameters, density, mass, thermal_energy
        As in :func:`reduced_equation_of_state`.

    Returns
    -------
    float
        To about 1e-8 of X; in a table by points it may jump there.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """
    step = 1e-4 * validation.positive("density", density)
    low, high = (
        reduced_equation_of_state(
            kind, parameters, density=at, mass=mass, thermal_energy=thermal_energy
        )[0]
        for at in (density - step, density + step)
    )
    return (high - low) / 2e-4


def pairing_limit(kernel: str, dimension: int, *, pressure_share: float = 1.0) -> float:
    """Largest X = m c^2/(kB T) at which the uniform fluid is stable in RPA.

    Parameters
    ----------
    kernel : str
        Name of the kernel.
    dimension : int
        2 or 3.
    pressure_share : float
        Z/X = P/(rho c^2): 1 for P = c^2 rho, 0 for the artificial compressibility at rho0.

    Returns
    -------
    float
        287 for Lucy in 3D with P = c^2 rho; infinite for kernels of positive transform.
    """
    validation.finite("pressure_share", pressure_share)
    transform = _grid(kernel, dimension)[2]
    lowest = float(
        np.min(2.0 * pressure_share * transform + (1.0 - 2.0 * pressure_share) * transform**2)
    )
    return -1.0 / lowest if lowest < -1e-12 else math.inf


def cell_count_variance(
    structure_factor: Callable[[Array], Array],
    *,
    box: Sequence[float],
    cell: Sequence[float],
    n_particles: int,
    max_wave_number: float,
) -> float:
    r"""Variance of the number of particles in a sharp rectangular cell of a periodic box.

    Parameters
    ----------
    structure_factor : callable
        S(k) of wave numbers [1/length], shape (M,) to (M,).
    box, cell : sequence of float, length D
        Edge lengths of the periodic box and of the cell [length], ``0 < cell <= box``.
    n_particles : int
        N, particles in the box.
    max_wave_number : float
        S(k) is taken as 1 beyond [1/length]; 25/h serves the kernels here.

    Returns
    -------
    float
        Var(N_cell), for S = 1 the binomial N p (1 - p) with p the volume share of the cell.

    Raises
    ------
    ValueError
        If shapes or ranges are wrong.

    Notes
    -----
    .. math:: \mathrm{Var} N_c = N p^2 \sum_{\mathbf k\ne0} S(k)
              \prod_a \mathrm{sinc}^2(k_a l_a/2)

    over the wave vectors of the box. Sharp cells of a stiff fluid are surface terms: the result
    can be many times the thermodynamic value.
    """
    lengths, edges = np.asarray(box, dtype=np.float64), np.asarray(cell, dtype=np.float64)
    if lengths.ndim != 1 or edges.shape != lengths.shape:
        raise ValueError("`box` and `cell` must have the same number of edge lengths")
    if not ((edges > 0.0) & (edges <= lengths)).all():
        raise ValueError(f"`cell` must lie between 0 and `box`, got {edges.tolist()}")
    number = validation.integer("n_particles", n_particles, minimum=1)
    limit = validation.positive("max_wave_number", max_wave_number)
    axes, factors = [], []
    for length, edge in zip(lengths, edges, strict=True):
        index = np.arange(int(limit * length / (2.0 * np.pi)) + 1)
        axes.append((2.0 * np.pi / length * index) ** 2)
        factors.append(np.sinc(index * edge / length) ** 2 * np.where(index > 0, 2.0, 1.0))
    rest_squared = np.add.outer(axes[1], axes[2]) if len(axes) == 3 else axes[1]
    rest_factor = np.multiply.outer(factors[1], factors[2]) if len(axes) == 3 else factors[1]
    total = 0.0
    for first_squared, first_factor in zip(axes[0], factors[0], strict=True):
        squared = first_squared + rest_squared
        used = (squared <= limit**2) & (squared > 0.0)
        if used.any():
            excess = structure_factor(np.sqrt(squared[used])) - 1.0
            total += first_factor * float(np.sum(rest_factor[used] * excess))
    share = float(np.prod(edges / lengths))
    return number * share * (1.0 - share) + number * share**2 * total


@lru_cache(maxsize=16)
def _grid(kernel: str, dimension: int) -> tuple[Array, Array, Array]:
    """Quadrature over wave vectors: kh, weight (with surface, over (2 pi)^D), What."""
    panels, order = 64, 12
    x, weight = np.polynomial.legendre.leggauss(order)
    width = 128.0 / panels
    kh = (np.arange(panels)[:, None] + 0.5 * (x + 1.0)).ravel() * width
    surface = kh / (2.0 * np.pi) if dimension == 2 else kh**2 / (2.0 * np.pi**2)
    arrays = (
        kh,
        np.tile(0.5 * width * weight, panels) * surface,
        kernel_transform(kernel, dimension, kh),
    )
    for array in arrays:
        array.setflags(write=False)
    return arrays
