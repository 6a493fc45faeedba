"""The current of energy: exact for the discrete step, by part the twin's, and it only reads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from .test_thermal_against_twin import SMALL, scaled
from .thermal_build import orders, replace, thermal_core, thermal_problem
from .twin.kernels import force_factor
from .twin.thermal import Contact, ThermalSystem
from .twin.thermal_splitting import Accounts, Sweep, kicked

Array = NDArray[np.float64]

CONSERVING = ("full", "full_variable", "heating", "conduction", "adiabatic")
PARTS = ("conduction", "friction", "pressure", "convection", "conduction noise", "friction noise")


def rows(observer: Any, dimension: int) -> Array:
    """Parts of the flux, (intervals, 6, D)."""
    return np.asarray(observer.table())[:, 2:].reshape(-1, 6, dimension)


def moment(sim: Any, system: ThermalSystem) -> Array:
    """sum of e_i r_i of unwrapped positions."""
    kinetic = 0.5 * system.mass * np.sum(np.asarray(sim.velocities) ** 2, axis=1)
    energies = kinetic + np.asarray(sim.internal_energies)
    return np.asarray(energies @ (sim.positions + sim.images * system.box))


# --- the Helfand moment -----------------------------------------------------------------------


@pytest.mark.parametrize("eos", ["ideal_gas", "liquid"])
@pytest.mark.parametrize("noise", ["none", "gaussian"])
@pytest.mark.parametrize("exchanges", CONSERVING)
@pytest.mark.parametrize("dimension", [2, 3])
def test_it_is_the_change_of_the_helfand_moment(
    dimension: int, exchanges: str, noise: str, eos: str
) -> None:
    """For a blob that touches no image of itself; with a drift, so that it crosses the faces."""
    system = thermal_problem(
        dimension,
        **SMALL[dimension],
        exchanges=exchanges,
        noise=noise,
        eos=eos,
        capacity=12.0,
        dt=0.006,
    )
    wide = 3.0 * system.box
    drift = np.array([7.0, -4.0, 2.0])[:dimension]
    system = replace(
        system,
        positions=system.positions + 1.9 * system.box,
        velocities=system.velocities + drift,
        box=wide,
    )
    if eos == "ideal_gas":
        system = scaled(system, 3e-10, 0.0, 2e-13)
    sim = thermal_core(system, positions=np.mod(system.positions, system.box))
    observer = sim.attach_heat_current(2)
    moments = []
    for _ in range(6):
        sim.run(2, system.dt)
        moments.append(moment(sim, system))
    got = rows(observer, dimension)
    got = got.sum(axis=1) * float(np.prod(system.box)) * 2 * system.dt
    expected = np.diff(moments, axis=0)
    assert got.shape == expected.shape
    scale = np.abs(moments).max()
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=3e-13 * scale)
    assert np.abs(expected).max() > 1e-3 * scale
    conducts = exchanges in ("full", "full_variable", "conduction")
    rubs = exchanges not in ("conduction", "adiabatic")
    present = [conducts, rubs, True, True, conducts, rubs]
    if noise == "none" or exchanges == "adiabatic":
        present[4:] = False, False
    largest = np.abs(rows(observer, dimension)).max(axis=(0, 2))
    rounding = 1e-12 * largest.max()
    assert (largest > rounding).tolist() == present, dict(zip(PARTS, largest, strict=True))


# --- by part ----------------------------------------------------------------------------------


class Ledger(Sweep):
    """A sweep that notes what each contact hands over."""

    def __init__(self, system: ThermalSystem, time: float) -> None:
        super().__init__(system, time, Accounts())
        self.conduction = np.zeros((2, system.dimension))  # without the noise, by the noise
        self.friction = np.zeros((2, system.dimension))

    def energies(self, contact: Contact) -> Array:
        ends = (contact.i, contact.j)
        return np.array(
            [
                self.heat[k] + 0.5 * self.system.mass * sum(v * v for v in self.velocities[k])
                for k in ends
            ]
        )

    def handed(self, contact: Contact, before: Array) -> Array:
        change = self.energies(contact) - before
        way = self.system.positions[contact.i] - self.system.positions[contact.j]
        way -= self.system.box * np.rint(way / self.system.box)
        return way * 0.5 * (change[0] - change[1])

    def rub(self, contact: Contact) -> None:
        self.note(contact, super().rub, self.friction)

    def conduct(self, contact: Contact) -> None:
        self.note(contact, super().conduct, self.conduction)

    def note(self, contact: Contact, exchange: Callable[[Contact], None], account: Array) -> None:
        """First as it is without the noise: what the noise adds is linear in the variates."""
        before, ends = self.energies(contact), (contact.i, contact.j)
        saved = [(self.heat[k], list(self.velocities[k])) for k in ends]
        exchange(contact._replace(xi=[0.0] * 4))
        mean = self.handed(contact, before)
        for k, (heat, velocity) in zip(ends, saved, strict=True):
            self.heat[k], self.velocities[k] = heat, velocity
        exchange(contact)
        account += np.array([mean, self.handed(contact, before) - mean])


def swept(system: ThermalSystem, order: Any, half: int) -> tuple[ThermalSystem, Array, Array]:
    """Half the exchanges of step 1, and what they hand over by conduction and friction."""
    sweep = Ledger(system, 0.5 * system.dt)
    for pairs in reversed(order[0]) if half else order[0]:
        sweep.run(system.direct_contacts(pairs, 1, half), backward=bool(half))
    return sweep.end(), sweep.conduction, sweep.friction


def pressed(system: ThermalSystem) -> tuple[ThermalSystem, Array, Array]:
    """Half a kick: the system after it, work by particle, what pressure hands over.

    From the force of a pair on either end and P dV of either, as they are, not from their sum.
    """
    after, work = kicked(system, Accounts())
    u = 0.5 * (system.velocities + after.velocities)
    p = system.pairs
    a = system.pressures / system.number_densities**2
    f = force_factor(system.kernel, system.dimension, p.distance, system.support)
    force = ((a[p.i] + a[p.j]) * f)[:, None] * p.vector
    closing = f * np.sum(p.vector * (u[p.i] - u[p.j]), axis=1)
    into_i = np.sum(force * u[p.i], axis=1) - a[p.i] * closing
    into_j = -np.sum(force * u[p.j], axis=1) - a[p.j] * closing
    assert np.abs(into_i + into_j).max() < 1e-11 * np.abs(into_i).max()
    time = 0.5 * system.dt
    return after, work, time * np.sum(p.vector * (0.5 * (into_i - into_j))[:, None], axis=0)


@pytest.mark.parametrize("exchanges", ["full", "full_variable"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_every_part_is_the_twins(dimension: int, exchanges: str) -> None:
    """One step (number 1) of a periodic box, with noise."""
    base = thermal_problem(
        dimension,
        **SMALL[dimension],
        exchanges=exchanges,
        noise="gaussian",
        capacity=12.0,
        eos="liquid",
        dt=0.01,
    )
    sim = thermal_core(base)
    observer = sim.attach_heat_current(1)
    sim.run(1, base.dt)  # step 0 opens the first interval
    system = replace(
        base,
        positions=np.array(sim.positions),
        velocities=np.array(sim.velocities),
        temperatures=np.array(sim.temperatures),
    )
    forward = orders(sim)
    sim.run(1, base.dt)
    backward = orders(sim)
    got = rows(observer, dimension)[0] * float(np.prod(base.box)) * base.dt

    state, heat, rub = swept(system, forward, 0)
    entropies, energies = state.entropies, state.internal_energies
    fast, first, push = pressed(state)
    booked = energies - first
    whole = booked + 0.5 * base.mass * np.sum(fast.velocities**2, axis=1)
    carried = base.dt * whole @ fast.velocities
    moved = replace(fast, positions=fast.positions + base.dt * fast.velocities)
    adiabat = moved.caloric.temperature(moved.densities, entropies / base.mass)
    moved, second, again = pressed(replace(moved, temperatures=adiabat))
    rest = booked - second - base.mass * moved.caloric.cold(moved.densities)
    _, more, rubbed = swept(moved.heated(rest), backward, 1)
    heat, rub = heat + more, rub + rubbed
    expected = np.array([heat[0], rub[0], push + again, carried, heat[1], rub[1]])
    for part in range(6):
        scale = np.abs(expected[part]).max()
        np.testing.assert_allclose(got[part], expected[part], rtol=0, atol=1e-8 * scale)
        assert scale > 1e-3


# --- it only reads ----------------------------------------------------------------------------


def test_it_changes_no_bit_and_has_the_same_bits_on_all_threads() -> None:
    system = thermal_problem(
        3, cells=(9, 9, 9), support=2.2, exchanges="full_variable", noise="gaussian", dt=0.005
    )

    def state(threads: int, observed: bool) -> tuple[Any, ...]:
        sim = thermal_core(system, threads=threads)
        tables = []
        if observed:
            series, products = sim.attach_heat_current(2), sim.attach_heat_correlator(1, 4, 2)
            sim.attach_stress(2)
        sim.run(6, system.dt)
        if observed:
            tables = [np.array(series.table()), np.array(products.blocks())]
        return np.array(sim.positions), np.array(sim.temperatures), *tables

    plain, one, three = state(1, False), state(1, True), state(3, True)
    for a, b in zip(plain, one, strict=False):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(one, three, strict=True):
        np.testing.assert_array_equal(a, b)
    assert np.abs(one[2]).max() > 0.0


def test_without_the_books_there_is_none() -> None:
    sim = thermal_core(thermal_problem(2, **SMALL[2], bookkeeping=False))
    with pytest.raises(ValueError, match="`energy_bookkeeping` must be True"):
        sim.attach_heat_current(1)
