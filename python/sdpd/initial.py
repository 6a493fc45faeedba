"""Where particles start and how fast: a lattice or relaxed random positions, Maxwellian speeds.

The numbers come from the counter-based generator of the core, keyed by seed and particle id, so a
start depends on the seed and on nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation
from sdpd.box import AXES, Box
from sdpd.walls.shaped import ROUNDING

if TYPE_CHECKING:
    from sdpd.geometry import Geometry
    from sdpd.scene import Scene

__all__ = [
    "LatticeStart",
    "RandomStart",
    "Start",
    "check_crowding",
    "check_positions",
    "check_velocities",
    "positions",
    "velocities",
]

Array = NDArray[np.float64]
_RELAX_STEPS = 200
_VELOCITIES = ("auto", "thermal", "zero")


@dataclass(frozen=True, kw_only=True)
class Start:
    """Base of the initial states.

    Parameters
    ----------
    velocities : {"auto", "thermal", "zero"}
        Maxwellian at the temperature of the fluid, or at rest; "auto" is thermal with fluctuations
        or without friction, else zero.
    """

    velocities: str = "auto"

    def __post_init__(self) -> None:
        validation.choice("velocities", self.velocities, _VELOCITIES)


@dataclass(frozen=True, kw_only=True)
class LatticeStart(Start):
    """Particles on a simple cubic (square) lattice.

    Parameters
    ----------
    jitter : float
        Each coordinate is moved by up to this times the spacing, either way; 0 <= jitter <= 0.5.
    velocities : {"auto", "thermal", "zero"}
        See `Start`.
    """

    jitter: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        value = validation.non_negative("jitter", self.jitter)
        if value > 0.5:
            raise ValueError(f"`jitter` must be >= 0 and <= 0.5 (of the spacing), got {value:g}")
        object.__setattr__(self, "jitter", value)


@dataclass(frozen=True, kw_only=True)
class RandomStart(Start):
    """Particles without order.

    Parameters
    ----------
    relax : bool
        True: a quasi-random set (which has no long density waves, slow to decay), jittered by a
        spacing and relaxed by steepest descent in a soft repulsion, whatever the kernel and the
        equation of state of the scene. Even and without order, but not yet in equilibrium.
        False: independent uniform positions, a Poisson process.
    relax_steps : int, optional
        Iterations of the descent, at most a million; 200 if None. Only with `relax`.
    velocities : {"auto", "thermal", "zero"}
        See `Start`.
    """

    relax: bool = True
    relax_steps: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "relax", validation.boolean("relax", self.relax))
        steps = self.relax_steps
        if steps is not None:
            steps = validation.integer("relax_steps", steps, minimum=1, maximum=10**6)
            if not self.relax:
                raise ValueError(
                    f"`relax_steps` must be None with relax=False, which takes none, got {steps}"
                )
        elif self.relax:
            steps = _RELAX_STEPS
        object.__setattr__(self, "relax_steps", steps)


# A density this many times that of the fluid is no state of it at one support. (Independent uniform
# positions reach 2 to 3, shocks 4.)
LARGEST_CROWDING = 30.0
RELAX_SLICE = 4  # iterations between two chances to interrupt

STARTS: dict[str, type[Start]] = {"lattice": LatticeStart, "random": RandomStart}


def _uniform(seed: int, number: int, dimension: int) -> Array:
    """Independent uniforms on [0, 1), one row per particle."""
    from sdpd import _core

    return np.asarray(_core.uniform_positions(number, dimension, seed))


def _wrap(points: Array, box: Box) -> Array:
    lengths = np.asarray(box.lengths)
    if box.periodic_axes != AXES[: box.dimension]:
        periodic = [axis in box.periodic_axes for axis in AXES[: box.dimension]]
        free = np.where(periodic, lengths, np.inf)
        with np.errstate(invalid="ignore"):
            turns = np.where(periodic, np.floor(points / free) * lengths, 0.0)
        wrapped = points - turns
        return np.where(periodic & (wrapped >= lengths), 0.0, wrapped)
    wrapped = points - np.floor(points / lengths) * lengths
    return np.where(wrapped >= lengths, 0.0, wrapped)


def positions(scene: Scene, seed: int, threads: int = 1) -> Array:
    """Initial positions of a scene.

    Parameters
    ----------
    scene : Scene
    seed : int
        >= 0.
    threads : int
        For relaxing a random start; the result does not depend on it.

    Returns
    -------
    ndarray of float64, shape (N, D)
        [length], inside the box: ``0 <= x < L``.
    """
    from sdpd import _core

    start, box = scene.start, scene.box
    lengths = np.asarray(box.lengths)
    number, dimension = scene.n_particles, scene.dimension
    if scene.walls:
        return _between_walls(scene, seed, threads)
    if isinstance(start, LatticeStart):
        assert scene.layout.counts is not None
        counts = np.asarray(scene.layout.counts)
        index = np.stack(np.unravel_index(np.arange(number), scene.layout.counts), axis=-1)
        points = (index + 0.5) * (lengths / counts)
        if start.jitter > 0.0:
            shift = 2.0 * _uniform(seed, number, dimension) - 1.0
            points += start.jitter * shift * (lengths / counts)
        return _wrap(points, box)
    assert isinstance(start, RandomStart)
    uniform = _uniform(seed, number, dimension)
    if not start.relax:
        return _wrap(uniform * lengths, box)
    assert start.relax_steps is not None
    points = _quasi_random(number, dimension) * lengths + uniform * scene.spacing
    points = _wrap(points, box)
    # A few iterations a call, so that Ctrl-C is heard in between.
    for first in range(0, start.relax_steps, RELAX_SLICE):
        points, _ = _core.relax_positions(
            points,
            list(box.lengths),
            scene.support_radius,
            start.relax_steps,
            first,
            first + RELAX_SLICE,
            threads,
        )
    return _wrap(np.asarray(points), box)


def _between_walls(scene: Scene, seed: int, threads: int) -> Array:
    """Initial positions where walls leave room for them."""
    from sdpd import _core, loading

    start, geometry = scene.start, scene.geometry
    number, dimension = scene.n_particles, scene.dimension
    uniform = _uniform(seed, number, dimension)
    if isinstance(start, LatticeStart):
        spacing = scene.spacing if geometry.is_cuboid else scene.resolution.spacing
        assert spacing is not None
        points = loading.lattice_sites(geometry, spacing)
        shift = start.jitter * (2.0 * uniform - 1.0) * scene.spacing
        return _wrap(_reflected(points + shift, points, geometry), scene.box)
    assert isinstance(start, RandomStart)
    if not start.relax:
        return _uniform_between_walls(scene, seed)
    points = loading.quasi_random_sites(geometry, number)
    shift = (uniform - 0.5) * scene.spacing
    points = _reflected(_wrap(points + shift, scene.box), points, geometry)
    assert start.relax_steps is not None
    arguments = scene.wall_arguments()
    for first in range(0, start.relax_steps, RELAX_SLICE):
        points, _ = _core.relax_positions(
            points,
            list(scene.box.lengths),
            scene.support_radius,
            start.relax_steps,
            first,
            first + RELAX_SLICE,
            threads,
            volume=scene.fluid_volume,
            **arguments,
        )
    return _wrap(np.asarray(points), scene.box)


def _uniform_between_walls(scene: Scene, seed: int) -> Array:
    """The first of a sequence of independent points of the box that lie in the fluid."""
    geometry, lengths = scene.geometry, np.asarray(scene.box.lengths)
    number = scene.n_particles
    drawn = int(1.1 * number * scene.box.volume / geometry.volume) + 64
    while True:
        points = _uniform(seed, drawn, scene.dimension) * lengths
        points = points[geometry.distance(points) > 0.0]
        if len(points) >= number:
            return np.asarray(points[:number])
        drawn *= 2


def _reflected(points: Array, instead: Array, geometry: Geometry) -> Array:
    """The points, or those `instead` of them where they lie behind a wall."""
    outside = geometry.distance(points) <= 0.0
    return np.where(outside[:, None], instead, points)


def _quasi_random(number: int, dimension: int) -> Array:
    """Additive recurrence with the generalised golden ratio (Roberts 2018), in [0, 1)^D."""
    ratio = 2.0
    for _ in range(60):  # the root of x^(D+1) = x + 1
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1))
    steps = ratio ** -np.arange(1.0, dimension + 1.0)
    return np.asarray((0.5 + np.arange(number)[:, None] * steps) % 1.0)


def velocities(scene: Scene, seed: int) -> Array:
    """Initial velocities of a scene.

    Parameters
    ----------
    scene : Scene
    seed : int
        >= 0.

    Returns
    -------
    ndarray of float64, shape (N, D)
        [length/time]; total momentum zero to rounding.

    Notes
    -----
    Independent normals of variance k_B T/m less their mean. Nothing is rescaled: this *is* the
    canonical distribution at zero total momentum, whose mean square per component is
    (1 - 1/N) k_B T/m, the same as that of the dynamics, which keep the momentum.
    """
    shape = (scene.n_particles, scene.dimension)
    if not scene.starts_thermal:
        return np.zeros(shape)
    from sdpd import _core

    drawn = scene.thermal_speed * np.asarray(_core.normal_velocities(*shape, seed))
    if scene.walls:
        return drawn  # walls take up momentum: none of it is conserved
    return np.asarray(drawn - drawn.mean(axis=0))


def check_positions(scene: Scene, value: Any) -> Array:
    """The user's positions, checked and wrapped into the box.

    Raises
    ------
    TypeError, ValueError
        If they are not a finite (N, D) array, two particles coincide, or one is behind a wall.
    """
    shape = (scene.n_particles, scene.dimension)
    points = _wrap(validation.real_array("positions", value, shape), scene.box)
    order = np.lexsort(points.T[::-1])
    same = np.flatnonzero((np.diff(points[order], axis=0) == 0.0).all(axis=1))
    if same.size:
        first, second = sorted(int(k) for k in order[same[0] : same[0] + 2])
        raise ValueError(
            f"`positions` must be distinct, got particles {first} and {second} both at "
            f"{points[first].tolist()}"
        )
    if scene.walls:
        distance = scene.geometry.distance(points)
        worst = int(np.argmin(distance))
        room = ROUNDING[scene.dimension] if scene.geometry.is_shaped else 1e-9
        if distance[worst] < -room * scene.support_radius:
            raise ValueError(
                f"`positions` must lie in the fluid, got particle {worst} at "
                f"{points[worst].tolist()}, {-distance[worst]:.4g} behind a wall"
            )
    return points


def check_crowding(scene: Scene, densities: Array) -> None:
    """Refuse positions so dense somewhere that a support there holds far too many particles.

    Raises
    ------
    ValueError
        Naming the particle and the ratio.
    """
    worst = int(np.argmax(densities))
    ratio = float(densities[worst]) / scene.fluid.density
    if ratio > LARGEST_CROWDING:
        raise ValueError(
            f"`positions` must keep the density below {LARGEST_CROWDING:g} times that of the "
            f"fluid, got {ratio:.4g} times at particle {worst}: the support is the same all over, "
            f"so it has {ratio * 2.0 * scene.pairs_per_particle:.0f} partners there and none in "
            "thin regions; large density ratios need a support that varies, which there is "
            "not"
        )


def check_velocities(scene: Scene, value: Any) -> Array:
    """The user's velocities, checked.

    Raises
    ------
    TypeError, ValueError
        If they are not a finite (N, D) array.
    """
    return validation.real_array("velocities", value, (scene.n_particles, scene.dimension))


def check_temperatures(scene: Scene, value: ArrayLike) -> Array:
    """Temperatures of the particles, (N,), finite and > 0; one number is that of all."""
    number = scene.n_particles
    if np.ndim(value) == 0:
        return np.full(number, validation.positive("temperatures", value))
    array = validation.real_array("temperatures", value, (number,))
    if not array.min() > 0.0:
        row = int(np.argmin(array))
        raise ValueError(f"`temperatures` must be > 0, got {array[row]:g} in row {row}")
    return array


def temperatures(scene: Scene, value: ArrayLike | None) -> Array | None:
    """Temperatures of the start: those given or that of the fluid; None if it has no energy."""
    if not scene.active_effects.energy:
        if value is not None:
            raise ValueError(
                "`temperatures` must be None for a fluid without an energy; make the scene with "
                "effects=sdpd.Effects(energy=True)"
            )
        return None
    return check_temperatures(scene, scene.fluid.temperature if value is None else value)
