"""Velocity Verlet of fluids with an energy: the core against the NumPy twin, and its own laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from .test_core_observers import stress_rows
from .test_thermal_against_twin import (
    DIMENSIONS,
    NOISY,
    QUIET,
    SMALL,
    assert_same,
    order_of_convergence,
    same_bits,
    scaled,
)
from .thermal_build import (
    EXCHANGES,
    VARIABLE,
    core_energy,
    replace,
    thermal_core,
    thermal_problem,
    thermal_wall_problem,
)
from .twin.thermal import ThermalSystem
from .twin.thermal_splitting import Accounts
from .twin.thermal_verlet import thermal_verlet_step

VERLET = {"integrator": "velocity_verlet"}


def small(dimension: int, **options: Any) -> ThermalSystem:
    return thermal_problem(dimension, **{**SMALL[dimension], **options})


def assert_same_steps(system: ThermalSystem, steps: int, tolerance: float) -> ThermalSystem:
    """The state after so many steps, which core and twin agree on, accounts included."""
    sim, accounts, state = thermal_core(system, **VERLET), Accounts(), system
    for step in range(steps):
        state = thermal_verlet_step(state, step, accounts)
    sim.run(steps, system.dt)
    assert_same(sim, state, tolerance)
    got = sim.energy_accounts()
    assert got["refused"] == accounts.refused
    for name in ("body_work", "unbooked", "discarded"):
        assert got[name] == pytest.approx(getattr(accounts, name), abs=1e-10)
    return state


@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_steps_without_noise(dimension: int, exchanges: str) -> None:
    """Kernel, friction, equation of state and body force change along."""
    index = dimension + (*EXCHANGES, *VARIABLE).index(exchanges)
    system = small(
        dimension,
        exchanges=exchanges,
        kernel=("lucy", "wendland_c2")[index % 2],
        friction=("general", "central")[index // 2 % 2],
        eos=("liquid", "ideal_gas")[index % 2],
        conductivity=100.0,
        body_force=(3.0, -2.0, 1.0)[:dimension],
        body_wave=(1, 1) if exchanges == "heating" else None,
    )
    state = assert_same_steps(system, 5, QUIET)
    assert np.abs(state.temperatures / system.temperatures - 1.0).max() > 1e-4


@pytest.mark.parametrize(("exchanges", "capacity", "exponents"), NOISY)
@pytest.mark.parametrize("noise", ["gaussian", "uniform"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_steps_with_noise(
    dimension: int, noise: str, exchanges: str, capacity: float, exponents: tuple[float, float]
) -> None:
    system = small(
        dimension,
        exchanges=exchanges,
        capacity=capacity,
        conductivity=12.0 * capacity,
        exponents=exponents,
        noise=noise,
        kernel=("lucy", "wendland_c2")[dimension % 2],
        friction=("general", "central")[dimension % 2],
        dt=0.004,
    )
    state = assert_same_steps(system, 3, QUIET)
    assert np.std(state.temperatures) > 0.05 or exchanges == "bath"


def test_the_same_steps_in_si_units() -> None:
    system = small(3, exchanges="full_variable", capacity=25.0, noise="gaussian", dt=0.002)
    assert_same_steps(scaled(system, 3e-10, 0.0, 2e-13), 3, 1e-11)


def test_heat_that_would_leave_none_is_not_given() -> None:
    """C = 1.5 k_B, hardly a fluid: the same particles are refused it, and it is in the books."""
    system = small(
        3,
        exchanges="full",
        capacity=1.5,
        conductivity=20.0,
        spread=0.5,
        noise="gaussian",
        dt=0.02,
    )
    sim, accounts = thermal_core(system, **VERLET), Accounts()
    state = system
    for step in range(3):
        state = thermal_verlet_step(state, step, accounts)
    sim.run(3, system.dt)
    assert_same(sim, state, 1e-9)
    assert sim.energy_accounts()["refused"] == accounts.refused > 2
    assert sim.energy_accounts()["unbooked"] == pytest.approx(accounts.unbooked, rel=1e-9)
    assert accounts.unbooked > 0.1


@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
def test_it_is_of_second_order_without_noise(exchanges: str) -> None:
    system = small(3, exchanges=exchanges, conductivity=100.0)
    for name, order in order_of_convergence(system, 0.064, 32, **VERLET).items():
        assert order == pytest.approx(2.0, abs=0.05), name


@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_momentum_to_rounding(dimension: int, noise: str) -> None:
    system = small(dimension, exchanges="full_variable", noise=noise, eos="liquid", dt=0.002)
    sim, steps = thermal_core(system, **VERLET), 100
    sim.run(steps, system.dt)
    scale = np.sqrt(steps * system.size) * np.finfo(float).eps * 100.0
    assert np.all(np.abs(sim.velocities.sum(axis=0)) < scale)


def energy_error(system: ThermalSystem, steps: int) -> float:
    sim = thermal_core(system, **VERLET)
    before = core_energy(sim)
    sim.run(steps, system.dt)
    return core_energy(sim) - before


@pytest.mark.parametrize("exchanges", ["full", "full_variable"])
def test_energy_without_noise_to_second_order(exchanges: str) -> None:
    system = small(3, exchanges=exchanges, conductivity=100.0)
    errors = [energy_error(replace(system, dt=0.064 / n), n) for n in (32, 64, 128)]
    ratios = [a / b for a, b in zip(errors, errors[1:], strict=False)]
    assert ratios == pytest.approx([4.0, 4.0], rel=0.1)


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "bath", "conduction"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_stress_is_the_change_of_the_helfand_moment(dimension: int, exchanges: str) -> None:
    """For a blob that touches no image of itself."""
    base = small(dimension, exchanges=exchanges, noise="gaussian", dt=0.002)
    system = replace(base, positions=base.positions + base.box, box=3.0 * base.box)
    sim, quiet = thermal_core(system, **VERLET), thermal_core(system, **VERLET)
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


@pytest.mark.parametrize("exchanges", ["full_variable", "bath_conduction"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_bits_on_any_number_of_threads_and_across_save_and_load(
    dimension: int, exchanges: str
) -> None:
    """Fast enough for lists and grid to be renewed within the steps."""
    cells = (16, 15) if dimension == 2 else (7, 7, 6)
    system = thermal_problem(
        dimension, cells=cells, support=2.2, exchanges=exchanges, noise="gaussian", dt=0.004
    )
    options = {**VERLET, "skin": 0.05}
    one, two, three = (thermal_core(system, threads=k, **options) for k in (1, 2, 3))
    for sim in (one, two):
        sim.run(40, system.dt)
    three.run(23, system.dt)
    again = thermal_core(system, threads=2, **options)
    again.set_state(three.state())
    again.run(17, system.dt)
    assert same_bits(one, two)
    assert same_bits(one, again)
    assert one.statistics()["grid_renewals"] > 1
    assert one.energy_accounts()["body_work"] == again.energy_accounts()["body_work"]


def test_walls_are_refused() -> None:
    system = thermal_wall_problem("planes", 3, [("adiabatic", [])], exchanges="full")
    with pytest.raises(ValueError, match="`integrator` must be .* has walls"):
        thermal_core(system, **VERLET)
