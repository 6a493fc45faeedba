"""Lattice factors of every kernel and support: density, viscosity by direction, friction rate."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from report import KERNEL_COLOURS, Report, grid, subplots

from sdpd import discretization, kernels
from sdpd.theory import friction_coefficients

SUPPORTS = (2.2, 2.4, 2.64, 3.0, 3.5, 4.0)
SMALL = 1e-3  # k dx: the long-wave limit to 1e-6


def diagonal_viscosity(kernel: str, dimension: int, support: float) -> float:
    """eta_eff/eta of a wave along a face diagonal, moving in the plane of that face."""
    across, along = friction_coefficients(1.0, 0.0, dimension)
    k, u = np.zeros(dimension), np.zeros(dimension)
    k[:2] = SMALL / math.sqrt(2.0)
    u[:2] = 1.0 / math.sqrt(2.0), -1.0 / math.sqrt(2.0)
    rates = discretization.lattice_rates(
        kernel, dimension, support, k, spacing=1.0, across=across, along=along, mass=1.0
    )
    return float(u @ rates @ u) / SMALL**2


def average_viscosity(axis: float, diagonal: float, dimension: int) -> float:
    """Mean over all orientations: a cubic tensor of fourth rank has but these two shears."""
    weight = 0.6 if dimension == 3 else 0.5
    return weight * axis + (1.0 - weight) * diagonal


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("discrete_factors", __doc__, argv)
    report.document(
        "In 3D:",
        _table(3),
        "In 2D, where at $\\zeta=0$ no orientation is preferred:",
        _table(2),
        "All columns are dimensionless and exact sums on the simple cubic or square lattice, "
        "$\\zeta=0$.",
    )
    _plot(report)


def _table(dimension: int) -> str:
    header = ["kernel", "$h/\\Delta x$", "pairs per particle", "$d/n$"]
    if dimension == 3:
        header += ["$\\eta_\\mathrm{eff}/\\eta$ along an axis", "diagonal", "average"]
    else:
        header += ["$\\eta_\\mathrm{eff}/\\eta$"]
    rows = []
    for row in discretization.kernel_table(dimension=dimension, supports=SUPPORTS):
        viscosity = [row.viscosity]
        if dimension == 3:
            diagonal = diagonal_viscosity(row.kernel, 3, row.support)
            viscosity += [diagonal, average_viscosity(row.viscosity, diagonal, 3)]
        rows.append(
            [
                kernels.get(row.kernel).title,
                f"{row.support:g}",
                f"{row.pairs:.0f}",
                f"{row.density:.4f}",
                *(f"{value:.3f}" for value in viscosity),
                f"{row.friction:.3f}",
            ]
        )
    return grid([*header, "friction rate"], rows)


def _plot(report: Report) -> None:
    supports = np.linspace(2.0, 5.0, 13 if report.quick else 241)
    figure, axes = subplots(3, width=8.6, height=3.0)
    for name in kernels.names():
        rows = discretization.kernel_table(names=[name], supports=supports)
        colour, title = KERNEL_COLOURS[name], kernels.get(name).title
        average = [
            average_viscosity(row.viscosity, diagonal_viscosity(name, 3, row.support), 3)
            for row in rows
        ]
        axes[0].plot(supports, [row.density for row in rows], color=colour, label=title)
        axes[1].plot(supports, [row.viscosity for row in rows], color=colour)
        axes[1].plot(supports, average, color=colour, linestyle="--")
        axes[2].plot(supports, [row.friction for row in rows], color=colour)
    axes[1].plot([], [], color="0.3", label="along an axis")
    axes[1].plot([], [], color="0.3", linestyle="--", label="mean over orientations")
    for panel, title in zip(
        axes, ("density $d/n$", r"viscosity $\eta_\mathrm{eff}/\eta$", "friction rate"), strict=True
    ):
        panel.axhline(1.0, color="0.5", linewidth=0.8)
        panel.set(title=title, xlabel=r"$h/\Delta x$")
    axes[0].set_ylim(0.98, 1.06)
    axes[1].set_ylim(0.75, 1.05)
    axes[0].legend()
    axes[1].legend(loc="lower right")
    report.figure(figure)


if __name__ == "__main__":
    main()
