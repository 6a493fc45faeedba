"""Initial states: lattice, jitter, random, velocities and arrays of the user."""

import math

import numpy as np
import pytest

import sdpd
from sdpd import initial

from .scenes import reduced_scene, water_scene


def test_lattice():
    points = initial.positions(reduced_scene(2), 0)
    assert points.shape == (144, 2)
    np.testing.assert_allclose(points[:3], [[0.5, 0.5], [0.5, 1.5], [0.5, 2.5]])
    assert len(np.unique(points, axis=0)) == 144


def test_jitter():
    scene = reduced_scene(2, start=sdpd.LatticeStart(jitter=0.2))
    shift = initial.positions(scene, 3) - initial.positions(reduced_scene(2), 3)
    assert 0.15 < np.abs(shift).max() <= 0.2
    np.testing.assert_array_equal(initial.positions(scene, 3), initial.positions(scene, 3))
    assert not np.array_equal(initial.positions(scene, 3), initial.positions(scene, 4))


def test_poisson():
    scene = reduced_scene(start=sdpd.RandomStart(relax=False))
    points = initial.positions(scene, 1)
    assert points.shape == (1728, 3)
    assert (points >= 0).all()
    assert (points < 12.0).all()
    assert np.abs(points.mean(axis=0) - 6.0).max() < 4 * 12 / math.sqrt(12 * 1728)


@pytest.mark.parametrize("dimension", [2, 3])
def test_relaxed_random(dimension):
    scene = reduced_scene(dimension, box=sdpd.Box((7.0,) * dimension), start=sdpd.RandomStart())
    points = initial.positions(scene, 1)
    assert (points >= 0).all()
    assert (points < 7.0).all()
    assert not np.array_equal(points, initial.positions(scene, 2))
    np.testing.assert_array_equal(points, initial.positions(scene, 1))
    # even, as no two are close, yet no lattice: the fractions of coordinates are spread
    separation = points[:, None] - points[None]
    separation -= 7.0 * np.round(separation / 7.0)
    distance = np.sqrt((separation**2).sum(axis=-1)) + 7.0 * np.eye(len(points))
    assert distance.min() > 0.4
    assert abs(np.exp(2j * np.pi * points[:, 0]).mean()) < 0.2


def test_velocities():
    scene = water_scene()
    v = initial.velocities(scene, 5)
    assert np.abs(v.sum(axis=0)).max() < 1e-12 * scene.thermal_speed * 3375
    temperature = (v**2).mean(axis=0) / scene.thermal_speed**2
    assert np.abs(temperature - 1).max() < 4 * math.sqrt(2 / 3375)
    zero = water_scene(start=sdpd.LatticeStart(velocities="zero"))
    assert not initial.velocities(zero, 5).any()
    quiet = water_scene(effects=sdpd.Effects(fluctuations=False))
    assert not initial.velocities(quiet, 5).any()
    hot = sdpd.LatticeStart(velocities="thermal")
    quiet = water_scene(effects=sdpd.Effects(fluctuations=False), start=hot)
    assert initial.velocities(quiet, 5).any()


def test_arrays_of_the_user():
    scene = reduced_scene(2)
    points = initial.positions(scene, 0)
    np.testing.assert_allclose(initial.check_positions(scene, points - 12.0), points)
    assert initial.check_velocities(scene, np.zeros((144, 2), np.float32)).dtype == np.float64
    with pytest.raises(ValueError, match=r"`positions` must be an array of shape \(144, 2\)"):
        initial.check_positions(scene, points[:-1])
    points[7] = points[3] + [12.0, 0.0]
    with pytest.raises(ValueError, match="`positions` must be distinct, got particles 3 and 7"):
        initial.check_positions(scene, points)
    with pytest.raises(ValueError, match=r"`velocities` must be finite, got nan at index \(0, 0"):
        initial.check_velocities(scene, np.full((144, 2), np.nan))
