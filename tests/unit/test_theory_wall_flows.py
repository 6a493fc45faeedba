"""Closed forms of flows along walls, and the flow through a cylinder array, by other numbers."""

import math

import numpy as np
import pytest

from sdpd import theory
from sdpd.theory import cylinder_array_drag, cylinder_array_flow

# Sangani and Acrivos (1982), Table 1: F/(eta U) of square arrays by their collocation
SANGANI = {0.05: 15.56, 0.1: 24.83, 0.2: 51.53, 0.3: 102.90, 0.4: 217.89, 0.5: 532.55}


def stokes(fraction, elements=2):
    radius = math.sqrt(fraction / math.pi)
    return cylinder_array_flow(
        length=1.0, radius=radius, acceleration=1e-6, kinematic_viscosity=1.0, elements=elements
    )


def yang(**changes):
    arguments = {"length": 0.1, "radius": 0.02, "acceleration": 1.5e-7, "density": 1000.0}
    return cylinder_array_flow(**{**arguments, "kinematic_viscosity": 1e-6, **changes})


@pytest.mark.parametrize("fraction", SANGANI)
def test_drag_is_that_of_sangani_and_acrivos(fraction):
    drag = 1e-6 / stokes(fraction).mean_velocity
    assert drag == pytest.approx(SANGANI[fraction], rel=3e-4)


def test_the_series_for_dilute_arrays_agrees_to_its_order():
    for fraction, error in ((0.03, 3e-4), (0.1, 1e-3), (0.1257, 2e-3)):
        drag = 1e-6 / stokes(fraction).mean_velocity
        assert cylinder_array_drag(fraction) == pytest.approx(drag, rel=error)
    with pytest.raises(ValueError, match=r"`volume_fraction` must be <= 0\.2, got 0\.4"):
        cylinder_array_drag(0.4)


def test_cylinder_array_converges_with_its_elements():
    points = np.array([[0.0, 0.03], [0.04, 0.01], [0.021, 0.001], [-0.03, 0.0], [0.05, 0.05]])
    fine = yang(elements=3)
    errors = []
    for elements in (1, 2):
        flow = yang(elements=elements)
        velocity = np.abs(flow.velocity(points) - fine.velocity(points)).max()
        pressure = np.abs(flow.pressure(points) - fine.pressure(points)).max()
        errors.append([flow.mean_velocity / fine.mean_velocity - 1.0, velocity, pressure])
        # the force on the wall by its stress, which Galerkin's method does not impose
        errors[-1].append(flow.traction / flow.drag - 1.0)
    one, two = np.abs(errors) / [1.0, 1e-4, 1e-5, 1.0]
    assert np.all(two < 0.3 * one)
    assert two[0] < 1e-6 and two[1] < 2e-4 and two[2] < 2e-3 and two[3] < 1e-3


def test_cylinder_array_flow_solves_the_navier_stokes_equations():
    """By finite differences of what `velocity` and `pressure` return, away from the wall."""
    flow, step = yang(elements=3), 2e-4
    at = np.array([[0.031, 0.012], [-0.012, 0.033], [0.003, 0.028], [0.028, -0.03]])

    def shifted(function, axis, by):
        return function(at + by * np.eye(2)[axis])

    def slope(function, axis):
        return (shifted(function, axis, step) - shifted(function, axis, -step)) / (2.0 * step)

    u = flow.velocity(at)
    gradient = np.stack([slope(flow.velocity, axis) for axis in (0, 1)], axis=1)  # [p, b, a]
    divergence = gradient[:, 0, 0] + gradient[:, 1, 1]
    laplace = sum(
        (shifted(flow.velocity, a, step) - 2.0 * u + shifted(flow.velocity, a, -step)) / step**2
        for a in (0, 1)
    )
    push = np.stack([slope(flow.pressure, axis) for axis in (0, 1)], axis=1) / 1000.0
    inertia = np.einsum("pb,pba->pa", u, gradient)
    residual = inertia + push - 1e-6 * laplace - [1.5e-7, 0.0]
    assert np.abs(residual).max() < 4e-3 * 1.5e-7
    assert np.abs(inertia).max() > 0.02 * 1.5e-7  # inertia is tested, too
    assert np.abs(divergence).max() < 1e-3 * np.abs(gradient).max()
    assert np.abs(flow.velocity([[0.02, 0.0], [0.012, 0.016]])).max() < 1e-15
    assert np.isnan(flow.velocity([0.0, 0.01])).all()
    assert np.isnan(flow.pressure([0.0, 0.01]))
    left, right = flow.velocity([[-0.05, 0.02], [0.05, 0.02]])
    assert left == pytest.approx(right, rel=1e-9)


