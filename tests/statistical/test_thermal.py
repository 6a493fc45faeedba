"""Equilibrium of fluids with an energy, exact for any number of particles.

On the shell of constant energy and momentum, with the measure dr dp dS and k = C/k_B:
A = N k + D (N - 1)/2, <T_i> = E/A, <K> = D (N - 1)/2 E/A, Var T_i/<T>^2 = (A - k)/(k (A + 1)). Next
to a bath of temperature T_w: <T_i> = T_w, Var T_i = k_B T_w^2/C, and T_i does not know the density.
Means of 32 blocks, each many friction times long: |t| < 4.3 at 31 degrees of freedom has p =
1.6e-4, and the family has 19 members. Few particles and heat capacities of a few k_B are what
tells: without c_ij <K> is 5 % low, with the wrong measure <T_i> is off by k_B/C.
"""

from __future__ import annotations

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
    # dimension, N, k, support [dx], viscosity, exponent of transport, samples
    "8 in the plane": (2, 8, 5.0, 1.4, 1.0, 0.0, 200),
    "27": (3, 27, 6.0, 1.5, 2.0, 0.0, 150),
    "27 with eta(T), kappa(T)": (3, 27, 4.0, 1.5, 2.0, 0.7, 150),
    "100 in the plane": (2, 100, 8.0, 2.4, 5.0, 0.0, 100),
}


@pytest.mark.parametrize("case", FEW)
def test_few_particles_share_their_energy_exactly(case: str) -> None:
    dimension, number, k, support, eta, exponent, samples = FEW[case]
    edge = number ** (1.0 / dimension)
    of = gas(
        k,
        shear_viscosity=eta,
        thermal_conductivity=eta * k / 2.0,
        viscosity_exponent=exponent,
        conductivity_exponent=exponent,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)
        made = scene(
            of,
            box=sdpd.Box((edge,) * dimension),
            resolution=sdpd.Resolution(particles=number, support=support, kernel="wendland_c2"),
            start=sdpd.RandomStart(relax_steps=20),
            sound_speed=4.0,
        )
    sim = sdpd.Simulation(made, seed=11, threads=1)
    energy = sim.total_energy
    freedom = dimension * (number - 1) / 2.0
    whole = number * k + freedom
    mean = energy / whole

    def measure(sim: sdpd.Simulation) -> np.ndarray:
        t = np.asarray(sim.temperatures) / mean
        return np.array([t.mean(), np.square(t - 1.0).mean(), sim.kinetic_energy / mean])

    rows = blocks(sim, samples, 5, measure)
    exact = np.array([1.0, (whole - k) / (k * (whole + 1.0)), freedom])
    judge(rows, exact, [0.002, 0.03, 0.01])
    assert abs(sim.total_energy - energy) < 1e-11 * energy
    assert sim.energy_accounts().refused < 1e-4 * sim.step * number


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
