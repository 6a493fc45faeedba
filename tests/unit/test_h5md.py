"""H5MD trajectories: what is in them, read back by this package, h5py and MDAnalysis."""

import sys
import warnings

import h5py
import numpy as np
import pytest

import sdpd

from .sims import small, small_scene


def water(dimension=3, particles=216):
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water() if dimension == 3 else sdpd.fluids.water().in_plane(1e-9),
        box=sdpd.Box((1e-8,) * dimension),
        resolution=sdpd.Resolution(particles=particles),
    )
    return sdpd.Simulation(scene, seed=1)


def recorded(sim, path, **options):
    """A trajectory of three frames, with copies of what the simulation showed."""
    frames = []

    def keep(s):
        names = ("positions", "unwrapped", "velocities", "forces", "densities", "pressures")
        frames.append({name: getattr(s, name).copy() for name in names} | {"time": s.time})

    keep(sim)
    trajectory = sdpd.Trajectory(path, every=5, **options)
    sim.run(steps=10, observe=trajectory, callback=keep, every=5)
    return trajectory, frames


EVERYTHING = {"forces": True, "pressures": True, "precision": "float64"}


@pytest.mark.parametrize("si", [True, False])
@pytest.mark.parametrize("dimension", [2, 3])
def test_round_trip(tmp_path, si, dimension):
    sim = water(dimension, 100 if dimension == 2 else 216) if si else small()
    sim.velocities[:] *= 30.0  # some cross the boundary
    sim.refresh()
    trajectory, frames = recorded(sim, tmp_path / "a.h5md", **EVERYTHING)
    read = sdpd.h5md.read(tmp_path / "a.h5md")
    assert len(trajectory) == trajectory.frames == len(read) == 3
    assert read.step.tolist() == [0, 5, 10]
    np.testing.assert_allclose(read.time, [frame["time"] for frame in frames], rtol=1e-14)
    np.testing.assert_allclose(read.box, sim.scene.box.lengths, rtol=1e-14)
    np.testing.assert_allclose(read.mass, sim.scene.particle_mass, rtol=1e-12)
    for name in ("positions", "unwrapped", "velocities", "forces", "densities", "pressures"):
        expected = np.array([frame[name] for frame in frames])
        np.testing.assert_allclose(getattr(read, name), expected, rtol=1e-12, err_msg=name)
    assert sdpd.Scene.from_toml(read.scene) == sim.scene


def test_time_between_frames(tmp_path):
    sim = small()
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md", every=5)
    sim.run(steps=10, observe=trajectory)
    read = sdpd.h5md.read(trajectory.path)
    assert read.dt == pytest.approx(5 * sim.dt)
    sim.run(steps=9, observe=trajectory, every=9)  # its own `every` goes first
    assert sdpd.h5md.read(trajectory.path).dt == pytest.approx(5 * sim.dt)
    uneven = sdpd.Trajectory(tmp_path / "b.h5md")
    sim.run(steps=3, observe=uneven, every=3)
    with pytest.raises(ValueError, match="`dt` needs at least 2 frames, got 1"):
        sdpd.h5md.read(uneven.path).dt  # noqa: B018
    sim.run(steps=20, observe=uneven, every=5)
    with pytest.raises(ValueError, match="`dt` needs equally spaced frames, got spacings from"):
        sdpd.h5md.read(uneven.path).dt  # noqa: B018


def test_single_precision_and_compression(tmp_path):
    sim = small()
    _, frames = recorded(sim, tmp_path / "a.h5md", compression=4)
    read = sdpd.h5md.read(tmp_path / "a.h5md")
    np.testing.assert_allclose(read.positions[-1], frames[-1]["positions"], atol=10.0 * 6e-8)
    np.testing.assert_allclose(read.velocities[-1], frames[-1]["velocities"], rtol=1e-6)
    assert read.forces is None and read.pressures is None and read.densities is not None
    with h5py.File(tmp_path / "a.h5md") as file:
        value = file["particles/trajectory/position/value"]
        assert value.dtype == np.float32 and value.compression == "gzip"


def test_what_is_left_out(tmp_path):
    _, _ = recorded(small(), tmp_path / "a.h5md", velocities=False, densities=False)
    read = sdpd.h5md.read(tmp_path / "a.h5md")
    assert read.velocities is None and read.densities is None
    assert len(read.positions) == 3


def test_layout_follows_h5md(tmp_path):
    recorded(water(), tmp_path / "a.h5md", forces=True)
    with h5py.File(tmp_path / "a.h5md") as file:
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        assert file["h5md/creator"].attrs["name"] == "sdpd"
        assert file["h5md/creator"].attrs["version"] == sdpd.__version__
        assert "name" in file["h5md/author"].attrs
        group = file["particles/trajectory"]
        assert group["box"].attrs["dimension"] == 3
        assert group["box"].attrs["boundary"].tolist() == [b"periodic"] * 3
        for name in ("position", "velocity", "force", "image", "density", "box/edges"):
            element = group[name]
            assert len(element["value"]) == len(element["step"]) == len(element["time"]) == 3
            assert element["step"] == group["position/step"]  # one dataset, linked
        assert group["position/value"].attrs["unit"] == "nm"
        assert group["velocity/value"].attrs["unit"] == "nm ps-1"
        assert group["position/time"].attrs["unit"] == "ps"
        assert group["id"].shape == group["mass"].shape == group["species"].shape == (216,)
        assert file["observables/density"] == group["density"]
        assert file["observables/temperature/value"].shape == (3,)


