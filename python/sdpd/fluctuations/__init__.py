"""The equilibrium of a scene: every variance and correlation beside its prediction.

The command is ``sdpd fluctuations SCENE.toml``.
"""

from __future__ import annotations

from sdpd.fluctuations.energy_items import EnergyPrediction
from sdpd.fluctuations.figures import plot, write_figure
from sdpd.fluctuations.files import rows, write
from sdpd.fluctuations.item import Item
from sdpd.fluctuations.plan import Plan, plan_scene
from sdpd.fluctuations.predictions import DensityPrediction
from sdpd.fluctuations.report import report
from sdpd.fluctuations.results import compare, judge
from sdpd.fluctuations.sampler import Sampler
from sdpd.fluctuations.study import Study, run_fluctuations

__all__ = [
    "DensityPrediction",
    "EnergyPrediction",
    "Item",
    "Plan",
    "Sampler",
    "Study",
    "compare",
    "judge",
    "plan_scene",
    "plot",
    "report",
    "rows",
    "run_fluctuations",
    "write",
    "write_figure",
]
