"""Effects by the regime: decisions, thresholds, settings that win, warnings, files, units."""

import dataclasses

import numpy as np
import pytest

import sdpd
from sdpd import effect_rules

from .scenes import reduced_scene

AIR = sdpd.Fluid(
    density=1.2,
    shear_viscosity=1.8e-5,
    bulk_viscosity=1.1e-5,
    temperature=300.0,
    sound_speed=290.0,
    thermal_conductivity=0.026,
    heat_capacity=718.0,
    viscosity_exponent=0.7,
    conductivity_exponent=0.8,
    molecular_mass=1.380649e-23 * 300.0 / 290.0**2,  # k_B T/c^2
    equation_of_state=sdpd.eos.IdealGas(),
)


EQUAL = sdpd.Isothermal()  # as hot as the fluid


def air_channel(
    *,
    width=1e-4,
    speed=3.0,
    hot=300.0,
    heat=EQUAL,
    fluid=AIR,
    effects="auto",
    **changes,
):
    """Air in a channel in which it flows at some speed, one wall of a temperature of its own."""
    box = sdpd.Box((width, width, width), periodic="xy")
    upper = sdpd.Isothermal(hot) if hot != fluid.temperature else EQUAL
    arguments = {
        "fluid": fluid,
        "box": box,
        "walls": (
            sdpd.Plane(axis="z", at=0.0, heat=heat),
            sdpd.Plane(axis="z", at=width, heat=upper),
        ),
        "resolution": sdpd.Resolution(particles=(10, 10, 10), support=2.6),
        "velocity_scale": speed,
        "effects": effects,
        **changes,
    }
    return sdpd.Scene(**arguments)


def water_box(edge=1e-6, speed=None, effects="auto", **changes):
    arguments = {
        "fluid": sdpd.fluids.water(bulk_viscosity=1e-3),
        "box": sdpd.Box((edge,) * 3),
        "resolution": sdpd.Resolution(particles=1000),
        "velocity_scale": speed,
        "effects": effects,
        **changes,
    }
    return sdpd.Scene(**arguments)


def on(scene):
    active = scene.active_effects
    names = [name for name in effect_rules.ORDER if name != "wall_heat"]
    return {name for name in names if getattr(active, name)}


HOT = {"energy", "variable_transport", "viscous_heating", "conduction"}

# name, scene, effects that must be on; the rest must be off
TABLE = {
    # v_th = 4.7 m/s at 1e-8 m and .0049 m/s at 1e-6 m
    "a drop of water at rest": (lambda: water_box(speed=0.0), {"fluctuations", "bulk_viscosity"}),
    "nanoflow of water": (lambda: water_box(1e-8, 5.0), {"fluctuations", "bulk_viscosity"}),
    "a channel of a millimetre": (lambda: water_box(1e-3, 1e-2, sound_speed=0.2), set()),
    "water nothing is known of": (lambda: water_box(), {"fluctuations", "bulk_viscosity"}),
    "slow air between equal walls": (lambda: air_channel(), set()),
    "slow air, one wall 10 % hotter": (lambda: air_channel(hot=330.0), HOT),
    "slow air, one wall .05 % hotter": (lambda: air_channel(hot=300.15), set()),
    # dT/T = .0014 by friction, .011 by compression: .8 x .011 leaves the coefficients alone
    "air at Ma .24": (
        lambda: air_channel(speed=70.0), {"bulk_viscosity", *HOT} - {"variable_transport"}
    ),
    "air at Ma .86": (lambda: air_channel(speed=250.0), {*HOT, "bulk_viscosity"}),
    "air, adiabatic wall": (
        lambda: air_channel(heat=sdpd.Adiabatic()),
        {"energy", "viscous_heating", "conduction"},
    ),
    # q L/(kappa T) = 1e4 x 1e-4/(.026 x 300) = .13
    "air, heated wall": (lambda: air_channel(heat=sdpd.HeatFlux(1e4)), HOT),
    "the same, a hundredth": (lambda: air_channel(heat=sdpd.HeatFlux(1e2), speed=0.3), {
        "energy", "conduction"
    }),
}  # fmt: skip


