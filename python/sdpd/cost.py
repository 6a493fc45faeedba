"""What a scene costs: memory, pairs, time step and its bounds, steps per unit of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sdpd import timestep
from sdpd.integrators import Integrator, resolve
from sdpd.timestep import ExpectedErrors, TimeStepBound
from sdpd.units import quantity, table

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["COEFFICIENTS", "Coefficients", "Cost", "cost"]


@dataclass(frozen=True)
class Coefficients:
    """Measured constants of the estimate, of one core of an ordinary machine.

    Attributes
    ----------
    bytes_per_particle, bytes_per_pair : float
        State, copies and lists.
    pairs_per_second : dict
        By integrator, noise on.
    """

    bytes_per_particle: float
    bytes_per_pair: float
    pairs_per_second: dict[str, float]


# 4e5 (velocity Verlet) and 2e5 (splitting) particle-steps/s at 54 pairs a particle.
COEFFICIENTS = Coefficients(
    bytes_per_particle=420.0,
    bytes_per_pair=8.0,
    pairs_per_second={"velocity_verlet": 2.2e7, "pair_splitting": 1.1e7},
)


@dataclass(frozen=True)
class Cost:
    """The cost of a scene; printable.

    Attributes
    ----------
    memory : float
        Estimate [byte].
    n_particles : int
    pairs_per_particle : float
    integrator : str
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


def cost(scene: Scene, integrator: Integrator | str | None = None, **accuracy: Any) -> Cost:
    """The cost of a scene; `accuracy` are the options of `timestep.bounds`."""
    chosen = resolve(integrator, fluctuations=scene.active_effects.fluctuations)
    bounds = timestep.bounds(scene, chosen, **accuracy)
    dt, number, pairs = bounds[0].value, scene.n_particles, scene.pairs_per_particle
    memory = COEFFICIENTS.bytes_per_particle + COEFFICIENTS.bytes_per_pair * pairs
    seconds = number * pairs / COEFFICIENTS.pairs_per_second[chosen.name]
    return Cost(
        memory=number * memory,
        n_particles=number,
        pairs_per_particle=pairs,
        integrator=chosen.title,
        dt=dt,
        bound=bounds[0],
        bounds=tuple(bounds),
        steps_per_time=1.0 / dt,
        seconds_per_step=seconds,
        seconds_per_time=seconds / dt,
        errors=timestep.expected_errors(scene, dt, chosen),
        si=scene.fluid.is_si,
    )
