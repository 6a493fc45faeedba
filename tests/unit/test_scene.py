"""Scenes: what they derive, their plain-data behaviour, their invariance and every message."""

import copy
import math
import pickle
import warnings

import numpy as np
import pytest

import sdpd
from sdpd import initial
from sdpd.sound import choose_sound_speed

KB = 1.380649e-23


def water_scene(**changes):
    arguments = {
        "fluid": sdpd.fluids.water(),
        "box": sdpd.Box((1e-8, 1e-8, 1e-8)),
        "resolution": sdpd.Resolution(particles=3375, kernel="lucy", support=2.64),
        **changes,
    }
    return sdpd.Scene(**arguments)


def reduced_scene(dimension=3, eta=20.0, **changes):
    """m = dx = k_B T = 1."""
    fluid = changes.pop("fluid", None) or sdpd.Fluid(
        density=1.0, shear_viscosity=eta, temperature=1.0, boltzmann_constant=1.0
    )
    arguments = {
        "fluid": fluid,
        "box": sdpd.Box((12.0,) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0),
        **changes,
    }
    return sdpd.Scene(**arguments)


class TestDerived:
    def test_particles(self):
        scene = water_scene()
        assert scene.dimension == 3
        assert scene.n_particles == 3375
        assert scene.layout.counts == (15, 15, 15)
        assert scene.spacing == pytest.approx(1e-8 / 15)
        assert scene.support_radius == pytest.approx(2.64e-8 / 15)
        assert scene.particle_mass == pytest.approx(1e-21 / 3375)
        assert scene.pairs_per_particle == pytest.approx(0.5 * 4 / 3 * np.pi * 2.64**3)

    def test_scales(self):
        scene = water_scene()
        assert scene.thermal_energy == pytest.approx(KB * 300)
        assert scene.thermal_speed == pytest.approx(math.sqrt(KB * 300 * 3375 / 1e-21))
        assert scene.sound.speed == pytest.approx(10 * scene.thermal_speed)
        assert scene.stiffness == pytest.approx(100.0)
        assert scene.pressure_number == pytest.approx(0.0, abs=1e-9)
        assert scene.reduced_viscosity == pytest.approx(
            1e-3 * scene.spacing**2 / math.sqrt(scene.particle_mass * KB * 300)
        )

    def test_friction_coefficients(self):
        a, b = (lambda s: (s.friction_across, s.friction_along))(reduced_scene(eta=3.0))
        assert (a, b) == pytest.approx((5.0, 5.0))
        scene = reduced_scene(2, eta=3.0)
        assert (scene.friction_across, scene.friction_along) == pytest.approx((6.0, 0.0))
        fluid = scene.fluid.replace(bulk_viscosity=2.0)
        scene = reduced_scene(2, fluid=fluid)
        assert (scene.friction_across, scene.friction_along) == pytest.approx((4.0, 8.0))
        scene = reduced_scene(3, fluid=fluid)
        assert (scene.friction_across, scene.friction_along) == pytest.approx((3.0, 15.0))

    def test_largest_bulk_viscosity_is_allowed(self):
        fluid = reduced_scene(eta=3.0).fluid.replace(bulk_viscosity=5.0)
        scene = reduced_scene(fluid=fluid)
        assert scene.friction_across == pytest.approx(0.0, abs=1e-12)
        assert scene.friction_across >= 0.0

    def test_central_friction(self):
        for dimension in (2, 3):
            scene = reduced_scene(dimension, eta=3.0, effects=sdpd.Effects(central_friction=True))
            assert scene.friction_across == 0.0
            assert scene.friction_along == pytest.approx(2 * (dimension + 2) * 3.0)
            assert scene.active_effects.effective_bulk_viscosity == pytest.approx(
                3.0 * (1 + 2 / dimension)
            )
            assert scene.core_arguments()["friction"] == "central"

    @pytest.mark.parametrize(
        ("kernel", "dimension", "factor"),
        [("lucy", 3, 3 / 70), ("wendland_c2", 3, 9 / 280), ("quintic_spline", 2, 239 / 8316)],
    )
    def test_self_diffusion_is_the_k_formula(self, kernel, dimension, factor):
        scene = reduced_scene(
            dimension, resolution=sdpd.Resolution(spacing=1.0, support=3.0, kernel=kernel)
        )
        assert scene.self_diffusion_continuum == pytest.approx(factor * 9.0 / 20.0)
        assert scene.self_diffusion == pytest.approx(
            scene.self_diffusion_continuum / scene.factors.friction
        )
        assert scene.schmidt_number == pytest.approx(20.0 / scene.self_diffusion)

    def test_short_time_diffusion_of_the_literature(self):
        # Lucy, eta = 20, h/dx = 2.65: k_B T tau/m = .01505 with the mean-field friction rate
        scene = reduced_scene(resolution=sdpd.Resolution(spacing=1.0, support=2.65, kernel="lucy"))
        assert scene.self_diffusion_continuum == pytest.approx(0.01505, rel=1e-3)

    def test_calibration_divides_the_friction(self):
        plain, calibrated = water_scene(), water_scene(calibrate=True)
        factor = plain.factors.viscosity
        assert factor == pytest.approx(0.991, abs=1e-3)
        assert calibrated.factors == plain.factors
        assert calibrated.friction_across == pytest.approx(plain.friction_across / factor)
        assert calibrated.friction_along == pytest.approx(plain.friction_along / factor)
        assert calibrated.friction_time == pytest.approx(plain.friction_time * factor)

    def test_core_arguments(self):
        scene = water_scene()
        arguments = scene.core_arguments()
        assert arguments["box"] == (1e-8, 1e-8, 1e-8)
        assert arguments["kernel"] == "lucy"
        assert arguments["friction"] == "general"
        assert arguments["eos"] == ("artificial_compressibility", [1000.0, scene.sound.speed])
        assert arguments["mass"] == scene.particle_mass
        assert arguments["support"] == scene.support_radius
        assert arguments["thermal_energy"] == scene.thermal_energy
        off = water_scene(effects=sdpd.Effects(dissipation=False, fluctuations=False))
        assert off.core_arguments()["friction"] == "none"
        assert off.core_arguments()["friction_across"] == 0.0
        assert math.isinf(off.friction_time)


