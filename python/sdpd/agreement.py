"""Independent ways to one number beside each other: differences with errors, and the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdpd.analysis import Estimate, bonferroni

__all__ = ["LEVEL", "Comparison", "columns", "comparison_table", "judge", "threshold"]

LEVEL = 0.01  # probability that any comparison of a right simulation fails


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Two methods beside each other.

    Attributes
    ----------
    first, second : str
        Their names.
    difference : Estimate
        In the unit of what is measured.
    accuracy : float
        Of both, added [as the difference].
    unit : float
        What a fault is relative to [as the difference].
    """

    first: str
    second: str
    difference: Estimate
    accuracy: float
    unit: float

    @property
    def z(self) -> float:
        """Difference in standard errors."""
        return self.difference.z(0.0)

    @property
    def p(self) -> float:
        """Two-sided probability of a difference beyond the accuracy, by Student's t."""
        away = self.difference.value
        beyond = np.sign(away) * max(0.0, abs(away) - self.accuracy)
        return self.difference.p(away - float(beyond))

    def visible(self, threshold: float) -> float:
        """Smallest relative fault beyond `threshold` standard errors and the accuracy [1]."""
        return (self.accuracy + threshold * self.difference.stderr) / self.unit


def judge(comparisons: Sequence[Comparison]) -> tuple[bool, ...]:
    """Whether each agrees, at `LEVEL` for all of them together (Bonferroni)."""
    rejected = bonferroni([each.p for each in comparisons], level=LEVEL).rejected
    return tuple(not bool(value) for value in rejected)


def threshold(comparisons: Sequence[Comparison], blocks: int) -> float:
    """Standard errors at which one comparison fails, by Student's t with the blocks' freedom."""
    from scipy import stats

    return float(stats.t.isf(0.5 * LEVEL / len(comparisons), blocks - 1))


def comparison_table(
    comparisons: Sequence[Comparison], agreed: Sequence[bool], bound: float
) -> str:
    """The differences as text; `bound` as of `threshold`."""
    lines = [["", "difference/asked", "SE", "accuracy", "z", "sees", ""]]
    for each, good in zip(comparisons, agreed, strict=True):
        lines.append(
            [
                f"{each.first} - {each.second}",
                f"{each.difference.value / each.unit:+.4f}",
                f"{each.difference.stderr / each.unit:.4f}",
                f"{each.accuracy / each.unit:.4f}",
                f"{each.z:+.1f}",
                f"{each.visible(bound):.1%}",
                "ok" if good else "FAIL",
            ]
        )
    return columns(lines)


def columns(lines: list[list[str]]) -> str:
    """A table with its header: names on the left, the rest right-aligned."""
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    rows = []
    for line in lines:
        cells = [cell.rjust(width) for cell, width in zip(line, widths, strict=True)]
        rows.append("  ".join([line[0].ljust(widths[0]), *cells[1:]]).rstrip())
    return "\n".join([rows[0], "-" * max(map(len, rows)), *rows[1:]])
