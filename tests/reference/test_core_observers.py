"""Observers inside the loop against plain NumPy on the trajectory seen from outside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from .build import core, problem, rescaled
from .twin import specific_potential
from .twin.integrators import exchange_terms

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
    for _ in range(75):
        sim.run(2, system.dt)
        positions.append(sim.positions + sim.images * system.box)
        velocities.append(np.array(sim.velocities))
    assert np.abs(sim.images).max() > 0
    r, v = np.array(positions), np.array(velocities)
    lags, blocks = observer.lags(), observer.blocks()
    assert lags.tolist() == [*range(8), 8, 10, 12, 14, 16, 20, 24, 28]
    assert observer.block_length() == 2 and len(blocks) == 38
    for row, lag in enumerate(lags.astype(int)):
        every = 1 if lag < 8 else (2 if lag < 16 else 4)
        for block, (origins, msd, vacf) in enumerate(blocks[:, row]):
            last = np.arange(2 * block, min(2 * block + 2, 75))  # a block owns its later samples
            last = last[(last >= lag) & (last % every == 0)]
            assert len(last) == origins, (lag, block)
            moved = np.sum((r[last] - r[last - lag]) ** 2, axis=-1)
            assert msd == pytest.approx(moved.mean(axis=1).sum(), rel=1e-10, abs=1e-20)
            product = np.sum(v[last] * v[last - lag], axis=-1)
            assert vacf == pytest.approx(product.mean(axis=1).sum(), rel=1e-9, abs=1e-13)


def stress_rows(sim: Any, dimension: int) -> np.ndarray:
    """Parts of the pressure tensor, (intervals, 4, D, D)."""
    return sim.table()[:, 2:].reshape(-1, 4, dimension, dimension)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("friction", ["general", "central", "none"])
@pytest.mark.parametrize(
    ("integrator", "iterations"),
    [("velocity_verlet", 0), ("velocity_verlet", 1), ("velocity_verlet", 3), ("pair_splitting", 0)],
)
def test_stress_is_the_change_of_the_helfand_moment(
    integrator: str, iterations: int, friction: str, dimension: int
) -> None:
    """For a blob that touches no image of itself, int V P dt is the change of sum m r_a v_b."""
    system = problem(dimension, friction=friction, viscosity=5.0, bulk_viscosity=1.0, dt=0.004)
    wide = 3.0 * system.box
    system = rescaled(
        system.at(positions=system.positions + system.box, box=wide), 2e-9, 3e-24, 5e-12
    )
    sim = core(system, integrator, iterations=iterations)
    observer = sim.attach_stress(3)
    moments = []
    for _ in range(6):
        sim.run(3, system.dt)
        r = sim.positions + sim.images * system.box
        moments.append(system.mass * np.einsum("ia,ib->ab", r, sim.velocities))
    got = stress_rows(observer, dimension).sum(axis=1)
    got *= float(np.prod(system.box)) * 3 * system.dt
    expected = np.diff(moments, axis=0)
    assert got.shape == expected.shape
    scale = np.abs(moments).max()
    assert np.allclose(got, expected, rtol=0.0, atol=1e-12 * scale)
    assert np.abs(expected).max() > 1e-3 * scale


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("friction", ["general", "central"])
@pytest.mark.parametrize("iterations", [0, 2])
def test_stress_of_verlet_by_part(iterations: int, friction: str, dimension: int) -> None:
    """Each part against the twin's pairs: half kicks of both ends, drift between them."""
    system = problem(dimension, friction=friction, dt=0.004)
    sim = core(system, "velocity_verlet", iterations=iterations)
    observer = sim.attach_stress(1)
    half = 0.5 * system.dt
    sums = []
    for step in (1, 2, 3):
        before, push = np.array(sim.velocities), np.array(sim.forces)
        sim.run(1, system.dt)
        middle = before + half * push
        now = system.at(positions=np.array(sim.positions), velocities=middle)
        p = now.pairs
        pair_sum = lambda f, p=p: np.einsum("pa,pb->ab", p.vector, f)  # noqa: E731
        drag = pair_sum(now.pair_dissipative(p))
        final = now.at(velocities=np.array(sim.velocities))
        # All drag corrections of the step have acted except for the last, which waits.
        ahead = pair_sum(final.pair_dissipative(p)) if iterations else drag
        kicked = drag
        if iterations == 2:
            once = now.at(velocities=middle + half * now.forces(step).total)
            kicked = pair_sum(once.pair_dissipative(p))
        sums.append(
            (
                np.einsum("ia,ib->ab", middle, middle),
                pair_sum(now.pair_conservative(p)),
                kicked,
                pair_sum(now.pair_random(p, step)),
                ahead,
            )
        )
    volume = float(np.prod(system.box))
    rows = stress_rows(observer, dimension)
    assert len(rows) == 2
    for row, old, new in zip(rows, sums[:-1], sums[1:], strict=True):
        drag = 0.5 * (old[4] + new[2])
        expected = [new[0], 0.5 * (old[1] + new[1]), drag, 0.5 * (old[3] + new[3])]
        for part, value in zip(row, expected, strict=True):
            assert np.allclose(part, value / volume, rtol=0.0, atol=1e-11 * np.abs(value).max())


