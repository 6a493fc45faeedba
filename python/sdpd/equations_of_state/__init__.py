"""Equations of state: P(rho) of isothermal fluids, and E(N, V, S) of those with an energy.

To add one: a class with its formula, a row in `KINDS`, and its twin in the core (src/eos).
"""

from __future__ import annotations

from typing import Any

from sdpd import validation
from sdpd.equations_of_state.energy_table import EnergyTable
from sdpd.equations_of_state.laws import (
    ArtificialCompressibility,
    EquationOfState,
    IdealGas,
    Linear,
    Polynomial,
    Table,
    Tait,
)

__all__ = [
    "KINDS",
    "ArtificialCompressibility",
    "EnergyTable",
    "EquationOfState",
    "IdealGas",
    "Linear",
    "Polynomial",
    "Table",
    "Tait",
    "from_dict",
]

_LAWS = (ArtificialCompressibility, Linear, Tait, IdealGas, Polynomial, Table, EnergyTable)
KINDS: dict[str, type[EquationOfState]] = {law.kind: law for law in _LAWS}


def from_dict(data: dict[str, Any], where: str = "equation_of_state") -> EquationOfState:
    """The equation of state of ``{"kind": ..., **arguments}``; errors name the key."""
    from sdpd.toml_io import build

    rest = dict(data)
    kind = validation.choice(f"{where}.kind", rest.pop("kind", None), list(KINDS))
    return build(KINDS[kind], rest, where)
