r"""Velocity autocorrelation of a particle from the plane waves of its box.

A particle that starts with some momentum shares it with the fluid around it, wave by wave:

    C(t) = kB T/(D rho V) sum_k exp(-D_s k^2 t) [(D - 1) C_T(k, t) + C_L(k, t)],

C_T = exp(-nu_k k^2 t) and C_L the normalised current correlations, nu_k the viscosity that a wave
of that length feels. Long waves give the tail t^(-D/2) of `vacf_tail`; at finite k friction is
weaker, which raises C while the momentum has spread over a few supports only.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

from .friction import FrictionTheory
from .hydrodynamics import HydrodynamicTheory, damped_wave

__all__ = ["vacf_modes"]

Array = NDArray[np.float64]

NEGLIGIBLE = 40.0  # exponent beyond which a wave has decayed
MOST_MODES = 2e7


def vacf_modes(
    time: ArrayLike,
    *,
    fluid: HydrodynamicTheory,
    friction: FrictionTheory,
    thermal_energy: float,
    self_diffusion: float,
    box: Sequence[float],
    at_rest: bool = True,
) -> Array:
    """Velocity autocorrelation by all waves of a periodic box.

    Parameters
    ----------
    time : array_like, any shape
        t [time], > 0.
    fluid : HydrodynamicTheory
        Viscosities the fluid of particles *delivers* to long waves, and its sound speed.
    friction : FrictionTheory
        How friction falls with k: both viscosities are multiplied by its `viscosity_ratio`.
    thermal_energy : float
        kB T [energy], > 0.
    self_diffusion : float
        D_s [length^2/time], > 0.
    box : sequence of float, length D
        Edge lengths [length].
    at_rest : bool
        The total momentum is zero, so that the wave k = 0 is missing. Without that it stands for
        kB T/(rho V), and the box shows only in its images.

    Returns
    -------
    ndarray of float64, shape of `time`
        <v_i(0).v_i(t)>/D, per component [length^2/time^2].

    Raises
    ------
    ValueError
        If a parameter is out of range, or times so short that millions of waves would count.

    Notes
    -----
    Mean field, for times beyond the friction time: waves decay by themselves, and the particle
    diffuses independently of them.

    Examples
    --------
    >>> from sdpd import theory
    >>> same = {"dimension": 3, "density": 1.0, "shear_viscosity": 2.0}
    >>> fluid = theory.HydrodynamicTheory(**same, sound_speed=10.0)
    >>> friction = theory.FrictionTheory(**same, kernel="lucy", support=2.2)
    >>> found = theory.vacf_modes([1.0, 2.0], fluid=fluid, friction=friction, thermal_energy=1.0,
    ...                           self_diffusion=0.1, box=(12.0,) * 3)
    >>> bool(found[0] > found[1] > 0.0)
    True
    """
    t = np.asarray(time, dtype=np.float64)
    if not np.all(np.isfinite(t) & (t > 0.0)):
        raise ValueError("`time` must be finite and > 0")
    energy = validation.positive("thermal_energy", thermal_energy)
    spread = validation.positive("self_diffusion", self_diffusion)
    dimension = fluid.dimension
    lengths = np.array(validation.vector("box", box, length=dimension))
    if not (lengths > 0.0).all():
        raise ValueError(f"`box` must be > 0, got {lengths.tolist()}")
    squared, count = _shells(lengths, np.sqrt(NEGLIGIBLE / (spread * float(t.min()))))
    k = np.sqrt(squared)
    ratio = friction.viscosity_ratio(k)
    total = np.zeros(t.shape)
    for index in np.ndindex(t.shape):
        now = float(t[index])
        side = np.exp(-fluid.kinematic_viscosity * ratio * squared * now)
        along = _longitudinal(k, now, fluid, ratio)
        left = count * np.exp(-spread * squared * now)
        total[index] = left @ ((dimension - 1.0) * side + along)
    if not at_rest:
        total += dimension
    return np.asarray(energy / fluid.density / float(np.prod(lengths)) / dimension * total)


def _shells(box: Array, most: float) -> tuple[Array, Array]:
    """Squares of the wave numbers up to a limit, and how many waves have each."""
    reach = [int(most * edge / (2.0 * np.pi)) for edge in box]
    if float(np.prod([2.0 * n + 1.0 for n in reach])) > MOST_MODES:
        raise ValueError("`time` must be longer: too many waves have not decayed")
    axes = [
        (2.0 * np.pi / edge * np.arange(-n, n + 1)) ** 2 for edge, n in zip(box, reach, strict=True)
    ]
    squared = axes[0]
    for axis in axes[1:]:
        squared = np.add.outer(squared, axis)
    flat = squared.ravel()
    flat = flat[(flat > 0.0) & (flat <= most**2)]
    unit = float(flat.min())
    value, count = np.unique(np.round(flat / unit, 9), return_counts=True)
    return value * unit, count.astype(np.float64)


def _longitudinal(k: Array, time: float, fluid: HydrodynamicTheory, ratio: Array) -> Array:
    """C_L of each wave number."""
    result = np.zeros(k.size)
    now = np.array(time)
    for index, (number, share) in enumerate(zip(k, ratio, strict=True)):
        damping = fluid.sound_damping * float(share) * float(number) ** 2
        if damping * time > NEGLIGIBLE and damping < fluid.sound_speed * number:
            continue
        even, odd, rate = damped_wave(now, fluid.sound_speed * float(number), damping)
        result[index] = float(even - rate * odd)
    return result
