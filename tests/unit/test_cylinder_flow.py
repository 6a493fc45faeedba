"""Flow through a cylinder array, 30 particles across: a short form of the validation."""

import warnings

import numpy as np
import pytest

import sdpd
from sdpd.theory import cylinder_array_flow

LENGTH, RADIUS, FORCE = 0.1, 0.02, 1.5e-7


def scene():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)  # h = 0.67 R
        return sdpd.Scene(
            fluid=sdpd.fluids.water().in_plane(1.0),
            box=sdpd.Box((LENGTH, LENGTH)),
            walls=[sdpd.Cylinder(radius=RADIUS, centre=(0.5 * LENGTH, 0.5 * LENGTH))],
            resolution=sdpd.Resolution(spacing=LENGTH / 30, support=4.0),
            start=sdpd.RandomStart(),
            effects=sdpd.Effects(fluctuations=False),
            body_force=sdpd.UniformForce((FORCE, 0.0)),
            sound_speed=1e-3,
            velocity_scale=1.2e-4,
        )


def test_steady_flow_is_that_of_navier_and_stokes():
    setting = scene()
    exact = cylinder_array_flow(
        length=LENGTH, radius=RADIUS, acceleration=FORCE, kinematic_viscosity=1e-6
    )
    sim = sdpd.Simulation(setting, threads=1)
    sim.run(time=3000.0)
    mass = setting.particle_mass * sim.n_particles
    before, start, forces = sim.momentum, sim.time, sdpd.WallForces(every=1)
    series = sdpd.Thermodynamics(every=1)
    sim.run(time=600.0, observe=[forces, series])
    # mN/V is not quite the fluid's density, so U is the mean over particles times their share
    share = 1.0 - np.pi * RADIUS**2 / LENGTH**2
    mean = series["momentum_x"].mean() / mass * share
    assert mean == pytest.approx(exact.mean_velocity, rel=0.04)
    drag = forces.force[:, 0].mean(axis=0)
    assert drag[0] == pytest.approx(mass * FORCE, rel=0.02)
    assert abs(drag[1]) < 0.02 * drag[0]
    # what the fluid loses the wall receives, at every step
    impulse = (forces.force[:, 0] * np.diff(forces.time, prepend=start)[:, None]).sum(axis=0)
    brought = np.array([mass * FORCE * (sim.time - start), 0.0])
    assert np.abs(sim.momentum - before + impulse - brought).max() < 1e-10 * brought[0]
    where = np.array(sim.positions) - 0.5 * LENGTH
    error = np.array(sim.velocities) - exact.velocity(where)
    assert np.sqrt(np.mean(error**2)) < 0.03 * np.abs(exact.velocity(where)).max()
