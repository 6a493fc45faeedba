"""What each effect costs: the same fluid with and without it, taking turns.

And whether an effect that is switched off costs what its absence costs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any, ClassVar

from sdpd import equations_of_state as eos
from sdpd import fluids, kernels, running, timestep, validation
from sdpd.bench.fluid import SHORTEST_EDGE, SPACING, WATER, edges, liquid, simulation, water
from sdpd.bench.machine import Machine
from sdpd.bench.study import Study
from sdpd.bench.turns import Runs, Spread, take_turns
from sdpd.box import Box
from sdpd.effects import Effects, UniformForce
from sdpd.integrators import Integrator, PairSplitting, VelocityVerlet
from sdpd.progress import bar
from sdpd.scene import Scene
from sdpd.units import table
from sdpd.walls import slab

if TYPE_CHECKING:
    from sdpd.observers import Observer
    from sdpd.simulation import Simulation

__all__ = ["Difference", "EffectCosts", "run_effects", "same"]

DEFAULT_SIZE = 3375
SUPPORT = 3.0
ROUNDS = 9
TURN = 0.05  # s, or two steps
EQUAL = 0.01  # relative difference that memory alone may make
FEWEST = 6  # turns to judge by
UNCLEAR = 0.1  # width of the spread beyond which nothing can be told

UNIFORM, GAUSSIAN = VelocityVerlet(noise="uniform"), VelocityVerlet(noise="gaussian")
SPLITTING = PairSplitting()
HOT = fluids.water().replace(equation_of_state=eos.Tait())  # that may have an energy


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Two sides that took turns.

    Attributes
    ----------
    name, base : str
        What one side has and the other has not, and where.
    without, with_it : Spread
        Time of a particle-step [ns].
    cost : Spread
        Their difference, turn by turn [ns].
    low, high : float
        Smallest and largest difference [ns].
    turns : int
        Of each side.
    """

    name: str
    base: str
    without: Spread
    with_it: Spread
    cost: Spread
    low: float
    high: float
    turns: int

    @classmethod
    def of(
        cls, name: str, base: str, without: Sequence[float], with_it: Sequence[float]
    ) -> Difference:
        """From the times of each turn [ns]."""
        costs = [b - a for a, b in zip(without, with_it, strict=True)]
        return cls(
            name=name,
            base=base,
            without=Spread.of(without),
            with_it=Spread.of(with_it),
            cost=Spread.of(costs),
            low=min(costs),
            high=max(costs),
            turns=len(costs),
        )

    @property
    def relative(self) -> float:
        """Median difference over the time without [1]."""
        return self.cost.median / self.without.median


def same(found: Difference) -> bool | None:
    """Whether both sides cost the same; None where turns are too few or too far apart to tell.

    They differ where every turn says so, with one sign, and by more than one per cent in the
    median: by chance that comes once in 2^(n-1) for n turns.
    """
    width = (found.cost.upper - found.cost.lower) / found.without.median
    if found.turns < FEWEST or width > UNCLEAR:
        return None
    one_sign = found.low > 0.0 or found.high < 0.0
    return not (one_sign and abs(found.relative) > EQUAL)


@dataclass(frozen=True, kw_only=True)
class EffectCosts(Study):
    """Cost of each effect, and of effects switched off; ``print`` shows both tables."""

    kind: ClassVar[str] = "effects"

    particles: int
    support: float
    effects: tuple[Difference, ...]
    absent: tuple[Difference, ...]

    @property
    def passed(self) -> bool:
        """Whether no effect that is switched off costs more or less than its absence."""
        return all(same(each) is not False for each in self.absent)

    def document(self) -> dict[str, Any]:
        """Everything as plain data, verdicts included."""
        found = super().document()
        for entry, each in zip(found["absent"], self.absent, strict=True):
            entry["same"] = same(each)
        return found

    def __str__(self) -> str:
        words = {True: "the same", False: "NOT the same", None: "cannot tell"}
        header = ["effect", "compared with", "ns without", "ns with", "it costs, ns", "%"]
        absent = [[*_cells(each), words[same(each)]] for each in self.absent]
        title = (
            f"what each effect costs: ns of a particle-step; {self.particles:,} particles, "
            f"h/dx = {self.support:g}, Lucy unless said otherwise"
        )
        blocks = [
            title,
            table([_cells(each) for each in self.effects], header),
            "switched off, against absent",
            table(absent, [*header, "verdict"]),
        ]
        return "\n\n".join([*blocks, self._foot()])


def _cells(found: Difference) -> list[str]:
    return [
        found.name,
        found.base,
        f"{found.without.median:.0f}",
        f"{found.with_it.median:.0f}",
        found.cost.shown("+.0f"),
        f"{100.0 * found.relative:+.1f}",
    ]


