"""Kernel sums against plain NumPy, averages and their errors, targets, and what leaves as files."""

import pickle

import numpy as np
import pytest

import sdpd
from sdpd import fields

BOX2, BOX3 = np.array([6.0, 8.0]), np.array([6.0, 4.0, 8.0])


def scattered(count, box, seed):
    return np.random.default_rng(seed).uniform(0.0, 1.0, size=(count, len(box))) * box


def reference(points, positions, values, box, periodic, kernel, length):
    """Eq. 2.80 before the division, written as it stands, over all images."""
    turns = [(-1, 0, 1) if p else (0,) for p in periodic]
    shifts = np.stack(np.meshgrid(*turns, indexing="ij"), axis=-1).reshape(-1, len(box)) * box
    between = points[:, None, None] - positions[None, :, None] + shifts
    w, _ = sdpd.kernels.evaluate(kernel, len(box), np.linalg.norm(between, axis=-1), length)
    return np.column_stack([w.sum(axis=(1, 2)), (w**2).sum(axis=(1, 2)), w.sum(axis=2) @ values])


def gas(frames, count, box, seed, *, drift=0.0, **options):
    """Independent particles of unit mass and temperature in each frame."""
    generator = np.random.default_rng(seed)
    for index in range(frames):
        positions = generator.uniform(0.0, 1.0, size=(count, len(box))) * box
        velocities = generator.normal(size=(count, len(box)))
        velocities[:, 0] += drift
        yield fields.State(
            positions=positions,
            box=box,
            velocities=velocities,
            densities=np.ones(count),
            time=float(index),
            **options,
        )


@pytest.mark.parametrize("kernel", sdpd.kernels.names())
@pytest.mark.parametrize(
    ("box", "periodic", "length"),
    [
        (BOX3, (True, True, True), 1.3),
        (BOX3, (True, False, False), 0.7),
        (BOX3, (True, True, True), 4.0),
        (BOX2, (False, True), 2.2),
        (BOX2, (False, False), 30.0),
    ],
)
def test_sums_equal_the_reference(kernel, box, periodic, length):
    positions = scattered(150, box, 1)
    points = scattered(40, box, 2) * 1.2 - 0.1 * box  # some outside: another image, or beyond
    points[:, [not p for p in periodic]] *= 1.5
    points[0] = positions[0]
    values = np.random.default_rng(3).normal(size=(150, 2))
    moved = positions + np.where(periodic, 3.0 * box, 0.0)
    folded = points - np.where(periodic, box * np.floor(points / box), 0.0)
    ours = fields.kernel_sums(
        points, moved, values, box=box, length=length, kernel=kernel, periodic=periodic
    )
    theirs = reference(folded, positions, values, box, periodic, kernel, length)
    assert ours == pytest.approx(theirs, rel=1e-11, abs=1e-11 * np.abs(theirs).max())
    assert theirs[0, 0] > 0.0


def test_threads_change_no_bit():
    positions, points = scattered(400, BOX3, 4), scattered(500, BOX3, 5)
    one, *others = (
        fields.kernel_sums(points, positions, positions, box=BOX3, length=1.5, threads=threads)
        for threads in (1, 2, 5)
    )
    for other in others:
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize(("box", "fine"), [(BOX2, (60, 80)), (BOX3, (30, 20, 40))])
def test_plain_sums_conserve_and_means_keep_constants(box, fine):
    state = fields.State(
        positions=scattered(200, box, 6),
        box=box,
        velocities=np.tile(np.arange(1.0, 1.0 + len(box)), (200, 1)),
        mass=0.5,
        pressures=np.full(200, 7.0),
    )
    grid = fields.Grid.over(box, fine)
    found = fields.snapshot(
        state, grid, length=1.6, quantities=("number_density", "density", "velocity", "pressure")
    )
    # the midpoint rule over cells an eighth of the support
    assert found["number_density"].mean.mean() * np.prod(box) == pytest.approx(200, rel=2e-3)
    assert found["density"].mean == pytest.approx(0.5 * found["number_density"].mean)
    there = found["number_density"].mean > 0.0
    assert found["velocity"].mean[there, 1] == pytest.approx(np.full(there.sum(), 2.0))
    assert found["pressure"].mean[there] == pytest.approx(np.full(there.sum(), 7.0))
    assert np.isnan(found["pressure"].mean[~there]).all()
    assert np.isnan(found["velocity"].stderr).all()  # one frame has no error


