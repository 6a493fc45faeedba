"""What a step takes on this machine: measured once by kind of step, kept in the user's cache."""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sdpd import cost, validation
from sdpd.bench.machine import Machine
from sdpd.box import AXES, Box
from sdpd.errors import silenced
from sdpd.initial import LatticeStart, RandomStart
from sdpd.integrators import Integrator, of_scene
from sdpd.resolution import Resolution
from sdpd.walls import Plane, slab

if TYPE_CHECKING:
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["Speed", "cache_file", "kind_of_step", "measure_speed", "speed_of"]

# Particles along an edge and h/dx of the boxes that are timed, by dimension: the first for what a
# step costs whatever its size, the others for particles and pairs.
_BOXES = {2: ((14, 2.4), (36, 2.4), (36, 4.0)), 3: ((6, 2.4), (10, 2.4), (10, 4.0))}
_CURVED = (1000, 3000, 10000)  # particles, where the walls are part of the box that is timed
_MELTING = 60  # steps before the clock starts
_TURN, _ROUNDS = 0.04, 4  # seconds of a turn, turns of each box
# A pair of a large box takes longer, as its particles leave the caches: docs/guide/performance.
_IN_CACHE, _SLOWER = 1e4, 0.1
_SCATTER = 1.2  # predicted over measured time, a factor: docs/guide/accuracy


@dataclass(frozen=True, kw_only=True)
class Speed:
    """Processor time of a step on one thread: a sum over what it works off.

    Attributes
    ----------
    step, particle, pair, wall, lists : float
        For itself, a particle, a pair, a pair of a particle near a wall, and a pair when lists are
        built because the fluid flows (lists of thermal motion count with the pairs) [ns].
    measured : bool
        On this machine; else it is the estimate that the package comes with.
    """

    step: float
    particle: float
    pair: float
    wall: float
    lists: float
    measured: bool

    @property
    def uncertainty(self) -> float:
        """Factor by which predicted times are off, one standard deviation [1]."""
        return _SCATTER if self.measured else 2.0

    def seconds(self, scene: Scene, dt: float, integrator: Integrator | str | None = None) -> float:
        """Of a step of a scene [s]."""
        work = _work(scene, dt, of_scene(scene, integrator), scene.flow_speed or 0.0)
        return 1e-9 * float(work @ (self.step, self.particle, self.pair, self.wall, self.lists))


def _work(scene: Scene, dt: float, integrator: Integrator, speed: float) -> np.ndarray:
    """What a step works off, in the order of the fields of `Speed`, shape (5,)."""
    number = scene.n_particles
    slower = max(1.0, number / _IN_CACHE) ** _SLOWER
    pairs = slower * number * scene.pairs_per_particle
    built = 0.0
    if not scene.active_effects.fluctuations:
        built = min(1.0, 2.0 * speed * dt / cost.margin(scene, dt, integrator))
    return np.array([1.0, slower * number, pairs, _near_walls(scene) * pairs, built * pairs])


def _near_walls(scene: Scene) -> float:
    """Share of the particles within a support of a wall, about."""
    areas = (scene.geometry.area(index) for index in range(len(scene.walls)))
    area = sum(area for area in areas if np.isfinite(area))
    return min(1.0, area * scene.support_radius / scene.fluid_volume) if scene.walls else 0.0


def kind_of_step(
    scene: Scene, integrator: Integrator | str | None = None, precision: str = "double"
) -> str:
    """What decides the cost of a pair: dimension, integrator, effects and precision, in words."""
    active, chosen = scene.active_effects, of_scene(scene, integrator)
    words = [f"{scene.dimension}D", chosen.name if active.dissipation else "no friction"]
    words.append(chosen.noise if active.fluctuations else "no noise")
    if chosen.iterations:
        words.append(f"{chosen.iterations} iterations")
    if chosen.sweeps > 1:
        words.append(f"{chosen.sweeps} sweeps")
    if active.central_friction:
        words.append("central")
    if active.energy:
        words += ["energy", "variable" if active.variable_transport else "constant"]
        words += ["conduction"] * active.conduction
        words += ["books"] * chosen.energy_bookkeeping
        words += ["metropolis"] * getattr(chosen, "metropolis", False)
    if scene.walls:
        words.append(scene.wall_model.name)
        words += sorted({type(wall).__name__ for wall in scene.walls} - {"Plane"})
    if precision != "double":
        words.append(f"{precision} precision")
    return ", ".join(words)


def speed_of(
    scene: Scene,
    integrator: Integrator | str | None = None,
    *,
    precision: str = "double",
    measure: bool = True,
    refresh: bool = False,
) -> Speed:
    """Speed of steps of this kind here: from the cache, else measured in about a second.

    Parameters
    ----------
    scene : Scene
    integrator : Integrator or str, optional
        The default for the scene if None.
    precision : {"double", "mixed"}
    measure : bool
        False: if the cache does not know it, the estimate that the package comes with.
    refresh : bool
        Measure anew.

    Returns
    -------
    Speed
    """
    measure = validation.boolean("measure", measure)
    kind, here = kind_of_step(scene, integrator, precision), _machine()
    known = _read()
    if not validation.boolean("refresh", refresh) and kind in known.get(here, {}):
        return Speed(**known[here][kind], measured=True)
    if not measure:
        return _shipped(scene, integrator)
    speed = measure_speed(scene, integrator, precision)
    numbers = asdict(speed)
    del numbers["measured"]
    known = _read()
    known.setdefault(here, {})[kind] = numbers
    _write(known)
    return speed


