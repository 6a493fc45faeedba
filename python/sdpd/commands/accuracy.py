"""The commands ``sdpd accuracy`` and ``sdpd cost``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from sdpd import validation
from sdpd.accuracy.settings import NAMES
from sdpd.commands.shared import NO_PROGRESS, OK, scene_of, show

__all__ = ["add_to"]

_AXES = {
    "across": (int, "particles along the length that the problem resolves"),
    "support": (float, "h/dx"),
    "kernel": (str, "kernels"),
    "step": (float, "time steps over the default one"),
    "integrator": (str, "pair_splitting, velocity_verlet"),
    "iterations": (int, "of velocity Verlet"),
    "noise": (str, "uniform, gaussian"),
    "bookkeeping": (bool, "yes, no: whether energies are kept to rounding"),
    "calibrate": (bool, "yes, no"),
    "wall_model": (str, "models of walls"),
    "precision": (str, "double, mixed"),
    "length": (float, "lengths of the run over the default one"),
}


def add_to(commands: Any) -> None:
    """Add both to the parsers of ``sdpd``."""
    _add_accuracy(commands)
    _add_cost(commands)


def _values(kind: type) -> Callable[[str], tuple[Any, ...]]:
    def parse(text: str) -> tuple[Any, ...]:
        parts = text.split(",")
        if kind is bool and set(parts) <= {"yes", "no"}:
            return tuple(part == "yes" for part in parts)
        try:
            if kind is bool:
                raise ValueError
            return tuple(kind(part) for part in parts)
        except ValueError:
            example = {int: "8,16", float: "2.6,3", bool: "yes,no"}[kind]
            raise argparse.ArgumentTypeError(
                f"expected values like {example}, got {text!r}"
            ) from None

    return parse


def _add_accuracy(commands: Any) -> None:
    text = "what accuracy costs: a problem with a known answer over settings; alone, their list"
    command = commands.add_parser("accuracy", help=text, description=text)
    command.set_defaults(run=_accuracy)
    add = command.add_argument
    add("problem", metavar="PROBLEM", nargs="?", help="its name; without one, all are listed")
    for name in NAMES:
        kind, note = _AXES[name]
        flag = f"--{name.replace('_', '-')}"
        add(flag, type=_values(kind), metavar="V,V", help=f"{note} (one or more)")
    add("--seeds", type=_values(int), default=(1,), metavar="N,N", help="a run each (default 1)")
    add("--repeats", type=int, default=1, metavar="N", help="of each run, for the clock")
    add("--store", metavar="DIR", help="keep finished settings there, and go on from them")
    add("-o", "--output", metavar="DIR", help="write table, text and figure there")
    add("--no-progress", **NO_PROGRESS)


def _accuracy(options: argparse.Namespace) -> int:
    from sdpd import accuracy
    from sdpd.units import table

    if options.problem is None:
        rows = [[p.name, p.title, ", ".join(p.takes)] for p in accuracy.PROBLEMS.values()]
        print(table(rows, ["problem", "", "settings it takes"]))
        return OK
    axes = {name: getattr(options, name) for name in NAMES if getattr(options, name) is not None}
    study = accuracy.study(
        options.problem,
        axes or _usual(options.problem),
        seeds=options.seeds,
        repeats=options.repeats,
        folder=options.store,
        progress=options.progress,
    )
    return show(accuracy, study, options.output)


def _usual(name: str) -> dict[str, tuple[Any, ...]]:
    """Resolution and support where a problem takes both, else the time step."""
    from sdpd.accuracy import PROBLEMS

    problem = PROBLEMS.get(name)
    if problem is None or "across" not in problem.takes:
        return {"step": (0.5, 1.0, 2.0)}
    across = problem.base.across
    return {"across": (across, across * 3 // 2), "support": (2.6, 3.0, 3.5)}


def _add_cost(commands: Any) -> None:
    text = (
        "memory, pairs and every bound on the time step of a scene; with --error the cheapest "
        "settings that reach it, and their time"
    )
    command = commands.add_parser("cost", help=text, description=text)
    command.set_defaults(run=_cost)
    add = command.add_argument
    add("scene", metavar="SCENE", help="a TOML file or a ready scene")
    add("--integrator", help="pair_splitting or velocity_verlet")
    add(
        "--precision",
        choices=validation.PRECISIONS,
        help="of what happens between two particles (default double, with --error the cheaper)",
    )
    add("--error", type=float, metavar="E", help="relative error asked for, 0.01 say")
    add(
        "--quantity",
        metavar="NAME",
        help="of what: flow, temperature, density_variance, temperature_variance or diffusion",
    )
    add("--time", type=float, metavar="T", help="to simulate, or of each run where there is noise")
    add("--refresh", action="store_true", help="measure the speed of this machine anew")
    add("--no-measure", action="store_true", help="a rough estimate where it is not known")


def _cost(options: argparse.Namespace) -> int:
    scene = scene_of(options.scene)
    if options.error is None:
        for name in ("quantity", "time"):
            if getattr(options, name) is not None:
                raise ValueError(f"`--{name}` needs `--error`")
        print(scene.cost(options.integrator, precision=options.precision))
        return OK
    print(
        scene.cost(
            options.integrator,
            error=options.error,
            precision=options.precision,
            quantity=options.quantity,
            time=options.time,
            refresh=options.refresh,
            measure=not options.no_measure,
        )
    )
    return OK
