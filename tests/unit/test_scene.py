"""Scenes: what they derive, their plain-data behaviour and their invariance."""

import copy
import math
import pickle
import warnings

import numpy as np
import pytest

import sdpd
from sdpd import cost
from sdpd.effects import BodyForce
from sdpd.initial import Start
from sdpd.integrators import Integrator
from sdpd.sound import choose_sound_speed

from .scenes import reduced_scene, water_scene

KB = 1.380649e-23


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
        assert arguments["body_force"] is None
        force = sdpd.SinusoidalForce(amplitude=2.0, direction="y", along="z", wavenumber=2)
        assert water_scene(body_force=force).core_arguments()["body_force"] == ([0, 2.0, 0], (2, 2))
        uniform = sdpd.UniformForce((1, 2, 3))
        assert water_scene(body_force=uniform).core_arguments()["body_force"] == ([1, 2, 3], None)
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
        kinds = ("RandomStart", "SinusoidalForce", "SymmetricImages")
        names |= {name: getattr(sdpd, name) for name in kinds}
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
        assert caught[0].filename.endswith("scenes.py")  # the caller, not the package
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


class TestDimension:
    def test_a_fluid_of_three_dimensions_is_refused_in_a_plane(self):
        flat = {"box": sdpd.Box((1e-8, 1e-8)), "resolution": sdpd.Resolution(particles=100)}
        with pytest.raises(ValueError, match=r"Fluid\.in_plane\(thickness\)") as caught:
            water_scene(**flat)
        assert str(caught.value).startswith("`fluid` must have the constants of 2 dimensions")
        layer = water_scene(fluid=sdpd.fluids.water().in_plane(1e-9), **flat)
        assert layer.particle_mass == pytest.approx(1000.0 * 1e-9 * 1e-16 / 100)
        assert layer.to_toml().count("dimension = 2") == 1
        assert sdpd.Scene.from_toml(layer.to_toml()) == layer

    def test_a_plane_is_refused_in_space(self):
        with pytest.raises(ValueError, match=r"before Fluid\.in_plane\(thickness\)"):
            water_scene(fluid=sdpd.fluids.water().in_plane(1e-9))

    def test_a_fluid_that_does_not_say_is_not_checked(self):
        fluid = sdpd.Fluid(density=1.0, shear_viscosity=20.0, temperature=1.0)
        assert fluid.dimension is None
        for dimension in (2, 3):
            assert reduced_scene(dimension, fluid=fluid).dimension == dimension


class TestResolutionWarning:
    @staticmethod
    def few(support, **changes):
        resolution = sdpd.Resolution(particles=512, kernel="wendland_c4", support=support)
        return water_scene(resolution=resolution, **changes)

    def test_too_few_neighbours(self):
        with pytest.warns(sdpd.ResolutionWarning) as caught:
            scene = self.few(1.6)
        factors, text = scene.factors, str(caught[0].message)
        assert f"d/n = {factors.density:.4g}" in text
        assert f"eta_eff/eta = {factors.viscosity:.4g}" in text
        assert caught[0].filename == __file__.replace("test_scene", "scenes")
        self.few(3.0)

    def test_viscosity_does_not_matter_where_there_is_none(self):
        with pytest.warns(sdpd.ResolutionWarning, match="eta_eff"):
            self.few(2.1)
        self.few(2.1, effects=sdpd.Effects(dissipation=False, fluctuations=False))

    def test_calibration_of_nothing_is_refused(self):
        with pytest.raises(ValueError, match="`calibrate` must be False where eta_eff/eta <"):
            self.few(1.3, calibrate=True)
        with pytest.warns(sdpd.ResolutionWarning):
            assert self.few(2.1, calibrate=True).calibration < 0.8

    def test_short_waves(self):
        def driven(waves, **changes):
            force = sdpd.SinusoidalForce(amplitude=1.0, wavenumber=waves)
            return reduced_scene(body_force=force, **changes)

        driven(2)  # 6 spacings, two supports
        with pytest.warns(sdpd.ResolutionWarning, match=r"`body_force`, 4, is shorter than two"):
            driven(3)
        with pytest.raises(ValueError, match=r"`body_force.wavenumber` must leave a wavelength"):
            driven(7)
        driven(7, effects=sdpd.Effects(body_force=False))