def _shipped(scene: Scene, integrator: Integrator | str | None) -> Speed:
    rate = cost.pairs_per_second(scene, of_scene(scene, integrator))
    pair = 1e9 / rate
    return Speed(step=0.0, particle=0.0, pair=pair, wall=pair, lists=0.0, measured=False)


# --- measuring -------------------------------------------------------------------------------


def measure_speed(
    scene: Scene, integrator: Integrator | str | None = None, precision: str = "double"
) -> Speed:
    """Time small boxes of a scene's fluid, in turns; the cache is not touched."""
    chosen = of_scene(scene, integrator)
    sizes = _BOXES[scene.dimension]
    timed = partial(_Box, integrator=chosen, precision=precision)
    boxes = [timed(_patch(scene, edge, support, walls=False)) for edge, support in sizes]
    if scene.walls:
        own = _curved(scene)
        plane = _patch(scene, *sizes[-1], walls=True)
        boxes.append(timed(plane) if own is None else timed(own, builds=None))
    if not scene.active_effects.fluctuations:
        boxes.append(timed(_patch(scene, *sizes[-1], walls=False), builds=0.5))
    found = np.full(len(boxes), np.inf)
    for _ in range(_ROUNDS):
        found = np.minimum(found, [box() for box in boxes])
    table = np.stack([box.work for box in boxes]) / (1e9 * found[:, None])
    from scipy.optimize import nnls

    step, particle, pair, wall, lists = nnls(table, np.ones(len(boxes)))[0].tolist()
    return Speed(step=step, particle=particle, pair=pair, wall=wall, lists=lists, measured=True)


def _patch(scene: Scene, edge: int, support: float, *, walls: bool) -> Scene:
    """A box of so many of the scene's particles along an edge, with two plates if asked."""
    dimension, spacing = scene.dimension, scene.spacing
    box = Box((edge * spacing,) * dimension, periodic=AXES[: dimension - walls])
    around = slab(box, AXES[dimension - 1]) if walls else ()
    with silenced():
        return scene.replace(
            box=box,
            walls=around,
            resolution=Resolution(
                particles=(edge,) * dimension, support=support, kernel=scene.resolution.kernel
            ),
            start=LatticeStart(),
            body_force=None,
            effects=replace(scene.active_effects.settings(), body_force=None),
            sound_speed=scene.sound.speed,
            length_scale=None,
        )


def _curved(scene: Scene) -> Scene | None:
    """The scene itself with about a thousand particles, where its walls are no planes."""
    if all(isinstance(wall, Plane) for wall in scene.walls):
        return None
    support = scene.resolution.support
    for number in _CURVED:
        spacing = (scene.fluid_volume / number) ** (1.0 / scene.dimension)
        with silenced():
            try:
                return scene.replace(
                    resolution=Resolution(
                        spacing=spacing, support=support, kernel=scene.resolution.kernel
                    ),
                    start=RandomStart(),
                    effects=scene.active_effects.settings(),
                    sound_speed=scene.sound.speed,
                )
            except ValueError:  # a support does not fit the wall
                continue
    return None


class _Box:
    """A small box whose steps are timed while it moves as a whole, which builds lists.

    Parameters
    ----------
    scene : Scene
    integrator : Integrator
    precision : str
    builds : float
        How often, in lists a step [1]; of the scene's own flow if None.
    """

    def __init__(
        self, scene: Scene, integrator: Integrator, precision: str, builds: float | None = 0.0
    ) -> None:
        from sdpd.simulation import Simulation

        with silenced():
            self._sim = Simulation(scene, integrator=integrator, precision=precision, threads=1)
        speed = scene.flow_speed or 0.0
        if builds is not None:
            speed = 0.5 * builds * cost.margin(scene, self._sim.dt, integrator) / self._sim.dt
        self._sim.velocities[:, 0] += speed
        self.work = _work(scene, self._sim.dt, integrator, speed)
        self._sim.run(_MELTING, progress=False)
        self._steps = max(4, round(_TURN / max(_timed(self._sim, 4), 1e-7)))

    def __call__(self) -> float:
        """Seconds of a step, measured anew."""
        return _timed(self._sim, self._steps)


def _timed(sim: Simulation, steps: int) -> float:
    """Processor time of a step: what else the machine does is left out."""
    begin = time.process_time()
    sim.run(steps, progress=False)
    return (time.process_time() - begin) / steps


# --- the cache -------------------------------------------------------------------------------


def cache_file() -> Path:
    """Where speeds are kept: ``SDPD_CACHE``, or the folder for caches of the user."""
    given = os.environ.get("SDPD_CACHE")
    if given:
        return Path(given) / "speed.json"
    if sys.platform == "darwin":
        folder = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        folder = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    else:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return folder / "sdpd" / "speed.json"


@lru_cache(maxsize=1)
def _machine() -> str:
    """Processor, its instructions and the version of this package."""
    from sdpd import __version__

    here = Machine.here()
    chosen = os.environ.get("SDPD_INSTRUCTIONS", "widest")
    return f"{here.processor}; {' '.join(here.flags)}; {chosen}; sdpd {__version__}"


def _read() -> dict[str, dict[str, dict[str, float]]]:
    """Empty where there is none, or none that can be read."""
    try:
        found = json.loads(cache_file().read_text(encoding="utf-8"))
        names = {"step", "particle", "pair", "wall", "lists"}
        assert all(set(s) == names for kinds in found.values() for s in kinds.values())
    except (OSError, ValueError, AttributeError, TypeError, AssertionError):
        return {}
    return dict(found)


def _write(known: dict[str, dict[str, dict[str, float]]]) -> None:
    """Aside, then renamed; a folder that cannot be written is no reason to fail."""
    path = cache_file()
    aside = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        aside.replace(path)
    except OSError:
        return
