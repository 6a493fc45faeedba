r"""Self-diffusion: Einstein, Green-Kubo, short-time slope of the VACF, local by bins.

Yang (2013) eqs. 2.69-2.76 with the sample spacing in place of the printed last factor t of 2.76;
standard errors come from the blocks of the correlation functions by the jackknife.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arguments import (
    Array,
    box_lengths,
    edges,
    integer,
    positive,
    trajectory,
)
from .blocked import Profile
from .correlation import Correlation
from .estimate import Estimate
from .slope import fitted_slope

__all__ = [
    "ShortTimeDiffusion",
    "einstein_diffusion",
    "green_kubo_diffusion",
    "local_diffusivity",
    "running_diffusion",
    "short_time_diffusion",
]


@dataclass(frozen=True)
class ShortTimeDiffusion:
    """Initial decay of the VACF and the diffusion coefficient it implies.

    Attributes
    ----------
    rate : Estimate
        ``-d ln C / dt`` at lag 0, the friction rate 1/tau [1/time].
    diffusion : Estimate
        ``(kB T / m) / rate`` [length^2/time].
    lag, rate_at_lag, rate_stderr : ndarray, shape (K,)
        ``-ln(C(t)/C(0)) / t`` at the lags extrapolated [time, 1/time, 1/time].
    """

    rate: Estimate
    diffusion: Estimate
    lag: Array
    rate_at_lag: Array
    rate_stderr: Array


def einstein_diffusion(
    msd: Correlation, *, window: tuple[float, float], weights: str = "brownian"
) -> Estimate:
    r"""Self-diffusion coefficient from the slope of the mean square displacement.

    Parameters
    ----------
    msd : Correlation
        From :func:`sdpd.analysis.msd` [length^2].
    window : tuple of float
        (start, stop) of the lags fitted [time]; at least two lags must lie inside. The start
        must be beyond every memory of the fluid, or the slope is not yet the diffusive one.
    weights : {"brownian", "generalized", "uniform"}
        Straight line with intercept, weighted by the variances of the MSD of a Brownian walk
        (default), by their full covariance (sharpest, and the most sensitive to a start that is
        too early), or not at all.

    Returns
    -------
    Estimate
        ``slope / (2 D)`` [length^2/time]; ``window`` is the interval of lags actually fitted.

    Raises
    ------
    ValueError
        If the window holds fewer than two lags or leaves the range of `msd`.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import analysis
    >>> steps = np.random.default_rng(1).normal(size=(1000, 50, 3))  # D = 1/2 in units of dt
    >>> curve = analysis.msd(np.cumsum(steps, axis=0), 1.0, max_lag=20)
    >>> analysis.einstein_diffusion(curve, window=(5.0, 20.0)).agrees(0.5)
    True

    Notes
    -----
    The slope is linear in the MSD, so the jackknife over blocks is exact: it equals the spread
    of the blocks' own slopes. The covariance of overlapping displacements of a Brownian walk,
    for lags of n <= m rows and many origins, is proportional to
    :math:`(m-n+1)n^2 + n(n-1)(2n-1)/3`.

    References
    ----------
    .. [1] Qian, Sheetz and Elson, Biophys. J. 60, 910 (1991).
    .. [2] Bullerjahn, von Bülow and Hummer, J. Chem. Phys. 153, 024116 (2020).
    """
    return fitted_slope(msd, window=window, weights=weights, factor=0.5 / msd.dimension)


def green_kubo_diffusion(vacf: Correlation, *, cutoff: float | None = None) -> Estimate:
    r"""Self-diffusion coefficient from the integral of the VACF.

    Parameters
    ----------
    vacf : Correlation
        From :func:`sdpd.analysis.vacf`, per component [length^2/time^2].
    cutoff : float, optional
        Last lag of the integral [time]; the last lag of `vacf` by default.

    Returns
    -------
    Estimate
        [length^2/time]; ``window`` is (0, cutoff). What lies beyond the cut-off is left out: in
        D dimensions the hydrodynamic tail t^(-D/2) adds to a 3D result and diverges in 2D.

    Raises
    ------
    ValueError
        If `cutoff` is not within the lags or leaves fewer than 3 of them, or these do not begin
        at 0.

    Notes
    -----
    .. math:: D = \int_0^{t_c} C(t)\,dt, \qquad
              C(t) = \tfrac1D\langle\mathbf v_i(0)\cdot\mathbf v_i(t)\rangle

    by Simpson's rule, also on lags of unequal spacing: the trapezoidal rule is too high by
    (dt/tau)^2/12 for C = exp(-t/tau).
    """
    from scipy import integrate

    vacf.require_lag_zero()
    end = float(vacf.lag[-1]) if cutoff is None else positive("cutoff", cutoff)
    if end > float(vacf.lag[-1]) * (1.0 + 1e-9):
        raise ValueError(f"`cutoff` must be <= the last lag {vacf.lag[-1]:.6g}, got {end:.6g}")
    count = int(np.searchsorted(vacf.lag, end * (1.0 + 1e-9), side="right"))
    if count < 3:
        raise ValueError(f"`cutoff` must leave at least 3 lags, got {count}")
    lag = vacf.lag[:count]
    return vacf.derive(
        lambda mean: float(integrate.simpson(mean[:count], x=lag)), window=(0.0, float(lag[-1]))
    )


def running_diffusion(vacf: Correlation) -> Correlation:
    """Green-Kubo integral against its cut-off, with its standard error (trapezoidal rule).

    Parameters
    ----------
    vacf : Correlation
        From :func:`sdpd.analysis.vacf` [length^2/time^2].

    Returns
    -------
    Correlation
        ``lag`` is the cut-off [time], ``mean`` the diffusion coefficient [length^2/time].
    """
    return vacf.integral()


def short_time_diffusion(
    vacf: Correlation,
    *,
    n_lags: int = 4,
    order: int = 2,
    velocity_variance: float | None = None,
) -> ShortTimeDiffusion:
    r"""Short-time self-diffusion from the initial slope of the VACF.

    Parameters
    ----------
    vacf : Correlation
        From :func:`sdpd.analysis.vacf` [length^2/time^2]; its first lags must resolve the decay.
    n_lags : int
        Lags 1 .. `n_lags` enter the extrapolation, ``n_lags > order``.
    order : int
        Degree of the polynomial in t that carries ``-ln(C(t)/C(0))/t`` to t = 0, >= 0. One term
        is used by the curvature that conservative forces add, one by the memory of friction.
    velocity_variance : float, optional
        kB T / m [length^2/time^2]; the measured C(0) by default.

    Returns
    -------
    ShortTimeDiffusion

    Raises
    ------
    ValueError
        If a parameter is out of range, C is not positive at the lags used, or these do not begin
        at 0.

    Notes
    -----
    The exact slope is :math:`-\dot C(0)/C(0) = \langle\sum_j g_{ij}(a+b/D)\rangle/m`. The
    extrapolation removes the finite lag, not the finite time step of the integrator: resolve the
    decay with steps <= tau/2 and keep ``n_lags dt`` at or below tau.
    """
    vacf.require_lag_zero()
    integer("n_lags", n_lags, low=1, high=vacf.lag.size - 1)
    integer("order", order, low=0, high=n_lags - 1)
    if velocity_variance is not None:
        positive("velocity_variance", velocity_variance)
    lag = vacf.lag[1 : n_lags + 1]
    if not (vacf.mean[: n_lags + 1] > 0.0).all():
        raise ValueError(f"`n_lags` must stay where the VACF is positive, got {n_lags}")
    scaled = lag / lag[-1]
    intercept = np.linalg.pinv(np.vander(scaled, order + 1, increasing=True))[0]
    used = (0.0, float(lag[-1]))

    def rates(mean: Array) -> Array:
        safe = np.maximum(mean[: n_lags + 1], np.finfo(float).tiny)
        return np.asarray(-np.log(safe[1:] / safe[0]) / lag)

    def diffusion(mean: Array) -> float:
        variance = float(mean[0]) if velocity_variance is None else float(velocity_variance)
        return variance / float(intercept @ rates(mean))

    each = [vacf.derive(lambda mean, k=k: float(rates(mean)[k])) for k in range(n_lags)]  # type: ignore[misc]
    return ShortTimeDiffusion(
        vacf.derive(lambda mean: float(intercept @ rates(mean)), window=used),
        vacf.derive(diffusion, window=used),
        lag,
        rates(vacf.mean),
        np.array([e.stderr for e in each]),
    )


def local_diffusivity(
    position: ArrayLike,
    dt: float,
    *,
    axis: int,
    bins: int | ArrayLike,
    lag: int,
    box: ArrayLike | None = None,
    components: tuple[int, ...] | None = None,
    n_blocks: int = 32,
) -> Profile:
    r"""Diffusivity in bins along an axis, from displacements that start in each bin.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D)
        Unwrapped positions at equal intervals [length].
    dt : float
        Time between rows [time], > 0.
    axis : int
        Axis along which bins lie, 0 .. D - 1.
    bins : int or array_like
        Number of equal bins over the box (or the range of the data), or their edges [length].
    lag : int
        Displacements span this many rows, ``1 <= lag < T // n_blocks``; short enough that a
        particle stays near its bin, long enough to be diffusive.
    box : array_like, shape (D,), optional
        Periodic box [length]: starting points are folded into [0, L) along `axis`.
    components : tuple of int, optional
        Components counted; all by default. Next to a wall take the parallel ones.
    n_blocks : int
        Blocks of time origins behind the standard error, >= 2.

    Returns
    -------
    Profile
        [length^2/time].

    Raises
    ------
    ValueError
        If an argument has the wrong shape, is not finite or is out of range.

    Notes
    -----
    .. math:: D(z) = \frac{\langle|\Delta\mathbf r(t)|^2\rangle_{z_i(0)\in\mathrm{bin}}}{2 n_c t}

    with n_c components counted: the local form of the Einstein relation (Yang 2013, eq. 2.74).
    """
    data = trajectory("position", position, frames=2)
    rows, _, dimension = data.shape
    positive("dt", dt)
    integer("axis", axis, low=0, high=dimension - 1)
    integer("n_blocks", n_blocks, low=2, high=rows // 2)
    integer("lag", lag, low=1, high=rows // n_blocks - 1)
    chosen = tuple(range(dimension)) if components is None else tuple(components)
    if not chosen:
        raise ValueError("`components` must not be empty")
    for component in chosen:
        integer("components", component, low=0, high=dimension - 1)
    length = None if box is None else float(box_lengths(box, dimension)[axis])
    low = 0.0 if length is not None else float(data[..., axis].min())
    high = length if length is not None else float(data[..., axis].max())
    limits = edges("bins", bins, low=low, high=high)

    origins = rows - lag
    sums = np.zeros((n_blocks, limits.size - 1))
    counts = np.zeros_like(sums)
    for start in range(origins):
        where = data[start, :, axis].astype(np.float64)
        if length is not None:
            where -= length * np.floor(where / length)
        index = np.searchsorted(limits, where, side="right") - 1
        index[where == limits[-1]] = limits.size - 2
        inside = (index >= 0) & (index < limits.size - 1)
        moved = (data[start + lag] - data[start])[:, chosen].astype(np.float64)
        squared = np.einsum("nc,nc->n", moved, moved)
        block = start * n_blocks // origins
        size = limits.size - 1
        sums[block] += np.bincount(index[inside], squared[inside], size)
        counts[block] += np.bincount(index[inside], minlength=size)
    factor = 1.0 / (2.0 * len(chosen) * lag * float(dt))
    return Profile.from_sums(limits, factor * sums, counts, (lag * float(dt), lag * float(dt)))
