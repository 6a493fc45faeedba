"""Fields while a simulation runs: against its frames, the analysis and known values."""

import pickle

import numpy as np
import pytest
from scipy import signal

import sdpd
from sdpd import analysis, cli, fields
from tests.unit.sims import small, small_scene

LINE = fields.Line((1.0, 0.0), (1.0, 9.0), 7)


class Keep(sdpd.Observer):
    """Copies of the frames."""

    def __init__(self, **options):
        super().__init__(**options)
        self.states, self.unwrapped = [], []

    def sample(self, sim):
        of = {
            n: getattr(sim, n).copy() for n in ("positions", "velocities", "densities", "pressures")
        }
        self.states.append(
            fields.State(box=sim.scene.box, mass=sim.scene.particle_mass, time=sim.time, **of)
        )
        self.unwrapped.append(sim.unwrapped)


def test_averages_are_those_of_the_frames():
    sim = small(seed=21, threads=1)
    kept = Keep(every=3)
    height = fields.Quantity(name="height", values=lambda s: s.positions[:, 1], unit="length")
    observers = [
        sdpd.FieldAverage(LINE, quantities=(*fields.BUILT_IN[:-1], height), every=3, n_blocks=4),
        sdpd.FieldAverage(LINE, quantities="density", every=3, length=2.0, kernel="lucy"),
        sdpd.BinAverage(axis="y", bins=5, quantities=("density", "temperature"), every=3),
    ]
    for steps in (10, 1, 19):  # several runs go on
        sim.run(steps=steps, observe=[kept, *observers], progress=False)
    scene, states = sim.scene, kept.states
    assert [len(o) for o in observers] == [10] * 3
    names = (*fields.BUILT_IN[:-1], height)
    theirs = [
        fields.average(states, LINE, quantities=names, length=scene.support_radius, n_blocks=4),
        fields.average(states, LINE, quantities="density", length=2.0, kernel="lucy"),
        fields.average(
            states, fields.Bins.over(scene.box, "y", 5), quantities=("density", "temperature")
        ),
    ]
    for observer, other in zip(observers, theirs, strict=True):
        assert observer.result.time == other.time == (states[0].time, states[-1].time)
        for name in other:
            assert observer[name].mean.tolist() == other[name].mean.tolist()
            assert observer[name].stderr.tolist() == other[name].stderr.tolist()
    assert observers[2].target.edges.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    again = pickle.loads(pickle.dumps(observers[2]))
    assert again["density"].mean.tolist() == observers[2]["density"].mean.tolist()
    assert "density, temperature: 10 frames" in repr(observers[2])


def test_observers_and_their_threads_change_no_bit():
    def after(threads, observe):
        sim = small(seed=22, threads=threads)
        sim.run(steps=12, observe=observe, progress=False)
        return sim, observe

    one, two = (
        after(threads, [sdpd.FieldAverage(LINE, every=2), sdpd.BinAverage(axis=0, every=2)])
        for threads in (1, 2)
    )
    bare, _ = after(1, [])
    assert one[0].positions.tobytes() == bare.positions.tobytes()
    for mine, its in zip(one[1], two[1], strict=True):
        assert mine["velocity"].mean.tobytes() == its["velocity"].mean.tobytes()


