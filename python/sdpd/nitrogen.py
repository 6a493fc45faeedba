"""Nitrogen with an energy at equilibrium, Tables 9 to 11 of Yang (2013); ``sdpd nitrogen``.

Twenty particle sizes and supports: temperature, kinetic temperature, density, pressure, thermal
speed and the variances of a particle's temperature, velocity, density and pressure, each beside
what is exact or expected and beside the published values. Those have three faults: C = 3/2 N k_B
of a diatomic gas (in chapter 4), the gas constant of air, and variances divided by the number of
particles, which their "analytical" columns take from a number density of 3e25 per m^3.
"""

from __future__ import annotations

import csv
import math
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd import fluids, validation
from sdpd.analysis.estimate import Estimate
from sdpd.box import Box
from sdpd.drawing import BLUE, GREEN, ORANGE, VERMILION, figure_or_new, save
from sdpd.effects import Effects
from sdpd.errors import SdpdWarning
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.units import table

__all__ = ["CASES", "Case", "Measured", "Study", "plot", "run_nitrogen", "write", "write_figure"]

PUBLISHED_PARTICLES = 3375
DEFAULT = (1, 5, 9, 13, 17)  # the finest support of each particle size
BLOCKS = 32
LARGEST_T = 4.0  # in standard errors, with 31 degrees of freedom (p = 4e-4) and five rows a case
LARGEST_ERROR = 0.007  # relative, of what is judged
# Stiffness m c^2/kT beyond which particles are a glass: their arrangement runs down for longer than
# any run, and the elastic energy that it gives off keeps their motion hotter than they are.
FROZEN = 2e4
_SIZE = (9.0, 3.6)  # inch


@dataclass(frozen=True)
class Case:
    """One row of Tables 9, 10 and 11; variances as printed, divided by 3375.

    Attributes
    ----------
    number : int
    edge, spacing, support : float
        [m].
    temperature, density, pressure, speed : float
        Published means [K], [kg/m^3], [Pa], [m/s].
    temperature_variance, density_variance, pressure_variance, velocity_variance : float
        Published [K^2], [kg^2/m^6], [Pa^2], [m^2/s^2].
    """

    number: int
    edge: float
    spacing: float
    support: float
    density: float
    temperature: float
    pressure: float
    speed: float
    temperature_variance: float
    density_variance: float
    pressure_variance: float
    velocity_variance: float


# case, L, dx, h; rho, T, P, c_rms; variances of T, rho, P, V
_ROWS = """
1 0.25e-6 1.67e-8 3.7e-8 1.193 299.2 102410 47.64 0.1468 3.13e-7 19478 0.6733
2 0.25e-6 1.67e-8 4.7e-8 1.188 299.25 102030 47.64 0.1467 1.42e-7 18134 0.6736
3 0.25e-6 1.67e-8 5.9e-8 1.185 299.25 101800 47.75 0.1475 6.53e-8 17504 0.6733
4 0.25e-6 1.67e-8 7.5e-8 1.184 299.3 101750 47.64 0.1456 2.94e-8 17042 0.6739
5 0.55e-6 3.67e-8 9e-8 1.184 299.41 101752 14.59 1.39e-2 3.53e-8 1866 6.28e-2
6 0.55e-6 3.67e-8 11e-8 1.188 299.5 102155 14.63 1.39e-2 1.88e-8 1749 6.35e-2
7 0.55e-6 3.67e-8 12.9e-8 1.185 299.43 101867 14.59 1.39e-2 9.84e-9 1682 6.3e-2
8 0.55e-6 3.67e-8 16.5e-8 1.184 299.40 101775 14.56 1.37e-2 3.85e-9 1615 6.26e-2
9 1e-6 6.67e-8 15e-8 1.178 299.41 101227 5.96 2.34e-3 3.27e-8 392 1.05e-2
10 1e-6 6.67e-8 19e-8 1.178 299.43 101228 5.96 2.31e-3 1.26e-8 329 1.04e-2
11 1e-6 6.67e-8 24e-8 1.183 299.42 101684 5.96 2.33e-3 1.56e-8 359 1.05e-2
12 1e-6 6.67e-8 29.5e-8 1.184 299.47 101729 5.96 2.33e-3 4.59e-9 345 1.06e-2
13 2.5e-6 16.7e-8 38e-8 1.177 299.41 101160 1.53 1.49e-4 1.94e-8 159 6.92e-4
14 2.5e-6 16.7e-8 50e-8 1.176 299.41 101052 1.52 1.49e-4 9.00e-9 82.2 6.84e-4
15 2.5e-6 16.7e-8 59e-8 1.176 299.42 101065 1.61 1.49e-4 6.85e-8 524 6.73e-4
16 2.5e-6 16.7e-8 75e-8 1.172 299.40 100752 1.52 1.49e-4 6.60e-8 500 6.69e-4
17 10e-6 66.7e-8 150e-8 1.173 299.4 100803 0.195 2.31e-6 1.67e-7 1231 1.13e-5
18 10e-6 66.7e-8 190e-8 1.171 299.4 100664 0.190 2.34e-6 1.42e-7 1049 1.06e-5
19 10e-6 66.7e-8 240e-8 1.181 299.4 101506 0.187 2.3e-6 1.17e-8 86.53 1.05e-5
20 10e-6 66.7e-8 290e-8 1.172 299.4 100670 0.187 2.3e-6 5.63e-8 416 1.05e-5
"""


