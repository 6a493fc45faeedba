"""Walls whose motion changes between runs: what they do, what files keep, what is refused."""

import math

import numpy as np
import pytest

import sdpd
from tests.validation.channel import script

from .scenes import reduced_scene

BOX = sdpd.Box((8.0, 8.0, 12.0), periodic="xy")


def slab(velocity=None, **changes):
    arguments = {"start": sdpd.LatticeStart(jitter=0.1), **changes}
    walls = sdpd.walls.slab(BOX, upper_velocity=velocity)
    return reduced_scene(box=BOX, walls=walls, **arguments)


def ring():
    """A circle that can turn inside of one at rest."""
    radius = 11.0
    box = sdpd.Box((44.0, 44.0), periodic="")
    walls = (
        sdpd.Cylinder(radius=radius, centre=(22.0, 22.0)),
        sdpd.Cylinder(radius=22.0, centre=(22.0, 22.0), fluid="inside"),
    )
    return reduced_scene(
        dimension=2,
        box=box,
        walls=walls,
        resolution=sdpd.Resolution(spacing=1.0, support=2.1, kernel="lucy"),
        effects=sdpd.Effects(fluctuations=False),
    )


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
def test_a_wall_set_in_motion_is_one_made_so(integrator):
    """Bit for bit: the scene's speed decides nothing but the neighbour lists, which are alike."""
    speed = (0.5, -0.25, 0.0)
    made = sdpd.Simulation(
        slab(speed, velocity_scale=1.0), seed=3, integrator=integrator, threads=1
    )
    moved = sdpd.Simulation(slab(velocity_scale=1.0), seed=3, integrator=integrator, threads=1)
    moved.set_wall_velocity(1, speed)
    assert moved.walls[1] == made.scene.walls[1]
    assert moved.scene.walls[1].velocity is None
    assert np.array_equal(made.forces, moved.forces)
    made.run(steps=7)
    moved.run(steps=7)
    assert np.array_equal(made.velocities, moved.velocities)
    assert np.array_equal(made._core.wall_forces(), moved._core.wall_forces())


@pytest.mark.parametrize("integrator", ["velocity_verlet", "pair_splitting"])
def test_files_keep_the_motion(integrator, tmp_path):
    whole = sdpd.Simulation(slab(), seed=3, integrator=integrator, threads=1)
    whole.run(steps=3)
    whole.set_wall_velocity(1, (1.0, 0.0, 0.0))
    whole.run(steps=3)
    whole.save(tmp_path / "moving.sdpd")
    again = sdpd.load(tmp_path / "moving.sdpd", threads=2)
    assert again.walls == whole.walls and again.walls[1].velocity == (1.0, 0.0, 0.0)
    for sim in (whole, again):
        sim.run(steps=4)
    assert np.array_equal(whole.velocities, again.velocities)
    goal = np.array(whole.velocities)
    whole.set_wall_velocity(1, (0.0, 0.0, 0.0))
    whole.run(steps=2)
    whole.restore(tmp_path / "moving.sdpd")
    assert whole.walls[1].speed == 1.0
    whole.run(steps=4)
    assert np.array_equal(goal, whole.velocities)


def test_motion_set_in_a_callback_holds_from_the_next_step():
    speeds = np.linspace(0.1, 0.8, 8)
    cut = sdpd.Simulation(slab(), seed=1, threads=1)
    for speed in speeds:
        cut.set_wall_velocity(0, (speed, 0.0, 0.0))
        cut.run(steps=2)
    called = sdpd.Simulation(slab(), seed=1, threads=1)
    called.set_wall_velocity(0, (speeds[0], 0.0, 0.0))

    def follow(sim):
        k = sim.step // 2
        if k < len(speeds):
            sim.set_wall_velocity(0, (speeds[k], 0.0, 0.0))

    called.run(steps=16, every=2, callback=follow)
    assert np.array_equal(cut.velocities, called.velocities)


def test_a_cylinder_begins_to_turn_and_drags_the_fluid():
    sim = sdpd.Simulation(ring(), threads=1)
    sim.run(steps=20)
    assert np.abs(sim._core.wall_forces()[:, 5]).max() < 1e-9
    sim.set_wall_velocity(0, angular_velocity=0.05)
    assert sim.walls[0].speed == pytest.approx(0.55)
    forces = sdpd.WallForces(every=10)
    sim.run(steps=10, observe=forces)
    assert forces.torque[0, 0, 2] < 0.0  # the fluid holds it back
    r = np.array(sim.positions) - 22.0
    turning = r[:, 0] * sim.velocities[:, 1] - r[:, 1] * sim.velocities[:, 0]
    assert turning.sum() > 0.0
    assert turning.max() < 0.05 * 11.0**2 * 1.2


