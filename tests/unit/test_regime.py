"""Regime and cost: values against their definitions, words that follow the value, printing."""

import math

import pytest

import sdpd
from sdpd.units import quantity, table


def scene(eta=20.0, **changes):
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=eta,
        temperature=1.0,
        boltzmann_constant=1.0,
        thermal_conductivity=2.0,
        molecular_mass=0.1,
        molecular_diameter=0.3,
    )
    arguments = {
        "fluid": fluid,
        "box": sdpd.Box((12.0, 12.0, 12.0)),
        "resolution": sdpd.Resolution(spacing=1.0),
        **changes,
    }
    return sdpd.Scene(**arguments)


# These flows heat themselves and their fluid cannot: of that the scene warns.
heats = pytest.mark.filterwarnings("ignore::sdpd.RegimeWarning")


@heats
def test_values():
    s = scene(velocity_scale=0.5, length_scale=6.0)
    r = s.regime()
    assert r["Re"] == pytest.approx(0.5 * 6 / 20)
    assert r["Ma"] == pytest.approx(0.5 / s.sound.speed)
    assert r["Pe"] == pytest.approx(0.5 * 6 / s.self_diffusion)
    assert r["v_th/V0"] == pytest.approx(2.0)
    assert r["dT/T"] == pytest.approx(20 * 0.25 / 16)
    assert r["Kn"] == pytest.approx(0.05)
    assert r["Kn_dx"] == pytest.approx(0.3)
    assert r["m/m_mol"] == pytest.approx(10.0)
    assert r["X"] == pytest.approx(s.stiffness)
    assert r["c/v_th"] == pytest.approx(math.sqrt(s.stiffness))
    assert r["Sc"] == pytest.approx(s.schmidt_number)
    assert r["eta*"] == pytest.approx(20.0)
    assert r["dt/tau"] == pytest.approx(s.cost().dt / s.friction_time)
    assert r["X_max/X"] == math.inf
    assert 0.0 < r["sigma_rho"] < 0.1


def test_mapping():
    r = scene().regime()
    assert dict(r) == r.to_dict()
    assert list(r) == r.keys()
    assert len(r) == len(r.rows)
    assert "Re" in r
    assert "nonsense" not in r
    assert r.row("X").name == "stiffness m c^2/kT"
    with pytest.raises(KeyError, match="there are Re, Ma"):
        r["nonsense"]


def test_without_a_flow_it_says_so():
    r = scene().regime()
    assert r["Re"] is None
    assert r.row("Re").meaning == "no flow scale given: set velocity_scale"
    assert "no flow scale given" in str(r)


@heats
@pytest.mark.parametrize(
    ("symbol", "changes", "words"),
    [
        ("Re", {"velocity_scale": 1e-3}, "creeping"),
        ("Re", {"velocity_scale": 10.0}, "laminar"),
        ("Re", {"velocity_scale": 1e4}, "inertia rules"),
        ("Ma", {"velocity_scale": 1.0}, "at most 1 %"),
        ("Ma", {"velocity_scale": 2.0, "sound_speed": 10.0}, "about 4%"),
        ("Ma", {"velocity_scale": 5.0, "sound_speed": 10.0}, "compressible"),
        ("v_th/V0", {"velocity_scale": 1e3}, "invisible"),
        ("v_th/V0", {"velocity_scale": 10.0}, "average a little"),
        ("v_th/V0", {"velocity_scale": 0.1}, "mostly noise: 10 % in the flow takes about 1e+04"),
        ("dT/T", {"velocity_scale": 1e-3}, "isothermal is right"),
        ("dT/T", {"velocity_scale": 1.0}, "an isothermal model is wrong"),
        ("Kn", {"length_scale": 0.5}, "not a continuum"),
        ("X", {"sound_speed": 2.0}, "soft"),
        ("X", {"sound_speed": 100.0}, "stiff"),
        ("eta*", {"eta": 4.0}, "adds a viscosity as large"),
        ("eta*", {"eta": 50.0}, "adds about 5%"),
        ("eta*", {"eta": 1e4}, "is the one asked for"),
        ("Sc", {"eta": 0.1}, "gas-like"),
        ("Sc", {"eta": 100.0}, "liquid-like"),
        ("X_max/X", {}, "do not pair"),
        ("dt/tau", {}, "set by"),
    ],
)
def test_words_follow_the_value(symbol, changes, words):
    changes = {"length_scale": 1.0, **changes}
    assert words in scene(**changes).regime().row(symbol).meaning


def test_pairing_margin_of_lucy():
    resolution = sdpd.Resolution(spacing=1.0, kernel="lucy")
    fluid = scene().fluid.replace(equation_of_state=sdpd.eos.IdealGas())
    row = scene(fluid=fluid, resolution=resolution).regime().row("X_max/X")
    assert row.value == pytest.approx(2.87, rel=0.01)
    assert row.meaning == "stable up to X = 287"


def test_absent_effects_have_no_rows():
    quiet = scene(effects=sdpd.Effects(fluctuations=False, dissipation=False))
    r = quiet.regime()
    assert not {"Sc", "eta*", "dt/tau"} & set(r)
    still = scene(effects=sdpd.Effects(fluctuations=False)).regime()
    assert "sigma_rho" not in still
    assert (
        "crystal"
        in scene(
            effects=sdpd.Effects(fluctuations=False),
            fluid=scene().fluid.replace(equation_of_state=sdpd.eos.IdealGas()),
            resolution=sdpd.Resolution(spacing=1.0, kernel="lucy"),
        )
        .regime()
        .row("X_max/X")
        .meaning
    )


def test_cost():
    s = scene()
    cost = s.cost()
    assert cost.n_particles == 1728
    assert cost.pairs_per_particle == pytest.approx(56.5, abs=0.1)
    assert cost.dt == cost.bounds[0].value == cost.bound.value
    assert cost.steps_per_time == pytest.approx(1 / cost.dt)
    assert cost.seconds_per_time == pytest.approx(cost.seconds_per_step / cost.dt)
    assert 200 < cost.memory / cost.n_particles <= 1600
    for part in ("exact pair splitting", "set by", "2 tau", "acoustic stability", "MB"):
        assert part in str(cost)
    assert s.cost("velocity_verlet", temperature_error=0.01).dt == pytest.approx(
        2 * s.cost("velocity_verlet").dt
    )


def test_units_are_printed_in_the_si_only():
    water = sdpd.Scene(
        fluid=sdpd.fluids.water(),
        box=sdpd.Box((1e-8, 1e-8, 1e-8)),
        resolution=sdpd.Resolution(particles=3375),
    )
    assert " s," in str(water.cost())
    assert "per simulated second" not in str(scene().cost())
    assert quantity(1.0, "m", si=True) == "1 m"
    assert quantity(1.0, "m", si=False) == quantity(1.0, "1", si=True) == "1"


def test_table():
    assert table([]) == ""
    assert table([["a", "b"], ["ccc", "d"]]) == "a    b\nccc  d"
    assert table([["a", "b"]], header=["x", "y"]).splitlines()[0] == "x  y"