def _cases() -> dict[int, Case]:
    rows = (line.split() for line in _ROWS.strip().splitlines())
    return {int(number): Case(int(number), *map(float, rest)) for number, *rest in rows}


CASES: dict[int, Case] = _cases()


@dataclass(frozen=True)
class Row:
    """A quantity of a case: measured, expected, published; `judged` where the theory is exact."""

    name: str
    unit: str
    measured: Estimate
    expected: float
    published: float | None
    judged: bool

    @property
    def t(self) -> float:
        """Distance from what is expected in standard errors."""
        return self.measured.z(self.expected)

    @property
    def passed(self) -> bool:
        """Within `LARGEST_T` standard errors that are small enough to tell; else not judged."""
        if not self.judged:
            return True
        return abs(self.t) < LARGEST_T and self.measured.relative < LARGEST_ERROR


@dataclass(frozen=True)
class Measured:
    """A case that was run."""

    case: Case
    scene: Scene
    rows: tuple[Row, ...]
    energy_change: float  # relative
    refused: int
    steps: int


@dataclass(frozen=True)
class Study:
    """Cases of Tables 9 to 11; ``print`` shows the table."""

    cases: tuple[Measured, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether all that is exact was met."""
        return all(row.passed for case in self.cases for row in case.rows)

    def __str__(self) -> str:
        first = self.cases[0].scene
        gamma = f"{first.adiabatic_ratio:.3f}"
        head = (
            f"nitrogen with an energy at equilibrium: kernel {first.resolution.kernel}, gamma = "
            f"{gamma}, {self.seconds:.0f} s\nvariances of particles; those of Yang (2013) times "
            f"{PUBLISHED_PARTICLES}"
        )
        rows = []
        for found in self.cases:
            for row in found.rows:
                published = "" if row.published is None else f"{row.published:.5g}"
                verdict = f"{row.t:+.1f}" if row.judged else "not judged"
                number = str(found.case.number) if row is found.rows[0] else ""
                shown = f"{row.measured.value:.6g} ± {row.measured.stderr:.2g}"
                rows.append(
                    [number, f"{row.name} [{row.unit}]", shown, f"{row.expected:.6g}", verdict]
                    + [published]
                )
        names = ["case", "quantity", "measured", "expected", "t", "Yang (2013)"]
        books = max(abs(found.energy_change) for found in self.cases)
        if any(found.scene.stiffness >= FROZEN for found in self.cases):
            names_of = ", ".join(
                str(found.case.number) for found in self.cases if found.scene.stiffness >= FROZEN
            )
            head += (
                f"\ncases {names_of} are glasses (m c^2/kT >= {FROZEN:g}): their arrangement runs "
                "down for longer than any run, and keeps their motion hot"
            )
        end = (
            f"energy held to {books:.0e}; what is exact was {'' if self.passed else 'NOT '}met "
            f"(|t| < {LARGEST_T:g}, errors below {LARGEST_ERROR:.1%})"
        )
        return f"{head}\n\n{table(rows, names)}\n\n{end}"


def scene_of(case: Case, *, kernel: str, heat_capacity: float, particles: int | None) -> Scene:
    """The gas of a case in a periodic cube of the size that is asked for, at its spacing."""
    ratio = case.support / case.spacing
    least = math.ceil(2.0 * ratio + 1e-9)
    side = max(8, least) if particles is None else max(round(particles ** (1.0 / 3.0)), least)
    gas = fluids.nitrogen()
    assert gas.molecular_mass is not None
    fluid = gas.replace(
        viscosity_exponent=0.7,
        conductivity_exponent=0.7,
        heat_capacity=heat_capacity * gas.boltzmann_constant / gas.molecular_mass,
    )
    with warnings.catch_warnings():  # the table has the support that it has
        warnings.simplefilter("ignore", SdpdWarning)
        return Scene(
            fluid=fluid,
            box=Box((side * case.spacing,) * 3),
            resolution=Resolution(particles=side**3, support=ratio, kernel=kernel),
            effects=Effects(energy=True),
        )


def _measure(case: Case, scene: Scene, seed: int, samples: int, threads: int | None) -> Measured:
    from sdpd.simulation import Simulation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SdpdWarning)
        sim = Simulation(scene, seed=seed, threads=threads)
    fluid, number = scene.fluid, scene.n_particles
    k = scene.heat_capacity_number
    sim.run(steps=600, progress=False)
    energy = sim.total_energy
    freedom = 1.5 * (number - 1)
    whole = number * k + freedom
    # the energy of an ideal gas is that of its temperatures
    mean = float(energy / (whole * fluid.boltzmann_constant))
    blocks = []
    for _ in range(BLOCKS):
        values = []
        for _ in range(samples):
            sim.run(steps=5, progress=False)
            t, d, p = (np.asarray(x) for x in (sim.temperatures, sim.densities, sim.pressures))
            v = np.asarray(sim.velocities) - sim.velocities.mean(axis=0)
            square = float(np.square(v).sum()) / (3.0 * (number - 1))
            values.append(
                [t.mean(), sim.temperature, d.mean(), p.mean(), np.square(t - mean).mean()]
                + [3.0 * square, d.var(), p.var()]
            )
        blocks.append(np.mean(values, axis=0))
    series: NDArray[np.float64] = np.asarray(blocks)
    found = [
        Estimate(float(column.mean()), float(column.std(ddof=1) / math.sqrt(BLOCKS)), BLOCKS)
        for column in series.T
    ]
    moves = scene.stiffness < FROZEN
    kt = float(fluid.boltzmann_constant * mean)
    gas = kt / (fluid.molecular_mass or 1.0)
    deviation = scene.density_deviation
    v = math.nan if deviation is None else deviation**2
    rho = found[2].value
    warm = (whole - k) / (k * (whole + 1.0))
    scale = float(PUBLISHED_PARTICLES)
    rows = (
        Row("T", "K", found[0], mean, case.temperature, moves),
        Row("T_kin", "K", found[1], mean, case.temperature, moves),
        Row("rho", "kg/m^3", found[2], rho, case.density, False),
        Row("P", "Pa", found[3], rho * gas, case.pressure, False),
        Row("Var T", "K^2", found[4], warm * mean**2, scale * case.temperature_variance, moves),
        Row(
            "Var V",
            "m^2/s^2",
            found[5],
            3.0 * kt / scene.particle_mass,
            scale * case.velocity_variance,
            moves,
        ),
        Row("Var rho", "kg^2/m^6", found[6], v * rho**2, scale * case.density_variance, False),
        Row(
            "Var P",
            "Pa^2",
            found[7],
            (warm + v + warm * v) * (rho * gas) ** 2,
            scale * case.pressure_variance,
            False,
        ),
    )
    change = (sim.total_energy - energy) / energy
    return Measured(case, scene, rows, change, sim.energy_accounts().refused, sim.step)


def run_nitrogen(
    cases: Sequence[int] | None = None,
    *,
    kernel: str = "wendland_c2",
    heat_capacity: float = 2.5,
    particles: int | None = None,
    quick: bool = False,
    seed: int = 1,
    threads: int | None = None,
) -> Study:
    """Run cases of Tables 9 to 11 at equilibrium.

    Parameters
    ----------
    cases : sequence of int, optional
        1 to 20; (1, 5, 9, 13, 17) if None.
    kernel : str
        The published Lucy kernel pairs beyond 287 molecules a particle, from case 5 on.
    heat_capacity : float
        C/(N k_B) [1]: 5/2 of a diatomic gas, 3/2 in chapter 4 of the dissertation.
    particles : int, optional
        About so many, 3375 as published; 512 or what two supports ask for if None.
    quick : bool
        A fifth of the samples: errors are then too large to judge by.
    seed : int
    threads : int, optional
        As for a `Simulation`.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Examples
    --------
    >>> from sdpd import nitrogen
    >>> nitrogen.CASES[1].spacing
    1.67e-08
    """
    from sdpd import kernels

    numbers = DEFAULT if cases is None else tuple(cases)
    for number in numbers:
        validation.integer("cases", number, minimum=1, maximum=len(CASES))
    if not numbers:
        raise ValueError("`cases` must name at least one of 1 to 20, got none")
    validation.choice("kernel", kernel, kernels.names())
    capacity = validation.positive("heat_capacity", heat_capacity)
    if particles is not None:
        particles = validation.integer("particles", particles, minimum=8)
    samples = 8 if validation.boolean("quick", quick) else 40
    begun = perf_counter()
    found = []
    for number in numbers:
        case = CASES[number]
        scene = scene_of(case, kernel=kernel, heat_capacity=capacity, particles=particles)
        found.append(_measure(case, scene, seed, samples, threads))
    return Study(tuple(found), perf_counter() - begun)


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write nitrogen.csv, a row for each case and quantity, and nitrogen.txt, the table."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"nitrogen.{ending}" for ending in ("csv", "txt")]
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["case", "quantity", "unit", "measured", "stderr", "expected", "judged", "published"]
        )
        for found in study.cases:
            for row in found.rows:
                values = [row.measured.value, row.measured.stderr, row.expected, row.judged]
                writer.writerow(
                    [found.case.number, row.name, row.unit, *values, row.published or ""]
                )
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths


def plot(study: Study, figure: Any = None) -> Any:
    """Draw measured and published variances over the expected ones, case by case.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    figure = figure_or_new(figure, _SIZE)
    axes = figure.subplots(1, 2)
    numbers = [found.case.number for found in study.cases]
    panels = (("Var T", "Var V"), ("Var rho", "Var P"))
    for axis, names in zip(axes, panels, strict=True):
        for name, colour, other in zip(names, (BLUE, GREEN), (VERMILION, ORANGE), strict=True):
            rows = [row for found in study.cases for row in found.rows if row.name == name]
            ratio = [row.measured.value / row.expected for row in rows]
            error = [row.measured.stderr / row.expected for row in rows]
            axis.errorbar(numbers, ratio, error, fmt="o", ms=4, color=colour, label=name)
            theirs = [(row.published or math.nan) / row.expected for row in rows]
            axis.plot(numbers, theirs, "x", color=other, label=f"{name}, Yang (2013)")
        axis.axhline(1.0, color="0.5", linewidth=0.8)
        axis.set(xlabel="case", ylabel="variance over the expected one [1]")
        axis.set_yscale("log")
        axis.set_xticks(numbers)
        axis.grid(color="0.9", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.legend(fontsize=8)
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write nitrogen.png, the drawing of `plot`; the folder is made if need be."""
    return save(lambda figure: plot(study, figure), folder, "nitrogen", size=_SIZE)
