"""Walls of the core against the NumPy twin: densities, forces, matrices, exchanges, momentum.

Rows: planes, corners, cylinders, spheres, a pipe with lids, in both dimensions, with walls that
slide and turn. The bound is 1e-12 of the rms force.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import sdpd
from sdpd import _core

from .build import coefficients, maxwell
from .twin import KERNELS
from .twin.integrators import exchange_sweep
from .twin.walls import (
    NO_EDGE,
    Plane,
    Round,
    Shaped,
    Wall,
    WallSystem,
    solve_curvature_weight,
)

Array = NDArray[np.float64]

SUPPORT = 2.1  # dx = 1; the edges of periodic axes are two supports and more
EDGE = 6.0


def plane(dimension: int, axis: int, at: float, side: float, velocity: Sequence[float]) -> Plane:
    point, normal, v = np.zeros(dimension), np.zeros(dimension), np.zeros(dimension)
    point[axis], normal[axis] = at, side
    v[:] = velocity[:dimension]
    return Plane(point, normal, v)


def slab(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    axis = dimension - 1
    speeds = ([0.7, 0.0, 0.0], [-0.2, 0.4, 0.0] if dimension == 3 else [-0.2, 0.0, 0.0])
    walls: list[Wall] = [
        plane(dimension, axis, 0.0, 1.0, speeds[0]),
        plane(dimension, axis, EDGE, -1.0, speeds[1]),
    ]
    return walls, [(0,), (1,)], "xyz"[:axis]


def tilted(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    """One plane at an angle, in a box with no periodic axis but the last."""
    n = np.array([0.6, 0.8, 0.0][:dimension])
    along = np.array([-0.8, 0.6, 0.3][:dimension])
    return [Plane(0.9 * n, n, along)], [(0,)], "z" if dimension == 3 else ""


def duct(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    """Four planes along x and y: corners; in 3D they slide along the edges."""
    v = [[0.0, 0.0, speed] if dimension == 3 else [0.0, 0.0, 0.0] for speed in (0.5, -0.3, 0.2, 0)]
    walls: list[Wall] = [
        plane(dimension, 0, 0.0, 1.0, v[0]),
        plane(dimension, 0, EDGE, -1.0, v[1]),
        plane(dimension, 1, 0.0, 1.0, v[2]),
        plane(dimension, 1, EDGE, -1.0, v[3]),
    ]
    images = [(0,), (1,), (2,), (3,), (0, 2), (0, 3), (1, 2), (1, 3)]
    return walls, images, "z" if dimension == 3 else ""


def closed(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    """A closed box: images of images of images."""
    walls: list[Wall] = []
    for axis in range(3):
        walls += [
            plane(3, axis, 0.0, 1.0, np.zeros(3).tolist()),
            plane(3, axis, EDGE, -1.0, np.zeros(3).tolist()),
        ]
    images: list[tuple[int, ...]] = [(k,) for k in range(6)]
    for i in range(6):
        for j in range(i + 1, 6):
            if i // 2 == j // 2:
                continue
            images.append((i, j))
            images += [(i, j, k) for k in range(j + 1, 6) if k // 2 not in (i // 2, j // 2)]
    return walls, images, ""


def pipe(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    centre = np.array([3.1, 2.9, 0.0][:dimension])
    v = np.array([0.0, 0.0, 0.4][:dimension])
    spin = np.array([0.0, 0.0, 0.15])
    return [Round(centre, 2.7, -1.0, 2, v, spin)], [(0,)], "z" if dimension == 3 else ""


def post(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    """A circle or a cylinder along y amid a periodic box."""
    axis = 2 if dimension == 2 else 1
    spin = np.zeros(3)
    spin[axis] = -0.2
    v = np.zeros(dimension)
    if dimension == 3:
        v[1] = -0.3
    return [Round(np.full(dimension, 2.2), 2.15, 1.0, axis, v, spin)], [(0,)], "xyz"[:dimension]


def sphere(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    spin = np.array([0.1, -0.2, 0.05])
    return [Round(np.full(3, 4.0), 2.2, 1.0, None, np.zeros(3), spin)], [(0,)], "xyz"


def bubble(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    return [Round(np.full(3, 3.0), 2.8, -1.0, None, np.zeros(3), np.zeros(3))], [(0,)], ""


def lidded(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    """A pipe along z with two lids: corners of a curved wall; the floor slides nowhere."""
    walls = [*pipe(3)[0], plane(3, 2, 0.0, 1.0, [0, 0, 0]), plane(3, 2, EDGE, -1.0, [0, 0, 0])]
    first = walls[0]
    assert isinstance(first, Round)
    walls[0] = Round(first.centre, first.radius, -1.0, 2, np.zeros(3), first.spin)
    return walls, [(0,), (1,), (2,), (0, 1), (0, 2)], ""


@functools.cache
def shape(kind: str, kernel: str) -> Shaped:
    """A field wall in a box of `EDGE`: a channel with a re-entrant edge, or an ellipsoid that
    turns."""
    if kind == "bent":
        half = 0.5 * EDGE
        outline = [(0, 0), (EDGE, 0), (EDGE, half), (half, half), (half, EDGE), (0, EDGE)]
        wall: Any = sdpd.Polyline(points=outline)
        field = wall.field(sdpd.Box((EDGE, EDGE), periodic=""), SUPPORT, kernel)
        return Shaped(field, np.array([2.0, 2.5]), np.zeros(2), np.zeros(3))
    if kind == "step":
        line = [(0, 1), (2, 1), (3, 2), (4, 1), (EDGE, 1)]
        wall = sdpd.Polyline(points=line, closed=False)
        lid = sdpd.LevelSet(
            function=lambda r: np.minimum(
                wall.distance(r, sdpd.Box((EDGE, EDGE), periodic="x")), 5.5 - r[:, 1]
            )
        )
        field = lid.field(sdpd.Box((EDGE, EDGE), periodic="x"), SUPPORT, kernel)
        return Shaped(field, np.array([3.0, 1.5]), np.zeros(2), np.zeros(3))
    axes = np.array([2.8, 2.8, 2.2])
    ellipsoid = sdpd.LevelSet(function=lambda r: 1.0 - np.sum(((r - 3.0) / axes) ** 2, axis=1))
    field = ellipsoid.field(sdpd.Box((EDGE,) * 3, periodic=""), SUPPORT, kernel)
    return Shaped(field, np.full(3, 3.0), np.zeros(3), np.array([0.0, 0.0, 0.3]))


def bent(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    return [shape("bent", "lucy")], [(0,)], ""


def step(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    return [shape("step", "lucy")], [(0,)], "x"


def ellipsoid(dimension: int) -> tuple[list[Wall], list[tuple[int, ...]], str]:
    return [shape("ellipsoid", "lucy")], [(0,)], ""


Geometry = Callable[[int], tuple[list[Wall], list[tuple[int, ...]], str]]
CASES: list[tuple[Geometry, int]] = [
    (slab, 2),
    (slab, 3),
    (tilted, 2),
    (tilted, 3),
    (duct, 2),
    (duct, 3),
    (closed, 3),
    (pipe, 2),
    (pipe, 3),
    (post, 2),
    (post, 3),
    (sphere, 3),
    (bubble, 3),
    (lidded, 3),
    (bent, 2),
    (step, 2),
    (ellipsoid, 3),
]
NAMES = [f"{geometry.__name__}-{dimension}d" for geometry, dimension in CASES]
each_case = pytest.mark.parametrize(("geometry", "dimension"), CASES, ids=NAMES)


def problem(
    geometry: Geometry,
    dimension: int,
    *,
    kernel: str = "lucy",
    friction: str = "general",
    noise: str = "gaussian",
    seed: int = 7,
    viscosity: float = 20.0,
) -> WallSystem:
    """Random particles at about unit spacing in the fluid, some within 0.02 of a wall."""
    walls, images, periodic = geometry(dimension)
    rng = np.random.default_rng([seed, dimension])
    axes = [np.arange(int(EDGE)) + 0.5] * dimension
    sites = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    points = sites + rng.uniform(-0.48, 0.48, sites.shape)
    length = EDGE
    if geometry in (post, sphere):  # need room to their own periodic images
        length = 8.0
        more = rng.uniform(0.0, 8.0, (5**dimension * 2, dimension))
        points = np.concatenate([points, more])
    box = np.array([length if "xyz"[a] in periodic else NO_EDGE for a in range(dimension)])
    for wall in walls:
        points = points[wall.stand(points, box).distance > 0.0]
    points = rng.permutation(points)
    a, b = coefficients(friction, dimension, viscosity, 4.0)

    def weight(q: Array) -> tuple[Array, Array]:
        return _core.curvature_weight(kernel, dimension, q)

    return WallSystem(
        positions=points,
        velocities=maxwell(len(points), dimension, rng),
        box=box,
        support=SUPPORT,
        mass=1.0,
        thermal_energy=1.0,
        kernel=kernel,
        friction=friction,
        friction_across=a,
        friction_along=b,
        eos=("linear", [1.0, 10.0, 3.0]),
        noise="none" if friction == "none" else noise,
        dt=0.002,
        seed=2024,
        walls=tuple(walls),
        images=tuple(images),
        weight=weight,
    )


def numbers(wall: Wall, dimension: int) -> tuple[str, list[float]]:
    """A wall in the form of the core."""

    def three(x: Array) -> list[float]:
        return [*map(float, x), 0.0, 0.0, 0.0][:3] if len(x) < 3 else [*map(float, x)]

    if isinstance(wall, Shaped):
        motion = [*three(wall.velocity), *three(wall.spin)]
        return "field", [*three(wall.centre), *motion, 0.0, 0.0]
    if isinstance(wall, Plane):
        return "plane", [*three(wall.point), *three(wall.normal), *three(wall.velocity), 0.0]
    rest = [wall.radius, wall.side, *three(wall.velocity), *three(wall.spin), 0.0]
    if wall.axis is None:
        return "sphere", three(wall.centre) + rest
    return "cylinder", [*three(wall.centre), float(wall.axis), *rest]


def core(system: WallSystem, integrator: str = "velocity_verlet", **options: Any) -> Any:
    lengths = np.where(system.box == NO_EDGE, EDGE, system.box)
    arguments = {
        "positions": system.positions,
        "velocities": system.velocities,
        "box": lengths,
        "periodic": [bool(edge != NO_EDGE) for edge in system.box],
        "walls": [numbers(wall, system.dimension) for wall in system.walls],
        "fields": [wall.field for wall in system.walls if isinstance(wall, Shaped)],
        "support": system.support,
        "mass": system.mass,
        "thermal_energy": system.thermal_energy,
        "kernel": system.kernel,
        "friction": system.friction,
        "friction_across": system.friction_across,
        "friction_along": system.friction_along,
        "eos": system.eos,
        "noise": system.noise,
        "integrator": integrator,
        "iterations": 1,
        "body_force": None,
        "dt": system.dt,
        "seed": system.seed,
        "skin": None,
        "threads": 1,
    }
    return _core.Core(**{**arguments, **options})


def rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def assert_same_forces(sim: Any, system: WallSystem, tolerance: float = 1e-12) -> None:
    d = system.number_densities
    assert np.abs(sim.number_densities - d).max() <= tolerance * d.mean()
    expected, got = system.forces(0), sim.force_parts()
    scale = rms(expected.total)
    for name in ("conservative", "dissipative", "random"):
        worst = np.abs(got[name] - getattr(expected, name)).max()
        assert worst <= tolerance * scale, f"{name}: {worst / scale:.1e} of the rms force"


@each_case
def test_forces(geometry: Geometry, dimension: int) -> None:
    system = problem(geometry, dimension)
    sim = core(system)
    assert_same_forces(sim, system)
    assert sim.statistics()["wall_links"] > 5
    rate = np.trace(system.friction_matrix()) / (system.size * dimension)
    # direct and image pairs alike have the trace D a + b; own images twice
    assert sim.friction_rate() == pytest.approx(rate, rel=1e-11)


@pytest.mark.parametrize("friction", ["general", "central", "none"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_every_kernel_and_friction(kernel: str, friction: str) -> None:
    for geometry, dimension in ((pipe, 2), (lidded, 3)):
        system = problem(geometry, dimension, kernel=kernel, friction=friction)
        assert_same_forces(core(system), system)


@each_case
def test_forces_of_images_alone(geometry: Geometry, dimension: int) -> None:
    """What `WallForceProfile` bins: the twin's images, and all that the walls feel."""
    system = problem(geometry, dimension)
    sim = core(system)
    parts = sim.force_parts(None, True)
    scale = rms(sim.forces)
    images = system.image_conservative()
    assert np.abs(parts["conservative"] - images).max() < 1e-12 * scale
    felt = sum(part.sum(axis=0) for part in parts.values())
    wrench = sim.wall_forces()[:, :dimension].sum(axis=0)
    assert np.abs(felt + wrench).max() < 1e-12 * scale * np.sqrt(system.size)
    again = sim.force_parts()
    assert np.abs(sum(again.values()) - sim.forces).max() < 1e-12 * scale


