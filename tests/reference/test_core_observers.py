"""Observers inside the loop against plain NumPy on the trajectory seen from outside."""

from __future__ import annotations

import numpy as np
import pytest

from .build import core, problem, rescaled
from .twin import specific_potential

INTEGRATORS = ("velocity_verlet", "pair_splitting")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_thermodynamics(integrator: str, dimension: int) -> None:
    """In units that are not 1; momentum on purpose not zero."""
    system = rescaled(problem(dimension), 2e-9, 3e-24, 5e-12)
    drift = np.array([0.3, -0.2, 0.1])[:dimension] * 2e-9 / 5e-12
    system = system.at(velocities=system.velocities + drift)
    sim = core(system, integrator)
    observer = sim.attach_thermodynamics(3)
    rows = []
    for step in range(1, 13):
        sim.run(1, system.dt)
        if step % 3:
            continue
        m, v = system.mass, np.array(sim.velocities)
        rho, p = np.array(sim.densities), np.array(sim.pressures)
        potential = specific_potential(*system.eos, rho, float(rho[0]))
        rows.append(
            {
                "step": step,
                "time": step * system.dt,
                "kinetic_energy": 0.5 * m * np.sum(v**2),
                "potential_energy": m * np.sum(potential),
                "mean_density": rho.mean(),
                "mean_square_density": np.mean(rho**2),
                "mean_pressure": p.mean(),
            }
        )
        thermal = m * v.var(axis=0, ddof=1)
        momentum = m * v.sum(axis=0)
        for a, axis in enumerate("xyz"[:dimension]):
            rows[-1][f"thermal_energy_{axis}"] = thermal[a]
            rows[-1][f"momentum_{axis}"] = momentum[a]
        # potential energies have an arbitrary constant: count the core's from the same density
        rows[-1]["reference"] = rho[0]
    table = observer.table()
    assert table.shape == (4, len(observer.columns))
    assert set(observer.columns) == set(rows[0]) - {"reference"}
    from sdpd import _core

    kind, parameters = system.eos
    for got, expected in zip(table, rows, strict=True):
        for name, value in zip(observer.columns, got, strict=True):
            if name == "potential_energy":
                zero = _core.eos_evaluate(kind, parameters, np.array([expected["reference"]]))[2][0]
                scale = abs(value) + abs(system.mass * system.size * zero)
                value -= system.mass * system.size * zero
                assert value == pytest.approx(expected[name], abs=1e-11 * scale)
            elif name.startswith("momentum"):
                scale = system.mass * np.abs(sim.velocities).sum()
                assert value == pytest.approx(expected[name], abs=1e-12 * scale)
            else:
                assert value == pytest.approx(expected[name], rel=1e-11), name


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_correlator(integrator: str, dimension: int) -> None:
    """MSD and VACF at every lag it reports, over particles that cross the boundary."""
    cells = (7, 8, 6)[:dimension]
    system = problem(dimension, cells=cells, dt=0.02, eos="linear")
    system = system.at(velocities=system.velocities + 1.0)
    sim = core(system, integrator)
    observer = sim.attach_correlator(2, 8, 3)
    positions, velocities = [], []
    for _ in range(60):
        sim.run(2, system.dt)
        positions.append(sim.positions + sim.images * system.box)
        velocities.append(np.array(sim.velocities))
    assert np.abs(sim.images).max() > 0
    r, v = np.array(positions), np.array(velocities)
    seen = set()
    for lag, origins, msd, vacf in observer.table():
        lag = int(lag)
        assert origins > 0
        seen.add(lag)
        every = 1 if lag < 8 else (2 if lag < 16 else 4)
        first = np.arange(0, len(r) - lag, every)
        assert len(first) == origins, (lag, origins)
        expected = np.mean(np.sum((r[first + lag] - r[first]) ** 2, axis=-1), axis=1).sum()
        assert msd == pytest.approx(expected, rel=1e-10, abs=1e-20)
        expected = np.mean(np.sum(v[first + lag] * v[first], axis=-1), axis=1).sum()
        assert vacf == pytest.approx(expected, rel=1e-9)
    assert {0, 1, 7, 8, 14, 16, 28} <= seen


def test_observers_do_not_change_the_trajectory() -> None:
    system = problem(3)
    for integrator in INTEGRATORS:
        plain, observed = core(system, integrator), core(system, integrator)
        observed.attach_thermodynamics(1)
        observed.attach_correlator(2, 8, 3)
        for sim in (plain, observed):
            sim.run(10, system.dt)
        assert np.array_equal(plain.positions, observed.positions)
        assert np.array_equal(plain.velocities, observed.velocities)


def test_a_detached_observer_stays_readable_and_silent() -> None:
    system = problem(3)
    sim = core(system)
    observer = sim.attach_thermodynamics(1)
    sim.run(4, system.dt)
    sim.detach_all()
    sim.run(4, system.dt)
    assert observer.table()[:, 0].tolist() == [1, 2, 3, 4]