@pytest.mark.parametrize("name", TABLE)
def test_table_of_scenes(name):
    make, expected = TABLE[name]
    scene = make()
    assert on(scene) == expected
    decisions = {each.effect: each for each in scene.regime().decisions}
    assert list(decisions) == list(effect_rules.ORDER)
    for effect in on(scene) | expected:
        assert decisions[effect].active
    active = scene.active_effects
    for each in decisions.values():  # what is explained is what acts
        if each.effect != "wall_heat":
            assert each.active == getattr(active, each.effect), each
            assert each.reason.split(": ")[-1].startswith(each.effect.replace("_", " "))


def test_the_thermal_couette_scene_asks_for_what_it_has():
    scene = sdpd.scenes.load("thermal_couette")
    assert scene.replace(effects="auto").active_effects == scene.active_effects


@pytest.mark.parametrize(
    ("effect", "scene", "symbol", "low", "high"),
    [
        ("fluctuations", lambda v: water_box(1e-4, 1.0 / v), "v_th/V0", 1.0, 1e5),
        ("energy", lambda v: air_channel(speed=v), "dT/T", 1.0, 280.0),
        ("energy", lambda v: air_channel(hot=300.0 + v), "dT_w/T", 1e-3, 200.0),
        ("variable_transport", lambda v: air_channel(hot=300.0 + v), "n dT/T", 1e-3, 200.0),
        ("bulk_viscosity", lambda v: air_channel(speed=v), "(zeta/eta) Ma^2", 5.0, 280.0),
        (
            "viscous_heating",
            lambda v: air_channel(
                hot=600.0,
                speed=v,
                fluid=AIR.replace(viscosity_exponent=0.0, conductivity_exponent=0.0),
            ),
            "dT/dT_max",
            3.0,
            250.0,
        ),
        (
            "conduction",
            lambda v: water_box(1e-3, 0.1, effects=sdpd.Effects(auto=True, energy=True),
                                fluid=hot_water(v)),
            "1/Pe_q",
            0.01,
            1e5,
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::sdpd.RegimeWarning")
def test_monotonic_about_the_threshold(effect, scene, symbol, low, high):
    """Off below, on above, with one change where the number passes the threshold."""
    decisions = [scene(v).regime().decision(effect) for v in np.geomspace(low, high, 25)]
    states = [each.active for each in decisions]
    assert states[0] is False and states[-1] is True
    change = states.index(True)
    assert all(states[change:])
    threshold = {each.symbol: each.threshold for each in effect_rules.CRITERIA}[symbol]
    below, above = decisions[change - 1], decisions[change]
    assert (above.symbol, above.threshold) == (symbol, threshold)
    assert below.value < threshold <= above.value < 10.0 * below.value


def hot_water(factor):
    """Water that conducts so many times better."""
    return sdpd.fluids.water().replace(thermal_conductivity=0.58 * factor)


def test_numbers_are_their_definitions():
    scene = air_channel(speed=100.0, hot=330.0, width=2e-4)
    numbers = effect_rules.Numbers(scene)
    assert numbers.noise == pytest.approx(scene.thermal_speed / 100.0)
    assert numbers.wall_difference == pytest.approx(0.1)
    assert numbers.friction_heat == pytest.approx(1.8e-5 * 1e4 / (8 * 0.026 * 300))
    assert numbers.compression_heat == pytest.approx(1e4 / (2 * 718 * 300))
    assert numbers.differences == pytest.approx(0.1)
    assert numbers.coefficient_change == pytest.approx(0.08)
    assert numbers.heating_share == pytest.approx(numbers.friction_heat / 0.1)
    assert numbers.heat_spreading == pytest.approx(0.026 / (1.2 * 718 * 100 * 2e-4))
    assert numbers.bulk_stress == pytest.approx(1.1 / 1.8 * (100 / 290) ** 2)
    soft = water_box(speed=1.0, sound_speed=10.0)  # Ma is that of water, not of the soft fluid
    assert effect_rules.Numbers(soft).bulk_stress == pytest.approx((1.0 / 1480.0) ** 2)
    assert numbers.sound_damping(False) == 0.0
    assert numbers.sound_damping(True) == pytest.approx(1.1 / (1.8 * 4 / 3 + 1.1))
    # a gas that heats up by (gamma - 1) Ma^2/2, with Ma by the adiabatic speed of sound
    gamma = 1.0 + 290.0**2 / 300.0 / 718.0
    mach = 100.0 / (290.0 * gamma**0.5)
    assert numbers.compression_heat == pytest.approx((gamma - 1) * gamma * mach**2 / 2, rel=1e-6)


def test_expansion_of_a_table_is_that_of_its_gas():
    r, c_v = 290.0**2 / 300.0, 718.0
    table = sdpd.eos.EnergyTable.from_helmholtz(
        lambda rho, t: r * t * np.log(rho) - c_v * t * (np.log(t) - 1.0),
        densities=(0.5, 2.0),
        temperatures=(200.0, 500.0),
    )
    fluid = AIR.replace(equation_of_state=table)
    assert fluid.equation_of_state.expansion(fluid) == pytest.approx(1.0 / 300.0, rel=1e-4)
    assert AIR.equation_of_state.expansion(AIR) == pytest.approx(1.0 / 300.0)


# --- who decides ------------------------------------------------------------------------------


def test_without_a_flow_it_says_so_and_stays_as_derived():
    scene = water_box()
    row = scene.regime().decision("fluctuations")
    assert row.called is None and row.active and row.origin == "derived" and row.value is None
    assert row.reason == (
        "thermal speed / flow speed unknown, as velocity_scale is not given: fluctuations on, as "
        "derived"
    )
    assert not scene.regime().decision("energy").active
    # what is known suffices where it calls: the wall alone decides
    assert on(air_channel(speed=None, hot=330.0)) >= {"energy", "conduction", "variable_transport"}


def test_what_the_scene_lacks_is_off():
    bare = reduced_scene(velocity_scale=0.1, effects="auto")
    assert on(bare) == {"fluctuations"}
    reasons = {each.effect: each for each in bare.regime().decisions}
    assert reasons["bulk_viscosity"].origin == "absent"
    assert "the fluid has none" in reasons["bulk_viscosity"].reason
    assert "the fluid has no heat capacity" in reasons["energy"].reason
    assert "no walls" in reasons["wall_heat"].reason


@pytest.mark.filterwarnings("ignore::sdpd.RegimeWarning")
@pytest.mark.parametrize("value", [True, False])
@pytest.mark.parametrize("effect", ["fluctuations", "energy", "bulk_viscosity"])
def test_explicit_settings_win(effect, value):
    for speed in (1.0, 250.0):
        scene = air_channel(speed=speed, effects=sdpd.Effects(auto=True, **{effect: value}))
        assert getattr(scene.active_effects, effect) is value
        decision = scene.regime().decision(effect)
        assert decision.origin == "set" and decision.active is value
        assert decision.reason.endswith("as set")
    # and a part of energy brings it along
    for name in ("conduction", "viscous_heating", "variable_transport"):
        part = air_channel(speed=1.0, effects=sdpd.Effects(auto=True, **{name: True}))
        assert part.active_effects.energy and getattr(part.active_effects, name)


def test_the_central_form_has_a_bulk_viscosity():
    for auto in (True, False):
        scene = reduced_scene(
            velocity_scale=0.1, effects=sdpd.Effects(auto=auto, central_friction=True)
        )
        decision = scene.regime().decision("bulk_viscosity")
        assert decision.active and scene.active_effects.bulk_viscosity
        assert decision.reason == "the central form of the friction has one: bulk viscosity on"


def test_a_fluid_without_friction_has_nothing_to_be_warned_of():
    ideal = sdpd.Fluid(density=1.0, shear_viscosity=0.0, temperature=1.0, boltzmann_constant=1.0)
    for effects in ("auto", sdpd.Effects()):
        scene = reduced_scene(fluid=ideal, velocity_scale=0.1, effects=effects)
        assert on(scene) == set()
        assert "no friction" in scene.regime().decision("bulk_viscosity").reason


def test_heat_into_a_fluid_that_cannot_conduct_is_not_ignored():
    scene = air_channel(
        fluid=AIR.replace(thermal_conductivity=None), heat=sdpd.HeatFlux(1e-3), speed=0.3
    )
    assert scene.active_effects.energy
    assert scene.regime().decision("energy").value == np.inf


@pytest.mark.filterwarnings("ignore::sdpd.RegimeWarning")
def test_particles_too_small_for_a_temperature_get_none():
    small = air_channel(speed=250.0, width=1e-8)
    assert small.heat_capacity_number < 1.0 and not small.active_effects.energy
    reason = small.regime().decision("energy").reason
    assert reason.endswith("but a particle has a heat capacity of k_B at most: energy off")
    with pytest.raises(ValueError, match=r"`fluid.heat_capacity` must be above k_B a particle"):
        air_channel(speed=250.0, width=1e-8, effects=sdpd.Effects(auto=True, energy=True))


def test_negligible_wall_heat_is_left_out_but_never_ignored():
    slight = air_channel(hot=300.15)
    assert not slight.active_effects.energy
    assert "thermal" not in slight.core_arguments()
    # derived, heat through a wall always needs an energy
    assert air_channel(hot=300.15, effects=sdpd.Effects()).active_effects.energy
    cold = AIR.replace(heat_capacity=None)
    with pytest.raises(ValueError, match=r"`fluid.heat_capacity` is None"):
        air_channel(hot=330.0, fluid=cold)
    assert not air_channel(hot=300.15, fluid=cold).active_effects.energy


# --- warnings ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (  # the flow heats itself, and nobody has asked for an energy
            lambda: air_channel(speed=250.0, effects=sdpd.Effects()),
            r"heating by friction / T = 0\.018, at least 0\.001, yet energy off, as derived; temp",
        ),
        (
            lambda: air_channel(speed=250.0, effects=sdpd.Effects(energy=False)),
            "energy off, as set",
        ),
        (
            lambda: air_channel(speed=250.0, fluid=AIR.replace(heat_capacity=None)),
            "but the fluid has no heat capacity: energy off",
        ),
        (
            lambda: air_channel(hot=400.0, effects=sdpd.Effects(variable_transport=False)),
            "variable transport off, as set; viscosity and conductivity should follow",
        ),
        (
            lambda: air_channel(
                speed=250.0, effects=sdpd.Effects(energy=True, bulk_viscosity=False)
            ),
            r"bulk stress / shear stress = 0\.45, at least 0\.01: bulk viscosity off, as set",
        ),
        (
            lambda: water_box(1e-8, 5.0, sdpd.Effects(auto=True, fluctuations=False)),
            "fluctuations off, as set; what thermal noise does to the flow is missing",
        ),
        (
            lambda: water_box(1e-3, 1e-2, sdpd.Effects(auto=True, fluctuations=True)),
            "fluctuations on, as set; it costs time",
        ),
        (
            lambda: air_channel(effects=sdpd.Effects(auto=True, energy=True)),
            "energy on, as set; it costs time",
        ),
    ],
)
def test_a_setting_that_contradicts_the_regime_warns(scene, words):
    with pytest.warns(sdpd.RegimeWarning, match=words) as caught:
        scene()
    assert __file__ in [each.filename for each in caught]


