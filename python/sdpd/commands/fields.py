"""The command ``sdpd fields``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.commands.shared import OK, numbers

if TYPE_CHECKING:
    from sdpd.scene import Scene


__all__ = ["add_to"]


def add_to(commands: Any) -> None:
    """Add the command to the others."""
    from sdpd import kernels

    text = "averaged fields or profiles of a trajectory, with standard errors"
    command = commands.add_parser("fields", help=text, description=text)
    command.set_defaults(run=_fields)
    add = command.add_argument
    add("trajectory", metavar="TRAJECTORY.h5md")
    where = command.add_mutually_exclusive_group(required=True)
    where.add_argument("--profile", choices=("x", "y", "z"), help="bins along this axis")
    where.add_argument(
        "--grid", type=numbers, metavar="N,N,N", help="centres of so many cells of the box"
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