class TestEffects:
    def test_derived(self):
        active = water_scene().active_effects
        assert active.fluctuations
        assert active.dissipation
        assert not (active.bulk_viscosity or active.body_force or active.central_friction)
        inviscid = reduced_scene(eta=0.0)
        assert not inviscid.active_effects.dissipation
        assert not inviscid.active_effects.fluctuations
        assert inviscid.starts_thermal
        bulk = reduced_scene(fluid=reduced_scene().fluid.replace(bulk_viscosity=1.0))
        assert bulk.active_effects.bulk_viscosity

    def test_overridden(self):
        bulky = reduced_scene().fluid.replace(bulk_viscosity=1.0)
        scene = reduced_scene(fluid=bulky, effects=sdpd.Effects(bulk_viscosity=False))
        assert scene.active_effects.effective_bulk_viscosity == 0.0
        quiet = reduced_scene(effects=sdpd.Effects(fluctuations=False))
        assert not quiet.starts_thermal
        assert quiet.density_deviation == 0.0
        force = sdpd.UniformForce((1.0, 0.0, 0.0))
        off = reduced_scene(body_force=force, effects=sdpd.Effects(body_force=False))
        assert not off.active_effects.body_force
        assert off.sound.reason == "largest term: 10 v_th"

    def test_water_with_its_true_bulk_viscosity_can_drop_it(self):
        fluid = sdpd.fluids.water(bulk_viscosity=2.4e-3)
        with pytest.raises(ValueError, match=r"`fluid.bulk_viscosity` must be <= eta \(1 \+ 2/D\)"):
            water_scene(fluid=fluid)
        assert water_scene(fluid=fluid, effects=sdpd.Effects(bulk_viscosity=False))

    def test_printed(self):
        assert str(water_scene().active_effects).startswith("on: fluctuations, dissipation; off:")


