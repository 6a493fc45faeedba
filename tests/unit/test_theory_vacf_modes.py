"""VACF by the waves of a box: a plain sum, the asymptotic tail, arguments."""

import math

import numpy as np
import pytest

from sdpd import theory


def theories(dimension=3, **more):
    same = {"dimension": dimension, "density": 1.0, "shear_viscosity": 1.5, **more}
    fluid = theory.HydrodynamicTheory(**same, sound_speed=4.0)
    return fluid, theory.FrictionTheory(**same, kernel="lucy", support=2.2)


def modes(time, dimension=3, edge=12.0, **more):
    fluid, friction = theories(dimension)
    return theory.vacf_modes(
        time,
        fluid=fluid,
        friction=friction,
        thermal_energy=1.0,
        self_diffusion=0.2,
        box=(edge,) * dimension,
        **more,
    )


def test_against_a_plain_sum():
    fluid, friction = theories(2)
    time, box = 0.7, (6.0, 8.0)
    expected = 0.0
    for a in range(-30, 31):
        for b in range(-40, 41):
            k = 2.0 * math.pi * math.hypot(a / box[0], b / box[1])
            if k == 0.0:
                continue
            across, _ = friction.plane_wave_rates(k)
            # the longitudinal damping follows the transverse ratio in this approximation
            damping = float(across) * fluid.sound_damping / fluid.kinematic_viscosity
            root = np.sqrt(complex((4.0 * k) ** 2 - damping**2))
            even = np.exp(-damping * time) * np.cos(root * time)
            odd = np.exp(-damping * time) * np.sin(root * time) / root
            wave = math.exp(-float(across) * time) + (even - damping * odd).real
            expected += math.exp(-0.2 * k**2 * time) * wave
    found = theory.vacf_modes(
        time, fluid=fluid, friction=friction, thermal_energy=1.0, self_diffusion=0.2, box=box
    )
    assert float(found) == pytest.approx(expected / 48.0 / 2.0, rel=1e-6)


def test_ends_as_the_tail_of_the_box():
    fluid, _ = theories()
    time = np.array([16.0, 30.0])
    tail = theory.vacf_tail(
        time, fluid=fluid, thermal_energy=1.0, self_diffusion=0.2, box=(32.0,) * 3, sound=True
    )
    assert modes(time, edge=32.0) == pytest.approx(tail, rel=0.025)
    assert float(modes(1.0, edge=24.0)) > 1.05 * float(
        theory.vacf_tail(1.0, fluid=fluid, thermal_energy=1.0, self_diffusion=0.2)
    )


def test_momentum_of_the_box():
    closed, free = modes(2.0), modes(2.0, at_rest=False)
    assert float(free - closed) == pytest.approx(12.0**-3)


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="`time` must be finite and > 0"):
        modes(0.0)
    with pytest.raises(ValueError, match="`time` must be longer"):
        modes(1e-4)
    fluid, friction = theories()
    with pytest.raises(ValueError, match="`box`"):
        theory.vacf_modes(
            1.0,
            fluid=fluid,
            friction=friction,
            thermal_energy=1.0,
            self_diffusion=0.2,
            box=(1.0, 1.0),
        )
