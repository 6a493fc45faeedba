"""Fluids with an energy as users meet them: effects, arrays, accounts, files, errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sdpd
from sdpd import theory

from .thermal import fluid, gas, layers, scene, slab


def test_an_energy_is_there_where_the_scene_calls_for_it() -> None:
    plain = scene(effects=sdpd.Effects())
    assert not plain.active_effects.energy and plain.active_effects.exchanges == "none"
    active = scene().active_effects
    assert active.viscous_heating and active.conduction and not active.variable_transport
    assert active.exchanges == "full"
    walled = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.2)).replace(effects=sdpd.Effects())
    assert walled.active_effects.energy
    powers = fluid(viscosity_exponent=0.7)
    assert scene(powers).active_effects.exchanges == "full_variable"
    names = {
        sdpd.Effects(energy=True, conduction=False): "heating",
        sdpd.Effects(energy=True, viscous_heating=False): "bath_conduction",
        sdpd.Effects(energy=True, viscous_heating=False, conduction=False): "bath",
        sdpd.Effects(energy=True, dissipation=False): "conduction",
        sdpd.Effects(energy=True, dissipation=False, conduction=False): "adiabatic",
    }
    for effects, name in names.items():
        assert scene(effects=effects).active_effects.exchanges == name


@pytest.mark.parametrize(
    ("of", "effects", "message"),
    [
        (fluid(heat_capacity=None), {"energy": True}, "`effects.energy` must be False"),
        (fluid(thermal_conductivity=None), {"energy": True, "conduction": True}, "conduction"),
        (fluid(), {"viscous_heating": True}, "must not be True without energy"),
        (fluid(), {"energy": True, "variable_transport": True}, "variable_transport"),
        (fluid(), {"energy": True, "dissipation": False, "viscous_heating": True}, "dissipation"),
    ],
)
def test_effects_that_contradict_the_fluid_are_refused(of, effects, message) -> None:
    with pytest.raises(ValueError, match=message):
        scene(of, effects=sdpd.Effects(**effects))


def test_walls_and_energy_must_agree() -> None:
    made = slab(sdpd.Isothermal(1.0), sdpd.Adiabatic())
    with pytest.raises(ValueError, match="must not be False where walls"):
        made.replace(effects=sdpd.Effects(energy=False))
    with pytest.raises(ValueError, match="`temperature` must be finite and > 0"):
        sdpd.Isothermal(-3.0)
    with pytest.raises(ValueError, match="must be 0 along the periodic axis x"):
        slab(sdpd.Isothermal(1.0, (0.1, 0.0, 0.0)), sdpd.Adiabatic())
    with pytest.raises(ValueError, match=r"must have 3 entries, got 2"):
        slab(sdpd.Isothermal(1.0, (0.1, 0.0)), sdpd.Adiabatic())
    with pytest.raises(TypeError, match="`heat` must be"):
        sdpd.Plane(axis="z", at=0.0, heat=300.0)


def test_arrays_go_with_the_equation_of_state() -> None:
    sim = sdpd.Simulation(scene(gas(), start=sdpd.RandomStart()), seed=1)
    sim.run(steps=5)
    rho, t = np.asarray(sim.densities), np.asarray(sim.temperatures)
    assert sim.pressures == pytest.approx(100.0 * rho * t, rel=1e-13)
    assert sim.internal_energies == pytest.approx(25.0 * t, rel=1e-13)
    # zero at the density and the temperature of the fluid
    assert sim.entropies == pytest.approx(25.0 * np.log(t) - 100.0 * np.log(rho), abs=1e-10)
    assert sim.internal_energy == pytest.approx(float(sim.internal_energies.sum()))
    assert sim.total_energy == pytest.approx(sim.internal_energy + sim.kinetic_energy)
    assert sim.entropy == pytest.approx(float(sim.entropies.sum()))
    for name in ("internal_energies", "entropies"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(sim, name)[0] = 1.0


def test_a_liquid_has_its_second_derivatives() -> None:
    """Of E(V, S) at rest: c_v, kappa_T and alpha are those of the fluid."""
    liquid = fluid(40.0, thermal_expansion=0.02)
    sim = sdpd.Simulation(scene(liquid), seed=1)
    kind, numbers, isotherm = sim.scene.caloric
    step = 1e-5

    def pressure(rho: float, t: float) -> float:
        at = np.array([float(rho)]), np.array([float(t)])
        return float(sdpd._core.caloric_evaluate((kind, numbers, isotherm), *at)[0][0])

    by_density = (pressure(1 + step, 1) - pressure(1 - step, 1)) / (2 * step)
    by_heat = (pressure(1, 1 + step) - pressure(1, 1 - step)) / (2 * step)
    assert by_density == pytest.approx(100.0)  # 1/kappa_T = rho c^2
    assert by_heat == pytest.approx(0.02 * 100.0)  # alpha/kappa_T
    # gamma = 1 + T alpha^2/(kappa_T rho c_v)
    assert sim.scene.adiabatic_ratio == pytest.approx(1.0 + 0.02**2 * 100.0 / 40.0)


def test_a_monatomic_gas_has_the_entropy_of_sackur_and_tetrode() -> None:
    argon = sdpd.fluids.argon()
    made = sdpd.Scene(
        fluid=argon,
        box=sdpd.Box((1e-6,) * 3),
        resolution=sdpd.Resolution(particles=512),
        effects=sdpd.Effects(energy=True),
    )
    sim = sdpd.Simulation(made, seed=1)
    # standard molar entropy of argon, CODATA: 154.846 J/(mol K) at 298.15 K and 1e5 Pa
    molar = np.asarray(sim.entropies) * argon.molecular_mass / made.particle_mass * 6.02214076e23
    gas_constant = 8.314462618
    shift = 2.5 * gas_constant * math.log(300.0 / 298.15) - gas_constant * math.log(1.01325)
    # the summed density is off by the lattice factor
    shift -= gas_constant * math.log(float(sim.densities[0]) / argon.density)
    assert molar == pytest.approx(154.846 + shift, abs=0.01)
    assert made.heat_capacity_number == pytest.approx(
        1.5 * made.particle_mass / argon.molecular_mass, rel=1e-6
    )


def test_temperatures_may_be_given_and_written() -> None:
    made = scene(gas())
    start = np.linspace(0.8, 1.2, made.n_particles)
    sim = sdpd.Simulation(made, seed=1, temperatures=start)
    assert sim.temperatures == pytest.approx(start, rel=1e-14)
    sim.temperatures[3] = 2.0
    sim.refresh()
    assert sim.pressures[3] == pytest.approx(200.0 * sim.densities[3])
    sim.temperatures = 1.5
    assert np.ptp(sim.temperatures) == 0.0
    before = np.array(sim.temperatures)
    sim.temperatures[7] = -1.0
    with pytest.raises(ValueError, match="`temperatures` must be finite and > 0, got -1 in row 7"):
        sim.run(steps=1)
    sim.temperatures[7] = before[7]
    sim.run(steps=1)
    for bad in ([1.0, 2.0], -1.0, np.full(made.n_particles, np.nan)):
        with pytest.raises(ValueError, match="`temperatures` must be"):
            sdpd.Simulation(made, temperatures=bad)
    with pytest.raises(ValueError, match="must be None for a fluid without an energy"):
        sdpd.Simulation(scene(effects=sdpd.Effects()), temperatures=1.0)


def test_a_fluid_without_an_energy_says_so() -> None:
    sim = sdpd.Simulation(scene(effects=sdpd.Effects()), seed=1)
    for name in ("temperatures", "internal_energies", "entropies", "entropy", "internal_energy"):
        with pytest.raises(AttributeError, match=r"effects=sdpd\.Effects\(energy=True\)"):
            getattr(sim, name)
    with pytest.raises(AttributeError, match="energy_accounts"):
        sim.energy_accounts()


def test_velocity_verlet_says_what_it_cannot() -> None:
    walls = slab(sdpd.Isothermal(1.0), sdpd.Adiabatic())
    for act in (sdpd.Simulation, sdpd.Scene.cost, sdpd.Scene.regime, sdpd.timestep.bounds):
        with pytest.raises(
            ValueError, match=r"`integrator` must be sdpd.PairSplitting\(\) where a"
        ):
            act(walls, integrator="velocity_verlet")
        with pytest.raises(ValueError, match=r"`integrator.iterations` must be 0 where the fluid"):
            act(scene(), integrator=sdpd.VelocityVerlet(iterations=2))
    with pytest.raises(TypeError, match="energy_bookkeeping"):
        sdpd.VelocityVerlet(energy_bookkeeping=1)  # type: ignore[arg-type]


def test_splitting_is_the_default_with_energies() -> None:
    for made in (scene(), scene(effects=sdpd.Effects(energy=True, fluctuations=False))):
        assert sdpd.Simulation(made).integrator == sdpd.PairSplitting()


@pytest.mark.parametrize("noise", ["uniform", "gaussian"])
def test_velocity_verlet_keeps_its_books_or_not(noise: str) -> None:
    for books in (True, False):
        chosen = sdpd.VelocityVerlet(noise=noise, energy_bookkeeping=books)
        sim = sdpd.Simulation(scene(gas(25.0), 6.0), integrator=chosen, seed=2, threads=1)
        before = sim.total_energy
        sim.run(steps=50, progress=False)
        gained = abs(sim.total_energy - before)
        assert (gained < 1e-11 * before) == books
        # some (dt/tau)^3 of the kinetic energy a step
        assert gained < 50 * 4.0 * (sim.dt / sim.scene.friction_time) ** 3 * sim.kinetic_energy
        assert sim.energy_accounts().gained == 0.0
        assert (sim.energy_accounts().discarded != 0.0) == books


def test_bounds_of_velocity_verlet_with_energies() -> None:
    made = scene(fluid(thermal_conductivity=5000.0))
    found = {bound.name: bound for bound in sdpd.timestep.bounds(made, "velocity_verlet")}
    part = math.sqrt(0.005 / 0.4)
    assert found["conduction"].value == pytest.approx(part * made.conduction_time)
    assert found["temperature accuracy"].value == pytest.approx(part * made.friction_time)
    assert found["conduction stability"].value == pytest.approx(0.7 * made.conduction_time)
    assert "friction" not in found
    quiet = scene(effects=sdpd.Effects(energy=True, fluctuations=False))
    names = {bound.name for bound in sdpd.timestep.bounds(quiet, "velocity_verlet")}
    assert {"conduction stability", "viscous stability"} < names
    assert not names & {"conduction", "temperature accuracy"}
    with pytest.warns(
        sdpd.TimeStepWarning, match=r"exceeds conduction stability .* 0.7 tau_q: heat"
    ):
        sdpd.Simulation(made, integrator="velocity_verlet", dt=0.8 * made.conduction_time)
    errors = sdpd.timestep.expected_errors(made, 0.1 * made.friction_time, "velocity_verlet")
    assert errors.temperature == pytest.approx(-0.004)
    assert "velocity Verlet" in str(made.cost("velocity_verlet"))


def test_conduction_bounds_the_step() -> None:
    made = scene(fluid(thermal_conductivity=5000.0))
    sim = sdpd.Simulation(made)
    assert sim.dt_bound == "conduction"
    assert sim.dt == pytest.approx(2.0 * made.conduction_time)
    # tau_q = rho c_v/(2 kappa I_F), I_F h^2 = 21/2 for Lucy in 3D, with the lattice factor
    exact = 50.0 / (2.0 * 5000.0 * 10.5 / 2.64**2) / made.factors.friction
    assert made.conduction_time == pytest.approx(exact)


@pytest.mark.parametrize("books", [True, False])
def test_total_energy_holds_where_the_books_are_kept(books: bool) -> None:
    made = scene(gas(5.0), start=sdpd.RandomStart(relax_steps=30))
    integrator = sdpd.PairSplitting(energy_bookkeeping=books)
    sim = sdpd.Simulation(made, seed=2, integrator=integrator)
    before, momentum = sim.total_energy, sim.momentum.copy()
    sim.run(steps=400)
    change = sim.total_energy - before
    accounts = sim.energy_accounts()
    if books:
        assert abs(change) < 1e-12 * before
        assert accounts.discarded != 0.0
    else:
        # adiabats: the energy goes up, and nothing is in the books
        assert change > 1e-6 * before
        assert accounts.discarded == 0.0
    assert sim.momentum == pytest.approx(momentum, abs=1e-10)
    assert accounts.body_work == 0.0 and len(accounts.wall_heat) == 0


def test_energy_in_is_energy_out() -> None:
    """Moving plates, a body force and heat through walls: to rounding."""
    made = slab(
        sdpd.Isothermal(0.9),
        sdpd.HeatFlux(-3.0),
        of=gas(viscosity_exponent=0.7, conductivity_exponent=0.7),
        speed=2.0,
        noise=True,
        body_force=sdpd.UniformForce((0.3, 0.0, 0.0)),
    )
    sim = sdpd.Simulation(made, seed=1)
    before = sim.total_energy
    sim.run(steps=200)
    accounts = sim.energy_accounts()
    gained = accounts.body_work + accounts.wall_work.sum() - accounts.wall_heat.sum()
    assert sim.total_energy - before == pytest.approx(gained, abs=1e-9 * before)
    area = 36.0
    assert accounts.wall_heat[1] == pytest.approx(3.0 * area * sim.time, rel=1e-12)
    assert accounts.wall_work[1] != 0.0 and accounts.wall_work[0] == 0.0


def test_an_adiabatic_box_is_adiabatic() -> None:
    box = sdpd.Box((6.0, 6.0, 6.0), periodic="")
    walls = tuple(
        sdpd.Plane(axis=axis, at=at, heat=sdpd.Adiabatic()) for axis in "xyz" for at in (0.0, 6.0)
    )
    made = scene(gas(), box=box, walls=walls)
    sim = sdpd.Simulation(made, seed=1)
    before = sim.total_energy
    sim.run(steps=200)
    assert abs(sim.total_energy - before) < 1e-12 * before
    assert not sim.energy_accounts().wall_heat.any()


def test_same_bits_over_threads_and_files(tmp_path) -> None:
    made = slab(sdpd.Isothermal(0.9), sdpd.Adiabatic(), of=gas(), noise=True, edge=9.0)
    sims = [sdpd.Simulation(made, seed=3, threads=threads) for threads in (1, 2)]
    for sim in sims:
        sim.run(steps=15)
    path = tmp_path / "half.sdpd"
    sims[0].save(path)
    sims.append(sdpd.load(path))
    for sim in sims:
        sim.run(steps=10)
    first = sims[0]
    for other in sims[1:]:
        for name in ("positions", "velocities", "temperatures", "entropies", "pressures", "forces"):
            assert np.array_equal(getattr(first, name), getattr(other, name)), name
    one, two = first.energy_accounts(), sims[2].energy_accounts()
    assert one.wall_heat == pytest.approx(two.wall_heat, rel=1e-13)
    assert one.discarded == pytest.approx(two.discarded, rel=1e-9)
    assert sdpd.Scene.from_toml(made.to_toml()) == made
    assert 'kind = "adiabatic"' in made.to_toml()


def test_time_series_and_profiles_know_temperatures() -> None:
    sim = sdpd.Simulation(slab(sdpd.Isothermal(0.9), sdpd.Isothermal(1.1), noise=True), seed=1)
    thermo = sdpd.Thermodynamics(every=5)
    profile = sdpd.Profile(axis="z", bins=4, every=5, samples_per_block=2)
    sim.run(steps=20, observe=[thermo, profile])
    assert thermo["internal_temperature"][-1] == pytest.approx(sim.temperatures.mean())
    square = np.square(sim.temperatures).mean()
    assert thermo["square_internal_temperature"][-1] == pytest.approx(square)
    assert thermo["internal_energy"][-1] == pytest.approx(sim.internal_energy)
    assert thermo.units["square_internal_temperature"] == "temperature^2"
    assert "potential_energy" not in thermo.names
    assert profile.internal_temperature.shape == (4,)
    assert profile.error("internal_temperature").shape == (4,)
    with pytest.raises(ValueError, match="`name` must be one of"):
        profile.series("entropy")


def test_wall_forces_know_heat_and_work() -> None:
    made = slab(sdpd.Isothermal(0.9), sdpd.Isothermal(1.1), speed=1.0)
    sim = sdpd.Simulation(made, seed=1)
    forces = sdpd.WallForces(every=5)
    sim.run(steps=20, observe=forces)
    accounts = sim.energy_accounts()
    assert forces.heat.shape == (4, 2)
    assert forces.heat.mean(axis=0) * sim.time == pytest.approx(accounts.wall_heat)
    assert forces.work.mean(axis=0) * sim.time == pytest.approx(accounts.wall_work)
    assert forces.heat_flux == pytest.approx(forces.heat / 36.0)
    assert forces.torque.shape == (4, 2, 3)
    assert "in the mean" in str(sim)
    plain = slab(sdpd.Isothermal(), sdpd.Isothermal()).replace(effects=sdpd.Effects())
    other, still = sdpd.Simulation(plain, seed=1), sdpd.WallForces()
    other.run(steps=2, observe=still)
    with pytest.raises(AttributeError, match="fluid with an energy"):
        still.heat  # noqa: B018


def test_boundary_particles_have_the_temperature_of_the_wall() -> None:
    made = scene(
        box=sdpd.Box((8.0, 8.0, 8.0), periodic="y"),
        walls=sdpd.walls.enclosure(sdpd.Box((8.0, 8.0, 8.0), periodic="y"))[:2]
        + (
            sdpd.Plane(axis="z", at=0.0, heat=sdpd.Isothermal(1.0, (0.05, 0.0, 0.0))),
            sdpd.Plane(axis="z", at=8.0),
        ),
    )
    points = made.walls[2].boundary_particles(made)
    assert points.temperatures == pytest.approx(1.0 + 0.05 * points.positions[:, 0])
    assert (made.walls[3].boundary_particles(made).temperatures == 1.0).all()


def test_closed_forms_of_heat_flow() -> None:
    """Against each other, and each against its equation by finite differences."""
    z = np.linspace(0.05, 0.95, 19)
    step = 1e-4

    def flux(x: np.ndarray) -> np.ndarray:
        def t(y: np.ndarray) -> np.ndarray:
            return theory.conduction_profile(y, width=1.0, temperatures=(1.0, 3.0), exponent=0.7)

        return np.asarray(t(x) ** 0.7 * (t(x + step) - t(x - step)) / (2 * step))

    assert np.ptp(flux(z)) < 1e-6 * flux(z).mean()
    late = theory.transient_conduction(
        z, 10.0, width=1.0, temperatures=(1.0, 2.0), start=0.5, diffusivity=1.0
    )
    assert late == pytest.approx(1.0 + z)

    def at(x: np.ndarray, t: float) -> np.ndarray:
        return theory.transient_conduction(
            x, t, width=1.0, temperatures=(1.0, 2.0), start=0.5, diffusivity=1.0
        )

    slope = (at(z, 0.05 + 1e-5) - at(z, 0.05 - 1e-5)) / 2e-5
    curve = (at(z + 1e-3, 0.05) - 2 * at(z, 0.05) + at(z - 1e-3, 0.05)) / 1e-6
    assert slope == pytest.approx(curve, abs=2e-3)
    flow = theory.thermal_couette(
        width=2.0,
        speed=3.0,
        temperatures=(1.0, 1.4),
        shear_viscosity=2.0,
        thermal_conductivity=5.0,
        exponent=0.7,
    )
    assert sum(flow.heat) == pytest.approx(flow.stress * 3.0)
    # eta du/dz = tau, and kappa dT/dz + tau u is a constant
    u = (flow.velocity[1:] + flow.velocity[:-1]) / 2
    t = (flow.temperature[1:] + flow.temperature[:-1]) / 2
    dz = np.diff(flow.height)
    assert 2.0 * t**0.7 * np.diff(flow.velocity) / dz == pytest.approx(flow.stress, rel=1e-6)
    constant = 5.0 * t**0.7 * np.diff(flow.temperature) / dz + flow.stress * u
    assert constant == pytest.approx(flow.heat[0], rel=1e-5)


def test_the_fluid_conducts_what_the_lattice_sum_says() -> None:
    """A long wave of temperature on a lattice at rest, at the default step."""
    made = scene(edge=16.0, effects=sdpd.Effects(energy=True, fluctuations=False))
    sim = sdpd.Simulation(made, seed=1)
    assert sim.dt == pytest.approx(2.0 * min(made.friction_time, made.conduction_time), rel=0.35)
    k = 2.0 * np.pi / 16.0
    wave = np.cos(k * np.asarray(sim.positions[:, 0]))
    sim.temperatures = 1.0 + 0.01 * wave
    sim.velocities[:] = 0.0
    sim.run(steps=40)
    amplitude = 2.0 * float(np.mean(wave * sim.temperatures))
    rate = -math.log(amplitude / 0.01) / sim.time
    exact = lattice_heat_rate(made, k)
    assert rate == pytest.approx(exact, rel=0.01)
    assert exact == pytest.approx(made.factors.conductivity * 10.0 * k**2, rel=0.03)


def lattice_heat_rate(made: sdpd.Scene, k: float) -> float:
    """(2 kappa/C) sum_j g_0j (1 - cos k x_j), summed over the lattice."""
    reach = range(-3, 4)
    offsets = np.array(
        [(x, y, z) for x in reach for y in reach for z in reach if (x, y, z) != (0,) * 3]
    )
    r = np.linalg.norm(offsets, axis=1)
    support = made.support_radius
    inside = r < support
    _, f = sdpd.kernels.evaluate("lucy", 3, r[inside], support)
    w, _ = sdpd.kernels.evaluate("lucy", 3, np.append(r[inside], 0.0), support)
    g = f / w.sum() ** 2
    conductivity, capacity = made.conductivity, made.heat_capacity_number
    return float(2.0 * conductivity / capacity * (g * (1 - np.cos(k * offsets[inside, 0]))).sum())


@pytest.mark.parametrize(
    ("hot", "exponent"), [(1.1, 0.0), (3.0, 0.0), (0.3, 0.0), (3.0, 0.7), (0.3, 0.7)]
)
def test_conduction_between_plates(hot: float, exponent: float) -> None:
    """Steady, far from equilibrium as well; started from the closed form, which must stay."""
    of = fluid(conductivity_exponent=exponent)
    made = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(hot), of=of)
    sim = sdpd.Simulation(made, seed=1)
    exact = {"width": 12.0, "temperatures": (1.0, hot), "exponent": exponent}
    sim.temperatures = theory.conduction_profile(sim.positions[:, 2], **exact)
    sim.run(time=3.0 * max(1.0, hot**-exponent))
    before, start = sim.energy_accounts().wall_heat, sim.time
    sim.run(time=1.0)
    height, mean = layers(sim, sim.temperatures, 12)
    difference = mean - theory.conduction_profile(height, **exact)
    # a conductivity that changes by half over a spacing costs accuracy at the cold wall
    assert np.abs(difference).max() < (0.008 if exponent else 0.004) * abs(hot - 1.0)
    flow = (sim.energy_accounts().wall_heat - before) / (36.0 * (sim.time - start))
    power = exponent + 1.0
    expected = 500.0 * made.factors.conductivity * (hot**power - 1.0) / power / 12.0
    assert flow == pytest.approx([expected, -expected], rel=0.015)


def test_transient_conduction_between_plates() -> None:
    made = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.5))
    sim = sdpd.Simulation(made, seed=1)
    for time in (0.6, 2.0):
        sim.run(time=time - sim.time)
        height, mean = layers(sim, sim.temperatures, 12)
        exact = theory.transient_conduction(
            height,
            sim.time,
            width=12.0,
            temperatures=(1.0, 1.5),
            start=1.0,
            diffusivity=10.0 * made.factors.conductivity,
        )
        assert np.abs(mean - exact).max() < 0.015 * 0.5


def test_a_given_flux_makes_its_gradient() -> None:
    q, kappa = 20.0, 500.0
    made = slab(sdpd.Isothermal(1.0), sdpd.HeatFlux(q))
    gradient = q / (kappa * made.factors.conductivity)
    sim = sdpd.Simulation(made, seed=1)
    sim.temperatures = 1.0 + gradient * sim.positions[:, 2]
    sim.run(time=4.0)
    height, mean = layers(sim, sim.temperatures, 12)
    inner = slice(3, 9)
    slope = np.polyfit(height[inner], mean[inner], 1)[0]
    assert slope == pytest.approx(gradient, rel=0.01)
    assert mean[1] == pytest.approx(1.0 + gradient * height[1], abs=0.01 * gradient * 12.0)
    # against an adiabatic wall there is none
    still = sdpd.Simulation(slab(sdpd.Isothermal(1.3), sdpd.Adiabatic()), seed=1)
    still.temperatures = 1.3
    still.run(steps=50)
    assert still.temperatures == pytest.approx(1.3, rel=1e-12)


def test_a_temperature_that_varies_along_a_wall() -> None:
    """Between plates with the same gradient along x, closed by adiabatic walls: T = T(x)."""
    box = sdpd.Box((12.0, 6.0, 12.0), periodic="y")
    plate = sdpd.Isothermal(1.0, (0.02, 0.0, 0.0))
    walls = (
        sdpd.Plane(axis="x", at=0.0, heat=sdpd.Isothermal(1.0)),
        sdpd.Plane(axis="x", at=12.0, heat=sdpd.Isothermal(1.24)),
        sdpd.Plane(axis="z", at=0.0, heat=plate),
        sdpd.Plane(axis="z", at=12.0, heat=plate),
    )
    made = scene(box=box, walls=walls, effects=sdpd.Effects(energy=True, fluctuations=False))
    sim = sdpd.Simulation(made, seed=1)
    sim.run(time=8.0)
    exact = 1.0 + 0.02 * np.asarray(sim.positions[:, 0])
    assert np.abs(sim.temperatures - exact).max() < 0.02 * 0.24


@pytest.mark.parametrize("temperatures", [(1.0, 1.8), (1.0, 1.05)])
def test_shear_flow_heats(temperatures: tuple[float, float]) -> None:
    """Velocity, temperature, stress and heat of plates in motion; Brinkman numbers 2 and 32.

    Re/Ma^2 is 3: where it is large, a fluid that starts as a lattice shears like a crystal.
    """
    speed = 2.0
    constants = {"viscosity_exponent": 0.7, "conductivity_exponent": 0.7, "shear_viscosity": 200.0}
    low, high = (sdpd.Isothermal(t) for t in temperatures)
    made = slab(low, high, of=fluid(**constants), speed=speed)
    factors = made.factors
    exact = theory.thermal_couette(
        width=12.0,
        speed=speed,
        temperatures=temperatures,
        shear_viscosity=200.0 * factors.viscosity,
        thermal_conductivity=500.0 * factors.conductivity,
        exponent=0.7,
    )
    sim = sdpd.Simulation(made, seed=1)
    velocity, temperature = exact.at(sim.positions[:, 2])
    sim.velocities[:, 0] = velocity
    sim.temperatures = temperature
    sim.run(time=1.0)
    before, start = sim.energy_accounts(), sim.time
    sim.run(time=0.5)
    after = sim.energy_accounts()
    per = 36.0 * (sim.time - start)
    height, mean = layers(sim, sim.temperatures, 12)
    span = exact.temperature.max() - exact.temperature.min()
    # 12 spacings across: a shift of the wall by 0.05 of one is 1.3 % where most heat is made
    assert np.abs(mean - exact.at(height)[1]).max() < 0.015 * span
    height, flow = layers(sim, sim.velocities[:, 0], 12)
    assert np.abs(flow - exact.at(height)[0]).max() < 0.006 * speed
    heat = (after.wall_heat - before.wall_heat) / per
    assert heat == pytest.approx(list(exact.heat), abs=0.025 * exact.stress * speed)
    work = (after.wall_work - before.wall_work)[1] / per
    assert work == pytest.approx(exact.stress * speed, rel=0.02)


def test_sound_is_adiabatic_with_an_energy_and_isothermal_without() -> None:
    """A standing wave without friction: c^2 = P/rho (2 W + (gamma - 2) W^2) with W = What(k).

    That is gamma R T for long waves; gamma is 1 without an energy. Support 4 dx: on a lattice of
    fewer neighbours the wave feels the stiffness of the crystal as well.
    """
    gamma, length, support = 1.4, 24.0, 4.0
    k = 2.0 * np.pi / length
    w = float(theory.kernel_transform("lucy", 3, np.array([k * support]))[0])
    found = {}
    for energy in (True, False):
        conduction = False if energy else None
        made = scene(
            gas(250.0),
            box=sdpd.Box((length, 8.0, 8.0)),
            effects=sdpd.Effects(energy=energy, dissipation=False, conduction=conduction),
            start=sdpd.LatticeStart(velocities="zero"),
            resolution=sdpd.Resolution(spacing=1.0, support=support, kernel="lucy"),
        )
        sim = sdpd.Simulation(made, dt=0.01, seed=1)
        wave = np.sin(k * np.asarray(sim.positions[:, 0]))
        sim.velocities[:, 0] = 0.01 * wave
        amplitudes = [0.01]
        while amplitudes[-1] > 0.0:
            sim.run(steps=1, progress=False)
            amplitudes.append(2.0 * float(np.mean(wave * sim.velocities[:, 0])))
        rest = amplitudes[-1] / (amplitudes[-1] - amplitudes[-2])
        quarter = sim.time - rest * sim.dt
        found[energy] = (np.pi / 2.0 / quarter / k) ** 2
    expected = [100.0 * (2.0 * w + (ratio - 2.0) * w**2) for ratio in (gamma, 1.0)]
    assert found[True] == pytest.approx(expected[0], rel=0.01)
    assert found[False] == pytest.approx(expected[1], rel=0.01)
    assert found[True] / found[False] == pytest.approx(expected[0] / expected[1], rel=0.005)
    assert expected[0] / expected[1] > 1.36


def test_entropy_never_falls_without_noise() -> None:
    """An isolated box, driven hard: a shear wave and hot and cold halves, step by step."""
    made = scene(gas(10.0), effects=sdpd.Effects(energy=True, fluctuations=False))
    sim = sdpd.Simulation(made, seed=1)
    x = np.asarray(sim.positions[:, 0])
    sim.velocities[:, 1] = 3.0 * np.sin(2 * np.pi * x / 8.0)
    sim.temperatures = np.where(x < 4.0, 0.5, 2.0)
    entropies, energies = [sim.entropy], [sim.total_energy]
    for _ in range(400):
        sim.run(steps=1, progress=False)
        entropies.append(sim.entropy)
        energies.append(sim.total_energy)
    gained = entropies[-1] - entropies[0]
    assert gained > 100.0
    # the books cost the adiabat its exactness: allow for that, far below what is gained
    assert np.diff(entropies).min() > -1e-6 * gained
    assert np.ptp(energies) < 1e-12 * energies[0]


def test_a_scene_with_an_energy_runs_from_the_command_line(tmp_path, capsys) -> None:
    pytest.importorskip("h5py")
    from sdpd.cli import main

    options = ["--steps", "4", "--every", "2", "--no-progress", "-o", str(tmp_path)]
    assert main(["run", "thermal_couette", *options]) == 0
    frames = sdpd.h5md.read(tmp_path / "trajectory.h5md")
    made = sdpd.scenes.load("thermal_couette")
    assert frames.temperatures is not None and frames.temperatures.shape == (3, made.n_particles)
    assert frames.temperatures[0] == pytest.approx(300.0)
    header = (tmp_path / "thermodynamics.csv").read_text().splitlines()[0]
    assert "internal_energy [J]" in header and "internal_temperature [K]" in header
    assert (tmp_path / "wall_forces.csv").exists()
    assert main(["regime", "thermal_couette"]) == 0
    assert "the flow hardly heats itself" in capsys.readouterr().out


def test_a_failed_run_leaves_accounts_and_files_whole(tmp_path) -> None:
    """Ten times the step that is stable: the state goes back, with all its books."""
    made = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.2), of=gas(), noise=True)
    sim = sdpd.Simulation(made, seed=1)
    sim.run(steps=20)
    before, temperatures = sim.energy_accounts(), np.array(sim.temperatures)
    with pytest.warns(sdpd.TimeStepWarning):
        sim.dt = 1.0
    with pytest.raises(sdpd.SimulationError):
        sim.run(steps=400)
    after = sim.energy_accounts()
    assert (after.discarded, after.refused) == (before.discarded, before.refused)
    assert np.array_equal(after.wall_heat, before.wall_heat)
    assert np.array_equal(sim.temperatures, temperatures)
    sim.save(tmp_path / "kept.sdpd")
    again = sdpd.load(tmp_path / "kept.sdpd")
    assert again.energy_accounts().gained == sim.energy_accounts().gained


def test_accounts_go_on_bit_for_bit(tmp_path) -> None:
    force = sdpd.UniformForce((0.3, 0.0, 0.0))
    made = slab(sdpd.Isothermal(1.0), sdpd.HeatFlux(2.0), noise=True, body_force=force)
    sim = sdpd.Simulation(made, seed=1)
    sim.run(steps=15)
    sim.save(tmp_path / "half.sdpd")
    again = sdpd.load(tmp_path / "half.sdpd")
    for one in (sim, again):
        one.run(steps=10)
    mine, its = sim.energy_accounts(), again.energy_accounts()
    assert (mine.body_work, mine.discarded, mine.refused) == (
        its.body_work,
        its.discarded,
        its.refused,
    )
    assert np.array_equal(mine.wall_heat, its.wall_heat)
    assert np.array_equal(sim._core.wall_impulses(), again._core.wall_impulses())


def test_no_more_heat_is_taken_than_there_is() -> None:
    sim = sdpd.Simulation(slab(sdpd.Isothermal(1.0), sdpd.HeatFlux(-3e5)), seed=1)
    before = sim.total_energy
    sim.run(steps=3)
    accounts = sim.energy_accounts()
    assert accounts.refused > 0 and sim.temperatures.min() > 0.0
    assert sim.total_energy - before == pytest.approx(accounts.gained, rel=1e-9)


def test_what_an_energy_needs_is_asked_for() -> None:
    with pytest.raises(ValueError, match="must be above k_B a particle"):
        scene(gas(0.8))
    with pytest.warns(sdpd.ResolutionWarning, match="heat capacity of 3"):
        scene(gas(3.0))
    with pytest.raises(ValueError, match="must not be a temperature without heat conduction"):
        slab(sdpd.Isothermal(2.0), sdpd.Adiabatic(), of=fluid(thermal_conductivity=None))
    with pytest.raises(ValueError, match="`sound_speed` must be that of the gas"):
        sdpd.Scene(
            fluid=sdpd.fluids.nitrogen(),
            box=sdpd.Box((1e-7,) * 3),
            resolution=sdpd.Resolution(particles=512),
            sound_speed=100.0,
            effects=sdpd.Effects(energy=True),
        )
    with pytest.raises(ValueError, match=r"or `fluid.molecular_mass`"):
        scene(gas(), sound_speed=None)
    powers = fluid(conductivity_exponent=0.7)
    bath = sdpd.Effects(energy=True, viscous_heating=False)
    assert not scene(powers, effects=bath).active_effects.variable_transport
    nitrogen = sdpd.Scene(
        fluid=sdpd.fluids.nitrogen(),
        box=sdpd.Box((1e-7,) * 3),
        resolution=sdpd.Resolution(particles=512),
        effects=sdpd.Effects(energy=True),
    )
    assert nitrogen.adiabatic_ratio == pytest.approx(1.4)
    assert "gamma = 1.4" in str(nitrogen)


def test_hot_walls_shorten_the_step() -> None:
    """Ten times the temperature: 3.2 times the speeds of sound and of particles, five times eta."""
    of = gas(viscosity_exponent=0.7, conductivity_exponent=0.7)
    cold = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(1.0001), of=of, noise=True)
    hot = slab(sdpd.Isothermal(1.0), sdpd.Isothermal(10.0), of=of, noise=True)
    short, long = ({b.name: b.value for b in sdpd.timestep.bounds(s)} for s in (hot, cold))
    assert long["acoustic accuracy"] / short["acoustic accuracy"] == pytest.approx(
        10**0.5, rel=1e-3
    )
    assert long["thermal motion"] / short["thermal motion"] == pytest.approx(10**0.5, rel=1e-3)
    assert long["friction"] / short["friction"] == pytest.approx(10**0.7, rel=1e-3)
    assert long["conduction"] / short["conduction"] == pytest.approx(10**0.7, rel=1e-3)


def test_a_refused_assignment_leaves_the_array_as_it_was() -> None:
    sim = sdpd.Simulation(scene(gas()), seed=1)
    before = np.array(sim.temperatures)
    with pytest.raises(ValueError, match="`temperatures` must be > 0"):
        sim.temperatures = np.where(np.arange(len(before)) == 3, -1.0, before)
    assert np.array_equal(sim.temperatures, before)


def test_ase_keeps_temperatures() -> None:
    pytest.importorskip("ase")
    made = scene(gas())
    sim = sdpd.Simulation(made, seed=1, temperatures=np.linspace(0.8, 1.2, made.n_particles))
    again = sdpd.Simulation.from_ase(sim.to_ase(), made)
    assert again.temperatures == pytest.approx(sim.temperatures, rel=1e-14)


def test_water_expands() -> None:
    # 2.07e-4/K at 20 C and 3.03e-4/K at 30 C, CRC Handbook of Chemistry and Physics
    measured = [sdpd.fluids.water(t, properties="measured") for t in (293.15, 303.15)]
    assert [f.thermal_expansion for f in measured] == pytest.approx([2.07e-4, 3.03e-4], rel=0.01)


def test_fields_have_the_internal_temperature() -> None:
    from sdpd import fields

    made = slab(sdpd.Isothermal(0.9), sdpd.Isothermal(1.1))
    sim = sdpd.Simulation(made, seed=1)
    sim.temperatures = 0.9 + 0.2 * sim.positions[:, 2] / 12.0
    sim.refresh()
    average = sdpd.BinAverage(axis="z", bins=6, quantities=("internal_temperature",), every=1)
    sim.run(steps=1, observe=average)
    found = average["internal_temperature"]
    assert found.unit == "temperature"
    assert found.mean == pytest.approx(0.9 + 0.2 * (np.arange(6) + 0.5) / 6.0, abs=1e-3)
    plain = sdpd.Simulation(scene(effects=sdpd.Effects()), seed=1)
    with pytest.raises(ValueError, match="needs `temperatures` of the particles"):
        fields.snapshot(plain, fields.Points([[1.0, 1.0, 1.0]]), quantities="internal_temperature")
