r"""Why the long-time coefficient differs from the short-time one: a mean-field estimate.

In the plane-wave picture a velocity of wavenumber k decays at the rate :math:`\lambda(k)`, which
becomes the friction rate 1/tau of a lone particle only for short waves: momentum handed to the
neighbours comes back as long as it has not spread. That raises the coefficient. The conservative
force lowers it: a density mode around the particle resists its motion until it has relaxed
(caging). Both sums run over the wave vectors of the periodic box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels
from sdpd.scene import Scene
from sdpd.theory.friction import FrictionTheory

__all__ = ["CollectiveTheory", "collective_theory"]

Array = NDArray[np.float64]

LARGEST_KH = 25.0  # beyond it a particle and its mode move alike


@dataclass(frozen=True, kw_only=True, eq=False)
class CollectiveTheory:
    """Mean-field estimate of what collective motion does to self-diffusion; good to a few per cent.

    Attributes
    ----------
    short : float
        Short-time coefficient of evenly spread particles [length^2/time].
    gain : float
        Relative rise by momentum that comes back from the neighbours [1].
    loss : float
        Relative fall by caging, at infinite time [1].
    weight, relaxation : ndarray
        Shares of the loss [1] and the rates at which they build up [1/time].
    """

    short: float
    gain: float
    loss: float
    weight: Array
    relaxation: Array

    @property
    def long(self) -> float:
        """Long-time coefficient [length^2/time]."""
        return self.short * (1.0 + self.gain - self.loss)

    def remaining(self, lag: ArrayLike) -> Array:
        """Part of the loss not yet there in the slope of the displacement at that lag [1]."""
        t = np.asarray(lag, dtype=np.float64)[..., None]
        return np.asarray(np.exp(-self.relaxation * t) @ self.weight)


def collective_theory(scene: Scene) -> CollectiveTheory:
    r"""Evaluate the sums for a cubic scene.

    Raises
    ------
    ValueError
        If the box is not a cube.

    Notes
    -----
    With :math:`\lambda_T, \lambda_L` the decay rates of transverse and longitudinal waves, r their
    limit at short waves and v^2 = k_B T/m,

    .. math::
        D_0^{-1} &= v^{-2} \Big[r + \frac{1}{3N}\sum_k (2\lambda_T+\lambda_L-3r)\Big], \qquad
        D_1 = v^2 \Big[\frac1r + \frac{1}{3N}\sum_k
              \Big(\frac2{\lambda_T}+\frac1{\lambda_L}-\frac3r\Big)\Big], \\
        D &= D_1\Big[1 - \frac1{3N}\sum_k \frac{w^2}{1+w}\,\frac{s}{s+c}\Big]

    where w = 1/S(k) - 1 in the random-phase approximation, s = k^2 D_1 is the rate at which the
    particle leaves a density mode and c = k^2 v^2 (1 + w)/lambda_L that at which the mode relaxes
    by itself (overdamped).
    """
    edge = scene.box.lengths[0]
    if scene.dimension != 3 or max(scene.box.lengths) - min(scene.box.lengths) > 1e-9 * edge:
        raise ValueError(f"`scene.box` must be a cube, got {scene.box.lengths}")
    h, number = scene.support_radius, scene.n_particles
    k, count = _shells(edge, LARGEST_KH / h)
    theory = FrictionTheory(
        kernel=scene.resolution.kernel,
        dimension=3,
        support=h,
        density=scene.fluid.density,
        shear_viscosity=scene.fluid.shear_viscosity / scene.calibration,
        bulk_viscosity=scene.active_effects.effective_bulk_viscosity / scene.calibration,
        central=scene.active_effects.central_friction,
    )
    across, along = theory.plane_wave_rates(k)
    r, variance, share = theory.rate(), scene.thermal_speed**2, count / (3.0 * number)
    first = r + float(share @ (2.0 * across + along - 3.0 * r))
    time = (1.0 - 1.0 / number) / r + float(share @ (2.0 / across + 1.0 / along - 3.0 / r))
    transform = kernels.fourier_transform(scene.resolution.kernel, 3, k * h)
    pressure = scene.pressure_number
    w = 2.0 * pressure * transform + (scene.stiffness - 2.0 * pressure) * transform**2
    leaving = k**2 * variance * time
    relaxing = k**2 * variance * (1.0 + w) / along
    weight = share * w**2 / (1.0 + w) * leaving / (leaving + relaxing) * time * first
    return CollectiveTheory(
        short=variance / first,
        gain=time * first - 1.0,
        loss=float(weight.sum()),
        weight=weight,
        relaxation=leaving + relaxing,
    )


def _shells(edge: float, largest: float) -> tuple[Array, Array]:
    """Wavenumbers of a periodic cube up to the largest, and how many vectors each has."""
    unit = 2.0 * np.pi / edge
    reach = int(largest / unit) + 1
    squares = np.arange(-reach, reach + 1) ** 2
    total = (squares[:, None] + squares)[:, :, None] + squares
    number = np.bincount(total.ravel())[: reach**2 + 1]
    found = np.flatnonzero(number[1:]) + 1
    return unit * np.sqrt(found), number[found].astype(np.float64)
