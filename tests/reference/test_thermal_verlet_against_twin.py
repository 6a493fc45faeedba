"""Velocity Verlet of fluids with an energy: the core against the NumPy twin, and its own laws."""

from __future__ import annotations

from itertools import pairwise
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
from .test_walls_against_twin import slab
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


def assert_same_steps(
    system: ThermalSystem, steps: int, tolerance: float
) -> tuple[ThermalSystem, Accounts]:
    """The state after so many steps, which core and twin agree on, and what was exchanged."""
    sim, accounts, state = thermal_core(system, **VERLET), Accounts(), system
    for step in range(steps):
        state = thermal_verlet_step(state, step, accounts)
    sim.run(steps, system.dt)
    assert_same(sim, state, tolerance)
    got = sim.energy_accounts()
    assert got["refused"] == accounts.refused
    for name in ("body_work", "unbooked", "discarded"):
        assert got[name] == pytest.approx(getattr(accounts, name), abs=1e-10)
    return state, accounts


@pytest.mark.parametrize("bookkeeping", [True, False])
@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_steps_without_noise(dimension: int, exchanges: str, bookkeeping: bool) -> None:
    """Kernel, friction and equation of state change along."""
    index = dimension + (*EXCHANGES, *VARIABLE).index(exchanges) + bookkeeping
    system = small(
        dimension,
        exchanges=exchanges,
        bookkeeping=bookkeeping,
        kernel=("lucy", "wendland_c2")[index % 2],
        friction=("general", "central")[index // 2 % 2],
        eos=("liquid", "ideal_gas")[index % 2],
        conductivity=100.0,
        body_force=(3.0, -2.0, 1.0)[:dimension],
        body_wave=(1, 1) if exchanges in ("heating", "adiabatic") else None,
    )
    before = system.total_energy()
    state, accounts = assert_same_steps(system, 5, QUIET)
    if bookkeeping and not exchanges.startswith("bath"):
        gained = state.total_energy() - before
        assert gained == pytest.approx(accounts.body_work, abs=1e-11 * abs(before))
        assert abs(accounts.discarded) > 1e-6
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
    state, _ = assert_same_steps(system, 3, QUIET)
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
    before, state = core_energy(sim), system
    for step in range(3):
        state = thermal_verlet_step(state, step, accounts)
    sim.run(3, system.dt)
    assert_same(sim, state, 1e-9)
    assert sim.energy_accounts()["refused"] == accounts.refused > 2
    assert sim.energy_accounts()["unbooked"] == pytest.approx(accounts.unbooked, rel=1e-9)
    assert accounts.unbooked > 0.1
    assert core_energy(sim) - before == pytest.approx(accounts.unbooked, rel=1e-9)


def thin(exchanges: str) -> ThermalSystem:
    """Little friction: errors of second order rule at steps long beside those of rounding."""
    s = small(3, exchanges=exchanges, conductivity=100.0)
    return replace(
        s, friction_across=0.1 * s.friction_across, friction_along=0.1 * s.friction_along
    )


@pytest.mark.parametrize("bookkeeping", [True, False])
@pytest.mark.parametrize("exchanges", [*EXCHANGES, *VARIABLE])
def test_it_is_of_second_order_without_noise(exchanges: str, bookkeeping: bool) -> None:
    system = replace(thin(exchanges), bookkeeping=bookkeeping)
    for name, order in order_of_convergence(system, 0.064, 64, **VERLET).items():
        assert order == pytest.approx(2.0, abs=0.03), name


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "heating", "conduction"])
@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_energy_and_momentum_to_rounding(dimension: int, noise: str, exchanges: str) -> None:
    system = small(dimension, exchanges=exchanges, noise=noise, eos="liquid", dt=0.002)
    wave = replace(system, body_force=(3.0, -2.0, 1.0)[:dimension], body_wave=(1, 1))
    sim, driven = thermal_core(system, **VERLET), thermal_core(wave, **VERLET)
    steps, before = 100, core_energy(sim)
    for each in (sim, driven):
        each.run(steps, system.dt)
    scale = np.sqrt(steps * system.size) * np.finfo(float).eps * 100.0
    assert np.all(np.abs(sim.velocities.sum(axis=0)) < scale)
    assert abs(core_energy(sim) - before) < 1e-12 * abs(before)
    accounts = driven.energy_accounts()
    assert abs(accounts["discarded"]) > 1e-5
    assert accounts["body_work"] != 0.0
    gained = core_energy(driven) - before - accounts["body_work"]
    assert abs(gained) < 1e-12 * abs(before)


@pytest.mark.parametrize("exchanges", ["full", "heating", "conduction_variable"])
def test_both_integrators_tend_to_the_same_motion(exchanges: str) -> None:
    """Without noise they differ by errors of second order: a quarter for half the step."""
    differences = []
    for n in (64, 128, 256):
        system = replace(thin(exchanges), dt=0.064 / n)
        one, other = thermal_core(system, **VERLET), thermal_core(system)
        for sim in (one, other):
            sim.run(n, system.dt)
        pairs = [(np.asarray(s.velocities), np.asarray(s.temperatures)) for s in (one, other)]
        differences.append([np.abs(a - b).max() for a, b in zip(*pairs, strict=True)])
    table = np.array(differences)
    np.testing.assert_allclose(table[:-1] / table[1:], 4.0, rtol=0.05)
    assert table[-1].max() < 1e-4


def energy_error(system: ThermalSystem, steps: int) -> float:
    sim = thermal_core(system, **VERLET)
    before = core_energy(sim)
    sim.run(steps, system.dt)
    return core_energy(sim) - before


@pytest.mark.parametrize("exchanges", ["full", "full_variable", "adiabatic"])
def test_without_books_energy_errs_at_second_order(exchanges: str) -> None:
    system = replace(thin(exchanges), bookkeeping=False)
    errors = [energy_error(replace(system, dt=0.064 / n), n) for n in (64, 128, 256)]
    ratios = [a / b for a, b in pairwise(errors)]
    assert ratios == pytest.approx([4.0, 4.0], rel=0.05)


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
    assert one.energy_accounts()["discarded"] == pytest.approx(
        again.energy_accounts()["discarded"], rel=1e-12
    )


def test_walls_are_refused() -> None:
    system = thermal_wall_problem(slab, 3, [("adiabatic", [])], exchanges="full")
    with pytest.raises(ValueError, match=r"`integrator` must be .* has walls"):
        thermal_core(system, **VERLET)
