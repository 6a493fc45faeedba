"""Walls of a fluid with an energy: heating, baths and mirrors of the core against the NumPy twin.

Without noise to 1e-12 of thermal speed and temperature, with noise to 1e-9 (see
test_thermal_against_twin.py); energies of the walls' accounts to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import sdpd

from .test_thermal_against_twin import order_of_convergence
from .test_walls_against_twin import (
    CASES,
    Geometry,
    closed,
    duct,
    each_case,
    lidded,
    numbers,
    pipe,
    slab,
    step,
    tilted,
)
from .thermal_build import (
    advanced,
    core_energy,
    differences,
    replace,
    thermal_core,
    thermal_wall_problem,
)
from .twin.thermal import ThermalSystem, WallHeat
from .twin.thermal_splitting import Accounts

Array = NDArray[np.float64]

ADIABATIC: WallHeat = ("adiabatic", [])
FLUX: WallHeat = ("flux", [40.0])
QUIET, LOUD = 1e-12, 1e-9


def isothermal(t: float, dimension: int, gradient: Sequence[float] = (0.0, 0.0, 0.0)) -> WallHeat:
    return "isothermal", [t, *gradient[:dimension]]


def mixed(dimension: int, walls: int) -> list[WallHeat]:
    """Every kind of condition, corners of every kind of pair; a bath where there is one wall."""
    bath, other = isothermal(1.5, dimension), isothermal(0.7, dimension)
    if walls == 1:
        return [bath]
    return [bath, FLUX] if walls == 2 else [bath, other, ADIABATIC, FLUX]


def problem(geometry: Geometry, dimension: int, **options: Any) -> ThermalSystem:
    heat = options.pop("heat", None) or mixed(dimension, len(geometry(dimension)[0]))
    return thermal_wall_problem(geometry, dimension, heat, **options)


def assert_same(sim: Any, system: ThermalSystem, tolerance: float) -> None:
    for name, worst in differences(sim, system).items():
        assert worst < tolerance, f"{name}: {worst:.1e}"


def assert_same_accounts(sim: Any, accounts: Accounts, tolerance: float = 1e-9) -> None:
    """Work by wall, and heat of all: see `test_heat_at_mixed_corners` for the heat by wall."""
    got = sim.energy_accounts()
    heat, work = got["walls"].T
    assert np.abs(work - accounts.wall_work).max() < tolerance
    assert abs(heat.sum() - accounts.wall_heat.sum()) < tolerance
    assert got["discarded"] == pytest.approx(accounts.discarded, abs=tolerance)
    assert got["body_work"] == pytest.approx(accounts.body_work, abs=tolerance)


def balance(sim: Any, before: float) -> float:
    """What is missing of d(E) = wall work + body work - heat to the walls."""
    accounts = sim.energy_accounts()
    heat, work = accounts["walls"].sum(axis=0)
    return float(core_energy(sim) - before - (work + accounts["body_work"] - heat))


# --- steps ------------------------------------------------------------------------------------


@each_case
def test_steps_without_noise(geometry: Geometry, dimension: int) -> None:
    """Walls that slide and turn, corners, curved walls, walls of any shape; a body force."""
    index = CASES.index((geometry, dimension))
    periodic = geometry(dimension)[2]
    force = [2.0 * ("xyz"[axis] in periodic) for axis in range(dimension)]
    system = problem(
        geometry,
        dimension,
        exchanges=("full", "full_variable")[index % 2],
        friction=("general", "central")[index // 2 % 2],
        eos=("ideal_gas", "liquid")[index % 2],
    ).at(body_force=np.array(force))
    assert isinstance(system, ThermalSystem)
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 2 if dimension == 2 else 1, accounts)
    assert_same(sim, state, QUIET)
    assert_same_accounts(sim, accounts)
    assert abs(balance(sim, before)) < 1e-12 * abs(before)
    assert abs(accounts.wall_heat).max() > 0.1


@pytest.mark.parametrize(
    ("exchanges", "conditions"),
    [
        ("conduction", "bath"),
        ("conduction", "mirror"),
        ("conduction_variable", "mixed"),
        ("heating", "mirror"),
        ("heating_variable", "mixed"),
        ("bath", "bath"),
        ("bath_conduction", "mixed"),
        ("adiabatic", "flux"),
        ("full", "mirror"),
    ],
)
@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 2), (pipe, 2), (closed, 3)])
def test_every_exchange_at_walls(
    geometry: Geometry, dimension: int, exchanges: str, conditions: str
) -> None:
    heat = {
        "bath": [isothermal(1.3, dimension)],
        "mirror": [ADIABATIC],
        "flux": [FLUX],
        "mixed": mixed(dimension, len(geometry(dimension)[0])),
    }[conditions]
    system = problem(geometry, dimension, heat=heat, exchanges=exchanges)
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, QUIET)
    assert_same_accounts(sim, accounts)
    heat_of_walls = sim.energy_accounts()["walls"][:, 0]
    if conditions == "mirror" or (conditions == "bath" and "cond" not in exchanges):
        assert np.all(heat_of_walls == 0.0)
    elif conditions == "flux":
        np.testing.assert_allclose(heat_of_walls, -40.0 * system.dt, rtol=1e-12)
    if not exchanges.startswith("bath"):
        assert abs(balance(sim, before)) < 1e-12 * abs(before)


@pytest.mark.parametrize("capacity", [5.0, 25.0])
@pytest.mark.parametrize(
    ("geometry", "dimension"),
    [(slab, 2), (duct, 2), (pipe, 2), (tilted, 3), (closed, 3), (lidded, 3)],
)
def test_steps_with_noise(geometry: Geometry, dimension: int, capacity: float) -> None:
    system = problem(
        geometry,
        dimension,
        exchanges="full_variable",
        capacity=capacity,
        conductivity=12.0 * capacity,
        exponents=(0.0, 0.0) if capacity < 10.0 else (0.7, 0.9),
        noise="gaussian",
        dt=0.01,
    )
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, LOUD)
    assert_same_accounts(sim, accounts)
    assert abs(balance(sim, before)) < 1e-12 * abs(before)


@pytest.mark.parametrize("exchanges", ["bath_conduction", "conduction", "bath"])
def test_noise_of_links_without_heating(exchanges: str) -> None:
    system = problem(
        duct, 2, exchanges=exchanges, noise="gaussian", capacity=8.0, conductivity=90.0
    )
    sim, accounts = thermal_core(system), Accounts()
    state = advanced(sim, system, 3, accounts)
    assert_same(sim, state, LOUD)
    assert_same_accounts(sim, accounts)


@pytest.mark.parametrize(
    ("geometry", "dimension"), [(slab, 2), (closed, 3), (tilted, 3), (step, 2)]
)
def test_temperature_gradients_along_walls(geometry: Geometry, dimension: int) -> None:
    """T + G.x at the mean of both feet, x from the origin of the user's box."""
    periodic = geometry(dimension)[2]
    gradient = [0.0 if "xyz"[a] in periodic else 0.03 * (a + 1) for a in range(dimension)]
    heat = [isothermal(1.2, dimension, gradient)]
    system = problem(geometry, dimension, heat=heat, exchanges="full")
    sim, accounts = thermal_core(system), Accounts()
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, QUIET)
    heat_of_walls = sim.energy_accounts()["walls"][:, 0]
    assert np.abs(heat_of_walls - accounts.wall_heat).max() < 1e-10


