"""Sound and heat on a lattice without noise, against sums over the lattice in NumPy.

With an energy sound is adiabatic, without one isothermal: (gamma - 1) c_T^2 k^2 apart. Forces and
temperatures of the reference are written from E(N, V, S), not from the core.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import sdpd
from sdpd import conductivity, kernels
from sdpd.theory import FrictionTheory, SoundAndHeat, kernel_transform

EDGE, ACROSS, SUPPORT, R = 20, 6, 2.64, 100.0
K = 2.0 * math.pi / EDGE
AMPLITUDE = 1e-5


def scene(gamma: float, *, energy: bool = True, **changes: float) -> sdpd.Scene:
    """A gas on a square lattice, m = dx = kB = T_0 = 1, c_T = 10."""
    capacity = R / (gamma - 1.0)
    constants = {
        "density": 1.0,
        "shear_viscosity": 0.0,
        "temperature": 1.0,
        "boltzmann_constant": 1.0,
        "heat_capacity": capacity,
        **changes,
    }
    return sdpd.Scene(
        fluid=sdpd.Fluid(**constants, equation_of_state=sdpd.eos.IdealGas()),
        box=sdpd.Box((float(EDGE), float(ACROSS))),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=SUPPORT),
        start=sdpd.LatticeStart(velocities="zero"),
        sound_speed=math.sqrt(R),
        effects=sdpd.Effects(energy=energy, fluctuations=False),
    )


def squared_frequencies(gamma: float) -> tuple[float, float]:
    """Isothermal and adiabatic w^2 of the longest wave: restoring force over displacement."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(EDGE), np.arange(ACROSS), indexing="ij"))
    wave = np.cos(K * x)
    box = np.array([EDGE, ACROSS])

    def pull(step: float, adiabatic: bool) -> float:
        r = np.stack([x + step * wave, y.astype(float)], axis=1)
        gap = r[:, None] - r[None]
        gap -= box * np.rint(gap / box)
        distance = np.sqrt(np.sum(gap**2, axis=2))
        w, f = kernels.evaluate("lucy", 2, np.where(distance > 0.0, distance, 1e-9), SUPPORT)
        np.fill_diagonal(f, 0.0)
        d = w.sum(axis=1)
        at_rest = d0 if step else d
        t = (d / at_rest) ** (gamma - 1.0) if adiabatic else np.ones_like(d)
        a = R * t / d  # P/d^2
        force = np.sum((a[:, None] + a[None])[..., None] * f[..., None] * gap, axis=1)
        return float(force[:, 0] @ wave) / float(wave @ wave)

    def density() -> np.ndarray:
        gap = np.stack([x, y], axis=1)[:, None] - np.stack([x, y], axis=1)[None]
        gap = gap - box * np.rint(gap / box)
        w, _ = kernels.evaluate(
            "lucy", 2, np.maximum(np.sqrt(np.sum(gap**2, axis=2)), 1e-9), SUPPORT
        )
        return np.asarray(w.sum(axis=1))

    d0 = density()
    step = 1e-4
    return tuple(
        -(pull(step, adiabatic) - pull(-step, adiabatic)) / (2.0 * step)
        for adiabatic in (False, True)
    )


def measured_frequency(made: sdpd.Scene, dt: float, steps: int) -> float:
    """From the velocity of a standing wave, by least squares."""
    sim = sdpd.Simulation(made, dt=dt, threads=1)
    wave = np.cos(K * np.asarray(sim.positions[:, 0]))
    velocities = np.zeros((made.n_particles, 2))
    velocities[:, 0] = AMPLITUDE * wave
    sim.velocities = velocities
    seen = [1.0]
    for _ in range(steps):
        sim.run(1, progress=False)
        seen.append(float(np.asarray(sim.velocities)[:, 0] @ wave) / (AMPLITUDE * wave @ wave))
    from scipy import optimize

    t, y = np.arange(steps + 1) * dt, np.array(seen)
    zero = float(t[np.flatnonzero(y < 0.0)[0]])
    fit, _ = optimize.curve_fit(lambda s, w: np.cos(w * s), t, y, p0=[0.5 * np.pi / zero])
    assert np.max(np.abs(y - np.cos(fit[0] * t))) < 1e-3
    return 2.0 / dt * math.sin(0.5 * float(fit[0]) * dt)  # what velocity Verlet adds taken off


