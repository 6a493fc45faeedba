"""The main job: self-diffusion of an SDPD fluid against the size of its particles.

Tables 7 and 8 of Yang (2013), run at one stiffness, against exact and approximate theory; the
command is ``sdpd diffusion``.

Examples
--------
>>> import sdpd
>>> study = sdpd.diffusion.run_study(cases=[3], quick=True, particles=216, processes=1)
>>> study.results[0].exact.relative < 0.01
True
"""

from __future__ import annotations

from sdpd.diffusion.cases import (
    DEFAULT_CASES,
    EQUATIONS_OF_STATE,
    EXPERIMENTAL_WATER,
    TABLES,
    Case,
    Formulas,
    formulas,
    get_cases,
)
from sdpd.diffusion.collective import CollectiveTheory, collective_theory
from sdpd.diffusion.figures import plot_diffusion, plot_schmidt, write_figures
from sdpd.diffusion.files import rows, write
from sdpd.diffusion.measure import Sample, run_replica
from sdpd.diffusion.plan import CORE_MINUTES, Plan, plan_case, quick_plan
from sdpd.diffusion.published import Recomputed, recomputed
from sdpd.diffusion.report import report, tables
from sdpd.diffusion.results import CaseResult, Limits, assess, evaluate
from sdpd.diffusion.study import QUICK_PARTICLES, Study, run_study

__all__ = [
    "CORE_MINUTES",
    "DEFAULT_CASES",
    "EQUATIONS_OF_STATE",
    "EXPERIMENTAL_WATER",
    "QUICK_PARTICLES",
    "TABLES",
    "Case",
    "CaseResult",
    "CollectiveTheory",
    "Formulas",
    "Limits",
    "Plan",
    "Recomputed",
    "Sample",
    "Study",
    "assess",
    "collective_theory",
    "evaluate",
    "formulas",
    "get_cases",
    "plan_case",
    "plot_diffusion",
    "plot_schmidt",
    "quick_plan",
    "recomputed",
    "report",
    "rows",
    "run_replica",
    "run_study",
    "tables",
    "write",
    "write_figures",
]
