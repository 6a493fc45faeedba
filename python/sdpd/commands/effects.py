"""The command ``sdpd effects``."""

from __future__ import annotations

import argparse
from typing import Any

from sdpd.commands.shared import NO_PROGRESS, scene_of, show

__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the command to the others."""
    text = "a scene with each effect on and off: what it changes beside what it costs"
    command = commands.add_parser("effects", help=text, description=text)
    command.set_defaults(run=_run)
    add = command.add_argument
    add("scene", metavar="SCENE", help="a TOML file or a ready scene")
    length = command.add_mutually_exclusive_group()
    length.add_argument("--steps", type=int, help="of each run (default: seconds of work)")
    length.add_argument("--time", type=float, help="simulated time of each run")
    add("--seeds", type=int, help="runs of each side (default 4)")
    add(
        "--effects",
        type=lambda text: tuple(text.split(",")),
        metavar="NAME,NAME",
        help="these alone, e.g. fluctuations,bulk_viscosity",
    )
    add("--threads", type=int, default=1, help="of each simulation (default 1)")
    add("-o", "--output", metavar="DIR", help="write JSON, tables and figure there")
    add("--quick", action="store_true", help="short runs, to try it")
    add("--no-progress", **NO_PROGRESS)


def _run(options: argparse.Namespace) -> int:
    from sdpd import effects_study

    given = {"seeds": options.seeds, "effects": options.effects}
    study = effects_study.compare_effects(
        scene_of(options.scene),
        steps=options.steps,
        time=options.time,
        quick=options.quick,
        threads=options.threads,
        progress=options.progress,
        **{name: value for name, value in given.items() if value is not None},
    )
    return show(effects_study, study, options.output)