@each_case
def test_reaction_of_the_walls(geometry: Geometry, dimension: int) -> None:
    """The walls' forces are what the fluid feels in all, and round walls feel its torque."""
    system = problem(geometry, dimension)
    sim = core(system)
    scale = rms(sim.forces) * np.sqrt(system.size)
    wrench = sim.wall_forces()
    assert np.abs(wrench[:, :dimension].sum(axis=0) + sim.forces.sum(axis=0)).max() < 1e-12 * scale
    still = core(system.at(friction="none", noise="none", friction_across=0.0, friction_along=0.0))
    if isinstance(system.walls[0], Shaped):
        arm = np.zeros((system.size, 3))
        arm[:, :dimension] = system.positions - system.walls[0].centre
        force = np.zeros((system.size, 3))
        force[:, :dimension] = still.forces
        torque = -np.cross(arm, force).sum(axis=0)
        if geometry is not step:  # whose arms end at the periodic faces
            assert np.abs(still.wall_forces()[0, 3:] - torque).max() < 1e-10 * scale
        return
    assert np.abs(still.wall_forces()[:, 3:]).max() < 1e-12 * scale


def energy(system: WallSystem) -> float:
    return system.potential_energy(1.0)


@each_case
def test_the_force_is_the_gradient_of_the_energy(geometry: Geometry, dimension: int) -> None:
    """Finite differences of U along random directions of all particles at once."""
    system = problem(geometry, dimension, kernel="wendland_c4", friction="none")
    force = system.forces().conservative
    rng = np.random.default_rng(3)
    for _ in range(3):
        direction = rng.standard_normal(system.positions.shape)
        step = 2e-6
        ends = [
            energy(system.at(positions=system.positions + s * step * direction)) for s in (1, -1)
        ]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        work = float(np.sum(force * direction))
        assert slope == pytest.approx(-work, abs=1e-6 * rms(force) * np.sqrt(system.size))


