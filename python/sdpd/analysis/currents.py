r"""Hydrodynamic correlation functions in Fourier space and fits of nu, c_T and Gamma_T.

With rho_k = sum exp(i k.r) and j_k = sum v exp(i k.r), per particle: the density correlation starts
at S(k), each current correlation at kB T/m. Bian et al., Phys. Rev. E (2015) eqs. 21-23; Palmer,
Phys. Rev. E 49, 359 (1994) for the viscosity from transverse currents.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, box_lengths, choice, positive, trajectory
from .correlation import Correlation, assemble
from .estimate import Estimate
from .fourier import fourier_components, integer_vectors
from .lagged_products import block_plan, product_sums

__all__ = [
    "CurrentCorrelations",
    "SoundFit",
    "current_correlations",
    "fit_sound",
    "fit_transverse",
]


@dataclass(frozen=True)
class CurrentCorrelations:
    """Correlation functions of the wave vectors of one length.

    Attributes
    ----------
    wave_number : float
        |k| [1/length].
    wave_vectors : ndarray of int, shape (K, D)
        The integer wave vectors averaged.
    density : Correlation
        ``<rho_k(0)* rho_k(t)>/N`` [1], real part.
    longitudinal, transverse : Correlation
        ``<j_k(0)* j_k(t)>/N`` along k and per component across k [length^2/time^2], real part.
    cross : Correlation
        ``Im <rho_k(0)* j_k(t)>/N`` with the longitudinal current [length/time].
    reversed_cross : Correlation
        ``Im <j_k(0)* rho_k(t)>/N``; in equilibrium the same function.
    energy : Correlation or None
        ``<e_k(0)* e_k(t)>/N`` of e_k = sum (e - <e>) exp(i k.r), e = C T + m v^2/2 the thermal and
        kinetic energy of a particle [energy^2]; None without an energy, like the next two.
    density_energy : Correlation or None
        ``Re <rho_k(0)* e_k(t)>/N`` [energy], mean over both orders.
    energy_current : Correlation or None
        ``Im <j_k(0)* e_k(t)>/N`` with the longitudinal current [energy length/time], likewise.
    """

    wave_number: float
    wave_vectors: NDArray[np.int64]
    density: Correlation
    longitudinal: Correlation
    transverse: Correlation
    cross: Correlation
    reversed_cross: Correlation
    energy: Correlation | None = None
    density_energy: Correlation | None = None
    energy_current: Correlation | None = None


@dataclass(frozen=True)
class SoundFit:
    """Sound speed and damping fitted to one wave number.

    Attributes
    ----------
    sound_speed : Estimate
        c_T, isothermal [length/time].
    damping : Estimate
        Gamma_T [length^2/time].
    """

    sound_speed: Estimate
    damping: Estimate


def current_correlations(
    position: ArrayLike,
    velocity: ArrayLike,
    box: ArrayLike,
    dt: float,
    *,
    wave_vectors: ArrayLike,
    max_lag: int,
    n_blocks: int = 32,
) -> list[CurrentCorrelations]:
    """Density and current correlation functions at given integer wave vectors.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D)
        Positions at equal intervals, wrapped or not [length].
    velocity : ndarray of float, shape (T, N, D)
        Velocities at the same times [length/time].
    box : array_like, shape (D,)
        Edge lengths of the periodic box [length].
    dt : float
        Time between rows [time], > 0.
    wave_vectors : array_like of int, shape (K, D)
        n of k = 2 pi n / L; those of equal |k| are averaged. Give k or -k, not both.
    max_lag, n_blocks
        As in :func:`sdpd.analysis.vacf`, blocks of time.

    Returns
    -------
    list of CurrentCorrelations
        One for each |k|, ascending.

    Raises
    ------
    TypeError
        If `wave_vectors` are not integers.
    ValueError
        If shapes, ranges or values are not acceptable.
    """
    r = trajectory("position", position, frames=2)
    v = trajectory("velocity", velocity, frames=2)
    if v.shape != r.shape:
        raise ValueError(f"`velocity` must have the shape of `position`, {r.shape}, got {v.shape}")
    positive("dt", dt)
    rows, count, dimension = r.shape
    lengths = box_lengths(box, dimension)
    vectors = integer_vectors(wave_vectors, dimension)
    block_plan((rows, len(vectors)), max_lag, n_blocks, "time")
    density, current = _modes(r, v, lengths, vectors)
    density /= np.sqrt(count)
    current /= np.sqrt(count)
    return list(_by_shell(density, current, vectors, lengths, (dt, max_lag, n_blocks)))


def fit_transverse(
    transverse: Correlation, wave_number: float, *, window: tuple[float, float] | None = None
) -> Estimate:
    r"""Kinematic viscosity from the decay of a transverse current correlation.

    Parameters
    ----------
    transverse : Correlation
        From :func:`current_correlations`.
    wave_number : float
        |k| [1/length], > 0.
    window : tuple of float, optional
        (start, stop) of the lags fitted [time]; by default from 0 to where it falls below 1/e.

    Returns
    -------
    Estimate
        nu(k) [length^2/time], at finite k h smaller than nu(0):
        :meth:`sdpd.theory.FrictionTheory.viscosity_ratio` has the factor.

    Raises
    ------
    ValueError
        If the window holds fewer than 3 lags, or the lags do not begin at 0.

    Notes
    -----
    Least squares of ``exp(-nu k^2 t)`` on C(t)/C(0); the error is the jackknife's.
    """
    k = positive("wave_number", wave_number)
    inside = _fit_lags(transverse, window, float(np.exp(-1.0)))
    t = transverse.lag[inside]

    def rate(mean: Array) -> float:
        from scipy import optimize

        y = mean[inside] / mean[0]
        positive_part = y > 0.05
        guess = float(-np.sum(np.log(y[positive_part]) * t[positive_part]) / np.sum(t**2))
        fit, _ = optimize.curve_fit(
            lambda s, x: np.exp(-x * s), t / t[-1], y, p0=[max(guess * t[-1], 1e-3)]
        )
        return float(fit[0]) / float(t[-1]) / k**2

    return transverse.derive(rate, window=(float(t[0]), float(t[-1])))


def fit_sound(
    correlation: Correlation,
    wave_number: float,
    *,
    kind: str = "density",
    window: tuple[float, float] | None = None,
    guess: tuple[float, float] | None = None,
) -> SoundFit:
    r"""Sound speed and damping from a density or longitudinal current correlation.

    Parameters
    ----------
    correlation : Correlation
        ``density`` or ``longitudinal`` of :func:`current_correlations`.
    wave_number : float
        |k| [1/length], > 0.
    kind : {"density", "longitudinal"}
        Which of the two it is.
    window : tuple of float, optional
        (start, stop) of the lags fitted [time]; all of them by default.
    guess : tuple of float, optional
        Starting (c_T, Gamma_T) [length/time, length^2/time]; from the first zero by default.

    Returns
    -------
    SoundFit
        Of the linearised isothermal theory
        (:class:`sdpd.theory.HydrodynamicTheory`), errors by the jackknife.

    Raises
    ------
    ValueError
        If the window holds fewer than 4 lags, the lags do not begin at 0, or no guess is given and
        the function has no zero.
    """
    from sdpd.theory.hydrodynamics import damped_wave

    choice("kind", kind, ("density", "longitudinal"))
    k = positive("wave_number", wave_number)
    whole = (0.0, float(correlation.lag[-1])) if window is None else window
    inside = _fit_lags(correlation, whole, 0.0)
    t = correlation.lag[inside]
    if t.size < 4:
        raise ValueError(f"`window` must hold at least 4 lags, got {t.size}")
    if guess is None:
        frequency, damping = _wave_guess(correlation, kind)
    else:
        frequency, damping = (positive("guess", guess[0]) * k, positive("guess", guess[1]) * k**2)
    sign = 1.0 if kind == "density" else -1.0

    def model(s: Array, log_frequency: float, log_damping: float) -> Array:
        even, odd, rate = damped_wave(s, float(np.exp(log_frequency)), float(np.exp(log_damping)))
        return even + sign * rate * odd

    start = np.log([frequency, damping])

    def fitted(mean: Array) -> Array:
        from scipy import optimize

        fit, _ = optimize.curve_fit(model, t, mean[inside] / mean[0], p0=start, maxfev=5000)
        return np.asarray(np.exp(fit))

    span = (float(t[0]), float(t[-1]))
    return SoundFit(
        correlation.derive(lambda mean: float(fitted(mean)[0]) / k, window=span),
        correlation.derive(lambda mean: float(fitted(mean)[1]) / k**2, window=span),
    )


def _modes(
    r: NDArray[Any], v: NDArray[Any], box: Array, vectors: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Density (T, K) and current (T, K, D) components with one evaluation of the waves."""
    weights = np.concatenate([np.ones((*v.shape[:2], 1), dtype=v.dtype), v], axis=2)
    both = fourier_components(r, box, vectors, weights)
    return both[..., 0].copy(), both[..., 1:].copy()


