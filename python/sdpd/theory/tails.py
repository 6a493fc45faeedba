r"""What the modes of a fluid do to a particle in it: long-time tail, size of the periodic box.

A particle's velocity lives on in the flow it set off. In mode coupling, the velocity field at the
particle has the component kB T/rho per wave vector and transverse direction, it decays with nu k^2
and the particle leaves it with D_s k^2, so

    C(t) = <v(0).v(t)>/D = (D - 1)/D (kB T/rho) (1/V) sum_{k != 0} exp(-(nu + D_s) k^2 t)

in a periodic box, and (D - 1)/D (kB T/rho) [4 pi (nu + D_s) t]^(-D/2) without one. The sums over
k are products of theta functions, evaluated to rounding.

Alder and Wainwright, Phys. Rev. A 1, 18 (1970); Ernst, Hauge and van Leeuwen, Phys. Rev. Lett. 25,
1254 (1970); Hansen and McDonald, *Theory of Simple Liquids*, 4th ed., 2013, sec. 8.7; Yeh and
Hummer, J. Phys. Chem. B 108, 15873 (2004).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

from .hydrodynamics import HydrodynamicTheory

__all__ = ["finite_size_diffusion", "vacf_tail"]

Array = NDArray[np.float64]

_MOST_VECTORS = 4_000_000


def vacf_tail(
    time: ArrayLike,
    *,
    fluid: HydrodynamicTheory,
    thermal_energy: float,
    self_diffusion: float = 0.0,
    box: Sequence[float] | None = None,
    sound: bool = False,
) -> Array:
    r"""Long-time velocity autocorrelation of a particle, by mode coupling.

    Parameters
    ----------
    time : array_like, any shape
        t [time], > 0.
    fluid : HydrodynamicTheory
        Density and viscosities, those that the fluid of particles *delivers*; bulk viscosity and
        sound speed are used with `sound` only.
    thermal_energy : float
        kB T [energy], > 0.
    self_diffusion : float
        D_s [length^2/time], >= 0; negligible against nu at large Schmidt numbers.
    box : sequence of float, length D, optional
        Edge lengths of the periodic box [length]; an infinite fluid without.
    sound : bool
        Add the longitudinal modes of the box, for times of many 2 Gamma_T/c_T^2. In an infinite
        fluid sound carries its momentum away for good; in a box it comes round again after L/c_T
        unless damped by then.

    Returns
    -------
    ndarray of float64, shape of `time`
        <v_i(0).v_i(t)>/D, per component [length^2/time^2].

    Raises
    ------
    ValueError
        If a parameter is out of range, `sound` is asked for without `box`, or `time` is so early
        that the longitudinal sum needs more than 4e6 wave vectors.

    Notes
    -----
    Approximate: it takes the long-wave limits of viscosity and diffusion for all k and is right for
    times in which shear diffuses much farther than a particle's support, :math:`\nu t \gg h^2`; as
    t falls it diverges where the true function ends at kB T/m. In a box the tail turns exponential
    at :math:`t \sim L^2/(4\pi^2\nu)`; the sum over the box's modes is then its leading order. In 2D
    the integral of t^(-1) diverges, so nu and D_s grow with the size of the box and the tail is
    only the first order of a series. With sound,

    .. math:: C(t) = \frac{k_BT}{D\rho V}\sum_{\mathbf k\ne0} e^{-D_sk^2t}
              \left[(D-1)\,e^{-\nu k^2t} + C_L(k,t)\right]

    where C_L is :meth:`HydrodynamicTheory.longitudinal`; its overdamped waves, k > c_T/Gamma_T,
    are not to be trusted but fade as exp(-c_T^2 t/(2 Gamma_T)).

    References
    ----------
    .. [1] Alder and Wainwright, Phys. Rev. A 1, 18 (1970).
    .. [2] Ernst, Hauge and van Leeuwen, Phys. Rev. Lett. 25, 1254 (1970).
    .. [3] Hansen and McDonald, *Theory of Simple Liquids*, 4th ed., 2013, sec. 8.7.

    Examples
    --------
    >>> from sdpd import theory
    >>> fluid = theory.HydrodynamicTheory(
    ...     dimension=3, density=1.0, shear_viscosity=2.0, sound_speed=10.0)
    >>> free = theory.vacf_tail([1.0, 4.0], fluid=fluid, thermal_energy=1.0)
    >>> round(float(free[0] / free[1]), 9)         # t^(-3/2)
    8.0
    """
    t = np.asarray(time, dtype=np.float64)
    if not np.all(np.isfinite(t) & (t > 0.0)):
        raise ValueError("`time` must be finite and > 0")
    energy = validation.positive("thermal_energy", thermal_energy)
    spread = validation.non_negative("self_diffusion", self_diffusion)
    dimension = fluid.dimension
    scale = energy / fluid.density / dimension
    decay = (fluid.kinematic_viscosity + spread) * t
    if box is None:
        if sound:
            raise ValueError("`sound` needs a `box`: without one sound does not come back")
        return np.asarray(scale * (dimension - 1.0) * (4.0 * math.pi * decay) ** (-0.5 * dimension))
    lengths = np.array(_box(box, dimension))
    modes = np.array([_mode_sum(float(s), lengths) for s in decay.ravel()]).reshape(t.shape)
    whole = (dimension - 1.0) * modes
    if sound:
        whole = whole + _sound_modes(t, fluid, spread, lengths)
    return np.asarray(scale * whole)


def finite_size_diffusion(
    *,
    box: Sequence[float],
    thermal_energy: float,
    shear_viscosity: float,
    reference_box: Sequence[float] | None = None,
    schmidt_number: float = math.inf,
) -> float:
    r"""What a periodic box takes from the self-diffusion coefficient [length^2/time].

    Parameters
    ----------
    box : sequence of float, length D
        Edge lengths of the periodic box [length].
    thermal_energy : float
        kB T [energy], > 0.
    shear_viscosity : float
        eta that the fluid delivers [pressure x time], > 0.
    reference_box : sequence of float, length D, optional
        The box to correct to; infinite by default, which 2D has not: there D_s grows as the
        logarithm of the box for ever.
    schmidt_number : float
        nu/D_s, > 0; a finite one divides the result by 1 + 1/Sc, as in :func:`vacf_tail`.

    Returns
    -------
    float
        D_s(reference) - D_s(box), mean over the axes: *add* it to a result from `box`.

    Raises
    ------
    ValueError
        If a parameter is out of range, or there is no `reference_box` in 2D.

    Notes
    -----
    .. math:: \Delta D = \frac{D-1}{D}\frac{k_BT}{\eta}\Big[\int\frac{d^Dk}{(2\pi)^D}\frac1{k^2}
              - \frac1V\sum_{\mathbf k\ne0}\frac1{k^2}\Big]

    which in a cube is 2.837297 kB T/(6 pi eta L) [1]_ [2]_. In an elongated box the single axes
    differ, and the mean over them can change its sign. The flow is taken as that of a point force
    at zero Reynolds number: right for boxes of many supports.

    References
    ----------
    .. [1] Dünweg and Kremer, J. Chem. Phys. 99, 6983 (1993).
    .. [2] Yeh and Hummer, J. Phys. Chem. B 108, 15873 (2004).

    Examples
    --------
    >>> from sdpd import theory
    >>> missing = theory.finite_size_diffusion(
    ...     box=(10.0, 10.0, 10.0), thermal_energy=1.0, shear_viscosity=1.0)
    >>> round(missing * 6.0 * 3.141592653589793 * 10.0, 6)
    2.837297
    """
    dimension = len(box)
    if dimension not in (2, 3):
        raise ValueError(f"`box` must have 2 or 3 edge lengths, got {dimension}")
    lengths = np.array(_box(box, dimension))
    energy = validation.positive("thermal_energy", thermal_energy)
    viscosity = validation.positive("shear_viscosity", shear_viscosity)
    if not schmidt_number > 0.0:
        raise ValueError(f"`schmidt_number` must be > 0, got {schmidt_number}")
    if reference_box is None:
        if dimension == 2:
            raise ValueError(
                "`reference_box` must be given in 2D, where self-diffusion grows with the box "
                "without limit"
            )
        other = 0.0
    else:
        other = _inverse_square_sum(np.array(_box(reference_box, dimension, "reference_box")))
    less = other - _inverse_square_sum(lengths)
    share = (dimension - 1.0) / dimension / (1.0 + 1.0 / schmidt_number)
    return share * energy / viscosity * less


def _mode_sum(s: float, box: Array) -> float:
    """(1/V) sum over k != 0 of exp(-s k^2)."""
    terms = math.fsum(math.log1p(_theta(s, float(edge))) for edge in box)
    return math.expm1(terms) / float(np.prod(box))


def _theta(s: float, edge: float) -> float:
    """Sum over n != 0 of exp(-s (2 pi n/L)^2), by its own series or by Poisson's."""
    x = s * (2.0 * math.pi / edge) ** 2
    if x > math.pi:
        return 2.0 * math.fsum(math.exp(-x * n**2) for n in range(1, 5))
    images = 2.0 * math.fsum(math.exp(-((math.pi * n) ** 2) / x) for n in range(1, 5))
    return math.sqrt(math.pi / x) * (1.0 + images) - 1.0


