"""Temperatures and pressure of nitrogen against the time step (Yang 2013, Figures 26 and 27)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from report import Report, blocked, grid, shown, subplots

import sdpd
from sdpd import nitrogen

MULTIPLES = (0.25, 0.5, 1.0, 2.0, 3.0)  # of the default step


def measure(multiple: float, samples: int, particles: int | None) -> dict[str, tuple[float, float]]:
    """Case 1 of Table 9: ratios to the exact T, and to R T times the mean density."""
    scene = nitrogen.scene_of(
        nitrogen.CASES[1], kernel="wendland_c2", heat_capacity=2.5, particles=particles
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        step = multiple * sdpd.timestep.auto_time_step(scene).value
        sim = sdpd.Simulation(scene, dt=step, seed=2, threads=1)
    boltzmann = scene.fluid.boltzmann_constant
    number, k = scene.n_particles, scene.heat_capacity_number
    every = max(1, round(5.0 / multiple))
    sim.run(steps=120 * every, progress=False)
    mean = sim.total_energy / ((number * k + 1.5 * (number - 1)) * boltzmann)
    gas = boltzmann / (scene.fluid.molecular_mass or 1.0)
    rows = []
    for _ in range(samples):
        sim.run(steps=every, progress=False)
        rho, p = np.asarray(sim.densities), np.asarray(sim.pressures)
        rows.append(
            (
                sim.temperatures.mean() / mean,
                sim.temperature / mean,
                p.mean() / (gas * mean * rho.mean()),
                np.square(sim.temperatures / mean - 1.0).mean() * k,
                rho.var() / rho.mean() ** 2 / (scene.density_deviation or np.nan) ** 2,
            )
        )
    names = ("T", "T_kin", "P", "Var T", "Var rho")
    found = {name: blocked(column) for name, column in zip(names, np.transpose(rows), strict=True)}
    found["dt/tau"] = (step / scene.friction_time, 0.0)
    return found


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("nitrogen_time_step", __doc__, argv)
    multiples = MULTIPLES[2:3] if report.quick else MULTIPLES
    size = 216 if report.quick else None
    found = [measure(x, 32 if report.quick else 640, size) for x in multiples]
    names = ("T", "T_kin", "P", "Var T", "Var rho")
    rows = [
        [f"{x:g}", f"{case['dt/tau'][0]:.2f}", *(shown(*case[name]) for name in names)]
        for x, case in zip(multiples, found, strict=True)
    ]
    header = ["dt / default", r"$\Delta t/\tau$", "$T$", "$T_{kin}$", "$P$"]
    report.document(
        grid([*header, r"$\mathrm{Var}\,T$", r"$\mathrm{Var}\,\rho$"], rows),
        "Over what is exact ($T$, $T_{kin}$, $P$ at the mean density, $\\mathrm{Var}\\,T$) or the "
        "random-phase estimate ($\\mathrm{Var}\\,\\rho$), with standard errors.",
    )
    figure, axes = subplots(width=4.6, height=3.0)
    for name, marker in zip(("T", "T_kin", "P", "Var T"), "os^v", strict=True):
        values, errors = np.transpose([case[name] for case in found])
        axes.errorbar(multiples, values, errors, fmt=marker + "-", ms=4, label=name)
    axes.set_xscale("log")
    axes.set_xlabel(r"$\Delta t$ / default [1]")
    axes.set_ylabel("ratio to the exact value [1]")
    axes.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
