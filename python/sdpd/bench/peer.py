"""Side by side with LAMMPS on one core: speed at the same time step, and time to a result.

Both codes have the same box, particles, positions, velocities, equation of state (Tait, exponent 7,
the same c), viscosity, temperature and, unless said otherwise, kernel (Lucy) and time step. They
take turns, ABAB, pinned to the same core.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from sdpd import validation
from sdpd.analysis import Estimate, ensemble
from sdpd.bench.fluid import Step, edges, liquid, water
from sdpd.bench.lammps import Lammps, Session, find
from sdpd.bench.machine import Machine, pinned
from sdpd.bench.peer_results import BIAS, TIME_STEP, Contest, Journey, Peer, Temperature
from sdpd.bench.turns import Lists, Runs, Spread, take_turns
from sdpd.effects import Effects
from sdpd.errors import silenced
from sdpd.integrators import PairSplitting, VelocityVerlet
from sdpd.progress import bar
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["PEERS", "run_peer"]

PEERS = ("lammps",)
DEFAULT_SIZES = (3375, 32768)
SUPPORTS = (2.4, 3.0)
ROUNDS = 5
TURN = 0.5  # s
WARMING = 40  # steps, in which the temperature gets where the time step takes it
BIAS_STEPS = (1000, 2000)  # at the time step and at half of it, to find the bias
BLOCKS = 16
OURS = {
    "Verlet, uniform noise": Step(VelocityVerlet(noise="uniform")),
    "the same, mixed precision": Step(VelocityVerlet(noise="uniform"), precision="mixed"),
    "Verlet, Gaussian noise": Step(VelocityVerlet(noise="gaussian")),
    "Verlet, uniform noise, Wendland C2": Step(VelocityVerlet(), kernel="wendland_c2"),
    "pair splitting": Step(PairSplitting()),
    "splitting, mixed precision": Step(PairSplitting(), precision="mixed"),
    "Verlet, no noise": Step(VelocityVerlet(), noisy=False),
    "no noise, mixed precision": Step(VelocityVerlet(), precision="mixed", noisy=False),
}


class _Ours:
    """Turns of a simulation of ours; remembers the temperature and the friction of each."""

    def __init__(self, sim: Simulation, seconds: float, lists: Lists | None) -> None:
        from sdpd.observers import Thermodynamics

        self.sim = sim
        if isinstance(sim.integrator, VelocityVerlet):
            sim.run(WARMING, progress=False)
        self._thermo = Thermodynamics(every=4)
        self.runs = Runs(sim, seconds, lists=lists, observe=self._thermo)
        self.temperatures: list[float] = []

    @property
    def steps(self) -> int:
        """Of a turn."""
        return self.runs.steps

    def __call__(self) -> float:
        seen = len(self._thermo)
        time = self.runs()
        fresh = self._thermo["temperature"][seen:]
        self.temperatures.append(float(fresh.mean()) if len(fresh) else self.sim.temperature)
        return time


class _Observed(_Ours):
    """The same, and the short-time self-diffusion after each turn."""

    def __init__(self, sim: Simulation, seconds: float) -> None:
        super().__init__(sim, seconds, None)
        self.diffusions: list[float] = []

    def __call__(self) -> float:
        time = super().__call__()
        self.diffusions.append(1.0 / self.sim.friction_rate())
        return time


class _Theirs:
    """Turns of a LAMMPS that runs; remembers the temperature of each."""

    def __init__(self, session: Session, number: int, seconds: float) -> None:
        self._session, self._number = session, number
        pilot = session.run(WARMING if seconds else 2)
        self.steps = max(4, round(seconds * pilot.steps / pilot.seconds))
        self.temperatures: list[float] = []

    def __call__(self) -> float:
        found = self._session.run(self.steps)
        self.temperatures.append(float(found.temperatures.mean()))
        return found.seconds * 1e9 / (found.steps * self._number)


def run_peer(
    peer: str = "lammps",
    *,
    executable: str | os.PathLike[str] | None = None,
    sizes: Sequence[int] | None = None,
    supports: Sequence[float] = SUPPORTS,
    rounds: int = ROUNDS,
    quick: bool = False,
    progress: bool | None = None,
) -> Peer:
    """Take turns with another code on one core.

    Parameters
    ----------
    peer : {"lammps"}
    executable : path, optional
        Of LAMMPS; that of the package `lammps` or `lmp` on the PATH if None.
    sizes : sequence of int, optional
        Numbers of particles, cubes of integers; `DEFAULT_SIZES` if None. The time to a result is
        measured with the first.
    supports : sequence of float
        h/dx [1].
    rounds : int
        Turns of each side.
    quick : bool
        Turns of a few steps: to try it.
    progress : bool, optional
        Show a progress bar; None: where somebody is likely to look.

    Returns
    -------
    Peer

    Raises
    ------
    FileNotFoundError
        If there is no LAMMPS.
    TypeError, ValueError
        If an argument is out of range, or the LAMMPS found does not serve.
    ChildProcessError
        If LAMMPS stops on its way.
    """
    validation.choice("peer", peer, PEERS)
    chosen = edges(DEFAULT_SIZES if sizes is None else sizes)
    ratios = tuple(validation.positive("supports", support) for support in supports)
    if not ratios:
        raise ValueError("`supports` must name at least one, got none")
    turns = validation.integer("rounds", rounds, minimum=1)
    short = validation.boolean("quick", quick)
    lammps = find(executable)
    begun = perf_counter()
    contests: list[Contest] = []
    journeys: list[Journey] = []
    total = len(ratios) * (len(chosen) + 1)
    with (
        bar(total=total, progress=progress, unit="case") as shown,
        pinned() as core,
        silenced(),
    ):
        for support in ratios:
            bench = _Bench(lammps, support, turns, short)
            for edge in chosen:
                contests += bench.contests(edge)
                shown.update()
            journeys += bench.journeys(chosen[0])
            shown.update()
    return Peer(
        machine=Machine.here(),
        threads=1,
        rounds=turns,
        seconds=perf_counter() - begun,
        lammps=lammps,
        core=core,
        contests=tuple(contests),
        journeys=tuple(journeys),
    )


class _Bench:
    """Everything at one support."""

    def __init__(self, lammps: Lammps, support: float, rounds: int, quick: bool) -> None:
        self._lammps, self._support, self._rounds, self._quick = lammps, support, rounds, quick
        self._seconds = 0.0 if quick else TURN
        self._lists: dict[str, Lists] = {}

    def contests(self, edge: int) -> list[Contest]:
        """All kinds of steps in a box of that edge, at the same time step."""
        mine = {}
        for name, step in OURS.items():
            sim = self._simulation(edge, step, TIME_STEP)
            mine[name] = _Ours(sim, self._seconds, self._lists.get(name))
            self._lists[name] = mine[name].runs.lists
        with self._session(edge, True) as noisy_one, self._session(edge, False) as quiet_one:
            peers = {
                noisy: _Theirs(session, edge**3, self._seconds)
                for noisy, session in ((True, noisy_one), (False, quiet_one))
            }
            cases: dict[str | bool, Callable[[], float]] = {True: peers[True]}
            cases |= {name: mine[name] for name in OURS if OURS[name].noisy}
            cases |= {False: peers[False]}
            cases |= {name: mine[name] for name in OURS if not OURS[name].noisy}
            times = take_turns(cases, self._rounds)
        return [
            self._contest(edge, name, times, mine[name], peers[OURS[name].noisy]) for name in OURS
        ]

    def _contest(
        self,
        edge: int,
        name: str,
        times: Mapping[str | bool, Sequence[float]],
        mine: _Ours,
        peer: _Theirs,
    ) -> Contest:
        noisy = OURS[name].noisy
        theirs, ours = times[noisy], times[name]
        ratios = [a / b for a, b in zip(theirs, ours, strict=True)]
        scene = water(edge, self._support)
        return Contest(
            particles=edge**3,
            support=self._support,
            step=name,
            dt=TIME_STEP,
            theirs=Spread.of(theirs).inverse(1e9),
            ours=Spread.of(ours).inverse(1e9),
            ratio=Spread.of(ratios),
            lowest=min(ratios),
            highest=max(ratios),
            their_temperature=_temperature(peer, scene, TIME_STEP) if noisy else None,
            our_temperature=_temperature(mine, scene, TIME_STEP) if noisy else None,
        )

    def journeys(self, edge: int) -> list[Journey]:
        """Time to one h^2 rho/eta, each code at the time step that suits it."""
        scene = water(edge, self._support)
        span = scene.support_radius**2 * scene.fluid.density / scene.fluid.shear_viscosity
        kinds = {
            "splitting": Step(PairSplitting()),
            "splitting, mixed precision": Step(PairSplitting(), precision="mixed"),
            "Verlet": Step(VelocityVerlet()),
        }
        mine = {
            name: _Observed(self._simulation(edge, each, "auto"), self._seconds)
            for name, each in kinds.items()
        }
        small = self._simulation(edge, Step(VelocityVerlet()), TIME_STEP)
        reference = _Observed(small, self._seconds)
        with self._session(edge, True) as session:
            dt, error = self._largest_step(session, scene.fluid.temperature)
            session.set_time_step(dt)
            session.run(WARMING)
            theirs = _Theirs(session, edge**3, self._seconds)
            times = take_turns({"LAMMPS": theirs, **mine, "reference": reference}, self._rounds)
        steps = {"LAMMPS": dt, **{name: each.sim.dt for name, each in mine.items()}}
        wall = {
            name: [time * 1e-9 * edge**3 * span / step for time in times[name]]
            for name, step in steps.items()
        }
        found = []
        for name, step in steps.items():
            side = theirs if name == "LAMMPS" else mine[name]
            drift = _relative(mine[name].diffusions, reference.diffusions) if name in mine else None
            ratios = [a / b for a, b in zip(wall["LAMMPS"], wall[name], strict=True)]
            found.append(
                Journey(
                    particles=edge**3,
                    support=self._support,
                    code=name if name == "LAMMPS" else f"sdpd, {name}",
                    dt=step,
                    dt_error=error if name == "LAMMPS" else 0.0,
                    seconds=Spread.of(wall[name]),
                    ratio=Spread.of(ratios),
                    temperature=_temperature(side, scene, step),
                    diffusion_error=math.nan if drift is None else drift.value,
                    diffusion_stderr=math.nan if drift is None else drift.stderr,
                    shear_error=_shear(scene, step) if name.startswith("splitting") else math.nan,
                )
            )
        return found

    def _largest_step(self, session: Session, temperature: float) -> tuple[float, float]:
        """Time step at which LAMMPS is `BIAS` off, and its relative error.

        By weighted least squares of bias = slope dt, its bias being of first order.
        """
        counts = (4 * BLOCKS, 4 * BLOCKS) if self._quick else BIAS_STEPS
        top = bottom = 0.0
        for dt, steps in zip((TIME_STEP, 0.5 * TIME_STEP), counts, strict=True):
            session.set_time_step(dt)
            session.run(WARMING)
            samples = session.run(steps, every=2).temperatures
            count = min(BLOCKS, len(samples))
            blocks = [float(part.mean()) for part in np.array_split(samples, count)]
            found = ensemble(blocks)
            bias, variance = found.value / temperature - 1.0, (found.stderr / temperature) ** 2
            top += bias * dt / variance
            bottom += dt**2 / variance
        slope, slope_error = top / bottom, bottom**-0.5
        return BIAS / abs(slope), slope_error / abs(slope)

    def _session(self, edge: int, noise: bool) -> Session:
        sim = self._simulation(edge, Step(VelocityVerlet()), TIME_STEP)
        positions, velocities = np.array(sim.positions), np.array(sim.velocities)
        return Session(
            self._lammps, sim.scene, positions, velocities, dt=TIME_STEP, seed=edge, noise=noise
        )

    def _simulation(self, edge: int, step: Step, dt: float | str) -> Simulation:
        from sdpd.simulation import Simulation

        noisy_scene = water(edge, self._support, step.kernel)
        fluctuations = None if step.noisy else False
        scene = noisy_scene.replace(effects=Effects(fluctuations=fluctuations))
        start = liquid(noisy_scene)
        thermal = Simulation(noisy_scene, dt=TIME_STEP, threads=1, seed=3, positions=start)
        return Simulation(
            scene,
            integrator=step.integrator,
            precision=step.precision,
            dt=dt,
            threads=1,
            seed=3,
            positions=start,
            velocities=thermal.velocities,
        )


def _temperature(side: _Ours | _Theirs, scene: Scene, dt: float) -> Temperature:
    values = side.temperatures
    return Temperature.of(values, scene, len(values) * side.steps * dt)


def _relative(values: Sequence[float], reference: Sequence[float]) -> Estimate:
    """Mean of values over that of a reference, less 1."""
    ratios = [a / b - 1.0 for a, b in zip(values, reference, strict=True)]
    if len(ratios) < 2:
        return Estimate(value=ratios[0], stderr=math.nan)
    return ensemble(ratios)


def _shear(scene: Scene, dt: float) -> float:
    """Of the viscosity that a wave on the lattice decays with, by the time step alone."""
    from sdpd.viscosity.lattice import measure_lattice

    return measure_lattice(scene, dt, threads=1).factor.value - 1.0