def test_a_snapshot_is_what_its_equations_say():
    (state,) = gas(1, 80, BOX2, 7, mass=2.0, boltzmann_constant=0.5)
    points = scattered(10, BOX2, 8)
    custom = fields.Quantity(name="height", values=lambda s: s.positions[:, 1], kind="sum")
    found = fields.snapshot(
        state,
        fields.Points(points),
        length=2.5,
        kernel="lucy",
        quantities=(*fields.BUILT_IN[:5], "particle_density", custom),
    )
    v = state.velocities
    carried = np.column_stack([v, np.square(v).sum(axis=1), state.positions[:, 1]])
    sums = reference(points, state.positions, carried, BOX2, (True, True), "lucy", 2.5)
    w, w2, vx, vy, vv, height = sums.T
    assert found["number_density"].mean == pytest.approx(w)
    assert found["momentum_density_x"].mean == pytest.approx(2.0 * vx)
    assert found["velocity"].mean == pytest.approx(np.stack([vx, vy], axis=1) / w[:, None])
    spread = vv / w - (vx**2 + vy**2) / w**2
    exact = 2.0 * spread / (2.0 * 0.5) / (1.0 - w2 / w**2)
    assert found["temperature"].mean == pytest.approx(exact)
    assert found["height"].mean == pytest.approx(height)
    assert found.particles_in_reach == pytest.approx(w**2 / w2)


@pytest.mark.parametrize("target", ["points", "bins"])
def test_temperature_of_few_particles_has_no_bias(target):
    """Frames of about four particles in reach, each by itself."""
    points = fields.Points([[3.0, 4.0]]) if target == "points" else fields.Bins.over(BOX2, "y", 12)
    frames = gas(1500, 48, BOX2, 9, drift=3.0)
    found = fields.average(frames, points, quantities="temperature", length=1.6, n_blocks=32)
    pooled = found["temperature"]
    assert np.abs(pooled.z(1.0)).max() < 4.5
    assert pooled.stderr.max() < 0.03  # the spread that is corrected is a quarter
    number = found.statistics["temperature"].count.min()
    error = pooled.frame_deviation.max() / np.sqrt(number)
    assert 2.0 < found.particles_in_reach.mean() < 6.0
    # weighted means of few particles are correlated with nothing: the mean of frames is exact too
    assert np.abs(pooled.frame_mean - 1.0).max() < 4.5 * error
    assert error < 0.03


def test_errors_tell_the_spread_of_independent_runs():
    target = fields.Grid.over(BOX2, (1, 4))
    runs = [
        fields.average(
            gas(32, 60, BOX2, 100 + seed, drift=1.0),
            target,
            quantities=("density", "velocity", "temperature"),
            length=2.5,
        )
        for seed in range(64)
    ]
    pooled = fields.ensemble(runs)
    assert (pooled.n_blocks, pooled.n_frames) == (64, 64 * 32)
    for name, exact in (("density", 60 / 48), ("velocity", [1.0, 0.0]), ("temperature", 1.0)):
        values = np.array([run[name].mean for run in runs])
        claimed = np.sqrt(np.mean([run[name].stderr ** 2 for run in runs]))
        seen = np.sqrt(values.var(axis=0, ddof=1).mean())
        # four standard deviations of a ratio from 63 x 4 degrees of freedom
        assert claimed / seen == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * 63 * 4))
        assert np.abs(pooled[name].z(exact)).max() < 4.0
        assert pooled[name].stderr.max() < 0.02
        assert (pooled[name].p(exact) > 1e-3).all()
    weights = np.array([run.sums.sum(axis=0) for run in runs])
    assert pooled.sums == pytest.approx(weights)
    joined = pooled["density"]
    assert joined.frame_mean == pytest.approx(np.mean([r["density"].frame_mean for r in runs], 0))
    assert joined.frame_mean == pytest.approx(joined.mean)  # a plain sum has one mean


