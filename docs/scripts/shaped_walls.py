"""How well one image of each particle completes the density at walls of any shape, in mean field.

A fluid of density 1 fills each shape; the density with images is summed over cells at many places
within a support of the wall. The figure shows it in a star.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from report import Report, grid, subplots
from scipy.spatial import cKDTree

import sdpd
from sdpd import _core

Array = NDArray[np.float64]
BOX = sdpd.Box((8.0, 8.0), periodic="")
KERNELS = ("lucy", "wendland_c2")
TIP = 3.0 * math.sqrt(3.0)


def star(tips: int = 5) -> Array:
    angle = np.pi * np.arange(2 * tips) / tips
    radius = np.where(np.arange(2 * tips) % 2 == 0, 3.4, 1.9)
    return np.column_stack([4.0 + radius * np.cos(angle), 4.0 + radius * np.sin(angle)])


def circle(side: float) -> sdpd.LevelSet:
    return sdpd.LevelSet(function=lambda r: side * (np.linalg.norm(r - 4.0, axis=1) - 2.0))


# shape, and the corners of a rectangle to look at
SHAPES: dict[str, tuple[sdpd.walls.ShapedWall, tuple[float, ...]]] = {
    "circle, inside, R = 2h": (circle(-1.0), (2.0, 2.0, 6.0, 6.0)),
    "circle, outside, R = 2h": (circle(1.0), (1.0, 1.0, 7.0, 7.0)),
    "square corner": (
        sdpd.Polyline(points=[(1, 1), (7, 1), (7, 7), (1, 7)]),
        (1.0, 1.0, 2.5, 2.5),
    ),
    "corner of 60 degrees": (
        sdpd.Polyline(points=[(1, 1), (7, 1), (4, 1 + TIP)]),
        (1.0, 1.0, 2.5, 2.5),
    ),
    "re-entrant edge": (
        sdpd.Polyline(points=[(0.5, 0.5), (7.5, 0.5), (7.5, 4), (4, 4), (4, 7.5), (0.5, 7.5)]),
        (3.0, 3.0, 5.0, 5.0),
    ),
    "solid wedge of 60 degrees": (
        sdpd.Polyline(points=[(4, 4), (6.6, 5.5), (6.6, 2.5)]),
        (3.0, 3.0, 5.0, 5.0),
    ),
    "gap of 0.6 h": (
        sdpd.Polyline(points=[(0.5, 2), (7.5, 2), (7.5, 2.6), (0.5, 2.6)]),
        (3.0, 2.0, 5.0, 2.6),
    ),
    "star of five tips": (sdpd.Polyline(points=star()), (0.5, 0.5, 7.5, 7.5)),
}


def completed(field: object, kernel: str, targets: Array, step: float) -> Array:
    """Density with images at the targets, of a fluid of density 1, by cells of `step`; h = 1."""
    low, high = targets.min(axis=0) - 1.0, targets.max(axis=0) + 1.0
    axes = [np.arange(a, b, step) + 0.5 * step for a, b in zip(low, high, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    phi, _, psi, _ = field.evaluate(cells)
    share = np.clip(phi / step + 0.5, 0.0, 1.0)
    cells, phi, psi, share = (x[share > 0.0] for x in (cells, phi, psi, share))
    phi = np.maximum(phi, 0.0)
    here, _, weight, _ = field.evaluate(targets)
    result = np.empty(len(targets))
    for k, near in enumerate(cKDTree(cells).query_ball_point(targets, 1.0)):
        square = np.sum((cells[near] - targets[k]) ** 2, axis=1)
        image = np.sqrt(square + 4.0 * max(here[k], 0.0) * phi[near])
        direct, _ = _core.kernel_profile(kernel, 2, np.sqrt(square))
        mirrored, _ = _core.kernel_profile(kernel, 2, image)
        result[k] = share[near] @ (direct + weight[k] * psi[near] * mirrored) * step**2
    return result


def row(name: str, kernel: str, *, quick: bool) -> list[str]:
    wall, (x, y, right, top) = SHAPES[name]
    field = wall.field(BOX, 1.0, kernel)
    at = np.random.default_rng(8).uniform((x, y), (right, top), (20_000, 2))
    distance = wall.distance(at, BOX)
    at = at[(distance > 0.0) & (distance < 1.0)][: 100 if quick else 2000]
    error = 100.0 * (completed(field, kernel, at, 1.0 / (16.0 if quick else 64.0)) - 1.0)
    if isinstance(wall, sdpd.Polyline):
        corners = np.asarray(wall.points)
        apart = np.min([np.linalg.norm(at - c, axis=1) for c in corners], axis=0)
    else:
        apart = np.full(len(at), np.inf)
    low, high = field.report()["weights"]
    return [
        name,
        kernel,
        f"{np.sqrt(np.mean(error**2)):.3f}",
        f"{np.abs(error[apart > 0.15]).max():.2f}",
        f"{np.abs(error).max():.2f}",
        f"{low:.2f} to {high:.2f}",
    ]


def picture(report: Report) -> None:
    wall, _ = SHAPES["star of five tips"]
    field = wall.field(BOX, 1.0, "lucy")
    n = 24 if report.quick else 160
    axis = np.linspace(0.5, 7.5, n)
    at = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    fluid = wall.distance(at, BOX) > 0.0
    _, _, psi, _ = field.evaluate(at)
    density = np.full(len(at), np.nan)
    density[fluid] = completed(field, "lucy", at[fluid], 1.0 / (12.0 if report.quick else 48.0))
    figure, panels = subplots(2, width=9.0, height=3.8)
    outline = np.vstack([star(), star()[:1]])
    shown = [
        (np.where(fluid, psi, np.nan), "weight $\\psi$", {}),
        (100.0 * (density - 1.0), "density with images, error [%]", {"vmin": -1.0, "vmax": 1.0}),
    ]
    for panel, (values, label, limits) in zip(panels, shown, strict=True):
        colours = "viridis" if not limits else "RdBu"
        mesh = panel.pcolormesh(axis, axis, values.reshape(n, n).T, cmap=colours, **limits)
        panel.plot(*outline.T, color="black", linewidth=1.0)
        panel.grid(False)
        panel.set(aspect="equal", xlabel="$x/h$", ylabel="$y/h$")
        figure.colorbar(mesh, ax=panel, label=label)
    report.figure(figure)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("shaped_walls", __doc__, argv)
    names = list(SHAPES)[:2] if report.quick else list(SHAPES)
    rows = [row(name, kernel, quick=report.quick) for name in names for kernel in KERNELS]
    picture(report)
    report.document(
        grid(
            ["shape", "kernel", "rms [%]", "largest beyond 0.15 h of a vertex", "largest", "psi"],
            rows,
        ),
        "Error of the density that images complete in a uniform fluid, at places within a support "
        "of the wall, and the range of the weight. Without images the density at the wall would be "
        "half of the right one, a sixth in a corner of 60 degrees.",
    )


if __name__ == "__main__":
    main()
