"""Particle-steps per second and memory of the integrators; writes generated/performance.json too.

Times are wall times on whatever machine runs this: run it on a quiet one.
"""

from __future__ import annotations

import json
import os
import platform
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from report import Report, grid, reduced_fluid

import sdpd
from sdpd.integrators import Integrator

ETA = 20.0
SOUND_SPEED = 10.0  # X = 100
SUPPORTS = (2.4, 3.0)
EDGES = (15, 32)  # 3,375 and 32,768 particles
INTEGRATORS: dict[str, Integrator] = {
    "Verlet, uniform, iterations=0": sdpd.VelocityVerlet(iterations=0, noise="uniform"),
    "Verlet, uniform, iterations=1": sdpd.VelocityVerlet(iterations=1, noise="uniform"),
    "Verlet, Gaussian, iterations=0": sdpd.VelocityVerlet(iterations=0, noise="gaussian"),
    "Verlet, Gaussian, iterations=1": sdpd.VelocityVerlet(iterations=1, noise="gaussian"),
    "pair splitting": sdpd.PairSplitting(),
}


@dataclass(frozen=True)
class Row:
    """Speed of one case: particle-steps per second, and bytes per particle."""

    particles: int
    support: float
    pairs: float
    integrator: str
    threads: int
    dt_over_tau: float
    steps: int
    repeats: int
    best: float
    median: float
    lower_quartile: float
    upper_quartile: float
    bytes_per_particle: float


def simulations(
    edge: int, support: float, threads: Sequence[int], relax: int
) -> dict[tuple[str, int], sdpd.Simulation]:
    """The same fluid under every integrator, each at its own time step, ready to be timed."""
    scene = sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=support),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )
    start = sdpd.Simulation(scene, seed=1)
    start.run(relax, progress=False)
    positions = np.array(start.positions)
    return {
        (name, number): sdpd.Simulation(
            scene, integrator=integrator, threads=number, seed=2, positions=positions
        )
        for name, integrator in INTEGRATORS.items()
        for number in threads
    }


def timed(sim: sdpd.Simulation, steps: int) -> float:
    """Particle-steps per second of a run."""
    begin = time.perf_counter()
    sim.run(steps, progress=False)
    return sim.n_particles * steps / (time.perf_counter() - begin)


def measure(edge: int, support: float, *, threads: Sequence[int], quick: bool) -> list[Row]:
    """All integrators and thread numbers for one box and support, taking turns."""
    sims = simulations(edge, support, threads, relax=2 if quick else 200)
    seconds, repeats = (0.01, 2) if quick else (0.6, 5)
    steps = {}
    for key, sim in sims.items():  # lists and memory are in place after this
        speed = timed(sim, 2 if quick else 10)
        steps[key] = max(2, round(seconds * speed / sim.n_particles))
    speeds: dict[tuple[str, int], list[float]] = {key: [] for key in sims}
    for repeat in range(repeats):
        for key in list(sims) if repeat % 2 == 0 else list(reversed(sims)):
            speeds[key].append(timed(sims[key], steps[key]))
    rows = []
    for (name, number), sim in sims.items():
        low, middle, high = np.percentile(speeds[name, number], [25, 50, 75])
        statistics = sim.statistics()
        rows.append(
            Row(
                particles=sim.n_particles,
                support=support,
                pairs=sim.scene.pairs_per_particle,
                integrator=name,
                threads=number,
                dt_over_tau=sim.dt / sim.scene.friction_time,
                steps=steps[name, number],
                repeats=repeats,
                best=max(speeds[name, number]),
                median=float(middle),
                lower_quartile=float(low),
                upper_quartile=float(high),
                bytes_per_particle=(statistics["list_bytes"] + statistics["state_bytes"])
                / sim.n_particles,
            )
        )
    return rows


def processor() -> str:
    """Name of the processor, as far as the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("performance", __doc__, argv)
    edges, supports = ((8,), (2.4,)) if report.quick else (EDGES, SUPPORTS)
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.PairingWarning)
        for edge in edges:
            for support in supports:
                rows += measure(edge, support, threads=(1, 2), quick=report.quick)
    machine = {
        "processor": processor(),
        "processors": os.cpu_count(),
        "system": platform.system(),
        "version": sdpd.__version__,
    }
    document = {"machine": machine, "rows": [asdict(row) for row in rows]}
    report.write("generated", "performance.json", json.dumps(document, indent=1) + "\n")

    cells = [
        [
            f"{row.particles:,}",
            f"{row.support:g} ({row.pairs:.0f})",
            row.integrator,
            f"{row.threads}",
            f"{row.dt_over_tau:.3f}",
            _thousands(row.best),
            _thousands(row.median, row.lower_quartile, row.upper_quartile),
            f"{row.bytes_per_particle:.0f}",
        ]
        for row in rows
    ]
    header = [
        "particles",
        "$h/\\Delta x$ (pairs)",
        "integrator",
        "threads",
        "$\\Delta t/\\tau$",
        "best",
        "median (quartiles)",
        "bytes per particle",
    ]
    report.document(
        grid(header, cells),
        f"Thousand particle-steps per second of wall time, all threads together: best, median and "
        f"quartiles of {rows[0].repeats} repeats taking turns. Lucy, $X=100$, $\\eta^*={ETA:g}$, "
        f'noise on, `dt="auto"`; bytes of state and lists. {machine["processor"]}, '
        f"{machine['processors']} processors.",
    )


def _thousands(speed: float, *quartiles: float) -> str:
    spread = "–".join(f"{value / 1e3:.0f}" for value in quartiles)
    return f"{speed / 1e3:.0f}" + f" ({spread})" * bool(spread)


if __name__ == "__main__":
    main()
