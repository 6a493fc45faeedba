"""The models of walls beside each other: energy, density, temperature, slip, crossings and cost.

The table shows tests/validation/results.json, which `make validation` writes by the functions here;
mean fields are computed anew.
"""

from __future__ import annotations

import json
import math
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from report import DOCS, Report, grid, reduced_fluid, shown, subplots
from scipy.spatial import cKDTree

import sdpd
from sdpd import _core, kernels
from sdpd.drawing import BLUE, GREEN, ORANGE, VERMILION

RECORD = DOCS.parent / "tests" / "validation" / "results.json"
ETA, SOUND_SPEED, SUPPORT = 20.0, 10.0, 2.65  # X = 100; m = dx = k_B T = 1
RADIUS = 5.03 * SUPPORT  # the spacing is not quite 1, and h is to stay below R/5
LEAST = 0.1  # least distance of explicit friction without a bound at the wall
BLOCKS = 32
COLOURS = (VERMILION, GREEN, BLUE)


@dataclass(frozen=True)
class Model:
    """A model, and what it is called in tables."""

    title: str
    model: Any
    explicit: Any  # for velocity Verlet

    @property
    def splits(self) -> bool:
        """Whether its friction can be solved exactly."""
        return self.model.name != "own_foot_images"


def _models() -> dict[str, Model]:
    same = {
        "symmetric": ("symmetric images", sdpd.SymmetricImages()),
        "own foot": ("own-foot images, as published", sdpd.OwnFootImages()),
        "own foot, noise": ("own-foot images with noise", sdpd.OwnFootImages(noise=True)),
    }
    found = {key: Model(title, model, model) for key, (title, model) in same.items()}
    found["completion"] = Model(
        "completion", sdpd.Completion(), sdpd.Completion(least_distance=LEAST)
    )
    found["completion, own pressure"] = Model(
        "completion, its own pressure",
        sdpd.Completion(pressure="completion"),
        sdpd.Completion(pressure="completion", least_distance=LEAST),
    )
    found["frozen"] = Model(
        "frozen particles", sdpd.FrozenParticles(), sdpd.FrozenParticles(least_distance=LEAST)
    )
    return found


MODELS = _models()


def scene_of(kind: str, model: Any, *, viscosity: float = ETA) -> sdpd.Scene:
    """A slab, or a pipe or a post of R = 5h, in three dimensions, of the Lucy kernel."""
    if kind == "slab":
        box = sdpd.Box((7.0, 7.0, 12.0), periodic="xy")
        walls: tuple[sdpd.walls.Wall, ...] = sdpd.walls.slab(box)
    elif kind == "pipe":
        box = sdpd.Box((2.0 * RADIUS, 2.0 * RADIUS, 6.0), periodic="z")
        walls = (sdpd.Cylinder(radius=RADIUS, centre=(RADIUS, RADIUS, 0.0), fluid="inside"),)
    else:
        edge = 2.0 * RADIUS + 3.0 * SUPPORT
        box = sdpd.Box((edge, edge, 6.0))
        walls = (sdpd.Cylinder(radius=RADIUS, centre=(0.5 * edge, 0.5 * edge, 0.0)),)
    law = sdpd.eos.Linear(background_pressure=SOUND_SPEED**2)
    return sdpd.Scene(
        fluid=reduced_fluid(viscosity, law),
        box=box,
        walls=walls,
        resolution=sdpd.Resolution(spacing=1.0, support=SUPPORT, kernel="lucy"),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
        wall_model=model,
    )


# --- energy ----------------------------------------------------------------------------------


