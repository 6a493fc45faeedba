"""Walls of any shape: distances, weights, what is refused, starts, files, energy."""

import math
import pickle
import warnings

import numpy as np
import pytest
from scipy.spatial import cKDTree

import sdpd
from sdpd import _core

from .scenes import reduced_scene

OPEN = sdpd.Box((8.0, 8.0), periodic="")
OPEN3 = sdpd.Box((8.0, 8.0, 8.0), periodic="")
SQUARE = [(1.0, 1.0), (7.0, 1.0), (7.0, 7.0), (1.0, 7.0)]
FLUID = sdpd.Fluid(
    density=1.0,
    shear_viscosity=20.0,
    temperature=1.0,
    boltzmann_constant=1.0,
    equation_of_state=sdpd.eos.Linear(background_pressure=100.0),
)


def sphere(radius, centre, n=24, inside_out=False):
    """Points and triangles of a sphere from an octahedron, edges divided n times."""
    faces = []
    for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).T.reshape(-1, 3):
        corner = np.diag(signs).astype(float)
        faces.append(corner if np.prod(signs) > 0 else corner[::-1])
    triangles = []
    for a, b, c in faces:
        grid = {
            (i, j): a + (b - a) * i / n + (c - a) * j / n
            for i in range(n + 1)
            for j in range(n + 1 - i)
        }
        for i in range(n):
            for j in range(n - i):
                triangles.append([grid[i, j], grid[i + 1, j], grid[i, j + 1]])
                if i + j < n - 1:
                    triangles.append([grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]])
    flat = np.array(triangles).reshape(-1, 3)
    flat = centre + radius * flat / np.linalg.norm(flat, axis=1)[:, None]
    numbers = np.arange(len(flat)).reshape(-1, 3)
    return flat, numbers[:, ::-1] if inside_out else numbers


def cube(low=2.0, high=6.0):
    corners = [(x, y, z) for x in (low, high) for y in (low, high) for z in (low, high)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return corners, triangles


def star(tips=5, outer=3.4, inner=1.9, centre=4.0):
    angle = np.pi * np.arange(2 * tips) / tips
    radius = np.where(np.arange(2 * tips) % 2 == 0, outer, inner)
    return np.column_stack([centre + radius * np.cos(angle), centre + radius * np.sin(angle)])


# --- what is refused -------------------------------------------------------------------------


def shaped_scene(wall, box=OPEN, **changes):
    arguments = {
        "resolution": sdpd.Resolution(spacing=0.4, support=2.5, kernel="lucy"),
        "start": sdpd.RandomStart(relax_steps=60),
        "sound_speed": 10.0,
        "fluid": FLUID,
        **changes,
    }
    return reduced_scene(dimension=box.dimension, box=box, walls=[wall], **arguments)


CORNERS, FACES = cube()
MESSAGES = [
    (
        lambda: sdpd.Polyline(points=[(0, 0), (1, 1)]),
        "`points` must have at least 3 rows, got 2",
    ),
    (
        lambda: sdpd.Polyline(points=[(0, 0), (1, 0), (1, 0), (0, 1)]),
        "`points` must differ from one to the next, got twice (1.0, 0.0) in row 1",
    ),
    (
        lambda: sdpd.Polyline(points=[(0, 0), (2, 2), (2, 0), (0, 2)]),
        (
            "`points` must make lines that do not cross, got lines 0 from (0.0, 0.0) and 2 from "
            "(2.0, 0.0)"
        ),
    ),
    (
        lambda: shaped_scene(
            sdpd.Polyline(points=[(0, 1), (8, 2)], closed=False), sdpd.Box((8, 8), periodic="x")
        ),
        (
            "`walls[0]` is open: its ends must lie on opposite periodic faces at the same place, "
            "got (0.0, 1.0) and (8.0, 2.0); close it, or see `box.periodic`"
        ),
    ),
    (
        lambda: shaped_scene(sdpd.Polyline(points=SQUARE), OPEN3),
        "`walls[0]` is a Polyline, which needs two dimensions; use a Mesh",
    ),
    (
        lambda: shaped_scene(sdpd.Mesh(points=CORNERS, triangles=FACES), OPEN),
        "`walls[0]` is a Mesh, which needs three dimensions; use a Polyline",
    ),
    (lambda: sdpd.Mesh(), "a Mesh needs either `file`, or `points` and `triangles`"),
    (
        lambda: sdpd.Mesh(points=CORNERS, triangles=[(0, 1, 9)]),
        "`triangles` must hold numbers of the 8 points, got 0 to 9",
    ),
    (
        lambda: sdpd.Mesh(points=[*CORNERS, (4, 2, 2)], triangles=[*FACES, (0, 8, 4)]),
        (
            "`triangles` must have an area, got none in 1 of them, the first being 12 at "
            "(4.0, 2.0, 2.0)"
        ),
    ),
    (
        lambda: sdpd.Mesh(points=CORNERS, triangles=[FACES[0][::-1], *FACES[1:]]),
        (
            "`triangles` must all go round the same way, with two at each edge, got an edge passed "
            "twice in one direction at (2.0, 4.0, 4.0)"
        ),
    ),
    (
        lambda: sdpd.Mesh(points=CORNERS, triangles=[t[::-1] for t in FACES]),
        (
            "`triangles` must go round counter-clockwise seen from outside, got the other way "
            "round in the part at (2.0, 6.0, 6.0): exchange two columns, or use `fluid` to say "
            "which side the fluid is on"
        ),
    ),
    (
        lambda: shaped_scene(sdpd.Mesh(points=CORNERS, triangles=FACES[1:], fluid="inside"), OPEN3),
        (
            "`walls[0]` must be a closed surface, or match itself on periodic faces of the box, "
            "got 3 edges of one triangle only, the first at (2.0, 4.0, 4.0)"
        ),
    ),
    (
        lambda: shaped_scene(sdpd.LevelSet(function=lambda r: 1.0 + r[:, 0] ** 2)),
        (
            "`function` must change its sign in the box, got positive numbers everywhere on a grid "
            "of spacing 0.0208"
        ),
    ),
    (
        lambda: shaped_scene(sdpd.LevelSet(function=lambda r: r)),
        "`function` must return an array of shape (212521,), got (212521, 2)",
    ),
    (
        lambda: shaped_scene(sdpd.Polyline(points=SQUARE, angular_velocity=(1.0, 0.0, 0.0))),
        "`walls[0].angular_velocity` must be about z in two dimensions, got (1.0, 0.0, 0.0)",
    ),
]


@pytest.mark.parametrize(("call", "text"), MESSAGES)
def test_messages(call, text):
    with pytest.raises(ValueError, match=r".") as caught:
        call()
    assert str(caught.value) == text


def test_types_and_functions_that_are_not_numbers_are_refused():
    with pytest.raises(TypeError, match="`function` must be a function of points, got float"):
        sdpd.LevelSet(function=1.0)
    with pytest.raises(TypeError, match=r"`triangles` must be integers of shape \(M, 3\)"):
        sdpd.Mesh(points=CORNERS, triangles=[(0.0, 1.0, 2.0)])
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match="must be finite, got nan"):
        shaped_scene(sdpd.LevelSet(function=lambda r: np.sqrt(r[:, 0] - 4.0)))


