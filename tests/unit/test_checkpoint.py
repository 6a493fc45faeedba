"""Checkpoints: bit for bit, whole or refused, atomic."""

import io
import json
import os
import stat
import zipfile

import numpy as np
import pytest

import sdpd
from sdpd import checkpoint

from .sims import ARRAYS, INTEGRATORS, assert_same_bits, small, small_scene


def rewritten(path, change):
    """Rewrites the members of a checkpoint: `change(header, members)`."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(members.pop("header.json"))
    change(header, members)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.json", json.dumps(header))
        for name, content in members.items():
            archive.writestr(name, content)


def forged(path, change):
    """Rewrites a checkpoint with a digest that fits: `change(header, arrays)`."""
    header, arrays = checkpoint._Reader(path).read()
    change(header, arrays)
    header["digest"] = checkpoint._digest(header, arrays)
    with path.open("wb") as file:
        checkpoint._write(file, header, arrays)


@pytest.fixture
def saved(tmp_path):
    sim = small()
    sim.run(steps=5)
    path = tmp_path / "state.sdpd"
    sim.save(path)
    return path


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("skin", [None, 0.05])
@pytest.mark.parametrize("threads", [1, 2])
def test_continues_bit_for_bit(tmp_path, integrator, skin, threads):
    options = {"integrator": integrator, "skin": skin, "edge": 30}
    whole = small(threads=1, **options)
    whole.run(steps=17)
    whole.save(tmp_path / "state.sdpd")
    other = sdpd.Simulation.load(tmp_path / "state.sdpd", threads=threads)
    assert other.threads == threads
    assert_same_bits(whole, other)
    whole.run(steps=25)
    other.run(steps=11)
    other.run(steps=14)
    assert_same_bits(whole, other)


def test_continues_after_writing_and_a_new_dt(tmp_path):
    sim = small(integrator=sdpd.VelocityVerlet(iterations=0))
    sim.run(steps=9)
    sim.velocities[3] *= 1.5
    sim.positions[5] += 0.3
    sim.dt = 0.3 * sim.dt
    sim.save(tmp_path / "state.sdpd")
    other = sdpd.load(tmp_path / "state.sdpd")
    assert other.dt == sim.dt
    sim.run(steps=15)
    other.run(steps=15)
    assert_same_bits(sim, other)


@pytest.mark.parametrize("shrink", [1.0, 0.8])
@pytest.mark.parametrize("known", ["nothing", "other widths"])
def test_files_of_other_lists(tmp_path, known, shrink):
    """Of earlier versions: they say nothing of lists, or widths, maybe blocks too, were others."""
    sim = small(integrator="velocity_verlet", edge=30)
    sim.run(steps=17)
    path = tmp_path / "state.sdpd"
    sim.save(path)

    def older(header, arrays):
        if known == "nothing":
            del header["list_travel"], header["list_widths"]
            arrays["list_reference"] = np.zeros((0, 3))
        else:
            header["list_widths"][1] *= 1.1
        middle = 0.5 * np.array([*sim.scene.box.lengths, 0.0]) / sim.scene.support_radius
        arrays["grid_reference"] = middle + shrink * (arrays["grid_reference"] - middle)

    forged(path, older)
    other = sdpd.load(path)
    np.testing.assert_allclose(other.densities, sim.densities, rtol=1e-12)
    sim.run(steps=20)
    other.run(steps=20)
    np.testing.assert_allclose(other.velocities, sim.velocities, rtol=0.0, atol=1e-9)


def test_a_travel_that_cannot_be(saved):
    forged(saved, lambda header, _: header.update(list_travel=-1.0))
    with pytest.raises(sdpd.CheckpointError, match=r"`list_travel` must be >= 0, got -1"):
        sdpd.load(saved)


def test_saving_changes_no_bit(tmp_path):
    plain, saving = small(), small()
    plain.run(steps=20)
    saving.run(steps=20, callback=lambda s: s.save(tmp_path / "state.sdpd"), every=3)
    assert_same_bits(plain, saving)


def test_everything_comes_back(tmp_path):
    scene = small_scene(
        dimension=3,
        edge=6,
        body_force=sdpd.SinusoidalForce(amplitude=0.3),
        effects=sdpd.Effects(central_friction=True),
        calibrate=True,
    )
    sim = sdpd.Simulation(
        scene,
        integrator=sdpd.VelocityVerlet(iterations=2, noise="gaussian"),
        seed=2**64 - 1,
        resolve_vacf=True,
    )
    sim.run(steps=2)
    sim.save(tmp_path / "state.sdpd")
    other = sdpd.load(tmp_path / "state.sdpd")
    assert other.scene == scene and other.integrator == sim.integrator and other.seed == sim.seed
    assert other.dt == sim.dt and other.bounds == sim.bounds and other.statistics().keys()
    assert_same_bits(sim, other)
    sim.run(steps=5)
    other.run(steps=5)
    assert_same_bits(sim, other)


def test_header_tells_what_it_is(saved):
    header = checkpoint.read_header(saved)
    assert header["format"] == "sdpd checkpoint" and header["schema"] == 1
    assert header["sdpd"] == sdpd.__version__ and header["machine"]["precision"] == "float64"
    assert header["clock"]["step"] == 5 and header["integrator"]["name"] == "pair_splitting"
    assert sdpd.Scene.from_toml(header["scene"]) == small_scene()


def test_numpy_opens_it(saved):
    with np.load(saved) as archive:
        assert archive["position"].shape == (100, 4) and archive["id"].dtype == np.uint64


def test_restore_keeps_the_views(saved):
    sim, other = small(), sdpd.load(saved)
    views = {name: getattr(sim, name) for name in ARRAYS}
    thermo = sdpd.Thermodynamics(every=1)
    sim.run(steps=30, observe=thermo)
    sim.restore(saved)
    assert all(np.shares_memory(getattr(sim, name), view) for name, view in views.items())
    assert_same_bits(sim, other)
    sim.run(steps=3, observe=thermo)
    other.run(steps=3)
    assert_same_bits(sim, other)
    assert thermo["step"].tolist() == [*range(1, 31), 6, 7, 8]


def test_restore_is_refused_while_running(saved):
    sim = small()
    with pytest.raises(RuntimeError, match="the simulation is running") as caught:
        sim.run(steps=1, callback=lambda s: s.restore(saved))
    assert not isinstance(caught.value, sdpd.SimulationError)
    sim.restore(saved)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"seed": 6}, "`seed` of its simulation is 5, of this one 6; sdpd.load()"),
        ({"integrator": "velocity_verlet"}, "`noise` of its simulation is 'gaussian', of this"),
        ({"skin": 0.1}, "`skin` of its simulation is None, of this one 0.1"),
        ({"scene": small_scene(calibrate=True)}, "it belongs to another scene; sdpd.load() makes"),
    ],
)
def test_restore_refuses_another_simulation(saved, options, text):
    sim, twin = small(**options), small(**options)
    sim.run(steps=2)
    twin.run(steps=2)
    with pytest.raises(sdpd.CheckpointError) as caught:
        sim.restore(saved)
    assert text in str(caught.value) and str(saved) in str(caught.value)
    assert_same_bits(sim, twin)


# --- refusals --------------------------------------------------------------------------------


def assert_refused(path, text):
    """Neither `load` nor `restore` takes it, and `restore` changes nothing."""
    sim, twin = small(), small()
    for simulation in (sim, twin):
        simulation.run(steps=3)
    with pytest.raises(sdpd.CheckpointError) as caught:
        sdpd.load(path)
    assert text in str(caught.value), str(caught.value)
    assert str(path) in str(caught.value)
    with pytest.raises(sdpd.CheckpointError):
        sim.restore(path)
    assert_same_bits(sim, twin)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("part", [0.0, 0.01, 0.3, 0.6, 0.95, 0.999])
def test_truncated(saved, part):
    content = saved.read_bytes()
    saved.write_bytes(content[: int(part * len(content))])
    assert_refused(saved, "damaged, truncated or not a checkpoint")


@pytest.mark.parametrize("part", np.linspace(0.02, 0.98, 13))
def test_a_flipped_byte_is_noticed(saved, part):
    content = bytearray(saved.read_bytes())
    content[int(part * len(content))] ^= 0x10
    saved.write_bytes(content)
    try:
        loaded = sdpd.load(saved)
    except sdpd.CheckpointError:
        return
    # what is left are bytes of the archive that carry nothing, such as its dates
    assert_same_bits(loaded, _five_steps())


def _five_steps():
    sim = small()
    sim.run(steps=5)
    return sim


def test_foreign(tmp_path):
    path = tmp_path / "foreign"
    path.write_text("positions: 1 2 3\n")
    assert_refused(path, "damaged, truncated or not a checkpoint")
    np.savez(tmp_path / "foreign.npz", position=np.zeros(3))
    assert_refused(tmp_path / "foreign.npz", "not a checkpoint of sdpd (no header)")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.json", "{}")
    assert_refused(path, "not a checkpoint of sdpd (its header says otherwise)")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.json", "{")
    assert_refused(path, "its header is not readable")


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError):
        sdpd.load(tmp_path / "none.sdpd")
    with pytest.raises(IsADirectoryError):
        sdpd.load(tmp_path)


def test_other_schema(saved):
    rewritten(saved, lambda header, _: header.update(schema=2))
    assert_refused(saved, "its schema is 2, this version of sdpd reads 1; it was written by sdpd")


def test_altered(saved):
    rewritten(saved, lambda header, _: header.update(dt=1.0))
    assert_refused(saved, "it was altered after it was written (its digest differs)")


def _seven_rows():
    file = io.BytesIO()
    np.save(file, np.zeros((7, 4)))
    return file.getvalue()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda h, m: m.pop("force.npy"), "its array 'force' is missing"),
        (lambda h, m: m.update({"id.npy": b"abc"}), "its array 'id' is not readable"),
        (
            lambda h, m: m.update({"velocity.npy": _seven_rows()}),
            "its array 'velocity' must hold 100 rows of 4 <f8, got shape (7, 4) of float64",
        ),
        (lambda h, m: h.update(particles=99), "its array 'position' must hold 99 rows"),
    ],
)
def test_arrays_that_do_not_fit(saved, change, text):
    rewritten(saved, change)
    assert_refused(saved, text)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda h, a: h.pop("dt"), "its header lacks 'dt'"),
        (lambda h, a: h.update(dt=-1.0), "its header is not valid: `dt` must be finite and > 0"),
        (lambda h, a: h.update(scene="x = 1"), "its header is not valid: `x` is not a known key"),
        (lambda h, a: h["integrator"].update(name="leapfrog"), "or has an unknown one"),
        (lambda h, a: h["integrator"].update(noise="loud"), "`noise` must be one of"),
        (
            lambda h, a: h["settings"].update(mass=2.0),
            "`mass` of its simulation is 2.0, but its scene says 1.0",
        ),
        (lambda h, a: h["settings"].update(kernel="lucy"), "`kernel` of its simulation is 'lucy'"),
        (
            lambda h, a: h["settings"].update(integrator="velocity_verlet"),
            "`integrator` of its simulation is 'velocity_verlet', but its scene says",
        ),
        (lambda h, a: h.update(accuracy={"speed": 1}), "its header is not valid: bounds() got"),
        (lambda h, a: h.update(machine=None), "its header is not valid"),
        (lambda h, a: h["clock"].update(step=-1), "its state is not valid"),
        (lambda h, a: h["clock"].update(dt=0.0), "its state is not valid: `base_step` must be"),
        (lambda h, a: a.update(row=np.zeros(100, "<u4")), "`row` must be a permutation"),
        (lambda h, a: a.update(row=np.full(100, 200, "<u4")), "its rows are not valid"),
        (
            lambda h, a: a.update(velocity=np.full((100, 4), np.nan)),
            "its state is not valid: `velocity` must be finite",
        ),
        (
            lambda h, a: a.update(position=np.full((100, 4), np.inf)),
            "its state is not valid: `position",
        ),
    ],
)
def test_contents_that_make_no_sense(saved, change, text):
    forged(saved, change)
    assert_refused(saved, text)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda h, a: h.update(sdpd="0.0.1"), "was written by sdpd 0.0.1 (here "),
        (lambda h, a: h["machine"].update(architecture="pdp11"), "architecture pdp11 (here "),
    ],
)
def test_other_machines_and_versions_warn(saved, change, text):
    forged(saved, change)
    with pytest.warns(sdpd.SdpdWarning, match="not necessarily bit for bit") as caught:
        sim = sdpd.load(saved)
    assert text in str(caught[0].message)
    assert sim.step == 5


# --- writing ---------------------------------------------------------------------------------


def test_a_crash_while_writing_leaves_the_old_file(saved, monkeypatch):
    before = saved.read_bytes()
    sim = small()

    def crash(*_):
        raise OSError("no space left")

    for module, name in ((checkpoint, "_write"), (os, "replace")):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, crash)
            with pytest.raises(OSError, match="no space left"):
                sim.save(saved)
        assert saved.read_bytes() == before
        assert [path.name for path in saved.parent.iterdir()] == [saved.name]


def test_writing_replaces_and_keeps_permissions(saved):
    saved.chmod(0o600)
    sim = small()
    sim.save(str(saved))
    assert sdpd.load(saved).step == 0
    assert stat.S_IMODE(saved.stat().st_mode) == 0o600
    fresh = saved.with_name("fresh.sdpd")
    sim.save(fresh)
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(fresh.stat().st_mode) == 0o666 & ~mask


def test_writing_leaves_the_mask_of_the_process_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "umask", lambda mask: pytest.fail("other threads would see it"))
    small().save(tmp_path / "state.sdpd")


def test_writing_into_no_folder(tmp_path):
    with pytest.raises(FileNotFoundError):
        small().save(tmp_path / "none" / "state.sdpd")


def test_loading_warns_of_nothing_again(tmp_path):
    fluid = small_scene().fluid.replace(
        equation_of_state=sdpd.eos.Linear(background_pressure=-200.0)
    )
    with pytest.warns(sdpd.PairingWarning):
        scene = small_scene(fluid=fluid)
    with pytest.warns(sdpd.TimeStepWarning):
        sim = sdpd.Simulation(scene, dt=0.5)
    sim.save(tmp_path / "state.sdpd")
    assert sdpd.load(tmp_path / "state.sdpd").dt == 0.5
