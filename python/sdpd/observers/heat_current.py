"""The current of energy inside the loop: its series, and its correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.integrators import PairSplitting

from .base import Array
from .interval_means import IntervalMeans
from .lagged import BLOCKS, LaggedObserver

if TYPE_CHECKING:
    from sdpd.analysis.correlation import Correlation
    from sdpd.simulation import Simulation

__all__ = ["HeatCurrent", "HeatCurrentCorrelator"]

PARTS = ("conduction", "friction", "pressure", "convection")
CHOICES = ("total", *PARTS)
AT_REST = 1e-9  # total momentum over what N particles with Maxwellian speeds would have

# The core keeps six parts: these four, the first two without their noise, and the noise of either.
_MEMBERS = {"conduction": {0, 4}, "friction": {1, 5}, "pressure": {2}, "convection": {3}}
_MEMBERS["total"] = set().union(*_MEMBERS.values())
_NOISE = {4, 5}
# Columns of its table of sums.
_PRODUCTS = [(p, q) for p in range(6) for q in range(p, 6)]
_VARIATION = {4: 22, 5: 23}
_TOTAL, _RANDOM = 24, 25


def _check_energy(name: str, sim: Simulation) -> None:
    """Refuse a fluid whose steps do not conserve energy: it has no current of it."""
    active = sim.scene.active_effects
    if not active.energy:
        raise ValueError(
            f"`observe` must not hold a {name} of an isothermal fluid; give the scene "
            "effects=sdpd.Effects(energy=True)"
        )
    if active.dissipation and not active.viscous_heating:
        raise ValueError(
            f"`observe` must not hold a {name} without viscous heating: friction then exchanges "
            "energy with a bath and not between particles"
        )
    integrator = sim.integrator
    if not isinstance(integrator, PairSplitting) or integrator.metropolis:
        raise ValueError(
            f"`observe` must not hold a {name} with {integrator!r}: it is made for "
            "the exchanges of sdpd.PairSplitting() without acceptance"
        )
    if not integrator.energy_bookkeeping:
        raise ValueError(
            f"`observe` must not hold a {name} without energy_bookkeeping: adiabats alone do not "
            "conserve energy from step to step, so that none is handed from one particle to another"
        )


class HeatCurrent(IntervalMeans):
    r"""Time series of the flux of energy through the box, by part.

    Each value is the exact mean over the interval since the sample before: every exchange, kick and
    drift of every step is counted, random heat and impulses included. The first sample of a segment
    only opens the first interval.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.

    Notes
    -----
    With the kinetic and internal energy :math:`e_i` of a particle,

    .. math:: V \mathbf q = \sum_{pairs} \mathbf r_{ij}\,\dot e_{i\leftarrow j}
              + \sum_i e_i \mathbf v_i ,

    where j hands to i what conduction does, :math:`\mathbf F\cdot(\mathbf v_i+\mathbf v_j)/2` by
    friction and its noise, and :math:`F\,\mathbf r_{ij}\cdot(A_j\mathbf v_i+A_i\mathbf v_j)` by
    pressure, :math:`A=P/d^2`. The time integral of V q is the Helfand moment: in every step it
    changes by just what :math:`\sum_i e_i\mathbf r_i` of unwrapped positions does. Work of a body
    force is a source, not a current.

    This is the flux of *energy*. Where the fluid as a whole moves it holds the enthalpy that goes
    along; with zero total momentum it is the flux of heat, and the zero of energy plays no part.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.nitrogen(),
    ...     box=sdpd.Box((2.5e-7, 2.5e-7, 2.5e-7)),
    ...     resolution=sdpd.Resolution(particles=512),
    ...     effects=sdpd.Effects(energy=True),
    ... )
    >>> heat = sdpd.HeatCurrent(every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=heat)
    >>> heat.total.shape, heat.data["step"].tolist()
    ((3, 3), [10, 15, 20])
    """

    parts: ClassVar[tuple[str, ...]] = PARTS

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse walls, another simulation, and a fluid without a current of energy."""
        super().check(sim, every, dt)
        _check_energy("HeatCurrent", sim)

    def _attach(self, sim: Simulation, every: int) -> Any:
        return sim._core.attach_heat_current(every)

    def _values(self, rows: Array) -> dict[str, Array]:
        kept = rows.reshape(-1, 6, self._dimension)
        fields = {**{name: _MEMBERS[name] for name in PARTS}, "noise": _NOISE}
        return {name: kept[:, sorted(which)].sum(axis=1) for name, which in fields.items()}

    @property
    def data(self) -> NDArray[np.void]:
        """All intervals, one row each: a structured array.

        Fields are ``step`` and ``time`` of the end [1, time], and ``conduction``, ``friction``,
        ``pressure`` and ``convection``, the mean parts of the flux over the interval, shape (D,)
        each [energy/(length^(D-1) time)]; then ``noise``, what random heat and impulses have of the
        first two.
        """
        return self._table((*PARTS, "noise"), (self._dimension,))

    @property
    def total(self) -> Array:
        """Mean flux over each interval, (T, D) [energy/(length^(D-1) time)]."""
        return self._total()