def test_crossing_triangles_are_named():
    points, triangles = cube()
    other = np.asarray(points) + 3.0
    both = [*points, *other.tolist()]
    more = [*triangles, *(np.asarray(triangles) + 8).tolist()]
    with pytest.raises(ValueError, match=r"must not cross each other, got \d+ and \d+ near \("):
        sdpd.Mesh(points=both, triangles=more)


@pytest.mark.parametrize(
    ("wall", "text"),
    [
        (sdpd.Polyline(points=SQUARE, velocity=(1.0, 0.0)), "must stay in its place"),
        (sdpd.Polyline(points=SQUARE, angular_velocity=0.1), "must stay in its place"),
    ],
)
def test_walls_that_leave_their_place_are_refused(wall, text):
    scene = shaped_scene(wall)
    with pytest.raises(ValueError, match=text):
        sdpd.Simulation(scene, seed=1)


def test_thin_blades_and_coarse_meshes_warn():
    blade = [(2.0, 3.8), (2.0, 4.2), (6.0, 4.2), (6.0, 3.8)]
    scene = shaped_scene(sdpd.Polyline(points=blade), sdpd.Box((8.0, 8.0)))
    with pytest.warns(sdpd.ResolutionWarning, match=r"`walls\[0\]` is only 0\.4\d* thick at \("):
        sdpd.Simulation(scene, seed=1)
    points, triangles = sphere(3.0, 4.0, n=4)
    ball = sdpd.Mesh(points=points, triangles=triangles, fluid="inside")
    with pytest.warns(sdpd.ResolutionWarning, match="coarse where it is curved: an edge of 1"):
        ball.warn(1.0, "walls[0]")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sdpd.Mesh(points=CORNERS, triangles=FACES).warn(1.0, "walls[0]")


def test_planes_at_other_angles_are_refused_with_a_way_out():
    walls = [
        sdpd.Plane(axis="y", at=0.0),
        sdpd.Plane(point=(8.0, 8.0), normal=(-0.1, -1.0)),
        sdpd.Plane(axis="x", at=0.0),
        sdpd.Plane(axis="x", at=16.0),
    ]
    with pytest.raises(ValueError, match="describe both by one Polyline, LevelSet or Mesh"):
        reduced_scene(dimension=2, box=sdpd.Box((16.0, 9.0), periodic=""), walls=walls)


def test_a_shaped_wall_too_near_to_a_plane_is_refused_and_a_lid_is_not():
    box = sdpd.Box((8.0, 3.0), periodic="x")
    lids = sdpd.walls.slab(box, "y")
    options = {"resolution": sdpd.Resolution(spacing=0.5, support=2.0, kernel="lucy")}

    def scene(function):
        walls = [sdpd.LevelSet(function=function), *lids]
        return reduced_scene(dimension=2, box=box, walls=walls, **options)

    block = scene(lambda r: np.abs(r[:, 0] - 4.0) - 1.05)
    sim = sdpd.Simulation(block, seed=1)
    labels = sim._core.wall_link_order()[:, 2]
    assert labels.max() == 5  # three walls, and the block with each of the lids
    circle = scene(lambda r: np.linalg.norm(r - [4.0, 1.5], axis=1) - 1.2)
    with pytest.raises(ValueError, match="must be at least one support apart or meet at right"):
        sdpd.Simulation(circle, seed=1)


# --- distances -------------------------------------------------------------------------------


