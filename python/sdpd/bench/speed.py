"""Full steps by number of particles, support, kernel and integrator; parts of a step; lists."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, ClassVar

from sdpd import kernels as kernel_table
from sdpd import running, validation
from sdpd.bench.fluid import Step, edges, liquid, simulation, water
from sdpd.bench.machine import Machine
from sdpd.bench.parts import Part, measure_parts
from sdpd.bench.peak import Peak, Work, work
from sdpd.bench.study import Study
from sdpd.bench.turns import Lists, Runs, Spread, take_turns
from sdpd.effects import Effects
from sdpd.integrators import PairSplitting, VelocityVerlet
from sdpd.progress import bar
from sdpd.units import table

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["DEFAULT_SIZES", "SHARES", "STEPS", "SUPPORTS", "Row", "Speed", "run_speed"]

DEFAULT_SIZES = (3375, 32768, 216000)
SUPPORTS = (2.4, 3.0)
ROUNDS = 5
TURN = 0.2  # s, as long as a call of the core from a run
SMALL, SMALLEST = 15, 8  # particles along an edge of the box in which lists are watched
FLAT = 1.2  # largest over smallest cost of a particle-step that still counts as flat in N
SHARES = ["N", "h/dx", "step", "GFlop/s", "% of best", "GB/s", "% of best"]
STEPS = {
    "Verlet, uniform noise": Step(VelocityVerlet(noise="uniform")),
    "the same, mixed precision": Step(VelocityVerlet(noise="uniform"), precision="mixed"),
    "Verlet, Gaussian noise": Step(VelocityVerlet(noise="gaussian")),
    "Verlet, no noise": Step(VelocityVerlet(), noisy=False),
    "pair splitting": Step(PairSplitting()),
    "splitting, mixed precision": Step(PairSplitting(), precision="mixed"),
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
    pairs, near, listed : float
        A particle, each pair counted once; within the support, within the skin, and in the list.
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
    near: float
    listed: float
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
    def work(self) -> Work:
        """Operations and bytes of a particle-step."""
        kind = STEPS[self.step]
        noise = kind.integrator.noise if kind.noisy else "none"
        splitting = isinstance(kind.integrator, PairSplitting)
        return work(self.pairs, self.near, self.listed, noise=noise, splitting=splitting)

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
    peak: Peak
    one_thread: Peak

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
        blocks += [f"{self.best()}; what steps reach of it", table(self.shares(), SHARES)]
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

    def best(self) -> str:
        """What the machine can do, in words."""
        found = [str(self.one_thread)]
        if self.threads > 1:
            gain = self.peak.flops / self.one_thread.flops
            found.append(f"{self.peak}: {gain:.2f} times the operations of one")
        return "; ".join(found)

    def shares(self) -> list[list[str]]:
        """Operations and bytes a second of each row, beside the machine's best; see `SHARES`."""
        found = []
        for row in self.rows:
            mixed = STEPS[row.step].precision == "mixed"  # the best is that of double precision
            flops, moved = (x * row.rate.median for x in (row.work.flops, row.work.bytes))
            found.append(
                [
                    f"{row.particles:,}",
                    f"{row.support:g}",
                    row.step,
                    f"{flops * 1e-9:.1f}",
                    "" if mixed else f"{100.0 * flops / self.peak.flops:.0f}",
                    f"{moved * 1e-9:.1f}",
                    f"{100.0 * moved / self.peak.bandwidth:.0f}",
                ]
            )
        return found


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
    a particle, is measured in a box of `SMALL` particles along an edge. At the end of a turn the
    user's arrays are written: a turn has at least as many steps as pass between that in a run.
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
    with bar(total=total, progress=progress, unit="turn") as shown:
        for kernel, support in groups:
            rows += _measure(chosen, support, kernel, number, turns, seconds, shown.update)
        for support in ratios:
            parts += measure_parts(chosen[0], support, threads=number, rounds=turns, turn=seconds)
    one_thread = Peak.measure()
    return Speed(
        machine=Machine.here(),
        threads=number,
        rounds=turns,
        seconds=perf_counter() - begun,
        rows=tuple(rows),
        parts=tuple(parts),
        peak=one_thread if number == 1 else Peak.measure(number),
        one_thread=one_thread,
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
            near=each.sim.statistics()["pairs_in_skin"] / each.sim.n_particles,
            listed=each.sim.statistics()["pairs_in_list"] / each.sim.n_particles,
            step=name,
            dt_over_tau=each.sim.dt / each.sim.scene.friction_time,
            lists=each.lists,
            time=Spread.of(times[edge, name]),
            bytes_per_particle=each.bytes_per_particle,
        )
        for (edge, name), each in runs.items()
    ]


def _simulation(edge: int, support: float, kernel: str, step: str, threads: int) -> Simulation:
    kind = STEPS[step]
    effects = Effects(fluctuations=None if kind.noisy else False)
    scene = water(edge, support, kernel, effects=effects)
    start = liquid(water(edge, support, kernel))
    return simulation(
        scene,
        integrator=kind.integrator,
        threads=threads,
        positions=start,
        precision=kind.precision,
    )