@pytest.mark.parametrize(("frames", "blocks"), [(1, 1), (7, 7), (8, 8), (9, 4), (17, 4), (32, 8)])
def test_blocks_grow_and_lose_nothing(frames, blocks):
    found, other = (
        fields.average(
            gas(frames, 20, BOX2, 11),
            fields.Bins.over(BOX2, 0, 3),
            quantities="density",
            n_blocks=n,
        )
        for n in (4, 50)
    )
    assert (found.n_blocks, found.n_frames, other.n_blocks) == (blocks, frames, frames)
    assert found["density"].mean == pytest.approx(other["density"].mean)
    if frames > 1:
        deviation = found["density"].frame_deviation
        assert deviation == pytest.approx(other["density"].frame_deviation)
        exact = deviation / np.sqrt(frames)  # one frame is one block
        assert other["density"].stderr == pytest.approx(exact)


def test_growth_tells_blocks_that_are_too_short():
    def slow():
        for state in gas(256, 40, BOX2, 17):
            if int(state.time) % 16 == 0:
                held = state
            yield held

    target = fields.Bins.over(BOX2, "y", 8)
    short = fields.average(slow(), target, quantities=("density", "velocity"), n_blocks=64)
    long = fields.average(slow(), target, quantities=("density", "velocity"), n_blocks=8)
    assert (short.n_blocks, long.n_blocks) == (128, 16)  # of 2 and of 16 frames
    for name in ("density", "velocity", "velocity_x"):
        assert short.block_growth(name) > 1.3
        assert long.block_growth(name) < 1.2
        assert long[name].stderr.mean() > 1.5 * short[name].stderr.mean()
    assert "growth" in str(long)


def test_blocked_functions_agree_and_fit():
    found = fields.average(
        gas(64, 50, BOX2, 12, drift=0.5),
        fields.Bins.over(BOX2, "y", 4),
        quantities=("density", "velocity", "number_density"),
    )
    for name in ("density", "number_density", "velocity_x"):
        blocked = found.blocked(name)
        assert blocked.mean == pytest.approx(found[name].mean)
        assert blocked.stderr == pytest.approx(found[name].stderr, rel=0.1)
        assert blocked.edges.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]
    fit = found.blocked("velocity_x").derive(lambda mean: float(mean.mean()))
    assert abs(fit.z(0.5)) < 4.0
    with pytest.raises(ValueError, match="`name` must be that of a component"):
        found.blocked("velocity")


def test_bins_count_like_the_analysis():
    states = list(gas(10, 40, BOX3, 13))
    edges = np.array([0.0, 1.0, 4.0, 8.0])
    target = fields.Bins(2, edges, tuple(BOX3))
    found = fields.average(states, target, quantities=("number_density", "velocity"))
    positions = np.array([s.positions for s in states]) - 7.0 * BOX3
    velocities = np.array([s.velocities[:, 0] for s in states])
    density = sdpd.analysis.local_profile(positions, axis=2, bins=edges, box=BOX3)
    flow = sdpd.analysis.local_profile(positions, velocities, axis=2, bins=edges, box=BOX3)
    assert found["number_density"].mean == pytest.approx(density.mean)
    assert found["velocity_x"].mean == pytest.approx(flow.mean)
    wall = fields.State(
        positions=[[0.0, 0.0], [6.0, 8.0], [6.0, 8.1]], box=BOX2, periodic=(False, False)
    )
    counted = fields.snapshot(wall, fields.Bins.over(BOX2, "y", 4), quantities="number_density")
    assert counted["number_density"].mean * 12.0 == pytest.approx([1.0, 0.0, 0.0, 1.0])


