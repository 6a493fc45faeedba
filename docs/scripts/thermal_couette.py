"""Shear flow of nitrogen between plates of 300 K and 330 K (Yang 2013, section 4.2).

Steady profiles, stress and heat do not depend on the density. At the published one P/tau = 2e4, and
particles without noise shear like a crystal; here it is lower, so that P/tau = 20.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, grid, subplots

import sdpd
from sdpd.theory import HeatedShear, thermal_couette

WIDTH, SPEED = 1e-4, 30.0  # m, m/s
TEMPERATURES = (300.0, 330.0)  # K
HOT = (300.0, 300.2)  # K, at ten thirds of the speed: Brinkman number 34
RAREFIED = 1.1e-3  # of the published density
BINS = 33


def scene(speed: float, temperatures: tuple[float, float], across: int) -> sdpd.Scene:
    """The published fluid and height, as wide as the supports need."""
    spacing = WIDTH / across
    gas = sdpd.fluids.nitrogen()
    fluid = gas.replace(
        density=RAREFIED * gas.density, viscosity_exponent=0.7, conductivity_exponent=0.7
    )
    box = sdpd.Box((7 * spacing, 7 * spacing, WIDTH), periodic="xy")
    low, high = (sdpd.Isothermal(t) for t in temperatures)
    return sdpd.Scene(
        fluid=fluid,
        box=box,
        walls=(
            sdpd.Plane(axis="z", at=0.0, heat=low),
            sdpd.Plane(axis="z", at=WIDTH, velocity=(speed, 0.0, 0.0), heat=high),
        ),
        resolution=sdpd.Resolution(particles=(7, 7, across), support=3.0, kernel="wendland_c2"),
        calibrate=True,
        effects=sdpd.Effects(energy=True, fluctuations=False),
    )


@dataclass(frozen=True)
class Measured:
    """Profiles, and what the plates feel, beside the closed form."""

    exact: HeatedShear
    height: np.ndarray
    velocity: np.ndarray
    temperature: np.ndarray
    stress: float
    heat: tuple[float, float]
    balance: float

    @property
    def errors(self) -> tuple[float, float]:
        """Largest errors of velocity and temperature, over the span of each."""
        v, t = self.exact.at(self.height)
        span = np.ptp(self.exact.temperature)
        return (
            float(np.abs(self.velocity - v).max() / self.exact.velocity[-1]),
            float(np.abs(self.temperature - t).max() / span),
        )


def measure(
    speed: float, temperatures: tuple[float, float], across: int, settle: int, steps: int
) -> Measured:
    """From the closed form, which must stay."""
    made = scene(speed, temperatures, across)
    fluid = made.fluid
    exact = thermal_couette(
        width=WIDTH,
        speed=speed,
        temperatures=temperatures,
        shear_viscosity=fluid.shear_viscosity,
        thermal_conductivity=fluid.thermal_conductivity or 0.0,
        exponent=0.7,
        reference=300.0,
    )
    sim = sdpd.Simulation(made, threads=1)
    velocity, temperature = exact.at(sim.positions[:, 2])
    sim.velocities[:, 0] = velocity
    sim.temperatures = temperature
    sim.run(steps=settle, progress=False)
    forces = sdpd.WallForces(every=1)
    before, start, energy = sim.energy_accounts(), sim.time, sim.total_energy
    sim.run(steps=steps, observe=forces, progress=False)
    after = sim.energy_accounts()
    per = made.geometry.area(0) * (sim.time - start)
    gained = (after.wall_work - before.wall_work).sum() - (after.wall_heat - before.wall_heat).sum()
    z = np.asarray(sim.positions[:, 2])
    layer = np.clip((z / WIDTH * across).astype(int), 0, across - 1)
    count = np.bincount(layer, minlength=across)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(layer, values, minlength=across) / count

    heat = (after.wall_heat - before.wall_heat) / per
    return Measured(
        exact,
        mean(z),
        mean(np.asarray(sim.velocities[:, 0])),
        mean(np.asarray(sim.temperatures)),
        float((after.wall_work - before.wall_work)[1] / per / speed),
        (float(heat[0]), float(heat[1])),
        float((sim.total_energy - energy - gained) / sim.total_energy),
    )


CASES = {"published": (SPEED, TEMPERATURES), "heated": (10.0 * SPEED / 3.0, HOT)}


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("thermal_couette", __doc__, argv)
    across, settle, steps = (12, 100, 50) if report.quick else (BINS, 1200, 400)
    found = {
        name: measure(*case, across, settle, steps)
        for name, case in CASES.items()
        if not (report.quick and name == "heated")
    }
    rows = []
    for name, case in found.items():
        v, t = case.errors
        exact = case.exact
        rows.append(
            [
                name,
                f"{v:.2%}",
                f"{t:.2%}",
                f"{case.stress:.3f} / {exact.stress:.3f} ({case.stress / exact.stress - 1:+.1%})",
                *(
                    f"{mine:.0f} / {its:.0f}"
                    for mine, its in zip(case.heat, exact.heat, strict=True)
                ),
                f"{case.balance:.0e}",
            ]
        )
    report.document(
        grid(
            [
                "case",
                "velocity, largest error / V",
                "temperature / span",
                "stress on the plates / exact [Pa]",
                "heat to the lower plate / exact [W/m^2]",
                "heat to the upper plate / exact [W/m^2]",
                "energy balance",
            ],
            rows,
        )
    )
    figure, axes = subplots(2)
    for (name, case), colour in zip(found.items(), ("#4269d0", "#ff725c"), strict=False):
        height = case.height / WIDTH
        exact = case.exact
        axes[0].plot(
            case.velocity / exact.velocity[-1], height, "o", ms=3, color=colour, label=name
        )
        axes[0].plot(exact.velocity / exact.velocity[-1], exact.height / WIDTH, "-", color=colour)
        span = np.ptp(exact.temperature)
        scaled = (case.temperature - exact.temperature[0]) / span
        axes[1].plot(scaled, height, "o", ms=3, color=colour, label=name)
        axes[1].plot(
            (exact.temperature - exact.temperature[0]) / span,
            exact.height / WIDTH,
            "-",
            color=colour,
        )
    axes[0].set_xlabel("$v_x/V$ [1]")
    axes[0].set_ylabel("$z/L$ [1]")
    axes[1].set_xlabel(r"$(T-T_0)/(T_{max}-T_{min})$ [1]")
    axes[0].legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