@pytest.mark.parametrize("gamma", [1.02, 1.4, 5.0 / 3.0])
def test_sound_is_adiabatic_with_an_energy_and_isothermal_without(gamma: float) -> None:
    isothermal, adiabatic = squared_frequencies(gamma)
    with_energy = measured_frequency(scene(gamma), 0.008, 250) ** 2
    without = measured_frequency(scene(gamma, energy=False), 0.008, 250) ** 2
    assert without == pytest.approx(isothermal, rel=2e-4)
    assert with_energy == pytest.approx(adiabatic, rel=2e-4)
    # and the continuum, as far as the kernel sees the wave; the order of the lattice adds to both
    smear = float(kernel_transform("lucy", 2, np.array([K * SUPPORT]))[0])
    expected = (gamma - 1.0) * R * (K * smear) ** 2
    assert with_energy - without == pytest.approx(expected, rel=0.02)
    continuum = R * K**2 * smear * (2.0 - smear)
    assert without == pytest.approx(continuum, rel=0.3) and without > 1.2 * continuum


@pytest.mark.parametrize(
    ("conduction", "mode"), [(0.02, "adiabatic"), (1.0, "between"), (40.0, "isothermal")]
)
def test_coupled_waves_follow_the_three_equations(conduction: float, mode: str) -> None:
    """A wave of temperature drives sound, and heat leaves it: from adiabatic to isothermal sound.

    `conduction` is q over c_T k; all parameters are sums over the lattice.
    """
    gamma = 1.4
    isothermal, adiabatic = squared_frequencies(gamma)
    capacity = R / (gamma - 1.0)
    w = math.sqrt(isothermal)
    kappa = conduction * w * capacity / K**2
    made = scene(gamma, shear_viscosity=3.0, thermal_conductivity=kappa)
    friction = FrictionTheory(
        kernel="lucy", dimension=2, support=SUPPORT, density=1.0, shear_viscosity=3.0
    )
    damping = friction.lattice_plane_wave_rate(
        np.array([K, 0.0]), np.array([1.0, 0.0]), spacing=1.0
    )
    q = conductivity.lattice_conductivity(made, K) * K**2 / capacity
    system = SoundAndHeat(
        frequency=w,
        coupling=math.sqrt(adiabatic - isothermal),
        damping=damping,
        conduction=q,
    )
    dt = min(0.004, 0.045 / q)
    sim = sdpd.Simulation(made, dt=dt, threads=1)
    x = np.asarray(sim.positions[:, 0])
    cosine, sine = np.cos(K * x), np.sin(K * x)
    sim.temperatures = 1.0 + AMPLITUDE / math.sqrt(capacity) * cosine
    rows, every = [], max(1, round(0.02 / dt))
    for _ in range(30):
        sim.run(every, progress=False)
        warm = float((np.asarray(sim.temperatures) - 1.0) @ cosine) * math.sqrt(capacity)
        moved = float(np.asarray(sim.velocities)[:, 0] @ sine)
        rows.append([moved, warm])
    seen = np.array(rows) / (AMPLITUDE * float(cosine @ cosine))
    found = system.correlations(np.arange(1, 31) * every * dt)
    # u = sin goes with a compression of -cos
    np.testing.assert_allclose(seen[:, 0], -found[1, 2], atol=4e-3)
    np.testing.assert_allclose(seen[:, 1], found[2, 2], atol=4e-3)
    speed = system.sound_frequency**2 + system.sound_rate**2
    limits = {"adiabatic": adiabatic, "isothermal": isothermal}
    if mode in limits:
        assert speed == pytest.approx(limits[mode], rel=0.03)