@pytest.mark.parametrize("slips", [(0,), (0, 2)])
def test_heat_passes_where_the_fluid_slips(slips: tuple[int, ...]) -> None:
    """No friction with images over such a wall, those over two included."""
    system = problem(duct, 2, exchanges="full_variable", noise="gaussian")
    system = replace(system, slips=slips)
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 2, accounts)
    assert_same(sim, state, LOUD)
    assert_same_accounts(sim, accounts)
    assert abs(balance(sim, before)) < 1e-12 * abs(before)
    assert abs(accounts.wall_heat[0]) > 0.1


def sliding(wall: Any, speed: float, dimension: int) -> Any:
    velocity = np.zeros(dimension)
    velocity[0] = speed
    return replace(wall, velocity=velocity)


def test_a_wall_may_change_its_speed() -> None:
    system = problem(slab, 2, exchanges="full")
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 1, accounts)
    fast = (sliding(state.walls[0], 3.0, 2), state.walls[1])
    sim.move_wall(0, numbers(fast[0], 2))
    state = advanced(sim, replace(state, walls=fast), 2, accounts, 1)
    assert_same(sim, state, QUIET)
    assert_same_accounts(sim, accounts)
    assert abs(balance(sim, before)) < 1e-12 * abs(before)


# --- laws ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 3), (pipe, 3)])
def test_energy_balance_to_rounding(geometry: Geometry, dimension: int, noise: str) -> None:
    """Many steps in pieces, across save and load and on any number of threads."""
    force = np.array([0.0, 0.0, 3.0])
    system = problem(geometry, dimension, exchanges="full", noise=noise).at(body_force=force)
    assert isinstance(system, ThermalSystem)
    sim, other = thermal_core(system), thermal_core(system, threads=2)
    before = core_energy(sim)
    sim.run(7, 0.004)
    again = thermal_core(system)
    again.set_state(sim.state())
    for one in (sim, again):
        one.run(13, 0.004)
    other.run(20, 0.004)
    for one in (sim, again):
        assert abs(balance(one, before)) < 3e-12 * abs(before)
    accounts = sim.energy_accounts()
    assert abs(accounts["body_work"]) > 1.0
    assert np.abs(accounts["walls"]).max(axis=0).min() > 1.0
    assert np.array_equal(sim.temperatures, other.temperatures)
    assert np.array_equal(sim.velocities, other.velocities)
    assert np.array_equal(again.temperatures, sim.temperatures)
    assert np.array_equal(accounts["walls"], other.energy_accounts()["walls"])
    lost = (system.velocities - sim.velocities).sum(axis=0) + 20 * 0.004 * force * system.size
    received = sim.wall_impulses()[:, :dimension].sum(axis=0)
    assert np.abs(lost - received).max() < 1e-11 * np.abs(sim.wall_impulses()).sum()


