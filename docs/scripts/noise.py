"""Gaussian and uniform variates under velocity Verlet: what they cost and what they change."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence

import numpy as np
from report import Report, blocked, grid, mean_and_error, reduced_fluid, shown

import sdpd

ETA = 20.0
SOUND_SPEED = 10.0  # X = 100
SUPPORT = 2.4
VARIATES = ("gaussian", "uniform")
RATIO = 0.05  # dt/tau of the physics
LAG = 0.5  # of the velocity autocorrelation, in tau


def simulation(edge: int, variate: str, positions: np.ndarray | None = None) -> sdpd.Simulation:
    """An equilibrium fluid under velocity Verlet with these variates."""
    scene = sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=SUPPORT),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )
    dt = RATIO * scene.friction_time
    integrator = sdpd.VelocityVerlet(noise=variate)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        return sdpd.Simulation(
            scene, integrator=integrator, dt=dt, seed=11, threads=1, positions=positions
        )


def cost(positions: np.ndarray, edge: int, repeats: int, steps: int) -> dict[str, np.ndarray]:
    """Processor time [ns] per particle and step of each repeat, with these variates or none."""
    sims = {name: simulation(edge, name, positions) for name in VARIATES}
    quiet = sims["gaussian"].scene.replace(effects=sdpd.Effects(fluctuations=False))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sims["none"] = sdpd.Simulation(
            quiet,
            integrator=sdpd.VelocityVerlet(),
            dt=sims["gaussian"].dt,
            threads=1,
            positions=positions,
        )
    found: dict[str, list[float]] = {name: [] for name in sims}
    for sim in sims.values():
        sim.run(steps, progress=False)  # lists and memory are in place
    for repeat in range(repeats):
        order = list(sims) if repeat % 2 == 0 else list(reversed(sims))
        for name in order:
            begin = time.process_time()
            sims[name].run(steps, progress=False)
            spent = time.process_time() - begin
            found[name].append(1e9 * spent / (steps * edge**3))
    return {name: np.array(values) for name, values in found.items()}


def physics(
    positions: np.ndarray, edge: int, variate: str, duration: float
) -> list[tuple[float, float]]:
    """Temperature, excess kurtosis, friction rate and autocorrelation, with standard errors."""
    sim = simulation(edge, variate, positions)
    tau = sim.scene.friction_time
    sim.run(time=20.0 * tau, progress=False)
    thermo = sdpd.Thermodynamics(every=5)
    kurtosis, rates, decay = [], [], []
    stretches = 32
    for _ in range(stretches):
        correlator = sdpd.Correlator(every=round(LAG / RATIO), points=2, levels=1)
        for _ in range(4):
            sim.run(
                time=duration / (4 * stretches) * tau,
                observe=(thermo, correlator),
                progress=False,
            )
            velocity = sim.velocities - sim.velocities.mean(axis=0)
            kurtosis.append(np.mean(velocity**4) / np.mean(velocity**2) ** 2 - 3.0)
            rates.append(sim.friction_rate())
        vacf = correlator.vacf
        decay.append(-np.log(vacf[1] / vacf[0]) / correlator.time[1])
    return [
        blocked(np.asarray(thermo["temperature"]) - 1.0),
        blocked(kurtosis),
        blocked(np.array(rates) * tau, blocks=8),  # configurations live long
        mean_and_error(np.array(decay) * tau),
    ]


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("noise", __doc__, argv)
    edge, duration, repeats, steps = (6, 64.0, 3, 5) if report.quick else (10, 3072.0, 31, 60)
    start = simulation(edge, "uniform")
    start.run(time=0.5 if report.quick else 5.0, progress=False)
    positions = np.array(start.positions)
    spent = cost(positions, edge, repeats, steps)
    measured = {name: physics(positions, edge, name, duration) for name in VARIATES}

    rows = [["processor time, ns per particle and step", *(_spread(spent[n]) for n in spent)]]
    for name, text in (("uniform", "uniform variates"), ("none", "no noise")):
        rows.append(
            [
                f"over that with {text}, same repeat",
                *(_spread(spent[n] / spent[name]) for n in spent),
            ]
        )
    costs = grid(["cost", *VARIATES, "no noise"], rows)
    names = (
        "$T_\\mathrm{kin}/T-1$",
        "excess kurtosis of the velocity components",
        "exact initial slope of the velocity autocorrelation, times $\\tau$",
        f"$-\\ln[C(t)/C(0)]\\,\\tau/t$ at $t={LAG:g}\\,\\tau$",
    )
    rows = []
    for index, name in enumerate(names):
        (one, e1), (two, e2) = (measured[variate][index] for variate in VARIATES)
        difference = two - one, float(np.hypot(e1, e2))
        cells = [shown(one, e1, digits=5), shown(two, e2, digits=5)]
        rows.append([name, *cells, shown(*difference, digits=5, signed=True)])
    pairs = start.scene.pairs_per_particle
    report.document(
        costs,
        f"Median and range from the first to the third quartile of {repeats} repeats taking turns, "
        "one core; the ratios are of neighbours in time.",
        grid(["effect [1]", *VARIATES, "uniform − gaussian"], rows),
        f"One standard error. Lucy, $h/\\Delta x={SUPPORT:g}$ ({pairs:.0f} pairs per particle), "
        f"$X=100$, $\\eta^*={ETA:g}$, $N={edge**3}$, $\\Delta t/\\tau={RATIO:g}$ "
        f"without iterations, runs of ${duration:g}\\,\\tau$; $\\tau$ is that of the lattice.",
    )


def _spread(values: np.ndarray) -> str:
    if np.all(values == 1.0):
        return "1"
    low, middle, high = np.percentile(values, [25, 50, 75])
    digits = 0 if middle >= 100.0 else 2
    return f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


if __name__ == "__main__":
    main()
