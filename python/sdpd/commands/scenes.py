"""The commands ``sdpd regime`` and ``sdpd run``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd import validation
from sdpd.commands.shared import NO_PROGRESS, OK, scene_of

if TYPE_CHECKING:
    from sdpd.observers import Profile, WallForces
    from sdpd.scene import Scene


__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the commands to the others."""
    for name, run, text in (
        ("regime", _regime, "dimensionless numbers of a scene and what they mean"),
        ("run", _run, "run a scene; writes a trajectory, a time series and the final state"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=run)
        command.add_argument("scene", metavar="SCENE", help="a TOML file or a ready scene")
        if name == "run":
            command.add_argument("--integrator", help="pair_splitting or velocity_verlet")
            _run_options(command)


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
        choices=validation.PRECISIONS,
        default="double",
        help="of what happens between two particles (default double)",
    )
    add("--no-progress", **NO_PROGRESS)


def _regime(options: argparse.Namespace) -> int:
    scene = scene_of(options.scene)
    print(scene)
    print()
    print(scene.regime())
    return OK


def _run(options: argparse.Namespace) -> int:
    from sdpd import h5md
    from sdpd.observers import Thermodynamics
    from sdpd.simulation import Simulation

    scene = scene_of(options.scene)
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
        progress=options.progress,
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