def _by_shell(
    density: NDArray[Any],
    current: NDArray[Any],
    vectors: NDArray[Any],
    box: Array,
    settings: tuple[float, int, int],
) -> Iterator[CurrentCorrelations]:
    dt, max_lag, n_blocks = settings
    k = 2.0 * np.pi * vectors / box
    length = np.sqrt(np.sum(k**2, axis=1))
    unit = k / length[:, None]
    forward = np.einsum("tkc,kc->tk", current, unit)
    across = current - forward[..., None] * unit
    for value in np.unique(np.round(length / length.min(), 9)):
        chosen = np.flatnonzero(np.round(length / length.min(), 9) == value)
        plan = block_plan((density.shape[0], chosen.size), max_lag, n_blocks, "time")
        rho, along = density[:, chosen, None], forward[:, chosen, None]
        side = across[:, chosen]
        others = side.shape[2] - 1
        yield CurrentCorrelations(
            float(length[chosen[0]]),
            vectors[chosen],
            assemble(product_sums(rho, rho, plan).real, plan, dt, 1),
            assemble(product_sums(along, along, plan).real, plan, dt, 1),
            assemble(product_sums(side, side, plan).real / others, plan, dt, others),
            assemble(product_sums(rho, along, plan).imag, plan, dt, 1),
            assemble(product_sums(along, rho, plan).imag, plan, dt, 1),
        )


