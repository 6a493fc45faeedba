"""The twenty cases of Tables 9 to 11 of Yang (2013), as printed, and their scenes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sdpd import fluids
from sdpd.box import Box
from sdpd.effects import Effects
from sdpd.errors import silenced
from sdpd.initial import LatticeStart, Start
from sdpd.resolution import Resolution
from sdpd.scene import Scene

__all__ = ["CASES", "FROZEN", "PUBLISHED_PARTICLES", "Case", "scene_of"]

PUBLISHED_PARTICLES = 3375
# Stiffness m c^2/kT beyond which particles are a glass: their arrangement runs down for longer than
# any run, and the elastic energy that it gives off keeps their motion hotter than they are.
FROZEN = 2e4


@dataclass(frozen=True)
class Case:
    """One row of Tables 9, 10 and 11; variances as printed, those of particles divided by 3375.

    Attributes
    ----------
    number : int
    edge, spacing, support : float
        [m].
    density, temperature, pressure, speed : float
        Published means [kg/m^3], [K], [Pa], [m/s].
    temperature_variance, density_variance, pressure_variance, velocity_variance : float
        Published [K^2], [kg^2/m^6], [Pa^2], [m^2/s^2].
    diffusion, viscosity : float
        Published [m^2/s], [Pa s].
    box_temperature_variance, box_density_variance : float
    box_pressure_variance, box_velocity_variance : float
        Published as "analytical", in the same units: variances of the whole box, at a number
        density of 3e25 per m^3.
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
    diffusion: float
    viscosity: float
    box_temperature_variance: float
    box_density_variance: float
    box_pressure_variance: float
    box_velocity_variance: float


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
# case, D, eta; "analytical" variances of T, rho, P, V
_MORE = """
1 3.1e-9 4e-5 0.127 3.04e-6 22373 0.6714
2 4.1e-9 2e-5 0.127 3.01e-6 22208 0.6714
3 5.8e-9 3e-5 0.127 3.00e-6 22108 0.6714
4 8.5e-9 2e-5 0.127 2.99e-6 22086 0.6714
5 1.4e-9 4.5e-5 1.2e-2 2.81e-7 2074 6.3e-2
6 2.4e-9 1.5e-5 1.2e-2 2.83e-7 2090 6.3e-2
7 2.7e-9 2e-5 1.2e-2 2.81e-7 2079 6.3e-2
8 4.2e-9 1.5e-5 1.2e-2 2.81e-7 2075 6.3e-2
9 0.3e-9 1e-5 2e-3 4.63e-8 341 1.05e-2
10 0.7e-9 1.5e-5 2e-3 4.63e-8 342 1.05e-2
11 1.4e-9 1e-5 2e-3 3.11e-8 345 1.05e-2
12 2.9e-9 1.5e-5 2e-3 4.67e-8 345 1.05e-2
13 0.21e-9 3e-5 1.3e-4 2.96e-9 21.8 6.69e-4
14 0.3e-9 3e-5 1.3e-4 2.95e-9 21.8 6.69e-4
15 0.4e-9 2e-5 1.3e-4 2.95e-9 21.8 6.69e-4
16 0.65e-9 2.5e-5 1.3e-4 2.93e-9 21.8 6.69e-4
17 0.0365e-9 1e-5 2.0e-6 4.59e-11 0.3387 1.05e-5
18 0.0259e-9 1e-5 2.0e-6 4.57e-11 0.3377 1.05e-5
19 0.044e-9 1e-5 2.0e-6 4.65e-11 0.3434 1.05e-5
20 0.1e-9 3e-5 2.0e-6 4.58e-11 0.3378 1.05e-5
"""


def _table(text: str) -> dict[int, list[float]]:
    rows = (line.split() for line in text.strip().splitlines())
    return {int(number): [float(value) for value in rest] for number, *rest in rows}


_FOUND = _table(_MORE)
CASES: dict[int, Case] = {n: Case(n, *row, *_FOUND[n]) for n, row in _table(_ROWS).items()}


def scene_of(
    case: Case,
    *,
    kernel: str,
    heat_capacity: float,
    particles: int | None,
    start: Start | None = None,
) -> Scene:
    """The gas of a case in a periodic cube of the size that is asked for, at its spacing.

    It starts from a lattice if `start` is None.
    """
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
    with silenced():  # the table has the support that it has
        return Scene(
            fluid=fluid,
            box=Box((side * case.spacing,) * 3),
            resolution=Resolution(particles=side**3, support=ratio, kernel=kernel),
            start=LatticeStart() if start is None else start,
            effects=Effects(energy=True),
        )