class TestSound:
    def test_rule(self):
        given = {
            "thermal_speed": 1.0,
            "kinematic_viscosity": 0.0,
            "flow_speed": None,
            "length_scale": 1.0,
            "peak_force": 0.0,
            "true_speed": None,
        }
        assert choose_sound_speed(**given).reason == "largest term: 10 v_th"
        flow = choose_sound_speed(**{**given, "flow_speed": 2.0})
        assert (flow.speed, flow.reason) == (20.0, "largest term: 10 V0")
        viscous = choose_sound_speed(**{**given, "flow_speed": 2.0, "kinematic_viscosity": 8.0})
        assert viscous.speed == pytest.approx(40.0)
        assert viscous.reason == "largest term: sqrt(nu V0/(L0 delta))"
        force = choose_sound_speed(**{**given, "peak_force": 4.0})
        assert (force.speed, force.reason) == (20.0, "largest term: sqrt(f L0/delta)")
        capped = choose_sound_speed(**{**given, "true_speed": 5.0})
        assert capped.speed == 5.0
        assert capped.reason.startswith("true speed of sound of the fluid, below 10 v_th")
        assert capped.terms == (("10 v_th", 10.0),)

    def test_poiseuille_of_the_dissertation(self):
        # Y 2.54 at delta = .01 gives 3.2e-3 m/s
        terms = dict(
            choose_sound_speed(
                thermal_speed=1.11e-5,
                kinematic_viscosity=1e-6,
                flow_speed=1.25e-5,
                length_scale=1e-3,
                peak_force=1e-4,
                true_speed=1480.0,
            ).terms
        )
        assert max(terms.values()) == pytest.approx(3.2e-3, rel=0.02)

    def test_true_speed_caps_small_particles(self):
        scene = water_scene(
            box=sdpd.Box((3e-9,) * 3), resolution=sdpd.Resolution(particles=1000, support=2.64)
        )
        assert scene.sound.speed == 1480.0
        assert "true speed" in scene.sound.reason

    def test_given(self):
        assert water_scene(sound_speed=700.0).sound.speed == 700.0
        assert water_scene(sound_speed=700.0).sound.reason == "given"

    def test_of_the_equation_of_state(self):
        law = sdpd.eos.Polynomial(coefficients=(0.0, 0.0, 50.0))
        scene = reduced_scene(fluid=reduced_scene().fluid.replace(equation_of_state=law))
        assert scene.sound.speed == pytest.approx(10.0)
        assert scene.sound.reason == "given by the equation of state"
        assert scene.pressure_number == pytest.approx(50.0)
        law = sdpd.eos.IdealGas(sound_speed=7.0)
        scene = reduced_scene(fluid=reduced_scene().fluid.replace(equation_of_state=law))
        assert scene.stiffness == pytest.approx(49.0)

    def test_flow_speed_of_a_shear_wave(self):
        force = sdpd.SinusoidalForce(amplitude=0.2, direction="x", along="z", wavenumber=2)
        scene = reduced_scene(body_force=force)
        assert scene.flow_length == 6.0
        assert scene.flow_speed == pytest.approx(0.2 / (20.0 * (2 * np.pi / 6.0) ** 2))
        assert reduced_scene(velocity_scale=3.0, body_force=force).flow_speed == 3.0
        assert reduced_scene(length_scale=5.0, body_force=force).flow_length == 5.0
        assert reduced_scene().flow_speed is None
        assert reduced_scene().flow_length == 12.0
        along = sdpd.SinusoidalForce(amplitude=0.2, direction="x", along="x")
        assert reduced_scene(body_force=along).flow_speed is None


class TestResolution:
    def test_spacing_and_particles_agree(self):
        a = water_scene(resolution=sdpd.Resolution(spacing=1e-8 / 15))
        b = water_scene(resolution=sdpd.Resolution(particles=(15, 15, 15)))
        assert a.layout == b.layout

    def test_random_start_takes_any_number(self):
        resolution = sdpd.Resolution(particles=3001, support=2.2)
        scene = water_scene(resolution=resolution, start=sdpd.RandomStart())
        assert scene.n_particles == 3001
        assert scene.layout.counts is None
        resolution = sdpd.Resolution(spacing=7.1e-10, support=2.2)
        scene = water_scene(resolution=resolution, start=sdpd.RandomStart())
        assert scene.n_particles == round((1e-8 / 7.1e-10) ** 3)
        assert scene.spacing**3 * scene.n_particles == pytest.approx(1e-24)

    def test_slightly_unequal_lattices_are_allowed(self):
        box = sdpd.Box((1e-3, 3e-4, 1e-3))
        resolution = sdpd.Resolution(particles=np.array([31, 9, 31]), support=2.65)
        scene = water_scene(box=box, resolution=resolution)
        assert scene.n_particles == 31 * 9 * 31


