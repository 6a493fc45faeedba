"""Mode coupling: sums over wave vectors one by one, literature's constant, closed forms."""

import math

import numpy as np
import pytest

from sdpd import theory

TIME = np.array([0.02, 0.3, 2.0, 9.0])
BOXES = {2: (5.0, 7.0), 3: (5.0, 6.0, 7.0)}


def fluid(dimension):
    return theory.HydrodynamicTheory(
        dimension=dimension,
        density=1.3,
        shear_viscosity=1.7,
        bulk_viscosity=0.4,
        sound_speed=30.0,
    )


def wave_vectors(box, limit):
    reach = [int(limit * edge / (2.0 * math.pi)) + 1 for edge in box]
    axes = [2.0 * math.pi / e * np.arange(-n, n + 1) for n, e in zip(reach, box, strict=True)]
    k = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(box))
    length = np.linalg.norm(k, axis=1)
    return length[length > 1e-9]


@pytest.mark.parametrize("dimension", [2, 3])
def test_box_tail_equals_the_sum_over_its_modes(dimension):
    f, box = fluid(dimension), BOXES[dimension]
    k = wave_vectors(box, 40.0)
    nu, spread, scale = f.kinematic_viscosity, 0.2, 0.9 / f.density / np.prod(box) / dimension
    shear = np.array([np.sum(np.exp(-(nu + spread) * k**2 * t)) for t in TIME])
    arguments = {"fluid": f, "thermal_energy": 0.9, "self_diffusion": spread, "box": box}
    ours = theory.vacf_tail(TIME, **arguments)
    assert ours == pytest.approx(scale * (dimension - 1) * shear, rel=1e-10)
    late = TIME[1:]  # overdamped waves are gone
    values, counts = np.unique(np.round(k[k < 15.0], 9), return_counts=True)
    waves = [
        float(f.longitudinal(q, t)) * math.exp(-spread * q**2 * t) for t in late for q in values
    ]
    sound = np.array(waves).reshape(late.size, -1) @ counts
    both = theory.vacf_tail(late, sound=True, **arguments)
    assert both - ours[1:] == pytest.approx(scale * sound, rel=1e-6, abs=1e-12)
    assert np.abs(sound).max() * scale > 1e-4


@pytest.mark.parametrize("dimension", [2, 3])
def test_large_box_has_the_tail_of_an_infinite_fluid(dimension):
    f = fluid(dimension)
    free = theory.vacf_tail(TIME, fluid=f, thermal_energy=0.9)
    exact = (dimension - 1.0) / dimension * 0.9 / f.density
    exact *= (4.0 * math.pi * f.kinematic_viscosity * TIME) ** (-dimension / 2.0)
    assert free == pytest.approx(exact)
    box = theory.vacf_tail(TIME, fluid=f, thermal_energy=0.9, box=(400.0,) * dimension)
    assert box == pytest.approx(free, rel=1e-3)
    early = theory.vacf_tail(TIME[0], fluid=f, thermal_energy=0.9, box=(40.0,) * dimension)
    assert early.shape == ()
    assert early == pytest.approx(free[0], rel=1e-3)


def test_late_times_are_those_of_the_slowest_mode():
    f, edge = fluid(3), 5.0
    tail = theory.vacf_tail([60.0], fluid=f, thermal_energy=1.0, box=(edge,) * 3)
    rate = f.kinematic_viscosity * (2.0 * math.pi / edge) ** 2
    mode = 6.0 * 2.0 / 3.0 / f.density / edge**3 * math.exp(-60.0 * rate)
    assert tail == pytest.approx([mode], rel=1e-9)


@pytest.mark.parametrize("edge", [1.0, 3e-9])
def test_cube_has_the_constant_of_the_literature(edge):
    """2.837297, Dünweg and Kremer (1993), Yeh and Hummer (2004)."""
    missing = theory.finite_size_diffusion(
        box=(edge,) * 3, thermal_energy=4e-21, shear_viscosity=8e-4
    )
    assert missing * 6.0 * math.pi * 8e-4 * edge / 4e-21 == pytest.approx(2.837297, abs=6e-7)


@pytest.mark.parametrize("dimension", [2, 3])
def test_finite_size_is_the_integral_of_the_tails(dimension):
    """D = int C dt: that of the large box less that of the small one."""
    from scipy import integrate

    f = fluid(dimension)
    small, large = BOXES[dimension], tuple(2.3 * edge for edge in BOXES[dimension])

    def difference(t):
        arguments = {"fluid": f, "thermal_energy": 0.9, "self_diffusion": 0.2}
        less, more = (float(theory.vacf_tail(t, box=box, **arguments)) for box in (small, large))
        return more - less

    exact = sum(
        integrate.quad(difference, a, b, epsrel=1e-9)[0]
        for a, b in ((1e-9, 1.0), (1.0, 10.0), (10.0, 200.0))
    )
    ours = theory.finite_size_diffusion(
        box=small,
        reference_box=large,
        thermal_energy=0.9,
        shear_viscosity=f.shear_viscosity,
        schmidt_number=f.kinematic_viscosity / 0.2,
    )
    assert ours == pytest.approx(exact, rel=1e-6)


def test_growth_with_the_box():
    arguments = {"thermal_energy": 1.0, "shear_viscosity": 1.0}
    plane = theory.finite_size_diffusion(box=(1.0, 1.0), reference_box=(8.0, 8.0), **arguments)
    assert plane == pytest.approx(math.log(8.0) / (4.0 * math.pi), rel=1e-9)
    cube = theory.finite_size_diffusion(box=(1.0,) * 3, **arguments)
    part = theory.finite_size_diffusion(box=(1.0,) * 3, reference_box=(100.0,) * 3, **arguments)
    assert part == pytest.approx(0.99 * cube, rel=1e-9)
    rod = theory.finite_size_diffusion(box=(1.0, 1.0, 40.0), **arguments)
    assert rod < 0.0 < cube  # along the rod particles move faster than in an infinite fluid


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda f: theory.vacf_tail(0.0, fluid=f, thermal_energy=1.0), "`time` must be finite"),
        (lambda f: theory.vacf_tail(1.0, fluid=f, thermal_energy=0.0), "`thermal_energy` must"),
        (
            lambda f: theory.vacf_tail(1.0, fluid=f, thermal_energy=1.0, sound=True),
            "`sound` needs a `box`",
        ),
        (
            lambda f: theory.vacf_tail(
                1e-4, fluid=f, thermal_energy=1.0, box=(9.0,) * 3, sound=True
            ),
            "`time` must be later",
        ),
        (
            lambda f: theory.vacf_tail(1.0, fluid=f, thermal_energy=1.0, box=(1.0, 1.0)),
            "`box` must be a sequence of 3",
        ),
        (
            lambda f: theory.finite_size_diffusion(
                box=(1.0, 1.0), thermal_energy=1.0, shear_viscosity=1.0
            ),
            "`reference_box` must be given in 2D",
        ),
        (
            lambda f: theory.finite_size_diffusion(
                box=(1.0,), thermal_energy=1.0, shear_viscosity=1.0
            ),
            "`box` must have 2 or 3",
        ),
        (
            lambda f: theory.finite_size_diffusion(
                box=(1.0,) * 3, thermal_energy=1.0, shear_viscosity=1.0, schmidt_number=0.0
            ),
            "`schmidt_number` must be > 0",
        ),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call(fluid(3))