def _frozen_sums(scene: sdpd.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Frozen particles and the part of their density that does not change."""
    places = scene.wall_model.places(scene)  # type: ignore[attr-defined]
    near = places[scene.geometry.distance(places) > -scene.support_radius]
    return near, _sums(scene, near, places)


def _sums(scene: sdpd.Scene, points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Kernel sums at points over others."""
    periods = np.array(
        [
            length if axis in scene.box.periodic_axes else 0.0
            for axis, length in zip("xyz", scene.box.lengths, strict=False)
        ]
    )
    wrapped = [
        np.where(periods > 0.0, np.mod(x, np.maximum(periods, 1.0)), x) for x in (points, others)
    ]
    trees = [cKDTree(x, boxsize=periods) for x in wrapped]
    table = trees[0].sparse_distance_matrix(trees[1], scene.support_radius, output_type="ndarray")
    w, _ = kernels.evaluate(
        scene.resolution.kernel, scene.dimension, table["v"], scene.support_radius
    )
    return np.bincount(table["i"], weights=w, minlength=len(points))


def energy_error(name: str, dt: float, duration: float = 4.0) -> float:
    """rms deviation of the energy in a pipe of R = 5h without friction [k_B T]."""
    scene = scene_of("pipe", MODELS[name].model, viscosity=0.0)
    sim = sdpd.Simulation(scene, dt=dt, seed=3, threads=1)
    frozen = None
    if name == "frozen":
        frozen = _frozen_sums(scene)
    law, mass = scene.fluid.equation_of_state, scene.particle_mass
    kind, parameters = law.core(scene.fluid.density, SOUND_SPEED)
    energies = []
    for _ in range(40):
        sim.run(steps=round(duration / dt) // 40, progress=False)
        energy = sim.kinetic_energy + sim.potential_energy
        if frozen is not None:
            d = frozen[1] + _sums(scene, frozen[0], np.array(sim.positions))
            energy += mass * float(_core.eos_evaluate(kind, list(parameters), mass * d)[2].sum())
        energies.append(energy)
    return float(np.std(energies))


# --- density in the mean field -----------------------------------------------------------------


def mean_field(name: str, side: float, heights: np.ndarray, points: int = 60) -> np.ndarray:
    """Density of a particle in a uniform fluid of density 1 at a cylinder of R = 5h, less 1.

    By quadrature of the kernel over cross sections, integrated along the axis; h = 1, and `side` is
    +1 with the fluid outside.
    """
    radius = 5.0
    nodes, weights = np.polynomial.legendre.leggauss(points)
    t, wt = 0.5 * (nodes + 1.0), 0.5 * weights

    def over_axis(s: np.ndarray) -> np.ndarray:
        """The kernel integrated along the axis at a distance s in the cross section."""
        length = np.sqrt(np.maximum(1.0 - s**2, 0.0))[..., None]
        z = length * t
        w, _ = kernels.evaluate("lucy", 3, np.sqrt(s[..., None] ** 2 + z**2), 1.0)
        return np.asarray(2.0 * np.sum(length * wt * w, axis=-1))

    weight = np.asarray(_core.curvature_weight("lucy", 3, heights)[0])
    result = np.empty(len(heights))
    for k, height in enumerate(heights):
        at = radius + side * height
        # rings of the solid within the support, and the angles at which they are
        depth = (1.0 - height) * t
        ring = radius - side * depth
        cosine = np.clip((at**2 + ring**2 - 1.0) / (2.0 * at * ring), -1.0, 1.0)
        angle = np.arccos(cosine)[:, None] * t
        arc = np.arccos(cosine)[:, None] * wt
        s = np.sqrt(at**2 + ring[:, None] ** 2 - 2.0 * at * ring[:, None] * np.cos(angle))
        share = 2.0 * (1.0 - height) * wt * ring * np.sum(arc * over_axis(s), axis=1)
        missing = share.sum()
        if name.startswith("own foot"):
            # a ring of the solid holds the fluid of the ring that it mirrors
            result[k] = np.sum(share * ((2.0 * radius - ring) / ring - 1.0))
        elif name.startswith("completion"):
            closed = _core.wall_completion(3, np.array([height]))[0]
            result[k] = (1.0 - missing) / (1.0 - closed[0] + side / radius * closed[4]) - 1.0
        elif name == "frozen":
            result[k] = 0.0
        else:
            result[k] = _symmetric(side, radius, height, weight[k], t, wt, over_axis) - missing
    return result


def _symmetric(
    side: float, radius: float, height: float, own: float, t: Any, wt: Any, over_axis: Any
) -> float:
    """What images with weights complete."""
    curvature = -side / radius
    other = (1.0 - height) * t
    ring = radius + side * other
    at = radius + side * height
    square = 1.0 - 4.0 * height * other  # of the longest separation in the cross section
    cosine = np.clip((at**2 + ring**2 - square) / (2.0 * at * ring), -1.0, 1.0)
    angle = np.arccos(cosine)[:, None] * t
    arc = np.arccos(cosine)[:, None] * wt
    s2 = at**2 + ring[:, None] ** 2 - 2.0 * at * ring[:, None] * np.cos(angle)
    s = np.sqrt(s2 + 4.0 * height * other[:, None])
    p = np.asarray(_core.curvature_weight("lucy", 3, other)[0])
    both = (1.0 + curvature * own) * (1.0 + curvature * p)
    share = 2.0 * (1.0 - height) * wt * ring * both * np.sum(arc * over_axis(s), axis=1)
    return float(share.sum())


def lattice_density(name: str, kind: str) -> float:
    """Mean density of a lattice within h/2 of a wall that cuts it, over that far away, less 1."""
    scene = scene_of(kind, MODELS[name].model).replace(start=sdpd.LatticeStart(jitter=0.0))
    integrator = "pair_splitting" if MODELS[name].splits else "velocity_verlet"
    sim = sdpd.Simulation(scene, integrator=integrator, threads=1)
    distance = scene.geometry.distance(np.array(sim.positions))
    near, far = (sim.number_densities[of].mean() for of in (distance < 0.5 * SUPPORT, distance > 4))
    return float(near / far - 1.0)


# --- fluids at rest ----------------------------------------------------------------------------


def _simulation(name: str, kind: str, seed: int) -> sdpd.Simulation:
    """At half a friction time where friction is solved exactly, else at a fifth of it."""
    chosen = MODELS[name]
    scene = scene_of(kind, chosen.model)
    integrator: Any = sdpd.PairSplitting() if chosen.splits else sdpd.VelocityVerlet()
    step = (0.5 if chosen.splits else 0.2) * scene.friction_time
    return sdpd.Simulation(scene, integrator=integrator, dt=step, seed=seed, threads=1)


def layer(name: str, samples: int = 40, warm: int = 400, seed: int = 3) -> dict[str, Any]:
    """Temperature of the layer of one spacing at planes, along and across, and crossings.

    Crossings are counted per particle of the layer and unit of time, dx (m/k_B T)^(1/2).
    """
    sim = _simulation(name, "slab", seed)
    sim.run(steps=warm, progress=False)
    profiles = [
        sdpd.Profile(wall=k, bins=1, range=(0.0, 1.0), every=4, samples_per_block=samples)
        for k in range(2)
    ]
    before, start = sim.statistics()["wall_crossings"], sim.time
    sim.run(steps=4 * samples * BLOCKS, observe=profiles, progress=False)
    count = sim.statistics()["wall_crossings"] - before
    temperature = np.mean([p.series("temperature")[:, 0] for p in profiles], axis=0)
    density = np.mean([p.series("density")[:, 0] for p in profiles], axis=0)
    along = temperature[:, :2].mean(axis=1)
    particles = density.mean() * 2.0 * 49.0  # of mass 1, in both layers
    return {
        "along": _mean(along),
        "across": _mean(temperature[:, 2]),
        "crossings": count / particles / (sim.time - start),
    }


def wall_density(name: str, kind: str, samples: int = 3, warm: int = 300) -> list[float]:
    """Density of the layer of one spacing at a round wall over that of the fluid, and its error."""
    sim = _simulation(name, kind, 5)
    sim.run(steps=warm, progress=False)
    near = sdpd.Profile(wall=0, bins=1, range=(0.0, 1.0), every=4, samples_per_block=samples)
    far = sdpd.Profile(wall=0, bins=1, range=(4.0, 7.0), every=4, samples_per_block=samples)
    sim.run(steps=4 * samples * BLOCKS, observe=[near, far], progress=False)
    return _mean(near.series("density")[:, 0] / far.density[0])


def _mean(series: np.ndarray) -> list[float]:
    return [float(series.mean()), float(series.std(ddof=1) / math.sqrt(len(series)))]


# --- flow and cost -----------------------------------------------------------------------------


def slip(name: str, particles: int = 31) -> float:
    """Where steady Couette flow, carried on, reaches the walls' velocities: mean shift [h].

    Positive where the fluid seems wider than the channel.
    """
    length, top = 1e-3, 1.25e-5
    box = sdpd.Box((9 * length / particles, length), periodic="x")
    model = MODELS[name].explicit
    if model.name != "symmetric_images" and getattr(model, "least_distance", 0.0) > 0.0:
        kind = type(model)
        options = {"pressure": model.pressure} if hasattr(model, "pressure") else {}
        model = kind(least_distance=LEAST * length / particles, **options)
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water().in_plane(1e-4),
        box=box,
        walls=sdpd.walls.slab(box, "y", upper_velocity=(top, 0.0)),
        resolution=sdpd.Resolution(particles=(9, particles), support=SUPPORT, kernel="lucy"),
        effects=sdpd.Effects(fluctuations=False),
        sound_speed=1.25e-4,
        wall_model=model,
    )
    sim = sdpd.Simulation(scene, threads=1)
    sim.run(time=1.0, progress=False)
    z, v = np.array(sim.positions[:, 1]), np.array(sim.velocities[:, 0])
    away = np.abs(z - 0.5 * length) < 0.5 * length - scene.support_radius
    line = np.polynomial.Polynomial.fit(z[away], v[away], 1)
    ends = [float(line.roots()[0]), float((line - top).roots()[0])]
    return 0.5 * (ends[1] - ends[0] - length) / scene.support_radius


def cost(repeats: int = 5, steps: int = 20) -> dict[str, float]:
    """Time of a velocity Verlet step in the pipe over that with symmetric images, at best."""
    sims = {}
    for name, chosen in MODELS.items():
        scene = scene_of("pipe", chosen.explicit)
        sims[name] = sdpd.Simulation(
            scene, integrator="velocity_verlet", dt=0.2 * scene.friction_time, threads=1
        )
        sims[name].run(steps=20, progress=False)
    best = dict.fromkeys(sims, math.inf)
    for _ in range(repeats):
        for name, sim in sims.items():
            start = time.perf_counter()
            sim.run(steps=steps, progress=False)
            best[name] = min(best[name], time.perf_counter() - start)
    return {name: value / best["symmetric"] for name, value in best.items()}


# --- table and figure --------------------------------------------------------------------------


def row(name: str, found: dict[str, Any], heights: np.ndarray) -> list[str]:
    """A model's line of the table."""
    fields = []
    for side in (-1.0, 1.0):
        error = mean_field(name, side, heights)
        fields.append(f"{100.0 * error[np.abs(error).argmax()]:+.2f}")
    fields += [f"{100.0 * lattice_density(name, kind):+.1f}" for kind in ("pipe", "post")]
    return [
        MODELS[name].title,
        *(f"{value:.3g}" for value in found["energy"]),
        *fields,
        *(shown(*found[kind], digits=3) for kind in ("pipe", "post")),
        *(shown(*found[part], digits=3) for part in ("along", "across")),
        f"{found['slip']:+.4f}",
        f"{found['crossings']:.3f}",
        f"{found['cost']:.1f}",
    ]


def picture(report: Report, numbers: dict[str, Any]) -> None:
    """Error of the mean-field density at round walls, and temperatures of the layer."""
    figure, panels = subplots(2, width=9.0)
    heights = np.linspace(0.0, 0.98, 8 if report.quick else 80)
    for name, colour in zip(("own foot", "completion", "symmetric"), COLOURS, strict=True):
        for side, style in ((-1.0, "-"), (1.0, "--")):
            label = MODELS[name].title.split(",")[0] if side < 0.0 else None
            error = 100.0 * np.abs(mean_field(name, side, heights))
            panels[0].semilogy(heights, error, style, color=colour, label=label)
    panels[0].set(xlabel="$\\phi/h$", ylabel="|error of the density| [%]", ylim=(1e-4, 10.0))
    panels[0].legend()
    places = np.arange(len(MODELS))
    for shift, part, marker, colour in ((-0.1, "along", "o", BLUE), (0.1, "across", "s", ORANGE)):
        values = np.array([numbers[name][part] for name in MODELS])
        style = {"fmt": marker, "color": colour, "markersize": 4, "label": f"{part} the wall"}
        panels[1].errorbar(values[:, 0], places + shift, xerr=values[:, 1], **style)
    panels[1].axvline(1.0, color="black", linewidth=0.8)
    panels[1].set(xlabel="temperature of the layer $z<\\Delta x$")
    panels[1].set_yticks(places, [chosen.title for chosen in MODELS.values()])
    panels[1].invert_yaxis()
    panels[1].legend()
    report.figure(figure)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("wall_models", __doc__, argv)
    numbers = json.loads(RECORD.read_text())["wall_models"]["numbers"]
    heights = np.linspace(0.0, 0.98, 5 if report.quick else 50)
    picture(report, numbers)
    header = [
        "model",
        "energy, $\\Delta t=0.01$",
        "0.005",
        "mean field, inside [%]",
        "outside [%]",
        "lattice, inside [%]",
        "outside [%]",
        "density, inside",
        "outside",
        "T along",
        "T across",
        "slip [h]",
        "crossings",
        "cost",
    ]
    report.document(
        grid(header, [row(name, numbers[name], heights) for name in MODELS]),
        "*Energy*: rms error in a pipe of $R=5h$ without friction [$k_BT$], at two time steps. "
        "*Mean field*: largest error of the density of a particle in a uniform fluid at a cylinder "
        "of $R=5h$. *Lattice*: mean error of densities within $h/2$ of it, on a lattice that it "
        "cuts. *Density*: of the layer of one spacing in a fluid that moves, over that of the "
        "fluid away from the wall, inside of a cylinder and outside. *T*: kinetic temperature of "
        "the layer of one spacing at planes over that of the bath, along the wall and across. "
        "*Slip*: how much wider than the channel a Couette flow without noise seems, at each wall. "
        "*Crossings*: per particle of that layer and unit of time. *Cost*: of a step of velocity "
        "Verlet in the pipe, over that of symmetric images, on a busy machine. Lucy, "
        f"$h/\\Delta x={SUPPORT:g}$, $X=100$, $\\eta^*={ETA:g}$, $m=k_BT=\\Delta x=1$; one "
        "standard error.",
    )


if __name__ == "__main__":
    warnings.simplefilter("ignore", sdpd.TimeStepWarning)
    main()
