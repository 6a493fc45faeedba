"""A scene with each effect on and off: what is compared, errors, verdicts, forms, the command."""

import json
import math

import numpy as np
import pytest

import sdpd
from sdpd import cli, effects_study
from sdpd.analysis import Estimate
from sdpd.bench.effects import Difference
from sdpd.effects_study import EFFECTS, Change, Comparison, Study, compare_effects
from sdpd.effects_study.observables import BLOCKS, Sampling, direction
from sdpd.effects_study.results import estimate
from sdpd.effects_study.variants import variants

from . import thermal
from .scenes import reduced_scene

BULKY = sdpd.Fluid(
    density=1.0,
    shear_viscosity=20.0,
    bulk_viscosity=20.0,
    temperature=1.0,
    boltzmann_constant=1.0,
)


def plane(**changes):
    """Fluid in two dimensions, 144 particles."""
    return reduced_scene(2, **{"fluid": BULKY, "start": sdpd.RandomStart(), **changes})


def channel(**changes):
    """Layers of a gas between plates, the upper one moving and hotter; no noise."""
    return thermal.slab(
        sdpd.Isothermal(1.0),
        sdpd.Isothermal(1.5),
        of=thermal.gas(viscosity_exponent=0.7),
        speed=1.0,
        **changes,
    )


# --- what is compared -------------------------------------------------------------------------


def test_variants_differ_in_one_effect():
    pairs, left_out = variants(plane(), EFFECTS)
    assert [each.effect for each in pairs] == ["fluctuations", "bulk_viscosity"]
    for each in pairs:
        on, off = each.on.active_effects, each.off.active_effects
        assert getattr(on, each.effect) and not getattr(off, each.effect)
        assert each.own and each.on.active_effects == plane().active_effects
        others = ("fluctuations", "dissipation", "bulk_viscosity", "body_force", "energy")
        assert all(
            getattr(on, name) == getattr(off, name) for name in others if name != each.effect
        )
        assert each.on.sound.speed == each.off.sound.speed
        assert each.integrator == sdpd.PairSplitting()
    assert set(left_out) == set(EFFECTS) - {"fluctuations", "bulk_viscosity"}
    assert "`fluid.heat_capacity` is None" in left_out["energy"]
    assert "has no body force" in left_out["body_force"]


def test_variants_of_a_fluid_with_an_energy():
    scene = thermal.scene(thermal.fluid(viscosity_exponent=0.5))
    pairs, left_out = variants(scene, EFFECTS)
    found = {each.effect: each for each in pairs}
    assert set(left_out) == {"bulk_viscosity", "body_force"}
    assert not found["energy"].off.active_effects.conduction
    # without heating a viscosity cannot follow the temperature: derived anew
    assert not found["viscous_heating"].off.active_effects.variable_transport
    assert found["conduction"].off.active_effects.variable_transport


def test_an_automatic_scene_is_compared_with_what_it_decided():
    scene = plane(velocity_scale=1.0, effects="auto")
    (pair,), _ = variants(scene, ("fluctuations",))
    assert pair.own and pair.on is scene
    assert not pair.off.effects.auto and pair.off.active_effects.bulk_viscosity


def test_a_force_off_leaves_the_fluid_as_it_is():
    """The rule for the speed of sound looks at the force; the comparison must not."""
    scene = plane(body_force=sdpd.SinusoidalForce(amplitude=1e4))
    (pair,), _ = variants(scene, ("body_force",))
    assert pair.off.sound.speed == scene.sound.speed
    bare = scene.replace(effects=sdpd.Effects(body_force=False))
    assert bare.sound.speed < 0.9 * scene.sound.speed


def test_sampling():
    for steps in (16, 17, 40, 255, 256, 1000, 20000):
        plan = Sampling.of(steps)
        assert plan.measured == BLOCKS * plan.per_block * plan.every <= steps // 2 + plan.every
        assert plan.settling % plan.every == 0 and plan.settling >= plan.measured - plan.every
        assert steps - 2 * plan.every < plan.settling + plan.measured <= steps


def test_direction_of_the_flow():
    assert direction(plane()) is None
    assert direction(plane(body_force=sdpd.UniformForce((0.0, -2.0)))) == 1
    assert direction(channel()) == 0
    assert direction(plane(body_force=sdpd.SinusoidalForce(amplitude=1.0, direction="y",
                                                           along="x"))) == 1  # fmt: skip


# --- errors and verdicts ----------------------------------------------------------------------


