"""Analysis of trajectories: every estimate with its standard error and sampling window.

Arrays are (T, N, D): T equally spaced times, N particles, D components, in any consistent units.
Positions for displacements are unwrapped; for structure they may be wrapped or not.
"""

from __future__ import annotations

from .blocked import BlockedFunction, Profile
from .cells import CellCorrelation, cell_correlation, local_profile
from .correlation import Correlation, autocorrelation, cross_correlation, msd, vacf
from .currents import (
    CurrentCorrelations,
    SoundFit,
    current_correlations,
    fit_sound,
    fit_transverse,
)
from .diffusion import (
    ShortTimeDiffusion,
    einstein_diffusion,
    green_kubo_diffusion,
    local_diffusivity,
    running_diffusion,
    short_time_diffusion,
)
from .distributions import QuantileData, probability_density, quantiles
from .estimate import (
    Bonferroni,
    Estimate,
    Homogeneity,
    bonferroni,
    combine,
    ensemble,
    homogeneity,
    jackknife,
)
from .fourier import (
    StructureFactor,
    allowed_wave_vectors,
    cell_variance,
    fourier_components,
    structure_factor,
)
from .heat import (
    einstein_conductivity,
    green_kubo_conductivity,
    heat_autocorrelation,
    heat_increments,
    running_conductivity,
)
from .statistics import (
    AutocorrelationTime,
    Blocking,
    block_average,
    blocking,
    integrated_autocorrelation_time,
    time_average,
)
from .stress import (
    VirialPressure,
    bulk_component,
    einstein_viscosity,
    green_kubo_viscosity,
    helfand_increments,
    running_viscosity,
    stress_autocorrelation,
    virial_pressure,
)
from .structure import (
    SpatialCorrelation,
    SphericalModel,
    fit_spherical_model,
    radial_distribution,
    semivariogram,
    spatial_correlation,
)

__all__ = [
    "AutocorrelationTime",
    "BlockedFunction",
    "Blocking",
    "Bonferroni",
    "CellCorrelation",
    "Correlation",
    "CurrentCorrelations",
    "Estimate",
    "Homogeneity",
    "Profile",
    "QuantileData",
    "ShortTimeDiffusion",
    "SoundFit",
    "SpatialCorrelation",
    "SphericalModel",
    "StructureFactor",
    "VirialPressure",
    "allowed_wave_vectors",
    "autocorrelation",
    "block_average",
    "blocking",
    "bonferroni",
    "bulk_component",
    "cell_correlation",
    "cell_variance",
    "combine",
    "cross_correlation",
    "current_correlations",
    "einstein_conductivity",
    "einstein_diffusion",
    "einstein_viscosity",
    "ensemble",
    "fit_sound",
    "fit_spherical_model",
    "fit_transverse",
    "fourier_components",
    "green_kubo_conductivity",
    "green_kubo_diffusion",
    "green_kubo_viscosity",
    "heat_autocorrelation",
    "heat_increments",
    "helfand_increments",
    "homogeneity",
    "integrated_autocorrelation_time",
    "jackknife",
    "local_diffusivity",
    "local_profile",
    "msd",
    "probability_density",
    "quantiles",
    "radial_distribution",
    "running_conductivity",
    "running_diffusion",
    "running_viscosity",
    "semivariogram",
    "short_time_diffusion",
    "spatial_correlation",
    "stress_autocorrelation",
    "structure_factor",
    "time_average",
    "vacf",
    "virial_pressure",
]
