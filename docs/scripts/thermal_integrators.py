"""Fluids with an energy: velocity Verlet beside the pair splitting at equilibrium, step by step."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from energy import gas
from report import Report, blocked, grid, mean_and_error, shown

import sdpd

CAPACITIES = (25.0, 5.0)  # C/k_B
STEPS = (0.0625, 0.125, 0.25, 0.5, 1.0)  # of tau
SCHEMES: dict[str, sdpd.VelocityVerlet | sdpd.PairSplitting] = {
    "pair splitting": sdpd.PairSplitting(),
    "Verlet": sdpd.VelocityVerlet(),
    "Verlet without books": sdpd.VelocityVerlet(energy_bookkeeping=False),
}
EVERY = 5  # steps between samples
BLOCKS = 32


@dataclass(frozen=True)
class Equilibrium:
    """Ratios to the exact values at the present energy, and its drift, with standard errors."""

    temperature: tuple[float, float]
    kinetic: tuple[float, float]
    variance: tuple[float, float]
    drift: tuple[float, float]  # per 10^5 steps, over the kinetic energy
    refused: float  # per particle and 10^5 steps


def equilibrium(scheme: str, capacity: float, dt: float, steps: int) -> Equilibrium:
    """64 particles in the plane; `dt` in units of tau."""
    scene = gas(capacity, 2, 8.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        step = dt * scene.friction_time
        sim = sdpd.Simulation(scene, dt=step, integrator=SCHEMES[scheme], seed=5, threads=1)
    number, freedom = scene.n_particles, float(scene.n_particles - 1)
    whole = number * capacity + freedom
    exact = (whole - capacity) / (capacity * (whole + 1.0))
    sim.run(steps=max(steps // 10, 20), progress=False)
    refused = sim.energy_accounts().refused
    rows, energies = [], [sim.total_energy]
    for _ in range(steps // EVERY):
        sim.run(steps=EVERY, progress=False)
        t, mean = np.asarray(sim.temperatures), sim.total_energy / whole
        rows.append(
            (
                t.mean() / mean,
                sim.kinetic_energy / (freedom * mean),
                np.square(t / mean - 1.0).mean() / exact,
            )
        )
        energies.append(sim.total_energy)
    table, energy = np.asarray(rows), np.asarray(energies) / freedom
    length = len(energy) // BLOCKS
    gains = np.diff(energy[::length]) * 1e5 / (EVERY * length)
    found = [blocked(column, BLOCKS) for column in table.T]
    return Equilibrium(
        found[0],
        found[1],
        found[2],
        mean_and_error(gains),
        (sim.energy_accounts().refused - refused) * 1e5 / (steps * number),
    )


def row(scheme: str, capacity: float, dt: float, steps: int) -> list[str]:
    """One line of the table."""
    start = [scheme, f"{capacity:g}", f"{dt:g}"]
    try:
        found = equilibrium(scheme, capacity, dt, steps)
    except sdpd.SimulationError:
        return [*start, "blows up", *[""] * 4]
    drift = found.drift if abs(found.drift[0]) > 1e-9 else (0.0, float("nan"))
    return [
        *start,
        *(shown(*cell) for cell in (found.temperature, found.kinetic, found.variance)),
        shown(*drift, digits=2, signed=True),
        f"{found.refused:.2g}",
    ]


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("thermal_integrators", __doc__, argv)
    steps = 400 if report.quick else 60_000
    capacities, lengths = (CAPACITIES[:1], STEPS[1:2]) if report.quick else (CAPACITIES, STEPS)
    header = [
        "",
        "$C/k_B$",
        r"$\Delta t/\tau$",
        r"$\langle T_i\rangle/T$",
        "$T_{kin}/T$",
        r"$\mathrm{Var}\,T_i$",
        r"drift of $E/K$ in $10^5$ steps",
        "refused",
    ]
    rows = [row(name, k, dt, steps) for k in capacities for name in SCHEMES for dt in lengths]
    report.document(
        grid(header, rows),
        "64 particles in the plane (Lucy, $h/\\Delta x=2.65$, $X=100$, $\\tau_q=0.9\\,\\tau$), "
        f"{steps} steps. $T$ is that of the present total energy, the variance over its exact "
        "value on that shell; $K$ is the kinetic energy. Refused: updates that would have left no "
        "energy, per particle and $10^5$ steps. Errors are standard errors.",
    )


if __name__ == "__main__":
    main()
