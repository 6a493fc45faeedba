"""How fast it is, and where the time goes; ``sdpd bench``.

`run_speed`: full steps by size, support, kernel and integrator, parts of a step, memory.
`run_effects`: what each effect costs, and that one switched off costs nothing. `run_peer`: the same
water in LAMMPS, turn by turn. All times are wall times of cases that take turns, as medians and
quartiles, with the machine that they belong to.
"""

from __future__ import annotations

from sdpd.bench.effects import Difference, EffectCosts, run_effects, same
from sdpd.bench.figures import plot, plot_effects, plot_peer, plot_sizes, write_figure
from sdpd.bench.fluid import liquid, water
from sdpd.bench.machine import Machine
from sdpd.bench.parts import Part
from sdpd.bench.peak import Peak
from sdpd.bench.peer import PEERS, run_peer
from sdpd.bench.peer_results import Contest, Journey, Peer, Temperature
from sdpd.bench.speed import SHARES, Row, Speed, run_speed
from sdpd.bench.study import Study, write, write_json
from sdpd.bench.turns import Lists, Spread

__all__ = [
    "PEERS",
    "SHARES",
    "Contest",
    "Difference",
    "EffectCosts",
    "Journey",
    "Lists",
    "Machine",
    "Part",
    "Peak",
    "Peer",
    "Row",
    "Speed",
    "Spread",
    "Study",
    "Temperature",
    "liquid",
    "plot",
    "plot_effects",
    "plot_peer",
    "plot_sizes",
    "run_effects",
    "run_peer",
    "run_speed",
    "same",
    "water",
    "write",
    "write_figure",
    "write_json",
]
