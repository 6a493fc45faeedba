r"""Viscosity of a thermal fluid of particles: friction, and what density fluctuations add to it.

A shear stress has a part of each kind: momentum carried along by the particles, the pressure
forces, and the friction with its noise. Friction alone gives the viscosity that was asked for; the
pressure forces add the integral of their own fluctuations, which decay as density modes do,

    eta_c(k) = kB T/(2 k^2) int d^Dq/(2 pi)^D {q_e [R(|k - q|) - R(q)]}^2 S(q) S(|k - q|)
               int_0^inf f_q(t) f_|k-q|(t) dt,         R = 1/S - 1,

q_e the component of q along the velocity of the shear wave. Here S is that of the random-phase
approximation and f the free decay of a density mode, f'' + lambda_L f' + k^2 (kB T/m) f/S = 0. As
k -> 0 this is kB T/(60 pi^2) int q^4 (S'/S)^2 int f^2 dt dq in 3D, the mode-coupling formula of
Geszti, J. Phys. C 16, 5805 (1983); for stiff friction f decays as S lambda_L, so that eta_c is
proportional to the friction: a fixed share of it, however viscous the fluid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

from .density import DensityTheory
from .friction import FrictionTheory

__all__ = ["ViscosityTheory"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LARGEST_KH = 32.0  # of the wave vectors summed; S is 1 beyond
POINTS = 640
TABLE = 3  # points of the tables of S and lambda for each of those
ANGLES = 48


@dataclass(frozen=True, kw_only=True)
class ViscosityTheory:
    """Zero-shear viscosity of one fluid of particles, in mean field.

    Parameters
    ----------
    density : DensityTheory
        Structure of the fluid.
    friction : FrictionTheory
        Its friction, of the same kernel, dimension and support.
    thermal_energy : float
        kB T [energy], > 0.
    time_step : float
        dt of the pair splitting [time], >= 0: the friction acts on a mode as
        (2/dt) tanh(lambda dt/2), so that large steps let the structure relax faster.

    Raises
    ------
    ValueError
        If the two theories are of different fluids, or a parameter is out of range.

    Notes
    -----
    Against simulation (X = 100, h/dx 2.2 to 3, eta* 2 to 80) `configurational` is right to a third,
    mostly too low: the approximation is of first order in the density fluctuations.

    Examples
    --------
    >>> from sdpd.theory import DensityTheory, FrictionTheory, ViscosityTheory
    >>> fluid = {"kernel": "wendland_c2", "dimension": 3, "support": 2.65}
    >>> theory = ViscosityTheory(
    ...     density=DensityTheory(**fluid, number_density=1.0, stiffness=100.0,
    ...                           compressibility_factor=100.0),
    ...     friction=FrictionTheory(**fluid, density=1.0, shear_viscosity=20.0),
    ...     thermal_energy=1.0,
    ... )
    >>> f"{theory.configurational():.2f}"
    '1.09'
    """

    density: DensityTheory
    friction: FrictionTheory
    thermal_energy: float
    time_step: float = 0.0

    def __post_init__(self) -> None:
        for name in ("kernel", "dimension", "support"):
            if getattr(self.density, name) != getattr(self.friction, name):
                raise ValueError(
                    f"`friction.{name}` must be that of `density`, {getattr(self.density, name)}, "
                    f"got {getattr(self.friction, name)}"
                )
        validation.positive("thermal_energy", self.thermal_energy)
        validation.non_negative("time_step", self.time_step)

    @property
    def mass(self) -> float:
        """Mass of a particle [mass]."""
        return self.friction.density / self.density.number_density

    @property
    def kinetic(self) -> float:
        """Viscosity by momentum that particles carry, rho D_s/2 [pressure x time]."""
        return self.friction.kinetic_viscosity(thermal_energy=self.thermal_energy, mass=self.mass)

    def configurational(self, wave_number: float = 0.0) -> float:
        """Viscosity by the pressure forces at a wave number [1/length] [pressure x time]."""
        k = validation.non_negative("wave_number", wave_number)
        if k not in self._known:
            straight = self._weight @ self._overlap(self._decay, self._decay)
            self._known[k] = float(straight) if k == 0.0 else self._at(k)
        return self._known[k]

    @property
    def stress_time(self) -> float:
        """Mean relaxation time of the stress by pressure forces [time]."""
        return self.configurational() / float(self._weight.sum())

    def remaining(self, lag: ArrayLike) -> Array:
        """Share of `configurational()` that builds up beyond a lag [time], any shape [1]."""
        t = np.asarray(lag, dtype=np.float64)
        rates, amplitudes = self._decay
        later = np.zeros(t.shape)
        for a, s in zip(amplitudes, rates, strict=True):
            for b, u in zip(amplitudes, rates, strict=True):
                tail = np.exp(-np.multiply.outer(t, s + u))
                later += np.real(tail @ (self._weight * a * b / (s + u)))
        return np.asarray(later / self.configurational())

    def relaxation_time(self, share: float = 0.05) -> float:
        """Lag beyond which less than a share of `configurational()` builds up [time]."""
        if not 0.0 < share < 1.0:
            raise ValueError(f"`share` must lie between 0 and 1, got {share}")
        from scipy import optimize

        slowest = 1.0 / float(np.min(np.real(self._decay[0])))
        low, high = 1e-9 * slowest, slowest
        while self.remaining(high) > share:
            high *= 2.0
        root = optimize.brentq(
            lambda log: math.log(float(self.remaining(math.exp(log))) / share),
            math.log(low),
            math.log(high),
            xtol=1e-4,
        )
        return math.exp(root)

    # --- density modes ----------------------------------------------------------------------

    @cached_property
    def _known(self) -> dict[float, float]:
        """What `configurational` has found so far, by wave number."""
        return {}

    @cached_property
    def _grid(self) -> tuple[Array, float]:
        """Wave numbers at the middle of equal intervals, and their width."""
        width = LARGEST_KH / self.density.support / POINTS
        return np.asarray((np.arange(POINTS) + 0.5) * width), width

    @cached_property
    def _weight(self) -> Array:
        """kB T/2 <(q_e S'/S)^2> d^Dq/(2 pi)^D at k = 0: C(0) of the stress, by wave number."""
        q, width = self._grid
        step = 0.01 * width
        ends = self.density.structure_factor(np.stack([q - step, q + step]))
        slope = np.diff(np.log(ends), axis=0)[0] / (2.0 * step)
        plane = q**3 / (32.0 * np.pi) if self.density.dimension == 2 else q**4 / (60.0 * np.pi**2)
        return np.asarray(self.thermal_energy * plane * slope**2 * width)

    @cached_property
    def _decay(self) -> tuple[Complex, Complex]:
        return self._modes(self._grid[0])

    @cached_property
    def _tables(self) -> tuple[Array, Array, Array]:
        """Wave numbers, S and the damping rate of longitudinal waves as the steps let it act."""
        q = np.linspace(0.0, 1.5 * LARGEST_KH / self.density.support, int(1.5 * TABLE * POINTS))
        damping = self.friction.plane_wave_rates(q)[1]
        if self.time_step > 0.0:
            damping = 2.0 / self.time_step * np.tanh(0.5 * damping * self.time_step)
        return q, self.density.structure_factor(q), damping

    def _properties(self, q: Array) -> tuple[Array, Array]:
        """S [1] and damping rate [1/time], any shape."""
        grid, structure, damping = self._tables
        return np.interp(q, grid, structure), np.interp(q, grid, damping)

    def _modes(self, q: Array) -> tuple[Complex, Complex]:
        """Rates [1/time] and amplitudes [1] of the two exponentials of f_q(t), (2, ...)."""
        structure, damping = self._properties(q)
        square = q**2 * self.thermal_energy / self.mass / structure
        half = 0.5 * damping.astype(np.complex128)
        root = np.sqrt(half**2 - square)
        root = np.where(np.abs(root) < 1e-7 * np.abs(half), 1e-7 * np.abs(half), root)
        fast = half + root
        slow = square / fast  # half - root without the cancellation
        rates = np.stack([slow, fast])
        return rates, np.stack([fast, -slow]) / (fast - slow)

    @staticmethod
    def _overlap(first: tuple[Complex, Complex], second: tuple[Complex, Complex]) -> Array:
        """Integral of f_p(t) f_q(t) over t from 0 to infinity [time]."""
        total = np.zeros(first[0].shape[1:], dtype=np.complex128)
        for s, a in zip(*first, strict=True):
            for u, b in zip(*second, strict=True):
                total = total + a * b / (s + u)
        return np.asarray(np.real(total))

    def _at(self, k: float) -> float:
        """The integral over q at finite k, p = k - q, in polar coordinates about k."""
        dimension = self.density.dimension
        q, width = self._grid
        if dimension == 3:
            cosine, share = np.polynomial.legendre.leggauss(ANGLES)
            share = 0.5 * share * 0.5 * (1.0 - cosine**2)  # mean of (q_e/q)^2 over the azimuth
        else:
            angle = (np.arange(2 * ANGLES) + 0.5) * np.pi / (2 * ANGLES)
            cosine, share = np.cos(angle), np.sin(angle) ** 2 / (2 * ANGLES)
        surface = q / (2.0 * np.pi) if dimension == 2 else q**2 / (2.0 * np.pi**2)
        p = np.sqrt(np.maximum(q[:, None] ** 2 + k**2 - 2.0 * k * q[:, None] * cosine, 1e-300))
        here, there = self._properties(q)[0][:, None], self._properties(p)[0]
        vertex = (1.0 / there - 1.0 / here) ** 2 * here * there * q[:, None] ** 2
        own = tuple(part[..., None] for part in self._decay)
        time = self._overlap((own[0], own[1]), self._modes(p))
        total = surface * width @ (vertex * time) @ share
        return float(0.5 * self.thermal_energy / k**2 * total)
