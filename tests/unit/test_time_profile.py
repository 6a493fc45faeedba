"""`Simulation.profile`: whose time is counted, and how it is told."""

import time

import pytest

import sdpd
from sdpd.time_profile import PHASES, TimeProfile

from .sims import small
from .thermal import gas, scene


def test_a_new_simulation_has_spent_nothing() -> None:
    profile = small().profile()
    assert profile.steps == 0 and profile.total == 0.0
    assert set(profile.seconds) == set(PHASES)
    assert set(profile.per_particle_step.values()) == {0.0}
    assert "0 steps of" in str(profile)


@pytest.mark.parametrize("energy", [False, True])
def test_phases_share_the_time_of_the_runs(energy: bool) -> None:
    sim = sdpd.Simulation(scene(gas(25.0)), threads=1, seed=1) if energy else small()
    begin = time.perf_counter()
    sim.run(steps=7, progress=False)
    sim.run(steps=3, progress=False)
    wall = time.perf_counter() - begin
    profile = sim.profile()
    assert profile.steps == 10 and profile.n_particles == sim.n_particles
    assert 0.0 < profile.total <= wall
    for phase in ("densities", "forces", "exchanges", "motion"):
        assert profile.seconds[phase] > 0.0, phase
    assert profile.seconds["observers"] == 0.0
    whole = sum(profile.per_particle_step.values()) * sim.n_particles * 10 * 1e-9
    assert whole == pytest.approx(profile.total)


def test_reset_counts_from_there_on() -> None:
    sim = small()
    sim.run(steps=4, progress=False)
    assert sim.profile(reset=True).steps == 4
    sim.force_parts()  # nobody's time
    assert sim.profile().total == 0.0
    sim.run(steps=2, progress=False)
    assert sim.profile().steps == 2
    with pytest.raises(TypeError, match="`reset` must be True or False, got 1"):
        sim.profile(reset=1)  # type: ignore[arg-type]


def test_it_is_told_by_phase() -> None:
    profile = TimeProfile({"lists": 0.0, "densities": 1.0, "forces": 3.0}, 2000, 1000, 2, "avx2")
    assert profile.per_particle_step == {"lists": 0.0, "densities": 500.0, "forces": 1500.0}
    text = str(profile)
    assert "2000 ns per particle-step, threads = 2, avx2" in text and "75.0%" in text
    assert "lists" not in text
    assert profile.as_dict()["seconds"]["forces"] == 3.0