def test_targets():
    grid = fields.Grid((0.0, 0.0, 1.0), (2.0, 1.0, 1.0), (3, 2, 1))
    assert grid.points[1].tolist() == [0.0, 1.0, 1.0]
    assert [(kind, cells.shape) for kind, cells in grid.cells] == [("quad", (2, 4))]
    cube = fields.Grid.over((2.0, 2.0, 2.0), (2, 2, 2))
    ((kind, cells),) = cube.cells
    corners = cube.points[cells[0]]
    # VTK's hexahedron: around the bottom, then around the top
    assert kind == "hexahedron"
    assert corners[:4, 2].tolist() == [0.5] * 4
    assert np.linalg.norm(np.diff(corners[:4], axis=0), axis=1) == pytest.approx(np.ones(3))
    line = fields.Line((0.0, 1.0), (0.0, 3.0), 3)
    assert line.axes[0][0] == "y" and line.axes[0][1].tolist() == [1.0, 2.0, 3.0]
    assert fields.Line((0.0, 0.0), (3.0, 4.0), 2).axes[0][1].tolist() == [0.0, 5.0]
    plane = fields.Plane.across(BOX3, "y", 1.0, (3, 5))
    assert [name for name, _ in plane.axes] == ["x", "z"]
    assert plane.points[1].tolist() == [0.0, 1.0, 2.0]
    oblique = fields.Plane((0, 0, 0), (1.0, 1.0, 0.0), (0.0, 0.0, 2.0), (2, 2))
    assert oblique.axes[0][0] == "u" and oblique.axes[1][1].tolist() == [0.0, 2.0]
    assert len(fields.Points(np.ones((4, 2)))) == 4


def one_state():
    return next(iter(gas(1, 10, BOX2, 14)))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fields.Grid((0.0, 0.0), (1.0, -1.0), (2, 2)), r"`high\[1\]` must be above"),
        (lambda: fields.Grid((0.0, 0.0), (1.0, 1.0), (2, 2, 2)), "`shape` must have 2 entries"),
        (lambda: fields.Line((0.0, 0.0), (0.0, 0.0), 3), "`end` must differ"),
        (lambda: fields.Plane((0,) * 3, (1, 0, 0), (2, 0, 0), (2, 2)), "must not be parallel"),
        (lambda: fields.Points(np.ones((3, 4))), "`points` must be rows"),
        (lambda: fields.Bins(0, [0.0, 0.0], (1.0, 1.0)), "increasing"),
        (lambda: fields.Bins.over(BOX2, "z", 3), "`axis` must be one of 'x', 'y'"),
        (lambda: fields.snapshot(one_state(), fields.Points([[1.0, 1.0]])), "`length` must be giv"),
        (
            lambda: fields.snapshot(one_state(), fields.Points([[1.0] * 3]), length=1.0),
            "`target` must have 2 dimensions",
        ),
        (
            lambda: fields.snapshot(one_state(), fields.Points([[1.0] * 2]), length=6.1),
            "`length` must be at most the edge",
        ),
        (
            lambda: fields.snapshot(
                one_state(), fields.Points([[1.0] * 2]), length=1.0, quantities="pressure"
            ),
            "needs `pressures`",
        ),
        (
            lambda: fields.snapshot(
                one_state(), fields.Points([[1.0] * 2]), length=1.0, quantities="densty"
            ),
            "did you mean 'density'",
        ),
        (
            lambda: fields.snapshot(
                one_state(),
                fields.Points([[1.0] * 2]),
                length=1.0,
                quantities=fields.Quantity(name="a", values=lambda s: np.ones(3)),
            ),
            r"quantity 'a' must have shape \(10,\)",
        ),
        (lambda: fields.Quantity(name="velocity", values=abs), "another than those built in"),
        (lambda: fields.average([], fields.Points([[1.0] * 2]), length=1.0), "at least one frame"),
        (lambda: fields.ensemble([]), "`members` must be at least 2"),
        (lambda: fields.State(positions=np.ones((3, 2)), box=BOX3), "`box` must be a sequence of"),
        (
            lambda: fields.State(positions=np.ones((3, 2)), box=BOX2, velocities=np.ones((2, 2))),
            "`velocities` must be an array of shape",
        ),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call()


