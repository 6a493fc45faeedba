"""The simulation: particles of a scene, stepped by the compiled core and seen through NumPy."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import (
    compensation,
    failure,
    initial,
    integrators,
    running,
    stepping,
    timestep,
    validation,
    wall_motion,
)
from sdpd.adaptive import AdaptiveStep
from sdpd.errors import SimulationError, TimeStepWarning
from sdpd.observers import LoopObserver, Observer, check_observers
from sdpd.particles import Particles
from sdpd.scene import Scene
from sdpd.time_profile import TimeProfile
from sdpd.timestep import TimeStepBound
from sdpd.units import quantity, table
from sdpd.walls import Wall

if TYPE_CHECKING:
    from ase import Atoms
    from MDAnalysis import Universe

    from sdpd._core import Core
    from sdpd.integrators import Integrator

__all__ = ["Simulation"]

Array = NDArray[np.float64]


class Simulation(Particles):
    """The particles of a scene and what moves them.

    Parameters
    ----------
    scene : Scene
    integrator : PairSplitting, VelocityVerlet or their names, optional
        The exact pair splitting where fluctuations act, else velocity Verlet.
    dt : float, "auto", "adaptive" or AdaptiveStep
        Time step [time]; "auto" takes the smallest of `Simulation.bounds`, "adaptive" chooses it
        anew every ten steps, as `AdaptiveStep` says.
    seed : int
        Key of all randomness, ``0 <= seed < 2**64``.
    threads : int, optional
        Threads of this simulation; the processors at hand if None, but one per 500 particles at
        most. Changes no bit of the result.
    precision : str
        "double", or "mixed": what happens between two particles in single precision, faster; state
        and sums in double, momentum conserved to rounding as ever. Of isothermal fluids.
    skin : float, optional
        Of the pairs that sweeps work on [length], at most the margin of the lists; what should cost
        least, estimated from the scene, if None.
    positions, velocities : array_like, shape (N, D), optional
        Initial state [length], [length/time] instead of that of ``scene.start``. Positions are
        wrapped into the box, and refused where they crowd to 30 times the density of the fluid.
    temperatures : float or array_like, shape (N,), optional
        Of the particles of a fluid with an energy [temperature]; that of the fluid if None.
    temperature_error, resolve_vacf
        Asked accuracy, for the bounds on the time step; see `timestep.bounds`.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Warns
    -----
    TimeStepWarning
        If `dt` is above a bound; names it and its value.

    Notes
    -----
    State and results are NumPy views into the simulation, row i is particle i. ``positions``,
    ``velocities`` and, of a fluid with an energy, ``temperatures`` may be written between runs and
    in callbacks; `run` takes over what changed.
    Everything else is read-only and up to date when `run` returns and before each callback, or
    after `refresh`. Do not touch the arrays from another thread while `run` works.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> sim = sdpd.Simulation(scene, seed=1)
    >>> sim.dt_bound
    'friction'
    >>> sim.run(steps=10)
    >>> sim.step, sim.velocities.shape
    (10, (512, 3))
    """

    def __init__(
        self,
        scene: Scene,
        *,
        integrator: Integrator | str | None = None,
        dt: float | str | AdaptiveStep = "auto",
        seed: int = 0,
        threads: int | None = None,
        precision: str = "double",
        skin: float | None = None,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        temperatures: ArrayLike | None = None,
        temperature_error: float = 0.005,
        resolve_vacf: bool = False,
    ) -> None:
        validation.instance("scene", scene, Scene, "an sdpd.Scene")
        active = scene.active_effects
        chosen = integrators.of_scene(scene, integrator)
        if scene.walls:
            scene.wall_model.check_integrator(scene, chosen)
        seed = validation.integer("seed", seed, minimum=0)
        if seed >= 2**64:
            raise ValueError(f"`seed` must be < 2^64, got {seed}")
        threads = running.choose_threads(threads, scene.n_particles)
        validation.precision(precision, energy=active.energy)
        skin = validation.optional_positive("skin", skin)
        self._accuracy: dict[str, Any] = {
            "temperature_error": temperature_error,
            "resolve_vacf": resolve_vacf,
        }
        self._bounds = tuple(timestep.bounds(scene, chosen, **self._accuracy))
        self._adaptive = _adaptive(dt)
        self._dt = self._started_dt(scene, chosen, dt)
        if positions is None:
            points = initial.positions(scene, seed, threads)
        else:
            points = initial.check_positions(scene, positions)
        if velocities is None:
            speeds = initial.velocities(scene, seed)
        else:
            speeds = initial.check_velocities(scene, velocities)
        noise = chosen.noise if active.fluctuations else "none"
        settings = {
            **scene.core_arguments(),
            "noise": noise,
            "integrator": chosen.name,
            "iterations": chosen.passes,
            "dt": self._dt,
            "seed": seed,
            "skin": skin,
            "precision": precision,
        }
        settings = integrators.with_integrator(settings, chosen)
        heat = initial.temperatures(scene, temperatures)
        core = _new_core(points, speeds, settings, threads, heat)
        if positions is not None:
            initial.check_crowding(scene, core.densities)
        _check_skin(core, skin)
        self._adopt(scene, chosen, settings, threads, core)

    def _adopt(
        self,
        scene: Scene,
        integrator: Integrator,
        settings: dict[str, Any],
        threads: int,
        core: Core,
    ) -> None:
        """Set everything but the time step and its bounds."""
        self._scene, self._integrator = scene, integrator
        self._settings, self._threads, self._core = settings, threads, core
        self._walls = scene.walls
        self._attached: list[tuple[LoopObserver, int, float]] = []
        self._compensated = 0.0  # the dt that the friction of the core is for
        self._runner: int | None = None

    def _started_dt(self, scene: Scene, integrator: Integrator, dt: Any) -> float:
        """A time step to begin with, from what the user may give."""
        if self._adaptive is not None:
            value = self._adaptive.largest or self._bounds[0].value
        else:
            value = (
                self._bounds[0].value if _is_auto(dt) else self._checked_dt(scene, integrator, dt)
            )
        if integrator.compensate:
            compensation.friction_scale(scene, value, sweeps=integrator.sweeps)
        return value

    def _checked_dt(self, scene: Scene, integrator: Integrator, dt: Any) -> float:
        value = validation.positive("dt", dt)
        exceeded = timestep.check_time_step(scene, value, integrator, **self._accuracy)
        if exceeded:
            text = timestep.warning_text(value, exceeded)
            warnings.warn(text, TimeStepWarning, stacklevel=4)
        return value

    # --- what it is --------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self._scene

    @property
    def integrator(self) -> Integrator:
        """The integrator."""
        return self._integrator

    @property
    def seed(self) -> int:
        """Key of all randomness."""
        return int(self._settings["seed"])

    @property
    def threads(self) -> int:
        """Threads of this simulation."""
        return self._threads

    @property
    def precision(self) -> str:
        """Of what happens between two particles: "double" or "mixed"."""
        return str(self._settings.get("precision", "double"))

    @property
    def n_particles(self) -> int:
        """N."""
        return self._scene.n_particles

    def __len__(self) -> int:
        return self.n_particles

    def profile(self, *, reset: bool = False) -> TimeProfile:
        """Where the wall time of the runs has gone, by phase of the step.

        Parameters
        ----------
        reset : bool
            Whether to count from here on.

        Returns
        -------
        TimeProfile
            ``print`` shows it.

        Raises
        ------
        TypeError
            If `reset` is no bool.

        Notes
        -----
        Of all steps since the start or the last reset. The clock is read some ten times a step,
        whatever the number of particles.
        """
        seconds, steps = self._core.profile(validation.boolean("reset", reset))
        return TimeProfile(
            seconds, steps, self.n_particles, self.threads, self._core.instructions()
        )

    @property
    def dt(self) -> float:
        """Time step [time]; may be set between runs, with the same checks, but not in one.

        An adaptive one shows what was chosen last.

        Raises
        ------
        RuntimeError
            If a run is under way, in a callback too: its steps were planned when it began.
        """
        return self._dt

    @dt.setter
    def dt(self, value: float | str | AdaptiveStep) -> None:
        if self._runner is not None:
            raise RuntimeError(
                "`dt` cannot be set while the simulation is running (nor in a callback): set it "
                "between calls of run()"
            )
        before, self._adaptive = self._adaptive, _adaptive(value)
        try:
            self._dt = self._started_dt(self._scene, self._integrator, value)
        except BaseException:
            self._adaptive = before
            raise

    @property
    def adaptive(self) -> AdaptiveStep | None:
        """How the time step is chosen anew; None where it stays."""
        return self._adaptive

    @property
    def dt_bound(self) -> str:
        """Name of the tightest bound, the one that sets ``dt="auto"``."""
        return self._bounds[0].name

    @property
    def bounds(self) -> tuple[TimeStepBound, ...]:
        """All bounds on the time step, smallest first."""
        return self._bounds

    @property
    def step(self) -> int:
        """Steps done."""
        return self._core.step

    @property
    def time(self) -> float:
        """Simulated time [time]."""
        return self._core.time

    # --- walls -------------------------------------------------------------------------------

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The walls of the scene as they move now."""
        return self._walls

    def set_wall_velocity(
        self,
        wall: int,
        velocity: Sequence[float] | float | None = None,
        *,
        angular_velocity: Sequence[float] | float | None = None,
    ) -> None:
        """Let a wall move differently from now on; between runs and in callbacks.

        Parameters
        ----------
        wall : int
            Its index in ``scene.walls``.
        velocity : sequence of float, D of them, or float, optional
            Of a `Plane`, along itself; of a `Cylinder`, along its axis [length/time].
        angular_velocity : float or sequence of float, three, optional
            Of a `Cylinder` or a `Sphere` [1/time].

        Raises
        ------
        TypeError, ValueError
            If the wall cannot move in this way; nothing has changed.
        RuntimeError
            If the simulation is running in another thread.

        Notes
        -----
        What is not given stays as it is. ``scene`` remains what the simulation was made with;
        `walls` shows the present motion, and `save` keeps it. A plate that oscillates is one whose
        velocity is set every step, or every few: between the changes it is constant. Bounds on the
        time step are those of the scene, whose ``velocity_scale`` should foresee the fastest wall.

        Examples
        --------
        >>> import sdpd
        >>> box = sdpd.Box((1e-3, 1e-3), periodic="x")
        >>> scene = sdpd.Scene(
        ...     fluid=sdpd.fluids.water().in_plane(1e-4),
        ...     box=box,
        ...     walls=sdpd.walls.slab(box, "y"),
        ...     resolution=sdpd.Resolution(particles=(16, 16)),
        ... )
        >>> sim = sdpd.Simulation(scene)
        >>> sim.set_wall_velocity(1, (1e-5, 0.0))
        >>> sim.walls[1].speed
        1e-05
        """
        most = len(self._walls) - 1
        if most < 0:
            raise ValueError("`wall` must be that of a wall, and the scene has none")
        index = validation.integer("wall", wall, minimum=0, maximum=most)
        new = wall_motion.moved(
            self._walls[index],
            f"walls[{index}]",
            self._scene.box,
            velocity=velocity,
            angular_velocity=angular_velocity,
        )
        self._move_walls((*self._walls[:index], new, *self._walls[index + 1 :]))

    def _move_walls(self, walls: tuple[Wall, ...]) -> None:
        for index, (old, new) in enumerate(zip(self._walls, walls, strict=True)):
            if wall_motion.motion(new) != wall_motion.motion(old):
                self._core.move_wall(index, new.core(self._scene.box))
        self._walls = walls

    # --- running -----------------------------------------------------------------------------

    def run(
        self,
        steps: int | None = None,
        *,
        time: float | None = None,
        every: int = 1,
        callback: Callable[[Simulation], object] | None = None,
        observe: Observer | Sequence[Observer] = (),
        progress: bool | None = None,
        on_error: str | os.PathLike[str] = "raise",
    ) -> None:
        """Advance the simulation.

        Parameters
        ----------
        steps : int, optional
            Number of steps of `dt`. Exactly one of `steps` and `time`.
        time : float, optional
            Time to simulate [time]: ceil(time/dt) equal steps, of dt or a little less; where dt is
            adaptive, the last steps are a little less.
        every : int
            Steps between calls of `callback` and samples of observers without their own `every`.
            All are due when `step` is a multiple of it.
        callback : callable, optional
            Called with the simulation. May write positions and velocities, save, or raise.
        observe : Observer or sequence of Observer
            `Thermodynamics`, `Correlator`, `h5md.Trajectory` or your own.
        progress : bool, optional
            Show a progress bar; None: on a terminal or in a notebook, after two seconds.
        on_error : "raise", "checkpoint" or path object
            What to do when the run blows up, besides raising: "checkpoint" writes the last good
            state to ``sdpd-step-N.sdpd`` in the working directory, a path object names the file.
            The error carries its name; `load` goes on from there.

        Raises
        ------
        SimulationError
            If a value is no longer finite or a particle runs away, or an adaptive step would have
            to be too small. The arrays then show the last good state.
        KeyboardInterrupt
            At Ctrl-C, after the steps under way (a fifth of a second or one step) are complete:
            the state is that of a whole step and `run` may be called again.
        TypeError, ValueError
            For a bad argument; nothing has changed.
        RuntimeError
            If it is running already.
        """
        plan = running.plan_steps(steps, time, self._dt, adaptive=self._adaptive is not None)
        on_error = failure.check_on_error(on_error)
        every = validation.integer("every", every, minimum=1, maximum=validation.LARGEST)
        if progress is not None:
            progress = validation.boolean("progress", progress)
        if callback is not None and not callable(callback):
            raise TypeError(f"`callback` must be callable, got {type(callback).__name__}")
        observers = check_observers(observe)
        if self._runner is not None:
            raise RuntimeError(
                "the simulation is running already: call run() neither from its own callback nor "
                "from another thread"
            )
        for observer in observers:
            observer.check(self, observer.every or every, plan.dt)
        self._runner = threading.get_ident()
        try:
            stepping.march(self, plan, every, callback, observers, progress)
        except SimulationError as error:
            raise failure.rescue(self, error, on_error) from None
        finally:
            self._runner = None

    def _refuse_restore(self) -> None:
        if self._runner is not None:
            raise RuntimeError("the simulation is running; restore it before or after run()")

    def _set_state(
        self,
        state: dict[str, Any],
        dt: float,
        walls: tuple[Wall, ...],
        adaptive: AdaptiveStep | None,
    ) -> None:
        """Take over a checked state; for `checkpoint`."""
        self._refuse_restore()
        self._core.set_state(state)  # first: it refuses what is not valid, and walls need it
        given = [wall_motion.motion(wall) for wall in walls]
        if given != [wall_motion.motion(wall) for wall in self._walls]:
            self._move_walls(walls)
            self._core.set_state(state)  # their motion has renewed the forces
        stepping.detach(self)
        self._dt, self._adaptive = dt, adaptive

    # --- saving ------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write everything needed to go on bit for bit into one file, atomically.

        Observers and their samples are not contained.
        """
        from sdpd import checkpoint

        checkpoint.save(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, threads: int | None = None) -> Simulation:
        """A simulation from a file that `save` wrote.

        Parameters
        ----------
        path : path
        threads : int, optional
            As for a new simulation; changes no bit of what follows.

        Raises
        ------
        CheckpointError
            If the file is not a whole and valid checkpoint.
        """
        from sdpd import checkpoint

        return checkpoint.load(path, threads=threads)

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Return to the state in a file of this same simulation; the views stay valid.

        Raises
        ------
        CheckpointError
            If the file is not a valid checkpoint or belongs to a simulation of another scene,
            integrator, seed or skin; nothing has changed.
        RuntimeError
            If a run is under way, in a callback too.
        """
        from sdpd import checkpoint

        checkpoint.restore(self, path)

    # --- other programs ----------------------------------------------------------------------

    def to_mdanalysis(self) -> Universe:
        """The present state as an MDAnalysis Universe of one frame; see `interop.to_mdanalysis`."""
        from sdpd import interop

        return interop.to_mdanalysis(self)

    def to_ase(self) -> Atoms:
        """The present state as ASE Atoms; see `interop.to_ase`."""
        from sdpd import interop

        return interop.to_ase(self)

    @classmethod
    def from_ase(cls, atoms: Atoms, scene: Scene, **options: Any) -> Simulation:
        """A simulation that begins with the positions and velocities of ASE Atoms.

        Parameters
        ----------
        atoms : ase.Atoms
            See `interop.from_ase`; without momenta, velocities are those of ``scene.start``.
        scene : Scene
        **options
            Of `Simulation`.
        """
        from sdpd import interop

        state = interop.from_ase(atoms, scene)
        given = {"positions": state.positions, "velocities": state.velocities}
        return cls(scene, **{**given, "temperatures": state.temperatures, **options})

    def __repr__(self) -> str:
        return (
            f"<sdpd.Simulation of {self.n_particles} particles in {self._scene.dimension}D, "
            f"step {self.step}, time {self.time:.6g}>"
        )

    def __str__(self) -> str:
        si = self._scene.fluid.is_si
        dt = quantity(self._dt, "s", si=si)
        tightest = self._bounds[0]
        bound = f"tightest bound {tightest.name} = {quantity(tightest.value, 's', si=si)}"
        temperature = quantity(self.temperature, "K", si=si)
        resolution = self._scene.resolution
        rows = [
            ("particles", f"{self.n_particles} in {self._scene.dimension}D, {resolution.kernel}"),
            ("state", f"step {self.step}, time {quantity(self.time, 's', si=si)}"),
            ("integrator", repr(self._integrator)),
            ("time step", f"{dt}{self._rhythm()}, {bound}"),
            ("precision", self.precision),
            ("effects", str(self._scene.active_effects)),
            ("kinetic", f"temperature {temperature}"),
            *self._thermal_rows(si),
            ("seed", f"{self.seed}, {self._threads} thread{'s' * (self._threads > 1)}"),
        ]
        return "sdpd simulation\n" + table([[f"  {name}", text] for name, text in rows])

    def _rhythm(self) -> str:
        chosen = self._adaptive
        return "" if chosen is None else f" now, chosen anew every {chosen.every} steps"

    def _thermal_rows(self, si: bool) -> list[tuple[str, str]]:
        if not self._scene.active_effects.energy:
            return []
        low, mean, high = (
            quantity(float(value), "K", si=si)
            for value in (
                self.temperatures.min(),
                self.temperatures.mean(),
                self.temperatures.max(),
            )
        )
        return [("internal", f"temperature {mean} in the mean, {low} to {high}")]


