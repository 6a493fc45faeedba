"""Fluids with an energy: the core against the NumPy twin, step by step, and its own laws.

Without noise the bound is 1e-12 of thermal speed and temperature. With noise it is 1e-9 where there
is conduction: the width of its noise is a difference of numbers that are known to 1e-16, so a link
at the very edge of the support, where th is nothing, may be off by sqrt(1e-16) at the worst.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import _core

from .build import restated
from .test_core_observers import stress_rows
from .thermal_build import (
    EXCHANGES,
    VARIABLE,
    advanced,
    caloric,
    core_energy,
    differences,
    orders,
    replace,
    thermal_core,
    thermal_problem,
)
from .twin.thermal import ThermalSystem
from .twin.thermal_splitting import Accounts, thermal_splitting_step

Array = NDArray[np.float64]

DIMENSIONS = (2, 3)
SMALL: dict[int, dict[str, Any]] = {
    2: {"cells": (7, 6), "support": 2.5},
    3: {"cells": (4, 5, 4), "support": 1.95},
}
QUIET, LOUD = 1e-12, 1e-9


def small(dimension: int, **options: Any) -> ThermalSystem:
    return thermal_problem(dimension, **{**SMALL[dimension], **options})


def assert_same(sim: Any, system: ThermalSystem, tolerance: float) -> None:
    for name, worst in differences(sim, system).items():
        assert worst < tolerance, f"{name}: {worst:.1e}"


def assert_same_accounts(sim: Any, accounts: Accounts, tolerance: float) -> None:
    got = sim.energy_accounts()
    assert got["refused"] == accounts.refused
    assert got["discarded"] == pytest.approx(accounts.discarded, abs=tolerance)
    assert got["body_work"] == pytest.approx(accounts.body_work, abs=tolerance)


# --- the equation of state and what is summed from it -----------------------------------------


def test_ideal_gas_by_the_textbook() -> None:
    """Air: gamma = 7/5 and 347 m/s at 300 K; a monatomic gas by Sackur and Tetrode."""
    gas, c_v = 287.0, 717.5
    rho, t = np.array([1.0, 1.2, 0.3]), np.array([300.0, 350.0, 300.0])
    p, e, s, slow, fast, capacity = _core.caloric_evaluate(
        ("ideal_gas", [gas, c_v, 0.0], ""), rho, t
    )
    np.testing.assert_allclose(p, [86100.0, 120540.0, 25830.0], rtol=1e-14)
    np.testing.assert_allclose(e, [215250.0, 251125.0, 215250.0], rtol=1e-14)
    np.testing.assert_allclose(slow, gas * t, rtol=1e-14)
    np.testing.assert_allclose(fast, 1.4 * gas * t, rtol=1e-14)
    np.testing.assert_allclose(capacity, c_v, rtol=1e-15)
    # from state 0 to 1 and 2: c_v ln(T/T') + R ln(rho'/rho)
    assert s[1] - s[0] == pytest.approx(717.5 * np.log(350 / 300) - 287 * np.log(1.2), rel=1e-11)
    assert s[2] - s[0] == pytest.approx(287.0 * np.log(1.0 / 0.3), rel=1e-11)


@pytest.mark.parametrize("kind", ["ideal_gas", "liquid"])
def test_caloric_equations_of_state(kind: str) -> None:
    law = caloric(kind, 25.0)
    rho, t = (x.ravel() for x in np.meshgrid([0.7, 0.95, 1.0, 1.3], [0.5, 1.1, 2.3]))
    arguments = (law.kind, law.parameters, law.isotherm)
    p, e, s, slow, fast, capacity = _core.caloric_evaluate(arguments, rho, t)
    np.testing.assert_allclose(p, law.pressure(rho, t), rtol=1e-12, atol=1e-12)
    energy = law.cold(rho) + law.heat_capacity * t
    np.testing.assert_allclose(e - e[0], energy - energy[0], rtol=0, atol=1e-11)
    entropy = law.entropy(rho, t)
    np.testing.assert_allclose(s - s[0], entropy - entropy[0], rtol=0, atol=1e-12)
    # c_T^2 = (dP/drho)_T, and Mayer's relation c_S^2 = c_T^2 + T (dP/dT)^2/(rho^2 c_v)
    step = 1e-4
    p_rho = (law.pressure(rho + step, t) - law.pressure(rho - step, t)) / (2.0 * step)
    p_t = (law.pressure(rho, t + step) - law.pressure(rho, t - step)) / (2.0 * step)
    np.testing.assert_allclose(slow, p_rho, rtol=1e-6)
    mayer = t * p_t**2 / (rho**2 * law.heat_capacity)
    np.testing.assert_allclose(fast - slow, mayer, rtol=1e-8)
    np.testing.assert_allclose(capacity, law.heat_capacity, rtol=1e-15)


def scaled(system: ThermalSystem, length: float, mass: float, time: float) -> ThermalSystem:
    """The same dimensionless problem in other units, kelvin and k_B in SI; an ideal gas."""
    kelvin, boltzmann = 290.0, 1.380649e-23
    mass = boltzmann * kelvin * time**2 / length**2 if mass == 0.0 else mass
    boltzmann = mass * length**2 / time**2 / kelvin
    dimension = system.dimension
    gas, c_v, constant = system.caloric.parameters
    specific = length**2 / time**2 / kelvin
    viscosity = mass / (length ** (dimension - 2) * time)
    parameters = [gas * specific, c_v * specific, constant * specific]
    return replace(
        system,
        positions=system.positions * length,
        velocities=system.velocities * length / time,
        box=system.box * length,
        support=system.support * length,
        mass=system.mass * mass,
        thermal_energy=system.thermal_energy * mass * length**2 / time**2,
        friction_across=system.friction_across * viscosity,
        friction_along=system.friction_along * viscosity,
        dt=system.dt * time,
        temperatures=system.temperatures * kelvin,
        caloric=replace(system.caloric, parameters=parameters),
        boltzmann_constant=system.boltzmann_constant * boltzmann,
        conductivity=system.conductivity * mass / (length ** (dimension - 4) * time**3 * kelvin),
        reference_temperature=system.reference_temperature * kelvin,
    )


@pytest.mark.parametrize("units", [(1.0, 1.0, 1.0), (3e-10, 0.0, 2e-13)], ids=["reduced", "si"])
@pytest.mark.parametrize("eos", ["ideal_gas", "liquid"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_densities_pressures_forces(
    dimension: int, eos: str, units: tuple[float, float, float]
) -> None:
    kernel = "lucy" if dimension == 2 else "wendland_c2"
    system = thermal_problem(dimension, eos=eos, kernel=kernel)
    if eos == "ideal_gas":
        system = scaled(system, *units)
    elif units[1] == 0.0:
        return
    sim = thermal_core(system)
    np.testing.assert_allclose(sim.densities, system.densities, rtol=1e-13)
    scale = np.abs(system.pressures).max()
    np.testing.assert_allclose(sim.pressures, system.pressures, rtol=0, atol=1e-12 * scale)
    force = system.conservative()
    np.testing.assert_allclose(sim.forces, force, rtol=0, atol=1e-12 * np.abs(force).max())
    np.testing.assert_allclose(sim.temperatures, system.temperatures, rtol=1e-14)
    for got, expected in (
        (sim.internal_energies, system.internal_energies),
        (sim.entropies, system.entropies),
    ):
        change = expected - expected[0]
        atol = 1e-12 * np.abs(expected).max()
        np.testing.assert_allclose(got - got[0], change, rtol=0, atol=atol)
    assert np.ptp(system.pressures) > 0.1 * scale


# --- steps ------------------------------------------------------------------------------------


@pytest.mark.parametrize("bookkeeping", [True, False])
@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_steps_without_noise(dimension: int, exchanges: str, bookkeeping: bool) -> None:
    """One step, then more. Kernel, friction and equation of state change along."""
    index = dimension + (*EXCHANGES, *VARIABLE).index(exchanges) + bookkeeping
    system = small(
        dimension,
        exchanges=exchanges,
        bookkeeping=bookkeeping,
        kernel=("lucy", "wendland_c2")[index % 2],
        friction=("general", "central")[index // 2 % 2],
        eos=("liquid", "ideal_gas")[bookkeeping],
        body_force=(3.0, -2.0, 1.0)[:dimension],
        body_wave=(1, 1) if exchanges == "heating" else None,
    )
    sim, accounts = thermal_core(system), Accounts()
    before = system.total_energy()
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, QUIET)
    state = advanced(sim, state, 9 if dimension == 2 else 4, accounts, 1)
    assert_same(sim, state, QUIET)
    assert_same_accounts(sim, accounts, 1e-10)
    assert np.abs(state.temperatures / system.temperatures - 1.0).max() > 1e-4
    if bookkeeping and not exchanges.startswith("bath"):
        gained = state.total_energy() - before
        assert gained == pytest.approx(accounts.body_work, abs=1e-11 * abs(before))
        assert abs(accounts.discarded) > 1e-4


NOISY = [
    # (exchanges, C/k_B, exponents)
    ("full_variable", 5.0, (0.0, 0.0)),
    ("full_variable", 5.0, (0.7, 0.9)),
    ("full_variable", 40.0, (-0.5, 1.3)),
    ("heating_variable", 5.0, (0.7, 0.0)),
    ("conduction_variable", 5.0, (0.0, 0.9)),
    ("conduction", 5.0, (0.0, 0.0)),
    ("bath", 5.0, (0.0, 0.0)),
    ("bath_conduction", 5.0, (0.0, 0.0)),
]


@pytest.mark.parametrize(("exchanges", "capacity", "exponents"), NOISY)
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_steps_with_noise(
    dimension: int, exchanges: str, capacity: float, exponents: tuple[float, float]
) -> None:
    """Few degrees of freedom, so that c is large; c is current where transport is variable."""
    system = small(
        dimension,
        exchanges=exchanges,
        capacity=capacity,
        conductivity=12.0 * capacity,
        exponents=exponents,
        noise="gaussian",
        kernel=("lucy", "wendland_c2")[dimension % 2],
        friction=("general", "central")[dimension % 2],
        dt=0.01,
    )
    sim, accounts = thermal_core(system), Accounts()
    state = advanced(sim, system, 4, accounts)
    assert_same(sim, state, LOUD)
    assert_same_accounts(sim, accounts, LOUD)
    assert np.std(state.temperatures) > 0.05 or exchanges == "bath"


@pytest.mark.parametrize("exchanges", ["full", "heating"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_constant_coefficients_with_noise(dimension: int, exchanges: str) -> None:
    """c = (1 - y^2)/(2 k), y = (E_i - E_j)/(E_i + E_j), is that of the present energies."""
    options: dict[str, Any] = {
        "exchanges": exchanges,
        "capacity": 5.0,
        "conductivity": 50.0,
        "spread": 0.3,
        "noise": "gaussian",
        "dt": 0.01,
    }
    system = small(dimension, **options)
    sim = thermal_core(system)
    state = advanced(sim, system, 2, Accounts())
    assert_same(sim, state, LOUD)
    forgotten = replace(system, boltzmann_constant=0.5)  # halves c, and k_B T
    worst = differences(sim, advanced(thermal_core(system), forgotten, 2, Accounts()))
    assert worst["velocities"] > 1e-5


@pytest.mark.parametrize("exchanges", ["full", "heating", "full_variable", "bath_conduction"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_a_single_pair_with_noise(dimension: int, exchanges: str) -> None:
    """Two particles far from equilibrium with each other, at C = 5 k_B, for many steps."""
    base = small(dimension, exchanges=exchanges, capacity=5.0, conductivity=20.0, noise="gaussian")
    positions = np.full((2, dimension), 2.0)
    positions[1, 0] += 0.8
    system = replace(
        base, positions=positions, velocities=base.velocities[:2], temperatures=np.array([0.7, 1.5])
    )
    sim, accounts = thermal_core(system), Accounts()
    state = advanced(sim, system, 20, accounts)
    assert_same(sim, state, 1e-11)
    assert accounts.refused == sim.energy_accounts()["refused"]
    assert np.abs(state.temperatures - system.temperatures).max() > 0.01 or "bath" in exchanges


@pytest.mark.parametrize("exchanges", ["full_variable", "heating_variable", "conduction"])
def test_steps_that_would_leave_no_energy_are_not_made(exchanges: str) -> None:
    """C = 1.5 k_B, hardly a fluid: the same ones are refused, and counted."""
    system = small(
        3,
        exchanges=exchanges,
        capacity=1.5,
        conductivity=20.0,
        exponents=(0.0, 0.0),
        spread=0.5,
        noise="gaussian",
        dt=0.02,
    )
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 2, accounts)
    assert_same(sim, state, LOUD)
    assert_same_accounts(sim, accounts, LOUD)
    assert accounts.refused > 5
    assert core_energy(sim) == pytest.approx(before, rel=1e-12)


def test_the_same_steps_in_si_units() -> None:
    system = small(3, exchanges="full_variable", capacity=25.0, noise="gaussian")
    twin = scaled(system, 3e-10, 0.0, 2e-13)
    sim = thermal_core(twin)
    assert twin.boltzmann_constant == pytest.approx(1.380649e-23)
    state = advanced(sim, twin, 3, Accounts())
    assert_same(sim, state, LOUD)


# --- laws ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "heating", "conduction"])
@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_energy_and_momentum_to_rounding(dimension: int, noise: str, exchanges: str) -> None:
    system = small(dimension, exchanges=exchanges, noise=noise, eos="liquid", dt=0.01)
    sim, steps = thermal_core(system), 200
    before = core_energy(sim)
    sim.run(steps, system.dt)
    scale = np.sqrt(steps * system.size) * np.finfo(float).eps * 100.0
    assert np.all(np.abs(sim.velocities.sum(axis=0)) < scale)
    assert abs(core_energy(sim) - before) < 1e-12 * abs(before)
    accounts = sim.energy_accounts()
    assert abs(accounts["discarded"]) > 1e-5  # what would have been gained or lost
    assert accounts["body_work"] == 0.0
    assert accounts["walls"].shape == (0, 2)


def test_entropy_never_falls_without_noise() -> None:
    for exchanges in ("full", "heating", "conduction"):
        system = small(3, exchanges=exchanges, spread=0.4)
        sim = thermal_core(system)
        entropy = [float(sim.entropies.sum())]
        for _ in range(30):
            sim.run(1, system.dt)
            entropy.append(float(sim.entropies.sum()))
        # the books change S along the reversible part, by far less than exchanges make
        assert np.all(np.diff(entropy) > -1e-3)
        assert entropy[-1] > entropy[0] + 1.0


def test_adiabats_keep_every_entropy() -> None:
    system = small(2, exchanges="adiabatic", bookkeeping=False, eos="liquid")
    sim = thermal_core(system)
    before = np.array(sim.entropies)
    sim.run(50, system.dt)
    np.testing.assert_allclose(sim.entropies, before, rtol=0, atol=1e-11)
    assert np.abs(sim.temperatures / system.temperatures - 1.0).max() > 1e-3


def order_of_convergence(
    system: ThermalSystem, time: float, steps: int, **options: Any
) -> dict[str, float]:
    """log2 of the ratio of what halving the step changes, twice in a row; without noise."""
    ends = []
    for n in (steps, 2 * steps, 4 * steps):
        sim = thermal_core(replace(system, dt=time / n), **options)
        sim.run(n, time / n)
        ends.append(sim)
    orders = {}
    for name in ("velocities", "temperatures"):
        a, b, c = (np.array(getattr(sim, name)) for sim in ends)
        orders[name] = float(np.log2(np.abs(a - b).max() / np.abs(b - c).max()))
    return orders


@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
@pytest.mark.parametrize("bookkeeping", [True, False])
def test_the_splitting_is_of_second_order(exchanges: str, bookkeeping: bool) -> None:
    system = small(3, exchanges=exchanges, conductivity=100.0, bookkeeping=bookkeeping)
    for name, order in order_of_convergence(system, 0.064, 16).items():
        assert order == pytest.approx(2.0, abs=0.05), name


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "bath", "conduction"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_stress_is_the_change_of_the_helfand_moment(dimension: int, exchanges: str) -> None:
    """For a blob that touches no image of itself; refused updates (C = 2 k_B) move nothing."""
    base = small(dimension, exchanges=exchanges, noise="gaussian", capacity=2.0, conductivity=30.0)
    system = replace(base, positions=base.positions + base.box, box=3.0 * base.box)
    sim, quiet = thermal_core(system), thermal_core(system)
    observer = sim.attach_stress(3)
    moments = []
    for _ in range(6):
        sim.run(3, system.dt)
        r = sim.positions + sim.images * system.box
        moments.append(np.einsum("ia,ib->ab", r, sim.velocities))
    got = stress_rows(observer, dimension).sum(axis=1)
    got *= float(np.prod(system.box)) * 3 * system.dt
    scale = np.abs(moments).max()
    np.testing.assert_allclose(got, np.diff(moments, axis=0), rtol=0, atol=1e-12 * scale)
    # and the tally only reads
    quiet.run(18, system.dt)
    assert same_bits(sim, quiet)


# --- state ------------------------------------------------------------------------------------


def same_bits(one: Any, other: Any) -> bool:
    names = ("positions", "velocities", "temperatures", "pressures", "internal_energies")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "bath_conduction"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_bits_on_any_number_of_threads_and_across_save_and_load(
    dimension: int, exchanges: str
) -> None:
    cells = (16, 15) if dimension == 2 else (7, 7, 6)
    system = thermal_problem(
        dimension, cells=cells, support=2.2, exchanges=exchanges, noise="gaussian"
    )
    one, two, three = (thermal_core(system, threads=k, skin=0.1) for k in (1, 2, 3))
    for sim in (one, two):
        sim.run(12, system.dt)
    three.run(7, system.dt)
    again = thermal_core(system, threads=2, skin=0.1)
    again.set_state(three.state())
    again.run(5, system.dt)
    assert same_bits(one, two)
    assert same_bits(one, again)
    assert one.energy_accounts()["discarded"] == pytest.approx(
        again.energy_accounts()["discarded"], rel=1e-12
    )


@pytest.mark.parametrize(
    "exchanges",
    ["full", "heating", "full_variable", "bath_conduction", "conduction"],
)
def test_a_skin_is_only_speed(exchanges: str) -> None:
    system = thermal_problem(
        3, cells=(7, 7, 6), support=2.2, exchanges=exchanges, noise="gaussian", dt=0.02
    )
    sims = [thermal_core(system, skin=skin) for skin in (None, 0.05)]
    for sim in sims:
        sim.run(10, system.dt)
    assert np.abs(sims[0].temperatures / sims[1].temperatures - 1.0).max() < LOUD
    assert np.abs(sims[0].velocities - sims[1].velocities).max() < LOUD


def test_written_temperatures_take_effect() -> None:
    system = small(3, exchanges="full")
    sim = thermal_core(system)
    sim.run(1, system.dt)
    warmer = np.array(sim.temperatures)
    warmer[::3] *= 1.3
    now = replace(
        system,
        positions=np.array(sim.positions),
        velocities=np.array(sim.velocities),
        temperatures=warmer,
    )
    sim.temperatures[:] = warmer
    sim.refresh()
    np.testing.assert_allclose(sim.pressures, now.pressures, rtol=1e-12)
    change = now.internal_energies - now.internal_energies[0]
    got = np.array(sim.internal_energies)
    np.testing.assert_allclose(got - got[0], change, rtol=0, atol=1e-11)
    state = advanced(sim, now, 2, Accounts(), 1)
    assert_same(sim, state, QUIET)
    # and without a refresh: the run itself takes the rows over
    late, early = thermal_core(system), thermal_core(replace(system, temperatures=warmer))
    late.temperatures[:] = warmer
    for sim in (late, early):
        sim.run(3, system.dt)
    assert np.array_equal(late.temperatures, early.temperatures)


@pytest.mark.parametrize("exchanges", ["adiabatic", "full_variable"])
def test_rows_may_be_in_any_order(exchanges: str) -> None:
    """Ids go with their particles: forces to rounding, steps as the twin makes them."""
    system = small(3, exchanges=exchanges, noise="gaussian")
    mixed = np.random.default_rng(5).permutation(system.size)
    other = replace(
        system,
        positions=system.positions[mixed],
        velocities=system.velocities[mixed],
        temperatures=system.temperatures[mixed],
        ids=mixed.astype(np.uint64),
    )
    sim, again = thermal_core(system), thermal_core(other)
    restated(again, ids=mixed)
    scale = np.abs(sim.forces).max()
    assert np.abs(sim.forces[mixed] - again.forces).max() < 1e-13 * scale
    forward = orders(again)
    again.run(1, system.dt)
    state = thermal_splitting_step(other, 0, forward, orders(again))
    assert_same(again, state, LOUD)
    if exchanges == "adiabatic":
        sim.run(1, system.dt)
        assert np.abs(sim.temperatures[mixed] - again.temperatures).max() < 1e-14


# --- messages -----------------------------------------------------------------------------------


def broken(**changes: Any) -> Any:
    """A core of a small problem with entries of `thermal` (or arguments) replaced."""
    system = small(2)
    sim_arguments = {k: v for k, v in changes.items() if k in ("temperatures", "exchanges")}
    law = system.caloric
    thermal = {
        "eos": (law.kind, law.parameters, law.isotherm),
        "boltzmann_constant": 1.0,
        "conductivity": 1.0,
        "exponents": [0.0, 0.0],
        "reference_temperature": 1.0,
        "bookkeeping": True,
        "walls": [],
    }
    thermal.update({k: v for k, v in changes.items() if k in thermal})
    return thermal_core(system, thermal=thermal, **sim_arguments)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"boltzmann_constant": 0.0}, "`boltzmann_constant` must be finite and > 0"),
    ({"conductivity": -1.0}, "`thermal_conductivity` must be finite and >= 0"),
    ({"reference_temperature": np.inf}, "`reference_temperature`"),
    ({"exponents": [np.nan, 0.0]}, "`transport_exponents`"),
    ({"eos": ("ideal_gas", [1.0, 0.0, 0.0], "")}, "`heat_capacity` must be finite and > 0"),
    ({"eos": ("ideal_gas", [-1.0, 2.0, 0.0], "")}, "`gas_constant`"),
    ({"eos": ("ideal_gas", [1.0], "")}, "takes the parameters"),
    ({"eos": ("steam", [], "")}, "`caloric` must be one of"),
    ({"temperatures": np.ones(3)}, r"`temperatures` must have shape \(42,\)"),
    ({"temperatures": None}, "`temperatures` must have shape"),
    ({"temperatures": np.zeros(42)}, "`temperatures` must be finite and > 0, got 0 in row 0"),
    ({"exchanges": "osmosis"}, "`exchanges`"),
]


@pytest.mark.parametrize(("changes", "message"), BAD, ids=[m for _, m in BAD])
def test_bad_input_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        broken(**changes)


def test_bad_written_temperatures_are_named() -> None:
    sim = thermal_core(small(2))
    before = np.array(sim.positions)
    sim.temperatures[4] = -1.0
    for act in (sim.refresh, lambda: sim.run(1, 0.001)):
        with pytest.raises(
            ValueError, match="`temperatures` must be finite and > 0, got -1 in row 4"
        ):
            act()
    assert np.array_equal(sim.positions, before)
