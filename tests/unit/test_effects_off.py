"""An effect that is off is its coefficient at zero, and no part of the loop that is entered.

Off against a scene that has no such thing: the same bits. Off against on with a coefficient that
goes to zero: a difference in proportion to it (noise: to the square root of k_B T or kappa), down
to rounding. On and at zero at once, which only a body force can be: the same bits.
"""

import numpy as np
import pytest

import sdpd

from . import thermal
from .scenes import reduced_scene
from .sims import INTEGRATORS, assert_same_bits

STEPS, DT = 16, 0.0015
THERMAL_START = sdpd.RandomStart(velocities="thermal")
CHOICES = ("friction", "noise", "exchanges", "integrator", "kernel")  # what the registry goes by


def fluid(**changes):
    constants = {"shear_viscosity": 20.0, "temperature": 1.0, "boltzmann_constant": 1.0}
    return sdpd.Fluid(density=1.0, **{**constants, **changes})


def isothermal(of=None, **changes):
    arguments = {
        "fluid": of or fluid(),
        "box": sdpd.Box((7.0,) * 3),
        "start": THERMAL_START,
        "sound_speed": 10.0,
        **changes,
    }
    return reduced_scene(**arguments)


def with_energy(of=None, *, noise=False, **effects):
    on = sdpd.Effects(energy=True, fluctuations=noise, **effects)
    return thermal.scene(of, edge=7.0, effects=on, start=THERMAL_START)


def ran(scene, integrator="pair_splitting"):
    sim = sdpd.Simulation(scene, integrator=integrator, dt=DT, seed=3, threads=1)
    sim.run(STEPS, progress=False)
    return sim


def away(one, other, name="velocities"):
    """Largest difference over the largest value."""
    mine, its = np.asarray(getattr(one, name)), np.asarray(getattr(other, name))
    return float(np.abs(mine - its).max() / np.abs(its).max())


# --- off against absent -----------------------------------------------------------------------

PUSH = sdpd.UniformForce((1.0, 0.0, 0.0))
BULKY = fluid(bulk_viscosity=20.0)
WARM = fluid(heat_capacity=50.0, thermal_conductivity=500.0)
COOL = thermal.fluid(thermal_conductivity=None)
BENT = thermal.fluid(viscosity_exponent=0.7, conductivity_exponent=0.7)
OFF_AND_ABSENT = {
    "bulk viscosity": (
        isothermal(BULKY, effects=sdpd.Effects(bulk_viscosity=False)),
        isothermal(),
    ),
    "body force": (
        isothermal(body_force=PUSH, effects=sdpd.Effects(body_force=False)),
        isothermal(),
    ),
    "energy": (isothermal(WARM, effects=sdpd.Effects(energy=False)), isothermal()),
    "conduction": (with_energy(conduction=False, noise=True), with_energy(COOL, noise=True)),
    "variable transport": (
        with_energy(BENT, variable_transport=False, noise=True),
        with_energy(noise=True),
    ),
    "friction": (
        isothermal(effects=sdpd.Effects(dissipation=False)),
        isothermal(fluid(shear_viscosity=0.0)),
    ),
}


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("effect", OFF_AND_ABSENT)
def test_off_has_the_bits_and_the_loop_of_absent(effect, integrator):
    off, absent = (ran(scene, integrator) for scene in OFF_AND_ABSENT[effect])
    assert_same_bits(off, absent)
    for name in CHOICES:
        assert off._settings.get(name) == absent._settings.get(name)


def test_the_loop_has_no_more_than_what_is_on():
    """The names by which the registry picks a compiled loop."""

    def chosen(scene):
        settings = sdpd.Simulation(scene, threads=1)._settings
        return settings["friction"], settings["noise"], settings.get("exchanges", "none")

    assert chosen(isothermal()) == ("general", "gaussian", "none")
    quiet = sdpd.Effects(fluctuations=False)
    assert chosen(isothermal(effects=quiet)) == ("general", "none", "none")
    bare = sdpd.Effects(fluctuations=False, dissipation=False)
    assert chosen(isothermal(effects=bare)) == ("none", "none", "none")
    for effects, exchanges in (
        ({}, "full_variable"),
        ({"variable_transport": False}, "full"),
        ({"conduction": False}, "heating_variable"),
        ({"conduction": False, "variable_transport": False}, "heating"),
        ({"viscous_heating": False}, "bath_conduction"),
        ({"viscous_heating": False, "conduction": False}, "bath"),
        ({"dissipation": False, "conduction": False}, "adiabatic"),
        ({"dissipation": False, "variable_transport": False}, "conduction"),
    ):
        assert chosen(with_energy(BENT, **effects))[2] == exchanges
    assert isothermal(BULKY, effects=sdpd.Effects(bulk_viscosity=False)).friction_across == (
        isothermal().friction_across
    )