def test_mdanalysis_opens_it_with_velocities(tmp_path):
    mda = pytest.importorskip("MDAnalysis")
    sim = water()
    _, frames = recorded(sim, tmp_path / "a.h5md", forces=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        universe = mda.Universe(str(tmp_path / "a.h5md"))
    assert universe.trajectory.n_frames == 3 and len(universe.atoms) == 216
    for ts, frame in zip(universe.trajectory, frames, strict=True):
        assert ts.time == pytest.approx(frame["time"] * 1e12)  # ps
        np.testing.assert_allclose(ts.positions, frame["positions"] * 1e10, atol=1e-4)  # angstrom
        np.testing.assert_allclose(ts.velocities, frame["velocities"] * 1e-2, rtol=1e-5)
        force = 6.02214076e23 * 1e-13  # kJ/(mol angstrom)
        np.testing.assert_allclose(ts.forces, frame["forces"] * force, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(ts.dimensions, [100, 100, 100, 90, 90, 90])
        np.testing.assert_allclose(ts.data["density"], frame["densities"], rtol=1e-6)
        assert 100.0 < ts.data["temperature"] < 600.0
    universe.trajectory.close()


def test_mdanalysis_opens_two_dimensions_and_other_units(tmp_path):
    mda = pytest.importorskip("MDAnalysis")
    _, frames = recorded(small(), tmp_path / "a.h5md")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        universe = mda.Universe(str(tmp_path / "a.h5md"), convert_units=False, n_atoms=100)
    last = universe.trajectory[-1]
    np.testing.assert_allclose(last.positions[:, :2], frames[-1]["positions"], atol=1e-6)
    assert np.all(last.positions[:, 2] == 0.0)
    np.testing.assert_allclose(last.dimensions, [10, 10, 1, 90, 90, 90])
    np.testing.assert_allclose(last.velocities[:, :2], frames[-1]["velocities"], rtol=1e-6)
    universe.trajectory.close()


def test_it_goes_on_over_runs(tmp_path):
    sim = small()
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md", every=4)
    sim.run(steps=3)
    sim.run(steps=6, observe=trajectory)
    assert sdpd.h5md.read(trajectory.path).step.tolist() == [4, 8]
    sim.run(steps=6)
    sim.run(steps=6, observe=trajectory)
    assert sdpd.h5md.read(trajectory.path).step.tolist() == [4, 8, 16, 20]
    assert repr(trajectory).endswith("a.h5md': 4 frames>")


def test_frames_after_a_restored_state_are_replaced(tmp_path):
    sim = small()
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md", every=5)
    sim.run(steps=10, observe=trajectory)
    sim.save(tmp_path / "state.sdpd")
    sim.run(steps=20, observe=trajectory)
    before = sdpd.h5md.read(trajectory.path)
    sim.restore(tmp_path / "state.sdpd")
    sim.run(steps=15, observe=trajectory)
    after = sdpd.h5md.read(trajectory.path)
    assert after.step.tolist() == [0, 5, 10, 15, 20, 25]
    np.testing.assert_array_equal(after.positions, before.positions[:6])


def test_a_broken_frame_does_not_count(tmp_path, monkeypatch):
    sim = small()
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md", every=1)
    sim.run(steps=2, observe=trajectory)
    with monkeypatch.context() as patch:
        patch.setattr(sdpd.Simulation, "kinetic_energy", property(lambda s: 1 / 0))
        with pytest.raises(ZeroDivisionError):
            sim.run(steps=5, observe=trajectory)
    assert sim.step == 3
    assert sdpd.h5md.read(trajectory.path).step.tolist() == [0, 1, 2]
    sim.run(steps=2, observe=trajectory)
    read = sdpd.h5md.read(trajectory.path)
    assert read.step.tolist() == [0, 1, 2, 4, 5]
    np.testing.assert_allclose(read.positions[-1], sim.positions, atol=1e-6)


def test_a_failing_run_leaves_whole_frames(tmp_path):
    sim = small()
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md", every=2)
    with pytest.warns(sdpd.TimeStepWarning):
        sim.dt = 1e3
    with pytest.raises(sdpd.SimulationError):
        sim.run(steps=10, observe=trajectory)
    assert sdpd.h5md.read(trajectory.path).step.tolist() == [0]


def test_existing_files_are_kept(tmp_path):
    path = tmp_path / "a.h5md"
    path.write_text("mine")
    with pytest.raises(FileExistsError, match="choose another path or overwrite=True"):
        sdpd.Trajectory(path)
    late = sdpd.Trajectory(tmp_path / "b.h5md")
    late.path.write_text("mine")
    with pytest.raises(FileExistsError):
        small().run(steps=1, observe=late)
    assert path.read_text() == late.path.read_text() == "mine"
    small().run(steps=1, observe=sdpd.Trajectory(path, overwrite=True))
    assert len(sdpd.h5md.read(path)) == 2


def test_foreign_files(tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file.create_group("h5md")
    with pytest.raises(ValueError, match="`path` must be an H5MD file written by sdpd, got"):
        sdpd.h5md.read(tmp_path / "other.h5")
    with pytest.raises(FileNotFoundError):
        sdpd.h5md.read(tmp_path / "none.h5")


def test_one_trajectory_serves_one_simulation(tmp_path):
    trajectory = sdpd.Trajectory(tmp_path / "a.h5md")
    small().run(steps=1, observe=trajectory)
    with pytest.raises(ValueError, match="already belongs to another one; make one for each"):
        small(scene=small_scene(edge=12)).run(steps=1, observe=trajectory)


def test_without_h5py(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ImportError, match=r"h5py is needed .*: pip install 'sdpd\[io\]'"):
        sdpd.Trajectory(tmp_path / "a.h5md")
    with pytest.raises(ImportError, match="h5py is needed to read H5MD trajectories"):
        sdpd.h5md.read(tmp_path / "a.h5md")
