"""The wave of the energies inside the loop: against direct sums, and what it leaves alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sdpd
from tests.unit.thermal import gas, scene


class Frames(sdpd.Observer):
    """Positions, velocities and temperatures of every sample."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.frames: list[tuple[np.ndarray, ...]] = []

    def sample(self, sim: sdpd.Simulation) -> None:
        kept = (sim.positions, sim.velocities, sim.temperatures)
        self.frames.append(tuple(np.array(part) for part in kept))


def small(dimension: int, **changes: Any) -> sdpd.Scene:
    """In units that are not 1."""
    fluid = gas(30.0 * 2e-3 / 3e-2, temperature=3.0, boltzmann_constant=2e-3, density=3e-2)
    return scene(
        fluid,
        box=sdpd.Box((8.0, 6.0, 6.0)[:dimension]),
        start=sdpd.RandomStart(relax_steps=20),
        **{"sound_speed": 3.0, **changes},
    )


def run(
    made: sdpd.Scene, vectors: list[list[int]], *, threads: int = 1, frames: bool = False
) -> Any:
    currents = sdpd.CurrentCorrelator(vectors, every=2, points=4, levels=1)
    kept = Frames(every=2)
    sim = sdpd.Simulation(made, seed=3, threads=threads)
    observers = [currents, kept] if frames else [currents]
    sim.run(steps=2 * 64, observe=observers, progress=False)
    return sim, currents, kept


@pytest.mark.parametrize("dimension", [2, 3])
def test_against_direct_sums(dimension: int) -> None:
    made = small(dimension)
    vectors = [vector[:dimension] for vector in ([1, 0, 0], [0, 2, 0], [1, -1, 0])]
    _, currents, kept = run(made, vectors, frames=True)
    r, v, t = (np.stack(part) for part in zip(*kept.frames, strict=True))
    capacity = made.heat_capacity_number * made.fluid.boltzmann_constant
    e = capacity * t + 0.5 * made.particle_mass * np.sum(v**2, axis=2)
    e -= e.mean(axis=1, keepdims=True)
    found = {shell.wave_number: shell for shell in currents.correlations(n_blocks=8)}
    assert len(found) == 3
    for vector in vectors:
        k = 2.0 * np.pi * np.array(vector) / np.asarray(made.box.lengths)
        wave = np.exp(1j * r @ k) / np.sqrt(made.n_particles)
        rho = wave.sum(axis=1)
        along = np.einsum("ti,tia,a->t", wave, v, k / np.linalg.norm(k))
        eps = np.sum(wave * e, axis=1)
        [shell] = [s for length, s in found.items() if np.isclose(length, np.linalg.norm(k))]
        for lag in range(4):
            rows = slice(0, 64 - lag), slice(lag, 64)
            old = [x[rows[0]].conj() for x in (rho, along, eps)]
            new = [x[rows[1]] for x in (rho, along, eps)]
            exact = {
                "density": (old[0] * new[0]).real,
                "energy": (old[2] * new[2]).real,
                "density_energy": 0.5 * (old[0] * new[2] + old[2] * new[0]).real,
                "energy_current": 0.5 * (old[1] * new[2] + old[2] * new[1]).imag,
            }
            for name, value in exact.items():
                function = getattr(shell, name)
                mean = np.average(function.blocks[:, lag], weights=function.block_counts[:, lag])
                scale = float(np.prod([np.abs(x).max() for x in (old[2], new[1])]))
                assert mean == pytest.approx(value.mean(), rel=1e-9, abs=1e-10 * scale)


def test_same_bits_on_two_threads_and_without_it() -> None:
    made = small(3)
    one, first, _ = run(made, [[1, 0, 0]])
    two, second, _ = run(made, [[1, 0, 0]], threads=2)
    [a], [b] = (c.correlations(n_blocks=8) for c in (first, second))
    np.testing.assert_array_equal(a.energy.blocks, b.energy.blocks)
    np.testing.assert_array_equal(a.energy_current.blocks, b.energy_current.blocks)
    plain = sdpd.Simulation(made, seed=3, threads=1)
    plain.run(steps=128, progress=False)
    np.testing.assert_array_equal(plain.positions, one.positions)
    np.testing.assert_array_equal(two.temperatures, one.temperatures)


def test_isothermal_fluids_have_no_such_wave() -> None:
    made = small(2, effects=sdpd.Effects(energy=False))
    _, currents, _ = run(made, [[1, 0]])
    [shell] = currents.correlations(n_blocks=8)
    assert shell.energy is None
    assert shell.density_energy is None
    assert shell.energy_current is None