def test_distance_to_a_polygon_and_to_a_line_through_periodic_faces():
    """Against the least distance to the lines and the crossing number, written out here."""
    points = np.random.default_rng(3).uniform(0.0, 8.0, (500, 2))
    outline = star()
    wall = sdpd.Polyline(points=outline)
    ends = np.roll(outline, -1, axis=0)
    t = np.einsum("nkd,kd->nk", points[:, None] - outline, ends - outline)
    t = np.clip(t / np.sum((ends - outline) ** 2, axis=1), 0.0, 1.0)
    foot = outline + t[..., None] * (ends - outline)
    least = np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)
    crosses = (outline[:, 1] > points[:, None, 1]) != (ends[:, 1] > points[:, None, 1])
    at = (
        outline[:, 0]
        + (points[:, None, 1] - outline[:, 1]) * (ends - outline)[:, 0] / ((ends - outline)[:, 1])
    )
    inside = (crosses & (points[:, None, 0] < at)).sum(axis=1) % 2 == 1
    exact = np.where(inside, least, -least)
    assert np.abs(wall.distance(points, OPEN) - exact).max() < 1e-12
    reverse = sdpd.Polyline(points=outline[::-1])
    assert np.abs(reverse.distance(points, OPEN) + exact).max() < 1e-12
    ramp = sdpd.Polyline(points=[(0, 1), (4, 2), (8, 1)], closed=False)
    box = sdpd.Box((8.0, 8.0), periodic="x")
    shifted = ramp.distance(points + [16.0, 0.0], box)
    assert np.abs(ramp.distance(points, box) - shifted).max() < 1e-12
    assert ramp.distance(np.array([[8.0, 2.0], [0.0, 2.0], [0.0, 0.0]]), box) == pytest.approx(
        [4.0 / math.sqrt(17.0), 4.0 / math.sqrt(17.0), -1.0], abs=1e-12
    )


def test_distance_to_a_mesh_is_exact_and_periodic():
    points = np.random.default_rng(4).uniform(0.0, 8.0, (400, 3))
    block = sdpd.Mesh(points=CORNERS, triangles=FACES)
    q = np.abs(points - 4.0) - 2.0
    exact = np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)
    assert np.abs(block.distance(points, OPEN3) - exact).max() < 1e-12
    inside = sdpd.Mesh(points=CORNERS, triangles=FACES, fluid="inside")
    assert np.abs(inside.distance(points, OPEN3) + exact).max() < 1e-12
    # a block that reaches through a face of the box
    moved = sdpd.Mesh(points=CORNERS, triangles=FACES, offset=(3.0, 0.0, 0.0))
    shifted = block.distance(np.mod(points - [3.0, 0, 0], 8.0), sdpd.Box((8.0,) * 3))
    assert np.abs(moved.distance(points, sdpd.Box((8.0,) * 3)) - shifted).max() < 1e-12


def test_a_mesh_through_periodic_faces_is_a_wall_without_ends():
    """A wavy floor of triangles whose rims match."""
    x = np.linspace(0.0, 8.0, 17)
    height = np.where(np.arange(17) % 2 == 0, 1.0, 1.5)
    points = [(a, b, z) for a, z in zip(x, height, strict=True) for b in (0.0, 8.0)]
    triangles = []
    for k in range(16):
        a, b, c, d = 2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3
        triangles += [(a, c, b), (b, c, d)]
    floor = sdpd.Mesh(points=points, triangles=triangles)
    box = sdpd.Box((8.0, 8.0, 6.0), periodic="xy")
    floor.check(box, "walls[0]")
    line = sdpd.Polyline(points=np.column_stack([x, height]), closed=False)
    at = np.random.default_rng(5).uniform(0.0, 8.0, (300, 3))
    flat = line.distance(at[:, [0, 2]], sdpd.Box((8.0, 6.0), periodic="x"))
    assert np.abs(floor.distance(at, box) - flat).max() < 1e-12
    with pytest.raises(ValueError, match="match itself on periodic faces"):
        floor.check(sdpd.Box((8.0, 8.0, 6.0), periodic="x"), "walls[0]")


def test_distance_to_a_level_set_is_that_to_the_surface():
    """A function that is no distance: the ellipse, against dense points of it."""
    ellipse = sdpd.LevelSet(
        function=lambda r: 1.0 - ((r[:, 0] - 4.0) / 3.0) ** 2 - ((r[:, 1] - 4.0) / 2.0) ** 2
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 400_001)
    curve = np.column_stack([4.0 + 3.0 * np.cos(angle), 4.0 + 2.0 * np.sin(angle)])
    at = np.random.default_rng(6).uniform(0.5, 7.5, (2000, 2))
    least, _ = cKDTree(curve).query(at)
    got = ellipse.distance(at, OPEN)
    assert np.abs(np.abs(got) - least).max() < 1e-6
    inside = ((at - 4.0) / [3.0, 2.0]) ** 2 @ [1.0, 1.0] < 1.0
    assert ((got > 0.0) == inside).all()


# --- weights ---------------------------------------------------------------------------------