@pytest.mark.parametrize("lag", [1, 4])
def test_diffusivity_is_that_of_the_displacements(lag):
    sim = small(seed=23, threads=1)
    kept = Keep(every=2)
    profile = sdpd.BinAverage(axis="y", bins=4, every=2, lag=lag, components="x")
    kept.sample(sim)
    sim.run(steps=10, observe=[kept, profile], progress=False)
    sim.run(steps=16, observe=[kept, profile], progress=False)
    positions = np.array(kept.unwrapped)
    time = lag * 2 * sim.dt
    found = profile["diffusivity"]
    if lag == 1:
        exact = analysis.local_diffusivity(
            positions,
            2 * sim.dt,
            axis=1,
            bins=4,
            lag=1,
            box=(10.0, 10.0),
            components=(0,),
            n_blocks=4,
        )
        assert found.mean == pytest.approx(exact.mean)
    squares, counts = np.zeros(4), np.zeros(4)
    for start in range(0, len(positions) - lag, lag):
        index = (positions[start, :, 1] % 10.0 // 2.5).astype(int)
        moved = positions[start + lag, :, 0] - positions[start, :, 0]
        squares += np.bincount(index, moved**2, 4)
        counts += np.bincount(index, minlength=4)
    assert found.mean == pytest.approx(squares / counts / (2.0 * time))
    assert found.unit == "length^2/time"
    assert np.isfinite(found.stderr).all()


def test_a_restored_state_breaks_a_displacement(tmp_path):
    sim = small(seed=24, threads=1)
    profile = sdpd.BinAverage(axis="y", bins=1, every=1, lag=3)
    sim.save(tmp_path / "start.sdpd")
    sim.run(steps=5, observe=profile, progress=False)
    before = profile["diffusivity"].mean
    sim.restore(tmp_path / "start.sdpd")
    sim.run(steps=5, observe=profile, progress=False)  # the same steps: the same displacement
    assert profile["diffusivity"].mean == pytest.approx(before)


def test_equilibrium_is_uniform():
    """Temperature, density and flow of every bin and every point, errors included."""
    sim = small(8, seed=25, threads=1)
    sim.run(time=20.0, progress=False)
    every = round(0.25 / sim.dt)
    profile = sdpd.BinAverage(axis="y", bins=4, every=every)
    grid = sdpd.FieldAverage(fields.Grid.over(sim.scene.box, (2, 2)), every=every)
    sim.run(steps=1600 * every, observe=[profile, grid], progress=False)
    # the momentum of the box does not move, which leaves 1 - 1/N of the kinetic temperature
    exact = {"density": 1.0, "velocity": 0.0, "temperature": 1.0 - 1.0 / 64}
    p, error = [], {}
    for name, value in exact.items():
        for observer in (profile, grid):
            found = observer[name]
            p += found.p(value).ravel().tolist()
            error[name] = max(error.get(name, 0.0), float(found.stderr.max()))
        for observer in (profile, grid):
            assert observer.result.block_growth(name) < 1.2  # blocks are long enough
    assert profile.result.n_blocks == 50
    assert analysis.bonferroni(p).smallest > 1e-3
    assert error["density"] < 0.01
    assert error["velocity"] < 0.02
    assert error["temperature"] < 0.015


def test_walls_close_an_axis():
    """A point on a wall does not see what is at the other."""
    box = sdpd.Box((6.0, 8.0), periodic="x")
    scene = small_scene(box=box, walls=sdpd.walls.slab(box, "y"))
    sim = small(scene=scene, seed=28, threads=1)
    points = fields.Points([[0.0, 4.0], [0.0, 0.0], [0.0, 8.0], [0.0, 14.0]])
    average = sdpd.FieldAverage(points, quantities=("density", "velocity"), length=2.0)
    layers = sdpd.BinAverage(axis="y", bins=4, quantities="density")
    core = sdpd.Profile(axis="y", bins=4)
    sim.run(steps=50, observe=[average, layers, core], progress=False)
    middle, low, high, outside = average["density"].mean
    assert 0.2 < low < 0.7 * middle  # half of the kernel is in the wall
    assert 0.2 < high < 0.7 * middle
    assert outside == 0.0
    assert np.isnan(average["velocity"].mean[3]).all()
    mass = scene.particle_mass
    assert layers["density"].mean.mean() == pytest.approx(scene.n_particles * mass / 48.0)
    assert layers["density"].mean * 12.0 == pytest.approx(mass * core.counts)


def test_a_driven_flow_has_its_profile():
    """A weak sinusoidal force without noise: viscosity from the fitted profile."""
    scene = small_scene(
        12,
        start=sdpd.LatticeStart(),
        body_force=sdpd.SinusoidalForce(amplitude=1e-3, direction="x", along="y"),
        effects=sdpd.Effects(fluctuations=False),
    )
    sim = small(scene=scene, threads=1)
    profile = sdpd.BinAverage(axis="y", bins=12, quantities="velocity", every=10)
    nu = scene.fluid.kinematic_viscosity
    k = 2.0 * np.pi / 12.0
    sim.run(time=8.0 / (nu * k**2), progress=False)
    sim.run(steps=40, observe=profile, progress=False)
    found = profile["velocity_x"]
    shape = np.sin(k * profile.target.centers)
    amplitude = found.mean @ shape / (shape @ shape)
    assert found.mean == pytest.approx(amplitude * shape, abs=0.01 * abs(amplitude))
    rates = sdpd.discretization.lattice_rates(
        scene.resolution.kernel,
        2,
        scene.support_radius,
        (0.0, k),
        spacing=1.0,
        across=scene.friction_across,
        along=scene.friction_along,
        mass=1.0,
    )
    assert amplitude == pytest.approx(1e-3 / rates[0, 0], rel=1e-3)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: sdpd.FieldAverage(fields.Grid.over((1.0,) * 3, (1, 1, 1))), "must have 2 dimens"),
        (lambda: sdpd.FieldAverage(LINE, length=20.0), "`length` must be at most"),
        (lambda: sdpd.FieldAverage(LINE, quantities="speed"), "`quantities"),
        (lambda: sdpd.FieldAverage(LINE, quantities=()), "must name at least one"),
        (lambda: sdpd.BinAverage(axis="z"), "`axis` must be below 2"),
        (lambda: sdpd.BinAverage(axis="y", bins=[0.0, 11.0]), "`bins` must lie between"),
        (lambda: sdpd.BinAverage(axis="y", bins=[1.0, 0.0]), "two increasing edges"),
        (lambda: sdpd.BinAverage(axis="y", components="x"), "`components` must come with `lag`"),
    ],
)
def test_bad_input_is_named_before_anything_runs(make, text):
    sim = small(seed=26, threads=1)
    with pytest.raises(ValueError, match=text):
        sim.run(steps=1, observe=make(), progress=False)
    assert sim.step == 0


