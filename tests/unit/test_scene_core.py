"""What a scene derives on the lattice is what the compiled core has there."""

import numpy as np
import pytest

import sdpd
from sdpd import _core, initial

from .scenes import reduced_scene


def core_of(scene, **changes):
    arguments = {
        **scene.core_arguments(),
        "noise": "gaussian",
        "integrator": "pair_splitting",
        "iterations": 0,
        "dt": 1e-3,
        "seed": 1,
        "skin": None,
        "threads": 1,
        **changes,
    }
    return _core.Core(initial.positions(scene, 1), initial.velocities(scene, 1), **arguments)


@pytest.mark.parametrize("central", [False, True])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kernel", sdpd.kernels.names())
def test_density_and_friction_rate_of_the_lattice(kernel, dimension, central):
    fluid = reduced_scene().fluid.replace(bulk_viscosity=0.0 if central else 3.0)
    scene = reduced_scene(
        dimension,
        fluid=fluid,
        box=sdpd.Box((7.0,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel=kernel, support=3.3),
        effects=sdpd.Effects(central_friction=central),
        calibrate=True,
    )
    core = core_of(scene)
    np.testing.assert_allclose(core.number_densities, scene.factors.density, rtol=1e-12)
    assert core.friction_rate() * scene.friction_time == pytest.approx(1.0, rel=1e-12)
    pressure = scene.fluid.equation_of_state.pressure(
        core.densities, reference_density=1.0, sound_speed=scene.sound.speed
    )
    np.testing.assert_allclose(core.pressures, pressure, rtol=1e-10)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_shear_wave_decays_at_the_lattice_rate(dimension):
    """Small step, no noise, no sound: v' = -Lambda(k) v exactly."""
    scene = reduced_scene(
        dimension,
        box=sdpd.Box((8.0,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.64),
        effects=sdpd.Effects(fluctuations=False),
        calibrate=True,
        sound_speed=1e-3,
    )
    core = core_of(scene, noise="none", integrator="velocity_verlet")
    k = np.zeros(dimension)
    k[0] = 2 * np.pi / 8
    wave = np.sin(core.positions @ k)
    core.velocities[:, 1] = 1e-6 * wave
    core.run(100, 1e-4)
    amplitude = 2e6 * float(np.mean(core.velocities[:, 1] * wave))
    rate = sdpd.discretization.lattice_rates(
        "lucy",
        dimension,
        2.64,
        k,
        spacing=1.0,
        across=scene.friction_across,
        along=scene.friction_along,
        mass=1.0,
    )[1, 1]
    assert -np.log(amplitude) / 1e-2 == pytest.approx(rate, rel=1e-3)


@pytest.mark.parametrize(
    "law",
    [sdpd.eos.ArtificialCompressibility(), sdpd.eos.Tait(), sdpd.eos.IdealGas()],
    ids=lambda law: law.kind,
)
def test_sound_is_stable_at_its_stability_bound(law):
    """The explicit limit follows the equation of state; beyond it the same run blows up."""
    fluid = reduced_scene().fluid.replace(equation_of_state=law)
    scene = reduced_scene(
        fluid=fluid, box=sdpd.Box((7.0,) * 3), effects=sdpd.Effects(dissipation=False)
    )
    bounds = {bound.name: bound.value for bound in scene.cost().bounds}
    stable = bounds["acoustic stability"]
    core = core_of(scene, noise="none", integrator="velocity_verlet")
    core.run(400, stable)
    kinetic = float(np.mean(core.velocities**2))
    assert 0.1 < kinetic < 1.0
    core = core_of(scene, noise="none", integrator="velocity_verlet")
    try:
        core.run(400, 1.3 * stable / 0.6)
    except sdpd.SimulationError:
        return
    assert float(np.mean(core.velocities**2)) > 10.0