def test_weights_of_a_plane_and_a_circle_are_those_of_the_analytic_walls():
    """psi = 1, and 1 + K h p(phi/h) to second order in K h; weighted by what images add."""
    rng = np.random.default_rng(7)
    for kernel in ("lucy", "wendland_c2"):
        for side in (1.0, -1.0):
            wall = sdpd.LevelSet(
                function=lambda r, side=side: side * (np.linalg.norm(r - 6.0, axis=1) - 5.0)
            )
            field = wall.field(sdpd.Box((12.0, 12.0), periodic=""), 1.0, kernel)
            s, angle = rng.uniform(0.0, 0.6, 2000), rng.uniform(0.0, 2.0 * np.pi, 2000)
            at = 6.0 + (5.0 + side * s)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            phi, gradient, psi, _ = field.evaluate(at)
            assert np.abs(phi - s).max() < 2e-6
            assert np.abs(np.linalg.norm(gradient, axis=1) - 1.0).max() < 1e-4
            p, _ = _core.curvature_weight(kernel, 2, s)
            difference = psi - (1.0 - 0.2 * side * p)
            assert np.abs(difference).max() < 1e-2
            assert np.abs(difference[s < 0.1].mean()) < 1.5e-3
        field = sdpd.LevelSet(function=lambda r: (r - 6.02) @ [0.6, 0.8]).field(
            sdpd.Box((12.0, 12.0), periodic=""), 1.0, kernel
        )
        along, s = rng.uniform(-3.0, 3.0, 2000), rng.uniform(0.0, 0.6, 2000)
        at = 6.02 + s[:, None] * [0.6, 0.8] + along[:, None] * [0.8, -0.6]
        assert np.abs(field.evaluate(at)[2] - 1.0).max() < 2e-3


