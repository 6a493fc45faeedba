"""Observers sample a running simulation: some inside the compiled loop, some between its calls."""

from __future__ import annotations

from .base import LoopObserver, Observer, check_observers
from .correlator import Correlator
from .currents import CurrentCorrelator
from .fields import BinAverage, FieldAverage
from .heat_current import HeatCurrent, HeatCurrentCorrelator
from .lagged import LaggedObserver
from .profile import Profile
from .stress import Stress, StressCorrelator
from .thermodynamics import Thermodynamics
from .wall_force_profile import WallForceProfile
from .wall_forces import WallForces

__all__ = [
    "BinAverage",
    "Correlator",
    "CurrentCorrelator",
    "FieldAverage",
    "HeatCurrent",
    "HeatCurrentCorrelator",
    "LaggedObserver",
    "LoopObserver",
    "Observer",
    "Profile",
    "Stress",
    "StressCorrelator",
    "Thermodynamics",
    "WallForceProfile",
    "WallForces",
    "check_observers",
]