@pytest.mark.parametrize(
    "call",
    [
        lambda: reduced_scene(resolution=sdpd.Resolution(spacing=1e-300)),
        lambda: reduced_scene(resolution=sdpd.Resolution(spacing=5e-324)),
        lambda: reduced_scene(resolution=sdpd.Resolution(particles=(10**12,) * 3)),
        lambda: sdpd.Resolution(particles=10**5000),
        lambda: sdpd.Resolution(spacing=10**400),
        lambda: sdpd.Box((1e-150,) * 3),
        lambda: sdpd.Box((1e150,) * 3),
        lambda: reduced_scene(
            box=sdpd.Box((1e-100,) * 3), resolution=sdpd.Resolution(particles=8**3)
        ),
        lambda: water_scene(fluid=sdpd.fluids.water(1e-300)).regime(),
        lambda: water_scene(fluid=sdpd.fluids.water(1e-310)),
        lambda: water_scene(sound_speed=1e200),
        lambda: sdpd.SinusoidalForce(amplitude=1.0, wavenumber=2**40),
        lambda: sdpd.VelocityVerlet(iterations=2**40),
        lambda: sdpd.VelocityVerlet(iterations=1001),
        lambda: sdpd.RandomStart(relax_steps=2**33),
        lambda: sdpd.RandomStart(relax_steps=10**6 + 1),
        lambda: sdpd.RandomStart(relax=False, relax_steps=3),
        lambda: sdpd.Correlator(points=2**70),
        lambda: sdpd.Thermodynamics(every=2**70),
    ],
)
def test_magnitudes_are_values(call):
    with pytest.raises(ValueError):
        call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: reduced_scene(start=Start()),
        lambda: reduced_scene(body_force=BodyForce()),
        lambda: reduced_scene().fluid.replace(equation_of_state=sdpd.eos.EquationOfState()),
        lambda: reduced_scene().cost(Integrator()),
    ],
)
def test_bases_are_refused(call):
    with pytest.raises(TypeError):
        call()


def test_a_random_start_relaxes_for_200_steps_unless_told():
    assert sdpd.RandomStart().relax_steps == 200
    assert sdpd.RandomStart(relax=False).relax_steps is None


@pytest.mark.parametrize(
    ("particles", "support", "hints"),
    [
        (1001, 2.64, ["1000 = 10 x 10 x 10 would fit", "sdpd.RandomStart()"]),
        (200, 2.64, ["216 = 6 x 6 x 6 would fit", "sdpd.RandomStart()"]),
        (200, 2.95, ["216 = 6 x 6 x 6 would fit"]),  # 200 leave less than two supports
        (220, 3.01, ["sdpd.RandomStart()"]),  # and so do 216
        (60, 3.0, []),
    ],
)
def test_only_what_is_allowed_is_proposed(particles, support, hints):
    resolution = sdpd.Resolution(particles=particles, support=support)
    with pytest.raises(ValueError, match="must fill a lattice") as caught:
        water_scene(resolution=resolution)
    text = str(caught.value)
    for hint in ("would fit", "sdpd.RandomStart()"):
        assert (hint in text) == any(hint in wanted for wanted in hints), text
    for hint in hints:
        assert hint in text
    if "would fit" in text:
        water_scene(
            resolution=sdpd.Resolution(particles=216 if particles < 300 else 1000, support=support)
        )


def test_no_lattice_is_proposed_that_is_too_small():
    with pytest.raises(ValueError, match="must divide every length") as caught:
        water_scene(resolution=sdpd.Resolution(spacing=2.1e-9))
    assert "nearest" not in str(caught.value) and "RandomStart" not in str(caught.value)