class TestPlainData:
    def test_equality_hash_pickle_copy(self):
        scene = water_scene()
        _ = scene.factors, scene.sound
        same = pickle.loads(pickle.dumps(scene))
        assert same == scene == water_scene() == copy.deepcopy(scene)
        assert hash(same) == hash(scene)
        assert same.factors == scene.factors
        assert water_scene(calibrate=True) != scene

    def test_frozen(self):
        with pytest.raises(AttributeError):
            water_scene().calibrate = True

    def test_replace(self):
        scene = water_scene().replace(sound_speed=500.0)
        assert scene.sound.speed == 500.0
        assert water_scene().sound.speed != 500.0

    def test_repr_evaluates(self):
        scene = water_scene(
            body_force=sdpd.SinusoidalForce(amplitude=1.0), start=sdpd.RandomStart(relax=False)
        )
        names = {**vars(sdpd.eos), **{name: getattr(sdpd, name) for name in ("Scene", "Fluid")}}
        names |= {name: getattr(sdpd, name) for name in ("Box", "Resolution", "Effects")}
        names |= {name: getattr(sdpd, name) for name in ("RandomStart", "SinusoidalForce")}
        assert eval(repr(scene), names) == scene

    def test_print(self):
        text = str(water_scene(body_force=sdpd.UniformForce((1, 2, 3)), calibrate=True))
        for part in ("kg/m^3", "3375", "lucy", "10 v_th", "divided out", "UniformForce", "1e-08 m"):
            assert part in text or part == "1e-08 m"
        assert "kg" not in str(reduced_scene())
        assert "rms fluctuation" in text


def groups(scene):
    """Everything dimensionless that a scene derives."""
    regime = scene.regime().to_dict()
    tau = scene.friction_time
    bounds = {bound.name: bound.value / tau for bound in scene.cost().bounds}
    verlet = {bound.name: bound.value / tau for bound in scene.cost("velocity_verlet").bounds}
    return {
        **{f"regime {key}": value for key, value in regime.items() if value is not None},
        **{f"splitting {key}": value for key, value in bounds.items()},
        **{f"verlet {key}": value for key, value in verlet.items()},
        "density": scene.factors.density,
        "y": scene.pressure_number,
        "c": scene.sound.speed / scene.thermal_speed,
        "a": scene.friction_across / scene.fluid.shear_viscosity,
        "tau": tau * scene.thermal_speed / scene.spacing,
    }


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("law", [sdpd.eos.IdealGas(), sdpd.eos.Tait()])
def test_dimensionless_groups_do_not_depend_on_units(dimension, law):
    """1e-9 m, 0.1 m and reduced units; equal eta*, X, force and flow in units of dx, m, k_B T."""

    def scene(length, mass, energy, boltzmann):
        time = length * math.sqrt(mass / energy)
        fluid = sdpd.Fluid(
            density=mass / length**dimension,
            shear_viscosity=20.0 * mass / length ** (dimension - 2) / time,
            bulk_viscosity=3.0 * mass / length ** (dimension - 2) / time,
            temperature=energy / boltzmann,
            boltzmann_constant=boltzmann,
            mean_free_path=0.1 * length,
            equation_of_state=law,
        )
        return sdpd.Scene(
            fluid=fluid,
            box=sdpd.Box((12 * length,) * dimension),
            resolution=sdpd.Resolution(particles=12**dimension, support=2.5),
            body_force=sdpd.SinusoidalForce(amplitude=0.1 * length / time**2),
            velocity_scale=1.5 * length / time,
        )

    reference = groups(scene(1.0, 1.0, 1.0, 1.0))
    assert len(reference) > 20
    for length, mass in ((1e-9, 1e-24), (0.1, 0.7)):
        found = groups(scene(length, mass, KB * 300, KB))
        assert found.keys() == reference.keys()
        for key, value in reference.items():
            assert found[key] == pytest.approx(value, rel=1e-11, abs=1e-13), key


