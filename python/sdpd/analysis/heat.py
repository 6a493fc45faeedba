r"""Thermal conductivity from the flux of heat at equilibrium: Einstein-Helfand and Green-Kubo.

The flux is the mean over each sampling interval of everything that carries energy,
q = (1/V) [sum_i e_i v_i + sum_{i<j} r_ij de_ij/dt], random heat included, in a fluid at rest
(:class:`sdpd.HeatCurrent`).

Helfand, Phys. Rev. 119, 1 (1960); Allen and Tildesley, *Computer Simulation of Liquids*, 2nd ed.,
2017, sec. 2.7; Ripoll, Español and Ernst, Int. J. Mod. Phys. C 9, 1329 (1998) (particles with
internal energies).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .arguments import Array, positive, real_array
from .correlation import Correlation, msd
from .correlation import autocorrelation as correlated
from .estimate import Estimate
from .green_kubo import green_kubo, running_sum
from .slope import fitted_slope

__all__ = [
    "einstein_conductivity",
    "green_kubo_conductivity",
    "heat_autocorrelation",
    "heat_increments",
    "running_conductivity",
]


def heat_increments(
    flux: ArrayLike, dt: float, *, volume: float, max_lag: int, n_blocks: int = 32
) -> Correlation:
    r"""Mean square increments of the Helfand moment, the time integral of the current of heat.

    Parameters
    ----------
    flux : ndarray of float, shape (T, D)
        Mean flux over T consecutive intervals [energy/(length^(D-1) time)]:
        ``sdpd.HeatCurrent.total`` or one of its parts.
    dt : float
        Length of an interval [time], > 0.
    volume : float
        Volume of the box (area in 2D) [length^D], > 0.
    max_lag : int
        Largest lag in intervals, ``1 <= max_lag < (T + 1) // n_blocks``.
    n_blocks : int
        Blocks of time behind the standard error, >= 2.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [(energy length)^2], mean over the axes.

    Raises
    ------
    ValueError
        If `flux` is not (T, D) or not finite, or a parameter is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import analysis
    >>> flux = np.random.default_rng(1).normal(size=(4000, 3))  # white: kappa = V dt/(2 kB T^2)
    >>> moment = analysis.heat_increments(flux, 0.1, volume=20.0, max_lag=40)
    >>> kappa = analysis.einstein_conductivity(
    ...     moment, volume=20.0, temperature=1.0, boltzmann_constant=1.0, window=(0.0, 4.0))
    >>> kappa.agrees(1.0)
    True
    """
    columns = _columns(flux)
    scale = positive("volume", volume) * positive("dt", dt)
    moment = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    return msd(moment[..., None] * scale, dt, max_lag=max_lag, n_blocks=n_blocks)


def einstein_conductivity(
    increments: Correlation,
    *,
    volume: float,
    temperature: float,
    boltzmann_constant: float,
    window: tuple[float, float],
    weights: str = "brownian",
) -> Estimate:
    r"""Conductivity from the growth of the Helfand moment.

    Parameters
    ----------
    increments : Correlation
        From :func:`heat_increments` or ``sdpd.HeatCurrentCorrelator`` [(energy length)^2].
    volume : float
        Volume of the box (area in 2D) [length^D], > 0.
    temperature : float
        [temperature], > 0.
    boltzmann_constant : float
        [energy/temperature], > 0.
    window : tuple of float
        (start, stop) of the lags fitted [time]. Beyond the memory of the flux the slope is the
        conductivity; at the first lags it is the instantaneous (delta-correlated) part alone.
    weights : {"brownian", "generalized", "uniform"}
        As in :func:`sdpd.analysis.einstein_diffusion`.

    Returns
    -------
    Estimate
        kappa [energy/(time temperature length^(D-2))]. Of a part of the flux it is not that part's
        share: cross correlations of the parts count towards the whole only.

    Raises
    ------
    ValueError
        If a parameter is out of range or the window holds fewer than two lags.

    Notes
    -----
    .. math::
        \kappa = \lim_{t\to\infty}\frac{1}{2 V k_BT^2}\frac{d}{dt}\langle\Delta G_a^2(t)\rangle

    Temperature fluctuates in a box of constant energy, but the fluid's kappa is that of the mean
    temperature.

    References
    ----------
    .. [1] Helfand, Phys. Rev. 119, 1 (1960).
    """
    factor = 0.5 * _factor(volume, temperature, boltzmann_constant) / float(volume) ** 2
    return fitted_slope(increments, window=window, weights=weights, factor=factor)


def heat_autocorrelation(
    flux: ArrayLike, dt: float, *, max_lag: int, n_blocks: int = 32
) -> Correlation:
    r"""Autocorrelation of the flux of heat, mean over the axes.

    Parameters
    ----------
    flux, dt, n_blocks
        As in :func:`heat_increments`.
    max_lag : int
        Largest lag in intervals, ``1 <= max_lag < T // n_blocks``.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [flux^2]. The value at lag 0 holds the
        delta-correlated part over `dt`.

    Raises
    ------
    ValueError
        If `flux` is not (T, D) or not finite, or a parameter is out of range.
    """
    return correlated(_columns(flux), dt, max_lag=max_lag, n_blocks=n_blocks)


def green_kubo_conductivity(
    autocorrelation: Correlation,
    *,
    volume: float,
    temperature: float,
    boltzmann_constant: float,
    cutoff: float | None = None,
) -> Estimate:
    r"""Conductivity from the integral of the flux's autocorrelation, delta part included.

    Parameters
    ----------
    autocorrelation : Correlation
        From :func:`heat_autocorrelation` or ``sdpd.HeatCurrentCorrelator``, of *interval means*, at
        equally spaced lags from 0 [flux^2].
    volume, temperature, boltzmann_constant
        As in :func:`einstein_conductivity`.
    cutoff : float, optional
        Last lag of the sum [time]; the last lag at hand by default.

    Returns
    -------
    Estimate
        kappa [energy/(time temperature length^(D-2))]; ``window`` is (0, cutoff).

    Raises
    ------
    ValueError
        If a parameter is out of range, or the lags are not equally spaced from 0.

    Notes
    -----
    .. math:: \kappa = \frac{V\,\Delta t}{k_BT^2}\left(\tfrac12 C_0 + C_1 + \dots + C_n\right)

    It is the slope of the Helfand moment between the lags n and n + 1, not a quadrature.
    """
    factor = _factor(volume, temperature, boltzmann_constant)
    return green_kubo(autocorrelation, factor=factor, cutoff=cutoff)


def running_conductivity(
    autocorrelation: Correlation, *, volume: float, temperature: float, boltzmann_constant: float
) -> Correlation:
    """Green-Kubo conductivity against its cut-off, with its standard error.

    Parameters
    ----------
    autocorrelation, volume, temperature, boltzmann_constant
        As in :func:`green_kubo_conductivity`.

    Returns
    -------
    Correlation
        ``lag`` is the cut-off [time], ``mean`` the conductivity
        [energy/(time temperature length^(D-2))].

    Raises
    ------
    ValueError
        If a parameter is out of range, or the lags are not equally spaced from 0.
    """
    factor = _factor(volume, temperature, boltzmann_constant)
    return running_sum(autocorrelation, factor=factor)


def _factor(volume: float, temperature: float, boltzmann_constant: float) -> float:
    """V/(kB T^2)."""
    kt = positive("boltzmann_constant", boltzmann_constant) * positive("temperature", temperature)
    return positive("volume", volume) / kt / float(temperature)


def _columns(flux: ArrayLike) -> Array:
    columns = real_array("flux", flux, 2)
    if columns.shape[1] not in (2, 3):
        raise ValueError(f"`flux` must have shape (T, D) with D = 2 or 3, got {columns.shape}")
    return np.asarray(columns, dtype=np.float64)
