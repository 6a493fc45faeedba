"""A user's own E(N, V, S): what a table gives back, and runs with a heat capacity C(T)."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sdpd
from sdpd import _core

from .thermal import fluid, gas, scene, slab

R, C = 100.0, 25.0  # of `gas`


def evaluate(law: sdpd.eos.EnergyTable, rho: Any, t: Any) -> tuple[np.ndarray, ...]:
    """P, e, s, isothermal and adiabatic speeds squared, c_v."""
    made = fluid(equation_of_state=law)
    table = made.equation_of_state.caloric(made, 1.0, 1.0)
    return tuple(_core.caloric_evaluate(table, np.atleast_1d(rho) * 1.0, np.atleast_1d(t) * 1.0))


def perfect(rho: np.ndarray, s: np.ndarray) -> np.ndarray:
    """e(rho, s) of `gas`."""
    return C * np.exp((s + R * np.log(rho)) / C)


def perfect_table(**changes: Any) -> sdpd.eos.EnergyTable:
    ranges: dict[str, Any] = {"densities": (0.3, 3.0), "temperatures": (0.2, 5.0)}
    return sdpd.eos.EnergyTable.from_energy(perfect, **{**ranges, **changes})


def warming(rho: np.ndarray, t: np.ndarray) -> np.ndarray:
    """f(rho, T) of a gas with c_v = 3 (1 + T) and P = 16 rho T."""
    return 3.0 * (t + 0.5 * t * t) - 3.0 * t * (np.log(t) + t) + 16.0 * t * np.log(rho)


def own(law: sdpd.eos.EnergyTable, **changes: Any) -> sdpd.Scene:
    return scene(fluid(equation_of_state=law), edge=6.0, sound_speed=None, **changes)


def test_van_der_waals_from_its_energy() -> None:
    """P, c_v and both speeds of sound from e(rho, s) = c T - a rho."""
    a, b, c = 0.6, 0.3, 2.5

    def energy(rho: np.ndarray, s: np.ndarray) -> np.ndarray:
        return c * np.exp((s - np.log((1.0 - b * rho) / rho)) / c) - a * rho

    law = sdpd.eos.EnergyTable.from_energy(
        energy, densities=(0.2, 2.2), temperatures=(0.3, 4.0), points=(48, 32)
    )
    rho, t = (x.ravel() for x in np.meshgrid([0.4, 1.0, 1.7], [0.6, 1.0, 2.5]))
    p, e, s, slow, fast, capacity = evaluate(law, rho, t)
    np.testing.assert_allclose(p, rho * t / (1.0 - b * rho) - a * rho**2, atol=1e-4)
    np.testing.assert_allclose(e, c * t - a * rho, atol=1e-6)
    np.testing.assert_allclose(s, c * np.log(c * t / c) + np.log((1.0 - b * rho) / rho), atol=1e-6)
    np.testing.assert_allclose(capacity, c, rtol=1e-9)
    exact = t / (1.0 - b * rho) ** 2 - 2.0 * a * rho
    # Second derivatives of a cubic.
    np.testing.assert_allclose(slow, exact, rtol=6e-3)
    np.testing.assert_allclose(fast, exact + t / (1.0 - b * rho) ** 2 / c, rtol=6e-3)


def test_nitrogen_whose_molecules_vibrate_from_its_free_energy() -> None:
    """c_v by Planck and Einstein from 2.5 to 3.5 R, and gamma with it."""
    gas_constant, theta = 296.8, 3394.0

    def free(rho: np.ndarray, t: np.ndarray) -> np.ndarray:
        own = np.log(rho) - 2.5 * np.log(t) + np.log(-np.expm1(-theta / t))
        return gas_constant * t * own

    law = sdpd.eos.EnergyTable.from_helmholtz(
        free, densities=(0.5, 5.0), temperatures=(150.0, 4000.0)
    )
    t = np.array([200.0, 300.0, 1000.0, 2000.0, 3500.0])
    x = theta / t
    exact = 2.5 + x**2 * np.exp(x) / np.expm1(x) ** 2
    p, _, _, slow, fast, capacity = evaluate(law, np.full_like(t, 1.2), t)
    np.testing.assert_allclose(capacity, gas_constant * exact, rtol=5e-5)
    np.testing.assert_allclose(p, 1.2 * gas_constant * t, rtol=1e-6)
    np.testing.assert_allclose(fast / slow, 1.0 + 1.0 / exact, rtol=5e-5)
    assert law.heat_capacity(1.2, 1000.0) == pytest.approx(capacity[2])


def pair_of_runs(of: Callable[[sdpd.Fluid], sdpd.Scene], **changes: Any) -> list[np.ndarray]:
    """End of a run with the ideal gas and with its table, from the same noise."""
    ends = []
    for law in (sdpd.eos.IdealGas(), perfect_table()):
        sim = sdpd.Simulation(of(fluid(C, equation_of_state=law, **changes)), seed=3, threads=1)
        sim.run(steps=12, progress=False)
        state = (sim.positions, sim.velocities, sim.temperatures[:, None])
        ends.append(np.hstack([np.asarray(x) for x in state]))
    return ends


@pytest.mark.parametrize("exponent", [0.0, 0.7])
@pytest.mark.parametrize("place", ["free", "between plates"])
def test_the_table_of_an_ideal_gas_moves_like_the_ideal_gas(place: str, exponent: float) -> None:
    """Its entropy is linear in the table's coordinates, so the interpolation is exact."""

    def made(of: sdpd.Fluid) -> sdpd.Scene:
        speed = 10.0 if isinstance(of.equation_of_state, sdpd.eos.IdealGas) else None
        if place == "free":
            return scene(of, edge=6.0, start=sdpd.RandomStart(relax_steps=20), sound_speed=speed)
        walls = (sdpd.Isothermal(0.8), sdpd.Adiabatic())
        return slab(*walls, of=of, speed=2.0, height=7.0, noise=True, sound_speed=speed)

    powers = {"viscosity_exponent": exponent, "conductivity_exponent": exponent}
    plain, table = pair_of_runs(made, **powers)
    np.testing.assert_allclose(table, plain, rtol=0, atol=2e-7)


