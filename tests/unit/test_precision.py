"""`precision="mixed"` of a simulation: bits, files, walls, refusals."""

import numpy as np
import pytest

import sdpd

from .scenes import reduced_scene
from .sims import INTEGRATORS, assert_same_bits, small, small_scene


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_same_bits_on_any_threads_and_however_a_run_is_cut(integrator):
    scene = small_scene(24)
    one = small(scene=scene, integrator=integrator, precision="mixed", threads=1)
    two = small(scene=scene, integrator=integrator, precision="mixed", threads=2)
    one.run(steps=30)
    two.run(steps=7)
    two.run(steps=23)
    assert_same_bits(one, two)
    double = small(scene=scene, integrator=integrator)
    double.run(steps=30)
    assert np.abs(one.velocities - double.velocities).max() > 0.0


def test_files_remember_the_precision(tmp_path):
    path = tmp_path / "mixed.sdpd"
    sim = small(precision="mixed")
    sim.run(steps=5)
    sim.save(path)
    again = sdpd.load(path)
    assert again.precision == sim.precision == "mixed"
    for each in (sim, again):
        each.run(steps=20)
    assert_same_bits(sim, again)
    with pytest.raises(sdpd.CheckpointError, match="`precision` of its simulation is 'mixed'"):
        small().restore(path)


def test_clusters_are_the_same_after_loading(tmp_path):
    """Of particles that have passed each other since the grid was renewed, too."""
    scene = small_scene(8, 3, eta=500.0)
    sim = small(scene=scene, precision="mixed", integrator="velocity_verlet")
    margin = sim.statistics()["margin"] / sim.scene.support_radius
    assert margin <= 0.15  # or there are no clusters
    renewals = sim.statistics()["grid_renewals"]
    for _ in range(4):
        sim.run(steps=9)
        sim.save(tmp_path / "state.sdpd")
        again = sdpd.load(tmp_path / "state.sdpd")
        assert_same_bits(sim, again)
        again.run(steps=5)
        sim.run(steps=5)
        assert_same_bits(sim, again)
    assert sim.statistics()["grid_renewals"] - renewals < 4


def assert_close(found):
    for mixed, double in zip(*found, strict=True):
        assert 0.0 < np.abs(mixed - double).max() < 2e-5 * max(1.0, np.abs(double).max())


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_stress(integrator):
    found = []
    for precision in ("mixed", "double"):
        stress, sums = sdpd.Stress(), sdpd.StressCorrelator()
        sim = small(integrator=integrator, precision=precision, dt=0.002)
        sim.run(steps=25, observe=stress)
        sim.run(steps=25, observe=sums)
        found.append((sim.velocities, stress.total, sums.increments(n_blocks=2).mean))
    assert_close(found)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_walls(integrator):
    box = sdpd.Box((9.0, 9.0, 9.0), periodic="xy")
    walls = sdpd.walls.slab(box, "z")
    scene = reduced_scene(box=box, walls=walls, body_force=sdpd.UniformForce((1.0, 0.0, 0.0)))
    found = []
    for precision in ("mixed", "double"):
        forces = sdpd.WallForces()
        sim = sdpd.Simulation(scene, integrator=integrator, precision=precision, dt=0.002, seed=1)
        sim.run(steps=25, observe=forces)
        found.append((sim.velocities, forces.force))
    assert_close(found)


def test_it_is_shown_and_wrong_ones_are_refused():
    assert small().precision == "double"
    assert "mixed" in str(small(precision="mixed"))
    with pytest.raises(ValueError, match=r"`precision` must be one of .*got 'single'"):
        small(precision="single")
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=20.0,
        temperature=1.0,
        boltzmann_constant=1.0,
        heat_capacity=25.0,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    scene = reduced_scene(fluid=fluid, effects=sdpd.Effects(energy=True), sound_speed=10.0)
    with pytest.raises(ValueError, match="`precision` must be 'double' for a fluid with an energy"):
        sdpd.Simulation(scene, precision="mixed")
