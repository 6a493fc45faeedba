r"""Friction of the particle model: rates of plane waves, of one particle, self-diffusion.

Pairs act on each other by f_i = -g_ij [a v_ij + b e e.v_ij], g = F/(d_i d_j), with

    a = eta (1 + 2/D) - zeta,    b = (D + 2) (zeta + eta (1 - 2/D)),

which in the continuum gives the viscous force of Navier-Stokes with shear viscosity eta and bulk
viscosity zeta. The central form a = 0, b = 2 (D + 2) eta conserves angular momentum and has
zeta = eta (1 + 2/D). Español and Revenga, Phys. Rev. E 67, 026705 (2003); Yang (2013) eq. 2.10.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels, validation

from .kernel_moments import friction_integral, nodes, one_minus_cosine

__all__ = ["FrictionTheory", "friction_coefficients", "viscosities"]

Array = NDArray[np.float64]


def friction_coefficients(
    shear_viscosity: float, bulk_viscosity: float, dimension: int
) -> tuple[float, float]:
    """Return a and b of the pair friction from the viscosities [pressure x time].

    Raises
    ------
    ValueError
        If ``a < 0`` or ``a + b < 0``: then no random force fits the friction.
    """
    eta = validation.non_negative("shear_viscosity", shear_viscosity)
    zeta = validation.non_negative("bulk_viscosity", bulk_viscosity)
    _check_dimension(dimension)
    across = eta * (1.0 + 2.0 / dimension) - zeta
    along = (dimension + 2.0) * (zeta + eta * (1.0 - 2.0 / dimension))
    if across < -1e-12 * eta:
        raise ValueError(
            f"`bulk_viscosity` must be <= shear_viscosity (1 + 2/D) = "
            f"{eta * (1.0 + 2.0 / dimension):.6g}, got {zeta:.6g}"
        )
    return max(across, 0.0), along


def viscosities(across: float, along: float, dimension: int) -> tuple[float, float]:
    """Return the shear and bulk viscosity that pair coefficients a and b stand for."""
    _check_dimension(dimension)
    a, b = validation.finite("across", across), validation.finite("along", along)
    shear = 0.5 * a + b / (2.0 * (dimension + 2.0))
    return shear, b / (dimension + 2.0) - shear * (1.0 - 2.0 / dimension)


@dataclass(frozen=True, kw_only=True)
class FrictionTheory:
    """Mean-field friction of a fluid of particles of one kernel.

    Parameters
    ----------
    kernel : str
        Name of the kernel.
    dimension : int
        2 or 3.
    support : float
        h, full support radius [length], > 0.
    density : float
        Mass density rho [mass/length^D], > 0.
    shear_viscosity : float
        eta [pressure x time], > 0.
    bulk_viscosity : float
        zeta [pressure x time], 0 <= zeta <= eta (1 + 2/D); ignored by the central form.
    central : bool
        Take the angular-momentum-conserving form a = 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    kernel: str
    dimension: int
    support: float
    density: float
    shear_viscosity: float
    bulk_viscosity: float = 0.0
    central: bool = False

    def __post_init__(self) -> None:
        kernels.get(self.kernel)
        _check_dimension(self.dimension)
        validation.positive("support", self.support)
        validation.positive("density", self.density)
        validation.positive("shear_viscosity", self.shear_viscosity)
        friction_coefficients(self.shear_viscosity, self.bulk_viscosity, self.dimension)

    @property
    def coefficients(self) -> tuple[float, float]:
        """Return a and b [pressure x time]."""
        if self.central:
            return 0.0, 2.0 * (self.dimension + 2.0) * self.shear_viscosity
        return friction_coefficients(self.shear_viscosity, self.bulk_viscosity, self.dimension)

    def rate(self) -> float:
        """Friction rate of one particle 1/tau = (a + b/D) I_F/rho, minus the VACF's slope [1/time].

        Neighbours are taken as uncorrelated in place; on particles the mean of
        ``sum_j g_ij (a + b/D)/m`` differs by the lattice's factor (0.8 to 0.95 at h/dx 2.6 to 3).
        """
        across, along = self.coefficients
        integral = friction_integral(self.kernel, self.dimension) / self.support**2
        return (across + along / self.dimension) * integral / self.density

    def self_diffusion(self, *, thermal_energy: float, mass: float) -> float:
        """Mean-field self-diffusion coefficient kB T tau/m [length^2/time].

        Good to about 10 % for soft viscous fluids; up to 30 % too high where the conservative
        forces cage strongly (X >= 400), meaningless in a paired fluid.
        """
        validation.positive("thermal_energy", thermal_energy)
        validation.positive("mass", mass)
        return thermal_energy / mass / self.rate()

    def kinetic_viscosity(self, *, thermal_energy: float, mass: float) -> float:
        """Shear viscosity of the momentum that particles carry along, rho D_s/2 [pressure x time].

        Kinetic theory without conservative forces (Marsh, Backx and Ernst, Phys. Rev. E 56, 1676
        (1997); Groot and Warren 1997): the kinetic stress decays at twice the friction rate. It
        adds to the input viscosity; both parts of a fluid under pressure differ from it, as the
        conservative stress of the thermal motion adds as well.
        """
        diffusion = self.self_diffusion(thermal_energy=thermal_energy, mass=mass)
        return 0.5 * self.density * diffusion

    def self_diffusion_factor(self) -> float:
        """K of ``D_self = K h^2 rho kB T/(m eta)`` [1]; Lucy 1/20 in 2D, 3/70 in 3D at zeta = 0."""
        return self.shear_viscosity / (self.rate() * self.density * self.support**2)

    def schmidt_number(self, *, thermal_energy: float, mass: float) -> float:
        """Return eta/(rho D_self) with the mean-field diffusion coefficient [1]."""
        diffusion = self.self_diffusion(thermal_energy=thermal_energy, mass=mass)
        return self.shear_viscosity / (self.density * diffusion)

    def plane_wave_rates(self, wave_number: ArrayLike) -> tuple[Array, Array]:
        r"""Decay rates of transverse and longitudinal velocity waves in the continuum limit.

        Parameters
        ----------
        wave_number : array_like, any shape
            k [1/length], >= 0.

        Returns
        -------
        transverse, longitudinal : ndarray, shape of `wave_number`
            [1/time]; nu k^2 and 2 Gamma_T k^2 as k h -> 0.

        Notes
        -----
        .. math:: \lambda(k) = \frac1\rho\int F(r)\,(a + b\,(e\cdot p)^2)\,
                  (1 - \cos\mathbf k\cdot\mathbf r)\,d^Dr

        with p the unit vector of the velocity, across or along k.
        """
        k = np.asarray(wave_number, dtype=np.float64)
        if not np.all(np.isfinite(k) & (k >= 0.0)):
            raise ValueError("`wave_number` must be finite and >= 0")
        across, along = self.coefficients
        kh = k * self.support
        order = 32 + 16 * int(np.max(kh, initial=0.0) / 48.0)
        q, weight, _, f = nodes(self.kernel, self.dimension, order)
        plain, side = one_minus_cosine(self.dimension, kh[..., None] * q)
        forward = plain - (self.dimension - 1.0) * side
        unit = 1.0 / (self.density * self.support**2)
        transverse = (across * plain + along * side) @ (weight * f) * unit
        longitudinal = (across * plain + along * forward) @ (weight * f) * unit
        return np.asarray(transverse), np.asarray(longitudinal)

    def viscosity_ratio(self, wave_number: ArrayLike) -> Array:
        """Transverse rate over nu k^2: the viscosity a wave of finite length feels [1]."""
        k = np.asarray(wave_number, dtype=np.float64)
        if not np.all(k > 0.0):
            raise ValueError("`wave_number` must be > 0")
        kinematic = self.shear_viscosity / self.density
        return self.plane_wave_rates(k)[0] / (kinematic * k**2)

    def lattice_plane_wave_rate(
        self, wave_vector: ArrayLike, polarization: ArrayLike, *, spacing: float
    ) -> float:
        r"""Exact decay rate of a velocity wave on a square or simple cubic lattice at rest.

        Parameters
        ----------
        wave_vector : array_like, shape (D,)
            k [1/length].
        polarization : array_like, shape (D,)
            Direction of the velocity, any length > 0. The rate is that of an eigenmode when k
            and the direction lie along lattice axes.
        spacing : float
            Lattice constant dx [length]; the particle mass is rho dx^D.

        Returns
        -------
        float
            [1/time].
        """
        k = _vector("wave_vector", wave_vector, self.dimension)
        direction = _vector("polarization", polarization, self.dimension)
        size = float(np.linalg.norm(direction))
        if size == 0.0:
            raise ValueError("`polarization` must not be zero")
        r, g = self._lattice(spacing)
        across, along = self.coefficients
        cosine = (r @ (direction / size)) ** 2 / np.sum(r**2, axis=1)
        wave = 2.0 * np.sin(0.5 * (r @ k)) ** 2
        return float(np.sum(g * (across + along * cosine) * wave)) / self._mass(spacing)

    def lattice_rate(self, *, spacing: float) -> float:
        """Friction rate of one particle at rest on the lattice, all others fixed [1/time]."""
        _, g = self._lattice(spacing)
        across, along = self.coefficients
        return float(np.sum(g)) * (across + along / self.dimension) / self._mass(spacing)

    def lattice_factors(self, *, spacing: float) -> tuple[float, float, float]:
        """Return d/n, eta_eff/eta (k -> 0 along an axis) and the friction rate's factor [1].

        Parameters
        ----------
        spacing : float
            Lattice constant dx [length].
        """
        k = np.zeros(self.dimension)
        k[0] = 1e-4 / self.support
        rate = self.lattice_plane_wave_rate(k, np.eye(self.dimension)[1], spacing=spacing)
        viscosity = rate / (self.shear_viscosity / self.density * k[0] ** 2)
        density = self._lattice_density(spacing) * spacing**self.dimension
        return density, viscosity, self.lattice_rate(spacing=spacing) / self.rate()

    def _mass(self, spacing: float) -> float:
        return self.density * validation.positive("spacing", spacing) ** self.dimension

    def _lattice(self, spacing: float) -> tuple[Array, Array]:
        """Neighbours of a lattice site: separations (M, D) and g = F/d^2 (M,)."""
        r = _lattice_sites(self.dimension, self.support, validation.positive("spacing", spacing))
        distance = np.linalg.norm(r, axis=1)
        _, f = kernels.evaluate(self.kernel, self.dimension, distance, self.support)
        return r, f / self._lattice_density(spacing) ** 2

    def _lattice_density(self, spacing: float) -> float:
        r = _lattice_sites(self.dimension, self.support, spacing)
        distance = np.concatenate([[0.0], np.linalg.norm(r, axis=1)])
        w, _ = kernels.evaluate(self.kernel, self.dimension, distance, self.support)
        return float(np.sum(w))


def _lattice_sites(dimension: int, support: float, spacing: float) -> Array:
    reach = int(support / spacing) + 1
    axis = np.arange(-reach, reach + 1, dtype=np.float64)
    grid = np.meshgrid(*[axis] * dimension, indexing="ij")
    r = spacing * np.stack(grid, axis=-1).reshape(-1, dimension)
    squared = np.sum(r**2, axis=1)
    return np.asarray(r[(squared > 0.0) & (squared < support**2)])


def _vector(name: str, value: ArrayLike, dimension: int) -> Array:
    return np.array(validation.vector(name, value, length=dimension))


def _check_dimension(dimension: int) -> None:
    if dimension not in (2, 3):
        raise ValueError(f"`dimension` must be 2 or 3, got {dimension!r}")
