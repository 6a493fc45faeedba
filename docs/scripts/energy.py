"""Equilibrium and conservation of a fluid with an energy: heat capacities, time steps, books."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, blocked, grid, shown, subplots

import sdpd

CAPACITIES = (295.0, 25.0, 5.0)  # C/k_B; the first is that of the smallest particles of Table 9
FRACTIONS = (0.09, 0.18, 0.27, 0.36)  # of the acoustic limit


def gas(capacity: float, dimension: int, edge: float) -> sdpd.Scene:
    """m = dx = k_B = T_0 = 1, X = 100."""
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=20.0,
        temperature=1.0,
        boltzmann_constant=1.0,
        heat_capacity=capacity,
        thermal_conductivity=22.2 * capacity,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    return sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((edge,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, support=2.65, kernel="lucy"),
        start=sdpd.RandomStart(relax_steps=100),
        sound_speed=10.0,
        effects=sdpd.Effects(energy=True),
    )


@dataclass(frozen=True)
class Equilibrium:
    """Ratios to the exact values, each with its standard error."""

    capacity: float
    step: float  # of tau
    temperature: tuple[float, float]
    kinetic: tuple[float, float]
    variance: tuple[float, float]
    correlation: tuple[float, float]
    density: tuple[float, float]
    energy: float  # change over the kinetic energy
    refused: int


def equilibrium(capacity: float, samples: int, settle: int = 2000) -> Equilibrium:
    """A box at its own time step."""
    scene = gas(capacity, 3, 8.0)
    sim = sdpd.Simulation(scene, seed=7, threads=1)
    number = scene.n_particles
    sim.run(steps=settle, progress=False)
    before = sim.total_energy
    whole = number * capacity + 1.5 * (number - 1)
    mean = before / whole
    rows = []
    for _ in range(samples):
        sim.run(steps=5, progress=False)
        t, d = np.asarray(sim.temperatures) / mean, np.asarray(sim.number_densities)
        d = d - d.mean()
        rows.append(
            (
                t.mean(),
                sim.temperature / mean,
                np.square(t - 1.0).mean(),
                np.mean((t - 1.0) * d),
                np.square(d).mean(),
            )
        )
    table = np.asarray(rows)
    exact = (whole - capacity) / (capacity * (whole + 1.0))
    deviation = scene.density_deviation or math.nan
    spread = math.sqrt(exact) * math.sqrt(table[:, 4].mean())
    columns = [
        table[:, 0],
        table[:, 1],
        table[:, 2] / exact,
        table[:, 3] / spread,
        table[:, 4] / deviation**2,
    ]
    found = [blocked(column) for column in columns]
    return Equilibrium(
        capacity,
        sim.dt / scene.friction_time,
        found[0],
        found[1],
        found[2],
        found[3],
        found[4],
        (sim.total_energy - before) / sim.kinetic_energy,
        sim.energy_accounts().refused,
    )


def drift(fraction: float, steps: int, *, books: bool) -> tuple[float, float]:
    """Drift of the total energy per 10^5 steps, and the energy discarded, over the kinetic one."""
    scene = gas(25.0, 2, 8.0)
    limit = sdpd.timestep.acoustic_limit(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        integrator = sdpd.PairSplitting(energy_bookkeeping=books)
        sim = sdpd.Simulation(scene, dt=fraction * limit, integrator=integrator, seed=3, threads=1)
    sim.run(steps=500, progress=False)
    energy, discarded = sim.total_energy, sim.energy_accounts().discarded
    kinetic = scene.n_particles * scene.thermal_energy
    sim.run(steps=steps, progress=False)
    scale = 1e5 / steps / kinetic
    return (
        (sim.total_energy - energy) * scale,
        (sim.energy_accounts().discarded - discarded) * scale,
    )


def slope(steps: int, points: int = 50) -> tuple[float, float]:
    """Slope of the total energy per 10^5 steps over the kinetic energy, and its standard error."""
    sim = sdpd.Simulation(gas(25.0, 2, 6.0), seed=3, threads=1)
    sim.run(steps=200, progress=False)
    x, y = [], []
    for _ in range(points):
        sim.run(steps=steps // points, progress=False)
        x.append(sim.step / 1e5)
        y.append(sim.total_energy / (sim.scene.n_particles * sim.scene.thermal_energy))
    coefficients, covariance = np.polyfit(x, y, 1, cov=True)
    return float(coefficients[0]), float(math.sqrt(covariance[0, 0]))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("energy", __doc__, argv)
    capacities = CAPACITIES[1:2] if report.quick else CAPACITIES
    size = (40, 200) if report.quick else (6000, 2000)
    rows = []
    for found in (equilibrium(k, *size) for k in capacities):
        cells = [found.temperature, found.kinetic, found.variance, found.correlation]
        rows.append(
            [
                f"{found.capacity:g}",
                f"{found.step:.2f}",
                *(shown(*cell) for cell in cells),
                shown(*found.density, digits=3),
                f"{found.energy:.0e}",
                f"{found.refused}",
            ]
        )
    header = [
        "$C/k_B$",
        r"$\Delta t/\tau$",
        r"$\langle T_i\rangle/T$",
        "$T_{kin}/T$",
        r"$\mathrm{Var}\,T_i$",
        "corr$(T,d)$",
        r"$\mathrm{Var}\,d$",
        r"$\Delta E/K$",
        "refused",
    ]
    steps = 400 if report.quick else 20000
    fractions = FRACTIONS[1:2] if report.quick else FRACTIONS
    with_books = [drift(x, steps, books=True) for x in fractions]
    without = [drift(x, steps, books=False) for x in fractions]
    second = [
        [f"{x:g}", f"{kept[0]:.1e}", f"{kept[1]:.3g}", f"{lost[0]:.3g}"]
        for x, kept, lost in zip(fractions, with_books, without, strict=True)
    ]
    report.document(
        grid(header, rows),
        "Variances over their exact values (of $d$: over the random-phase estimate), errors are "
        "standard errors; $\\Delta E$ is the change of the total energy over the run.",
        grid(
            [
                r"$\Delta t$ / acoustic limit",
                "drift, books kept",
                "discarded by the books",
                "drift, adiabats alone",
            ],
            second,
        ),
        "Energies per $10^5$ steps over the kinetic energy.",
    )
    figure, axes = subplots(width=4.2, height=3.0)
    axes.loglog(fractions, [max(x[0], 1e-16) for x in without], "o-", label="adiabats alone")
    axes.loglog(
        fractions, [max(abs(x[0]), 1e-16) for x in with_books], "s-", label="books of the work"
    )
    axes.set_xlabel(r"$\Delta t$ / acoustic limit [1]")
    axes.set_ylabel(r"$\Delta E/K$ per $10^5$ steps [1]")
    axes.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