@each_case
def test_friction_matrix(geometry: Geometry, dimension: int) -> None:
    """Symmetric, positive semidefinite, and that of the core; walls at rest."""
    system = problem(geometry, dimension)
    gamma = system.friction_matrix()
    scale = np.abs(gamma).max()
    assert np.abs(gamma - gamma.T).max() < 1e-14 * scale
    eigenvalues = np.linalg.eigvalsh(gamma)
    # walls at rest hold the fluid: no motion is free of friction
    assert eigenvalues[0] > 0.0
    sim = core(system)
    moving = sim.force_parts()["dissipative"]
    sim.velocities[...] = 0.0
    sim.refresh()
    drag = moving - sim.force_parts()["dissipative"]
    expected = -(gamma @ system.velocities.ravel()).reshape(drag.shape)
    assert np.abs(drag - expected).max() < 1e-11 * rms(expected)


@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 2), (pipe, 2), (closed, 3)])
def test_noise_balances_drag(geometry: Geometry, dimension: int) -> None:
    """B B^T = 2 kT Gamma without sampling: the columns of B by unit variates of each link."""
    system = problem(geometry, dimension)
    n, d = system.size, dimension
    columns = []
    for link in system.links:
        strength = np.sqrt(np.where(link.i == link.j, 2.0, 1.0) * 2.0 * system.link_coupling(link))
        root = system.blocks(link, np.sqrt)
        for k in range(len(link.i)):
            one = type(link)(
                *(part[k : k + 1] if isinstance(part, np.ndarray) else part for part in link)
            )
            for a in range(d):
                column = system.scatter(one, strength[k] * root[k : k + 1, :, a])
                columns.append(column.ravel())
    b = np.stack(columns, axis=1)
    gamma = system.friction_matrix() - super(WallSystem, system).friction_matrix()
    assert np.abs(b @ b.T - 2.0 * gamma).max() < 1e-13 * np.abs(gamma).max()
    assert gamma.shape == (n * d, n * d)


