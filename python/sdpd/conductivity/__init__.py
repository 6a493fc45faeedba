"""The thermal conductivity that a fluid of particles delivers, measured in independent ways.

`decay`: a wave of temperature on the undisturbed lattice, without noise: exact, and to be compared
with the sum over the lattice. `imposed_gradient`: heat through a slab between plates of different
temperatures, with the noise of the scene. `equilibrium`: the fluctuations of the current of heat.
The command is ``sdpd conductivity SCENE.toml``.
"""

from __future__ import annotations

from sdpd.conductivity.equilibrium import Equilibrium, HeatMoment, equilibrium
from sdpd.conductivity.figures import plot, write_figure
from sdpd.conductivity.gradient import imposed_gradient
from sdpd.conductivity.lattice import Decay, decay, lattice_conductivity
from sdpd.conductivity.predictions import Prediction, predict
from sdpd.conductivity.report import report, rows, write
from sdpd.conductivity.study import Study, run_conductivity

__all__ = [
    "Decay",
    "Equilibrium",
    "HeatMoment",
    "Prediction",
    "Study",
    "decay",
    "equilibrium",
    "imposed_gradient",
    "lattice_conductivity",
    "plot",
    "predict",
    "report",
    "rows",
    "run_conductivity",
    "write",
    "write_figure",
]
