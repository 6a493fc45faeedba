"""Averages of fields while a simulation runs: by a kernel at points, or in bins along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels, validation
from sdpd.fields.accumulator import Accumulator
from sdpd.fields.evaluate import sampler_of
from sdpd.fields.field_set import Field, FieldSet
from sdpd.fields.quantities import DEFAULT, Quantity, Recipe, built_in_unit, check_quantities
from sdpd.fields.sampling import BinSampler
from sdpd.fields.state import State
from sdpd.fields.targets import Bins, Target, axis_index

from .base import Observer

if TYPE_CHECKING:
    from sdpd.analysis.blocked import BlockedFunction
    from sdpd.simulation import Simulation

__all__ = ["BinAverage", "FieldAverage"]

Array = NDArray[np.float64]
Quantities = Sequence[str | Quantity] | str | Quantity


class _Averaging(Observer):
    """What both have in common."""

    may_write: ClassVar[bool] = False

    def __init__(self, quantities: Quantities, *, every: int | None, n_blocks: int) -> None:
        super().__init__(every=every)
        self._quantities = check_quantities(quantities)
        self.n_blocks = validation.integer("n_blocks", n_blocks, minimum=2)
        self._sums: Accumulator | None = None

    @property
    def n_frames(self) -> int:
        """Frames averaged so far."""
        return 0 if self._sums is None else self._sums.n_frames

    def __len__(self) -> int:
        return self.n_frames

    @property
    def result(self) -> FieldSet:
        """The averages so far.

        Raises
        ------
        ValueError
            Before the first frame.
        """
        if self._sums is None:
            raise ValueError("there are no fields before the first run")
        return self._sums.result()

    def __getitem__(self, name: str) -> Field:
        return self.result[name]

    def blocked(self, name: str) -> BlockedFunction:
        """See `sdpd.fields.FieldSet.blocked`."""
        return self.result.blocked(name)

    def __repr__(self) -> str:
        names = [q if isinstance(q, str) else q.name for q in self._quantities]
        return f"<sdpd.{type(self).__name__} of {', '.join(names)}: {self.n_frames} frames>"


class FieldAverage(_Averaging):
    r"""Kernel-averaged fields at the points of a target, averaged over a run.

    No frame is kept: sums go into blocks that double in length as the run grows.

    Parameters
    ----------
    target : sdpd.fields.Target
        ``Grid``, ``Line``, ``Plane``, ``Points``, ``Mesh``.
    quantities : sequence of str or sdpd.fields.Quantity
        See `sdpd.fields.snapshot`.
    every : int, optional
        Steps between frames; that of the run if None.
    length : float, optional
        Support radius l_d of the averaging kernel [length]; that of the simulation if None.
    kernel : str, optional
        The averaging kernel; that of the simulation if None.
    n_blocks : int
        Blocks behind the standard errors, at least (up to twice as many); they must be much longer
        than the correlation time. Memory is 2 `n_blocks` times the points.

    Notes
    -----
    Sums of all frames are pooled before a quotient is formed: the velocity is total momentum over
    total mass, not the mean of instantaneous velocities (eq. 2.82 of [1]_), which is biased where
    density and velocity are correlated and has no value where a frame has no particle in reach.
    ``frame_mean`` of a `sdpd.fields.Field` is the latter. Runs of an ensemble are pooled by
    `sdpd.fields.ensemble`.

    References
    ----------
    .. [1] S. Yang, dissertation, Worcester Polytechnic Institute, 2013, sec. 2.2.9.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> line = sdpd.fields.Line((5e-9, 5e-9, 0.0), (5e-9, 5e-9, 1e-8), 11)
    >>> average = sdpd.FieldAverage(line, quantities="velocity", every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=40, observe=average)
    >>> average["velocity_x"].mean.shape, len(average)
    ((11,), 8)
    """

    def __init__(
        self,
        target: Target,
        *,
        quantities: Quantities = DEFAULT,
        every: int | None = None,
        length: float | None = None,
        kernel: str | None = None,
        n_blocks: int = 32,
    ) -> None:
        super().__init__(quantities, every=every, n_blocks=n_blocks)
        expected = "a target, e.g. sdpd.fields.Grid.over(box, (32, 32, 1))"
        self.target = validation.instance("target", target, Target, expected)
        self.length = validation.optional_positive("length", length)
        self.kernel = None if kernel is None else kernels.get(kernel).name

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse another simulation, or one of another dimension."""
        super().check(sim, every, dt)
        self._sampler(sim, State.of(sim))

    def _sampler(self, sim: Simulation, state: State) -> Any:
        return sampler_of(sim, state, self.target, length=self.length, kernel=self.kernel)

    def sample(self, sim: Simulation) -> None:
        """Add the present state."""
        state = State.of(sim)
        if self._sums is None:
            sampler = self._sampler(sim, state)
            self._sums = Accumulator(sampler, self._quantities, n_blocks=self.n_blocks)
        self._sums.add(state, sim)