class TestCost:
    @pytest.mark.parametrize("integrator", ["pair_splitting", "velocity_verlet"])
    @pytest.mark.parametrize(
        "changes",
        [
            {},
            {"effects": sdpd.Effects(fluctuations=False)},
            {
                "start": sdpd.RandomStart(relax_steps=5),
                "resolution": sdpd.Resolution(particles=4001),
            },
            {"velocity_scale": 30.0, "effects": sdpd.Effects(fluctuations=False)},
            {"fluid": sdpd.fluids.water().replace(shear_viscosity=0.0)},
        ],
    )
    @pytest.mark.parametrize("precision", ["double", "mixed"])
    def test_margin_and_memory_are_those_of_the_core(self, precision, integrator, changes):
        scene = water_scene(**changes)
        estimate = scene.cost(integrator, precision=precision)
        assert estimate.precision == precision and f"precision   {precision}" in str(estimate)
        sim = sdpd.Simulation(scene, integrator=integrator, precision=precision, threads=1)
        sim.run(steps=3)
        found = sim.statistics()
        assert cost.margin(scene, sim.dt, sim.integrator) == pytest.approx(
            found["margin"], rel=1e-9
        )
        assert estimate.memory == pytest.approx(
            found["list_bytes"] + found["state_bytes"], rel=0.25
        )

    def test_margin_in_a_plane(self):
        scene = reduced_scene(2)
        sim = sdpd.Simulation(scene, threads=1)
        found = sim.statistics()
        assert cost.widths(scene, sim.dt, sim.integrator) == pytest.approx(
            (found["margin"], found["skin"]), rel=1e-9
        )

    def test_iterations_take_memory_and_uniform_variates_less_time(self):
        scene = water_scene()
        plain, again, normal = (
            scene.cost(sdpd.VelocityVerlet(**options))
            for options in ({}, {"iterations": 1}, {"noise": "gaussian"})
        )
        margins = [
            cost.margin(scene, one.dt, sdpd.VelocityVerlet()) / scene.support_radius
            for one in (plain, again)
        ]
        listed = [8.4 * scene.pairs_per_particle * (1.0 + margin) ** 3 for margin in margins]
        more = (again.memory - plain.memory) / scene.n_particles
        assert more - listed[1] + listed[0] == pytest.approx(64.0)
        assert normal.seconds_per_step / plain.seconds_per_step == pytest.approx(16.0 / 13.0)

    @pytest.mark.parametrize(
        ("dimension", "eta", "clustered"), [(2, 500.0, False), (3, 20.0, False), (3, 500.0, True)]
    )
    def test_mixed_precision_takes_memory_and_less_time(self, dimension, eta, clustered):
        scene = reduced_scene(dimension, eta)
        double, mixed = (
            scene.cost("velocity_verlet", precision=kind) for kind in ("double", "mixed")
        )
        assert scene.cost("velocity_verlet").precision == "double"
        assert mixed.seconds_per_step / double.seconds_per_step == pytest.approx(1.6 / 2.4)
        more = (mixed.memory - double.memory) / scene.n_particles
        sim = sdpd.Simulation(scene, integrator="velocity_verlet", precision="mixed", threads=1)
        margin = sim.statistics()["margin"] / scene.support_radius
        assert clustered == (dimension == 3 and margin <= 0.15)
        pairs = scene.pairs_per_particle * (1.0 + margin) ** 3
        assert more == pytest.approx(40.0 + (60.0 + pairs) * clustered)

    @pytest.mark.parametrize(
        ("precision", "energy", "message"),
        [
            ("half", False, "`precision` must be one of 'double', 'mixed', got 'half'"),
            ("mixed", True, "`precision` must be 'double' for a fluid with an energy"),
        ],
    )
    def test_a_precision_that_there_is_not(self, precision, energy, message):
        fluid = sdpd.fluids.water().replace(equation_of_state=sdpd.eos.Tait())
        scene = water_scene(fluid=fluid, effects=sdpd.Effects(energy=energy))
        with pytest.raises(ValueError, match=message):
            scene.cost(precision=precision)