def test_energy_holds_and_entropy_grows_with_any_heat_capacity() -> None:
    """To rounding with the books and noise; without noise towards an even temperature."""
    law = sdpd.eos.EnergyTable.from_helmholtz(
        warming, densities=(0.2, 5.0), temperatures=(0.05, 8.0)
    )
    made = own(law, start=sdpd.RandomStart(relax_steps=20))
    sim = sdpd.Simulation(made, seed=3, threads=1)
    energy = sim.total_energy
    sim.run(steps=200, progress=False)
    assert abs(sim.total_energy - energy) < 1e-11 * energy
    assert float(np.sum(sim.velocities)) == pytest.approx(0.0, abs=1e-10)
    quiet = made.replace(effects=sdpd.Effects(energy=True, fluctuations=False))
    start = 1.0 + 0.5 * np.sin(np.arange(216.0))
    sim = sdpd.Simulation(quiet, seed=3, threads=1, temperatures=start)
    assert np.asarray(sim.temperatures) == pytest.approx(start, rel=1e-12)
    last = sim.entropy
    for _ in range(20):
        sim.run(steps=2, progress=False)
        assert sim.entropy > last
        last = sim.entropy
    assert np.asarray(sim.temperatures).std() < 0.3 * start.std()


def test_temperatures_may_be_written_and_files_bring_all_back(tmp_path: Any) -> None:
    """Positions and temperatures at once: the temperature is one at the new density."""
    law = sdpd.eos.EnergyTable.from_helmholtz(
        warming, densities=(0.2, 5.0), temperatures=(0.05, 8.0), points=(12, 24)
    )
    made = own(law)
    sim = sdpd.Simulation(made, seed=3, threads=1)
    sim.positions[:] += 0.2 * np.sin(np.arange(648.0)).reshape(216, 3)
    sim.positions[:] %= 6.0
    target = np.linspace(0.5, 2.0, 216)
    sim.temperatures[:] = target
    sim.refresh()
    assert np.asarray(sim.temperatures) == pytest.approx(target, rel=1e-12)
    path = tmp_path / "state.sdpd"
    sim.save(path)
    back = sdpd.Simulation.load(path)
    for each in (sim, back):
        each.run(steps=5, progress=False)
    assert np.array_equal(sim.temperatures, back.temperatures)
    assert np.array_equal(sim.positions, back.positions)
    assert sdpd.Scene.from_toml(made.to_toml()) == made