def test_inertia_raises_the_drag_and_breaks_the_symmetry():
    slow, fast = yang(acceleration=1.5e-12), yang()
    share = fast.mean_velocity / slow.mean_velocity * 1e-5
    assert share == pytest.approx(0.99152, abs=1e-4)
    before, behind = fast.pressure([[-0.02, 0.0], [0.02, 0.0]])
    assert before > 0.0 > behind and before > -behind


def test_cylinder_array_messages():
    with pytest.raises(ValueError, match=r"`radius` must be <= 0\.45 `length`, 0\.045, got 0\.05"):
        yang(radius=0.05)
    with pytest.raises(ValueError, match="`elements` must be an integer >= 1"):
        yang(elements=0)
    with pytest.raises(ValueError, match=r"`points` must have shape \(\.\.\., 2\), got \(3,\)"):
        yang().velocity([0.0, 0.0, 0.0])


def test_duct_velocity_has_the_known_numbers():
    """Square: centre 0.073671, mean 0.035144 f a^2/nu (White, table 3-1); wide: two plates."""
    square = {"acceleration": 2.0, "kinematic_viscosity": 0.5, "width": 3.0, "height": 3.0}
    unit = 2.0 * 9.0 / 0.5
    assert theory.duct_velocity(1.5, 1.5, **square) == pytest.approx(0.0736714 * unit, rel=1e-5)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    x = 1.5 * (1.0 + nodes)
    v = theory.duct_velocity(x[:, None], x, **square)
    mean = 0.25 * weights @ v @ weights
    assert mean == pytest.approx(0.0351443 * unit, rel=1e-5)
    assert np.abs(v - v.T).max() < 1e-6 * v.max()
    wide = theory.duct_velocity(50.0, [0.3, 0.5], **{**square, "width": 100.0, "height": 1.0})
    plates = theory.poiseuille_velocity(
        [0.3, 0.5], math.inf, acceleration=2.0, kinematic_viscosity=0.5, width=1.0
    )
    assert wide == pytest.approx(plates, rel=1e-9)


def test_taylor_couette_velocity_and_torque():
    cell = {"inner_radius": 1.5, "outer_radius": 4.0, "inner_angular_velocity": 2.0}
    cell["outer_angular_velocity"] = -0.5
    ends = theory.taylor_couette_velocity([1.5, 4.0], **cell)
    assert ends == pytest.approx([3.0, -2.0], rel=1e-14)
    r, step = np.array([2.0, 3.0]), 1e-3
    torque = theory.taylor_couette_torque(shear_viscosity=0.7, **cell)
    omega = [theory.taylor_couette_velocity(r + s, **cell) / (r + s) for s in (-step, step)]
    stress = 0.7 * r * (omega[1] - omega[0]) / (2.0 * step)
    # the torque is carried through every radius: -2 pi r^2 sigma
    assert torque == pytest.approx(-2.0 * np.pi * r**2 * stress, rel=1e-6)
    with pytest.raises(ValueError, match="`outer_radius` must be > `inner_radius` = 2, got 1"):
        theory.taylor_couette_velocity(
            1.0, inner_radius=2.0, outer_radius=1.0, inner_angular_velocity=1.0
        )


@pytest.mark.parametrize("width", [math.inf, 1.3])
def test_oscillating_plate_solves_the_diffusion_equation(width):
    plate = {"amplitude": 2.0, "angular_frequency": 5.0, "kinematic_viscosity": 0.6}
    plate["width"] = width
    z, t, step = np.array([0.1, 0.4, 1.0]), 0.37, 1e-4

    def v(dz, dt):
        return theory.oscillating_plate_velocity(z + dz, t + dt, **plate)

    rate = (v(0.0, step) - v(0.0, -step)) / (2.0 * step)
    curvature = (v(step, 0.0) - 2.0 * v(0.0, 0.0) + v(-step, 0.0)) / step**2
    assert rate == pytest.approx(0.6 * curvature, rel=1e-5)
    assert theory.oscillating_plate_velocity(0.0, t, **plate) == pytest.approx(
        2.0 * math.cos(5.0 * t), rel=1e-12
    )
    if width < math.inf:
        assert abs(theory.oscillating_plate_velocity(width, t, **plate)) < 1e-15
