"""Which settings are worth their time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sdpd import validation
from sdpd.accuracy.row import Row

__all__ = ["pareto"]


def pareto(rows: Sequence[Row], *, z: float = 1.0) -> tuple[Row, ...]:
    """The front of error against seconds, cheapest first: no cheaper setting is as good.

    Parameters
    ----------
    rows : sequence of Row
    z : float
        Errors count with so many of their standard errors on top: one that is badly known is not
        taken for small. 0 takes errors as they are.

    Returns
    -------
    tuple of Row
        Without those that failed.
    """
    z = validation.non_negative("z", z)
    front: list[Row] = []
    best = math.inf
    for row in sorted(rows, key=lambda row: (row.seconds, row.error + z * row.stderr)):
        error = row.error + z * row.stderr
        if error < best:
            front.append(row)
            best = error
    return tuple(front)
