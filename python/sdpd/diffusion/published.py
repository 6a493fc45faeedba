"""The printed columns of Tables 7 and 8 computed again from the printed inputs.

What differs is a misprint or an error of the dissertation, and named in docs/theory/errata.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sdpd.diffusion.cases import DISSERTATION_FACTOR, Case

__all__ = ["Recomputed", "recomputed"]


@dataclass(frozen=True, kw_only=True)
class Recomputed:
    """Columns of one case, SI units.

    Attributes
    ----------
    mass_ratio, size_ratio : float
        m = rho L^3/N over the mass of a molecule, dx over its size (Y 3.3, 3.4) [1].
    speed : float
        sqrt(3 k_B T/m), which the printed rms speed is said to equal [m/s].
    temperature : float
        At which the printed rms speed would be that one [K].
    bird : float
        k_B T/(2 pi eta dx), Y 3.7 [m^2/s].
    support : float
        Y 3.8 with the printed mean density, rho h^2 k_B T/(63 m eta) [m^2/s].
    """

    mass_ratio: float
    size_ratio: float
    speed: float
    temperature: float
    bird: float
    support: float


def recomputed(case: Case) -> Recomputed:
    """Compute the columns of a case of Table 7 or 8.

    Raises
    ------
    ValueError
        If the fluid does not know its molecules.
    """
    scene = case.scene()
    fluid, mass, energy = scene.fluid, scene.particle_mass, scene.thermal_energy
    if fluid.molecular_mass is None or fluid.molecular_diameter is None:
        raise ValueError("`case.fluid` must be one that knows its molecules")
    eta, h = fluid.shear_viscosity, case.support_radius
    return Recomputed(
        mass_ratio=mass / fluid.molecular_mass,
        size_ratio=scene.spacing / fluid.molecular_diameter,
        speed=math.sqrt(3.0 * energy / mass),
        temperature=mass * case.published_speed**2 / (3.0 * fluid.boltzmann_constant),
        bird=energy / (2.0 * math.pi * eta * scene.spacing),
        support=DISSERTATION_FACTOR * case.published_density * h**2 * energy / (mass * eta),
    )
