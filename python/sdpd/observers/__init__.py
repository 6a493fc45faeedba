"""Observers sample a running simulation: some inside the compiled loop, some between its calls."""

from __future__ import annotations

from .base import LoopObserver, Observer, check_observers
from .correlator import Correlator
from .currents import CurrentCorrelator
from .lagged import LaggedObserver
from .stress import Stress, StressCorrelator
from .thermodynamics import Thermodynamics

__all__ = [
    "Correlator",
    "CurrentCorrelator",
    "LaggedObserver",
    "LoopObserver",
    "Observer",
    "Stress",
    "StressCorrelator",
    "Thermodynamics",
    "check_observers",
]
