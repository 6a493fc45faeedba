"""Velocity Verlet with energies, one step at a time.

E form of the Ito equations (Espanol and Revenga 2003): of a pair, with X = Ti Tj/(Ti + Tj) and
phi_i = dphi/dT_i, f = -[(1 - c) phi + k_B X (phi_i/Ci + phi_j/Cj)] G u, <dF dF> = 4 k_B X phi G dt,
c = Ti Tj/(Ti + Tj)^2 (k_B/Ci + k_B/Cj),
dE_i = -u.(f dt + dF)/2 + 2 kappa g [chi (Tj - Ti) + k_B Ti Tj (chi_i/Ci - chi_j/Cj)] dt + dq. The
product u.dF is that of the mean of both ends of the step (Stratonovich), which holds Ito's term
-2 k_B X tr G/m; the widths of dF and dq are those of the temperatures at its start (Ito).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .noise import pair_variates
from .system import Pairs, System
from .thermal import ThermalSystem
from .thermal_splitting import Accounts

Array = NDArray[np.float64]


def power_law(system: ThermalSystem, ti: Array, tj: Array, exponent: float) -> tuple[Array, Array]:
    """((Ti + Tj)/2 T_0)^n, and its derivative by either temperature."""
    mean = 0.5 * (ti + tj) / system.reference_temperature
    slope = 0.5 * exponent * mean ** (exponent - 1.0) / system.reference_temperature
    return mean**exponent, slope


def variates(system: ThermalSystem, p: Pairs, step: int) -> Array:
    """Four variates of each pair with the sign of the order of ids, (n, 4)."""
    a, b = system.particle_ids[p.i], system.particle_ids[p.j]
    xi = pair_variates(system.seed, "pair_thermal_force", step, 0, a, b, system.noise, 4)
    return np.where(a < b, 1.0, -1.0)[:, None] * xi


def friction(system: ThermalSystem, step: int, cold: Array) -> Array:
    """Drag and random force of each pair on i, (n, D); the noise has the temperatures `cold`."""
    s, p = system, system.pairs
    (a, b), g = s.across_along, s.coupling(p)
    ti, tj = s.temperatures[p.i], s.temperatures[p.j]
    k, capacities = s.boltzmann_constant, s.capacities
    ci, cj = capacities[p.i], capacities[p.j]
    reduced = ti * tj / (ti + tj)
    factor, slope = power_law(s, ti, tj, s.exponents[0])
    if s.noisy and s.heats:
        c = ti * tj / (ti + tj) ** 2 * (k / ci + k / cj)
        factor = (1.0 - c) * factor + k * reduced * (slope / ci + slope / cj)
    u = s.velocities[p.i] - s.velocities[p.j]
    along = np.sum(p.unit * u, axis=1, keepdims=True)
    force = -(factor * g)[:, None] * (a * u + b * along * p.unit)
    if s.noisy:
        ti, tj = cold[p.i], cold[p.j]
        phi, _ = power_law(s, ti, tj, s.exponents[0])
        width = np.sqrt(2.0 * k * 2.0 * ti * tj / (ti + tj) * phi * g / s.dt)[:, None]
        xi = variates(s, p, step)[:, : s.dimension]
        along = np.sum(p.unit * xi, axis=1, keepdims=True)
        force += width * (np.sqrt(a) * xi + (np.sqrt(a + b) - np.sqrt(a)) * along * p.unit)
    return force


def conduction(system: ThermalSystem, step: int, cold: Array) -> Array:
    """Heat per time from j to i of each pair, (n,)."""
    s, p = system, system.pairs
    ti, tj = s.temperatures[p.i], s.temperatures[p.j]
    kappa = s.conductivity * s.coupling(p)
    chi, slope = power_law(s, ti, tj, s.exponents[1])
    heat = -2.0 * kappa * chi * (ti - tj)
    if s.noisy:
        k, capacities = s.boltzmann_constant, s.capacities
        heat += 2.0 * k * kappa * ti * tj * slope * (1.0 / capacities[p.i] - 1.0 / capacities[p.j])
        ti, tj = cold[p.i], cold[p.j]
        chi, _ = power_law(s, ti, tj, s.exponents[1])
        xi = variates(s, p, step)[:, 3]
        heat += np.sqrt(4.0 * kappa * chi * k * ti * tj / s.dt) * xi
    return heat


def rates(system: ThermalSystem, step: int, cold: Array) -> tuple[Array, Array]:
    """Forces (N, D) and heat per time (N,)."""
    p, heat = system.pairs, np.zeros(system.size)
    force = system.conservative()
    if system.rubs:
        pair = friction(system, step, cold)
        force = force + System.gather(system, p, pair)
        if system.heats:
            power = np.sum(pair * (system.velocities[p.i] - system.velocities[p.j]), axis=1)
            np.add.at(heat, p.i, -0.5 * power)
            np.add.at(heat, p.j, -0.5 * power)
    if system.conducts:
        across = conduction(system, step, cold)
        np.add.at(heat, p.i, across)
        np.add.at(heat, p.j, -across)
    return force, heat


def given(system: ThermalSystem, heat: Array, accounts: Accounts) -> tuple[ThermalSystem, Array]:
    """The system with that much more energy, and what was given: none that would leave none."""
    thermal = system.thermal
    refused = thermal + heat <= 0.0
    accounts.refused += int(refused.sum())
    accounts.unbooked -= float(heat[refused].sum())
    part = np.where(refused, 0.0, heat)
    return system.heated(thermal + part), part


def kicked(system: ThermalSystem, force: Array, accounts: Accounts) -> ThermalSystem:
    """Half a kick, and the body force's work in it."""
    half = 0.5 * system.dt
    velocities = system.velocities + half / system.mass * force
    mean = 0.5 * (velocities + system.velocities)
    accounts.body_work += half * float(np.sum(system.external_forces() * mean))
    return replace(system, velocities=velocities)