@dataclass(frozen=True)
class _Side:
    """One side of a comparison: a scene, an integrator, and perhaps an observer."""

    scene: Scene
    integrator: Integrator = UNIFORM
    observe: Callable[[], Observer] | None = None
    observed_before: bool = False  # detached again before the turns
    precision: str = "double"


@dataclass(frozen=True)
class _Comparison:
    name: str
    base: str
    without: _Side
    with_it: _Side


def run_effects(
    size: int | None = None,
    *,
    support: float = SUPPORT,
    threads: int = 1,
    rounds: int = ROUNDS,
    quick: bool = False,
    progress: bool | None = None,
) -> EffectCosts:
    """Time each effect by its absence.

    Parameters
    ----------
    size : int, optional
        Number of particles, the cube of an integer; `DEFAULT_SIZE` if None. In a plane there are
        about as many.
    support : float
        h/dx [1].
    threads : int
        Of each simulation.
    rounds : int
        Turns of each side.
    quick : bool
        Turns of a few steps: to try it.
    progress : bool, optional
        Show a progress bar; None: where somebody is likely to look.

    Returns
    -------
    EffectCosts

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    Both sides of a comparison have the same positions and the same time step: the smaller of the
    two that they take by themselves.
    """
    (edge,) = edges([DEFAULT_SIZE if size is None else size])
    ratio = validation.positive("support", support)
    number = running.choose_threads(threads, edge**3)
    turns = validation.integer("rounds", rounds, minimum=1)
    seconds = 0.0 if validation.boolean("quick", quick) else TURN
    begun = perf_counter()
    bench = _Bench(edge, ratio, number, turns, seconds)
    effects, absent = bench.effects(), bench.absent()
    total = len(effects) + len(absent)
    found = []
    with bar(total=total, progress=progress, unit="effect") as shown:
        for each in (*effects, *absent):
            found.append(bench.compare(each))
            shown.update()
    return EffectCosts(
        machine=Machine.here(),
        threads=number,
        rounds=turns,
        seconds=perf_counter() - begun,
        particles=edge**3,
        support=ratio,
        effects=tuple(found[: len(effects)]),
        absent=tuple(found[len(effects) :]),
    )


