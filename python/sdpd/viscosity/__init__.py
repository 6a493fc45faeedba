"""The viscosity a scene delivers, measured in independent ways beside what was asked for.

Decay of a shear wave on a lattice without noise; transverse currents, the Helfand moment and the
Green-Kubo integral at equilibrium; the answer to a weak sinusoidal force. The command is
``sdpd viscosity SCENE.toml``.
"""

from __future__ import annotations

from sdpd.agreement import Comparison, judge
from sdpd.viscosity.arrangement import Arrangement
from sdpd.viscosity.figures import plot, write_figure
from sdpd.viscosity.files import rows, write
from sdpd.viscosity.forcing import measure_forced
from sdpd.viscosity.lattice import LatticeDecay, measure_lattice
from sdpd.viscosity.plan import Plan, plan_scene, sample_scene
from sdpd.viscosity.predictions import viscosity_theory
from sdpd.viscosity.report import report
from sdpd.viscosity.results import Method
from sdpd.viscosity.study import Study, run_viscosity
from sdpd.viscosity.transverse import Shell

__all__ = [
    "Arrangement",
    "Comparison",
    "LatticeDecay",
    "Method",
    "Plan",
    "Shell",
    "Study",
    "judge",
    "measure_forced",
    "measure_lattice",
    "plan_scene",
    "plot",
    "report",
    "rows",
    "run_viscosity",
    "sample_scene",
    "viscosity_theory",
    "write",
    "write_figure",
]
