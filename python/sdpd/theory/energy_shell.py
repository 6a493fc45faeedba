r"""Fluids of particles with an energy at equilibrium, exact for any number of particles.

The stationary distribution is exp(sum S_i/kB) on the shell of constant energy and momentum, with
the measure dr dp dS. For a constant heat capacity C = k kB and given positions the thermal energies
C T_i and the D(N - 1) momenta then share E - E_cold as a Dirichlet distribution does: with
A = N k + D (N - 1)/2 and kB T = (E - E_cold)/A

    <T_i> = T,   Var T_i/T^2 = (A - k)/(k (A + 1)),   Cov(T_i, T_j)/T^2 = -1/(A + 1),

whatever the positions: temperatures do not know densities. As N -> infinity T_i has the gamma
distribution of shape k, Var T_i = kB T^2/C. Español, Serrano and Öttinger, Phys. Rev. Lett. 83,
4542 (1999) (the structure); Landau and Lifshitz, *Statistical Physics, Part 1*, sec. 112.
"""

from __future__ import annotations

from dataclasses import dataclass

from sdpd import validation

__all__ = ["EnergyShell"]


@dataclass(frozen=True, kw_only=True)
class EnergyShell:
    """N particles that share a constant energy.

    Parameters
    ----------
    particles : int
        N >= 2.
    dimension : int
        2 or 3.
    heat_capacity : float
        k = C/kB of a particle [1], > 0.

    Raises
    ------
    TypeError, ValueError
        If a parameter is out of range.

    Examples
    --------
    >>> from sdpd.theory import EnergyShell
    >>> shell = EnergyShell(particles=1000, dimension=3, heat_capacity=50.0)
    >>> round(50.0 * shell.variance, 4)  # 1 next to a bath
    0.999
    """

    particles: int
    dimension: int
    heat_capacity: float

    def __post_init__(self) -> None:
        validation.integer("particles", self.particles, minimum=2)
        if self.dimension not in (2, 3):
            raise ValueError(f"`dimension` must be 2 or 3, got {self.dimension!r}")
        validation.positive("heat_capacity", self.heat_capacity)

    @property
    def freedom(self) -> float:
        """A: kB T is the energy without its cold part over this [1]."""
        count = self.particles
        return count * self.heat_capacity + 0.5 * self.dimension * (count - 1)

    @property
    def variance(self) -> float:
        """Var T_i/T^2 [1]; 1/k next to a bath."""
        k, whole = self.heat_capacity, self.freedom
        return (whole - k) / (k * (whole + 1.0))

    @property
    def covariance(self) -> float:
        """Cov(T_i, T_j)/T^2 of two particles at any distance [1]; 0 next to a bath."""
        return -1.0 / (self.freedom + 1.0)

    @property
    def logarithmic_variance(self) -> float:
        """Var ln T_i, psi'(k) - psi'(A): Var S_i/C^2 at constant density [1]."""
        from scipy.special import polygamma

        return float(polygamma(1, self.heat_capacity) - polygamma(1, self.freedom))

    @property
    def logarithmic_covariance(self) -> float:
        """Cov(ln T_i, ln T_j), -psi'(A) [1]."""
        from scipy.special import polygamma

        return -float(polygamma(1, self.freedom))

    @property
    def velocity_fourth_moment(self) -> float:
        """<v_a^4>/3<v_a^2>^2 of a component of a velocity, A/(A + 1) [1]; 1 next to a bath."""
        return self.freedom / (self.freedom + 1.0)

    def cell_variance(self, number: float) -> float:
        """Variance of the mean temperature of `number` of the particles, over T^2 [1]."""
        count = validation.positive("number", number)
        if count > self.particles:
            raise ValueError(f"`number` must be <= {self.particles}, got {count:g}")
        return self.variance / count + (1.0 - 1.0 / count) * self.covariance