def test_estimate_of_independent_blocks():
    rng = np.random.default_rng(1)
    z = []
    for _ in range(400):
        found = estimate(rng.normal(size=(4, 8)), noisy=True)
        assert found.n_effective <= 32
        z.append(found.z(0.0))
    # a little wider than needed: only correlations > 0 count
    assert 0.8 < np.std(z) < 1.1


def test_estimate_of_correlated_blocks():
    """Blocks that share half of their value with the next: the error covers the spread."""
    rng = np.random.default_rng(2)
    z = []
    for _ in range(400):
        noise = rng.normal(size=(8, 64))
        for k in range(1, 64):
            noise[:, k] = 0.5 * noise[:, k - 1] + 0.75**0.5 * noise[:, k]
        z.append(estimate(noise, noisy=True).z(0.0))
    assert 0.85 < np.std(z) < 1.15  # it would be 1.73 without


def test_estimate_without_noise():
    blocks = np.array([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]])
    assert estimate(blocks[:1], noisy=False) == Estimate(2.0, 0.0)
    assert estimate(blocks, noisy=False) == Estimate(2.5, 0.5, 2.0)
    assert estimate(np.zeros((2, 8)), noisy=True).stderr == 0.0


def made(*differences):
    """A study of changes that are given."""
    changes = tuple(
        Change(
            observable=f"x{k}",
            unit="K",
            off=Estimate(1.0, 0.1, 32),
            on=Estimate(1.0 + each.value, 0.1, 32),
            difference=each,
        )
        for k, each in enumerate(differences)
    )
    cost = Difference.of("energy", "exact pair splitting", [10.0, 11.0], [20.0, 22.0])
    comparison = Comparison(
        effect="energy",
        own=False,
        noisy=True,
        changes=changes,
        cost=cost,
        dt=0.1,
        steps=10,
        dt_off=0.2,
        dt_on=0.1,
        reason="because",
    )
    return Study(scene=plane(), seeds=(1, 2), comparisons=(comparison,), left_out={}, seconds=1.0)


def test_what_counts_as_a_change():
    study = made(
        Estimate(0.5, 0.1, 32),  # z = 5
        Estimate(0.2, 0.1, 32),  # z = 2: chance, among four
        Estimate(1e-3, 0.0),  # exact
        Estimate(1e-6, 0.0),  # exact, and nothing that anybody would see
    )
    assert study.changed == {"energy": ("x0", "x2")}
    found = study["energy"]
    assert found.ratio == 2.0 and found.time_ratio == 4.0
    assert found.changes[0].z == pytest.approx(5.0)
    assert found.changes[0].relative == pytest.approx(0.5 / 1.5)
    assert found.changes[2].z == math.inf
    rows = study.to_dict()["effects"][0]["changes"]
    assert [row["changed"] for row in rows] == [True, False, True, False]
    assert rows[2]["z"] is None
    text = str(study)
    assert "1 +- 0.1 K" in text and "exact" in text and "because" in text
    with pytest.raises(KeyError, match="there are energy"):
        study["noise"]


# --- runs -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study():
    force = sdpd.SinusoidalForce(amplitude=5.0)
    effects = ("fluctuations", "body_force")
    return compare_effects(
        plane(body_force=force), effects=effects, steps=4000, seeds=3, quick=True, progress=False
    )


def test_noise_makes_the_temperature(study):
    """k_B T = 1 on top of what the flow has, in both."""
    found = {change.observable: change for change in study["fluctuations"].changes}
    kinetic = found["kinetic temperature, flow included"].difference
    assert kinetic.stderr < 0.01
    assert abs(kinetic.z(1.0)) < 4.0
    assert found["Var rho/rho^2"].z > 10.0
    assert "Var rho/rho^2" in study.changed["fluctuations"]


def test_a_force_drives_its_wave(study):
    """Off: no flow. On: the amplitude f/(nu k^2) of the steady wave."""
    wave = next(c for c in study["body_force"].changes if c.observable == "wave of velocity x")
    expected = 5.0 / (20.0 * (2.0 * np.pi / 12.0) ** 2)
    assert abs(wave.off.z(0.0)) < 4.0
    assert wave.difference.stderr < 0.03 * expected
    # the friction of 28 neighbours without order, and a wave of four supports
    assert wave.difference.value == pytest.approx(expected, rel=0.1)
    assert "wave of velocity x" in study.changed["body_force"]


