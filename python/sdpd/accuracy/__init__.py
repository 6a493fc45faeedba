"""What accuracy costs in time: studies over settings of problems whose right answer is known."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdpd.accuracy.advice import AccuracyCost, advise
    from sdpd.accuracy.figures import plot, write_figure
    from sdpd.accuracy.front import pareto
    from sdpd.accuracy.problem import Problem
    from sdpd.accuracy.problems import PROBLEMS
    from sdpd.accuracy.results import Study, write
    from sdpd.accuracy.row import UNITS, Row
    from sdpd.accuracy.run import study
    from sdpd.accuracy.settings import Settings, grid

__all__ = [
    "PROBLEMS",
    "UNITS",
    "AccuracyCost",
    "Problem",
    "Row",
    "Settings",
    "Study",
    "advise",
    "grid",
    "pareto",
    "plot",
    "study",
    "write",
    "write_figure",
]

# Loaded on first use, so that the command line need not load every problem. Name -> module.
_LAZY = {
    "PROBLEMS": "problems",
    "UNITS": "row",
    "AccuracyCost": "advice",
    "Problem": "problem",
    "Row": "row",
    "Settings": "settings",
    "Study": "results",
    "advise": "advice",
    "grid": "settings",
    "pareto": "front",
    "plot": "figures",
    "study": "run",
    "write": "results",
    "write_figure": "figures",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'sdpd.accuracy' has no attribute {name!r}")
    return getattr(importlib.import_module(f"sdpd.accuracy.{_LAZY[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})