# --- off against on, with a coefficient that vanishes -----------------------------------------


def assert_in_proportion(differences, coefficients, *, power=1.0, rounding=2e-12):
    """The differences vanish with a power of their coefficients, as they do from the first on."""
    first = differences[0] / coefficients[0] ** power
    assert differences[0] > 100.0 * rounding  # else nothing is tested
    for difference, coefficient in zip(differences, coefficients, strict=True):
        assert difference <= 1.5 * first * coefficient**power + rounding
        assert difference >= first * coefficient**power / 1.5 - rounding


SMALL = (1e-6, 1e-9, 1e-12)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_bulk_viscosity(integrator):
    found = []
    for small in SMALL:
        of = fluid(bulk_viscosity=20.0 * small)
        off = isothermal(of, effects=sdpd.Effects(bulk_viscosity=False))
        found.append(away(ran(isothermal(of), integrator), ran(off, integrator)))
    assert_in_proportion(found, SMALL)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_body_force(integrator):
    still = sdpd.UniformForce((0.0, 0.0, 0.0))
    assert_same_bits(ran(isothermal(body_force=still), integrator), ran(isothermal(), integrator))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_fluctuations(integrator):
    """A driven flow, ever colder: the noise dies out with the root of k_B T."""
    found, temperatures = [], (1e-6, 1e-10, 1e-14)
    for temperature in temperatures:
        scene = isothermal(
            fluid(temperature=temperature),
            start=sdpd.RandomStart(velocities="zero"),
            body_force=sdpd.SinusoidalForce(amplitude=10.0),
        )
        off = scene.replace(effects=sdpd.Effects(fluctuations=False))
        found.append(away(ran(scene, integrator), ran(off, integrator)))
        thermal_share = scene.thermal_speed / np.abs(ran(off, integrator).velocities).max()
        assert 0.3 < found[-1] / thermal_share < 10.0  # of the size of the thermal speed
    assert_in_proportion(found, temperatures, power=0.5)


@pytest.mark.parametrize("noise", [False, True])
def test_conduction(noise):
    found = []
    for small in SMALL:
        of = thermal.fluid(thermal_conductivity=500.0 * small)
        pair = (with_energy(of, noise=noise), with_energy(of, noise=noise, conduction=False))
        found.append(away(*map(ran, pair), "temperatures"))
    assert_in_proportion(found, SMALL, power=0.5 if noise else 1.0)


@pytest.mark.parametrize("noise", [False, True])
def test_variable_transport(noise):
    found = []
    for small in SMALL:
        of = thermal.fluid(viscosity_exponent=small, conductivity_exponent=small)
        pair = (
            with_energy(of, noise=noise),
            with_energy(of, noise=noise, variable_transport=False),
        )
        found.append(away(*map(ran, pair)))
    assert_in_proportion(found, SMALL)


def test_viscous_heating():
    """With an infinite heat capacity friction heats nothing: velocities go as without heating.

    Without noise at any heat capacity, as no temperature enters; with it by k_B/C. The energies
    differ by what friction does, whatever the heat capacity.
    """
    capacities = (1e6, 1e9, 1e12)
    found = []
    for capacity in capacities:
        of = thermal.fluid(capacity, thermal_conductivity=None)
        on, off = ran(with_energy(of)), ran(with_energy(of, viscous_heating=False))
        assert away(on, off) < 1e-14
        heat = capacity * float(np.sum(on.temperatures - off.temperatures))
        lost = _kinetic(of, on, first=True) - _kinetic(of, on)
        assert heat == pytest.approx(lost, rel=0.05 if capacity < 1e12 else 0.1)
        noisy = (with_energy(of, noise=True), with_energy(of, noise=True, viscous_heating=False))
        found.append(away(*map(ran, noisy)))
    assert_in_proportion(found, [1.0 / capacity for capacity in capacities])


def _kinetic(of, sim, *, first=False):
    """Kinetic energy now, or at the start of the same scene."""
    start = sdpd.Simulation(sim.scene, dt=DT, seed=3, threads=1) if first else sim
    return 0.5 * sim.scene.particle_mass * float(np.sum(start.velocities**2))


def test_energy():
    """A liquid without expansion whose energy nothing changes moves as the isothermal one."""
    on = ran(with_energy(COOL))
    off = ran(with_energy(COOL).replace(effects=sdpd.Effects(fluctuations=False)))
    assert away(on, off) < 1e-13
    assert away(on, off, "positions") < 1e-13
