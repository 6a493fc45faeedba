"""The commands that measure what theory or a paper predicts, with a verdict each."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Callable
from typing import Any

from sdpd.commands.shared import FAILED, NO_PROGRESS, OK, numbers, scene_of, show

__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the commands to the others."""
    _diffusion_options(commands)
    _fluctuations_options(commands)
    _correlations_options(commands)
    _viscosity_options(commands)
    _conductivity_options(commands)
    _channel_options(commands)
    _nitrogen_options(commands)


def _diffusion_options(commands: Any) -> None:
    from sdpd import kernels

    text = "self-diffusion of water against particle size: Yang (2013), Tables 7 and 8"
    command = commands.add_parser("diffusion", help=text, description=f"sdpd diffusion: {text}.")
    command.set_defaults(run=_diffusion)
    add = command.add_argument
    add("--full", action="store_true", help="every case of the table")
    add("--cases", type=numbers, metavar="N,N", help="these cases of the table")
    add("--fluid", choices=("water", "nitrogen"), default="water", help="Table 7 or Table 8")
    add("--quick", action="store_true", help="small boxes: seconds, larger errors, wider limits")
    add("-o", "--output", metavar="DIR", help="write table, summary and figures there")
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--processes", type=int, help="run side by side (default: processors at hand)")
    add(
        "--core-minutes",
        type=float,
        default=1.2,
        metavar="M",
        help="work a case, in minutes of one ordinary core (default 1.2); sets the steps, so "
        "that results do not depend on the clock",
    )
    add(
        "--sound-ratio",
        type=float,
        default=10.0,
        metavar="R",
        help="sound speed over sqrt(kT/m) (default 10); try 5 and 20",
    )
    add("--kernel", choices=kernels.names(), default="lucy", help="default: lucy, as published")
    add(
        "--eos",
        choices=("artificial_compressibility", "ideal_gas", "linear", "tait"),
        help="default: artificial compressibility for water, ideal gas for nitrogen, as published",
    )
    add("--no-progress", **NO_PROGRESS)


def _fluctuations_options(commands: Any) -> None:
    text = "equilibrium of a scene: each variance and correlation beside its prediction"
    command = commands.add_parser("fluctuations", help=text, description=text)
    command.set_defaults(run=_fluctuations)
    add = command.add_argument
    add("scene", metavar="SCENE.toml")
    add("-o", "--output", metavar="DIR", help="write table, text and figure there")
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--time-factor", type=float, default=1.0, metavar="F", help="so much longer (default 1)")
    add("--quick", action="store_true", help="seconds, larger errors")
    add("--no-progress", **NO_PROGRESS)


def _correlations_options(commands: Any) -> None:
    text = "waves of a scene: correlation functions, nu, c and Gamma beside linearised theory"
    command = commands.add_parser("correlations", help=text, description=text)
    command.set_defaults(run=_correlations)
    add = command.add_argument
    add("scene", metavar="SCENE.toml")
    add("-o", "--output", metavar="DIR", help="write tables, text and figure there")
    add(
        "--waves",
        type=numbers,
        metavar="N,N",
        help="wavelengths along each edge of the box (default 1,2,4 where resolved)",
    )
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--runs", type=int, help="independent runs (default 16, with --quick 8)")
    add("--quick", action="store_true", help="a quarter of the work, larger errors")
    add("--no-progress", **NO_PROGRESS)


def _viscosity_options(commands: Any) -> None:
    text = "viscosity that a scene delivers: four ways side by side, beside what was asked for"
    _transport_options(commands, "viscosity", _viscosity, text)


def _conductivity_options(commands: Any) -> None:
    text = "conductivity that a scene delivers: three ways side by side, beside what was asked for"
    _transport_options(commands, "conductivity", _conductivity, text)


def _transport_options(
    commands: Any, name: str, run: Callable[[argparse.Namespace], int], text: str
) -> None:
    command = commands.add_parser(name, help=text, description=text)
    command.set_defaults(run=run)
    add = command.add_argument
    add("scene", metavar="SCENE.toml")
    add("-o", "--output", metavar="DIR", help="write table, text and figure there")
    add("--dt", type=float, help="time step (default: that of a simulation of the scene)")
    add("--particles", type=int, metavar="N", help="in a cube (default: the scene's box)")
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--time-factor", type=float, default=1.0, metavar="F", help="so much longer (default 1)")
    add("--quick", action="store_true", help="seconds, larger errors")
    add("--no-progress", **NO_PROGRESS)