def _fit_lags(
    correlation: Correlation, window: tuple[float, float] | None, floor: float
) -> NDArray[Any]:
    correlation.require_lag_zero()  # the fits are normalised by its value there
    if window is None:
        below = np.flatnonzero(correlation.mean < floor * correlation.mean[0])
        stop = int(below[0]) if below.size else correlation.lag.size - 1
        inside = np.arange(stop + 1)
    else:
        inside = correlation.lags_within(window)
    if inside.size < 3:
        raise ValueError(f"`window` must hold at least 3 lags, got {inside.size}")
    return inside


def _wave_guess(correlation: Correlation, kind: str) -> tuple[float, float]:
    """Frequency and damping from the first zero and the depth of the first minimum."""
    y = correlation.mean / correlation.mean[0]
    crossed = np.flatnonzero(y <= 0.0)
    if not crossed.size:
        raise ValueError(f"`guess` must be given: the {kind} correlation has no zero in its lags")
    zero = float(correlation.lag[crossed[0]])
    early = correlation.lag < 3.0 * zero  # whatever the spacing of the lags
    lowest = int(np.argmin(y[early]))
    depth = min(max(-float(y[lowest]), 1e-3), 0.999)
    frequency = 0.5 * np.pi / zero
    damping = -np.log(depth) / max(float(correlation.lag[lowest]), zero)
    return float(np.hypot(frequency, damping)), float(damping)
