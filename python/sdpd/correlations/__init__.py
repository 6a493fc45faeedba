"""The dynamics of a scene: correlation functions of its waves beside linearised theory.

The command is ``sdpd correlations SCENE.toml``.
"""

from __future__ import annotations

from sdpd.correlations.energy_fits import EnergyWave
from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.correlations.figures import plot, plot_function, write_figure
from sdpd.correlations.files import function_rows, rows, write
from sdpd.correlations.fits import Wave
from sdpd.correlations.plan import Plan, plan_scene
from sdpd.correlations.predictions import predict
from sdpd.correlations.recorder import FUNCTIONS
from sdpd.correlations.report import report
from sdpd.correlations.results import Shell
from sdpd.correlations.study import Study, run_correlations
from sdpd.correlations.wave import WavePrediction

__all__ = [
    "FUNCTIONS",
    "EnergyWave",
    "EnergyWavePrediction",
    "Plan",
    "Shell",
    "Study",
    "Wave",
    "WavePrediction",
    "function_rows",
    "plan_scene",
    "plot",
    "plot_function",
    "predict",
    "report",
    "rows",
    "run_correlations",
    "write",
    "write_figure",
]
