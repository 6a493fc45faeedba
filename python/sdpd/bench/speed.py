"""Full steps by number of particles, support, kernel and integrator; parts of a step; lists."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, ClassVar

from sdpd import kernels as kernel_table
from sdpd import running, validation
from sdpd.bench.fluid import edges, liquid, simulation, water
from sdpd.bench.machine import Machine
from sdpd.bench.parts import Part, measure_parts
from sdpd.bench.study import Study
from sdpd.bench.turns import Lists, Runs, Spread, take_turns
from sdpd.effects import Effects
from sdpd.integrators import Integrator, PairSplitting, VelocityVerlet
from sdpd.progress import bar, wanted
from sdpd.units import table

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["DEFAULT_SIZES", "STEPS", "SUPPORTS", "Row", "Speed", "run_speed"]

DEFAULT_SIZES = (3375, 32768, 216000)
SUPPORTS = (2.4, 3.0)
ROUNDS = 5
TURN = 0.2  # s, as long as a call of the core from a run
SMALL, SMALLEST = 15, 8  # particles along an edge of the box in which lists are watched
FLAT = 1.2  # largest over smallest cost of a particle-step that still counts as flat in N
# name -> integrator, fluctuations
STEPS: dict[str, tuple[Integrator, bool]] = {
    "Verlet, uniform noise": (VelocityVerlet(noise="uniform"), True),
    "Verlet, Gaussian noise": (VelocityVerlet(noise="gaussian"), True),
    "Verlet, no noise": (VelocityVerlet(), False),
    "pair splitting": (PairSplitting(), True),
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """Speed of one kind of step.

    Attributes
    ----------
    particles : int
    support : float
        h/dx [1].
    kernel : str
    pairs : float
        A particle, each pair counted once.
    step : str
        Of `STEPS`.
    dt_over_tau : float
        Time step over the friction time of a particle [1].
    lists : Lists
        How often they are built, and at what cost, in a small box.
    time : Spread
        Of a particle-step [ns].
    bytes_per_particle : float
        Of state and lists.
    """

    particles: int
    support: float
    kernel: str
    pairs: float
    step: str
    dt_over_tau: float
    lists: Lists
    time: Spread
    bytes_per_particle: float

    @property
    def rate(self) -> Spread:
        """Particle-steps a second, all threads together [1/s]."""
        return self.time.inverse(1e9)

    @property
    def time_per_pair(self) -> Spread:
        """Of a pair and step [ns]."""
        return self.time.scaled(1.0 / self.pairs)


@dataclass(frozen=True, kw_only=True)
class Speed(Study):
    """Speed of steps and of their parts; ``print`` shows the tables."""

    kind: ClassVar[str] = "speed"

    rows: tuple[Row, ...]
    parts: tuple[Part, ...]

    def flatness(self) -> dict[tuple[str, str, float], float]:
        """Largest over smallest cost of a particle-step by step, kernel and support."""
        found: dict[tuple[str, str, float], list[float]] = {}
        for row in self.rows:
            found.setdefault((row.step, row.kernel, row.support), []).append(row.time.median)
        return {key: max(times) / min(times) for key, times in found.items()}

    def document(self) -> dict[str, object]:
        """Everything as plain data, flatness included."""
        flat = [
            {"step": step, "kernel": kernel, "support": support, "largest_over_smallest": ratio}
            for (step, kernel, support), ratio in self.flatness().items()
        ]
        return {**super().document(), "flatness": flat}

    def __str__(self) -> str:
        header = ["N", "h/dx", "kernel", "step", "M particle-steps/s", "ns", "ns/pair"]
        header += ["dt/tau", "steps a list", "ns a list", "bytes"]
        rows = [
            [
                f"{row.particles:,}",
                f"{row.support:g} ({row.pairs:.0f})",
                row.kernel,
                row.step,
                row.rate.scaled(1e-6).shown(),
                f"{row.time.median:.0f}",
                f"{row.time_per_pair.median:.2f}",
                f"{row.dt_over_tau:.3f}",
                f"{row.lists.interval:.0f}",
                f"{row.lists.cost:.0f}",
                f"{row.bytes_per_particle:.0f}",
            ]
            for row in self.rows
        ]
        parts = [
            [f"{part.particles:,}", f"{part.support:g}", part.name, *part.cells()]
            for part in self.parts
        ]
        blocks = [
            "full steps, each at its own time step; ns of a particle-step, bytes of a particle",
            table(rows, header),
            "parts of a Verlet step by differences; ns of a particle",
            table(parts, ["N", "h/dx", "part", "ns", "ns/pair"]),
        ]
        if len({row.particles for row in self.rows}) > 1:
            flat = [
                [step, kernel, f"{support:g}", f"{ratio:.2f}"]
                for (step, kernel, support), ratio in self.flatness().items()
            ]
            blocks += [
                f"flatness in N: largest over smallest ns, flat up to {FLAT:g}",
                table(flat, ["step", "kernel", "h/dx", "ratio"]),
            ]
        return "\n\n".join([*blocks, self._foot()])


def run_speed(
    sizes: Sequence[int] | None = None,
    *,
    supports: Sequence[float] = SUPPORTS,
    kernels: Sequence[str] = ("lucy",),
    threads: int = 1,
    rounds: int = ROUNDS,
    quick: bool = False,
    progress: bool | None = None,
) -> Speed:
    """Time full steps and their parts.

    Parameters
    ----------
    sizes : sequence of int, optional
        Numbers of particles, cubes of integers; `DEFAULT_SIZES` if None.
    supports : sequence of float
        h/dx [1].
    kernels : sequence of str
    threads : int
        Of each simulation.
    rounds : int
        Turns of each case.
    quick : bool
        Turns of a few steps: to try it.
    progress : bool, optional
        Show a progress bar; None: where somebody is likely to look.

    Returns
    -------
    Speed

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Notes
    -----
    All sizes and steps of a kernel and support take turns, so that they are compared at the same
    pace of the machine. Lists count with their share: how often they are built, and what that takes
    a particle, is measured in a box of `SMALL` particles along an edge. A turn is about as long as
    a call of the core, at whose end the user's arrays are written: that counts.
    """
    chosen = edges(DEFAULT_SIZES if sizes is None else sizes)
    ratios = tuple(validation.positive("supports", support) for support in supports)
    names = tuple(validation.choice("kernels", name, kernel_table.names()) for name in kernels)
    if not ratios or not names:
        raise ValueError("`supports` and `kernels` must name at least one each, got none")
    number = running.choose_threads(threads, chosen[0] ** 3)
    turns = validation.integer("rounds", rounds, minimum=1)
    seconds = 0.0 if validation.boolean("quick", quick) else TURN
    begun = perf_counter()
    groups = list(itertools.product(names, ratios))
    rows: list[Row] = []
    parts: list[Part] = []
    total = len(groups) * len(chosen) * len(STEPS) * turns
    with bar(total=total, progress=progress, unit="turn", disable=not wanted(progress)) as shown:
        for kernel, support in groups:
            rows += _measure(chosen, support, kernel, number, turns, seconds, shown.update)
        for support in ratios:
            parts += measure_parts(chosen[0], support, threads=number, rounds=turns, turn=seconds)
    return Speed(
        machine=Machine.here(),
        threads=number,
        rounds=turns,
        seconds=perf_counter() - begun,
        rows=tuple(rows),
        parts=tuple(parts),
    )


def _measure(
    chosen: Sequence[int],
    support: float,
    kernel: str,
    threads: int,
    rounds: int,
    seconds: float,
    advance: Callable[[], object],
) -> list[Row]:
    """All sizes and steps of a kernel and support, taking turns."""
    quick = seconds == 0.0
    box = SMALLEST if quick else SMALL
    lists = {
        name: Lists.of(_simulation(box, support, kernel, name, threads), quick=quick)
        for name in STEPS
    }
    runs = {
        (edge, name): Runs(
            _simulation(edge, support, kernel, name, threads), seconds, lists=lists[name]
        )
        for edge in chosen
        for name in STEPS
    }
    times = take_turns(runs, rounds, advance=advance)
    return [
        Row(
            particles=edge**3,
            support=support,
            kernel=kernel,
            pairs=each.sim.scene.pairs_per_particle,
            step=name,
            dt_over_tau=each.sim.dt / each.sim.scene.friction_time,
            lists=each.lists,
            time=Spread.of(times[edge, name]),
            bytes_per_particle=each.bytes_per_particle,
        )
        for (edge, name), each in runs.items()
    ]


def _simulation(edge: int, support: float, kernel: str, step: str, threads: int) -> Simulation:
    integrator, noisy = STEPS[step]
    effects = Effects(fluctuations=None if noisy else False)
    scene = water(edge, support, kernel, effects=effects)
    start = liquid(water(edge, support, kernel))
    return simulation(scene, integrator=integrator, threads=threads, positions=start)
