"""Nitrogen with an energy at equilibrium, Tables 9 to 11 of Yang (2013); ``sdpd nitrogen``.

Twenty particle sizes and supports: temperature, kinetic temperature, density, pressure, thermal
speed, the variances of a particle's temperature, velocity, density and pressure, self-diffusion at
short and long times, viscosity and conductivity, each beside what is exact or expected and beside
the published values. Those have three faults: C = 3/2 N k_B of a diatomic gas (in chapter 4), the
gas constant of air, and variances divided by the number of particles, which their "analytical"
columns take from a number density of 3e25 per m^3.
"""

from __future__ import annotations

from sdpd.nitrogen.cases import CASES, FROZEN, PUBLISHED_PARTICLES, Case, scene_of
from sdpd.nitrogen.figures import plot, plot_transport, write_figure
from sdpd.nitrogen.files import write
from sdpd.nitrogen.measure import Measured, Plan, measure
from sdpd.nitrogen.rows import Row
from sdpd.nitrogen.study import DEFAULT, Study, run_nitrogen
from sdpd.nitrogen.transport import Transport
from sdpd.nitrogen.waves import Response

__all__ = [
    "CASES",
    "DEFAULT",
    "FROZEN",
    "PUBLISHED_PARTICLES",
    "Case",
    "Measured",
    "Plan",
    "Response",
    "Row",
    "Study",
    "Transport",
    "measure",
    "plot",
    "plot_transport",
    "run_nitrogen",
    "scene_of",
    "write",
    "write_figure",
]