def test_no_warning_without_reason():
    # noise left out on purpose, near a threshold, in what ships, and by the regime itself
    water_box(1e-8, 5.0, sdpd.Effects(fluctuations=False, bulk_viscosity=False), sound_speed=1e3)
    air_channel(speed=100.0, effects=sdpd.Effects())  # dT/T = .0029
    for name in ("poiseuille", "couette", "thermal_couette"):
        sdpd.scenes.load(name).replace(effects="auto")
    for make, _ in TABLE.values():
        make()


def test_decisions_of_a_derived_scene_tell_what_acts():
    for name in ("poiseuille", "thermal_couette"):
        scene = sdpd.scenes.load(name)
        for each in scene.regime().decisions:
            if each.effect != "wall_heat":
                assert each.active == getattr(scene.active_effects, each.effect)
            assert each.origin != "regime"
    noise = sdpd.scenes.load("poiseuille").regime().decision("fluctuations")
    assert noise.called and not noise.active
    assert noise.reason == (
        "thermal speed / flow speed = 0.88, at least 0.01: fluctuations off, as set"
    )


# --- forms ------------------------------------------------------------------------------------


def test_forms_of_auto():
    assert water_box().effects == sdpd.Effects(auto=True)
    assert sdpd.Effects().auto is False
    with pytest.raises(ValueError, match=r"`effects` must be 'auto' .*, got 'autom"):
        water_box(effects="automatic")
    with pytest.raises(TypeError, match=r"`effects.auto` must be True or False, got 1"):
        sdpd.Effects(auto=1)
    with pytest.raises(KeyError, match="there are fluctuations, wall_heat"):
        water_box().regime().decision("noise")


