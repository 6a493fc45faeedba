"""Temperature and density in layers next to walls, at rest, with noise.

The table shows tests/validation/results.json, which `make validation` writes by `measure`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import DOCS, Report, grid, reduced_fluid, shown

import sdpd

RECORD = DOCS.parent / "tests" / "validation" / "results.json"
ETA, SOUND_SPEED, SUPPORT = 20.0, 10.0, 2.65  # X = 100
LAYERS = 3  # of one spacing each
BLOCKS = 32
# Samples per block, four steps apart, and steps before: larger walls have more particles near.
SAMPLES = {
    "slab": (60, 400),
    "duct": (60, 400),
    "pipe": (15, 400),
    "wide pipe": (8, 200),
    "post": (15, 400),
    "sphere": (4, 400),
    "wide sphere": (1, 100),
}


@dataclass(frozen=True)
class Layers:
    """Temperature, its error, and density over the bulk's with its error, layer by layer."""

    temperature: np.ndarray
    temperature_error: np.ndarray
    density: np.ndarray
    density_error: np.ndarray
    current: float  # largest mean velocity over its error, all layers and components
    torque: float  # over its error; 0 for planes


def scene_of(kind: str) -> sdpd.Scene:
    """A slab, a duct, a pipe, a post or a sphere, R = 5h or 10h; m = dx = k_B T = 1."""
    law = sdpd.eos.Linear(background_pressure=SOUND_SPEED**2)
    radius = 5.03 * SUPPORT  # the spacing is not quite 1, and h is to stay below R/5
    if kind.startswith("wide"):
        radius *= 2.0
    if kind == "slab":
        box = sdpd.Box((7.0, 7.0, 12.0), periodic="xy")
        walls: tuple[sdpd.walls.Wall, ...] = sdpd.walls.slab(box)
    elif kind == "duct":
        box = sdpd.Box((9.0, 9.0, 7.0), periodic="z")
        walls = sdpd.walls.enclosure(box)
    elif kind.endswith("pipe"):
        box = sdpd.Box((2.0 * radius, 2.0 * radius, 6.0), periodic="z")
        walls = (sdpd.Cylinder(radius=radius, centre=(radius, radius, 0.0), fluid="inside"),)
    elif kind == "post":
        edge = 2.0 * radius + 3.0 * SUPPORT
        box = sdpd.Box((edge, edge, 6.0))
        walls = (sdpd.Cylinder(radius=radius, centre=(0.5 * edge, 0.5 * edge, 0.0)),)
    else:
        edge = 2.0 * radius + 2.0 * SUPPORT
        box = sdpd.Box((edge, edge, edge))
        walls = (sdpd.Sphere(radius=radius, centre=(0.5 * edge,) * 3),)
    return sdpd.Scene(
        fluid=reduced_fluid(ETA, law),
        box=box,
        walls=walls,
        resolution=sdpd.Resolution(spacing=1.0, support=SUPPORT, kernel="lucy"),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )


def measure(kind: str, seed: int = 3) -> Layers:
    """Run the splitting at tau/2 and average over all walls."""
    scene = scene_of(kind)
    samples, warm = SAMPLES[kind]
    sim = sdpd.Simulation(scene, dt=0.5 * scene.friction_time, seed=seed, threads=1)
    sim.run(steps=warm, progress=False)
    count = len(scene.walls)
    width = LAYERS * 1.0
    profiles = [
        sdpd.Profile(wall=k, bins=LAYERS, range=(0.0, width), every=4, samples_per_block=samples)
        for k in range(count)
    ]
    whole = sdpd.Profile(axis="x", bins=1, every=4, samples_per_block=samples)
    forces = sdpd.WallForces(every=4 * samples)
    sim.run(steps=4 * samples * BLOCKS, observe=[*profiles, whole, forces], progress=False)
    unit = scene.fluid.temperature
    root = math.sqrt(BLOCKS)
    temperature = np.mean([p.series("temperature").mean(axis=-1) for p in profiles], axis=0) / unit
    bulk = whole.density[0]
    density = np.mean([p.series("density") for p in profiles], axis=0) / bulk
    velocity = np.stack([p.series("velocity") for p in profiles])
    drift = velocity.mean(axis=1) / (velocity.std(axis=1, ddof=1) / root)
    torque = forces.torque[:, :, 2]
    turning = np.zeros(1)
    if scene.walls[0].radius_of_curvature is not None:
        turning = torque.mean(axis=0) / (torque.std(axis=0, ddof=1) / math.sqrt(len(torque)))
    return Layers(
        temperature.mean(axis=0),
        temperature.std(axis=0, ddof=1) / root,
        density.mean(axis=0),
        density.std(axis=0, ddof=1) / root,
        float(np.abs(drift).max()),
        float(np.abs(turning).max()),
    )


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("wall_equilibrium", __doc__, argv)
    numbers = json.loads(RECORD.read_text())["wall_equilibrium"]["numbers"]
    rows = []
    for kind in SAMPLES:
        found = numbers[kind]
        pairs = zip(found["temperature"], found["temperature_error"], strict=True)
        layers = [shown(t, e, digits=4) for t, e in pairs]
        first = shown(found["density_over_mean"][0], found["density_error"][0], digits=4)
        rows.append([kind, *layers, first])
    header = ["walls", "T, layer 1", "T, layer 2", "T, layer 3", "density, layer 1"]
    report.document(
        grid(header, rows),
        "Kinetic temperature over that of the bath in layers of one spacing from the wall, mean of "
        "the components, and density of the first layer over the mean of all particles; one "
        f"standard error. Pair splitting at $\\tau/2$, Lucy, $h/\\Delta x={SUPPORT:g}$, $X=100$, "
        f"$\\eta^*={ETA:g}$; round walls of $R=5h$, wide ones of $10h$.",
    )


if __name__ == "__main__":
    main()
