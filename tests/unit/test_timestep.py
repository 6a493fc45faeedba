"""Time step bounds: values, names, which effects bring which, what exceeds them."""

import math

import pytest

import sdpd
from sdpd import timestep
from sdpd.integrators import resolve


def scene(eta=20.0, dimension=3, law=None, **changes):
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=eta,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=law or sdpd.eos.IdealGas(),
    )
    arguments = {
        "fluid": fluid,
        "box": sdpd.Box((12.0,) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.2),
        **changes,
    }
    return sdpd.Scene(**arguments)


def named(*args, **options):
    return {bound.name: bound for bound in timestep.bounds(*args, **options)}


def test_acoustic_limit_of_the_literature():
    # Lucy, h/dx 2.2, X = 100: 2h/(s c) = .119; stable at .08, unstable at .11
    assert timestep.acoustic_limit(scene()) == pytest.approx(0.119, abs=1e-3)
    c2 = sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.2)
    assert timestep.acoustic_limit(scene(resolution=c2, sound_speed=20.0)) == pytest.approx(
        0.0526, abs=1e-4
    )
    found = named(scene())
    assert found["acoustic accuracy"].value == pytest.approx(0.25 * 0.1192, rel=1e-2)
    assert found["acoustic stability"].value == pytest.approx(0.6 * 0.1192, rel=1e-2)
    assert found["acoustic accuracy"].kind == "accuracy"
    assert found["acoustic stability"].kind == "stability"


def test_flow_shortens_the_acoustic_limit():
    still, moving = scene(sound_speed=10.0), scene(sound_speed=10.0, velocity_scale=5.0)
    ratio = timestep.acoustic_limit(moving) / timestep.acoustic_limit(still)
    assert ratio == pytest.approx(10 / 15)


def test_stiffening_laws_are_taken_where_they_are_compressed():
    tait = scene(law=sdpd.eos.Tait(exponent=7, background_pressure=100.0))
    state = tait.compressed_state
    assert state.sound_speed > 1.2 * tait.sound.speed
    assert state.density == pytest.approx(1 + 3 * tait.density_deviation)
    linear = scene(law=sdpd.eos.Linear(background_pressure=100.0))
    assert linear.compressed_state.sound_speed == pytest.approx(10.0)


def test_splitting():
    s = scene()
    found = named(s)
    assert found["friction"].value == pytest.approx(2 * s.friction_time)
    assert found["thermal motion"].value == pytest.approx(0.1)
    assert set(found) == {"acoustic accuracy", "acoustic stability", "friction", "thermal motion"}
    resolved = named(s, resolve_vacf=True)
    assert resolved["velocity autocorrelation"].value == pytest.approx(0.5 * s.friction_time)
    assert "friction" not in resolved


def test_verlet():
    s = scene()
    once = sdpd.VelocityVerlet(iterations=1)
    found = named(s, once)
    tau = s.friction_time
    assert found["temperature accuracy"].value == pytest.approx(tau * 0.005 / 0.27, rel=1e-12)
    wide = named(s, once, temperature_error=0.01)
    assert wide["temperature accuracy"].value == pytest.approx(tau * 0.01 / 0.27, rel=1e-12)
    assert found["viscous stability"].value == pytest.approx(0.03 * 2.2**2 / 20.0)
    assert "velocity autocorrelation" in named(s, "velocity_verlet", resolve_vacf=True)
    plain = named(s, "velocity_verlet")
    assert plain["temperature accuracy"].value > 10.0 * found["temperature accuracy"].value
    often = named(s, sdpd.VelocityVerlet(iterations=5))
    assert often["temperature accuracy"].value < found["temperature accuracy"].value


def test_viscous_stability_follows_the_friction_rate_of_other_kernels():
    # 0.7 of the mean-field tau is .03 h^2 rho/eta for Lucy; a wider margin where tau is shorter
    c4 = sdpd.Resolution(spacing=1.0, kernel="wendland_c4", support=3.3)
    s = scene(resolution=c4, effects=sdpd.Effects(central_friction=True))
    bound = named(s, "velocity_verlet")["viscous stability"]
    assert bound.formula == "0.7 tau"
    assert bound.value == pytest.approx(0.7 * s.friction_time)


def test_body_force():
    s = scene(body_force=sdpd.UniformForce((0.0, 3.0, 4.0)), sound_speed=10.0)
    assert named(s)["body force"].value == pytest.approx(0.25 * math.sqrt(2.2 / 5.0))
    off = scene(
        body_force=sdpd.UniformForce((0.0, 3.0, 4.0)), effects=sdpd.Effects(body_force=False)
    )
    assert "body force" not in named(off)
    assert "body force" not in named(scene(body_force=sdpd.UniformForce((0.0, 0.0, 0.0))))