@each_case
def test_exact_exchange(geometry: Geometry, dimension: int) -> None:
    """A step of the splitting: links in the order of the core, bounce-forward, momentum."""
    system = problem(geometry, dimension).at(dt=0.01)
    sim = core(system, "pair_splitting")
    pairs = np.asarray(sim.pair_order(), dtype=np.int64)
    links = np.asarray(sim.wall_link_order(), dtype=np.int64)
    half = 0.5 * system.dt
    swept = exchange_sweep(system, pairs, 0, 0, half).exchanged(links, 0, 0, half, False)
    moved = pair_splitting_drift(swept)
    back = moved.exchanged(links, 0, 1, half, True)
    expected = exchange_sweep(back, pairs[::-1], 0, 1, half)
    sim.run(1, system.dt)
    assert np.array_equal(np.asarray(sim.wall_link_order(), dtype=np.int64), links)
    assert np.abs(sim.velocities - expected.velocities).max() < 1e-10
    # what the fluid has lost is what the walls have got
    lost = (system.velocities - sim.velocities).sum(axis=0)
    received = sim.wall_impulses()[:, :dimension].sum(axis=0)
    assert np.abs(lost - received).max() < 1e-11


def pair_splitting_drift(system: WallSystem) -> WallSystem:
    """Half kick, drift with bounce-forward, half kick."""
    half = 0.5 * system.dt
    v = system.velocities + half * system.forces().conservative
    moved = system.at(positions=system.positions + system.dt * v, velocities=v).bounced()
    force = moved.forces().conservative
    return moved.at(velocities=moved.velocities + half * force)  # type: ignore[return-value]


