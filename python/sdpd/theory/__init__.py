"""Theory to set beside a measurement; each docstring says where the theory is approximate."""

from __future__ import annotations

from .channel_flow import couette_velocity, pipe_velocity, poiseuille_velocity
from .cylinder_array import CylinderArrayFlow, cylinder_array_drag, cylinder_array_flow
from .density import (
    DensityTheory,
    cell_count_variance,
    pairing_limit,
    reduced_equation_of_state,
    stiffness_slope,
)
from .energy_shell import EnergyShell
from .friction import FrictionTheory, friction_coefficients, viscosities
from .heat_and_sound import SoundAndHeat, ThermalHydrodynamicTheory
from .heat_flow import (
    HeatedShear,
    conduction_profile,
    thermal_couette,
    transient_conduction,
)
from .hydrodynamics import HydrodynamicTheory, isothermal_sound_speed
from .kernel_moments import friction_integral, kernel_square_integral, kernel_transform
from .landau_lifshitz import CellVariances, cell_variances
from .tails import finite_size_diffusion, vacf_tail
from .vacf_modes import vacf_modes
from .viscosity import ViscosityTheory
from .wall_flows import (
    duct_velocity,
    oscillating_plate_velocity,
    taylor_couette_torque,
    taylor_couette_velocity,
)

__all__ = [
    "CellVariances",
    "CylinderArrayFlow",
    "DensityTheory",
    "EnergyShell",
    "FrictionTheory",
    "HeatedShear",
    "HydrodynamicTheory",
    "SoundAndHeat",
    "ThermalHydrodynamicTheory",
    "ViscosityTheory",
    "cell_count_variance",
    "cell_variances",
    "conduction_profile",
    "couette_velocity",
    "cylinder_array_drag",
    "cylinder_array_flow",
    "duct_velocity",
    "finite_size_diffusion",
    "friction_coefficients",
    "friction_integral",
    "isothermal_sound_speed",
    "kernel_square_integral",
    "kernel_transform",
    "oscillating_plate_velocity",
    "pairing_limit",
    "pipe_velocity",
    "poiseuille_velocity",
    "reduced_equation_of_state",
    "stiffness_slope",
    "taylor_couette_torque",
    "taylor_couette_velocity",
    "thermal_couette",
    "transient_conduction",
    "vacf_modes",
    "vacf_tail",
    "viscosities",
]
