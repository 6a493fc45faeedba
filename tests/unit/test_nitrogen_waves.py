"""Shear waves of equilibrium and shear waves put in."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sdpd
from sdpd import nitrogen
from sdpd.nitrogen.waves import Waves


def scene_of(number: int) -> sdpd.Scene:
    return nitrogen.scene_of(
        nitrogen.CASES[number], kernel="wendland_c2", heat_capacity=2.5, particles=216
    )


def friction_rates(scene: sdpd.Scene, waves: Waves) -> np.ndarray:
    """Decay rates of three lengths of waves by friction in a continuum, written out [1/s]."""
    fluid, h = scene.fluid, scene.support_radius
    across, along = 5.0 * fluid.shear_viscosity / 3.0, 5.0 * fluid.shear_viscosity / 3.0
    r, dr = np.linspace(0.0, h, 2001, retstep=True)
    force = 20.0 * 21.0 / (2.0 * np.pi) / h**5 * (1.0 - r / h) ** 3  # F of Wendland C2
    found = []
    for square in (1, 2, 3):
        k = 2.0 * np.pi / scene.box.lengths[0] * math.sqrt(square)
        x = np.maximum(k * r, 1e-9)
        j0 = np.sin(x) / x
        tilt = (np.sin(x) - x * np.cos(x)) / x**3  # angular mean of e_u^2 cos(k.r)
        shell = across * (1.0 - j0) + along * (1.0 / 3.0 - tilt)
        found.append(np.trapezoid(4.0 * np.pi * r**2 * force * shell, dx=dr) / fluid.density)
    return np.array(found)


def test_waves_that_friction_damps_have_the_viscosity_asked_for() -> None:
    scene = scene_of(5)
    waves = Waves(scene, 0.5 * scene.friction_time)
    assert waves.vectors.shape == (13, 3)
    rates = friction_rates(scene, waves)
    lag = 0.5 * scene.friction_time * np.arange(waves.late_lag + 1.0)
    asked = scene.fluid.shear_viscosity
    functions = [np.exp(-rate * lag) for rate in rates]
    assert waves.viscosity(functions) == pytest.approx(asked, rel=1e-4)
    assert waves.viscosity(functions, 30.0) == pytest.approx(asked, rel=1e-4)
    twice = [np.exp(-2.0 * rate * lag) for rate in rates]
    assert waves.viscosity(twice) == pytest.approx(2.0 * asked, rel=1e-4)
    # an elastic wave swings back: its current has no integral
    swings = [np.exp(-rate * lag) * np.cos(4.0 * rate * lag) - 0.1 for rate in rates]
    assert waves.viscosity(swings, 30.0) == math.inf


def test_the_answer_is_linear() -> None:
    """Waves four times as high are the same waves, and most noise is gone."""
    scene = scene_of(5)
    waves = Waves(scene, sdpd.Simulation(scene, threads=1).dt)
    low, high = (
        waves.put_in(starts=2, equilibration=40, seed=1, speed=speed, threads=1)
        for speed in (0.02, 0.08)
    )
    assert low.viscosity.relative < 0.01
    assert high.viscosity.value == pytest.approx(low.viscosity.value, rel=0.003)
    assert low.viscosity.window is not None and low.growth.window is not None
    assert low.growth.window[1] > 15.0 * low.viscosity.window[1]


def test_waves_of_equilibrium_die_like_waves_put_in() -> None:
    """Onsager's regression, and equipartition of their energy: case 5, 216 particles."""
    scene = scene_of(5)
    sim = sdpd.Simulation(scene, seed=2, threads=1)
    waves = Waves(scene, sim.dt)
    sim.run(steps=200, progress=False)
    observer = sdpd.CurrentCorrelator(
        waves.vectors, every=1, points=2 * (waves.lag // 2 + 1), levels=1
    )
    sim.run(steps=2500, observe=observer, progress=False)
    viscosity, warmth = waves.correlated(observer.correlations(n_blocks=32))
    put_in = waves.put_in(starts=3, equilibration=200, seed=3, threads=1).viscosity
    assert viscosity.relative < 0.02 and put_in.relative < 0.01 and warmth.relative < 0.012
    assert abs(viscosity.z(put_in)) < 4.0
    assert abs(warmth.z(300.0)) < 4.0