@pytest.mark.parametrize("friction", ["general", "central"])
def test_random_stress_of_the_splitting(friction: str) -> None:
    """The random part of the exchanges alone; the total is tested above."""
    system = problem(3, friction=friction, dt=0.02)
    sim = core(system, "pair_splitting")
    observer = sim.attach_stress(1)
    sim.run(1, system.dt)
    start = system.at(positions=np.array(sim.positions))
    sim.run(1, system.dt)
    end = system.at(positions=np.array(sim.positions))
    expected = 0.0
    for draw, state in enumerate((start, end)):
        p = state.pairs
        _, _, kick = exchange_terms(state, p, 1, draw, 0.5 * system.dt)
        expected = expected + 0.5 * np.einsum("pa,pb->ab", p.vector, kick)
    got = stress_rows(observer, 3)[0, 3] * float(np.prod(system.box)) * system.dt
    assert np.allclose(got, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("dimension", [2, 3])
def test_stress_correlator_against_the_series(dimension: int) -> None:
    system = rescaled(problem(dimension, dt=0.01), 2e-9, 3e-24, 5e-12)
    sim = core(system, "pair_splitting")
    series, observer = sim.attach_stress(2), sim.attach_stress_correlator(2, 4, 3, True)
    sim.run(90, system.dt)
    energy, time = observer.units()
    interval = 2 * system.dt / time
    volume = float(np.prod(system.box))
    parts = stress_rows(series, dimension) * volume / energy
    steps = parts * interval  # increments of the moments
    total = parts.sum(axis=1)
    off = ~np.eye(dimension, dtype=bool)
    reference = np.trace(total[0]) / dimension
    whole = total - reference * np.eye(dimension)
    lags, sums = observer.lags().astype(int), observer.blocks().sum(axis=0)
    assert lags.tolist() == [0, 1, 2, 3, 4, 6, 8, 12]
    for lag, row in zip(lags, sums, strict=True):
        every = 1 if lag < 4 else (2 if lag < 8 else 4)
        last = np.arange(lag, len(total))
        last = last[last % every == 0]
        assert row[0] == len(last)
        expected = np.zeros(23)
        for t in last:
            moved = steps[t - lag + 1 : t + 1].sum(axis=0)
            pairs = [(p, q) for p in range(4) for q in range(p, 4)]
            expected[:10] += [np.mean(moved[p][off] * moved[q][off]) for p, q in pairs]
            diagonal = np.diag(moved.sum(axis=0)) - reference * lag * interval
            now, past = np.diag(whole[t]), np.diag(whole[t - lag])
            expected[10:13] += [diagonal.mean() ** 2, diagonal.mean(), np.mean(diagonal**2)]
            expected[13 : 13 + dimension] += diagonal
            expected[16] += np.mean(total[t][off] * total[t - lag][off])
            expected[17:20] += [
                now.mean() * past.mean(),
                (now + past).mean() / 2,
                np.mean(now * past),
            ]
            expected[20 : 20 + dimension] += (now + past) / 2
        scale = np.abs(sums).max(axis=0)[1:]
        assert np.allclose(row[1:], expected, rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.parametrize("dimension", [2, 3])
def test_currents(dimension: int) -> None:
    """Modes of a direct sum, in units that are not 1, over particles that cross the boundary."""
    system = problem(dimension, cells=(9, 7, 6)[:dimension], dt=0.05)
    system = rescaled(system, 2e-9, 3e-24, 5e-12)
    system = system.at(velocities=system.velocities + 2e-9 / 5e-12)
    sim = core(system, "pair_splitting")
    vectors = [[1, 0, 0], [0, 3, 1], [-2, 1, 0], [1, -1, 2]]
    vectors = [vector[:dimension] for vector in vectors]
    observer = sim.attach_currents(2, vectors, 4, 2)
    positions, velocities = [], []
    for _ in range(30):
        sim.run(2, system.dt)
        positions.append(np.array(sim.positions))
        velocities.append(np.array(sim.velocities))
    assert np.abs(sim.images).max() > 0
    k = 2.0 * np.pi * np.array(vectors) / system.box
    wave = np.exp(1j * np.einsum("tia,ka->tki", positions, k)) / np.sqrt(system.size)
    rho = wave.sum(axis=2)
    current = np.einsum("tki,tia->tka", wave, velocities)
    unit = k / np.linalg.norm(k, axis=1)[:, None]
    along = np.einsum("tka,ka->tk", current, unit)
    across = current - along[..., None] * unit
    lags, sums = observer.lags().astype(int), observer.blocks().sum(axis=0)
    assert lags.tolist() == [0, 1, 2, 3, 4, 6]
    for lag, row in zip(lags, sums, strict=True):
        last = np.arange(lag, 30)
        last = last[last % (1 if lag < 4 else 2) == 0]
        first = last - lag
        side = np.sum(across[first].conj() * across[last], axis=2) / (dimension - 1)
        expected = [
            (rho[first].conj() * rho[last]).real,
            (along[first].conj() * along[last]).real,
            side.real,
            (rho[first].conj() * along[last]).imag,
            (along[first].conj() * rho[last]).imag,
        ]
        assert row[0] == len(last)
        got = row[1:].reshape(len(vectors), 5)
        scale = np.abs(sums[0, 1:].reshape(len(vectors), 5)).max(axis=0)
        for column, value in enumerate(expected):
            tolerance = 1e-10 * (scale[column] if column < 3 else np.sqrt(scale[0] * scale[1]))
            assert np.allclose(got[:, column], value.sum(axis=0), rtol=1e-10, atol=tolerance)


def attach_all(sim: Any) -> list[Any]:
    """Every observer there is; each with the arrays it shows."""
    vectors = [[1] * len(sim.positions[0]), [0] * (len(sim.positions[0]) - 1) + [2]]
    return [
        sim.attach_thermodynamics(1).table,
        sim.attach_stress(2).table,
        sim.attach_correlator(2, 8, 3).blocks,
        sim.attach_stress_correlator(1, 4, 3, False).blocks,
        sim.attach_currents(1, vectors, 4, 2).blocks,
    ]


@pytest.mark.parametrize("iterations", [0, 2])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_observers_do_not_change_the_trajectory(integrator: str, iterations: int) -> None:
    system = problem(3)
    plain, observed = (core(system, integrator, iterations=iterations) for _ in range(2))
    attach_all(observed)
    for sim in (plain, observed):
        sim.run(10, system.dt)
    assert np.array_equal(plain.positions, observed.positions)
    assert np.array_equal(plain.velocities, observed.velocities)
    assert np.array_equal(plain.forces, observed.forces)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_what_observers_see_does_not_depend_on_threads(integrator: str) -> None:
    system = problem(3, cells=(14, 13, 12))
    seen = []
    for threads in (1, 2, 3):
        sim = core(system, integrator, threads=threads)
        shown = attach_all(sim)
        sim.run(7, system.dt)
        seen.append([show() for show in shown])
    for other in seen[1:]:
        for one, two in zip(seen[0], other, strict=True):
            assert one.size and np.array_equal(one, two)


def test_a_detached_observer_stays_readable_and_silent() -> None:
    system = problem(3)
    sim = core(system)
    observer = sim.attach_thermodynamics(1)
    sim.run(4, system.dt)
    sim.detach_all()
    sim.run(4, system.dt)
    assert observer.table()[:, 0].tolist() == [1, 2, 3, 4]
