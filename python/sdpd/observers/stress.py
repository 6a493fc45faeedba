"""The pressure tensor inside the loop: its series, and its correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

from .base import Array, LoopObserver
from .lagged import BLOCKS, LaggedObserver

if TYPE_CHECKING:
    from sdpd.analysis.correlation import Correlation
    from sdpd.simulation import Simulation

__all__ = ["Stress", "StressCorrelator"]

PARTS = ("kinetic", "conservative", "dissipative", "random")
COMPONENTS = ("shear", "bulk", "longitudinal")
CHOICES = ("total", "collisional", *PARTS)

# Columns of the core's table of sums.
_PRODUCTS = [(p, q) for p in range(4) for q in range(p, 4)]
_INCREMENT = {"bulk": (11, 12), "longitudinal": (13, 14)}
_PRODUCT = {"shear": (15, None), "bulk": (16, 17), "longitudinal": (18, 19)}


class Stress(LoopObserver):
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

    def __init__(self, *, every: int | None = None) -> None:
        super().__init__(every=every)
        self._dimension = 3
        self._volume = 1.0

    def _attach(self, sim: Simulation, every: int) -> Any:
        self._dimension, self._volume = sim.scene.dimension, sim.scene.box.volume
        return sim._core.attach_stress(every)

    def rewind(self, step: int) -> None:
        """End the segment without the intervals that end after `step`."""
        self.detach()
        if self._segments:
            last = self._segments[-1]
            self._segments[-1] = last[last[:, 0] <= step]

    @property
    def interval(self) -> float:
        """Length of the intervals [time]."""
        return (self._every or 1) * self._dt

    @property
    def volume(self) -> float:
        """Volume of the box [length^D]."""
        return self._volume

    @property
    def data(self) -> NDArray[np.void]:
        """All intervals, one row each: a structured array.

        Fields are ``step`` and ``time`` of the end [1, time], and ``kinetic``, ``conservative``,
        ``dissipative`` and ``random``, the mean parts of the pressure tensor over the interval,
        shape (D, D) each [energy/length^D].
        """
        d = self._dimension
        kinds: list[Any] = [("step", np.int64), ("time", np.float64)]
        kinds += [(name, np.float64, (d, d)) for name in PARTS]
        tables = self._tables()
        result = np.zeros(sum(len(table) for table in tables), dtype=kinds)
        if len(result):
            rows = np.concatenate(tables)
            result["step"], result["time"] = rows[:, 0], rows[:, 1]
            parts = rows[:, 2:].reshape(-1, 4, d, d)
            for index, name in enumerate(PARTS):
                result[name] = parts[:, index]
        return result

    @property
    def total(self) -> Array:
        """Mean pressure tensor over each interval, (T, D, D) [energy/length^D]."""
        data = self.data
        return np.asarray(sum(data[name] for name in PARTS))

    def __len__(self) -> int:
        return sum(len(table) for table in self._tables())

    def __repr__(self) -> str:
        return f"<sdpd.Stress every {self._every or self.every}: {len(self)} intervals>"


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

    def __init__(self, *, every: int | None = None, points: int = 16, levels: int = 10) -> None:
        super().__init__(every=every, points=points, levels=levels)
        self._volume = 1.0
        self._energy, self._time = 1.0, 1.0

    def _attach(self, sim: Simulation, every: int) -> Any:
        handle = sim._core.attach_stress_correlator(every, self.points, self.levels)
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
        component : {"shear", "bulk", "longitudinal"}
            All elements off the diagonal; tr G/D; or those on the diagonal, the latter two about
            their means. Averaged over the elements.
        part : {"total", "collisional", "kinetic", "conservative", "dissipative", "random"}
            Of the shear component: one part alone (collisional: all but the kinetic). Parts are
            correlated, so theirs do not add up to the total.
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
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        counts = groups[..., 0]
        if component == "shear":
            sums = groups[..., 1:11] @ _part_weights(part)
            elements = self._dimension * (self._dimension - 1)
        else:
            square, plain = _INCREMENT[component]
            drift = _drift(groups, plain, self._lags)
            sums = groups[..., square] - 2.0 * drift * groups[..., plain] + drift**2 * counts
            elements = 1 if component == "bulk" else self._dimension
        unit = (self._energy * self._time) ** 2
        return self._as_correlation(sums * unit, counts, longest, dimension=elements)

    def autocorrelation(self, component: str = "shear", *, n_blocks: int = BLOCKS) -> Correlation:
        """Autocorrelation of the mean pressure over the intervals between samples [pressure^2].

        Parameters
        ----------
        component : {"shear", "bulk", "longitudinal"}
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
        validation.choice("component", component, COMPONENTS)
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        counts = groups[..., 0]
        product, plain = _PRODUCT[component]
        sums = groups[..., product]
        if plain is not None:
            mean = groups[:, 0, plain].sum() / counts[:, 0].sum()
            sums = sums - 2.0 * mean * groups[..., plain] + mean**2 * counts
        elements = {"shear": self._dimension * (self._dimension - 1), "bulk": 1}
        unit = (self._energy / self._volume) ** 2
        return self._as_correlation(
            sums * unit,
            counts,
            min(longest, self.points - 1.0),
            dimension=elements.get(component, self._dimension),
        )


def _part_weights(part: str) -> Array:
    """Coefficients of the ten products of increments in the square of the chosen parts' sum."""
    chosen = {"total": range(4), "collisional": range(1, 4)}.get(part)
    members = set(range(4)[PARTS.index(part) : PARTS.index(part) + 1] if chosen is None else chosen)
    return np.array(
        [(1.0 if p == q else 2.0) * (p in members and q in members) for p, q in _PRODUCTS]
    )


def _drift(groups: Array, plain: int, lags: Array) -> Array:
    """Mean increment at each lag, from the mean over one interval: the shortest lag's."""
    first = int(np.flatnonzero(lags > 0.0)[0])
    rate = groups[:, first, plain].sum() / groups[:, first, 0].sum() / lags[first]
    return np.asarray(rate * lags)