def _images(s: float, edge: float) -> float:
    """Sum over n != 0 of exp(-(n L)^2/(4 s)), the same function seen in real space."""
    x = s * (2.0 * math.pi / edge) ** 2
    if x > math.pi:
        return math.sqrt(x / math.pi) * (1.0 + _theta(s, edge)) - 1.0
    return 2.0 * math.fsum(math.exp(-((math.pi * n) ** 2) / x) for n in range(1, 5))


def _inverse_square_sum(box: Array) -> float:
    """(1/V) sum over k != 0 of 1/k^2, less its integral; in 2D but for a constant.

    With 1/k^2 as the integral of exp(-s k^2) over s, sum less integral is that of the images for
    small s, and of the modes less (4 pi s)^(-D/2) for large s.
    """
    from scipy import integrate

    dimension, volume = box.size, float(np.prod(box))
    split = float(box.max()) ** 2 / (4.0 * math.pi)
    slowest = (float(box.max()) / (2.0 * math.pi)) ** 2  # 1/k^2

    def near(s: float) -> float:
        terms = math.fsum(math.log1p(_images(s, float(edge))) for edge in box)
        return math.expm1(terms) / float((4.0 * math.pi * s) ** (0.5 * dimension))

    def far(u: float) -> float:
        return slowest * _mode_sum(split + u * slowest, box)

    first, _ = integrate.quad(near, 0.0, split, epsabs=0.0, epsrel=1e-11, limit=200)
    second, _ = integrate.quad(far, 0.0, 45.0, epsabs=0.0, epsrel=1e-11, limit=200)
    if dimension == 3:
        free = -2.0 * (4.0 * math.pi) ** -1.5 / math.sqrt(split)
    else:
        free = math.log(split) / (4.0 * math.pi)
    return float(first + second - split / volume + free)