def test_a_plate_that_oscillates_drives_stokes_layer():
    """At 16 layers, velocity and stress on the plate; tests/validation/wall_flows has 48."""
    plate = script("wall_flows").oscillating_plate(16, 3.0)
    assert plate.rms < 0.008
    assert plate.amplitude == pytest.approx(1.0, abs=0.005)
    assert abs(plate.phase) < 2.0


def test_what_walls_cannot_do_is_refused():
    sim, other = sdpd.Simulation(slab(), threads=1), sdpd.Simulation(ring(), threads=1)
    before = np.array(sim.forces)
    with pytest.raises(ValueError, match=r"`walls\[1\]\.velocity` must lie in the plane"):
        sim.set_wall_velocity(1, (0.0, 0.0, 1.0))
    with pytest.raises(ValueError, match=r"`walls\[1\]\.velocity` must have 3 entries"):
        sim.set_wall_velocity(1, (0.0, 1.0))
    with pytest.raises(TypeError, match="which has no `angular_velocity` but only"):
        sim.set_wall_velocity(1, angular_velocity=1.0)
    with pytest.raises(TypeError, match="one of `velocity` and `angular_velocity` must be given"):
        sim.set_wall_velocity(1)
    with pytest.raises(ValueError, match="`wall` must be an integer <= 1, got 2"):
        sim.set_wall_velocity(2, (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="must be finite"):
        other.set_wall_velocity(0, angular_velocity=math.nan)
    free = sdpd.Simulation(reduced_scene(), seed=1, threads=1)
    with pytest.raises(ValueError, match="the scene has none"):
        free.set_wall_velocity(0, (1.0, 0.0, 0.0))
    assert sim.walls == sim.scene.walls
    assert np.array_equal(before, sim.forces)


def test_the_core_keeps_the_form_of_a_wall():
    sim = sdpd.Simulation(slab(), threads=1)
    plane = sdpd.Plane(axis="z", at=1.0)
    with pytest.raises(ValueError, match="must be a wall of the scene and keep its form"):
        sim._core.move_wall(0, plane.core(BOX))
    with pytest.raises(ValueError, match="must be a wall of the scene and keep its form"):
        sim._core.move_wall(7, plane.core(BOX))


def test_a_wall_of_any_shape_starts_to_turn():
    """A round polyline that begins to turn drags the fluid, as one that turned from the start."""
    angle = np.linspace(0.0, 2.0 * np.pi, 121)[:-1]
    ring = tuple(map(tuple, 5.0 + 4.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)))

    def scene(spin):
        return reduced_scene(
            dimension=2,
            box=sdpd.Box((10.0, 10.0), periodic=""),
            walls=(sdpd.Polyline(points=ring, angular_velocity=spin),),
            resolution=sdpd.Resolution(spacing=1.0, support=2.0, kernel="lucy"),
            start=sdpd.RandomStart(relax_steps=20),
            sound_speed=10.0,
        )

    def start(spin):
        options = {"integrator": "velocity_verlet", "dt": 1e-3, "seed": 1, "threads": 1}
        return sdpd.Simulation(scene(spin), **options)

    turning, turned, resting = start(0.3), start(0.0), start(0.0)
    turned.set_wall_velocity(0, angular_velocity=0.3)
    assert turned.walls[0].angular_velocity == (0.0, 0.0, 0.3)
    for sim in (turning, turned, resting):
        sim.run(steps=5, progress=False)
    np.testing.assert_allclose(turned.velocities, turning.velocities, rtol=0.0, atol=1e-10)
    assert np.abs(turned.velocities - resting.velocities).max() > 0.01
    with pytest.raises(ValueError, match="stay in its place"):
        turned.set_wall_velocity(0, (1.0, 0.0))


@pytest.mark.parametrize("bad", [math.nan, 1e6])
def test_restore_mends_broken_arrays_whatever_the_walls_did_since(tmp_path, bad):
    sim = sdpd.Simulation(slab(), seed=1, dt=1e-3, threads=1)
    sim.run(steps=2, progress=False)
    path = tmp_path / "state.sdpd"
    sim.save(path)
    kept = np.array(sim.positions), np.array(sim.velocities)
    sim.set_wall_velocity(1, (0.5, 0.0, 0.0))
    sim.positions[0] = bad
    sim.restore(path)
    assert sim.walls[1].speed == 0.0
    np.testing.assert_array_equal(sim.positions, kept[0])
    np.testing.assert_array_equal(sim.velocities, kept[1])
    again = sdpd.Simulation.load(path, threads=1)
    for each in (sim, again):
        each.run(steps=3, progress=False)
    np.testing.assert_array_equal(sim.velocities, again.velocities)
