"""Fluctuating hydrodynamics with particles: smoothed dissipative particle dynamics (SDPD).

A `Scene` says what is simulated, a `Simulation` does it. Units: any consistent set, SI by default.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from sdpd import compensation, discretization, fluids, kernels, timestep, walls
from sdpd import equations_of_state as eos
from sdpd.adaptive import AdaptiveStep
from sdpd.box import Box
from sdpd.cost import Cost
from sdpd.discretization import DiscreteFactors
from sdpd.effects import Effects, SinusoidalForce, UniformForce
from sdpd.errors import (
    CheckpointError,
    PairingWarning,
    RegimeWarning,
    ResolutionWarning,
    SdpdWarning,
    SimulationError,
    TimeStepWarning,
)
from sdpd.fluids import Fluid
from sdpd.initial import LatticeStart, RandomStart
from sdpd.integrators import PairSplitting, VelocityVerlet
from sdpd.regime import Regime
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.wall_heat import Adiabatic, HeatFlux, Isothermal
from sdpd.wall_models import Completion, FrozenParticles, OwnFootImages, SymmetricImages
from sdpd.walls import Cylinder, LevelSet, Mesh, Plane, Polyline, Sphere

if TYPE_CHECKING:
    from sdpd import analysis, fields, h5md, interop, plot, simulation
    from sdpd.checkpoint import load
    from sdpd.h5md import Trajectory
    from sdpd.observers import (
        BinAverage,
        Correlator,
        CurrentCorrelator,
        FieldAverage,
        HeatCurrent,
        HeatCurrentCorrelator,
        Observer,
        Profile,
        Stress,
        StressCorrelator,
        Thermodynamics,
        WallForces,
    )
    from sdpd.simulation import Simulation

__version__: str

__all__ = [
    "AdaptiveStep",
    "Adiabatic",
    "BinAverage",
    "Box",
    "CheckpointError",
    "Completion",
    "Correlator",
    "Cost",
    "CurrentCorrelator",
    "Cylinder",
    "DiscreteFactors",
    "Effects",
    "FieldAverage",
    "Fluid",
    "FrozenParticles",
    "HeatCurrent",
    "HeatCurrentCorrelator",
    "HeatFlux",
    "Isothermal",
    "LatticeStart",
    "LevelSet",
    "Mesh",
    "Observer",
    "OwnFootImages",
    "PairSplitting",
    "PairingWarning",
    "Plane",
    "Polyline",
    "Profile",
    "RandomStart",
    "Regime",
    "RegimeWarning",
    "Resolution",
    "ResolutionWarning",
    "Scene",
    "SdpdWarning",
    "Simulation",
    "SimulationError",
    "SinusoidalForce",
    "Sphere",
    "Stress",
    "StressCorrelator",
    "SymmetricImages",
    "Thermodynamics",
    "TimeStepWarning",
    "Trajectory",
    "UniformForce",
    "VelocityVerlet",
    "WallForceProfile",
    "WallForces",
    "analysis",
    "compensation",
    "discretization",
    "eos",
    "fields",
    "fluids",
    "h5md",
    "interop",
    "kernels",
    "load",
    "plot",
    "simulation",
    "timestep",
    "walls",
]

# Loaded on first use, so that `import sdpd` costs NumPy and little more. Name -> module, attribute.
_LAZY: dict[str, tuple[str, str | None]] = {
    "BinAverage": ("sdpd.observers", "BinAverage"),
    "Correlator": ("sdpd.observers", "Correlator"),
    "Profile": ("sdpd.observers", "Profile"),
    "WallForceProfile": ("sdpd.observers", "WallForceProfile"),
    "WallForces": ("sdpd.observers", "WallForces"),
    "CurrentCorrelator": ("sdpd.observers", "CurrentCorrelator"),
    "FieldAverage": ("sdpd.observers", "FieldAverage"),
    "HeatCurrent": ("sdpd.observers", "HeatCurrent"),
    "HeatCurrentCorrelator": ("sdpd.observers", "HeatCurrentCorrelator"),
    "Observer": ("sdpd.observers", "Observer"),
    "Simulation": ("sdpd.simulation", "Simulation"),
    "Stress": ("sdpd.observers", "Stress"),
    "StressCorrelator": ("sdpd.observers", "StressCorrelator"),
    "Thermodynamics": ("sdpd.observers", "Thermodynamics"),
    "Trajectory": ("sdpd.h5md", "Trajectory"),
    "accuracy": ("sdpd.accuracy", None),
    "analysis": ("sdpd.analysis", None),
    "bench": ("sdpd.bench", None),
    "checkpoint": ("sdpd.checkpoint", None),
    "channel": ("sdpd.channel", None),
    "cli": ("sdpd.cli", None),
    "conductivity": ("sdpd.conductivity", None),
    "correlations": ("sdpd.correlations", None),
    "diffusion": ("sdpd.diffusion", None),
    "effects_study": ("sdpd.effects_study", None),
    "fields": ("sdpd.fields", None),
    "fluctuations": ("sdpd.fluctuations", None),
    "h5md": ("sdpd.h5md", None),
    "interop": ("sdpd.interop", None),
    "load": ("sdpd.checkpoint", "load"),
    "nitrogen": ("sdpd.nitrogen", None),
    "observers": ("sdpd.observers", None),
    "plot": ("sdpd.plot", None),
    "scenes": ("sdpd.scenes", None),
    "simulation": ("sdpd.simulation", None),
    "theory": ("sdpd.theory", None),
    "viscosity": ("sdpd.viscosity", None),
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            return version("sdpd")
        except PackageNotFoundError:  # a source tree that is not installed
            return "0.0.0"
    if name not in _LAZY:
        raise AttributeError(f"module 'sdpd' has no attribute {name!r}")
    module_name, attribute = _LAZY[name]
    module = importlib.import_module(module_name)
    return module if attribute is None else getattr(module, attribute)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY, "__version__"})