def _sound_modes(t: Array, fluid: HydrodynamicTheory, spread: float, box: Array) -> Array:
    """(1/V) sum over k != 0 of the longitudinal current's decay times exp(-D_s k^2 t)."""
    slowest = float(t.min())
    limit = math.sqrt(36.0 / ((fluid.sound_damping + spread) * slowest))
    reach = [int(limit * edge / (2.0 * math.pi)) + 1 for edge in box]
    if math.prod(2 * n + 1 for n in reach) > _MOST_VECTORS:
        raise ValueError(
            f"`time` must be later for the longitudinal modes: at {slowest:.6g} more than "
            f"{_MOST_VECTORS} wave vectors count"
        )
    squared = np.zeros(1)
    for n, edge in zip(reach, box, strict=True):
        axis = (2.0 * math.pi / edge * np.arange(-n, n + 1)) ** 2
        squared = np.add.outer(squared, axis).ravel()
    squared = squared[(squared > 0.0) & (squared <= limit**2)]
    if not squared.size:
        return np.zeros_like(t)
    values, counts = np.unique(np.round(squared / squared.min(), 9), return_counts=True)
    total = np.zeros_like(t)
    for square, count in zip(values * squared.min(), counts, strict=True):
        k = math.sqrt(square)
        total = total + count * fluid.longitudinal(k, t) * np.exp(-spread * square * t)
    return np.asarray(total / float(np.prod(box)))


def _box(box: Sequence[float], dimension: int, name: str = "box") -> tuple[float, ...]:
    lengths = validation.vector(name, box, length=dimension)
    for edge in lengths:
        validation.positive(name, edge)
    return tuple(lengths)
