"""Fluids: the values of the sources, and messages."""

import math
import pickle

import pytest

import sdpd
from sdpd import fluids


def make(**changes):
    return sdpd.Fluid(**{"density": 1.0, "shear_viscosity": 2.0, "temperature": 3.0, **changes})


def test_water_of_the_dissertation():
    water = fluids.water()
    assert (water.density, water.shear_viscosity, water.bulk_viscosity) == (1000.0, 1e-3, 0.0)
    assert water.temperature == 300.0
    assert water.boltzmann_constant == 1.380649e-23
    assert water.is_si
    assert "Yang" in water.source
    # (m_A/rho_A)^(1/3), the molecular scale of Y 3.4; Table 7 case 10 has dx/2R = 323
    assert 1e-7 / water.molecular_diameter == pytest.approx(323, rel=0.003)
    assert water.equation_of_state == sdpd.eos.ArtificialCompressibility()


def test_measured_water():
    # independent references: viscosity 1.0016e-3 Pa s at 20 C (ISO/TR 3666), 0.890e-3 at 25 C;
    # conductivity 0.6065 +- 0.0036 W/m/K at 25 C (Ramires et al., J. Phys. Chem. Ref. Data 1995)
    for kelvin, eta in ((293.15, 1.0016e-3), (298.15, 0.890e-3)):
        water = fluids.water(kelvin, properties="measured")
        assert water.shear_viscosity == pytest.approx(eta, rel=1e-3)
    water = fluids.water(298.15, properties="measured")
    assert water.thermal_conductivity == pytest.approx(0.6065, abs=0.0036)
    assert water.density == pytest.approx(997.05, rel=2e-5)
    assert water.sound_speed == pytest.approx(1496.7, rel=1e-4)


def test_nitrogen_and_argon():
    gas = fluids.nitrogen()
    assert (gas.density, gas.shear_viscosity, gas.thermal_conductivity) == (1.184, 1.79e-5, 0.026)
    assert gas.mean_free_path == pytest.approx(6.54e-8, rel=0.05)  # Y Table 1
    assert gas.sound_speed == pytest.approx(math.sqrt(296.8 * 300.0), rel=1e-4)
    assert gas.heat_capacity == pytest.approx(2.5 * 296.8, rel=1e-4)
    measured = fluids.nitrogen(properties="measured")
    assert measured.shear_viscosity == pytest.approx(1.79e-5, rel=0.01)
    assert measured.density == pytest.approx(1.138, rel=1e-3)
    argon = fluids.argon()
    assert argon.shear_viscosity == pytest.approx(2.27e-5, rel=0.02)
    assert argon.thermal_conductivity == pytest.approx(0.0177, rel=0.02)
    assert argon.equation_of_state == sdpd.eos.IdealGas()
    for fluid in (measured, argon):
        assert fluid.source


def test_density_of_a_gas_follows_the_pressure():
    one, two = fluids.argon(), fluids.argon(pressure=2 * 101325.0)
    assert two.density == pytest.approx(2 * one.density)
    assert two.mean_free_path == pytest.approx(0.5 * one.mean_free_path)


def test_fluid_is_plain_data():
    fluid = make(name="mine")
    assert fluid == pickle.loads(pickle.dumps(fluid)) == eval(repr(fluid), vars(sdpd.fluids))
    assert hash(fluid) == hash(make(name="mine"))
    assert fluid.replace(density=5).density == 5.0
    assert fluid.kinematic_viscosity == 2.0
    assert fluid.thermal_energy == pytest.approx(3 * 1.380649e-23)
    with pytest.raises(AttributeError):
        fluid.density = 2.0


def test_print_has_units_only_in_the_si():
    assert "kg/m^3" in str(fluids.water())
    assert "kg" not in str(make(boltzmann_constant=1.0))
    assert "kg/m^2" in fluids.water().describe(2)


def test_in_plane_scales_what_is_per_volume():
    water, layer = fluids.water(), fluids.water().in_plane(2e-9)
    assert layer.density == pytest.approx(2e-9 * water.density)
    assert layer.kinematic_viscosity == pytest.approx(water.kinematic_viscosity)
    assert layer.thermal_conductivity == pytest.approx(2e-9 * water.thermal_conductivity)
    assert make().in_plane(2.0).thermal_conductivity is None


def test_fluids_know_their_dimension():
    presets = (fluids.water(), fluids.nitrogen(), fluids.argon())
    assert [fluid.dimension for fluid in presets] == [3, 3, 3]
    assert fluids.water().in_plane(1e-9).dimension == make().in_plane(1.0).dimension == 2
    assert make().dimension is None
    assert "kg/m^2" in str(fluids.water().in_plane(1e-9))


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (lambda: make(density=0), ValueError, "`density` must be finite and > 0, got 0"),
        (
            lambda: make(shear_viscosity=-1),
            ValueError,
            "`shear_viscosity` must be finite and >= 0, got -1",
        ),
        (
            lambda: make(bulk_viscosity=math.inf),
            ValueError,
            "`bulk_viscosity` must be finite and >= 0, got inf",
        ),
        (
            lambda: make(temperature=None),
            TypeError,
            "`temperature` must be a number (finite and > 0), got None of type NoneType",
        ),
        (
            lambda: make(boltzmann_constant=0),
            ValueError,
            "`boltzmann_constant` must be finite and > 0, got 0",
        ),
        (lambda: make(sound_speed=-3), ValueError, "`sound_speed` must be finite and > 0, got -3"),
        (
            lambda: make(equation_of_state="tait"),
            TypeError,
            "`equation_of_state` must be an equation of state (sdpd.eos), got 'tait' of type str",
        ),
        (lambda: make(name=1), TypeError, "`name` must be a str, got 1 of type int"),
        (
            lambda: fluids.water(properties="real"),
            ValueError,
            "`properties` must be one of 'yang2013', 'measured', got 'real'",
        ),
        (
            lambda: fluids.water(500.0, properties="measured"),
            ValueError,
            (
                "`temperature` must be between 273.15 and 368.15 K, the range of the measured "
                "properties "
                "of liquid water, got 500; build an sdpd.Fluid for other states"
            ),
        ),
        (
            lambda: fluids.nitrogen(pressure=-5.0),
            ValueError,
            "`pressure` must be finite and > 0, got -5",
        ),
        (
            lambda: fluids.nitrogen(pressure=5e5),
            ValueError,
            (
                "`pressure` must be None with properties='yang2013', whose density is a constant, "
                "got 500000; use properties='measured'"
            ),
        ),
        (
            lambda: make(dimension=4),
            ValueError,
            "`dimension` must be an integer <= 3, got 4",
        ),
        (
            lambda: fluids.water().in_plane(1.0).in_plane(1.0),
            ValueError,
            "`dimension` must be 3 or None for in_plane, got 2",
        ),
        (
            lambda: fluids.argon(pressure=-1.0),
            ValueError,
            "`pressure` must be finite and > 0, got -1",
        ),
        (
            lambda: make(equation_of_state=sdpd.eos.Linear(background_pressure=1.0)).in_plane(1.0),
            ValueError,
            (
                "`equation_of_state` must have no constants of its own for in_plane, got "
                "Linear(reference_density=None, sound_speed=None, background_pressure=1.0)"
            ),
        ),
    ],
)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text