class _Bench:
    """The comparisons at one size and support."""

    def __init__(
        self, edge: int, support: float, threads: int, rounds: int, seconds: float
    ) -> None:
        self._edge, self._support = edge, support
        self._threads, self._rounds, self._seconds = threads, rounds, seconds
        self._plain = self._water()
        self._start = liquid(self._plain)

    def _water(self, kernel: str = "lucy", **changes: Any) -> Scene:
        return water(self._edge, self._support, kernel, **changes)

    def _hot(self, *, exponents: float = 0.0, **effects: bool) -> Scene:
        fluid = HOT.replace(viscosity_exponent=exponents, conductivity_exponent=exponents)
        return self._water(fluid=fluid, effects=Effects(energy=True, **effects))

    def effects(self) -> list[_Comparison]:
        """Each effect, integrator, kernel and observer."""
        plain, verlet = _Side(self._plain), "Verlet, uniform"
        gaussian, splitting = _Side(self._plain, GAUSSIAN), _Side(self._plain, SPLITTING)
        quiet = _Side(self._water(effects=Effects(fluctuations=False)))
        bare = _Side(self._water(effects=Effects(fluctuations=False, dissipation=False)))
        viscous = WATER.replace(bulk_viscosity=WATER.shear_viscosity)
        bulk = self._water(fluid=viscous)
        heating = self._hot(conduction=False)
        conducting = self._hot()
        variable = self._hot(exponents=0.7)
        box = Box((self._edge * SPACING,) * 3, periodic="xy")
        channel = self._water(box=box, walls=slab(box))
        found = [
            _Comparison("friction", "Verlet, neither", bare, quiet),
            _Comparison("fluctuations, uniform", "Verlet, friction", quiet, plain),
            _Comparison("fluctuations, Gaussian", "Verlet, friction", quiet, gaussian),
            _Comparison("Gaussian for uniform", verlet, plain, gaussian),
            _Comparison("bulk viscosity", verlet, plain, _Side(bulk)),
            _Comparison("bulk viscosity", "splitting", splitting, _Side(bulk, SPLITTING)),
            _Comparison("energy, heating", "splitting", splitting, _Side(heating, SPLITTING)),
            _Comparison(
                "conduction",
                "splitting, energy",
                _Side(heating, SPLITTING),
                _Side(conducting, SPLITTING),
            ),
            _Comparison(
                "coefficients of T",
                "splitting, conduction",
                _Side(conducting, SPLITTING),
                _Side(variable, SPLITTING),
            ),
            _Comparison(
                "accepted or rejected",
                "splitting, conduction",
                _Side(conducting, SPLITTING),
                _Side(conducting, PairSplitting(metropolis=True)),
            ),
            _Comparison("two walls", verlet, plain, _Side(channel)),
            _Comparison("two walls", "splitting", splitting, _Side(channel, SPLITTING)),
        ]
        for name, make in _observers().items():
            seen = _Side(self._plain, observe=make)
            found.append(_Comparison(name, verlet, plain, seen))
        for name in kernels.names():
            if name != "lucy":
                found.append(_Comparison(name, "Verlet, Lucy", plain, _Side(self._water(name))))
        again = VelocityVerlet(iterations=1)
        mixed = [_Side(self._plain, kind, precision="mixed") for kind in (UNIFORM, SPLITTING)]
        found += [
            _Comparison("mixed precision", verlet, plain, mixed[0]),
            _Comparison("mixed precision", "splitting", splitting, mixed[1]),
            _Comparison("friction once more", verlet, plain, _Side(self._plain, again)),
            _Comparison("pair splitting", verlet, plain, splitting),
            _Comparison(
                "splitting, conduction",
                "Verlet, conduction",
                _Side(conducting, VelocityVerlet()),
                _Side(conducting, SPLITTING),
            ),
            _Comparison("D = 3", "D = 2, Verlet", _Side(self._plane()), plain),
        ]
        return found

    def _plane(self) -> Scene:
        """About as many particles in a plane."""
        edge = max(SHORTEST_EDGE, round(self._edge**1.5 / SHORTEST_EDGE) * SHORTEST_EDGE)
        return water(edge, self._support, dimension=2)

    def absent(self) -> list[_Comparison]:
        """Each effect that a scene could have, switched off, against a scene that knows none."""
        plain = self._plain
        bulk = WATER.replace(bulk_viscosity=WATER.shear_viscosity)
        push = UniformForce((1.0, 0.0, 0.0))
        no_bulk = self._water(fluid=bulk, effects=Effects(bulk_viscosity=False))
        no_energy = self._water(fluid=HOT, effects=Effects(energy=False))
        no_force = self._water(body_force=push, effects=Effects(body_force=False))
        cool = HOT.replace(thermal_conductivity=None)
        insulated = self._water(fluid=cool, effects=Effects(energy=True))
        exponents = HOT.replace(viscosity_exponent=0.7, conductivity_exponent=0.7)
        fixed = Effects(energy=True, variable_transport=False)
        pairs = [
            ("bulk viscosity", UNIFORM, plain, no_bulk),
            ("bulk viscosity", SPLITTING, plain, no_bulk),
            ("energy", UNIFORM, plain, no_energy),
            ("energy", SPLITTING, plain, no_energy),
            ("body force", UNIFORM, plain, no_force),
            ("conduction", SPLITTING, insulated, self._hot(conduction=False)),
            (
                "coefficients of T",
                SPLITTING,
                self._hot(),
                self._water(fluid=exponents, effects=fixed),
            ),
        ]
        found = [
            _Comparison(name, kind.title, _Side(without, kind), _Side(off, kind))
            for name, kind, without, off in pairs
        ]
        detached = _Side(plain, observe=_observers()["stress observer"], observed_before=True)
        found.append(_Comparison("stress observer", UNIFORM.title, _Side(plain), detached))
        return found

    def compare(self, each: _Comparison) -> Difference:
        """Let both sides take turns."""
        sides = (each.without, each.with_it)
        dt = min(timestep.auto_time_step(side.scene, side.integrator).value for side in sides)
        runs = {index: self._runs(side, dt) for index, side in enumerate(sides)}
        times = take_turns(runs, self._rounds)
        return Difference.of(each.name, each.base, times[0], times[1])

    def _runs(self, side: _Side, dt: float) -> Runs:
        sim = self._simulation(side, dt)
        observer = None if side.observe is None else side.observe()
        if observer is not None and side.observed_before:
            sim.run(1, observe=observer, progress=False)
            observer = None
        return Runs(sim, self._seconds, observe=observer)

    def _simulation(self, side: _Side, dt: float) -> Simulation:
        """In equilibrium where there are no walls, else as it starts."""
        scene = side.scene
        if scene.walls:
            start = None
        elif scene.dimension == 2:
            start = liquid(scene)
        else:
            start = self._start
        return simulation(
            scene,
            integrator=side.integrator,
            dt=dt,
            threads=self._threads,
            positions=start,
            precision=side.precision,
        )


def _observers() -> dict[str, Callable[[], Observer]]:
    from sdpd.observers import Correlator, CurrentCorrelator, Stress, StressCorrelator

    waves = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    return {
        "stress observer": lambda: Stress(every=1),
        "Correlator": lambda: Correlator(every=1),
        "StressCorrelator": lambda: StressCorrelator(every=1),
        "CurrentCorrelator, 3 waves": lambda: CurrentCorrelator(waves, every=1),
    }
