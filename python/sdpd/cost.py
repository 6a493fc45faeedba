"""What a scene costs: memory, pairs, time step and its bounds, steps per unit of time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from sdpd import timestep, validation
from sdpd.box import AXES
from sdpd.integrators import Integrator, of_scene
from sdpd.timestep import ExpectedErrors, TimeStepBound
from sdpd.units import quantity, table

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = [
    "COEFFICIENTS",
    "Coefficients",
    "Cost",
    "cost",
    "margin",
    "pairs_per_second",
    "widths",
]


@dataclass(frozen=True)
class Coefficients:
    """Measured constants of the estimate, of one core of a server of 2024 with AVX-512.

    Attributes
    ----------
    bytes_per_particle : float
        State and copies.
    bytes_per_listed_pair : float
        Pairs in the margin of the lists included.
    pairs_per_second : dict
        By variate; without noise as with the cheapest.
    """

    bytes_per_particle: float
    bytes_per_listed_pair: float
    pairs_per_second: dict[str, float]


COEFFICIENTS = {
    "velocity_verlet": {
        "double": Coefficients(345.0, 4.0, {"gaussian": 1.3e8, "uniform": 1.6e8}),
        "mixed": Coefficients(385.0, 4.0, {"gaussian": 1.8e8, "uniform": 2.4e8}),
    },
    "pair_splitting": {
        "double": Coefficients(330.0, 9.0, {"gaussian": 3.1e7}),
        "mixed": Coefficients(405.0, 9.0, {"gaussian": 4.0e7}),
    },
}
# What one more sweep in each half step of the splitting takes of a step with one.
SWEEP_SHARE = 0.7
# Where the skin is less than the margin there is a second list, of the pairs within it
# (src/neighbor/list.rs), which takes so much of a listed pair, and positions from which to count.
# Up to so wide a margin [support] mixed precision has clusters of particles in space
# (src/sweep/precision.rs), which take so much.
BYTES_OF_NEAR_PAIRS = 4.4
BYTES_OF_REFERENCE = 24.0
CLUSTERED = 0.15
BYTES_OF_CLUSTERS = 60.0
BYTES_OF_CLUSTERED_PAIRS = 1.0
# Verlet keeps the friction apart from the other forces to evaluate it again.
BYTES_FOR_ITERATIONS = 64.0
# A step with energies over one without, with constant and with variable coefficients
# (docs/theory/energy), and what they take of a particle: four fields, three arrays of the user, two
# sums, and the second force array that lends its memory; what Verlet carries over the drift.
ENERGY = {
    "pair_splitting": {"gaussian": (1.9, 5.4)},
    "velocity_verlet": {"gaussian": (4.9, 12.6), "uniform": (5.0, 14.7)},
}
BYTES_FOR_ENERGY = {"pair_splitting": 136.0, "velocity_verlet": 168.0}


def _coefficients(scene: Scene, integrator: Integrator, precision: str) -> Coefficients:
    """Without friction the splitting has nothing to exchange: it keeps one list, as Verlet does."""
    active = scene.active_effects
    name = integrator.name if active.dissipation or active.conduction else "velocity_verlet"
    found = COEFFICIENTS[name][precision]
    if not active.energy and integrator.sweeps == 1:
        return found
    if not active.energy:
        more = 1.0 + SWEEP_SHARE * (integrator.sweeps - 1)
        rates = {noise: rate / more for noise, rate in found.pairs_per_second.items()}
        return replace(found, pairs_per_second=rates)
    slower = ENERGY[integrator.name]
    rates = {
        noise: rate / slower.get(noise, slower["gaussian"])[active.variable_transport]
        for noise, rate in found.pairs_per_second.items()
    }
    return Coefficients(
        found.bytes_per_particle + BYTES_FOR_ENERGY[integrator.name],
        found.bytes_per_listed_pair,
        rates,
    )


def pairs_per_second(scene: Scene, integrator: Integrator, precision: str = "double") -> float:
    """Pairs that a step works off per second of one core, an estimate [1/s]."""
    rates = _coefficients(scene, integrator, precision).pairs_per_second
    noisy = scene.active_effects.fluctuations
    return rates[integrator.noise] if noisy else max(rates.values())


# The core keeps this much room beyond walls, in supports: more than a support and any margin.
_BEYOND = 1.7


def _edges(scene: Scene) -> list[float]:
    """Edges of the core's box: with room beyond the walls where it is not periodic."""
    h, turns = scene.support_radius, scene.box.periodic_axes
    pairs = zip(AXES, scene.box.lengths, strict=False)
    return [length if axis in turns else length + _BEYOND * h for axis, length in pairs]


def _speed_of_start(scene: Scene) -> float:
    """Median speed of the fastest of all particles that start with thermal motion none drives."""
    if scene.active_effects.fluctuations or not scene.starts_thermal:
        return 0.0
    from scipy.stats import chi

    fastest = chi.isf(math.log(2.0) / scene.n_particles, scene.dimension)
    return scene.thermal_speed * float(fastest)


def margin(scene: Scene, dt: float, integrator: Integrator | str | None = None) -> float:
    """Margin of the lists that the core will choose [length]; see `widths`."""
    return widths(scene, dt, integrator)[0]


