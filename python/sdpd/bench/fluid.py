"""The fluid that is timed: water at the scale of a micrometre, in equilibrium, at any size.

Spacing 1 um/15, Tait with c = 1.2 m/s (m c^2/k_B T = 103), isothermal unless asked otherwise.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import equations_of_state as eos
from sdpd import fluids, initial, validation
from sdpd.box import Box
from sdpd.errors import silenced
from sdpd.fluids import Fluid
from sdpd.initial import RandomStart
from sdpd.integrators import Integrator
from sdpd.resolution import Resolution
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["SOUND_SPEED", "SPACING", "WATER", "Step", "edges", "liquid", "simulation", "water"]

Array = NDArray[np.float64]

SPACING = 1e-6 / 15.0  # m
SOUND_SPEED = 1.2  # m/s
SHORTEST_EDGE, LARGEST_PATTERN = 8, 20  # particles
SETTLING = 20  # steps of the pair splitting, each about two friction times
# Without a heat capacity or a conductivity: nothing of an energy can be switched on.
WATER = fluids.water().replace(
    equation_of_state=eos.Tait(), heat_capacity=None, thermal_conductivity=None
)


@dataclass(frozen=True)
class Step:
    """A kind of step that is timed.

    Attributes
    ----------
    integrator : Integrator
    noisy : bool
        Whether there are fluctuations.
    kernel, precision : str
    """

    integrator: Integrator
    noisy: bool = True
    kernel: str = "lucy"
    precision: str = "double"


def edges(sizes: Iterable[int]) -> tuple[int, ...]:
    """Particles along an edge of each size.

    Raises
    ------
    TypeError, ValueError
        If there is none, or one is not the cube of an integer of at least 8.
    """
    found = []
    for size in sizes:
        number = validation.integer("sizes", size, minimum=1)
        edge = round(number ** (1.0 / 3.0))
        if edge**3 != number or edge < SHORTEST_EDGE:
            raise ValueError(
                f"`sizes` must be cubes of integers >= {SHORTEST_EDGE} (512, 3375, 32768, ...), "
                f"got {number}"
            )
        found.append(edge)
    if not found:
        raise ValueError("`sizes` must name at least one number of particles, got none")
    return tuple(found)


def water(
    edge: int,
    support: float,
    kernel: str = "lucy",
    *,
    dimension: int = 3,
    fluid: Fluid = WATER,
    **changes: Any,
) -> Scene:
    """A cube or square of water, `edge` particles long.

    Parameters
    ----------
    edge : int
    support : float
        h/dx [1].
    kernel : str
    dimension : int
        In a plane the fluid is that of a layer, one spacing thick.
    fluid : Fluid
        Of three dimensions.
    **changes
        Of `Scene`.
    """
    arguments = {
        "fluid": fluid if dimension == 3 else fluid.in_plane(SPACING),
        "box": Box((edge * SPACING,) * dimension),
        "resolution": Resolution(particles=(edge,) * dimension, kernel=kernel, support=support),
        "start": RandomStart(),
        "sound_speed": SOUND_SPEED,
        **changes,
    }
    with silenced():  # what is timed need not be the best scene
        return Scene(**arguments)


def simulation(scene: Scene, **options: Any) -> Simulation:
    """Of what is timed, without a warning; seed 2 unless told otherwise.

    Parameters
    ----------
    scene : Scene
    **options
        Of `Simulation`.
    """
    from sdpd.simulation import Simulation

    with silenced():
        return Simulation(scene, **{"seed": 2, **options})


def liquid(scene: Scene, *, settling: int = SETTLING) -> Array:
    """Positions in equilibrium [m], shape (N, D), of a periodic scene of `water`.

    A smaller box whose edge divides that of the scene, relaxed and run for some steps, side by side
    with itself: as disordered as any fluid, and as quick to make at a million particles.
    """
    edge, dimension = round(scene.box.lengths[0] / SPACING), scene.dimension
    small = _pattern_edge(edge)
    pattern = scene.replace(
        box=Box((small * SPACING,) * dimension),
        resolution=Resolution(
            particles=(small,) * dimension,
            kernel=scene.resolution.kernel,
            support=scene.resolution.support,
        ),
    )
    start = SPACING * _disorder(small, dimension)
    sim = simulation(pattern, seed=1, threads=1, positions=start)
    sim.run(settling, progress=False)
    places = itertools.product(range(edge // small), repeat=dimension)
    return np.concatenate([sim.positions + small * SPACING * np.array(place) for place in places])


def _pattern_edge(edge: int) -> int:
    """The longest divisor of an edge that is long enough and not too long; else the edge."""
    fitting = [n for n in range(SHORTEST_EDGE, LARGEST_PATTERN + 1) if edge % n == 0]
    return max(fitting, default=edge)


@lru_cache(maxsize=8)
def _disorder(edge: int, dimension: int) -> Array:
    """Relaxed random positions, in spacings: the same for every kernel."""
    scene = water(edge, min(2.4, 0.5 * edge), dimension=dimension)
    return initial.positions(scene, 1) / SPACING
