"""Which settings are worth their time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sdpd import validation
from sdpd.accuracy.row import Row

__all__ = ["pareto"]


def pareto(rows: Sequence[Row], *, z: float = 2.0) -> tuple[Row, ...]:
    """The front of error against seconds, cheapest first.

    Parameters
    ----------
    rows : sequence of Row
    z : float
        A dearer setting must be more accurate than the best cheaper one by more than so many
        standard errors of the difference; 0 takes errors as they are.

    Returns
    -------
    tuple of Row
        Without those that blew up.
    """
    z = validation.non_negative("z", z)
    front: list[Row] = []
    finite = [row for row in rows if math.isfinite(row.error)]
    for row in sorted(finite, key=lambda row: (row.seconds, row.error)):
        if front:
            best = front[-1]
            needed = z * math.hypot(row.stderr, best.stderr)
            if not best.error - row.error > needed:
                continue
        front.append(row)
    return tuple(front)
