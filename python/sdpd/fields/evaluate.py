"""Fields of a simulation as it is, and of trajectories."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from sdpd import resolution, validation

from .accumulator import Accumulator
from .field_set import FieldSet
from .quantities import DEFAULT, Quantity, check_quantities
from .sampling import Sampler, make_sampler
from .state import State
from .targets import Target, axis_index

if TYPE_CHECKING:
    from sdpd.analysis.blocked import Profile
    from sdpd.h5md import Frames
    from sdpd.simulation import Simulation

__all__ = ["average", "diffusivity_profile", "sampler_of", "snapshot"]


def sampler_of(
    sim: Simulation,
    state: State,
    target: Target,
    *,
    length: float | None,
    kernel: str | None,
    threads: int | None = None,
) -> Sampler:
    """The sampler for a simulation: length and kernel are those of its scene if None."""
    return make_sampler(
        target,
        state,
        length=sim.scene.support_radius if length is None else length,
        kernel=sim.scene.resolution.kernel if kernel is None else kernel,
        threads=sim.threads if threads is None else threads,
    )


def snapshot(
    source: Simulation | State,
    target: Target,
    *,
    quantities: Sequence[str | Quantity] | str | Quantity = DEFAULT,
    length: float | None = None,
    kernel: str | None = None,
    threads: int | None = None,
) -> FieldSet:
    r"""Instantaneous fields.

    Parameters
    ----------
    source : Simulation or State
    target : Target
        Where: `Grid`, `Line`, `Plane`, `Points`, `Mesh` or `Bins`.
    quantities : sequence of str or Quantity
        ``"number_density"``, ``"density"`` and ``"momentum_density"`` are plain sums;
        ``"velocity"``, ``"temperature"`` (kinetic), ``"pressure"`` and ``"particle_density"`` (of
        the particles) means over the particles in reach (Shepard).
    length : float, optional
        Support radius l_d of the averaging kernel [length]; that of the simulation if None. A
        `State` needs it, `Bins` do not.
    kernel : str, optional
        Averaging kernel; that of the simulation if None, Wendland C2 for a `State`.
    threads : int, optional
        Those of the simulation if None; changes no bit.

    Returns
    -------
    FieldSet
        Of one frame, without errors: runs of an ensemble are pooled by `ensemble`.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range or a quantity lacks what it needs.

    Notes
    -----
    .. math:: \rho(\mathbf r) = \sum_i m W(|\mathbf r-\mathbf r_i|),\qquad
              X(\mathbf r) = \frac{\sum_i W(|\mathbf r-\mathbf r_i|)\, X_i}
                                  {\sum_i W(|\mathbf r-\mathbf r_i|)}

    The second is eq. 2.80 of [1]_. Within l_d of a wall a plain sum misses what lies beyond it.

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
    >>> sim = sdpd.Simulation(scene, seed=1)
    >>> grid = sdpd.fields.Grid.over(scene.box, (4, 4, 1))
    >>> fields = sdpd.fields.snapshot(sim, grid, quantities=["density", "velocity"])
    >>> fields["velocity"].mean.shape, fields["density"].unit
    ((4, 4, 1, 3), 'kg/m^3')
    """
    chosen = check_quantities(quantities)
    if isinstance(source, State):
        state = source
        sampler = make_sampler(
            target,
            state,
            length=length,
            kernel=kernel or resolution.DEFAULT_KERNEL,
            threads=threads or 1,
        )
    else:
        state = State.of(source)
        sampler = sampler_of(source, state, target, length=length, kernel=kernel, threads=threads)
    sums = Accumulator(sampler, chosen, n_blocks=2)
    sums.add(state, source)
    return sums.result()


def average(
    frames: Frames | Iterable[State],
    target: Target,
    *,
    quantities: Sequence[str | Quantity] | str | Quantity = DEFAULT,
    length: float | None = None,
    kernel: str | None = None,
    n_blocks: int = 32,
    threads: int = 1,
) -> FieldSet:
    """Fields averaged over the frames of a trajectory; see `snapshot` and `sdpd.FieldAverage`.

    Parameters
    ----------
    frames : sdpd.h5md.Frames or iterable of State
    target, quantities
        As in `snapshot`; a custom `Quantity` is called with each `State`.
    length : float, optional
        As in `snapshot`; that of the scene if None and `frames` are of a file.
    kernel : str, optional
        As in `snapshot`; that of the scene or Wendland C2.
    n_blocks : int
        Blocks of frames behind the standard errors, at least (up to twice as many).
    threads : int
        Changes no bit.

    Returns
    -------
    FieldSet

    Raises
    ------
    TypeError, ValueError
        As `snapshot`, or if there is no frame.
    """
    from sdpd.h5md import Frames

    chosen = check_quantities(quantities)
    states: Iterable[State]
    if isinstance(frames, Frames):
        from sdpd.scene import Scene

        scene = Scene.from_toml(frames.scene)
        length = scene.support_radius if length is None else length
        kernel = kernel or scene.resolution.kernel
        states = State.of_frames(frames)
    else:
        states = frames
    sums: Accumulator | None = None
    for index, state in enumerate(states):
        validation.instance(f"frames[{index}]", state, State, "an sdpd.fields.State")
        if sums is None:
            name = kernel or resolution.DEFAULT_KERNEL
            sampler = make_sampler(target, state, length=length, kernel=name, threads=threads)
            sums = Accumulator(sampler, chosen, n_blocks=n_blocks)
        sums.add(state, state)
    if sums is None:
        raise ValueError("`frames` must hold at least one frame, got none")
    return sums.result()


def diffusivity_profile(
    frames: Frames,
    *,
    axis: int | str,
    bins: int | ArrayLike,
    lag: int,
    components: Sequence[int | str] | None = None,
    n_blocks: int = 32,
) -> Profile:
    """Local diffusivity D(z) of a trajectory: `sdpd.analysis.local_diffusivity` of its frames.

    Parameters
    ----------
    frames : sdpd.h5md.Frames
        Equally spaced.
    axis : {"x", "y", "z"} or int
        Along which the bins lie.
    bins : int or array_like
        Number of equal bins over the box, or their edges [length].
    lag : int
        Displacements span so many frames, ``1 <= lag < T // n_blocks``.
    components : sequence of str or int, optional
        Counted components; all if None. Next to a wall take the parallel ones.
    n_blocks : int
        Blocks of time origins behind the standard error.

    Returns
    -------
    sdpd.analysis.Profile
        [length^2/time].
    """
    from sdpd.analysis import local_diffusivity

    dimension = frames.positions.shape[2]
    chosen: Any = None
    if components is not None:
        chosen = tuple(axis_index(component, dimension) for component in components)
    return local_diffusivity(
        frames.unwrapped,
        frames.dt,
        axis=axis_index(axis, dimension),
        bins=bins,
        lag=lag,
        box=frames.box,
        components=chosen,
        n_blocks=n_blocks,
    )
