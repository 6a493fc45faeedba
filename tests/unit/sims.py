"""Small simulations that several test files build on."""

import numpy as np

import sdpd

from .scenes import reduced_scene

INTEGRATORS = ("pair_splitting", "velocity_verlet")
ARRAYS = (
    "positions",
    "velocities",
    "forces",
    "number_densities",
    "densities",
    "pressures",
    "ids",
    "images",
)


def small_scene(edge=10, dimension=2, **changes):
    arguments = {"box": sdpd.Box((float(edge),) * dimension), "start": sdpd.RandomStart()}
    return reduced_scene(dimension, **{**arguments, **changes})


def small(edge=10, *, scene=None, seed=5, **options):
    return sdpd.Simulation(scene or small_scene(edge), seed=seed, **options)


def assert_same_bits(one, other):
    assert (one.step, one.time) == (other.step, other.time)
    for name in ARRAYS:
        mine, its = getattr(one, name), getattr(other, name)
        assert mine.tobytes() == its.tobytes(), f"{name}: {np.abs(mine - its).max()}"
