"""What observers inside the loop cost: time of a step with each of them, over the step without.

All take turns on the same running simulation, one thread; run it on a quiet machine.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence

import numpy as np
from report import Report, grid, reduced_fluid

import sdpd
from sdpd.observers import LoopObserver

WAVES = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
OBSERVERS: dict[str, Callable[[], LoopObserver]] = {
    "`Thermodynamics()`": sdpd.Thermodynamics,
    "`Correlator()`": sdpd.Correlator,
    "`CurrentCorrelator`, 3 wave vectors": lambda: sdpd.CurrentCorrelator(WAVES),
    "`StressCorrelator()`": sdpd.StressCorrelator,
    "`StressCorrelator(parts=True)`": lambda: sdpd.StressCorrelator(parts=True),
    "`Stress(every=10)`": lambda: sdpd.Stress(every=10),
}
INTEGRATORS = {
    "Verlet, uniform": sdpd.VelocityVerlet(noise="uniform"),
    "pair splitting": sdpd.PairSplitting(),
}


def simulation(edge: int, integrator: str) -> sdpd.Simulation:
    """Water-like: eta* = 140, X = 100, h/dx = 3."""
    scene = sdpd.Scene(
        fluid=reduced_fluid(140.0),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=3.0),
        start=sdpd.RandomStart(),
        sound_speed=10.0,
    )
    return sdpd.Simulation(scene, integrator=INTEGRATORS[integrator], seed=1, threads=1)


def seconds(sim: sdpd.Simulation, steps: int, observe: list[LoopObserver]) -> float:
    """Time of a step; the first few, in which memory is touched for the first time, apart."""
    sim.run(5, observe=observe, progress=False)
    begin = time.perf_counter()
    sim.run(steps, observe=observe, progress=False)
    return (time.perf_counter() - begin) / steps


def prices(edge: int, integrator: str, *, quick: bool) -> tuple[float, dict[str, np.ndarray]]:
    """Nanoseconds of a particle-step without observers, and ratios with each, round by round."""
    sim = simulation(edge, integrator)
    sim.run(2 if quick else 50, progress=False)
    span, rounds = (0.0, 2) if quick else (0.4, 9)
    once = seconds(sim, 5, [])
    steps = max(3, int(span / once))
    plain, ratios = [], {name: [] for name in OBSERVERS}
    for _ in range(rounds):
        # Each between two runs without: a machine that changes its pace changes both.
        before = seconds(sim, steps, [])
        for name, make in OBSERVERS.items():
            observed = seconds(sim, steps, [make()])
            after = seconds(sim, steps, [])
            ratios[name].append(2.0 * observed / (before + after) - 1.0)
            plain.append(before)
            before = after
    base = float(np.median(plain)) / sim.n_particles * 1e9
    return base, {name: np.array(values) for name, values in ratios.items()}


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("observers", __doc__, argv)
    edges = (8,) if report.quick else (15,)
    columns, cells = [], {name: [] for name in ("none", *OBSERVERS)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.SdpdWarning)
        for edge in edges:
            for integrator in INTEGRATORS:
                base, ratios = prices(edge, integrator, quick=report.quick)
                columns.append(f"{integrator}, N = {edge**3}")
                cells["none"].append(f"{base:.0f} ns")
                for name, values in ratios.items():
                    low, middle, high = np.percentile(100.0 * values, [25, 50, 75])
                    cells[name].append(f"{middle:+.1f} % ({low:+.1f} to {high:+.1f})")
    rows = [[name, *values] for name, values in cells.items()]
    report.document(
        grid(["observer", *columns], rows),
        "First row: time of a particle-step, one thread, h/dx = 3. Others: what sampling at every "
        "step adds, median and quartiles of nine rounds, each between two without. The stress is "
        "summed at every step whatever `every` is; all others become cheaper in proportion.",
    )


if __name__ == "__main__":
    main()
