"""The commands that only tell: ``sdpd scenes``, ``kernels`` and ``version``."""

from __future__ import annotations

import argparse
from typing import Any

from sdpd.commands.shared import OK

__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the commands to the others."""
    text = "ready scenes for `sdpd run NAME`; with a name, its file"
    command = commands.add_parser("scenes", help=text, description=text)
    command.add_argument("name", nargs="?", metavar="NAME")
    command.set_defaults(run=_scenes)
    text = "lattice factors of every kernel and support"
    command = commands.add_parser("kernels", help=text, description=text)
    command.add_argument("--dimension", type=int, choices=(2, 3), default=3)
    command.set_defaults(run=_kernels)
    command = commands.add_parser("version", help="print the version")
    command.set_defaults(run=_version)


def _scenes(options: argparse.Namespace) -> int:
    from sdpd import scenes
    from sdpd.units import table

    if options.name is not None:
        print(scenes.text(options.name), end="")
        return OK
    print(table([[name, scenes.describe(name)] for name in scenes.names()]))
    return OK


def _kernels(options: argparse.Namespace) -> int:
    from sdpd import discretization
    from sdpd.units import table

    header = ["kernel", "h/dx", "pairs", "d/n", "eta_eff/eta", "friction", "may pair above X"]
    rows = [
        [
            row.kernel,
            f"{row.support:g}",
            f"{row.pairs:.0f}",
            f"{row.density:.4f}",
            f"{row.viscosity:.3f}",
            f"{row.friction:.2f}",
            f"{row.pairing_limit:.3g}",
        ]
        for row in discretization.kernel_table(dimension=options.dimension)
    ]
    print(
        f"{options.dimension}D, on the lattice, zero bulk viscosity; friction: over its mean field"
    )
    print(table(rows, header))
    return OK


def _version(options: argparse.Namespace) -> int:
    from sdpd import __version__

    print(f"sdpd {__version__}")
    return OK