def test_without_an_energy_a_scene_has_the_isotherm() -> None:
    law = sdpd.eos.EnergyTable.from_helmholtz(
        warming, densities=(0.2, 5.0), temperatures=(0.05, 8.0)
    )
    of = sdpd.Fluid(
        density=1.0,
        shear_viscosity=1.0,
        temperature=2.0,
        boltzmann_constant=1.0,
        equation_of_state=law,
    )
    assert of.heat_capacity == pytest.approx(9.0, rel=1e-4)
    made = sdpd.Scene(
        fluid=of, box=sdpd.Box((6.0,) * 3), resolution=sdpd.Resolution(spacing=1.0, support=3.0)
    )
    assert made.sound.speed == pytest.approx(32.0**0.5, rel=1e-3)
    sim = sdpd.Simulation(made, seed=1)
    assert sim.pressures == pytest.approx(32.0 * np.asarray(sim.densities), rel=1e-4)


def good(**changes: Any) -> dict[str, Any]:
    law = perfect_table(points=(8, 8))
    fields = ("densities", "heats", "cold_energies", "entropies")
    return {**{name: getattr(law, name) for name in fields}, **changes}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"densities": (2.0, 1.0)}, "`densities` must be > 0 and increasing"),
        ({"heats": (0.0, 1.0)}, "`heats` must be > 0"),
        ({"cold_energies": (0.0,) * 3}, "`cold_energies` must have at least 8 entries, got 3"),
        ({"entropies": ((0.0,) * 8,) * 7}, "`entropies` must have 8 rows, got 7"),
        ({"entropies": ((0.0,) * 8,) * 8}, "positive temperatures and heat capacities"),
        ({"sound_speed": 3.0}, "`sound_speed` must be None"),
    ],
)
def test_bad_tables_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sdpd.eos.EnergyTable(**good(**changes))


def test_bad_functions_are_refused() -> None:
    ranges: dict[str, Any] = {"densities": (0.3, 3.0), "temperatures": (0.2, 5.0)}
    with pytest.raises(ValueError, match="`energy` must be finite and grow with s"):
        sdpd.eos.EnergyTable.from_energy(lambda rho, s: 1.0 + 0.0 * s, **ranges)
    with pytest.raises(ValueError, match="`temperatures` must be temperatures that"):
        sdpd.eos.EnergyTable.from_energy(lambda rho, s: 0.1 * s, **ranges)
    with pytest.raises(ValueError, match="`energy` must have a positive heat capacity"):
        sdpd.eos.EnergyTable.from_helmholtz(lambda rho, t: t * t + rho, **ranges)
    with pytest.raises(ValueError, match="`energy` must be finite and"):
        sdpd.eos.EnergyTable.from_energy(lambda rho, s: np.inf + s, **ranges)
    with pytest.raises(ValueError, match=r"`points\[1\]` must be"):
        perfect_table(points=(8, 2))
    with pytest.raises(ValueError, match="`thermal_expansion` must be 0 with EnergyTable"):
        fluid(equation_of_state=perfect_table(), thermal_expansion=0.1)

    def boiling(rho: np.ndarray, s: np.ndarray) -> np.ndarray:
        return 2.5 * np.exp((s - np.log((1.0 - 0.3 * rho) / rho)) / 2.5) - 1.5 * rho

    law = sdpd.eos.EnergyTable.from_energy(boiling, densities=(0.2, 2.5), temperatures=(0.5, 4.0))
    with pytest.raises(ValueError, match="pressure that falls with density"):
        own(law)


