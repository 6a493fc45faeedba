"""Scenes in TOML: exact round trips, shorthand, and errors that name the key."""

import sys

import pytest

import sdpd

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SHORT = """
[fluid]
preset = "water"
temperature = 310.0

[box]
lengths = [1e-8, 1e-8, 1e-8]

[resolution]
particles = 3375
"""


def scene(**changes):
    arguments = {
        "fluid": sdpd.fluids.water(temperature=293.15, properties="measured"),
        "box": sdpd.Box((1e-8, 1e-8, 1e-8)),
        "resolution": sdpd.Resolution(particles=3375),
        **changes,
    }
    return sdpd.Scene(**arguments)


LAWS = [
    sdpd.eos.ArtificialCompressibility(),
    sdpd.eos.Linear(background_pressure=1e7 / 3),
    sdpd.eos.Tait(exponent=7.15, background_pressure=1e5),
    sdpd.eos.IdealGas(sound_speed=1000 / 3),
    sdpd.eos.Polynomial(coefficients=(0.1, 1e5, 3.0)),
    sdpd.eos.Table(densities=(900.0, 1100.0), pressures=(0.0, 1e8)),
]


@pytest.mark.parametrize("law", LAWS, ids=[law.kind for law in LAWS])
def test_round_trip_of_equations_of_state(law):
    one = scene(fluid=sdpd.fluids.water().replace(equation_of_state=law))
    assert sdpd.Scene.from_toml(one.to_toml()) == one


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"resolution": sdpd.Resolution(spacing=1e-8 / 15, support=2.64, kernel="lucy")},
        {"resolution": sdpd.Resolution(particles=(15, 15, 15))},
        {"start": sdpd.RandomStart(relax=False, velocities="zero")},
        {"start": sdpd.LatticeStart(jitter=0.1)},
        {"effects": sdpd.Effects(fluctuations=False, central_friction=True)},
        {"body_force": sdpd.UniformForce((1e9 / 3, 0.0, 0.0))},
        {"body_force": sdpd.SinusoidalForce(amplitude=1e9, along="z", wavenumber=2)},
        {"sound_speed": 700 / 3, "velocity_scale": 1.0, "length_scale": 2e-9, "calibrate": True},
    ],
)
def test_round_trip(changes):
    one = scene(**changes)
    assert sdpd.Scene.from_toml(one.to_toml()) == one


def test_two_dimensions():
    one = scene(
        fluid=sdpd.fluids.nitrogen().in_plane(1e-7),
        box=sdpd.Box((2e-6, 1e-6)),
        resolution=sdpd.Resolution(particles=(40, 20)),
    )
    assert sdpd.Scene.from_toml(one.to_toml()) == one


def test_file(tmp_path):
    path = tmp_path / "water.toml"
    text = scene().to_toml(path)
    assert path.read_text(encoding="utf-8") == text
    assert sdpd.Scene.from_toml(path) == sdpd.Scene.from_toml(str(path)) == scene()
    assert tomllib.loads(text)["box"]["periodic"] == "xyz"


