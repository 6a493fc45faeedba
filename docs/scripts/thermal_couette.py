"""Shear flow of nitrogen between plates of 300 K and 330 K (Yang 2013, section 4.2).

Steady profiles, stress and heat do not depend on the density, which decides how stiff the particles
are against the shear: P/tau = Re/Ma^2. At the published one it is 2e4, and particles without noise
shear like a crystal. Here the density is lower; and for the published Reynolds number, 198, the
plate is faster.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, grid, subplots

import sdpd
from sdpd.theory import HeatedShear, thermal_couette

WIDTH, SPEED = 1e-4, 30.0  # m, m/s
TEMPERATURES = (300.0, 330.0)  # K
HOT = (300.0, 300.2)  # K, at ten thirds of the speed: Brinkman number 34
PRESSURE = 105423.0  # Pa, of the published density at 300 K
RAREFIED = 1.1e-3  # of the published density
ACROSS, SUPPORT = 25, 4.0  # spacings
SAMPLES = 40
RESOLUTIONS = ((20, 3.0, 1.0), (20, 3.0, 0.5), (25, 3.0, 1.0), (20, 4.0, 1.0), (25, 4.0, 1.0))
COLOURS = ("#4269d0", "#ff725c", "#3ca951")


@dataclass(frozen=True)
class Flow:
    """Speed of the upper plate [m/s], temperatures [K], density over the published one."""

    speed: float = SPEED
    temperatures: tuple[float, float] = TEMPERATURES
    rarefied: float = RAREFIED
    settle: float = 5.0  # relaxation times before the first sample; half as many are sampled

    @property
    def reynolds(self) -> float:
        """rho V L/eta at 300 K."""
        gas = sdpd.fluids.nitrogen()
        return self.rarefied * gas.density * self.speed * WIDTH / gas.shear_viscosity

    @property
    def stiffness(self) -> float:
        """Pressure over shear stress at 300 K, Re/Ma^2."""
        gas = sdpd.fluids.nitrogen()
        return float(self.rarefied * PRESSURE * WIDTH / (gas.shear_viscosity * self.speed))

    @property
    def brinkman(self) -> float:
        """eta V^2/(kappa dT)."""
        gas = sdpd.fluids.nitrogen()
        ratio = gas.shear_viscosity / (gas.thermal_conductivity or math.nan)
        return ratio * self.speed**2 / (self.temperatures[1] - self.temperatures[0])

    @property
    def relaxation(self) -> float:
        """L^2/pi^2 over the smaller diffusivity, that of momentum: how long the flow remembers."""
        gas = sdpd.fluids.nitrogen()
        return WIDTH**2 / math.pi**2 * self.rarefied * gas.density / gas.shear_viscosity


CASES = {
    "published": Flow(),
    "heated": Flow(10.0 * SPEED / 3.0, HOT),
    "Re = 198": Flow(30.0 * SPEED, rarefied=1.0 / 30.0, settle=1.0),
}


def scene(flow: Flow, across: int = ACROSS, support: float = SUPPORT) -> sdpd.Scene:
    """The published fluid and height, as wide as the supports need."""
    spacing = WIDTH / across
    gas = sdpd.fluids.nitrogen()
    fluid = gas.replace(
        density=flow.rarefied * gas.density, viscosity_exponent=0.7, conductivity_exponent=0.7
    )
    side = math.ceil(2.0 * support)
    low, high = (sdpd.Isothermal(t) for t in flow.temperatures)
    return sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((side * spacing, side * spacing, WIDTH), periodic="xy"),
        walls=(
            sdpd.Plane(axis="z", at=0.0, heat=low),
            sdpd.Plane(axis="z", at=WIDTH, velocity=(flow.speed, 0.0, 0.0), heat=high),
        ),
        resolution=sdpd.Resolution(
            particles=(side, side, across), support=support, kernel="wendland_c2"
        ),
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
    flow: Flow,
    across: int = ACROSS,
    *,
    support: float = SUPPORT,
    step: float = 1.0,
    settle: float,
    sample: float,
) -> Measured:
    """From the closed form, which must stay; times in `Flow.relaxation`, step in default ones."""
    made = scene(flow, across, support)
    fluid = made.fluid
    exact = thermal_couette(
        width=WIDTH,
        speed=flow.speed,
        temperatures=flow.temperatures,
        shear_viscosity=fluid.shear_viscosity,
        thermal_conductivity=fluid.thermal_conductivity or 0.0,
        exponent=0.7,
        reference=300.0,
    )
    sim = sdpd.Simulation(made, threads=1)
    sim.dt *= step
    velocity, temperature = exact.at(sim.positions[:, 2])
    sim.velocities[:, 0] = velocity
    sim.temperatures = temperature
    sim.run(time=settle * flow.relaxation, progress=False)
    forces = sdpd.WallForces(every=1)
    before, start, energy = sim.energy_accounts(), sim.time, sim.total_energy
    layers = Layers(across)
    every = max(1, math.ceil(sample * flow.relaxation / sim.dt / SAMPLES))
    for _ in range(SAMPLES):
        sim.run(steps=every, observe=forces, progress=False)
        layers.add(sim)
    after = sim.energy_accounts()
    per = made.geometry.area(0) * (sim.time - start)
    gained = (after.wall_work - before.wall_work).sum() - (after.wall_heat - before.wall_heat).sum()
    heat = (after.wall_heat - before.wall_heat) / per
    return Measured(
        exact,
        *layers.means,
        float((after.wall_work - before.wall_work)[1] / per / flow.speed),
        (float(heat[0]), float(heat[1])),
        float((sim.total_energy - energy - gained) / sim.total_energy),
    )


class Layers:
    """Means of height, velocity and temperature in layers a spacing thick."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._sums = np.zeros((4, number))

    def add(self, sim: sdpd.Simulation) -> None:
        """A sample."""
        z = np.asarray(sim.positions[:, 2])
        layer = np.clip((z / WIDTH * self._number).astype(int), 0, self._number - 1)
        values = (np.ones_like(z), z, sim.velocities[:, 0], sim.temperatures)
        self._sums += [np.bincount(layer, np.asarray(v), self._number) for v in values]

    @property
    def means(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the three, in that order."""
        height, velocity, temperature = self._sums[1:] / self._sums[0]
        return height, velocity, temperature


def run(flow: Flow) -> Measured:
    """A case as the table has it: long enough to forget where it started from."""
    return measure(flow, settle=flow.settle, sample=0.5 * flow.settle)


def refined(known: Measured) -> str:
    """The heated case by spacings across, support and time step; the last is the one above."""
    flow, rows = CASES["heated"], []
    for across, support, step in RESOLUTIONS:
        found = known
        if (across, support) != (ACROSS, SUPPORT):
            found = measure(
                flow,
                across,
                support=support,
                step=step,
                settle=flow.settle,
                sample=0.5 * flow.settle,
            )
        stress = found.stress / found.exact.stress - 1.0
        rows.append(
            [
                f"{across}",
                f"{support:g}",
                f"{step:g}",
                f"{found.errors[0]:.2%}",
                f"{found.errors[1]:.2%}",
                f"{stress:+.1%}",
                *(f"{a / b - 1.0:+.1%}" for a, b in zip(found.heat, found.exact.heat, strict=True)),
            ]
        )
    header = ["across", r"$h/\Delta x$", "time step / default", "velocity / V"]
    header += ["temperature / span", "stress", "heat, lower plate", "upper plate"]
    return "The heated case, errors by resolution:\n\n" + grid(header, rows)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("thermal_couette", __doc__, argv)
    if report.quick:
        found = {"published": measure(CASES["published"], 12, support=3.0, settle=0.2, sample=0.2)}
    else:
        found = {name: run(flow) for name, flow in CASES.items()}
    rows = []
    for name, case in found.items():
        v, t = case.errors
        exact, flow = case.exact, CASES[name]
        rows.append(
            [
                name,
                f"{flow.speed:.0f}",
                f"{flow.reynolds:.3g}",
                f"{flow.stiffness:.3g}",
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
                "V [m/s]",
                "Re",
                r"$P/\tau$",
                "velocity, largest error / V",
                "temperature / span",
                "stress on the plates / exact [Pa]",
                "heat to the lower plate / exact [W/m^2]",
                "heat to the upper plate / exact [W/m^2]",
                "energy balance",
            ],
            rows,
        ),
        *([] if report.quick else [refined(found["heated"])]),
    )
    figure, axes = subplots(2)
    for (name, case), colour in zip(found.items(), COLOURS, strict=False):
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