def test_a_scene_outside_its_table_is_refused() -> None:
    law = perfect_table(densities=(1.5, 3.0), points=(8, 8))
    with pytest.raises(ValueError, match="must reach the density of the fluid 1, but it is tab"):
        own(law)
    law = perfect_table(temperatures=(0.5, 2.0), points=(8, 8))
    of = fluid(C, equation_of_state=law)
    with pytest.raises(ValueError, match="must reach the temperature 3 of the scene"):
        slab(sdpd.Isothermal(1.0), sdpd.Isothermal(3.0), of=of, sound_speed=None)
    with pytest.raises(ValueError, match="must have a fluid with a constant heat capacity"):
        sdpd.fluctuations.run_fluctuations(own(perfect_table()))


def test_temperatures_stay_where_positions_are_written() -> None:
    """Also of the neighbours, and where what is written is what was there; c_v goes with rho."""

    def free(rho: np.ndarray, t: np.ndarray) -> np.ndarray:
        return -5.0 * (1.0 + 0.3 * np.log(rho)) * t * np.log(t) + 16.0 * t * np.log(rho)

    law = sdpd.eos.EnergyTable.from_helmholtz(
        free, densities=(0.2, 5.0), temperatures=(0.05, 8.0), points=(32, 16)
    )
    sim = sdpd.Simulation(own(law), seed=3, threads=1, temperatures=1.5)
    assert np.asarray(sim.temperatures) == pytest.approx(1.5, rel=1e-12)
    sim.positions[0] += 0.3
    sim.refresh()
    assert np.ptp(np.asarray(sim.densities)) > 0.01
    assert np.asarray(sim.temperatures) == pytest.approx(1.5, rel=1e-12)
    sim.positions[:] = (
        np.asarray(sim.positions) + 0.2 * np.sin(np.arange(648.0)).reshape(216, 3)
    ) % 6
    sim.temperatures[:] = 1.5
    sim.refresh()
    assert np.asarray(sim.temperatures) == pytest.approx(1.5, rel=1e-12)


def test_acceptance_is_refused_where_it_makes_no_sense() -> None:
    exact = sdpd.PairSplitting(metropolis=True)
    with pytest.raises(ValueError, match="`metropolis` must be False where particles have no"):
        sdpd.Simulation(scene(effects=sdpd.Effects()), integrator=exact)
    quiet = sdpd.Effects(energy=True, fluctuations=False)
    with pytest.raises(ValueError, match="`metropolis` must be False without fluctuations"):
        sdpd.Simulation(scene(effects=quiet), integrator=exact)
    bath = sdpd.Effects(energy=True, viscous_heating=False)
    with pytest.raises(ValueError, match="`metropolis` must be False without viscous heating"):
        sdpd.Simulation(scene(effects=bath), integrator=exact)
    walled = slab(sdpd.Isothermal(1.0), sdpd.Adiabatic(), noise=True)
    with pytest.raises(ValueError, match="`metropolis` must be False where there are walls"):
        sdpd.Simulation(walled, integrator=exact)
    with pytest.raises(TypeError, match="`metropolis` must be"):
        sdpd.PairSplitting(metropolis="yes")


def test_acceptance_keeps_energy_and_momentum_and_its_bits() -> None:
    runs = []
    for threads in (1, 2):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sdpd.TimeStepWarning)
            sim = sdpd.Simulation(
                scene(gas(5.0), edge=6.0),
                seed=4,
                threads=threads,
                integrator=sdpd.PairSplitting(metropolis=True),
            )
        energy = sim.total_energy
        sim.run(steps=60, progress=False)
        assert abs(sim.total_energy - energy) < 1e-11 * energy
        assert np.asarray(sim.velocities).sum(axis=0) == pytest.approx(0.0, abs=1e-11)
        runs.append(np.asarray(sim.temperatures).copy())
    assert np.array_equal(*runs)
    assert 0 < sim.energy_accounts().refused < 0.2 * 2 * 2 * 60 * 216 * 40
