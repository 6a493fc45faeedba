r"""Viscosities and pressure from the stress: Einstein-Helfand, Green-Kubo, virial.

The pressure tensor is the mean over each sampling interval of everything that carries momentum,
P = (1/V) [sum_i m v_i v_i + sum_{i<j} r_ij f_ij], random forces included (:class:`sdpd.Stress`).
Element [a, b] is the flux of momentum b through a plane normal to a. It is *not* symmetrised: the
friction of SDPD is not central, so P_xy and P_yx differ, and the symmetric part alone would give
a/4 + b/(2 (D + 2)) in place of eta = a/2 + b/(2 (D + 2)). As random forces are delta-correlated, a
stress sampled at instants would need a term dt^(-1/2); the mean over an interval does not.

For the same reason the trace does not give the bulk viscosity: a stress is known from the motion up
to a tensor without divergence, and the friction across the line of centres puts (a/2) grad v into
it where Navier and Stokes have eta times the symmetric gradient. Fluctuations of tr P/D give
(a + b)/(2 D) = zeta + a (D - 1)/(2 D) for drag and noise. What the motion fixes is the decay of
plane waves: eta from an off-diagonal element, zeta + eta (2 - 2/D) from a diagonal one, and zeta
from their difference.

Helfand, Phys. Rev. 119, 1 (1960); Allen and Tildesley, *Computer Simulation of Liquids*, 2nd ed.,
2017, sec. 2.7; Español, Phys. Rev. E 52, 1734 (1995) (the delta part); Yang (2013) eqs. 2.77-2.79,
whose symmetric P_xy does not hold here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, choice, integer, positive, real_array
from .correlation import Correlation, autocorrelation, msd
from .estimate import Estimate
from .green_kubo import green_kubo, running_sum
from .slope import fitted_slope
from .statistics import block_average

__all__ = [
    "VirialPressure",
    "bulk_component",
    "einstein_viscosity",
    "green_kubo_viscosity",
    "helfand_increments",
    "running_viscosity",
    "stress_autocorrelation",
    "virial_pressure",
]

_COMPONENTS = ("shear", "bulk", "longitudinal", "trace")
_PARTS = ("kinetic", "conservative", "dissipative", "random")


@dataclass(frozen=True)
class VirialPressure:
    """Mean pressure by parts; compare with :meth:`sdpd.theory.DensityTheory.virial_pressure`.

    Attributes
    ----------
    total : Estimate
        Of the sum of the parts, whose errors are correlated [pressure].
    kinetic : Estimate
        n kB T, less kB T/V where the total momentum is zero [pressure]. In the loop it is that of
        the velocities that drift, half a kick after the sampled ones: n dt^2 <f^2>/(4 m) higher,
        with f one component of the conservative force.
    conservative : Estimate
        Virial of the conservative forces [pressure].
    dissipative, random : Estimate
        Of drag and noise, each zero at equilibrium [pressure].
    """

    total: Estimate
    kinetic: Estimate
    conservative: Estimate
    dissipative: Estimate
    random: Estimate


def helfand_increments(
    stress: ArrayLike,
    dt: float,
    *,
    volume: float,
    component: str = "shear",
    max_lag: int,
    n_blocks: int = 32,
) -> Correlation:
    r"""Mean square increments of the Helfand moment, the time integral of the stress.

    Parameters
    ----------
    stress : ndarray of float, shape (T, D, D)
        Mean pressure tensor over T consecutive intervals, not symmetrised [pressure]:
        ``sdpd.Stress.total`` or one of its parts.
    dt : float
        Length of an interval [time], > 0.
    volume : float
        Volume of the box (area in 2D) [length^D], > 0.
    component : {"shear", "bulk", "longitudinal", "trace"}
        All D (D - 1) off-diagonal elements; their combination with the diagonal ones that belongs
        to the bulk viscosity (:func:`bulk_component`); the D diagonal elements less their means;
        tr P/D less its mean. Elements are averaged.
    max_lag : int
        Largest lag in intervals, ``1 <= max_lag < (T + 1) // n_blocks``.
    n_blocks : int
        Blocks of time behind the standard error, >= 2.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [(energy time)^2]. That of "bulk" is a
        difference of mean squares and may be negative.

    Raises
    ------
    ValueError
        If `stress` is not (T, D, D) or not finite, or a parameter is out of range.

    Notes
    -----
    .. math:: \langle\Delta G^2(t)\rangle,\qquad G(t) = V\int_0^t P_{ab}\,dt'

    An integral is exact whatever the length of the intervals, so this needs no resolved stress.
    Taking the mean of the run off makes the increments too small by 1 - t/T where the stress
    forgets in much less than t; "longitudinal" and "trace" are divided by that.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import analysis
    >>> stress = np.random.default_rng(1).normal(size=(4000, 3, 3))   # white: eta = V dt/(2 kB T)
    >>> moment = analysis.helfand_increments(stress, 0.1, volume=20.0, max_lag=40)
    >>> eta = analysis.einstein_viscosity(
    ...     moment, volume=20.0, thermal_energy=1.0, window=(0.0, 4.0))
    >>> eta.agrees(1.0)
    True
    """
    if component == "bulk":
        whole, side = (
            helfand_increments(
                stress, dt, volume=volume, component=c, max_lag=max_lag, n_blocks=n_blocks
            )
            for c in ("longitudinal", "shear")
        )
        return bulk_component(whole, side, dimension=np.shape(stress)[1])
    columns = _columns(stress, component)
    cell = positive("volume", volume)
    positive("dt", dt)
    moment = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    squares = msd(moment[..., None] * (cell * float(dt)), dt, max_lag=max_lag, n_blocks=n_blocks)
    if component == "shear":
        return squares
    left = 1.0 - squares.lag / (columns.shape[0] * float(dt))
    return squares.scaled(1.0 / left)


def bulk_component(longitudinal: Correlation, shear: Correlation, *, dimension: int) -> Correlation:
    """Combine two components into the one whose slope or integral is the bulk viscosity.

    Parameters
    ----------
    longitudinal, shear : Correlation
        Increments or autocorrelations of these components of *one* run, with the same lags and
        blocks: their errors are correlated, and the blocks know.
    dimension : int
        D, 2 or 3.

    Returns
    -------
    Correlation
        ``longitudinal - (2 - 2/D) shear``, in their unit.

    Raises
    ------
    ValueError
        If lags or blocks differ, or `dimension` is not 2 or 3.
    """
    integer("dimension", dimension, low=2, high=3)
    same = longitudinal.blocks.shape == shear.blocks.shape and np.allclose(
        longitudinal.lag, shear.lag, rtol=1e-9, atol=0.0
    )
    if not same:
        raise ValueError("`shear` must have the lags and blocks of `longitudinal`")
    if not np.array_equal(longitudinal.block_counts, shear.block_counts):
        # One of them holds pseudo-values, which weigh the same: make the other's do so too.
        longitudinal, shear = (c.transformed(np.asarray) for c in (longitudinal, shear))
    blocks = longitudinal.blocks - (2.0 - 2.0 / dimension) * shear.blocks
    return replace(longitudinal, blocks=blocks)


def einstein_viscosity(
    increments: Correlation,
    *,
    volume: float,
    thermal_energy: float,
    window: tuple[float, float],
    weights: str = "brownian",
) -> Estimate:
    r"""Viscosity from the growth of the Helfand moment.

    Parameters
    ----------
    increments : Correlation
        From :func:`helfand_increments` or ``sdpd.StressCorrelator`` [(energy time)^2].
    volume : float
        Volume of the box (area in 2D) [length^D], > 0.
    thermal_energy : float
        kB T [energy], > 0.
    window : tuple of float
        (start, stop) of the lags fitted [time]. Beyond the memory of the stress the slope is the
        viscosity; at the first lags it is the instantaneous (delta-correlated) part alone.
    weights : {"brownian", "generalized", "uniform"}
        As in :func:`sdpd.analysis.einstein_diffusion`.

    Returns
    -------
    Estimate
        [pressure x time], of the component of `increments`: the shear viscosity eta, the bulk
        viscosity zeta, the longitudinal zeta + eta (2 - 2/D), or for the trace zeta plus what
        friction across the line of centres adds, a (D - 1)/(2 D) (0 in the central form). Of a part
        of the stress it is not that part's share: cross correlations of the parts count towards
        the whole only.

    Raises
    ------
    ValueError
        If a parameter is out of range or the window holds fewer than two lags.

    Notes
    -----
    .. math:: \eta = \lim_{t\to\infty}\frac{1}{2 V k_BT}\frac{d}{dt}\langle\Delta G^2(t)\rangle

    Bulk and longitudinal values are those of an isothermal fluid, which conserves mass and momentum
    only. Where energy is conserved as well, the pressure that goes with its fluctuations must be
    taken off first (Hansen and McDonald, 4th ed., sec. 8.5).

    References
    ----------
    .. [1] Helfand, Phys. Rev. 119, 1 (1960).
    """
    whole = 2.0 * positive("volume", volume) * positive("thermal_energy", thermal_energy)
    return fitted_slope(increments, window=window, weights=weights, factor=1.0 / whole)


def stress_autocorrelation(
    stress: ArrayLike,
    dt: float,
    *,
    component: str = "shear",
    max_lag: int,
    n_blocks: int = 32,
) -> Correlation:
    r"""Autocorrelation of the stress, averaged over its equivalent elements.

    Parameters
    ----------
    stress, dt, component, n_blocks
        As in :func:`helfand_increments`.
    max_lag : int
        Largest lag in intervals, ``1 <= max_lag < T // n_blocks``.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [pressure^2]. The value at lag 0 holds the
        delta-correlated part over `dt`.

    Raises
    ------
    ValueError
        If `stress` is not (T, D, D) or not finite, or a parameter is out of range.

    Notes
    -----
    Taking the mean of the run off makes every value too small by the variance of that mean, which
    follows from the function itself and is put back for "longitudinal" and "trace".
    """
    if component == "bulk":
        whole, side = (
            stress_autocorrelation(stress, dt, component=c, max_lag=max_lag, n_blocks=n_blocks)
            for c in ("longitudinal", "shear")
        )
        return bulk_component(whole, side, dimension=np.shape(stress)[1])
    columns = _columns(stress, component)
    raw = autocorrelation(columns, dt, max_lag=max_lag, n_blocks=n_blocks)
    if component == "shear":
        return raw
    return put_back_mean(raw, columns.shape[0])


def put_back_mean(autocorrelation: Correlation, rows: int) -> Correlation:
    """Undo what taking the mean of the run off did to an autocorrelation at lags 0, 1, 2, ...

    Parameters
    ----------
    autocorrelation : Correlation
        About the mean of the same `rows` samples, at equally spaced lags that begin at 0 and
        reach beyond the memory.
    rows : int
        Samples behind the mean, more than twice the lags.
    """
    rest = rows - (2.0 * autocorrelation.lag.size - 1.0)

    def restored(values: Array) -> Array:
        both_sides = 2.0 * values.sum(axis=-1, keepdims=True) - values[..., :1]
        return np.asarray(values + both_sides / rest)

    return autocorrelation.transformed(restored)


def green_kubo_viscosity(
    autocorrelation: Correlation,
    *,
    volume: float,
    thermal_energy: float,
    cutoff: float | None = None,
) -> Estimate:
    r"""Viscosity from the integral of the stress autocorrelation, delta part included.

    Parameters
    ----------
    autocorrelation : Correlation
        From :func:`stress_autocorrelation` or ``sdpd.StressCorrelator``, of *interval means*, at
        equally spaced lags from 0 [pressure^2].
    volume : float
        Volume of the box (area in 2D) [length^D], > 0.
    thermal_energy : float
        kB T [energy], > 0.
    cutoff : float, optional
        Last lag of the sum [time]; the last lag at hand by default.

    Returns
    -------
    Estimate
        [pressure x time], as in :func:`einstein_viscosity`; ``window`` is (0, cutoff).

    Raises
    ------
    ValueError
        If a parameter is out of range, or the lags are not equally spaced from 0.

    Notes
    -----
    .. math:: \eta = \frac{V\,\Delta t}{k_BT}\left(\tfrac12 C_0 + C_1 + \dots + C_n\right)

    For interval means this is no quadrature but the slope of the Helfand moment between the lags
    n and n + 1: exact for any interval, with a delta-correlated stress in C_0 alone.

    References
    ----------
    .. [1] Español, Phys. Rev. E 52, 1734 (1995).
    """
    factor = positive("volume", volume) / positive("thermal_energy", thermal_energy)
    return green_kubo(autocorrelation, factor=factor, cutoff=cutoff)


def running_viscosity(
    autocorrelation: Correlation, *, volume: float, thermal_energy: float
) -> Correlation:
    """Green-Kubo viscosity against its cut-off, with its standard error.

    Parameters
    ----------
    autocorrelation, volume, thermal_energy
        As in :func:`green_kubo_viscosity`.

    Returns
    -------
    Correlation
        ``lag`` is the cut-off [time], ``mean`` the viscosity [pressure x time].

    Raises
    ------
    ValueError
        If a parameter is out of range, or the lags are not equally spaced from 0.
    """
    factor = positive("volume", volume) / positive("thermal_energy", thermal_energy)
    return running_sum(autocorrelation, factor=factor)


def virial_pressure(
    stress: NDArray[np.void] | Mapping[str, ArrayLike], *, n_blocks: int = 32
) -> VirialPressure:
    r"""Mean pressure from the stress by parts, tr P/D, with blocked standard errors.

    Parameters
    ----------
    stress : structured array or mapping
        ``sdpd.Stress.data``, or its fields ``kinetic``, ``conservative``, ``dissipative`` and
        ``random``, each (T, D, D) [pressure].
    n_blocks : int
        Blocks of time behind the standard errors, ``2 <= n_blocks <= T``.

    Returns
    -------
    VirialPressure

    Raises
    ------
    ValueError
        If a part is missing, not (T, D, D) or not finite, or `n_blocks` is out of range.

    Notes
    -----
    .. math:: P = n k_BT + \frac{1}{D V}\Big\langle\sum_{i<j}\mathbf r_{ij}\cdot
              \mathbf f_{ij}\Big\rangle

    by pairs and the minimum image. It is not P(rho) of the equation of state: beside the kinetic
    part there is what the density fluctuations add
    (:meth:`sdpd.theory.DensityTheory.virial_pressure`).
    """
    series = {}
    for name in _PARTS:
        try:
            part = stress[name]
        except (KeyError, ValueError, IndexError, TypeError):
            raise ValueError(f"`stress` must have the parts {', '.join(_PARTS)}") from None
        tensor = _tensor(f"stress[{name!r}]", part)
        series[name] = np.trace(tensor, axis1=1, axis2=2) / tensor.shape[1]
    lengths = {len(values) for values in series.values()}
    if len(lengths) > 1:
        raise ValueError(f"`stress` must have parts of equal length, got {sorted(lengths)}")
    total = np.sum(list(series.values()), axis=0)
    integer("n_blocks", n_blocks, low=2, high=len(total))
    parts = {name: block_average(values, n_blocks=n_blocks) for name, values in series.items()}
    return VirialPressure(block_average(total, n_blocks=n_blocks), **parts)


def _tensor(name: str, value: ArrayLike) -> NDArray[Any]:
    tensor = real_array(name, value, 3)
    if tensor.shape[1] != tensor.shape[2] or tensor.shape[1] not in (2, 3):
        raise ValueError(f"`{name}` must have shape (T, D, D) with D = 2 or 3, got {tensor.shape}")
    return tensor


def _columns(stress: ArrayLike, component: str) -> Array:
    """Equivalent elements of the stress as columns, (T, C); means taken off the diagonal ones."""
    choice("component", component, _COMPONENTS)
    tensor = _tensor("stress", stress).astype(np.float64, copy=False)
    dimension = tensor.shape[1]
    diagonal = np.diagonal(tensor, axis1=1, axis2=2)
    if component == "shear":
        return tensor[:, ~np.eye(dimension, dtype=bool)]
    columns = diagonal if component == "longitudinal" else diagonal.mean(axis=1, keepdims=True)
    return np.asarray(columns - columns.mean(axis=0))