class TestPairingWarning:
    def fluid(self, law):
        return reduced_scene().fluid.replace(equation_of_state=law)

    def lucy(self, law, x):
        return reduced_scene(
            fluid=self.fluid(law),
            resolution=sdpd.Resolution(spacing=1.0, kernel="lucy"),
            sound_speed=math.sqrt(x),
        )

    @pytest.mark.parametrize(
        "law", [sdpd.eos.IdealGas(), sdpd.eos.Linear(background_pressure=400.0)]
    )
    def test_lucy_beyond_its_limit_warns(self, law):
        with pytest.warns(sdpd.PairingWarning, match=r"its limit X = 28\d.*wendland_c2") as caught:
            scene = self.lucy(law, 400.0)
        assert caught[0].filename == __file__
        assert scene.regime()["X_max/X"] == pytest.approx(287 / 400, rel=0.01)
        assert scene.regime()["sigma_rho"] is None
        assert "particles clump" in str(scene)

    def test_below_the_limit_and_without_one_nothing_is_said(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.lucy(sdpd.eos.IdealGas(), 280.0)
            self.lucy(sdpd.eos.ArtificialCompressibility(), 1e6)
            reduced_scene(fluid=self.fluid(sdpd.eos.IdealGas()), sound_speed=1e4)

    def test_negative_pressure_warns(self):
        law = sdpd.eos.Linear(background_pressure=-200.0)
        with pytest.warns(sdpd.PairingWarning, match="pressure at the mean density is negative"):
            reduced_scene(fluid=self.fluid(law))


class TestInitialState:
    def test_lattice(self):
        points = initial.positions(reduced_scene(2), 0)
        assert points.shape == (144, 2)
        np.testing.assert_allclose(points[:3], [[0.5, 0.5], [0.5, 1.5], [0.5, 2.5]])
        assert len(np.unique(points, axis=0)) == 144

    def test_jitter(self):
        scene = reduced_scene(2, start=sdpd.LatticeStart(jitter=0.2))
        shift = initial.positions(scene, 3) - initial.positions(reduced_scene(2), 3)
        assert 0.15 < np.abs(shift).max() <= 0.2
        np.testing.assert_array_equal(initial.positions(scene, 3), initial.positions(scene, 3))
        assert not np.array_equal(initial.positions(scene, 3), initial.positions(scene, 4))

    def test_poisson(self):
        scene = reduced_scene(start=sdpd.RandomStart(relax=False))
        points = initial.positions(scene, 1)
        assert points.shape == (1728, 3)
        assert (points >= 0).all()
        assert (points < 12.0).all()
        assert np.abs(points.mean(axis=0) - 6.0).max() < 4 * 12 / math.sqrt(12 * 1728)

    def test_velocities(self):
        scene = water_scene()
        v = initial.velocities(scene, 5)
        assert np.abs(v.sum(axis=0)).max() < 1e-12 * scene.thermal_speed * 3375
        temperature = (v**2).mean(axis=0) / scene.thermal_speed**2
        assert np.abs(temperature - 1).max() < 4 * math.sqrt(2 / 3375)
        zero = water_scene(start=sdpd.LatticeStart(velocities="zero"))
        assert not initial.velocities(zero, 5).any()
        quiet = water_scene(effects=sdpd.Effects(fluctuations=False))
        assert not initial.velocities(quiet, 5).any()
        hot = sdpd.LatticeStart(velocities="thermal")
        quiet = water_scene(effects=sdpd.Effects(fluctuations=False), start=hot)
        assert initial.velocities(quiet, 5).any()

    def test_arrays_of_the_user(self):
        scene = reduced_scene(2)
        points = initial.positions(scene, 0)
        np.testing.assert_allclose(initial.check_positions(scene, points - 12.0), points)
        assert initial.check_velocities(scene, np.zeros((144, 2), np.float32)).dtype == np.float64
        with pytest.raises(ValueError, match=r"`positions` must be an array of shape \(144, 2\)"):
            initial.check_positions(scene, points[:-1])
        points[7] = points[3] + [12.0, 0.0]
        with pytest.raises(ValueError, match="`positions` must be distinct, got particles 3 and 7"):
            initial.check_positions(scene, points)
        with pytest.raises(
            ValueError, match=r"`velocities` must be finite, got nan at index \(0, 0"
        ):
            initial.check_velocities(scene, np.full((144, 2), np.nan))


MESSAGES = [
    (
        lambda: sdpd.Box((1.0,)),
        ValueError,
        "`lengths` must have 2 or 3 entries, got 1",
    ),
    (
        lambda: sdpd.Box((1.0, 0.0)),
        ValueError,
        "`lengths[1]` must be finite and > 0, got 0",
    ),
    (
        lambda: sdpd.Box((1.0, 1.0, 1.0), periodic="xy"),
        ValueError,
        "`periodic` must name every axis ('xyz') as walls are not implemented yet, got 'xy' without "
        "'z'",
    ),
    (
        lambda: sdpd.Box((1.0, 1.0), periodic="xyz"),
        ValueError,
        "`periodic` must name axes among 'xy', each once, got 'xyz'",
    ),
    (
        lambda: sdpd.Resolution(),
        ValueError,
        "exactly one of `spacing` and `particles` must be given, got neither",
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, particles=2),
        ValueError,
        "exactly one of `spacing` and `particles` must be given, got both",
    ),
    (
        lambda: sdpd.Resolution(particles=0),
        ValueError,
        "`particles` must be an integer >= 1, got 0",
    ),
    (
        lambda: sdpd.Resolution(particles=(3, 0)),
        ValueError,
        "`particles[1]` must be an integer >= 1, got 0",
    ),
    (
        lambda: sdpd.Resolution(spacing=-1.0),
        ValueError,
        "`spacing` must be finite and > 0, got -1",
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, support=1.0),
        ValueError,
        "`support` must be > 1 (in units of the spacing: particles further apart than h do not "
        "interact), got 1",
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, kernel="gauss"),
        ValueError,
        "`kernel` must be one of 'lucy', 'quintic_spline', 'wendland_c2', 'wendland_c4', got 'gauss'",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=1000, support=6.0)),
        ValueError,
        "`box.lengths` must be >= two supports, 2h = 1.2e-08, on every periodic axis, got 1e-08 along "
        "x (h = 6 x spacing 1e-09); enlarge the box, or lower the spacing or the support",
    ),
    (
        lambda: water_scene(
            box=sdpd.Box((4e-9, 1e-9, 4e-9)), resolution=sdpd.Resolution(particles=(16, 4, 16))
        ),
        ValueError,
        "`box.lengths` must be >= two supports, 2h = 1.5e-09, on every periodic axis, got 1e-09 along "
        "y (h = 3 x spacing 2.5e-10); enlarge the box, or lower the spacing or the support",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=3000)),
        ValueError,
        "`particles` must fill a lattice of about equal spacing in the box, got 3000; 2744 = 14 x 14 "
        "x 14 would fit, or use start=sdpd.RandomStart(), which takes any number",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=(10, 10))),
        ValueError,
        "`particles` must have one count per axis of the box (3), got 2: (10, 10)",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=(10, 10, 20))),
        ValueError,
        "`particles` must give spacings within 10% of each other, got 1e-09 along x, 1e-09 along y, "
        "5e-10 along z",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(spacing=7e-10)),
        ValueError,
        "`spacing` must divide every length of the box for a lattice, got 7e-10 with length 1e-08 "
        "along x (ratio 14.2857); particles=(14, 14, 14) is the nearest lattice, or use "
        "start=sdpd.RandomStart()",
    ),
    (
        lambda: sdpd.LatticeStart(jitter=0.7),
        ValueError,
        "`jitter` must be >= 0 and <= 0.5 (of the spacing), got 0.7",
    ),
    (
        lambda: sdpd.LatticeStart(velocities="hot"),
        ValueError,
        "`velocities` must be one of 'auto', 'thermal', 'zero', got 'hot'",
    ),
    (
        lambda: sdpd.RandomStart(relax=1),
        TypeError,
        "`relax` must be True or False, got 1 of type int",
    ),
    (
        lambda: sdpd.Effects(fluctuations="on"),
        TypeError,
        "`effects.fluctuations` must be True or False, got 'on' of type str",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(dissipation=False, fluctuations=True)),
        ValueError,
        "`effects.fluctuations` must be False without dissipation: the noise balances the friction",
    ),
    (
        lambda: reduced_scene(eta=0.0, effects=sdpd.Effects(dissipation=True)),
        ValueError,
        "`effects.dissipation` must be False as the fluid has no viscosity",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(bulk_viscosity=True)),
        ValueError,
        "`effects.bulk_viscosity` must be False as `fluid.bulk_viscosity` is 0",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(body_force=True)),
        ValueError,
        "`effects.body_force` must be False as the scene has no body force",
    ),
    (
        lambda: reduced_scene(
            eta=3.0, effects=sdpd.Effects(central_friction=True, bulk_viscosity=False)
        ),
        ValueError,
        "`effects.bulk_viscosity` must not be False with central_friction, which implies a bulk "
        "viscosity eta (1 + 2/D) = 5",
    ),
    (
        lambda: reduced_scene(
            fluid=reduced_scene(eta=3.0).fluid.replace(bulk_viscosity=1.0),
            effects=sdpd.Effects(central_friction=True),
        ),
        ValueError,
        "`fluid.bulk_viscosity` must be 0 or eta (1 + 2/D) = 5 with central_friction, which fixes it, "
        "got 1",
    ),
    (
        lambda: reduced_scene(fluid=reduced_scene(eta=3.0).fluid.replace(bulk_viscosity=6.0)),
        ValueError,
        "`fluid.bulk_viscosity` must be <= eta (1 + 2/D) = 5 (so that a >= 0 and the noise exists), "
        "got 6; lower it or set effects=sdpd.Effects(bulk_viscosity=False)",
    ),
    (
        lambda: sdpd.UniformForce((1.0,)),
        ValueError,
        "`acceleration` must have 2 or 3 entries, got 1",
    ),
    (
        lambda: reduced_scene(body_force=sdpd.UniformForce((1.0, 0.0))),
        ValueError,
        "`acceleration` must have 3 entries, as many as the box has axes, got 2",
    ),
    (
        lambda: reduced_scene(2, body_force=sdpd.SinusoidalForce(amplitude=1, along="z")),
        ValueError,
        "`along` must be an axis of the box ('xy'), got 'z'",
    ),
    (
        lambda: sdpd.SinusoidalForce(amplitude=1, wavenumber=0),
        ValueError,
        "`wavenumber` must be an integer >= 1, got 0",
    ),
    (
        lambda: reduced_scene(sound_speed=-1.0),
        ValueError,
        "`sound_speed` must be finite and > 0, got -1",
    ),
    (
        lambda: reduced_scene(velocity_scale=math.nan),
        ValueError,
        "`velocity_scale` must be finite and >= 0, got nan",
    ),
    (
        lambda: reduced_scene(length_scale=0.0),
        ValueError,
        "`length_scale` must be finite and > 0, got 0",
    ),
    (
        lambda: reduced_scene(calibrate=None),
        TypeError,
        "`calibrate` must be True or False, got None of type NoneType",
    ),
    (
        lambda: reduced_scene(
            sound_speed=2.0,
            fluid=reduced_scene().fluid.replace(
                equation_of_state=sdpd.eos.Polynomial(coefficients=(0.0, 1.0))
            ),
        ),
        ValueError,
        "`sound_speed` must be None as the equation of state has its own, got 2",
    ),
    (
        lambda: reduced_scene(
            fluid=reduced_scene().fluid.replace(
                equation_of_state=sdpd.eos.Polynomial(coefficients=(0.0, -1.0))
            )
        ),
        ValueError,
        "`fluid.equation_of_state` must have dP/drho > 0 at the density of the fluid 1, got -1",
    ),
    (
        lambda: reduced_scene(fluid="water"),
        TypeError,
        "`fluid` must be an sdpd.Fluid, e.g. sdpd.fluids.water(), got 'water' of type str",
    ),
    (
        lambda: reduced_scene(box=(1, 2, 3)),
        TypeError,
        "`box` must be an sdpd.Box, got (1, 2, 3) of type tuple",
    ),
    (
        lambda: reduced_scene(resolution=3),
        TypeError,
        "`resolution` must be an sdpd.Resolution, got 3 of type int",
    ),
    (
        lambda: reduced_scene(start="lattice"),
        TypeError,
        "`start` must be an sdpd.LatticeStart or sdpd.RandomStart, got 'lattice' of type str",
    ),
    (
        lambda: reduced_scene(effects={}),
        TypeError,
        "`effects` must be an sdpd.Effects, got {} of type dict",
    ),
    (
        lambda: reduced_scene(body_force=(0, 0, 1)),
        TypeError,
        "`body_force` must be an sdpd.UniformForce or sdpd.SinusoidalForce, got (0, 0, 1) of type "
        "tuple",
    ),
]


@pytest.mark.parametrize(("call", "kind", "text"), MESSAGES)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text
