"""The pressure tensor inside the loop: its series, and its correlations."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

from .base import Array
from .interval_means import IntervalMeans
from .lagged import BLOCKS, LaggedObserver

if TYPE_CHECKING:
    from sdpd.analysis.correlation import Correlation
    from sdpd.simulation import Simulation

__all__ = ["Stress", "StressCorrelator"]

PARTS = ("kinetic", "conservative", "dissipative", "random")
COMPONENTS = ("shear", "bulk", "longitudinal", "trace")
CHOICES = ("total", "collisional", *PARTS)

# Columns of the core's table of sums.
_PRODUCTS = [(p, q) for p in range(4) for q in range(p, 4)]
# Per component: column of the square, and columns of what it is of.
_INCREMENT = {"trace": (11, (12,)), "longitudinal": (13, (14, 15, 16))}
_PRODUCT = {"shear": (17, ()), "trace": (18, (19,)), "longitudinal": (20, (21, 22, 23))}


class Stress(IntervalMeans):
    r"""Time series of the pressure tensor of the box, by part.

    Each value is the exact mean over the interval since the sample before: every kick, exchange and
    drift of every step is counted, random impulses included. The first sample of a segment only
    opens the first interval.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.

    Notes
    -----
    Element (a, b) is the flux of momentum b through a plane across a, and nothing is symmetrised:

    .. math:: V P_{ab} = \sum_i m v_a v_b + \sum_{pairs} r_a f_b

    with the minimum image r of the pair and the force f on its first particle. Drag and noise are
    not central, so P_ab and P_ba differ; the symmetrised tensor would give the wrong viscosity. The
    time integral of V P is the Helfand moment.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> stress = sdpd.Stress(every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=stress)
    >>> stress.total.shape, stress.data["step"].tolist()
    ((3, 3, 3), [10, 15, 20])
    """

    parts: ClassVar[tuple[str, ...]] = PARTS

    def _attach(self, sim: Simulation, every: int) -> Any:
        return sim._core.attach_stress(every)

    def _values(self, rows: Array) -> dict[str, Array]:
        d = self._dimension
        tensors = rows.reshape(-1, 4, d, d)
        return {name: tensors[:, index] for index, name in enumerate(PARTS)}

    @property
    def data(self) -> NDArray[np.void]:
        """All intervals, one row each: a structured array.

        Fields are ``step`` and ``time`` of the end [1, time], and ``kinetic``, ``conservative``,
        ``dissipative`` and ``random``, the mean parts of the pressure tensor over the interval,
        shape (D, D) each [energy/length^D].
        """
        return self._table(PARTS, (self._dimension,) * 2)

    @property
    def total(self) -> Array:
        """Mean pressure tensor over each interval, (T, D, D) [energy/length^D]."""
        return self._total()


class StressCorrelator(LaggedObserver):
    r"""Increments of the Helfand moment and autocorrelation of the stress, on logarithmic lags.

    No series is kept, however long the run. `increments` leads to the viscosities by
    `sdpd.analysis.einstein_viscosity`, `autocorrelation` by `sdpd.analysis.green_kubo_viscosity`.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None. The moment is integrated over every step.
    points : int
        Lags on the first level, even; half as many on each further one.
    levels : int
        The longest lag is ``(points - 1) 2^(levels - 1)`` samples.
    parts : bool
        Keep what pairs exchange by cause: conservative, dissipative, random. The step then costs
        a quarter to a half more instead of some 5 %.

    Notes
    -----
    With :math:`G_{ab}(t) = \int_0^t V P_{ab}\,dt`, exact for the discrete steps, increments are
    :math:`\langle [G_{ab}(t_0+t) - G_{ab}(t_0)]^2 \rangle` and grow as 2 V kB T eta t off the
    diagonal. Segments join as those of `Correlator` do.

    References
    ----------
    .. [1] E. Helfand, Phys. Rev. 119 (1960) 1.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> stress = sdpd.StressCorrelator(every=2, points=4, levels=2)
    >>> sdpd.Simulation(scene, seed=1).run(steps=200, observe=stress)
    >>> stress.increments("shear", n_blocks=8).lag.size
    6
    """

    between_walls: ClassVar[bool] = False

    def __init__(
        self,
        *,
        every: int | None = None,
        points: int = 16,
        levels: int = 10,
        parts: bool = False,
    ) -> None:
        super().__init__(every=every, points=points, levels=levels)
        self.parts = validation.boolean("parts", parts)
        self._volume = 1.0
        self._energy, self._time = 1.0, 1.0

    def _attach(self, sim: Simulation, every: int) -> Any:
        handle = sim._core.attach_stress_correlator(every, self.points, self.levels, self.parts)
        self._energy, self._time = handle.units()
        self._volume = sim.scene.box.volume
        return handle

    @property
    def volume(self) -> float:
        """Volume of the box [length^D]."""
        return self._volume

    def increments(
        self, component: str = "shear", *, part: str = "total", n_blocks: int = BLOCKS
    ) -> Correlation:
        """Mean-square increments of the Helfand moment [(energy time)^2].

        Parameters
        ----------
        component : {"shear", "longitudinal", "bulk", "trace"}
            Averaged over the elements off the diagonal; over those on it, about their mean;
            longitudinal - (2 - 2/D) shear; or tr G/D about its mean. The slopes are those of eta,
            zeta + (2 - 2/D) eta, and zeta; the trace has *no* viscosity of Navier and Stokes, see
            `sdpd.analysis.stress`.
        part : {"total", "collisional", "kinetic", "conservative", "dissipative", "random"}
            Of the shear component: one part alone (collisional: all but the kinetic; the last
            three need `parts`). Parts are correlated, so theirs do not add up to the total.
        n_blocks : int
            Blocks of time behind the standard error, >= 2; lags longer than a block are left out.

        Returns
        -------
        sdpd.analysis.Correlation

        Raises
        ------
        ValueError
            For an unknown component or part, a part of another component than the shear, or
            without samples.
        """
        validation.choice("component", component, COMPONENTS)
        validation.choice("part", part, CHOICES)
        if component != "shear" and part != "total":
            raise ValueError(f'`part` must be "total" unless `component` is "shear", got {part!r}')
        if part in PARTS[1:] and not self.parts:
            raise ValueError(
                '`part` must be "total", "kinetic" or "collisional" for a correlator made without '
                f"parts=True, got {part!r}"
            )
        if component == "bulk":
            return self._bulk(self.increments, n_blocks)
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        counts = groups[..., 0]
        if component == "shear":
            sums = groups[..., 1:11] @ _part_weights(part)
        else:
            square, values = _INCREMENT[component]
            sums = groups[..., square].copy()
            for value in values[: self._elements(component)]:
                plain = groups[..., value]
                drift = _drift(plain, counts, self._lags)
                share = 1.0 / self._elements(component)
                sums += share * (drift**2 * counts - 2.0 * drift * plain)
            # The mean was taken from the same run, which leaves too little by this factor.
            sums = sums / np.maximum(1.0 - self._lags / max(self.n_samples - 1, 1), 0.5)
        unit = (self._energy * self._time) ** 2
        return self._as_correlation(
            sums * unit, counts, longest, dimension=self._elements(component)
        )

    def autocorrelation(self, component: str = "shear", *, n_blocks: int = BLOCKS) -> Correlation:
        """Autocorrelation of the mean pressure over the intervals between samples [pressure^2].

        Parameters
        ----------
        component : {"shear", "longitudinal", "bulk", "trace"}
            As in `increments`.
        n_blocks : int
            As in `increments`.

        Returns
        -------
        sdpd.analysis.Correlation
            At the equally spaced lags of the first level. The random part, delta-correlated in
            time, is in lag 0 in full.

        Raises
        ------
        ValueError
            For an unknown component or without samples.
        """
        from sdpd.analysis.stress import put_back_mean

        validation.choice("component", component, COMPONENTS)
        if component == "bulk":
            return self._bulk(self.autocorrelation, n_blocks)
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        counts = groups[..., 0]
        product, values = _PRODUCT[component]
        sums = groups[..., product].copy()
        for value in values[: self._elements(component)]:
            plain = groups[..., value]
            mean = plain[:, 0].sum() / counts[:, 0].sum()
            sums += (mean**2 * counts - 2.0 * mean * plain) / self._elements(component)
        unit = (self._energy / self._volume) ** 2
        result = self._as_correlation(
            sums * unit,
            counts,
            min(longest, self.points - 1.0),
            dimension=self._elements(component),
        )
        return put_back_mean(result, self.n_samples) if values else result

    def _bulk(self, function: Callable[..., Correlation], n_blocks: int) -> Correlation:
        from sdpd.analysis.stress import bulk_component

        longitudinal, shear = (function(c, n_blocks=n_blocks) for c in ("longitudinal", "shear"))
        return bulk_component(longitudinal, shear, dimension=self._dimension)

    def _elements(self, component: str) -> int:
        """Elements of the tensor behind a component."""
        d = self._dimension
        return {"shear": d * (d - 1), "trace": 1}.get(component, d)


def _part_weights(part: str) -> Array:
    """Coefficients of the ten products of increments in the square of the chosen parts' sum."""
    chosen = {"total": range(4), "collisional": range(1, 4)}.get(part)
    members = set(range(4)[PARTS.index(part) : PARTS.index(part) + 1] if chosen is None else chosen)
    return np.array(
        [(1.0 if p == q else 2.0) * (p in members and q in members) for p, q in _PRODUCTS]
    )


def _drift(plain: Array, counts: Array, lags: Array) -> Array:
    """Mean increment at each lag, from the mean over one interval: the shortest lag's."""
    first = int(np.flatnonzero(lags > 0.0)[0])
    rate = plain[:, first].sum() / counts[:, first].sum() / lags[first]
    return np.asarray(rate * lags)