@pytest.mark.parametrize(
    "condition",
    [
        isothermal(1.4, 2),
        ADIABATIC,
        pytest.param(
            ("flux", [2000.0]),
            marks=pytest.mark.xfail(
                strict=True, reason="the flux comes last in both halves: first order in dt"
            ),
        ),
    ],
    ids=["isothermal", "adiabatic", "flux"],
)
def test_the_splitting_is_of_second_order(condition: WallHeat) -> None:
    system = problem(slab, 2, heat=[condition], exchanges="full", conductivity=100.0)
    for name, order in order_of_convergence(system, 0.064, 64).items():
        assert order == pytest.approx(2.0, abs=0.1), name


@pytest.mark.parametrize("ratio", [0.3, 3.0])
def test_a_quiet_bath_brings_its_temperature(ratio: float) -> None:
    """T_w/T = 0.3 and 3, where the form of M linear in 1/T_w - 1/T would be off by such factors."""
    system = problem(slab, 2, heat=[isothermal(ratio, 2)], exchanges="conduction", conductivity=4e3)
    system = replace(system, velocities=np.zeros_like(system.velocities))
    sim = thermal_core(system)
    sim.run(2000, 0.01)
    assert np.abs(sim.temperatures / ratio - 1.0).max() < 0.02


def profile(lower: WallHeat, upper: WallHeat) -> Array:
    """T of the six layers of a lattice at rest, relaxed; there is no pressure."""
    system = problem(slab, 2, heat=[lower, upper], exchanges="conduction", conductivity=200.0)
    sites = np.stack(np.meshgrid(*[np.arange(6) + 0.5] * 2, indexing="ij"), axis=-1)
    cold = replace(system.caloric, kind="liquid", isotherm="polynomial")
    system = replace(
        system,
        positions=sites.reshape(-1, 2),
        velocities=np.zeros((36, 2)),
        temperatures=np.ones(36),
        caloric=replace(cold, parameters=[25.0, 0.0, 1.0, 0.0]),
    )
    sim = thermal_core(system)
    sim.run(4000, 0.01)
    assert np.all(sim.velocities == 0.0)
    return np.asarray(sim.temperatures.reshape(6, 6).mean(axis=0))


def test_between_two_baths_the_temperature_is_linear() -> None:
    """On a lattice exactly, up to the step: images have 2 T_w - T, so no jump at the wall."""
    t = profile(isothermal(0.8, 2), isothermal(1.4, 2))
    np.testing.assert_allclose(t, 0.85 + 0.1 * np.arange(6), atol=2e-4)