@pytest.mark.parametrize(
    "effects", ["auto", sdpd.Effects(auto=True, fluctuations=True), sdpd.Effects()]
)
def test_files(effects):
    scene = water_box(speed=1e-4, effects=effects)
    text = scene.to_toml()
    assert sdpd.Scene.from_toml(text) == scene
    assert ('effects = "auto"' in text) == (effects == "auto")
    assert ("auto = true" in text) == (effects == sdpd.Effects(auto=True, fluctuations=True))
    assert "auto = false" not in text
    with pytest.raises(ValueError, match=r"`effects` must be 'auto' .*, got 'all'"):
        sdpd.Scene.from_toml('effects = "all"\n' + water_box(effects=sdpd.Effects()).to_toml()
                             .replace("[effects]\ncentral_friction = false\n", ""))  # fmt: skip


def test_printed():
    scene = air_channel(hot=330.0)
    assert "(by the regime)" in str(scene)
    assert "(by the regime)" not in str(air_channel(effects=sdpd.Effects()))
    text = str(scene.regime())
    assert "effect              is   by      why" in text
    line = next(row for row in text.splitlines() if row.startswith("energy"))
    assert line.split()[1:3] == ["on", "regime"]
    assert "temperature difference of walls / T = 0.1, at least 0.001: energy on" in line