class BinAverage(_Averaging):
    r"""Averages in bins along an axis, over a run and over the box across it.

    Beside `sdpd.Profile`, which samples inside the loop and also bins by the distance from a wall,
    this takes any quantity, measures the local diffusivity, and needs no length of its blocks.

    Parameters
    ----------
    axis : {"x", "y", "z"} or int
        Along which the bins lie.
    bins : int or array_like
        Number of equal bins over the box, or their edges [length].
    quantities : sequence of str or sdpd.fields.Quantity
        See `sdpd.fields.snapshot`; a bin has the weight 1/volume for the particles in it.
    every : int, optional
        Steps between frames; that of the run if None.
    lag : int, optional
        Adds ``"diffusivity"``: the local diffusivity from displacements over so many frames that
        start in a bin, long enough to be diffusive, short enough to stay near.
    components : sequence of str or int, optional
        Components counted by it; all if None. Next to a wall take the parallel ones.
    n_blocks : int
        As in `FieldAverage`.

    Notes
    -----
    The diffusivity is that of `sdpd.analysis.local_diffusivity`, from displacements that follow one
    another (their origins are `lag` frames apart):

    .. math:: D(z) = \frac{\langle|\Delta\mathbf r(t)|^2\rangle_{z_i(0)\in\mathrm{bin}}}{2 n_c t}

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> profile = sdpd.BinAverage(axis="z", bins=8, quantities=("density", "velocity"), every=5)
    >>> sdpd.Simulation(scene, seed=1).run(steps=40, observe=profile)
    >>> profile["velocity_x"].mean.shape, profile["density"].unit
    ((8,), 'kg/m^3')
    """

    def __init__(
        self,
        *,
        axis: int | str,
        bins: int | ArrayLike = 40,
        quantities: Quantities = ("density", "velocity", "temperature"),
        every: int | None = None,
        lag: int | None = None,
        components: Sequence[int | str] | None = None,
        n_blocks: int = 32,
    ) -> None:
        super().__init__(quantities, every=every, n_blocks=n_blocks)
        self.axis = axis_index(axis, 3)
        self._bins: int | Array
        if isinstance(bins, (int, np.integer)) and not isinstance(bins, bool):
            self._bins = validation.integer("bins", bins, minimum=1)
        else:
            self._bins = validation.real_array("bins", bins, (None,))
            if len(self._bins) < 2 or not (np.diff(self._bins) > 0.0).all():
                raise ValueError("`bins` must be a number or at least two increasing edges")
        self.lag = None if lag is None else validation.integer("lag", lag, minimum=1)
        if components is not None and lag is None:
            raise ValueError("`components` must come with `lag`, got no lag")
        self._components = None if components is None else [axis_index(c, 3) for c in components]
        if self._components is not None and not self._components:
            raise ValueError("`components` must name at least one, got none")
        self._target: Bins | None = None
        self._turn = 1
        self._origin: tuple[int, float, Array] | None = None  # step, time, unwrapped positions

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse another simulation, bins outside the box or an axis it does not have."""
        super().check(sim, every, dt)
        dimension = sim.scene.dimension
        axis_index(self.axis, dimension)
        for component in self._components or ():
            axis_index(component, dimension)
        self._edges(sim)

    def _edges(self, sim: Simulation) -> Array:
        length = sim.scene.box.lengths[self.axis]
        if isinstance(self._bins, int):
            return np.linspace(0.0, length, self._bins + 1)
        if self._bins[0] < 0.0 or self._bins[-1] > length * (1.0 + 1e-12):
            raise ValueError(
                f"`bins` must lie between 0 and {length:g}, got {self._bins[0]:g} to "
                f"{self._bins[-1]:g}"
            )
        return self._bins

    @property
    def target(self) -> Bins:
        """The bins: ``target.centers`` and ``target.edges`` [length]; known from the first run.

        Raises
        ------
        ValueError
            Before the first run.
        """
        if self._target is None:
            raise ValueError("the bins are not known before the first run")
        return self._target

    def begin(self, sim: Simulation, every: int) -> None:
        """Lay out the bins; the first displacement may start here."""
        self._turn = every
        if self._target is None:
            self._target = Bins(self.axis, self._edges(sim), sim.scene.box.lengths)
            self._sums = Accumulator(
                BinSampler(self._target),
                self._quantities,
                n_blocks=self.n_blocks,
                extra=() if self.lag is None else (self._diffusivity(sim),),
            )
        if self.lag is not None and sim.step % every == 0 and not self._follows(sim.step):
            self._origin = (sim.step, sim.time, sim.unwrapped)

    def _follows(self, step: int) -> bool:
        """Whether that step belongs to the displacement under way: a restored state may not."""
        if self._origin is None or self.lag is None:
            return False
        return 0 <= step - self._origin[0] <= self.lag * self._turn

    @staticmethod
    def _diffusivity(sim: Simulation) -> Recipe:
        unit = built_in_unit("diffusivity", sim.scene.dimension, si=sim.scene.fluid.is_si)
        return Recipe("diffusivity", unit, ("displacement", "origins"), (), "mean")

    def sample(self, sim: Simulation) -> None:
        """Add the present state."""
        assert self._sums is not None
        state = State.of(sim)
        self._sums.add(state, sim, self._displacements(sim, state))

    def _displacements(self, sim: Simulation, state: State) -> dict[str, Array] | None:
        """Sums over a displacement that ends here, by the bin it started in."""
        if self.lag is None:
            return None
        step = sim.step
        if self._origin is None or not self._follows(step):
            self._origin = (step, sim.time, sim.unwrapped)
            return None
        first, time, before = self._origin
        if step < first + self.lag * self._turn:
            return None
        now = sim.unwrapped
        chosen = self._components or list(range(before.shape[1]))
        square = np.square(now - before)[:, chosen].sum(axis=1)
        values = square / (2.0 * len(chosen) * (sim.time - time))
        sums = BinSampler(self.target).sums(state, before, values[:, None])
        self._origin = (step, sim.time, now)
        return {"origins": sums[:, 0], "displacement": sums[:, 2]}
