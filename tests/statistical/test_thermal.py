"""Equilibrium of fluids with an energy, exact for any number of particles.

On the shell of constant energy and momentum, with the measure dr dp dS and k = C/k_B:
A = N k + D (N - 1)/2, <T_i> = E/A, <K> = D (N - 1)/2 E/A, Var T_i/<T>^2 = (A - k)/(k (A + 1)). Next
to a bath of temperature T_w: <T_i> = T_w, Var T_i = k_B T_w^2/C, and T_i does not know the density.
Means of 32 blocks, each many friction times long: |t| < 4.3 at 31 degrees of freedom has p =
1.6e-4, and the family has 37 members. Few particles and heat capacities of a few k_B are what
tells: without c_ij <K> is 5 % low, with the wrong measure <T_i> is off by k_B/C.
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import numpy as np
import pytest

import sdpd
from tests.unit.thermal import gas, scene, slab

BLOCKS = 32
LARGEST_T = 4.3


def blocks(sim: sdpd.Simulation, samples: int, every: int, measure: Any) -> np.ndarray:
    """Block means of what `measure` gives, (blocks, ...)."""
    sim.run(steps=40 * every, progress=False)
    rows = []
    for _ in range(BLOCKS):
        values = []
        for _ in range(samples):
            sim.run(steps=every, progress=False)
            values.append(measure(sim))
        rows.append(np.mean(values, axis=0))
    return np.asarray(rows)


def judge(rows: np.ndarray, exact: np.ndarray, largest_error: list[float]) -> None:
    mean, error = rows.mean(axis=0), rows.std(axis=0, ddof=1) / np.sqrt(BLOCKS)
    relative = error / np.abs(exact)
    assert (relative < largest_error).all(), f"too coarse to tell: {relative}"
    t = (mean - exact) / error
    assert (np.abs(t) < LARGEST_T).all(), f"t = {t}, mean/exact = {mean / exact} +- {relative}"


FEW = {
    # dimension, N, C/k_B of unit mass, support [dx], viscosity, exponent of transport, samples
    "8 in the plane": (2, 8, 5.0, 1.4, 1.0, 0.0, 300),
    "27": (3, 27, 6.0, 1.5, 2.0, 0.0, 150),
    "27 with eta(T), kappa(T)": (3, 27, 4.0, 1.5, 2.0, 0.7, 150),
    "100 in the plane": (2, 100, 8.0, 2.4, 5.0, 0.0, 100),
    # a periodic box of two supports holds more than four: these have walls, which take up momentum
    # and leave less mass to a particle, with 4 to 8 k_B
    "4 between walls": (3, 4, 9.0, 1.2, 2.0, 0.0, 1200),
    "4 between walls in the plane": (2, 4, 12.0, 1.2, 2.0, 0.0, 1600),
    "4 between walls, eta(T), kappa(T)": (2, 4, 7.0, 1.2, 2.0, 0.7, 1600),
}


@pytest.mark.parametrize("case", FEW)
def test_few_particles_share_their_energy_exactly(case: str) -> None:
    dimension, number, capacity, support, eta, exponent, samples = FEW[case]
    walled = "walls" in case
    box = sdpd.Box(
        (number ** (1.0 / dimension),) * dimension,
        periodic="" if walled else "xyz"[:dimension],
    )
    walls = tuple(
        dataclasses.replace(wall, heat=sdpd.Adiabatic()) for wall in sdpd.walls.enclosure(box)
    )
    of = gas(
        capacity,
        shear_viscosity=eta,
        thermal_conductivity=eta * capacity / 2.0,
        viscosity_exponent=exponent,
        conductivity_exponent=exponent,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)
        made = scene(
            of,
            box=box,
            walls=walls,
            resolution=sdpd.Resolution(particles=number, support=support, kernel="wendland_c2"),
            start=sdpd.RandomStart(relax_steps=20),
            sound_speed=4.0,
        )
    sim = sdpd.Simulation(made, seed=11, threads=1)
    energy = sim.total_energy
    freedom = dimension * (number if walled else number - 1) / 2.0
    k = made.heat_capacity_number
    assert 3.99 < k < 8.01
    whole = number * k + freedom
    mean = energy / whole

    def measure(sim: sdpd.Simulation) -> np.ndarray:
        t = np.asarray(sim.temperatures) / mean
        return np.array([t.mean(), np.square(t - 1.0).mean(), sim.kinetic_energy / mean])

    rows = blocks(sim, samples, 5, measure)
    exact = np.array([1.0, (whole - k) / (k * (whole + 1.0)), freedom])
    judge(rows, exact, [0.002, 0.03, 0.01])
    assert abs(sim.total_energy - energy) < 1e-11 * energy
    # images in walls are partners as well
    assert sim.energy_accounts().refused < (3e-4 if walled else 1e-4) * sim.step * number


def test_a_bath_behind_the_walls_sets_temperature_and_its_variance() -> None:
    """Plates at 1.25 T_0: all of the fluid, and the layer next to them, for a soft C = 10 k_B."""
    made = slab(
        sdpd.Isothermal(1.25),
        sdpd.Isothermal(1.25),
        of=gas(10.0, shear_viscosity=10.0),
        height=9.0,
        noise=True,
        start=sdpd.RandomStart(relax_steps=50),
    )
    sim = sdpd.Simulation(made, seed=5, threads=1, temperatures=1.25)
    sim.velocities *= np.sqrt(1.25)

    def measure(sim: sdpd.Simulation) -> np.ndarray:
        t, v = np.asarray(sim.temperatures) / 1.25, np.asarray(sim.velocities)
        z = np.asarray(sim.positions[:, 2])
        near = np.minimum(z, 9.0 - z) < 1.0
        d = np.asarray(sim.number_densities)
        motion = np.square(v[near]) / 1.25
        return np.array(
            [
                t.mean(),
                t[near].mean(),
                1.0 + np.square(t - 1.0).mean(),
                1.0 + np.square(t[near] - 1.0).mean(),
                motion[:, 2].mean(),
                motion[:, :2].mean(),
                1.0 + np.mean((t - 1.0) * (d - d.mean())),
            ]
        )

    rows = blocks(sim, 25, 5, measure)
    exact = np.array([1.0, 1.0, 1.1, 1.1, 1.0, 1.0, 1.0])
    judge(rows, exact, [0.003, 0.005, 0.004, 0.006, 0.018, 0.014, 0.0015])


def shares_of_a_shell(weight: Any, freedom: float, n: int, e: float) -> list[np.ndarray]:
    """Heats on a grid, and the laws of the heat of one of n particles and of the kinetic energy K.

    The n heats with weights exp(S)/T and K, with `freedom` degrees of freedom over two, share e.
    Convolutions, tilted against cancellation: cell k stands for (k + 1/2) of its width.
    """
    cells = 6000
    heat = (np.arange(cells) + 0.5) * e / cells
    tilt = -(n + 2.0) * 3.0 * heat / e
    one = weight(heat) + tilt
    one = np.exp(one - one.max())
    motion = heat ** (freedom - 1.0) * np.exp(tilt)
    size = 4 * cells

    def rest(heats: int, motions: int) -> np.ndarray:
        """Density of the sum of all the others at e less the heat of each cell."""
        spectrum = np.fft.rfft(one / one.sum(), size) ** heats
        spectrum = spectrum * np.fft.rfft(motion / motion.sum(), size) ** motions
        density = np.fft.irfft(spectrum, size)[:cells]
        place = cells - 0.5 * (heats + motions + 1) - np.arange(cells)
        return np.interp(place, np.arange(cells), density, left=0.0)

    laws = [one * rest(n - 1, 1), motion * rest(n, 0)]
    return [heat, *(law / law.sum() for law in laws)]


def test_shares_of_a_shell_are_those_of_a_constant_heat_capacity() -> None:
    heat, p, q = shares_of_a_shell(lambda h: 3.0 * np.log(h), 3.5, 8, 10.0)
    whole = 8 * 4.0 + 3.5
    assert (p * heat).sum() == pytest.approx(10.0 * 4.0 / whole, rel=1e-4)
    exact = 100.0 * 4.0 * 5.0 / (whole * (whole + 1.0))
    assert (p * heat**2).sum() == pytest.approx(exact, rel=1e-4)
    assert (q * heat).sum() == pytest.approx(10.0 * 3.5 / whole, rel=1e-3)


@pytest.mark.parametrize("metropolis", [False, True])
def test_particles_whose_heat_capacity_follows_the_temperature(metropolis: bool) -> None:
    """c_v = 3 (1 + T), 8 of them: <h>, <h^2> and <K> by quadrature over the shell."""
    from tests.unit.test_energy_table import warming

    number = 8
    law = sdpd.eos.EnergyTable.from_helmholtz(
        warming, densities=(0.1, 10.0), temperatures=(0.02, 12.0), points=(24, 96)
    )
    of = gas(shear_viscosity=1.0, thermal_conductivity=3.0).replace(equation_of_state=law)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.SdpdWarning)
        made = scene(
            of,
            box=sdpd.Box((number**0.5,) * 2),
            resolution=sdpd.Resolution(particles=number, support=1.4, kernel="wendland_c2"),
            start=sdpd.RandomStart(relax_steps=20),
            sound_speed=None,
        )
        sim = sdpd.Simulation(
            made, seed=12, threads=1, integrator=sdpd.PairSplitting(metropolis=metropolis)
        )
    energy = sim.total_energy
    # e = h + constant: the constant by the state at hand, h = 3 (T + T^2/2) of the closed form.
    t = np.asarray(sim.temperatures)
    constant = float(np.mean(np.asarray(sim.internal_energies) - 3.0 * (t + 0.5 * t * t)))
    whole = energy - number * constant

    def warmth(heat: np.ndarray) -> np.ndarray:
        return np.sqrt(1.0 + 2.0 * heat / 3.0) - 1.0

    def weight(heat: np.ndarray) -> np.ndarray:
        t = warmth(heat)
        return 3.0 * (np.log(t) + t) - np.log(t)

    heat, p, q = shares_of_a_shell(weight, float(number - 1), number, whole)
    t = warmth(heat)
    mean = float((p * t).sum())
    exact = np.array([1.0, float((p * t * t).sum()) / mean**2, float((q * heat).sum()) / mean])

    def measure(sim: sdpd.Simulation) -> np.ndarray:
        t = np.asarray(sim.temperatures) / mean
        return np.array([t.mean(), np.square(t).mean(), sim.kinetic_energy / mean])

    judge(blocks(sim, 200, 4, measure), exact, [0.004, 0.006, 0.02])


def test_acceptance_makes_long_steps_exact() -> None:
    """Eight of C = 1.5 k_B at steps of their friction time: 4 % too hot without it."""
    number, k = 8, 1.5
    of = gas(k, shear_viscosity=40.0, thermal_conductivity=20.0 * k)
    found = {}
    for metropolis in (False, True):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sdpd.SdpdWarning)
            made = scene(
                of,
                box=sdpd.Box((number**0.5,) * 2),
                resolution=sdpd.Resolution(particles=number, support=1.4, kernel="wendland_c2"),
                start=sdpd.RandomStart(relax_steps=20),
                sound_speed=4.0,
            )
            sim = sdpd.Simulation(
                made,
                seed=11,
                threads=1,
                dt=1.1 * made.friction_time,
                integrator=sdpd.PairSplitting(metropolis=metropolis),
            )
        energy = sim.total_energy
        whole = number * (k + 1.0) - 1.0
        mean = energy / whole

        def measure(sim: sdpd.Simulation, mean: float = mean) -> np.ndarray:
            t = np.asarray(sim.temperatures) / mean
            return np.array([t.mean(), np.square(t - 1.0).mean(), sim.kinetic_energy / mean])

        found[metropolis] = blocks(sim, 150, 4, measure)
        assert abs(sim.total_energy - energy) < 1e-11 * energy
    exact = np.array([1.0, (whole - k) / (k * (whole + 1.0)), number - 1.0])
    judge(found[True], exact, [0.004, 0.02, 0.01])
    assert found[False].mean(axis=0)[0] > 1.03
