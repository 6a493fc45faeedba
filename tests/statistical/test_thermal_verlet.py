"""Equilibrium by velocity Verlet with energies, against the exact distribution of any number.

As in test_thermal.py, on the shell of the energy, which this integrator keeps by its books:
<T_i> = E/A, Var T_i/<T>^2 = (A - k)/(k (A + 1)), <K> = D (N - 1)/2 E/A. Means of 32 blocks:
|t| < 4.3 at 31 degrees of freedom has p = 1.6e-4, and the family has 9 members. At these steps
its own bias, which falls as dt^2, is below the error. What would be seen: without c_ij <K> is 7 %
low at C = 5 k_B; without the drift of eta ~ T^0.7 it is 5.5 % high there, and 1.1 % at 25 k_B; with
the heat of half kicks as in Table 4 of Yang (2013) the particles cool.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import sdpd
from tests.unit.thermal import gas, scene

from .test_thermal import blocks, judge

CASES = {
    # dimension, N, k, support [dx], viscosity, exponent, dt/tau, samples, largest errors
    "27": (3, 27, 5.0, 1.5, 2.0, 0.0, 0.04, 150, (0.002, 0.02, 0.007)),
    "27 with eta(T), kappa(T)": (3, 27, 5.0, 1.5, 2.0, 0.7, 0.04, 150, (0.002, 0.02, 0.007)),
    "36 with eta(T), kappa(T)": (2, 36, 25.0, 2.65, 20.0, 0.7, 0.04, 150, (0.001, 0.02, 0.007)),
}


def few(case: str) -> sdpd.Scene:
    dimension, number, k, support, eta, exponent = CASES[case][:6]
    of = gas(
        k,
        shear_viscosity=eta,
        thermal_conductivity=eta * k / 2.0,
        viscosity_exponent=exponent,
        conductivity_exponent=exponent,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.ResolutionWarning)
        return scene(
            of,
            box=sdpd.Box((number ** (1.0 / dimension),) * dimension),
            resolution=sdpd.Resolution(particles=number, support=support, kernel="wendland_c2"),
            start=sdpd.RandomStart(relax_steps=20),
            sound_speed=4.0,
        )


@pytest.mark.parametrize("case", CASES)
def test_few_particles_share_their_energy_exactly(case: str) -> None:
    dimension, number, k = CASES[case][:3]
    part, samples, largest = CASES[case][6:]
    made = few(case)
    step = part * made.friction_time
    sim = sdpd.Simulation(made, integrator="velocity_verlet", dt=step, seed=11, threads=1)
    freedom = dimension * (number - 1) / 2.0
    whole = number * k + freedom

    def measure(sim: sdpd.Simulation) -> np.ndarray:
        mean = sim.total_energy / whole
        t = np.asarray(sim.temperatures) / mean
        return np.array([t.mean(), np.square(t - 1.0).mean(), sim.kinetic_energy / mean])

    before = sim.total_energy
    rows = blocks(sim, samples, 5, measure)
    judge(rows, np.array([1.0, (whole - k) / (k * (whole + 1.0)), freedom]), list(largest))
    accounts = sim.energy_accounts()
    assert sim.total_energy - before == pytest.approx(accounts.gained, abs=1e-10 * before)
    assert accounts.refused < 1e-4 * sim.step * number


def test_its_bias_is_the_expected_one() -> None:
    """At dt = tau/2 it is too cold by some 8 %, as `timestep.expected_errors` has it."""
    made = scene(gas(25.0), box=sdpd.Box((6.0, 6.0)), start=sdpd.RandomStart(relax_steps=50))
    step = 0.5 * made.friction_time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sim = sdpd.Simulation(made, integrator="velocity_verlet", dt=step, seed=3, threads=1)
    freedom = float(sim.n_particles - 1)
    whole = sim.n_particles * 25.0 + freedom
    rows = blocks(
        sim, 40, 4, lambda sim: np.array([sim.kinetic_energy / freedom * whole / sim.total_energy])
    )
    expected = sdpd.timestep.expected_errors(made, step, "velocity_verlet").temperature
    mean, error = rows.mean(), rows.std(ddof=1) / np.sqrt(len(rows))
    assert error < 0.007
    assert expected is not None
    assert mean - 1.0 == pytest.approx(expected, abs=0.2 * abs(expected) + 3.0 * error)