def widths(
    scene: Scene, dt: float, integrator: Integrator | str | None = None
) -> tuple[float, float]:
    """Margin and skin that the core will choose.

    Parameters
    ----------
    scene : Scene
    dt : float
        [time].
    integrator : Integrator or str, optional
        The default for the scene if None.

    Returns
    -------
    tuple of float
        How much wider than the support lists are, and those of their pairs that sweeps work on
        [length].
    """
    from sdpd import _core

    active = scene.active_effects
    chosen = of_scene(scene, integrator)
    d, h = scene.dimension, scene.support_radius
    rate = scene.friction_across + scene.friction_along / d
    # int F dV = 12/h^2, about right for every kernel, as in the core.
    tau = scene.fluid.density * h**2 / (12.0 * rate) if rate > 0.0 else math.inf
    margin, skin = _core.list_margins(
        particles=scene.n_particles,
        dimension=d,
        shortest_edge=min(_edges(scene)[1:]) / h,
        dt=dt,
        thermal_speed=scene.thermal_speed / h if active.fluctuations else 0.0,
        flow_speed=max(scene.flow_speed or 0.0, _speed_of_start(scene)) / h,
        friction_time=tau,
        shuffles=chosen.name == "pair_splitting" and (rate > 0.0 or active.conduction),
    )
    return h * margin, h * skin


@dataclass(frozen=True)
class Cost:
    """The cost of a scene; printable.

    Attributes
    ----------
    memory : float
        Estimate [byte], of state and lists; a `Correlator` needs its own.
    n_particles : int
    pairs_per_particle : float
    integrator : str
    precision : {"double", "mixed"}
        Of what happens between two particles.
    dt : float
        The time step ``dt="auto"`` picks [time].
    bound : TimeStepBound
        The bound that set it.
    bounds : tuple of TimeStepBound
        All, smallest first.
    steps_per_time : float
        [1/time].
    seconds_per_step : float
        Wall time of a step on one core, an estimate [s].
    seconds_per_time : float
        Wall time per unit of simulated time on one core [s/time].
    errors : ExpectedErrors
        What this time step is expected to do to temperature, viscosity and density.
    si : bool
        Whether to print SI units.
    """

    memory: float
    n_particles: int
    pairs_per_particle: float
    integrator: str
    precision: str
    dt: float
    bound: TimeStepBound
    bounds: tuple[TimeStepBound, ...]
    steps_per_time: float
    seconds_per_step: float
    seconds_per_time: float
    errors: ExpectedErrors
    si: bool

    def __str__(self) -> str:
        rows = [
            ["  integrator", self.integrator],
            ["  precision", self.precision],
            ["  particles", f"{self.n_particles}, {self.pairs_per_particle:.1f} pairs each"],
            ["  memory", _bytes(self.memory) + " (estimate)"],
            ["  time step", f"{quantity(self.dt, 's', si=self.si)}, set by {self.bound.name}"],
            ["  steps", quantity(self.steps_per_time, "per simulated second", si=self.si)],
            ["  one step", f"{self.seconds_per_step:.3g} s on one core (estimate)"],
            ["  errors", f"expected at this time step: {self.errors}"],
        ]
        shown = [
            [f"  {bound.name}", bound.kind, quantity(bound.value, "s", si=self.si), bound.formula]
            for bound in self.bounds
        ]
        return (
            "cost of the scene\n"
            + table(rows)
            + "\nbounds on the time step\n"
            + table(shown, header=["  bound", "kind", "value", "formula"])
        )


def _bytes(number: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if number < 1000.0:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} TB"


def cost(
    scene: Scene,
    integrator: Integrator | str | None = None,
    precision: str | None = None,
    **accuracy: Any,
) -> Cost:
    """The cost of a scene; `accuracy` are the options of `timestep.bounds`."""
    chosen, active = of_scene(scene, integrator), scene.active_effects
    asked = "double" if precision is None else precision
    kind = validation.precision(asked, energy=active.energy)
    bounds = timestep.bounds(scene, chosen, **accuracy)
    dt, number, pairs = bounds[0].value, scene.n_particles, scene.pairs_per_particle
    memory = _bytes_per_particle(scene, chosen, kind, dt)
    seconds = number * pairs / pairs_per_second(scene, chosen, kind)
    return Cost(
        memory=number * memory,
        n_particles=number,
        pairs_per_particle=pairs,
        integrator=chosen.title,
        precision=kind,
        dt=dt,
        bound=bounds[0],
        bounds=tuple(bounds),
        steps_per_time=1.0 / dt,
        seconds_per_step=seconds,
        seconds_per_time=seconds / dt,
        errors=timestep.expected_errors(scene, dt, chosen),
        si=scene.fluid.is_si,
    )


def _bytes_per_particle(scene: Scene, integrator: Integrator, precision: str, dt: float) -> float:
    """State and lists."""
    margin, skin = (width / scene.support_radius for width in widths(scene, dt, integrator))
    listed = scene.pairs_per_particle * (1.0 + margin) ** scene.dimension
    coefficients = _coefficients(scene, integrator, precision)
    found = coefficients.bytes_per_particle + coefficients.bytes_per_listed_pair * listed
    if skin < margin:
        found += BYTES_OF_REFERENCE + BYTES_OF_NEAR_PAIRS * listed
    # in a plane there are no clusters
    if precision == "mixed" and scene.dimension == 3 and margin <= CLUSTERED + 1e-9:
        found += BYTES_OF_CLUSTERS + BYTES_OF_CLUSTERED_PAIRS * listed
    return found + BYTES_FOR_ITERATIONS * (integrator.iterations > 0)