def test_absent_effects_give_no_bound():
    quiet = scene(effects=sdpd.Effects(fluctuations=False))
    assert set(named(quiet)) == {"acoustic accuracy", "acoustic stability", "viscous stability"}
    assert "temperature accuracy" not in named(quiet)
    bare = scene(effects=sdpd.Effects(fluctuations=False, dissipation=False))
    assert set(named(bare)) == {"acoustic accuracy", "acoustic stability", "thermal motion"}


def test_auto_names_the_smallest():
    s = scene()
    step = timestep.auto_time_step(s)
    assert step.value == min(bound.value for bound in timestep.bounds(s))
    assert step.bound.name == "friction"
    assert timestep.auto_time_step(scene(eta=10.0)).bound.name == "acoustic accuracy"
    assert timestep.auto_time_step(s, "velocity_verlet").bound.name == "temperature accuracy"


def test_check_names_what_is_exceeded():
    s = scene()
    assert timestep.check_time_step(s, timestep.auto_time_step(s).value) == []
    exceeded = timestep.check_time_step(s, 0.11)
    assert exceeded[0].name == "acoustic stability"
    assert {"acoustic accuracy", "thermal motion"} <= {bound.name for bound in exceeded}
    text = timestep.warning_text(0.11, exceeded)
    assert text.startswith("`dt` = 0.11 exceeds acoustic stability (stability) 0.07")
    assert "0.6 x 2h/(s (c + V0))" in text


def test_bounds_print():
    text = str(timestep.bounds(scene(eta=10.0))[0])
    assert text.startswith("acoustic accuracy (accuracy): dt <= 0.02")


def test_expected_errors():
    s = scene(eta=1e3)
    tau = s.friction_time
    found = timestep.expected_errors(s, 3.7 * tau)
    assert found.temperature == 0.0
    assert found.viscosity == pytest.approx(-0.58 / s.factors.partners)
    # Lucy at 2.2 has some 19 partners: the measured neighbours of that table lose 2.7 to 2.8 %.
    assert -0.036 < found.viscosity < -0.026
    assert found.density_variance > 0.0
    once = sdpd.VelocityVerlet(iterations=1)
    verlet = timestep.expected_errors(s, tau * 0.005 / 0.27, once)
    assert verlet.temperature == pytest.approx(-0.005)
    assert verlet.viscosity is None
    assert "temperature -0.50%" in str(verlet)
    bare = scene(effects=sdpd.Effects(fluctuations=False, dissipation=False))
    assert str(timestep.expected_errors(bare, 0.01)) == "none known"


def test_integrators():
    assert resolve(None, fluctuations=True) == sdpd.PairSplitting()
    assert resolve(None, fluctuations=False) == sdpd.VelocityVerlet()
    assert resolve("pair_splitting", fluctuations=False) == sdpd.PairSplitting()
    mine = sdpd.VelocityVerlet(iterations=3, noise="gaussian")
    assert resolve(mine, fluctuations=True) is mine


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (
            lambda: timestep.check_time_step(scene(), -0.1),
            ValueError,
            "`dt` must be finite and > 0, got -0.1",
        ),
        (
            lambda: timestep.expected_errors(scene(), math.nan),
            ValueError,
            "`dt` must be finite and > 0, got nan",
        ),
        (
            lambda: timestep.bounds(scene(), temperature_error=0),
            ValueError,
            "`temperature_error` must be finite and > 0, got 0",
        ),
        (
            lambda: timestep.bounds(scene(), resolve_vacf="yes"),
            TypeError,
            "`resolve_vacf` must be True or False, got 'yes' of type str",
        ),
        (
            lambda: timestep.bounds(scene(), "verlet"),
            ValueError,
            (
                "`integrator` must be one of 'velocity_verlet', 'pair_splitting', got 'verlet'; "
                "did you "
                "mean 'velocity_verlet'?"
            ),
        ),
        (
            lambda: timestep.bounds(scene(), 3),
            TypeError,
            (
                "`integrator` must be sdpd.PairSplitting(), sdpd.VelocityVerlet() or one of "
                "their names, "
                "got 3 of type int"
            ),
        ),
        (
            lambda: sdpd.VelocityVerlet(iterations=-1),
            ValueError,
            "`iterations` must be an integer >= 0, got -1",
        ),
        (
            lambda: sdpd.VelocityVerlet(noise="normal"),
            ValueError,
            "`noise` must be one of 'uniform', 'gaussian', got 'normal'",
        ),
        (
            lambda: sdpd.PairSplitting(noise="uniform"),
            ValueError,
            "`noise` must be one of 'gaussian', got 'uniform'",
        ),
    ],
)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text