def test_units_do_not_matter():
    """The same air with the width, T, k_B and the mass of a particle as units."""
    for speed, hot in ((3.0, 300.0), (100.0, 300.0), (250.0, 330.0), (3.0, 330.0)):
        scene = air_channel(speed=speed, hot=hot)
        length, temperature = 1e-4, 300.0
        mass, k = scene.particle_mass, AIR.boltzmann_constant
        velocity = (k * temperature / mass) ** 0.5
        time = length / velocity
        viscosity = mass / length / time
        fluid = dataclasses.replace(
            AIR,
            density=1.2 / (mass / length**3),
            shear_viscosity=1.8e-5 / viscosity,
            bulk_viscosity=1.1e-5 / viscosity,
            temperature=1.0,
            boltzmann_constant=1.0,
            sound_speed=290.0 / velocity,
            thermal_conductivity=0.026 / (k * length**-1 / time),
            heat_capacity=718.0 / (k / mass),
            molecular_mass=AIR.molecular_mass / mass,
        )
        reduced = air_channel(width=1.0, speed=speed / velocity, hot=hot / temperature, fluid=fluid)
        assert on(reduced) == on(scene)
        for mine, other in zip(scene.regime().decisions, reduced.regime().decisions, strict=True):
            assert mine.reason == other.reason
            if mine.value is not None:
                assert mine.value == pytest.approx(other.value, rel=1e-9)


def test_settled_effects_set_all_that_acts():
    for scene in (air_channel(hot=330.0), water_box(1e-8, 5.0), air_channel()):
        fixed = scene.replace(effects=scene.settled_effects)
        assert not fixed.effects.auto
        assert fixed.active_effects == scene.active_effects
    derived = water_box(effects=sdpd.Effects())
    assert derived.settled_effects is derived.effects


def test_a_checkpoint_keeps_it(tmp_path):
    scene = water_box(1e-8, 5.0, resolution=sdpd.Resolution(particles=216))
    sim = sdpd.Simulation(scene, seed=1, threads=1)
    sim.run(2, progress=False)
    sim.save(tmp_path / "a.sdpd")
    again = sdpd.load(tmp_path / "a.sdpd")
    assert again.scene == scene and again.scene.effects.auto
    set_by_hand = sdpd.Simulation(scene.replace(effects=scene.settled_effects), seed=1, threads=1)
    set_by_hand.run(2, progress=False)
    assert np.array_equal(again.positions, set_by_hand.positions)
