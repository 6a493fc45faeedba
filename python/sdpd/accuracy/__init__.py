"""What accuracy costs in time: studies over settings of problems whose right answer is known."""

from __future__ import annotations

from sdpd.accuracy.figures import plot, write_figure
from sdpd.accuracy.pareto import pareto
from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems import PROBLEMS
from sdpd.accuracy.results import Study, write
from sdpd.accuracy.row import UNITS, Row
from sdpd.accuracy.settings import Settings, grid
from sdpd.accuracy.study import study

__all__ = [
    "PROBLEMS",
    "UNITS",
    "Problem",
    "Row",
    "Settings",
    "Study",
    "grid",
    "pareto",
    "plot",
    "study",
    "write",
    "write_figure",
]
