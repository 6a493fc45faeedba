r"""Time correlation functions with blocked standard errors: VACF, MSD, general pairs.

Every origin is used once and belongs to one block (a stretch of time, or a group of particles);
products are summed by FFT, so a function of L lags costs O(T log T) per particle.
Frenkel and Smit, *Understanding Molecular Simulation*, 2nd ed., 2002, sec. 4.4; Allen and
Tildesley, *Computer Simulation of Liquids*, 2nd ed., 2017, sec. 8.3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import Array, positive, real_array, trajectory
from .arguments import window as checked_window
from .blocked import BlockedFunction
from .lagged_products import BlockPlan, block_plan, product_sums, squared_displacements

__all__ = ["Correlation", "autocorrelation", "cross_correlation", "msd", "vacf"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Correlation(BlockedFunction):
    """A function of lag with its standard error and the blocks behind it.

    Lags ascend and need not be equally spaced: those of the correlators inside the loop are linear
    first and then coarser.

    Attributes
    ----------
    lag : ndarray, shape (L,)
        Lags [time].
    mean, stderr : ndarray, shape (L,)
        Estimate and standard error, in the unit of the quantity.
    blocks, block_counts : ndarray, shape (B, L)
        Mean of each block, same unit, and the number of products in it.
    window : tuple of float
        (start, stop) of the times sampled [time].
    dimension : int
        Number of Cartesian components behind each product.
    """

    lag: Array
    dimension: int = 1

    @property
    def resolution(self) -> float:
        """Smallest spacing of the lags [time]."""
        return float(np.min(np.diff(self.lag)))

    @property
    def is_uniform(self) -> bool:
        """Whether the lags are equally spaced."""
        spacing = np.diff(self.lag)
        return bool(np.allclose(spacing, spacing[0], rtol=1e-6, atol=0.0))

    @property
    def step(self) -> float:
        """Spacing of equally spaced lags [time].

        Raises
        ------
        ValueError
            If they are not equally spaced; `resolution` is their smallest spacing.
        """
        if not self.is_uniform:
            raise ValueError("`lag` must be equally spaced for a step, these lags grow coarser")
        return self.resolution

    def lags_within(self, window: tuple[float, float], *, least: int = 1) -> NDArray[np.intp]:
        """Indices of the lags in a closed interval (start, stop) [time].

        Raises
        ------
        ValueError
            If the window leaves the range of the lags or holds fewer than `least` of them.
        """
        start, stop = checked_window("window", window, high=float(self.lag[-1]))
        slack = 1e-9 * float(self.lag[-1])
        inside = np.flatnonzero((self.lag >= start - slack) & (self.lag <= stop + slack))
        if inside.size < least:
            raise ValueError(
                f"`window` must hold at least {least} lags, got {inside.size} between "
                f"{start:.6g} and {stop:.6g}; the closest lags are {self.resolution:.6g} apart"
            )
        return inside

    def between(self, start: float, stop: float) -> Correlation:
        """Part of the function with ``start <= lag <= stop`` [time].

        Raises
        ------
        ValueError
            If the interval leaves the range of the lags or holds fewer than two of them.
        """
        return self.at_lags(self.lags_within((start, stop), least=2))

    def at_lags(self, index: ArrayLike) -> Correlation:
        """Part of the function at some of its lags, given by their (ascending) indices."""
        chosen = np.asarray(index)
        return replace(
            self,
            lag=self.lag[chosen],
            blocks=self.blocks[:, chosen],
            block_counts=self.block_counts[:, chosen],
        )

    def normalized(self) -> tuple[Array, Array]:
        """Return ``mean / mean[0]`` and its jackknife standard error, shapes (L,).

        Raises
        ------
        ValueError
            If the lags do not begin at 0.
        """
        self.require_lag_zero()
        leave = self.leave_one_out()
        ratio = leave / leave[:, :1]
        count = self.n_blocks
        spread = np.sum((ratio - ratio.mean(axis=0)) ** 2, axis=0)
        return self.mean / self.mean[0], np.sqrt((count - 1) / count * spread)

    def integral(self) -> Correlation:
        """Integrate from lag 0 by the trapezoidal rule, cut off at each lag [quantity x time].

        Where lags grow coarser the rule does too: choose them so that the function is smooth
        between its lags.

        Raises
        ------
        ValueError
            If the lags do not begin at 0.
        """
        self.require_lag_zero()
        return self.transformed(lambda mean: _running_integral(self.lag, mean))

    def transformed(self, function: Callable[[Array], Array]) -> Correlation:
        """Apply a function of the whole curve, errors by jackknife pseudo-values.

        Parameters
        ----------
        function : callable
            Takes arrays of shape (..., L) to arrays of the same shape.
        """
        whole, leave = function(self.mean), function(self.leave_one_out())
        number = self.n_blocks
        pseudo = number * whole - (number - 1) * leave
        pseudo += whole - pseudo.mean(axis=0)
        return replace(self, blocks=pseudo, block_counts=np.ones_like(pseudo))

    def scaled(self, factor: ArrayLike) -> Correlation:
        """Multiply by an exactly known number, or by one for each lag."""
        return replace(self, blocks=self.blocks * np.asarray(factor, dtype=np.float64))

    def require_lag_zero(self) -> None:
        """Refuse a function whose lags do not begin at 0.

        Raises
        ------
        ValueError
            If they do not.
        """
        if abs(float(self.lag[0])) > 1e-9 * float(self.lag[-1]):
            raise ValueError(f"`lag` must begin at 0, got {self.lag[0]:.6g}")

    @classmethod
    def merge(cls, members: Sequence[Correlation]) -> Correlation:
        """Join correlations of independent replicas; their blocks are pooled.

        Raises
        ------
        ValueError
            If there are none, or their lags or dimensions differ.
        """
        members = list(members)
        if not members:
            raise ValueError("`members` must not be empty")
        first = members[0]
        for other in members[1:]:
            same = other.lag.shape == first.lag.shape and np.allclose(
                other.lag, first.lag, rtol=1e-9, atol=0.0
            )
            if not same or other.dimension != first.dimension:
                raise ValueError("`members` must have the same lags and dimension")
        return cls(
            lag=first.lag,
            blocks=np.concatenate([m.blocks for m in members]),
            block_counts=np.concatenate([m.block_counts for m in members]),
            window=(min(m.window[0] for m in members), max(m.window[1] for m in members)),
            dimension=first.dimension,
        )


def vacf(
    velocity: ArrayLike, dt: float, *, max_lag: int, n_blocks: int = 32, by: str = "time"
) -> Correlation:
    r"""Velocity autocorrelation function with a blocked standard error.

    Parameters
    ----------
    velocity : ndarray of float, shape (T, N, D)
        Velocities at T equally spaced times [length/time].
    dt : float
        Time between rows of `velocity` [time], > 0.
    max_lag : int
        Largest lag in rows, ``1 <= max_lag < T // n_blocks`` (``< T`` with ``by="particles"``).
    n_blocks : int
        Number of blocks behind the standard error, >= 2.
    by : {"time", "particles"}
        Blocks of time origins, or groups of particles in row order. Groups allow lags up to the
        whole trajectory but ignore what all particles share, so their error is a lower bound.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [length^2/time^2], per component.

    Raises
    ------
    ValueError
        If `velocity` is not 3-d or not finite, or a parameter is out of range.

    Notes
    -----
    .. math:: C(t) = \frac{1}{D} \langle \mathbf v_i(t_0)\cdot\mathbf v_i(t_0+t) \rangle,
              \qquad C(0) = k_B T/m

    Blocks must be much longer than the correlation time for the error to be right.

    References
    ----------
    .. [1] Frenkel and Smit, *Understanding Molecular Simulation*, 2nd ed., 2002, sec. 4.4.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd.analysis import vacf
    >>> velocity = np.random.default_rng(1).normal(size=(400, 50, 3))
    >>> c = vacf(velocity, 0.1, max_lag=5, n_blocks=8)
    >>> bool(abs(c.mean[0] - 1.0) < 5.0 * c.stderr[0])
    True
    """
    data = trajectory("velocity", velocity, frames=2)
    dimension = data.shape[2]
    plan = block_plan(data.shape[:2], max_lag, n_blocks, by)
    sums = product_sums(data, data, plan)
    return assemble(sums / dimension, plan, dt, dimension)


def msd(
    position: ArrayLike, dt: float, *, max_lag: int, n_blocks: int = 32, by: str = "time"
) -> Correlation:
    r"""Mean square displacement over all time origins (windowed) by FFT.

    Parameters
    ----------
    position : ndarray of float, shape (T, N, D)
        *Unwrapped* positions at T equally spaced times [length].
    dt : float
        Time between rows of `position` [time], > 0.
    max_lag, n_blocks, by
        As in :func:`vacf`.

    Returns
    -------
    Correlation
        ``lag`` (L,) [time]; ``mean`` and ``stderr`` (L,) [length^2], summed over components.

    Raises
    ------
    ValueError
        If `position` is not 3-d or not finite, or a parameter is out of range.

    Notes
    -----
    .. math:: \mathrm{MSD}(t) = \langle |\mathbf r_i(t_0+t) - \mathbf r_i(t_0)|^2 \rangle

    with the square expanded and the cross term correlated by FFT. Positions are taken from the
    start of each block, so the rounding is relative to the largest displacement in a block.

    References
    ----------
    .. [1] Calandrini et al., Collection SFN 12, 201 (2011), sec. 4.2.1 (the algorithm).
    """
    data = trajectory("position", position, frames=2)
    plan = block_plan(data.shape[:2], max_lag, n_blocks, by)
    products = product_sums(data, data, plan, relative=True)
    squares = np.empty_like(products)
    for row, (rows, columns) in enumerate(plan.blocks()):
        block = data[rows.start : min(rows.stop + max_lag, plan.total), columns]
        squared = squared_displacements(block)
        running = np.concatenate([[0.0], np.cumsum(squared)])
        lags = np.arange(max_lag + 1)
        origins = plan.origins(rows, lags)
        squares[row] = running[origins] + running[lags + origins] - running[lags]
    sums = squares - 2.0 * products
    sums[:, 0] = 0.0
    return assemble(np.maximum(sums, 0.0), plan, dt, data.shape[2])


def autocorrelation(
    series: ArrayLike,
    dt: float,
    *,
    max_lag: int,
    n_blocks: int = 32,
    by: str = "time",
    subtract_mean: bool = False,
) -> Correlation:
    """Autocorrelation ``<a(t0) a(t0 + t)>`` of one or many real series.

    Parameters
    ----------
    series : array_like, shape (T,), (T, M) or (T, N, D)
        Samples at equal intervals; a last axis D is contracted and divided by D, other
        columns are averaged. Any unit.
    dt, max_lag, n_blocks, by
        As in :func:`vacf`.
    subtract_mean : bool
        Subtract the mean over all rows of each column first.

    Returns
    -------
    Correlation
        In the unit of the series squared.

    Raises
    ------
    ValueError
        If an argument has the wrong shape, is not finite or is out of range.
    """
    return cross_correlation(
        series, series, dt, max_lag=max_lag, n_blocks=n_blocks, by=by, subtract_mean=subtract_mean
    )


def cross_correlation(
    first: ArrayLike,
    second: ArrayLike,
    dt: float,
    *,
    max_lag: int,
    n_blocks: int = 32,
    by: str = "time",
    subtract_mean: bool = False,
) -> Correlation:
    """Correlation ``<a(t0) b(t0 + t)>`` of real series, t >= 0.

    Parameters
    ----------
    first, second : array_like, shape (T,), (T, M) or (T, N, D), equal shapes
        Samples at equal intervals; `second` is the later one.
    dt, max_lag, n_blocks, by, subtract_mean
        As in :func:`autocorrelation`.

    Returns
    -------
    Correlation
        In the product of the two units.

    Raises
    ------
    ValueError
        If the shapes differ, an element is not finite or a parameter is out of range.
    """
    a = real_array("first", first, (1, 2, 3))
    b = a if second is first else real_array("second", second, (1, 2, 3))
    if a.shape != b.shape:
        raise ValueError(f"`second` must have the shape of `first`, {a.shape}, got {b.shape}")
    shape = a.shape + (1,) * (3 - a.ndim)
    a, b = a.reshape(shape), b.reshape(shape)
    if subtract_mean:
        a = a - a.mean(axis=0, dtype=np.float64)
        b = a if second is first else b - b.mean(axis=0, dtype=np.float64)
    plan = block_plan(shape[:2], max_lag, n_blocks, by)
    return assemble(product_sums(a, b, plan) / shape[2], plan, dt, shape[2])


def assemble(sums: Array, plan: BlockPlan, dt: float, dimension: int) -> Correlation:
    """Turn sums of products into a correlation function of lags in units of time."""
    positive("dt", dt)
    lags = np.arange(plan.max_lag + 1)
    counts = np.array(
        [plan.origins(rows, lags) * (part.stop - part.start) for rows, part in plan.blocks()],
        dtype=np.float64,
    )
    window = (0.0, (plan.total - 1) * float(dt))
    lag = np.asarray(lags * float(dt), dtype=np.float64)
    return Correlation(
        lag=lag, blocks=sums / counts, block_counts=counts, window=window, dimension=dimension
    )


def _running_integral(lag: Array, value: Array) -> Array:
    area = 0.5 * np.diff(lag) * (value[..., 1:] + value[..., :-1])
    start = np.zeros((*value.shape[:-1], 1))
    return np.concatenate([start, np.cumsum(area, axis=-1)], axis=-1)