@pytest.mark.parametrize(("geometry", "dimension"), [(slab, 2), (duct, 3), (pipe, 3), (sphere, 3)])
def test_bounce_forward(geometry: Geometry, dimension: int) -> None:
    """Free flight into walls that slide and turn: every particle is where the twin puts it."""
    system = problem(geometry, dimension, friction="none").at(eos=("polynomial", [0.0]), dt=0.3)
    moved = system.at(positions=system.positions + system.dt * system.velocities)
    crossed = sum(int((stand.distance < 0.0).sum()) for stand in moved.stands)
    assert crossed > 0
    expected = moved.bounced()
    sim = core(system)
    sim.run(1, system.dt)
    turns = system.box * np.rint((sim.positions - expected.positions) / system.box)
    assert np.abs(sim.positions - expected.positions - turns).max() < 1e-12
    assert np.abs(sim.velocities - expected.velocities).max() < 1e-12
    for wall in system.walls:
        assert wall.stand(np.array(sim.positions), system.box).distance.min() >= -1e-12


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 2), (lidded, 3), (post, 3)])
def test_momentum_goes_to_the_walls(geometry: Geometry, dimension: int, integrator: str) -> None:
    """Over many steps, in pieces, with noise, drag and bounces: to rounding."""
    system = problem(geometry, dimension)
    sim = core(system, integrator)
    sim.run(7, 0.001)
    sim.run(13, 0.001)
    lost = (system.velocities - sim.velocities).sum(axis=0)
    received = sim.wall_impulses()[:, :dimension].sum(axis=0)
    size = np.abs(sim.wall_impulses()).sum()
    assert size > 1.0
    assert np.abs(lost - received).max() < 1e-12 * size


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 3), (post, 3)])
def test_bits_on_any_number_of_threads(geometry: Geometry, dimension: int, integrator: str) -> None:
    system = problem(geometry, dimension)
    sims = [core(system, integrator, threads=threads) for threads in (1, 2, 3)]
    for sim in sims:
        sim.run(20, 0.001)
    for sim in sims[1:]:
        assert np.array_equal(sim.positions, sims[0].positions)
        assert np.array_equal(sim.velocities, sims[0].velocities)
        assert np.array_equal(sim.wall_impulses(), sims[0].wall_impulses())
    # nor does a cut in the run, across save and load, with lists that have a skin of their own
    whole, part, again = (core(system, integrator, skin=0.02, threads=k) for k in (1, 2, 3))
    whole.run(20, 0.001)
    part.run(11, 0.001)
    again.set_state(part.state())
    again.run(9, 0.001)
    assert np.array_equal(again.positions, whole.positions)
    assert np.array_equal(again.velocities, whole.velocities)
    # and a skin is only speed
    assert np.abs(whole.velocities - sims[0].velocities).max() < 1e-9


def test_positions_behind_walls_are_refused() -> None:
    system = problem(slab, 3)
    points = np.array(system.positions)
    points[5, 2] = -0.1
    with pytest.raises(ValueError, match=r"row 5 at 0\.0476 supports behind wall 0"):
        core(system.at(positions=points))
    sim = core(system)
    sim.positions[...] = points
    with pytest.raises(ValueError, match="in the fluid"):
        sim.refresh()


def test_a_particle_that_leaves_stops_the_run() -> None:
    """Thrown out over a corner of the box farther than reflections bring it back."""
    system = problem(tilted, 2)
    v = np.array(system.velocities)
    v[3] = [300.0, 0.0]
    sim = core(system.at(velocities=v, friction="none", noise="none", eos=("polynomial", [0.0])))
    before = np.array(sim.positions)
    with pytest.raises(RuntimeError, match=r"step \d+: particle 3 at \(.*outside of the box"):
        sim.run(400, 0.005)
    assert np.array_equal(sim.positions, before)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_curvature_weight(kernel: str, dimension: int) -> None:
    s, p = solve_curvature_weight(kernel, dimension)
    near = s < 0.9
    got, _ = _core.curvature_weight(kernel, dimension, s[near])
    assert np.abs(got - p[near]).max() < 2e-4
