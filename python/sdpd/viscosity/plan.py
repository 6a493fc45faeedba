"""How large a sample, how long to run it, over which lags, and how weak the force.

Pressure forces relax as slowly as the friction is strong, and lags must outlast them: where the
work does not allow that, the viscosity is that of shorter times, and the report says what is still
to come.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sdpd import timestep, validation
from sdpd.analysis import allowed_wave_vectors
from sdpd.analysis.fourier import shells
from sdpd.box import AXES, Box
from sdpd.effects import SinusoidalForce
from sdpd.errors import ResolutionWarning
from sdpd.initial import RandomStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.viscosity.predictions import friction_theory, viscosity_theory

__all__ = ["Plan", "check_scene", "plan_scene", "sample_scene"]

BLOCKS = 32
MOST_PARTICLES = {2: 1024, 3: 1000}
PAIRS = 6e8  # pairs visited in both runs together; some 50 s of one ordinary core
QUICK_SHARE = 0.12
FORCED_SHARE = 0.3  # of the steps
SAMPLES = 24  # arrangements looked at
POINTS = 64  # equally spaced lags of the correlators
LEVELS = 3
MOST_POINTS = 1024  # of the currents
MOST_VECTORS = 13
LARGEST_KH = 4.0
FASTEST_DECAY = 0.6  # of a wave in one step, beyond which it is no eigenmode of the steps
UNRELAXED = 0.05  # share of what pressure forces add that the window may miss
WEISSENBERG = 0.1  # shear rate of the forced flow times the relaxation time of the stress
FASTEST = 0.25  # amplitude of the forced flow at most, in thermal speeds


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Two runs of a sample: one at equilibrium, one under a weak sinusoidal force.

    Parameters
    ----------
    dt : float
        Time step of the pair splitting [time], > 0.
    equilibration : int
        Steps before the first sample of either run, >= 0.
    steps, forced_steps : int
        Steps sampled, >= 8 times `blocks`.
    blocks : int
        Behind every standard error, >= 8.
    wave_vectors : ndarray of int, shape (K, D)
        n of k = 2 pi n/L, whole shells.
    current_every, stress_every, arrangement_every, forced_every : int
        Steps between samples, >= 1.
    current_points, current_levels : int
        Lags of the currents, see `sdpd.CurrentCorrelator`.
    current_lag : float
        Last lag of the integral of the transverse currents [time].
    stress_window : tuple of float
        First and last lag of the fit to the Helfand moment [time].
    force : SinusoidalForce
        Of the forced run.
    """

    dt: float
    equilibration: int
    steps: int
    forced_steps: int
    blocks: int = BLOCKS
    wave_vectors: NDArray[np.int64]
    current_every: int
    current_points: int
    current_levels: int
    stress_every: int
    arrangement_every: int
    forced_every: int
    current_lag: float
    stress_window: tuple[float, float]
    force: SinusoidalForce

    def __post_init__(self) -> None:
        validation.positive("dt", self.dt)
        validation.integer("equilibration", self.equilibration, minimum=0)
        validation.integer("blocks", self.blocks, minimum=8)
        for name in ("steps", "forced_steps"):
            validation.integer(name, getattr(self, name), minimum=8 * self.blocks)
        for kind in ("current", "stress", "arrangement", "forced"):
            validation.integer(f"{kind}_every", getattr(self, f"{kind}_every"), minimum=1)
        validation.integer("current_points", self.current_points, minimum=4)
        validation.integer("current_levels", self.current_levels, minimum=1)
        validation.positive("current_lag", self.current_lag)
        first, last = self.stress_window
        if not 0.0 <= first < last:
            raise ValueError(f"`stress_window` must ascend from >= 0, got {self.stress_window}")
        validation.instance("force", self.force, SinusoidalForce, "an sdpd.SinusoidalForce")

    def forced_wave_number(self, scene: Scene) -> float:
        """k of the force [1/length]."""
        length = scene.box.lengths[AXES.index(self.force.along)]
        return 2.0 * math.pi * self.force.wavenumber / length


def check_scene(scene: Scene) -> None:
    """Refuse a scene whose viscosity cannot be measured.

    Raises
    ------
    ValueError
        Without viscosity, without noise, beyond the pairing limit, or with an energy that friction
        does not feed.
    """
    active = scene.active_effects
    if not active.dissipation or scene.fluid.shear_viscosity == 0.0:
        raise ValueError("`scene` must have a shear viscosity, got one without")
    if not active.fluctuations:
        raise ValueError(
            "`scene` must have thermal fluctuations, got one without: what it delivers is the "
            "lattice's, see sdpd.viscosity.measure_lattice"
        )
    if active.energy and not active.viscous_heating:
        raise ValueError(
            "`scene` must have viscous heating where its fluid has an energy, got none: the "
            "temperature would not hold"
        )
    if scene.pairing[0] >= 1.0:
        raise ValueError(
            "`scene` must be within the pairing limit of its kernel and equation of state, got "
            f"X = {scene.stiffness:.4g}, {scene.pairing[0]:.3g} of it: particles clump and flow "
            "like no fluid"
        )