def test_ensembles_are_of_the_same_fields():
    one, two = (
        fields.snapshot(one_state(), fields.Points([[x, 1.0]]), length=1.0, quantities="density")
        for x in (1.0, 2.0)
    )
    with pytest.raises(ValueError, match=r"`members\[1\]` must have the target"):
        fields.ensemble([one, two])
    with pytest.raises(ValueError, match="`name` must be one of 'density'"):
        one["speed"]


# --- what leaves ------------------------------------------------------------------------------


def averaged(target, box):
    states = gas(4, 300, box, 15)
    return fields.average(states, target, quantities=("density", "velocity"), length=1.9)


def test_csv(tmp_path):
    found = averaged(fields.Line((0.0, 1.0), (6.0, 1.0), 5), BOX2)
    lines = found.write(tmp_path / "line.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("x [length],y [length],density [mass/length^2],density stderr")
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert table[:, 2] == pytest.approx(found["density"].mean, rel=1e-15)
    assert table[:, 4] == pytest.approx(found["velocity_x"].mean, rel=1e-15)
    assert "velocity_y  length/time" in str(found)


def test_results_survive_pickling():
    found = averaged(fields.Grid.over(BOX2, (2, 2)), BOX2)
    again = pickle.loads(pickle.dumps(found))
    assert again["velocity"].mean.tolist() == found["velocity"].mean.tolist()
    assert again["velocity_x"].target.points.tolist() == found.target.points.tolist()


def test_xarray():
    pytest.importorskip("xarray")
    found = averaged(fields.Grid.over(BOX2, (3, 4)), BOX2)
    data = found.to_xarray()
    assert data["velocity"].dims == ("x", "y", "velocity_component")
    value = data["velocity"].sel(x=1.0, y=3.0, velocity_component="y")
    assert float(value) == found["velocity_y"].mean[0, 1]
    assert data["density_stderr"].attrs["units"] == "mass/length^2"
    assert data.attrs["averaging_length"] == 1.9


def test_meshio_round_trip(tmp_path):
    meshio = pytest.importorskip("meshio")
    found = averaged(fields.Grid.over(BOX3, (2, 3, 4)), BOX3)
    path = found.write(tmp_path / "grid.vtu")
    mesh = meshio.read(path)
    assert mesh.points == pytest.approx(found.target.points)
    assert mesh.cells_dict["hexahedron"].shape == (6, 8)
    assert mesh.point_data["velocity"] == pytest.approx(found["velocity"].mean.reshape(-1, 3))
    on_mesh = averaged(fields.Mesh(path), BOX3)
    assert on_mesh["density"].mean == pytest.approx(found["density"].mean.ravel())
    assert on_mesh.to_meshio().cells[0].type == "hexahedron"
    with pytest.raises(ValueError, match=r"must end in \.csv or what meshio writes"):
        found.write(tmp_path / "grid.docx")
    flat = meshio.Mesh(
        [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], [("triangle", [[0, 1, 2]])]
    )
    assert fields.Mesh(flat, dimension=2).points.shape == (3, 2)


@pytest.mark.parametrize(
    ("target", "box"),
    [
        (fields.Grid.over(BOX3, (2, 3, 4)), BOX3),
        (fields.Grid.over(BOX2, (5, 3)), BOX2),
        (fields.Plane.across(BOX3, "y", 1.0, (3, 4)), BOX3),
        (fields.Line((0.0, 0.0, 0.0), (3.0, 2.0, 1.0), 6), BOX3),
        (fields.Points(scattered(5, BOX2, 16)), BOX2),
    ],
    ids=["grid", "flat grid", "plane", "line", "points"],
)
def test_pyvista_has_each_value_at_its_point(target, box):
    pytest.importorskip("pyvista")
    found = averaged(target, box)
    mesh = found.to_pyvista()
    assert mesh.n_points == len(target)
    for point, value in zip(target.points, found["density"].mean.ravel(), strict=True):
        where = np.pad(point, (0, 3 - len(point)))
        index = int(np.argmin(np.linalg.norm(np.asarray(mesh.points) - where, axis=1)))
        assert np.asarray(mesh.points)[index] == pytest.approx(where, abs=1e-6)
        assert mesh.point_data["density"][index] == pytest.approx(value)