def completed(field, box, kernel, targets, step):
    """Density of a uniform fluid of density 1 with images, by cells of `step`; h = 1."""
    dimension = box.dimension
    low, high = targets.min(axis=0) - 1.0, targets.max(axis=0) + 1.0
    axes = [np.arange(a, b, step) + 0.5 * step for a, b in zip(low, high, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    phi, _, psi, _ = field.evaluate(cells)
    share = np.clip(phi / step + 0.5, 0.0, 1.0)
    cells, phi, psi, share = (x[share > 0.0] for x in (cells, phi, psi, share))
    phi = np.maximum(phi, 0.0)
    here, _, weight, _ = field.evaluate(targets)
    result = []
    for k, near in enumerate(cKDTree(cells).query_ball_point(targets, 1.0)):
        square = np.sum((cells[near] - targets[k]) ** 2, axis=1)
        image = np.sqrt(square + 4.0 * max(here[k], 0.0) * phi[near])
        direct, _ = _core.kernel_profile(kernel, dimension, np.sqrt(square))
        mirrored, _ = _core.kernel_profile(kernel, dimension, image)
        total = share[near] @ (direct + weight[k] * psi[near] * mirrored)
        result.append(total * step**dimension)
    return np.array(result)


TIP = 3.0 * math.sqrt(3.0)
SHAPES = {
    "re-entrant edge": ([(0.5, 0.5), (7.5, 0.5), (7.5, 4), (4, 4), (4, 7.5), (0.5, 7.5)], 3.0, 5.0),
    "square corner": (SQUARE, 0.9, 2.5),
    "60 degrees of fluid": ([(1, 1), (7, 1), (4, 1 + TIP)], 0.9, 2.5),
    "60 degrees of solid": ([(4, 4), (6.6, 5.5), (6.6, 2.5)], 3.0, 5.0),
    "gap of 0.6": ([(0.5, 2.0), (7.5, 2.0), (7.5, 2.6), (0.5, 2.6)], 1.9, 2.7),
    "star": (star(), 0.5, 7.5),
}


@pytest.mark.parametrize("kernel", ["lucy", "wendland_c2"])
@pytest.mark.parametrize("name", SHAPES)
def test_images_complete_the_density_at_any_shape(name, kernel):
    """Mean field: within 0.5 %, rms 0.2 %; within 0.15 h of a vertex 3 %."""
    outline, low, high = SHAPES[name]
    wall = sdpd.Polyline(points=outline)
    field = wall.field(OPEN, 1.0, kernel)
    rng = np.random.default_rng(8)
    at = rng.uniform(low, high, (4000, 2))
    if name.startswith("gap"):
        at[:, 0] += 1.7
    distance = wall.distance(at, OPEN)
    at = at[(distance > 0.0) & (distance < 1.0)][:400]
    error = completed(field, OPEN, kernel, at, 1.0 / 48.0) - 1.0
    vertex = np.min([np.linalg.norm(at - corner, axis=1) for corner in np.asarray(outline)], axis=0)
    assert len(at) > 150
    assert np.sqrt(np.mean(error**2)) < 2e-3
    assert np.abs(error[vertex > 0.15]).max() < 5e-3
    assert np.abs(error).max() < 3e-2


def test_images_complete_the_density_in_a_triangulated_sphere_and_outside_of_it():
    points, triangles = sphere(2.0, 4.0, n=16)
    rng = np.random.default_rng(9)
    for fluid, sign in (("inside", -1.0), ("outside", 1.0)):
        wall = sdpd.Mesh(points=points, triangles=triangles, fluid=fluid)
        field = wall.field(OPEN3, 1.0, "wendland_c2")
        direction = rng.standard_normal((40, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        at = 4.0 + direction * (2.0 + sign * rng.uniform(0.02, 0.9, 40))[:, None]
        error = completed(field, OPEN3, "wendland_c2", at, 1.0 / 18.0) - 1.0
        assert np.abs(error).max() < 5e-3
        report = field.report()
        assert report["residual"] < 1e-4 and report["iterations"] < 40


# --- scenes ----------------------------------------------------------------------------------


def test_volumes_and_starts():
    outline = star()
    ends = np.roll(outline, -1, axis=0)
    area = 0.5 * float(np.sum(outline[:, 0] * ends[:, 1] - outline[:, 1] * ends[:, 0]))
    wall = sdpd.Polyline(points=outline)
    for start in (sdpd.RandomStart(relax_steps=40), sdpd.LatticeStart()):
        scene = shaped_scene(wall, start=start)
        assert scene.fluid_volume == pytest.approx(area, rel=1e-4)
        sim = sdpd.Simulation(scene, seed=2, threads=1)
        assert wall.distance(np.array(sim.positions), OPEN).min() > -0.02 * scene.support_radius
        assert scene.particle_mass * sim.n_particles == pytest.approx(
            area / scene.factors.density, rel=1e-4
        )
    points, triangles = sphere(3.0, 4.0)
    ball = sdpd.Mesh(points=points, triangles=triangles)
    box = sdpd.Box((8.0,) * 3)
    scene = shaped_scene(ball, box, resolution=sdpd.Resolution(spacing=0.7, support=2.5))
    exact = 512.0 - 4.0 / 3.0 * np.pi * 27.0 * (1.0 - 1.6e-3)  # the facets cut off a little
    assert scene.fluid_volume == pytest.approx(exact, rel=1e-3)


def test_same_bits_on_any_number_of_threads_and_across_save_and_load(tmp_path):
    scene = shaped_scene(sdpd.Polyline(points=star()))
    sims = [sdpd.Simulation(scene, seed=3, threads=threads) for threads in (1, 2)]
    for sim in sims:
        sim.run(steps=40)
    assert np.array_equal(sims[0].positions, sims[1].positions)
    sims[0].save(tmp_path / "star.sdpd")
    again = sdpd.load(tmp_path / "star.sdpd")
    for sim in (sims[0], again):
        sim.run(steps=20)
    assert np.array_equal(sims[0].positions, again.positions)
    assert np.array_equal(sims[0].velocities, again.velocities)
    sims[1].restore(tmp_path / "star.sdpd")
    assert again.scene == scene


def test_a_field_has_the_same_bits_on_any_number_of_threads():
    points, triangles = sphere(1.5, 4.0, n=8)
    wall = sdpd.Mesh(points=points, triangles=triangles)
    at = np.random.default_rng(10).uniform(2.0, 6.0, (500, 3))
    one, two = (wall.field(OPEN3, 1.0, "lucy", threads=n).evaluate(at) for n in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


def test_scene_files_hold_the_content_of_a_mesh(tmp_path):
    import meshio

    points, triangles = sphere(3.0, 4.0, n=6)
    meshio.write(tmp_path / "ball.stl", meshio.Mesh(points, [("triangle", triangles)]))
    body = sdpd.Mesh(file=tmp_path / "ball.stl", fluid="inside")
    assert len(body.points) == 4 * 6**2 + 2 and len(body.triangles) == 8 * 6**2
    scene = shaped_scene(body, OPEN3, resolution=sdpd.Resolution(spacing=0.8, support=2.0))
    text = scene.to_toml()
    assert sdpd.Scene.from_toml(text) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert "Mesh(146 points, 288 triangles, fluid='inside')" in str(scene)
    start = text.index("[[walls]]")
    end = text.index("[body_force]") if "[body_force]" in text else len(text)
    named = text[:start] + '[[walls]]\nkind = "mesh"\nfile = "ball.stl"\nfluid = "inside"\n'
    (tmp_path / "scene.toml").write_text(named + text[end:])
    assert sdpd.Scene.from_toml(tmp_path / "scene.toml") == scene
    with pytest.raises(FileNotFoundError, match="there is no file"):
        sdpd.Mesh(file=tmp_path / "none.stl")
    (tmp_path / "broken.stl").write_text("solid nothing")
    with pytest.raises(ValueError, match="`file` must"):
        sdpd.Mesh(file=tmp_path / "broken.stl")


def test_polylines_in_scene_files_and_functions_refused(tmp_path):
    line = sdpd.Polyline(points=[(0, 0), (4, 1), (8, 0)], closed=False, slip=True)
    box = sdpd.Box((8.0, 8.0), periodic="x")
    lid = sdpd.Plane(axis="y", at=8.0)
    scene = reduced_scene(
        dimension=2, box=box, walls=(line, lid), resolution=sdpd.Resolution(spacing=0.5)
    )
    assert sdpd.Scene.from_toml(scene.to_toml()) == scene
    circle = sdpd.LevelSet(function=lambda r: 3.5 - np.linalg.norm(r - 4.0, axis=1))
    scene = shaped_scene(circle)
    text = "`walls[0]` is a LevelSet, a function, which no file can hold"
    with pytest.raises(TypeError) as caught:
        scene.to_toml()
    assert str(caught.value).startswith(text)
    sim = sdpd.Simulation(scene, seed=1, threads=1)
    with pytest.raises(TypeError) as caught:
        sim.save(tmp_path / "circle.sdpd")
    assert str(caught.value).startswith(text)


def test_boundary_particles_lie_on_the_wall_and_know_the_normal_and_the_velocity():
    points, triangles = sphere(3.0, 4.0, n=12)
    box = sdpd.Box((8.0,) * 3)
    walls = [
        sdpd.Sphere(radius=3.0, centre=(4.0,) * 3, angular_velocity=(0.0, 0.0, 0.5)),
        sdpd.Mesh(points=points, triangles=triangles, angular_velocity=(0.0, 0.0, 0.5)),
        sdpd.Cylinder(radius=3.0, centre=(4.0,) * 3, angular_velocity=0.5),
        sdpd.LevelSet(
            function=lambda r: np.linalg.norm(r - 4.0, axis=1) - 3.0,
            angular_velocity=(0.0, 0.0, 0.5),
            centre=(4.0,) * 3,
        ),
    ]
    for wall in walls:
        scene = reduced_scene(
            box=box, walls=[wall], resolution=sdpd.Resolution(spacing=0.28, support=2.1)
        )
        found = wall.boundary_particles(scene, spacing=0.5)
        area = 2.0 * np.pi * 3.0 * 8.0 if isinstance(wall, sdpd.Cylinder) else 36.0 * np.pi
        assert len(found) == pytest.approx(area / 0.25, rel=0.05)
        assert np.abs(wall.distance(found.positions, box)).max() < 1e-6
        arm = found.positions - 4.0
        if isinstance(wall, sdpd.Cylinder):
            arm[:, 2] = 0.0
        outward = arm / np.linalg.norm(arm, axis=1)[:, None]
        assert np.sum(found.normals * outward, axis=1).min() > 0.99
        assert np.abs(found.velocities - np.cross([0.0, 0.0, 0.5], arm)).max() < 1e-6
        assert (found.temperatures == 1.0).all()
    flat = sdpd.Box((8.0, 6.0), periodic="x")
    scene = reduced_scene(
        dimension=2,
        box=flat,
        walls=sdpd.walls.slab(flat, "y", upper_velocity=(2.0, 0.0)),
        resolution=sdpd.Resolution(spacing=0.5),
    )
    top = scene.walls[1].boundary_particles(scene)
    assert len(top) == 16 and (top.positions[:, 1] == 6.0).all()
    assert top.velocities.tolist() == [[2.0, 0.0]] * 16 and top.normals[0].tolist() == [0.0, -1.0]


@pytest.mark.parametrize("kind", ["mesh", "level set"])
def test_trajectories_hold_scenes_with_large_meshes_and_functions(kind, tmp_path):
    pytest.importorskip("h5py")
    if kind == "mesh":
        points, triangles = sphere(3.0, 4.0, n=16)
        body, box = sdpd.Mesh(points=points, triangles=triangles, fluid="inside"), OPEN3
    else:
        body, box = (
            sdpd.LevelSet(function=lambda r: 3.5 - np.linalg.norm(r - 4.0, axis=1)),
            OPEN,
        )
    scene = shaped_scene(body, box, resolution=sdpd.Resolution(spacing=0.8, support=2.0))
    sim = sdpd.Simulation(scene, seed=1, threads=1)
    sim.run(steps=4, observe=sdpd.Trajectory(tmp_path / "run.h5md", every=2))
    text = sdpd.h5md.read(tmp_path / "run.h5md").scene
    assert sdpd.Scene.from_toml(text) == scene if kind == "mesh" else "LevelSet" in text


# --- flow ------------------------------------------------------------------------------------


def still_fluid(box, walls, **changes):
    arguments = {
        "fluid": FLUID,
        "resolution": sdpd.Resolution(spacing=1.0, support=2.1, kernel="lucy"),
        "effects": sdpd.Effects(fluctuations=False),
        "sound_speed": 10.0,
        **changes,
    }
    return reduced_scene(dimension=2, box=box, walls=walls, **arguments)


def test_a_flat_polyline_drags_like_a_plane():
    box = sdpd.Box((12.0, 13.0), periodic="x")
    lid = sdpd.Plane(axis="y", at=13.0, velocity=(1.0, 0.0))
    found = []
    for floor in (
        sdpd.Polyline(points=[(0, 1), (12, 1)], closed=False),
        sdpd.Plane(axis="y", at=1.0, fluid="above"),
    ):
        scene = still_fluid(box, [floor, lid], start=sdpd.LatticeStart())
        sim = sdpd.Simulation(scene, seed=1, threads=1)
        sim.run(time=8.0)
        forces = sdpd.WallForces(every=20)
        sim.run(steps=20, observe=forces)
        found.append((np.array(sim.velocities), np.array(sim.densities), forces.force[0, 0]))
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() < 1e-3 * np.abs(other).max()


def test_a_circle_by_a_function_turns_the_fluid_like_a_cylinder():
    box, centre = sdpd.Box((34.0, 34.0)), (17.0, 17.0)
    walls = (
        sdpd.Cylinder(radius=10.5, centre=centre, angular_velocity=0.1),
        sdpd.LevelSet(
            function=lambda r: np.linalg.norm(r - 17.0, axis=1) - 10.5, angular_velocity=0.1
        ),
    )
    first = sdpd.Simulation(
        still_fluid(box, walls[:1], start=sdpd.RandomStart()), seed=1, threads=1
    )
    torques = []
    for wall in walls:
        scene = still_fluid(
            box,
            [wall],
            start=sdpd.RandomStart(),
            resolution=sdpd.Resolution(particles=first.n_particles, support=2.1, kernel="lucy"),
        )
        assert scene.flow_speed == pytest.approx(1.05, rel=0.05)
        sim = sdpd.Simulation(
            scene, positions=np.array(first.positions), seed=1, threads=1, dt=0.5 * first.dt
        )
        forces = sdpd.WallForces(every=100)
        sim.run(steps=200, observe=forces)
        torques.append(forces.torque[:, 0, 2])
    assert (torques[0] < 0.0).all()
    assert np.abs(torques[1] / torques[0] - 1.0).max() < 5e-3


# --- energy ----------------------------------------------------------------------------------


def frictionless(wall, box, **changes):
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=0.0,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=sdpd.eos.Linear(background_pressure=100.0),
    )
    return reduced_scene(
        dimension=box.dimension,
        fluid=fluid,
        box=box,
        walls=[wall],
        resolution=sdpd.Resolution(spacing=1.0, support=2.2, kernel="wendland_c4"),
        start=sdpd.RandomStart(relax_steps=100),
        sound_speed=10.0,
        **changes,
    )


def energy_error(scene, dt, steps):
    sim = sdpd.Simulation(scene, seed=3, dt=dt, threads=1)
    energies = []
    for _ in range(40):
        sim.run(steps=steps // 40)
        energies.append(sim.kinetic_energy + sim.potential_energy)
    return float(np.std(energies)), abs(energies[-1] - energies[0]), sim.kinetic_energy


def test_energy_in_an_ellipse_is_conserved_to_second_order():
    ellipse = sdpd.LevelSet(
        function=lambda r: 1.0 - ((r[:, 0] - 12.0) / 11.0) ** 2 - ((r[:, 1] - 9.0) / 8.0) ** 2
    )
    scene = frictionless(ellipse, sdpd.Box((24.0, 18.0), periodic=""))
    coarse, _, _ = energy_error(scene, 0.01, 400)
    fine, _, kinetic = energy_error(scene, 0.005, 800)
    assert fine < 5e-4 * kinetic
    assert 2.5 < coarse / fine < 6.0


def test_energy_at_edges_does_not_drift():
    """A star of five tips, re-entrant edges between them."""
    wall = sdpd.Polyline(points=2.5 * star())
    scene = frictionless(wall, sdpd.Box((20.0, 20.0), periodic=""))
    rms, drift, kinetic = energy_error(scene, 0.005, 2000)
    assert rms < 2e-3 * kinetic and drift < 5e-3 * kinetic


def test_walls_receive_what_the_fluid_loses():
    scene = shaped_scene(sdpd.Polyline(points=star()))
    for integrator in ("pair_splitting", "velocity_verlet"):
        sim = sdpd.Simulation(scene, integrator=integrator, seed=5, threads=1)
        before = sim.momentum
        forces = sdpd.WallForces(every=5)
        sim.run(steps=40, observe=forces)
        interval = np.diff(forces.time, prepend=0.0)
        received = (forces.force[:, 0] * interval[:, None]).sum(axis=0)
        scale = np.abs(forces.force).sum() * interval[0]
        assert np.abs(sim.momentum - before + received).max() < 1e-12 * scale


@pytest.mark.parametrize("support", [2.0, 2.4, 3.0])
def test_a_surface_on_faces_of_the_grid_is_seen(support):
    """It cuts no cell of the grid, and must not leave its place all the same."""
    box = sdpd.Box((12.0, 12.0), periodic="x")

    def scene(velocity):
        lid = sdpd.LevelSet(function=lambda p: 12.0 - p[:, 1], velocity=velocity)
        return reduced_scene(
            dimension=2,
            box=box,
            walls=(sdpd.Plane(axis="y", at=0.0), lid),
            resolution=sdpd.Resolution(spacing=1.0, support=support, kernel="lucy"),
            start=sdpd.RandomStart(relax_steps=2),
            sound_speed=10.0,
        )

    sdpd.Simulation(scene((1.0, 0.0)), seed=1, dt=1e-3, threads=1)
    with pytest.raises(ValueError, match="stay in its place"):
        sdpd.Simulation(scene((0.0, 1.0)), seed=1, dt=1e-3, threads=1)


TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def tetrahedron(at, edge):
    return np.asarray(at) + edge * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])


def two_parts(second, *, turned):
    """A tetrahedron of edge 4 and another, the second the other way round if `turned`."""
    first = np.array(TETRAHEDRON)
    other = first[:, ::-1] if turned else first
    points = np.concatenate([tetrahedron((2.0, 2.0, 2.0), 4.0), second])
    return {"points": points, "triangles": np.concatenate([first, other + 4])}


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: sdpd.Polyline(points=[(3, 6), (6, 6), (9, 6)]), "lead back"),
        (lambda: sdpd.Polyline(points=[(3, 6), (9, 6), (6, 6), (6, 9)]), "lead back"),
        (
            lambda: sdpd.Mesh(points=np.eye(3), triangles=[(0, 1, 2), (0, 2, 1)]),
            "enclose a volume",
        ),
        (
            lambda: sdpd.Mesh(**two_parts(tetrahedron((7.0, 7.0, 7.0), 2.0), turned=True)),
            r"counter-clockwise seen from outside.*\(9",
        ),
        (
            lambda: sdpd.Mesh(**two_parts(tetrahedron((2.5, 2.5, 2.5), 0.5), turned=False)),
            r"clockwise within another part.*\(2\.5",
        ),
    ],
)
def test_bodies_that_are_none_are_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_parts_and_hollows_that_go_round_their_way_are_taken():
    apart = sdpd.Mesh(**two_parts(tetrahedron((7.0, 7.0, 7.0), 2.0), turned=False))
    hollow = sdpd.Mesh(**two_parts(tetrahedron((2.5, 2.5, 2.5), 0.5), turned=True))
    box = sdpd.Box((12.0, 12.0, 12.0))
    assert apart.distance(np.array([[7.2, 7.2, 7.2]]), box)[0] == pytest.approx(-0.2)
    assert hollow.distance(np.array([[2.55, 2.55, 2.55]]), box)[0] == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("wall", "box"),
    [
        (sdpd.Polyline(points=[(0.1, 0.2), (1.5, 0.2), (1.5, 0.8)]), sdpd.Box((1.0, 1.0))),
        (
            sdpd.Polyline(
                points=[
                    (0, 0.2),
                    (0.9, 0.2),
                    (0.9, 0.5),
                    (1.3, 0.5),
                    (1.3, 0.1),
                    (1.0, 0.1),
                    (1, 0.2),
                ],
                closed=False,
            ),
            sdpd.Box((1.0, 1.0), periodic="x"),
        ),
        (
            sdpd.Mesh(points=tetrahedron((0.1, 0.1, 0.1), 1.4), triangles=TETRAHEDRON),
            sdpd.Box((1.0, 1.0, 1.0)),
        ),
    ],
    ids=["closed line", "open line", "mesh"],
)
def test_surfaces_that_cross_their_own_image_are_refused(wall, box):
    with pytest.raises(ValueError, match=r"`walls\[0\]` must not cross its own periodic image"):
        wall.check(box, "walls[0]")