def _restored(
    *,
    scene: Scene,
    integrator: Integrator,
    settings: dict[str, Any],
    threads: int,
    core: Core,
    dt: float,
    accuracy: dict[str, Any],
    state: dict[str, Any],
    walls: tuple[Wall, ...],
    adaptive: AdaptiveStep | None,
) -> Simulation:
    """A simulation around a new core, with the state of a file; for `checkpoint`."""
    sim = Simulation.__new__(Simulation)
    sim._accuracy, sim._dt = accuracy, dt
    sim._bounds = tuple(timestep.bounds(scene, integrator, **accuracy))
    sim._adopt(scene, integrator, settings, threads, core)
    sim._set_state(state, dt, walls, adaptive)
    return sim


def _is_auto(dt: Any) -> bool:
    if isinstance(dt, str):
        validation.choice("dt", dt, ("auto", "adaptive"))
        return True
    return False


def _adaptive(dt: Any) -> AdaptiveStep | None:
    if isinstance(dt, AdaptiveStep):
        return dt
    return AdaptiveStep() if isinstance(dt, str) and dt == "adaptive" else None


def _check_skin(core: Core, skin: float | None) -> None:
    """The core takes no more than the margin of its lists; say so rather than take less."""
    if skin is None:
        return
    used, margin = core.statistics()["skin"], core.statistics()["margin"]
    if used < skin * (1.0 - 1e-9):
        raise ValueError(
            f"`skin` must be <= {margin:.6g}, the margin of the lists of this scene and dt, got "
            f"{skin:.6g}; None takes what should cost least"
        )


def _new_core(
    positions: Array,
    velocities: Array,
    settings: dict[str, Any],
    threads: int,
    temperatures: Array | None,
) -> Core:
    from sdpd import _core

    return _core.Core(positions, velocities, threads=threads, temperatures=temperatures, **settings)