def test_shorthand():
    one = sdpd.Scene.from_toml(SHORT)
    assert one == scene(fluid=sdpd.fluids.water(310.0))
    more = SHORT.replace("310.0", '310.0\nproperties = "measured"\nshear_viscosity = 2e-3')
    fluid = sdpd.fluids.water(310.0, properties="measured").replace(shear_viscosity=2e-3)
    assert sdpd.Scene.from_toml(more).fluid == fluid
    law = SHORT + '\n[fluid.equation_of_state]\nkind = "tait"\n'
    assert sdpd.Scene.from_toml(law).fluid.equation_of_state == sdpd.eos.Tait()


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("a = ", ValueError, "not a TOML file: "),
        (SHORT.replace("[box]", "[bax]"), ValueError, "`bax` is not a known key; expected one of"),
        (SHORT.replace("lengths", "length"), ValueError, "`box.length` is not a known key"),
        (SHORT.replace("lengths", "length"), ValueError, "did you mean 'lengths'?"),
        ("[fluid]\npreset='water'\n[resolution]\nspacing=1", ValueError, "`box` is missing"),
        (
            SHORT.replace("temperature", "temprature"),
            ValueError,
            "`fluid.temprature` is not a known",
        ),
        (SHORT.replace("310.0", "-1.0"), ValueError, "`fluid.temperature` must be finite and > 0"),
        (SHORT.replace("310.0", '"hot"'), TypeError, "`fluid.temperature` must be a number"),
        (SHORT.replace("water", "wine"), ValueError, "`fluid.preset` must be one of 'water'"),
        (SHORT.replace('preset = "water"\n', ""), ValueError, "`fluid.density` is missing"),
        (
            SHORT.replace('preset = "water"', 'properties = "measured"'),
            ValueError,
            "`fluid.properties` needs `fluid.preset`",
        ),
        (
            SHORT.replace("310.0", "310.0\npressure = 1.0"),
            ValueError,
            "`fluid.preset` 'water': ",
        ),
        (SHORT.replace("3375", "0"), ValueError, "`resolution.particles` must be an integer >= 1"),
        (
            SHORT.replace("3375", "true"),
            TypeError,
            "`resolution.particles` must be an integer >= 1",
        ),
        (
            SHORT + "kernel = 'lucyy'\n",
            ValueError,
            "`resolution.kernel` must be one of 'lucy'",
        ),
        (
            SHORT + "spacing = 1.0\n",
            ValueError,
            "resolution: exactly one of `spacing` and `particles`",
        ),
        (SHORT + "[start]\njitter = 0.1\n", ValueError, "`start.kind` is missing; expected one of"),
        (SHORT + "[start]\nkind = 'grid'\n", ValueError, "`start.kind` must be one of 'lattice'"),
        (
            SHORT + "[start]\nkind = 'lattice'\njitter = 2.0\n",
            ValueError,
            "`start.jitter` must be >= 0 and <= 0.5",
        ),
        (
            SHORT + "[effects]\nfluctuations = 1\n",
            TypeError,
            "`effects.fluctuations` must be True or False",
        ),
        (
            SHORT + "[body_force]\nkind = 'uniform'\n",
            ValueError,
            "`body_force.acceleration` is missing",
        ),
        (
            SHORT + "[fluid.equation_of_state]\nkind = 'foam'\n",
            ValueError,
            "`fluid.equation_of_state.kind` must be one of",
        ),
        (
            SHORT + "[fluid.equation_of_state]\nkind = 'tait'\nexponent = -1\n",
            ValueError,
            "`fluid.equation_of_state.exponent` must be > 1",
        ),
        ("start = 3\n" + SHORT, TypeError, "`start` must be a table, got 3"),
        ("effects = 3\n" + SHORT, TypeError, "`effects` must be a table, got 3"),
        (SHORT.replace("[fluid]", "[fluid]\nequation_of_state = 3"), TypeError, "must be a table"),
        ("fluid = 3\n[box]\n[resolution]\n", TypeError, "`fluid` must be a table, got 3"),
        ("format = 2\n" + SHORT, ValueError, "`format` must be 1, got 2"),
        ("calibrate = 1\n" + SHORT, TypeError, "`calibrate` must be True or False"),
    ],
)
def test_messages_name_the_key(text, kind, message):
    with pytest.raises(kind) as caught:
        sdpd.Scene.from_toml(text)
    assert message in str(caught.value)


def test_missing_file_and_wrong_source(tmp_path):
    with pytest.raises(FileNotFoundError):
        sdpd.Scene.from_toml(tmp_path / "none.toml")
    with pytest.raises(TypeError, match="`source` must be a str"):
        sdpd.Scene.from_toml(3)


def test_a_preset_in_a_plane():
    short = SHORT.replace("310.0", "310.0\nthickness = 2e-9").replace(
        "1e-8, 1e-8, 1e-8", "1e-8, 1e-8"
    )
    one = sdpd.Scene.from_toml(short.replace("3375", "400"))
    assert one.fluid == sdpd.fluids.water(310.0).in_plane(2e-9)
    with pytest.raises(ValueError, match=r"`fluid\.thickness` must be finite and > 0"):
        sdpd.Scene.from_toml(short.replace("2e-9", "-2e-9"))


class MyForce(sdpd.UniformForce):
    pass


class MyGas(sdpd.eos.IdealGas):
    pass


class MyStart(sdpd.LatticeStart):
    pass


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        (lambda: {"body_force": MyForce((1.0, 0.0, 0.0))}, "body_force"),
        (
            lambda: {"fluid": sdpd.fluids.argon().replace(equation_of_state=MyGas())},
            "fluid.equation_of_state",
        ),
        (lambda: {"start": MyStart()}, "start"),
    ],
)
def test_classes_of_the_user_cannot_be_written(changes, where, tmp_path):
    one = scene(**changes())
    with pytest.raises(TypeError, match=rf"^`{where}` must be of a built-in class \(.*\) to be"):
        one.to_toml()
    target = tmp_path / "mine.sdpd"
    with pytest.raises(TypeError, match="to be written to TOML, got an object of the class My"):
        sdpd.Simulation(one, threads=1).save(target)
    assert not list(tmp_path.iterdir())