def test_lines_that_cross_an_image_are_named():
    """They cross indeed once one of them is moved into a neighbouring box."""
    body = [(0.1, 0.5), (0.1, 0.2), (0.3, 0.2), (0.3, 0.3)]
    points = [*body, (1.2, 0.33), (1.2, 0.37), (0.3, 0.4), (0.3, 0.5)]
    wall = sdpd.Polyline(points=points)
    with pytest.raises(ValueError, match="own periodic image") as caught:
        wall.check(sdpd.Box((1.0, 1.0)), "walls[0]")
    named = [place for place in points if str(place) in str(caught.value)]
    lines = [(np.array(p), np.array(points[(points.index(p) + 1) % len(points)])) for p in named]
    assert len(lines) == 2
    (a, b), (c, d) = lines
    shifts = [np.array((x, y)) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0) if x or y]

    def side(p, q, r):
        return float((q - p)[0] * (r - p)[1] - (q - p)[1] * (r - p)[0])

    def cross(p, q, r, s):
        return side(p, q, r) * side(p, q, s) <= 0.0 and side(r, s, p) * side(r, s, q) <= 0.0

    assert any(cross(a, b, c + shift, d + shift) for shift in shifts)


def test_functions_that_do_not_go_on_through_periodic_faces_are_refused():
    slope = sdpd.LevelSet(function=lambda r: np.minimum(r[:, 1] - 1 - 0.25 * r[:, 0], 11 - r[:, 1]))
    with pytest.raises(ValueError, match=r"`walls\[0\]\.function` must be periodic along x"):
        slope.check(sdpd.Box((12.0, 12.0), periodic="x"), "walls[0]")
    slope.check(sdpd.Box((12.0, 12.0), periodic=""), "walls[0]")