def _channel_options(commands: Any) -> None:
    text = "Poiseuille or Couette flow from rest beside its closed form: Yang (2013), 3.1 and 3.2"
    command = commands.add_parser("channel", help=text, description=text)
    command.set_defaults(run=_channel)
    add = command.add_argument
    add("kind", choices=("poiseuille", "couette"))
    add("-o", "--output", metavar="DIR", help="write table, profiles and figure there")
    add("--threads", type=int, help="threads (default: processors at hand)")
    add("--quick", action="store_true", help="20 layers of particles instead of 31: seconds")
    add("--no-progress", **NO_PROGRESS)


def _nitrogen_options(commands: Any) -> None:
    text = "nitrogen with an energy at equilibrium: Yang (2013), Tables 9 to 11"
    command = commands.add_parser("nitrogen", help=text, description=text)
    command.set_defaults(run=_nitrogen)
    add = command.add_argument
    chosen = command.add_mutually_exclusive_group()
    chosen.add_argument(
        "--cases", type=numbers, metavar="N,N", help="of 1 to 20 (default 1,5,9,13,17)"
    )
    chosen.add_argument("--all", action="store_true", help="all twenty")
    add("--no-transport", action="store_true", help="no self-diffusion, viscosity, conductivity")
    add("--kernel", default="wendland_c2", help="lucy as published (pairs from case 5 on)")
    add("--heat-capacity", type=float, default=2.5, help="C/(N k_B), 1.5 as published")
    add("--particles", type=int, help="3375 as published (default 512 or more)")
    add("--quick", action="store_true", help="seconds a case, errors up to 6 %% instead of 0.7 %%")
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--threads", type=int, help="threads (default: processors at hand)")
    add("-o", "--output", metavar="DIR", help="write table and figure there")
    add("--no-progress", **NO_PROGRESS)


def _diffusion(options: argparse.Namespace) -> int:
    from sdpd import diffusion

    figures = importlib.util.find_spec("matplotlib") is not None
    if not figures:
        print("no figures: matplotlib is missing (pip install 'sdpd[plot]')", file=sys.stderr)
    numbers = options.cases
    if options.full:
        if numbers is not None:
            raise ValueError("`--cases` and `--full` exclude each other")
        numbers = tuple(diffusion.TABLES[options.fluid])
    study = diffusion.run_study(
        fluid=options.fluid,
        cases=numbers,
        kernel=options.kernel,
        equation_of_state=options.eos,
        sound_ratio=options.sound_ratio,
        seed=options.seed,
        core_minutes=options.core_minutes,
        quick=options.quick,
        processes=options.processes,
        progress=options.progress is not False,
    )
    print(study)
    if options.output is not None:
        paths = diffusion.write(study, options.output)
        if figures:
            paths += diffusion.write_figures(study, options.output)
        print("\nwritten: " + ", ".join(map(str, paths)))
    return OK if study.passed else FAILED


def _fluctuations(options: argparse.Namespace) -> int:
    from sdpd import fluctuations

    study = fluctuations.run_fluctuations(
        scene_of(options.scene),
        seed=options.seed,
        time_factor=options.time_factor,
        quick=options.quick,
        progress=options.progress,
    )
    return show(fluctuations, study, options.output)


def _correlations(options: argparse.Namespace) -> int:
    from sdpd import correlations

    study = correlations.run_correlations(
        scene_of(options.scene),
        waves=options.waves,
        seed=options.seed,
        runs=options.runs,
        quick=options.quick,
        progress=options.progress,
    )
    return show(correlations, study, options.output)


def _viscosity(options: argparse.Namespace) -> int:
    from sdpd import viscosity

    return _coefficient(viscosity, viscosity.run_viscosity, options)


def _conductivity(options: argparse.Namespace) -> int:
    from sdpd import conductivity

    return _coefficient(conductivity, conductivity.run_conductivity, options)


def _coefficient(package: Any, run: Callable[..., Any], options: argparse.Namespace) -> int:
    """Measure a transport coefficient of a scene and show it."""
    study = run(
        scene_of(options.scene),
        dt="auto" if options.dt is None else options.dt,
        particles=options.particles,
        seed=options.seed,
        time_factor=options.time_factor,
        quick=options.quick,
        progress=options.progress,
    )
    return show(package, study, options.output)


def _channel(options: argparse.Namespace) -> int:
    from sdpd import channel

    study = channel.run_channel(
        options.kind,
        quick=options.quick,
        threads=options.threads,
        progress=options.progress,
    )
    return show(channel, study, options.output)


def _nitrogen(options: argparse.Namespace) -> int:
    from sdpd import nitrogen

    study = nitrogen.run_nitrogen(
        sorted(nitrogen.CASES) if options.all else options.cases,
        kernel=options.kernel,
        heat_capacity=options.heat_capacity,
        particles=options.particles,
        transport=not options.no_transport,
        quick=options.quick,
        seed=options.seed,
        threads=options.threads,
        progress=options.progress,
    )
    return show(nitrogen, study, options.output)