def unaccounted(
    start: ThermalSystem, predictor: ThermalSystem, first: Array, second: Array
) -> Array:
    """Kinetic energy that the particles' forces make beyond v.f dt/2 of both stages, (N,).

    Forces f + b, f of particles and b of the body: v_1 = v_0 + (f + b + f' + b') dt/2m. The books
    of b have its work with the mean velocities of both half kicks; the stages have v_0.f dt/2 and
    (v_0 + (f + b) dt/m).f' dt/2. The rest is [f.(f + b) + f'.(f' + b') - 2 f'.(f + b)] dt^2/8m.
    """
    own_1, own_2 = first - start.external_forces(), second - predictor.external_forces()
    products = own_1 * first + own_2 * second - 2.0 * own_2 * first
    return start.dt**2 / (8.0 * start.mass) * np.sum(products, axis=1)


def thermal_verlet_step(
    system: ThermalSystem, step: int, accounts: Accounts | None = None
) -> ThermalSystem:
    """Half a step with the rates at the start, drift along adiabats, half with the predictor's."""
    books = Accounts() if accounts is None else accounts
    half, cold = 0.5 * system.dt, system.temperatures
    first, heat = rates(system, step, cold)
    fast = kicked(system, first, books)
    gain = fast.velocities - system.velocities
    fast, part = given(fast, half * heat, books)
    entropies = fast.entropies / fast.mass
    moved = replace(fast, positions=fast.positions + fast.dt * fast.velocities)
    adiabat = moved.caloric.temperature(moved.densities, entropies)
    moved = replace(moved, temperatures=adiabat)
    warm = moved.thermal
    predictor = moved.heated(np.where(warm + part > 0.0, warm + part, warm))
    predictor = replace(predictor, velocities=moved.velocities + gain)
    second, heat = rates(predictor, step, cold)
    end = kicked(moved, second, books)
    end, rest = given(end, half * heat, books)
    if not system.bookkeeping:
        return end
    work = half * (
        system.pressure_work(system.velocities) + predictor.pressure_work(predictor.velocities)
    )
    if system.heats or not system.rubs:
        work += unaccounted(system, predictor, first, second)
    energy = system.internal_energies + part + rest - work
    booked = energy - end.mass * end.caloric.cold(end.densities)
    stands, kept = booked <= 0.0, end.thermal
    books.discarded += float(np.sum(np.where(stands, 0.0, kept - booked)))
    books.unbooked += float(np.sum(np.where(stands, kept - booked, 0.0)))
    return end.heated(np.where(stands, kept, booked))