def test_level_set_off_the_middle_of_a_small_box_is_near_through_its_faces():
    box = sdpd.Box((6.0, 6.0))
    shift = np.array([2.4, 3.0])

    def circle(r):
        apart = r - shift
        return np.linalg.norm(apart - 6.0 * np.rint(apart / 6.0), axis=1) - 0.9

    wall = sdpd.LevelSet(function=circle)
    points = np.array([[5.6, 3.0], [5.9, 3.0], [0.1, 2.0], [5.5, 5.9]])
    np.testing.assert_allclose(wall.distance(points, box), circle(points), atol=1e-6)


def test_speed_of_a_turning_line_is_about_its_own_middle():
    angle = 2.0 * np.pi * np.concatenate([np.linspace(0, 0.5, 200), np.linspace(0.5, 1, 60)[1:-1]])
    points = 10.0 + 6.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    wall = sdpd.Polyline(points=points, angular_velocity=1.0)
    assert wall.speed == pytest.approx(6.0, rel=1e-3)


def test_fields_say_which_wall_and_which_argument():
    box = sdpd.Box((12.0, 12.0))
    far = sdpd.Polyline(points=[(3, 30), (4, 31), (5, 30)])
    wall = sdpd.Polyline(points=[(3, 3), (6, 9), (9, 3)])
    walled = sdpd.Box((12.0, 12.0), periodic="")
    with pytest.raises(ValueError, match=r"`walls\[1\]`: the surface must pass through the box"):
        far.field(walled, 2.4, "lucy", name="walls[1]")
    for name, bad in (("support", -1.0), ("spacing", np.nan), ("threads", 0)):
        options = {"support": 2.4, "kernel": "lucy", name: bad}
        with pytest.raises(ValueError, match=f"`{name}`"):
            wall.field(box, **options)


def test_vertices_of_a_vessel_are_places_to_start_from():
    """The grid rounds off vertices; particles there come back in the first step."""
    corners = np.array([(x, y, z) for x in (0.13, 7.9) for y in (0.17, 7.8) for z in (0.2, 7.7)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    mesh = sdpd.Mesh(points=corners, triangles=triangles, fluid="inside")
    inner = np.stack(np.meshgrid(*[np.arange(1.0, 7.5, 1.0)] * 3, indexing="ij"), axis=-1)
    positions = np.concatenate([corners, inner.reshape(-1, 3)])
    scene = reduced_scene(
        box=sdpd.Box((8.0, 8.0, 8.0), periodic=""),
        walls=(mesh,),
        resolution=sdpd.Resolution(particles=len(positions), support=2.4, kernel="lucy"),
        start=sdpd.RandomStart(),
        sound_speed=10.0,
    )
    sim = sdpd.Simulation(scene, positions=positions, seed=1, dt=1e-3, threads=1)
    sim.run(steps=3, progress=False)
    assert mesh.distance(np.array(sim.positions), scene.box).min() > -0.09 * scene.support_radius