def test_nothing_before_the_first_run():
    for observer in (sdpd.FieldAverage(LINE), sdpd.BinAverage(axis="x")):
        with pytest.raises(ValueError, match="before the first"):
            observer["density"]
        assert len(observer) == 0
    with pytest.raises(ValueError, match="not known before the first run"):
        _ = sdpd.BinAverage(axis="x").target
    with pytest.raises(TypeError, match="`target` must be a target"):
        sdpd.FieldAverage([1.0, 2.0])


# --- trajectories and the command -------------------------------------------------------------


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    pytest.importorskip("h5py")
    path = tmp_path_factory.mktemp("fields") / "run.h5md"
    sim = small(scene=small_scene(8), seed=27, threads=1)
    profile = sdpd.BinAverage(axis="y", bins=4, quantities=("density", "velocity"), every=2)
    wanted = sdpd.Trajectory(path, every=2, precision="float64", pressures=True)
    sim.run(steps=20, observe=[wanted, profile], progress=False)
    return path, profile


def test_trajectories_give_the_same(trajectory):
    path, profile = trajectory
    frames = sdpd.h5md.read(path)
    states = list(fields.State.of_frames(frames))[1:]  # the observer did not see the first
    found = fields.average(states, profile.target, quantities=("density", "velocity"))
    assert found["velocity"].mean == pytest.approx(profile["velocity"].mean)
    whole = fields.average(frames, fields.Grid.over((8.0, 8.0), (2, 2)))
    assert set(whole.names) == set(fields.DEFAULT) and whole.n_frames == 11
    local = fields.diffusivity_profile(frames, axis="y", bins=2, lag=2, components="x", n_blocks=3)
    exact = analysis.local_diffusivity(
        frames.unwrapped,
        frames.dt,
        axis=1,
        bins=2,
        lag=2,
        box=frames.box,
        components=(0,),
        n_blocks=3,
    )
    assert local.mean.tolist() == exact.mean.tolist()


def test_command(trajectory, tmp_path, capsys):
    path, profile = trajectory
    table = tmp_path / "new" / "profile.csv"
    options = ["fields", str(path), "--profile", "y", "--bins", "4", "--skip", "1"]
    assert cli.main([*options, "--quantities", "density,velocity", "-o", str(table)]) == 0
    shown = capsys.readouterr().out
    assert "10 frames in 10 blocks, 4 points" in shown and "velocity_x" in shown
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    assert rows[:, 2] == pytest.approx(profile["density"].mean)
    assert cli.main(["fields", str(path), "--grid", "3,4"]) == 0
    assert "12 points" in capsys.readouterr().out
    assert cli.main([*options, "--skip", "11"]) == 2
    assert "`--skip` must be" in capsys.readouterr().err
    assert cli.main([*options, "--quantities", "colour"]) == 2


@pytest.mark.parametrize("where", [["--profile", "y"], ["--grid", "6,5"]])
def test_command_draws(trajectory, tmp_path, where):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "fields.png"
    assert cli.main(["fields", str(trajectory[0]), *where, "-o", str(picture)]) == 0
    assert picture.stat().st_size > 10_000


class _Recorded(sdpd.Profile):
    """A profile whose rows were measured elsewhere."""

    def __init__(self, rows, dimension, **options):
        super().__init__(**options)
        self._dimension, self.given = dimension, rows

    def _rows(self):
        return self.given


@pytest.mark.parametrize("memory", [0.0, 0.95])
def test_profile_error_is_that_of_the_mean_even_of_samples_that_remember(memory):
    """Scatter of the mean over 300 runs of correlated samples against the mean stated error."""
    rng = np.random.default_rng(5)
    runs, samples = 300, 4096
    means, errors = [], []
    for _ in range(runs):
        kick = rng.normal(size=samples) * np.sqrt(1.0 - memory**2)
        density = signal.lfilter([1.0], [1.0, -memory], kick)
        number = rng.integers(0, 4, size=samples)  # bins are empty now and then
        rows = np.zeros((samples, 2 + 7))
        rows[:, 1], rows[:, 2] = 1.0, number
        rows[:, 2 + 5] = number * density
        profile = _Recorded(rows, 2, axis="x", bins=1)
        means.append(profile.density[0])
        errors.append(profile.error("density")[0])
    stated = np.sqrt(np.mean(np.square(errors)))
    assert stated == pytest.approx(np.std(means), rel=4.0 / np.sqrt(2.0 * runs))


def test_profile_error_needs_two_blocks():
    rows = np.zeros((1, 2 + 2 * 7))
    rows[:, 1] = rows[:, 2] = 1.0
    assert np.isnan(_Recorded(rows, 2, axis="x", bins=2).error("density")).all()
    assert np.isnan(_Recorded(rows[:0], 2, axis="x", bins=2).error("velocity")).all()
