"""The choice of integrator, as plain data handed to the compiled core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from sdpd import validation

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["Integrator", "PairSplitting", "VelocityVerlet"]


class Integrator:
    """Base of the integrators."""

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    iterations: int = 0
    noise: str = "gaussian"
    energy_bookkeeping: bool = True
    compensate: bool = False
    sweeps: int = 1

    @property
    def passes(self) -> int:
        """How often the core repeats its part of friction in a step; 0 where it does it once."""
        return self.iterations if self.sweeps == 1 else self.sweeps


@dataclass(frozen=True, kw_only=True)
class VelocityVerlet(Integrator):
    """Velocity Verlet with the friction evaluated at predicted velocities: the cheapest step.

    With energies it is a Runge-Kutta method of second order for friction and heat, to compare
    `PairSplitting` with: it needs a smaller step, and knows no walls.

    Parameters
    ----------
    iterations : int
        At most 1000, and 0 with energies. Further evaluations of the friction at the end of the
        step. 0: the force of the step serves the next one (Bian et al. 2015, appendix B); 1: once
        with the new velocities; 2 or more: the iteration of Yang 2013, Table 4, S-6 to S-8. They
        cost sweeps and accuracy: the temperature comes out too low by 0.015, 0.27 and 0.52 dt/tau
        (tau: friction time of a particle).
    noise : {"uniform", "gaussian"}
        Variates of the random force: with the right first two moments, which is all a first-order
        scheme sees, or normal.
    energy_bookkeeping : bool
        Where particles have an energy: let each pay for the work of its forces, so that the total
        energy holds to rounding. Without it every particle moves on its adiabat and takes the heat
        of Yang 2013, Table 4, corrected, and the energy rises by some (dt/tau)^3 of the kinetic
        energy a step.
    """

    name: ClassVar[str] = "velocity_verlet"
    title: ClassVar[str] = "velocity Verlet"

    iterations: int = 0
    noise: str = "uniform"
    energy_bookkeeping: bool = True

    def __post_init__(self) -> None:
        books = validation.boolean("energy_bookkeeping", self.energy_bookkeeping)
        object.__setattr__(self, "energy_bookkeeping", books)
        iterations = validation.integer("iterations", self.iterations, minimum=0, maximum=1000)
        object.__setattr__(self, "iterations", iterations)
        validation.choice("noise", self.noise, ("uniform", "gaussian"))


@dataclass(frozen=True, kw_only=True)
class PairSplitting(Integrator):
    """Friction and noise of each pair solved exactly in turn: keeps the Maxwellian at any step.

    Parameters
    ----------
    noise : {"gaussian"}
        Uniform variates would not keep a Maxwellian where dt exceeds the friction time.
    energy_bookkeeping : bool
        Where particles have an energy: take the work of the pressure pair by pair off their
        energies, so that the total energy holds to rounding. Without it every particle moves on its
        adiabat, which costs two sweeps less, and the energy drifts upward.
    metropolis : bool
        Where particles have an energy and there are no walls: accept or reject the exchange of each
        pair, so that the equilibrium of the exchanges is exact at any step, also where particles
        have heat capacities of a few k_B. It costs more than twice as much; without it the
        temperature is right within 0.1 % and its variance within 0.3 % down to 5 k_B.
    compensate : bool
        Without energies: raise the friction, and its noise with it, by what the fluid loses of its
        viscosity at the step, so that it delivers what was asked for; see `compensation`. A step
        where twice the friction would not do is refused: from 36 to 54 tau in 3D, 14 to 18 in 2D.
        The friction of one particle, and with it its short-time diffusion, is changed.
    sweeps : int
        1 to 255; more than one without energies only. Sweeps of exchanges in half a step, each over
        its part of the time: what is delivered is about that of so much shorter steps, at the cost
        of the exchanges alone.
    """

    name: ClassVar[str] = "pair_splitting"
    title: ClassVar[str] = "exact pair splitting"

    noise: str = "gaussian"
    energy_bookkeeping: bool = True
    metropolis: bool = False
    compensate: bool = False
    sweeps: int = 1

    def __post_init__(self) -> None:
        books = validation.boolean("energy_bookkeeping", self.energy_bookkeeping)
        object.__setattr__(self, "energy_bookkeeping", books)
        metropolis = validation.boolean("metropolis", self.metropolis)
        object.__setattr__(self, "metropolis", metropolis)
        compensate = validation.boolean("compensate", self.compensate)
        object.__setattr__(self, "compensate", compensate)
        sweeps = validation.integer("sweeps", self.sweeps, minimum=1, maximum=255)
        object.__setattr__(self, "sweeps", sweeps)
        validation.choice("noise", self.noise, ("gaussian",))


def with_integrator(settings: dict[str, Any], integrator: Integrator) -> dict[str, Any]:
    """Settings of the core with the integrator's word on how energies are kept and exchanged.

    Raises
    ------
    ValueError
        If exchanges cannot be accepted or rejected.
    """
    metropolis = getattr(integrator, "metropolis", False)
    if "thermal" not in settings:
        if metropolis:
            raise ValueError(
                "`metropolis` must be False where particles have no energy: the exchanges of an "
                "isothermal fluid are exact"
            )
        return settings
    books = integrator.energy_bookkeeping
    settings = {**settings, "thermal": {**settings["thermal"], "bookkeeping": books}}
    if metropolis:
        settings["exchanges"] = _metropolis(settings)
    return settings


def _metropolis(settings: dict[str, Any]) -> str:
    """Name of the exchanges with acceptance."""
    base = settings["exchanges"].removesuffix("_variable").removesuffix("_general")
    if settings.get("noise") == "none" or base == "adiabatic":
        raise ValueError("`metropolis` must be False without fluctuations")
    if base.startswith("bath"):
        raise ValueError("`metropolis` must be False without viscous heating")
    if settings.get("walls"):
        raise ValueError("`metropolis` must be False where there are walls")
    return f"{base}_metropolis"


INTEGRATORS: dict[str, type[Integrator]] = {
    "velocity_verlet": VelocityVerlet,
    "pair_splitting": PairSplitting,
}


def resolve(
    integrator: Integrator | str | None, *, fluctuations: bool, energy: bool = False
) -> Integrator:
    """An integrator from an object, a name, or None: splitting with noise or energy, else Verlet.

    Raises
    ------
    ValueError
        If there is no integrator of that name, or it cannot be as it is with energies.
    TypeError
        If it is neither.
    """
    if integrator is None:
        return PairSplitting() if fluctuations or energy else VelocityVerlet()
    if isinstance(integrator, str):
        integrator = INTEGRATORS[validation.choice("integrator", integrator, list(INTEGRATORS))]()
    expected = "sdpd.PairSplitting(), sdpd.VelocityVerlet() or one of their names"
    kinds = (PairSplitting, VelocityVerlet)
    chosen = validation.instance("integrator", integrator, kinds, expected)
    if energy and chosen.iterations > 0:
        raise ValueError(
            "`integrator.iterations` must be 0 where the fluid has an energy: velocity Verlet then "
            f"evaluates all rates twice a step, got {chosen.iterations}"
        )
    if energy and (chosen.compensate or chosen.sweeps > 1):
        raise ValueError(
            "`integrator` must be without `compensate` and with one of `sweeps` where the fluid "
            f"has an energy, got {chosen!r}; take a smaller dt"
        )
    return chosen


def of_scene(scene: Scene, integrator: Integrator | str | None = None) -> Integrator:
    """The integrator of a scene; see `resolve`.

    Raises
    ------
    ValueError
        If it does not know walls that give and take heat.
    """
    active = scene.active_effects
    chosen = resolve(integrator, fluctuations=active.fluctuations, energy=active.energy)
    if scene.walls and active.energy and not isinstance(chosen, PairSplitting):
        raise ValueError(
            "`integrator` must be sdpd.PairSplitting() where a fluid with an energy has walls, got "
            f"{chosen!r}"
        )
    return chosen