def test_bulk_viscosity_changes_no_equilibrium():
    """Temperature, pressure and densities at rest know of no friction."""
    found = compare_effects(
        plane(), effects=["bulk_viscosity"], steps=4000, seeds=3, quick=True, progress=False
    )
    changes = {change.observable: change for change in found["bulk_viscosity"].changes}
    assert set(changes) == {"kinetic temperature", "pressure", "Var rho/rho^2"}
    assert all(abs(change.z) < 4.0 for change in changes.values())
    assert changes["kinetic temperature"].difference.stderr < 0.01  # of T = 1
    assert changes["Var rho/rho^2"].difference.stderr < 0.03 * changes["Var rho/rho^2"].on.value
    assert found.changed["bulk_viscosity"] == ()


def test_costs_and_forms(study, tmp_path):
    pytest.importorskip("matplotlib")
    for each in study.comparisons:
        assert each.cost.without.median > 0.0 and each.ratio > 0.0
        assert each.dt == min(each.dt_off, each.dt_on)
    assert study.passed
    names = {path.name for path in effects_study.write(study, tmp_path / "a")}
    names.add(effects_study.write_figure(study, tmp_path / "a").name)
    assert names == {"effects.json", "effects.txt", "effects.png"}
    document = json.loads((tmp_path / "a" / "effects.json").read_text())
    assert document["seeds"] == [1, 2, 3]
    assert [each["effect"] for each in document["effects"]] == [
        *("fluctuations", "body_force"),
    ]
    assert document["left_out"] == {}


def test_between_hot_walls_without_noise():
    scene = channel()
    found = compare_effects(
        scene, steps=32, effects=("viscous_heating", "variable_transport"), quick=True,
        progress=False,
    )  # fmt: skip
    names = [change.observable for change in found["viscous_heating"].changes]
    assert names == [
        *("pressure", "Var rho/rho^2", "temperature", "Var T/T^2", "mean velocity x"),
        *("force on wall 0, x", "heat into wall 0", "force on wall 1, x", "heat into wall 1"),
        "velocity x, middle third",
    ]
    for each in found.comparisons:
        assert not each.noisy and each.own
        for change in each.changes:
            assert change.difference.stderr == 0.0
            assert change.off.n_effective == math.inf
    heat = found["viscous_heating"].changes[2]
    assert heat.difference.value > 0.0  # friction heats
    assert "temperature" in found.changed["viscous_heating"]


def test_the_same_seeds_give_the_same_numbers():
    options = {"steps": 32, "effects": ["fluctuations"], "seeds": 2, "quick": True}
    one, other = (compare_effects(plane(), progress=False, **options) for _ in range(2))
    assert one["fluctuations"].changes == other["fluctuations"].changes


# --- the command, and what is refused ---------------------------------------------------------


def test_command(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    path = tmp_path / "plane.toml"
    plane().to_toml(path)
    options = ["--steps", "32", "--seeds", "2", "--quick", "--no-progress"]
    assert cli.main(["effects", str(path), *options, "-o", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "what it changes" in shown and "what it costs" in shown and "not switched" in shown
    assert (tmp_path / "out" / "effects.png").exists()
    assert cli.main(["effects", str(path), "--effects", "noise", "--quick"]) == 2
    assert "`effects` must be one of 'fluctuations'" in capsys.readouterr().err
    assert cli.main(["effects", str(path), "--steps", "3"]) == 2
    assert "`steps` must be >= 16" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"steps": 15}, ValueError, "`steps` must be >= 16"),
        ({"steps": 16, "time": 1.0}, ValueError, "exactly one of `steps` and `time`"),
        ({"time": -1.0}, ValueError, "`time` must be finite and >= 0"),
        ({"seeds": 0}, ValueError, "`seeds` must be an integer >= 1"),
        ({"effects": "energy"}, TypeError, "`effects` must be a sequence of names"),
        ({"effects": ["walls"]}, ValueError, "`effects` must be one of"),
        ({"threads": 0}, ValueError, "`threads` must be an integer >= 1"),
        ({"quick": 1}, TypeError, "`quick` must be True or False"),
    ],
)
def test_refused(options, error, words):
    with pytest.raises(error, match=words):
        compare_effects(plane(), **options)
    with pytest.raises(TypeError, match="`scene` must be an sdpd"):
        compare_effects("plane")


def test_nothing_to_switch():
    still = plane(
        fluid=BULKY.replace(bulk_viscosity=0.0, shear_viscosity=0.0), effects=sdpd.Effects()
    )
    found = compare_effects(still, quick=True, steps=16)
    assert found.comparisons == () and found.changed == {}
    assert "not switched" in str(found) and "what it changes" not in str(found)
