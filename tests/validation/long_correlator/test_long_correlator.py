"""Correlators without a trajectory: a million samples, a hundred thousand particles.

A million samples of a small system keep the memory that a few hundred had, and the functions are
right: C(0) = kT/m, and both routes to the diffusion coefficient agree. A hundred thousand particles
take the memory that is stated and no more, however long they run.
"""

from __future__ import annotations

import resource

import pytest

import sdpd
from sdpd import analysis
from tests.validation import record

SAMPLES = 1_000_000
PARTICLES = 100_000
LEVELS = 18  # lags to 7 * 2^17 = 9e5 samples


def resident() -> float:
    """Memory of this process [byte]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def scene(dimension: int, edge: float) -> sdpd.Scene:
    return sdpd.Scene(
        fluid=sdpd.Fluid(density=1.0, shear_viscosity=5.0, temperature=1.0, boltzmann_constant=1.0),
        box=sdpd.Box((edge,) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel="wendland_c2", support=2.4),
        start=sdpd.RandomStart(),
    )


def test_a_million_samples() -> None:
    sim = sdpd.Simulation(scene(2, 6.0), integrator="pair_splitting", seed=1, threads=1, dt=0.04)
    sim.run(steps=500, progress=False)
    correlator = sdpd.Correlator(points=16, levels=LEVELS - 1)
    stress, currents = sdpd.StressCorrelator(), sdpd.CurrentCorrelator([(1, 0), (0, 1)])
    observers = [correlator, stress, currents]
    sim.run(steps=2000, observe=observers, progress=False)
    before = resident()
    sim.run(steps=SAMPLES - 2000, observe=observers, progress=False)
    grown = resident() - before
    assert correlator.n_samples == currents.n_samples == SAMPLES
    assert stress.n_samples == SAMPLES - 1  # the first one opens the first interval
    assert grown < 2e6, f"{grown:.0f} bytes more after a million samples"

    vacf, msd = (correlator.correlation(kind, n_blocks=32) for kind in ("vacf", "msd"))
    start = vacf.at(0)
    exact = 1.0 - 1.0 / sim.n_particles  # the total momentum is zero
    assert start.stderr < 0.002 and abs(start.z(exact)) < 4.0, start
    # The slope of the MSD at some time is the integral of the VACF up to it. Velocities are sampled
    # half a kick from those that drift, which is some 2 % of the diffusion at this step.
    einstein = analysis.einstein_diffusion(msd, window=(4.5, 5.5))
    integral = analysis.green_kubo_diffusion(vacf, cutoff=5.0)
    assert einstein.relative < 0.01 and integral.relative < 0.01
    apart = abs(einstein.value - integral.value)
    assert apart < 4.0 * integral.stderr + 0.03 * einstein.value, (einstein, integral)
    record.store(
        "long_correlator",
        {
            "samples": SAMPLES,
            "bytes_grown": grown,
            "vacf_0": start.value,
            "vacf_0_stderr": start.stderr,
            "vacf_0_exact": exact,
            "D_einstein": einstein.value,
            "D_einstein_stderr": einstein.stderr,
            "D_green_kubo": integral.value,
            "D_green_kubo_stderr": integral.stderr,
        },
    )


def test_a_hundred_thousand_particles() -> None:
    edge = round(PARTICLES ** (1.0 / 3.0) + 0.5)  # 47^3 = 103,823
    sim = sdpd.Simulation(
        scene(3, float(edge)), integrator=sdpd.VelocityVerlet(noise="uniform"), seed=1, dt=0.002
    )
    assert sim.n_particles >= PARTICLES
    sim.run(steps=3, progress=False)
    empty, correlator = resident(), sdpd.Correlator(levels=LEVELS)
    sim.run(steps=30, observe=correlator, progress=False)
    used = resident() - empty
    stated = 48.0 * correlator.points * LEVELS * sim.n_particles
    assert used < 1.1 * stated + 2e7, (used, stated)
    before = resident()
    sim.run(steps=60, observe=correlator, progress=False)
    assert resident() - before < 0.35 * stated, "memory of levels first touched, no more"
    start = correlator.correlation("vacf", n_blocks=8).at(0)
    assert start.value == pytest.approx(1.0, abs=0.03)
