"""The conductivity that a fluid delivers: by decay on the lattice, and by an imposed gradient."""

from __future__ import annotations

import pytest

import sdpd
from sdpd import conductivity

from .thermal import fluid, scene


@pytest.mark.parametrize(("kernel", "support"), [("lucy", 2.64), ("wendland_c2", 3.0)])
@pytest.mark.parametrize("dimension", [2, 3])
def test_decay_is_that_of_the_lattice_sum(kernel: str, support: float, dimension: int) -> None:
    made = scene(
        box=sdpd.Box((10.0,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, support=support, kernel=kernel),
    )
    found = conductivity.decay(made)
    assert found.asked == 500.0 and found.dt == pytest.approx(sdpd.Simulation(made).dt)
    assert found.delivered == pytest.approx(found.lattice, rel=0.01)
    short = conductivity.decay(made, dt=0.05 * found.dt, steps=200)
    assert short.delivered == pytest.approx(found.lattice, rel=5e-4)
    # a long wave feels the factor of the discretisation
    long = conductivity.lattice_conductivity(made, 1e-3)
    assert long == pytest.approx(500.0 * made.factors.conductivity, rel=1e-3)


def test_an_imposed_gradient_without_noise_is_the_lattice_too() -> None:
    made = scene(effects=sdpd.Effects(energy=True, fluctuations=False))
    found = conductivity.imposed_gradient(made, times=2.0, n_blocks=4)
    assert found.value == pytest.approx(500.0 * made.factors.conductivity, rel=0.01)


def test_an_imposed_gradient_with_noise() -> None:
    made = scene(fluid(200.0), start=sdpd.RandomStart(relax_steps=50))
    found = conductivity.imposed_gradient(made, difference=0.9, times=5.0)
    assert found.relative < 0.04
    # a fluid that moves delivers what the lattice does, to a few per cent
    assert abs(found.value / (2000.0 * made.factors.conductivity) - 1.0) < 0.03 + 3 * found.relative


def test_bad_arguments_are_named() -> None:
    plain = scene(effects=sdpd.Effects())
    for measure in (conductivity.decay, conductivity.imposed_gradient):
        with pytest.raises(ValueError, match="`scene` must have heat conduction"):
            measure(plain)
    with pytest.raises(ValueError, match="`difference` must be below 1"):
        conductivity.imposed_gradient(scene(), difference=1.5)
    with pytest.raises(ValueError, match="`steps` must be"):
        conductivity.decay(scene(), steps=0)
    with pytest.raises(ValueError, match="`wavenumber` must be"):
        conductivity.lattice_conductivity(scene(), -1.0)