@pytest.mark.xfail(
    strict=True, reason="(1 - phi^2)^2 spreads the flux too far: the layer at the wall is cold"
)
def test_next_to_a_flux_the_temperature_is_linear() -> None:
    """It is where a particle gets a share of sum_J g_iJ phi_j: what an image of the linear
    profile would give, over the image of an adiabatic wall. Then T is linear to rounding.
    """
    t = profile(("flux", [120.0]), isothermal(1.0, 2))
    slope = np.diff(t)
    assert np.abs(slope / slope[2] - 1.0).max() < 0.01


# --- known faults of the books ------------------------------------------------------------------


@pytest.mark.xfail(
    strict=True, reason="the heat of an image over a bath and another wall is dealt to both"
)
def test_heat_at_mixed_corners() -> None:
    """No heat passes an adiabatic wall, and a wall of given flux gets that flux."""
    heat = [isothermal(1.5, 2), isothermal(0.7, 2), ADIABATIC, FLUX]
    system = problem(duct, 2, heat=heat, exchanges="full")
    sim, accounts = thermal_core(system), Accounts()
    advanced(sim, system, 3, accounts)
    assert accounts.wall_heat[2] == 0.0
    assert accounts.wall_heat[3] == pytest.approx(-40.0 * 3 * system.dt)
    assert np.abs(sim.energy_accounts()["walls"][:, 0] - accounts.wall_heat).max() < 1e-9


@pytest.mark.xfail(
    strict=True, reason="a refused update at a corner counts half by wall, and halves are cut off"
)
def test_refused_updates_at_corners_are_counted() -> None:
    system = problem(
        closed,
        3,
        heat=[ADIABATIC],
        exchanges="full_variable",
        exponents=(0.0, 0.0),
        capacity=1.5,
        conductivity=60.0,
        spread=0.5,
        noise="gaussian",
        dt=0.05,
    )
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert sim.energy_accounts()["refused"] == accounts.refused


# --- messages -----------------------------------------------------------------------------------

BAD = [
    (("isothermal", [1.0]), r'`walls\[0\].heat` "isothermal" takes 3 numbers, got 1'),
    (("isothermal", [-1.0, 0.0, 0.0]), r"`walls\[0\].heat` must be finite and > 0, got -1"),
    (("isothermal", [1.0, np.inf, 0.0]), r"`walls\[0\].heat` must be finite, got inf"),
    (("flux", [np.nan]), r"`walls\[0\].heat` must be finite, got NaN"),
    (("adiabatic", [1.0]), r'`walls\[0\].heat` "adiabatic" takes 0 numbers, got 1'),
    (("hot", []), r'`walls\[0\].heat` must be "isothermal", "adiabatic" or "flux", got "hot"'),
]


@pytest.mark.parametrize(("heat", "message"), BAD, ids=[str(heat) for heat, _ in BAD])
def test_bad_conditions_are_named(heat: WallHeat, message: str) -> None:
    system = problem(slab, 2, exchanges="full")
    with pytest.raises(ValueError, match=message):
        thermal_core(replace(system, heat=(heat, heat)))


@pytest.mark.xfail(strict=True, reason="the core panics at the first step")
def test_every_wall_needs_a_condition() -> None:
    system = problem(slab, 2, exchanges="full")
    with pytest.raises(ValueError, match=r"`walls`"):
        thermal_core(replace(system, heat=system.heat[:1]))


@pytest.mark.xfail(strict=True, reason="only the temperature at the origin is looked at")
def test_no_wall_is_colder_than_nothing() -> None:
    """T + G.x must be > 0 all along a wall; here it is -4, and most updates are refused."""
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=20.0,
        temperature=1.0,
        boltzmann_constant=1.0,
        heat_capacity=100.0,
        thermal_conductivity=500.0,
        sound_speed=10.0,
    )
    falling = sdpd.Isothermal(1.0, (0.0, 0.0, -0.5))
    with pytest.raises(ValueError, match=r"`walls\[1\].heat`"):
        sdpd.Scene(
            fluid=fluid,
            box=sdpd.Box((7.0, 7.0, 10.0), periodic="xy"),
            resolution=sdpd.Resolution(spacing=1.0, support=2.65, kernel="lucy"),
            effects=sdpd.Effects(energy=True, fluctuations=False),
            walls=(
                sdpd.Plane(axis="z", at=0.0, fluid="above", heat=falling),
                sdpd.Plane(axis="z", at=10.0, fluid="below", heat=falling),
            ),
        )