class HeatCurrentCorrelator(LaggedObserver):
    r"""Increments of the Helfand moment of heat and autocorrelation of its flux, on many lags.

    No series is kept, however long the run. `increments` leads to the conductivity by
    `sdpd.analysis.einstein_conductivity`, `autocorrelation` by
    `sdpd.analysis.green_kubo_conductivity`.

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
    See `HeatCurrent` for the flux. With :math:`\mathbf G(t) = \int_0^t V\mathbf q\,dt`, increments
    are :math:`\langle [G_a(t_0+t) - G_a(t_0)]^2 \rangle`, the mean over the axes, and grow as
    2 V kB T^2 kappa t. The fluid must be at rest, or the enthalpy that goes along would be taken
    for heat. Segments join as those of `Correlator` do.

    References
    ----------
    .. [1] E. Helfand, Phys. Rev. 119 (1960) 1.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.nitrogen(),
    ...     box=sdpd.Box((2.5e-7, 2.5e-7, 2.5e-7)),
    ...     resolution=sdpd.Resolution(particles=512),
    ...     effects=sdpd.Effects(energy=True),
    ... )
    >>> heat = sdpd.HeatCurrentCorrelator(every=2, points=4, levels=2)
    >>> sdpd.Simulation(scene, seed=1).run(steps=60, observe=heat)
    >>> heat.increments(n_blocks=4).lag.size
    6
    """

    between_walls: ClassVar[bool] = False

    def __init__(self, *, every: int | None = None, points: int = 16, levels: int = 10) -> None:
        super().__init__(every=every, points=points, levels=levels)
        self._volume = 1.0
        self._current, self._unit_time = 1.0, 1.0

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse what has no current of heat at rest, and other lags than those at hand."""
        super().check(sim, every, dt)
        _check_energy("HeatCurrentCorrelator", sim)
        scene = sim.scene
        if scene.active_effects.body_force:
            raise ValueError(
                "`observe` must not hold a HeatCurrentCorrelator where a body force acts: it is "
                "for a fluid in equilibrium"
            )
        velocities = np.asarray(sim.velocities)
        total = np.abs(velocities.sum(axis=0)).max()
        speed = np.sqrt(np.square(velocities).sum())
        if total > AT_REST * max(speed, scene.thermal_speed):
            raise ValueError(
                "`observe` must hold a HeatCurrentCorrelator of a fluid at rest only: its mean "
                f"velocity is up to {total / len(velocities):.3g} along an axis and would carry "
                "enthalpy; take it off with sim.velocities -= sim.velocities.mean(axis=0)"
            )

    def _attach(self, sim: Simulation, every: int) -> Any:
        handle = sim._core.attach_heat_correlator(every, self.points, self.levels)
        energy, time = handle.units()
        self._current = energy * sim.scene.support_radius / time
        self._volume = sim.scene.box.volume
        self._unit_time = time
        return handle

    @property
    def volume(self) -> float:
        """Volume of the box [length^D]."""
        return self._volume

    def increments(
        self, part: str = "total", *, exact_noise: bool = True, n_blocks: int = BLOCKS
    ) -> Correlation:
        """Mean-square increments of the Helfand moment, mean over the axes [(energy length)^2].

        Parameters
        ----------
        part : {"total", "conduction", "friction", "pressure", "convection"}
            All, or one part alone. Parts are correlated: theirs do not add up to the total.
        exact_noise : bool
            Replace the mean square of what the noise alone hands over by the sum of the squares
            that it hands over pair by pair: the same mean, known much better. A Metropolis step
            that refuses updates, or very few k_B a particle, make them differ by the share refused.
        n_blocks : int
            Blocks of time behind the standard error, >= 2; lags longer than a block are left out.

        Returns
        -------
        sdpd.analysis.Correlation

        Raises
        ------
        ValueError
            For an unknown part or without samples.
        """
        validation.choice("part", part, CHOICES)
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        members, exact = _MEMBERS[part], validation.boolean("exact_noise", exact_noise)
        sums = groups[..., 1:22] @ _square(members)
        if exact:
            noise = members & _NOISE
            sums = sums - groups[..., 1:22] @ _square(noise)
            sums = sums + sum(groups[..., _VARIATION[k]] for k in noise)
        unit = (self._current * self._unit_time) ** 2
        return self._as_correlation(sums * unit, groups[..., 0], longest, dimension=self._dimension)

    def noise_increments(self, *, n_blocks: int = BLOCKS) -> Correlation:
        """Mean-square increments of what noise alone hands over, from its pair sums.

        They grow linearly in time: of all increments, the part that is delta-correlated.

        Parameters
        ----------
        n_blocks : int
            As in `increments`.

        Returns
        -------
        sdpd.analysis.Correlation
            [(energy length)^2].
        """
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        sums = groups[..., list(_VARIATION.values())].sum(axis=-1)
        unit = (self._current * self._unit_time) ** 2
        return self._as_correlation(sums * unit, groups[..., 0], longest, dimension=self._dimension)

    def autocorrelation(self, *, exact_noise: bool = True, n_blocks: int = BLOCKS) -> Correlation:
        """Autocorrelation of the mean flux over the intervals, mean over the axes [flux^2].

        Parameters
        ----------
        exact_noise, n_blocks
            As in `increments`; noise of different intervals is independent.

        Returns
        -------
        sdpd.analysis.Correlation
            At the equally spaced lags of the first level. Random heat, delta-correlated in time, is
            in lag 0 in full.

        Raises
        ------
        ValueError
            Without samples.
        """
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        sums = groups[..., _TOTAL].copy()
        if validation.boolean("exact_noise", exact_noise):
            sums -= groups[..., _RANDOM]
            interval = (self._every or 1) * self._dt / self._unit_time
            squares = groups[:, 1, 22:24].sum(axis=1) / np.maximum(groups[:, 1, 0], 1.0)
            sums[:, 0] += groups[:, 0, 0] * squares / interval**2
        unit = (self._current / self._volume) ** 2
        return self._as_correlation(
            sums * unit,
            groups[..., 0],
            min(longest, self.points - 1.0),
            dimension=self._dimension,
        )


def _square(members: set[int]) -> Array:
    """Coefficients of the products of increments in the square of the members' sum."""
    return np.array([(1.0 if p == q else 2.0) * ({p, q} <= members) for p, q in _PRODUCTS])
