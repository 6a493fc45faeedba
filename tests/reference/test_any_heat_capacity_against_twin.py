"""Any heat capacity c_v(rho, T): the core against the NumPy twin, which reads the same table.

The particles of a pair have different heat capacities C_i and C_j. The bounds are 1e-12 of thermal
speed and temperature without noise, and 1e-11 with noise, where the width is a difference.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import _core

from .test_thermal_against_twin import (
    QUIET,
    SMALL,
    assert_same,
    assert_same_accounts,
    scaled,
)
from .test_thermal_walls_against_twin import ADIABATIC, balance, isothermal, mixed, problem
from .test_thermal_walls_against_twin import assert_same_accounts as assert_same_wall_accounts
from .test_walls_against_twin import Geometry, closed, duct, slab
from .thermal_build import (
    advanced,
    caloric,
    core_energy,
    differences,
    helmholtz,
    replace,
    tabulated,
    thermal_core,
    thermal_problem,
)
from .twin.table import Table
from .twin.thermal import ThermalSystem
from .twin.thermal_splitting import Accounts
from .twin.thermal_verlet import thermal_verlet_step

Array = NDArray[np.float64]

LOUD = 1e-11
VERLET = {"integrator": "velocity_verlet"}
BATHS = ("bath_general", "bath_conduction_general")
GENERAL = ("full_general", "heating_general", "conduction_general", *BATHS)
METROPOLIS = ("full_metropolis", "heating_metropolis", "conduction_metropolis")
EXPONENTS = [(0.0, 0.0), (0.7, 0.9)]
TABLE: dict[str, Any] = {"eos": "table", "capacity": 5.0, "conductivity": 60.0, "spread": 0.4}


def cases(*names: str) -> list[tuple[int, tuple[float, float], str]]:
    """D, exponents and exchanges; in three dimensions the first name alone."""
    constant, follows = EXPONENTS
    flat = [(2, constant, name) for name in names]
    flat += [(2, follows, name) for name in names if name not in (*BATHS, "adiabatic")]
    return [*flat, (3, follows, names[0])]


def small(dimension: int, **options: Any) -> ThermalSystem:
    """C from 3.7 to 6.9 k_B."""
    return thermal_problem(dimension, **{**TABLE, **SMALL[dimension], "dt": 0.006, **options})


def largest_ratio(system: ThermalSystem) -> float:
    """C_i/C_j of the most unequal pair."""
    logarithms, p = np.log(system.capacities), system.pairs
    return float(np.exp(np.abs(logarithms[p.i] - logarithms[p.j]).max()))


# --- the table ----------------------------------------------------------------------------------


def test_the_table_is_the_interpolant_of_its_numbers() -> None:
    """Within the table and beyond it, where entropy goes on as a straight line."""
    law = tabulated(5.0)
    rho, t = (x.ravel() for x in np.meshgrid([0.47, 0.71, 0.97, 1.3, 2.4], [0.07, 0.4, 1.1, 9.0]))
    p, e, s, _, _, capacity = _core.caloric_evaluate(("table", law.parameters, ""), rho, t)
    heat = law.heats(rho, t)
    warm, c_v = law.states(rho, heat)
    np.testing.assert_allclose(warm, t, rtol=1e-13)
    np.testing.assert_allclose(capacity, c_v, rtol=1e-11)
    np.testing.assert_allclose(p, law.pressure(rho, t), rtol=1e-11)
    np.testing.assert_allclose(e, law.cold(rho) + heat, rtol=1e-12, atol=1e-12)
    entropy = law.entropy(rho, t)
    np.testing.assert_allclose(s, entropy, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(law.temperature(rho, entropy), t, rtol=1e-12)


@pytest.mark.parametrize("line", ["isotherm", "adiabat"])
def test_squares_of_speeds_of_sound_are_slopes_of_the_pressure(line: str) -> None:
    """Beyond the table as well."""
    law, step = tabulated(5.0), 1e-6
    rho, t = (x.ravel() for x in np.meshgrid([0.47, 0.71, 0.97, 1.3, 2.4], [0.07, 0.4, 1.1, 9.0]))
    entropy = law.entropy(rho, t)

    def pressure(rho: Array) -> Array:
        return law.pressure(rho, t if line == "isotherm" else law.temperature(rho, entropy))

    found = _core.caloric_evaluate(("table", law.parameters, ""), rho, t)
    expected = (pressure(rho + step) - pressure(rho - step)) / (2.0 * step)
    np.testing.assert_allclose(found[3 if line == "isotherm" else 4], expected, rtol=1e-6)


def test_the_table_is_that_of_its_free_energy() -> None:
    """P = rho^2 df/drho and c_v = -T d2f/dT2, to what so coarse a table holds."""
    rho, t = (x.ravel() for x in np.meshgrid([0.8, 1.0, 1.25], [0.5, 1.0, 1.6]))
    law = tabulated(5.0)
    step = 1e-5
    rise = helmholtz(rho + step, t, 5.0) - helmholtz(rho - step, t, 5.0)
    np.testing.assert_allclose(law.pressure(rho, t), rho**2 * rise / (2.0 * step), rtol=1e-3)
    c_v = law.states(rho, law.heats(rho, t))[1]
    np.testing.assert_allclose(c_v, 2.5 * (1.0 + t) * (1.0 + 1.2 * np.log(rho)), rtol=1e-2)


# --- the splitting ------------------------------------------------------------------------------


@pytest.mark.parametrize(("dimension", "exponents", "exchanges"), cases(*GENERAL, "adiabatic"))
def test_steps_without_noise(
    dimension: int, exponents: tuple[float, float], exchanges: str
) -> None:
    system = small(
        dimension,
        exchanges=exchanges,
        exponents=exponents,
        friction=("general", "central")[dimension % 2],
        body_force=(3.0, -2.0, 1.0)[:dimension],
    )
    assert largest_ratio(system) > 1.7
    sim, accounts = thermal_core(system), Accounts()
    before = system.total_energy()
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, QUIET)
    assert_same_accounts(sim, accounts, 1e-10)
    if exchanges not in BATHS:
        gained = state.total_energy() - before
        assert gained == pytest.approx(accounts.body_work, abs=1e-11 * abs(before))


@pytest.mark.parametrize(("dimension", "exponents", "exchanges"), cases(*GENERAL))
def test_steps_with_noise(dimension: int, exponents: tuple[float, float], exchanges: str) -> None:
    system = small(
        dimension,
        exchanges=exchanges,
        exponents=exponents,
        noise="gaussian",
        friction=("general", "central")[exponents[0] == 0.0],
        kernel=("lucy", "wendland_c2")[dimension % 2],
    )
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert_same_accounts(sim, accounts, 1e-10)


@pytest.mark.parametrize(("dimension", "exponents", "exchanges"), cases(*METROPOLIS))
def test_the_same_exchanges_are_accepted(
    dimension: int, exponents: tuple[float, float], exchanges: str
) -> None:
    system = small(
        dimension,
        exchanges=exchanges,
        exponents=exponents,
        noise="gaussian",
        friction=("general", "central")[exponents[0] == 0.0],
    )
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert_same_accounts(sim, accounts, 1e-10)
    assert accounts.refused > 2


@pytest.mark.parametrize("exchanges", METROPOLIS)
def test_acceptance_with_a_constant_heat_capacity(exchanges: str) -> None:
    """ln of the ratio of the weights is (k - 1) ln(E'/E) of both."""
    system = small(2, exchanges=exchanges, eos="liquid", noise="gaussian", dt=0.012)
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert sim.energy_accounts()["refused"] == accounts.refused > 2


def test_exchanges_that_would_leave_no_energy_are_not_made() -> None:
    """C of 1.5 k_B, hardly a fluid."""
    system = small(2, exchanges="full_general", capacity=1.5, noise="gaussian", dt=0.03)
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert_same_accounts(sim, accounts, 1e-10)
    assert accounts.refused > 5
    assert core_energy(sim) == pytest.approx(before, rel=1e-12)


def in_si(system: ThermalSystem) -> ThermalSystem:
    """The same problem in nanometres and kelvin, the table with it."""
    length, time, kelvin = 3e-10, 2e-13, 290.0
    twin = scaled(replace(system, caloric=caloric("ideal_gas", 5.0)), length, 0.0, time)
    specific = (length / time) ** 2
    numbers = np.array(system.caloric.parameters)
    n = int(numbers[2])
    numbers[0] += np.log(twin.mass / length**system.dimension)
    numbers[3] += np.log(specific)
    numbers[6 : 6 + 2 * n] *= specific
    numbers[6 + 2 * n :] *= specific / kelvin
    return replace(twin, caloric=Table("table", numbers.tolist()))


@pytest.mark.parametrize("exchanges", ["full_general", "full_metropolis"])
def test_the_same_steps_in_si_units(exchanges: str) -> None:
    system = in_si(small(2, exchanges=exchanges, noise="gaussian"))
    assert system.boltzmann_constant == pytest.approx(1.380649e-23)
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert sim.energy_accounts()["refused"] == accounts.refused


# --- velocity Verlet ----------------------------------------------------------------------------


@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize(("dimension", "exponents", "exchanges"), cases(*GENERAL[:3]))
def test_velocity_verlet(
    dimension: int, exponents: tuple[float, float], exchanges: str, noise: str
) -> None:
    system = small(dimension, exchanges=exchanges, exponents=exponents, noise=noise, dt=0.003)
    sim, accounts, state = thermal_core(system, **VERLET), Accounts(), system
    for step in range(2):
        state = thermal_verlet_step(state, step, accounts)
    sim.run(2, system.dt)
    assert_same(sim, state, QUIET)
    got = sim.energy_accounts()
    assert got["refused"] == accounts.refused
    for name in ("unbooked", "discarded"):
        assert got[name] == pytest.approx(getattr(accounts, name), abs=1e-10)


@pytest.mark.parametrize("exchanges", [*BATHS, "adiabatic"])
def test_velocity_verlet_with_constant_coefficients(exchanges: str) -> None:
    noise = "none" if exchanges == "adiabatic" else "gaussian"
    system = small(2, exchanges=exchanges, exponents=(0.0, 0.0), noise=noise)
    sim, state = thermal_core(system, **VERLET), system
    for step in range(2):
        state = thermal_verlet_step(state, step)
    sim.run(2, system.dt)
    assert_same(sim, state, QUIET)


def test_the_drift_of_conduction_between_unequal_capacities_shows() -> None:
    """2 k_B kappa g Ti Tj (chi_i/C_i - chi_j/C_j) is not 0: without it the twin is far off."""
    system = small(2, exchanges="conduction_general", noise="gaussian", dt=0.003)
    equal = replace(system, caloric=EqualCapacities("table", system.caloric.parameters))
    sim = thermal_core(system, **VERLET)
    sim.run(1, system.dt)
    assert_same(sim, thermal_verlet_step(system, 0), QUIET)
    assert differences(sim, thermal_verlet_step(equal, 0))["temperatures"] > 1e-4


class EqualCapacities(Table):
    """Wrong on purpose: heat capacities that are the same in the drift alone."""

    def states(self, rho: Array, heat: Array) -> tuple[Array, Array]:
        t, capacity = super().states(rho, heat)
        return t, np.full_like(capacity, capacity.mean())


# --- walls --------------------------------------------------------------------------------------

WALLS = [
    (slab, 2, "none", [isothermal(1.5, 2), ADIABATIC]),
    (slab, 2, "gaussian", [isothermal(1.5, 2), ADIABATIC]),
    (slab, 2, "gaussian", [isothermal(0.6, 2), isothermal(1.7, 2, (0.0, 0.05, 0.0))]),
    (duct, 2, "none", mixed(2, 4)),
    (duct, 2, "gaussian", mixed(2, 4)),
    (closed, 3, "gaussian", [isothermal(1.3, 3), ADIABATIC]),
]


@pytest.mark.parametrize(("geometry", "dimension", "noise", "heat"), WALLS)
def test_walls(geometry: Geometry, dimension: int, noise: str, heat: Any) -> None:
    """Walls that slide, baths and mirrors, corners: gains of particles of unequal capacities."""
    system = problem(geometry, dimension, heat=heat, exchanges="full_general", noise=noise, **TABLE)
    sim, accounts = thermal_core(system), Accounts()
    before = core_energy(sim)
    state = advanced(sim, system, 1, accounts)
    assert_same(sim, state, QUIET if noise == "none" else LOUD)
    assert_same_wall_accounts(sim, accounts)
    assert sim.energy_accounts()["refused"] == accounts.refused
    assert abs(balance(sim, before)) < 1e-12 * abs(before)
    assert np.abs(accounts.wall_heat).max() > 0.1


@pytest.mark.parametrize("exchanges", GENERAL[1:])
def test_every_exchange_at_walls(exchanges: str) -> None:
    system = problem(
        slab, 2, heat=WALLS[0][3], exchanges=exchanges, noise="gaussian", dt=0.01, **TABLE
    )
    sim, accounts = thermal_core(system), Accounts()
    assert_same(sim, advanced(sim, system, 1, accounts), LOUD)
    assert_same_wall_accounts(sim, accounts)