def sample_scene(scene: Scene, *, particles: int | None = None) -> Scene:
    """The fluid of a scene at equilibrium, in a periodic box of a size that can be measured.

    Parameters
    ----------
    scene : Scene
    particles : int, optional
        In a cube (square) of them; if None the box of the scene, or a cube of 1000 (a square of
        1024) where that is larger or has walls.

    Returns
    -------
    Scene
        From a relaxed random start, without walls and body force, with the sound speed of `scene`,
        and with an energy where `scene` has one.
    """
    most = MOST_PARTICLES[scene.dimension]
    number = None if particles is None else validation.integer("particles", particles, minimum=2)
    box, own = scene.box, scene.n_particles
    if number is None and (own > most or scene.walls):
        number = max(most, math.ceil((2.0 * scene.resolution.support) ** scene.dimension * 1.001))
    if number is not None:
        edge = scene.spacing * number ** (1.0 / scene.dimension)
        box, own = Box((edge,) * scene.dimension), number
    law = scene.fluid.equation_of_state
    given = law.sound_speed is not None or law.kind in ("polynomial", "table")
    resolution = Resolution(
        particles=own, kernel=scene.resolution.kernel, support=scene.resolution.support
    )
    with warnings.catch_warnings():  # the scene itself has warned
        warnings.simplefilter("ignore", ResolutionWarning)
        return scene.replace(
            box=box,
            resolution=resolution,
            start=RandomStart(),
            effects=replace(
                scene.settled_effects, body_force=None, energy=scene.active_effects.energy
            ),
            body_force=None,
            walls=(),
            sound_speed=None if given else scene.sound.speed,
            velocity_scale=None,
            length_scale=None,
        )


def plan_scene(
    scene: Scene,
    *,
    dt: float | str = "auto",
    time_factor: float = 1.0,
    quick: bool = False,
) -> Plan:
    """Plan both runs of a sample by the work they take, so that results do not depend on the clock.

    Parameters
    ----------
    scene : Scene
        From `sample_scene`.
    dt : float or "auto"
        Time step [time]; "auto" is that of a simulation of the scene.
    time_factor : float
        Longer or shorter than the default, > 0.
    quick : bool
        An eighth of the work: seconds, with larger errors.

    Returns
    -------
    Plan
    """
    check_scene(scene)
    factor = validation.positive("time_factor", time_factor)
    if isinstance(dt, str):
        validation.choice("dt", dt, ("auto",))
        step = timestep.auto_time_step(scene, "pair_splitting").value
    else:
        step = validation.positive("dt", dt)
    work = PAIRS * factor * (QUICK_SHARE if quick else 1.0)
    every_step = scene.n_particles * scene.pairs_per_particle
    total = max(64 * BLOCKS, int(work / every_step))
    forced = int(FORCED_SHARE * total)
    steps = total - forced
    relaxed, stress_time = _relaxation(scene, step)
    vectors, lengths = _wave_vectors(scene, step)
    slowest, fastest = friction_theory(scene).plane_wave_rates(lengths)[0][[0, -1]]
    last = min(2.0 * relaxed, steps * step / (1.5 * BLOCKS))
    current = min(max(5.0 / slowest, relaxed), steps * step / (1.5 * BLOCKS))
    # Samples must resolve the fastest decay however far the lags reach: half of an unresolved
    # function is its value at lag 0. Levels of lags take origins further apart than the decay, so
    # that the noise of the integral grows: there are many lags on the first.
    current_every = max(1, int(0.2 / (fastest * step)))
    lags = current / (current_every * step)
    current_points = min(MOST_POINTS, max(POINTS, 2 * math.ceil(0.5 * lags) + 2))
    reach = lags / (current_points - 1)
    return Plan(
        dt=step,
        equilibration=max(200, min(int(3.0 * relaxed / step), steps // 4)),
        steps=steps,
        forced_steps=forced,
        wave_vectors=vectors,
        current_every=current_every,
        current_points=current_points,
        current_levels=1 + max(0, math.ceil(math.log2(reach))),
        stress_every=max(1, round(last / ((POINTS - 2) * step))),
        arrangement_every=max(1, steps // SAMPLES),
        forced_every=max(1, int(0.3 / (slowest * step))),
        current_lag=current,
        stress_window=(0.5 * last, last),
        force=_force(scene, stress_time),
    )


def _relaxation(scene: Scene, dt: float) -> tuple[float, float]:
    """Lag after which the stress has relaxed, and its mean relaxation time."""
    theory = viscosity_theory(scene, dt)
    return theory.relaxation_time(UNRELAXED), theory.stress_time


def _wave_vectors(scene: Scene, dt: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The shortest whole shells whose decay the steps resolve, and their wave numbers."""
    box = np.asarray(scene.box.lengths)
    lowest = 2.0 * np.pi / box.max()
    reach = max(LARGEST_KH / scene.support_radius, 1.01 * lowest)
    vectors = allowed_wave_vectors(box, reach)
    number, sizes = shells(np.linalg.norm(2.0 * np.pi * vectors / box, axis=1))
    ends = np.cumsum(sizes)
    decay = dt * friction_theory(scene).plane_wave_rates(number)[0]
    if decay[0] > FASTEST_DECAY:
        raise ValueError(
            f"`dt` must be <= {dt * FASTEST_DECAY / decay[0]:.4g}, so that steps resolve the decay "
            f"of the longest wave of the box, got {dt:.4g}; or take a larger box or more "
            "`particles`"
        )
    seen = int(np.searchsorted(decay, FASTEST_DECAY, side="right"))
    whole = min(seen, max(1, int(np.searchsorted(ends, MOST_VECTORS, side="right"))))
    return vectors[: ends[whole - 1]], number[:whole]


def _force(scene: Scene, stress_time: float) -> SinusoidalForce:
    """Along the longest edge, so weak that the flow does not disturb the structure."""
    lengths = scene.box.lengths
    along = int(np.argmax(lengths))
    direction = (along + 1) % scene.dimension
    k = 2.0 * math.pi / lengths[along]
    speed = min(FASTEST * scene.thermal_speed, WEISSENBERG / (k * stress_time))
    rate = float(friction_theory(scene).plane_wave_rates(k)[0])
    return SinusoidalForce(
        amplitude=speed * rate, direction=AXES[direction], along=AXES[along], wavenumber=1
    )
