"""Printing quantities and tables; SI units are shown where k_B has its SI value, else none."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["quantity", "table"]


def quantity(value: float, unit: str, *, si: bool) -> str:
    """``"1.23e-09 m"``, or the bare number outside the SI."""
    shown = f"{value:.4g}"
    return f"{shown} {unit}" if si and unit not in ("", "1") else shown


def table(rows: Sequence[Sequence[str]], header: Sequence[str] | None = None) -> str:
    """Left-aligned columns; the last one may run on."""
    lines = [list(row) for row in rows]
    if header is not None:
        lines.insert(0, list(header))
    if not lines:
        return ""
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    shown = [
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    ]
    if header is not None:
        shown.insert(1, "  ".join("-" * width for width in widths[:-1]) + "  " + "-" * 4)
    return "\n".join(shown)
