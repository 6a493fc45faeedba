"""The record of the long tests exists, is complete and belongs to the present physics sources."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sdpd
from tests.validation import record, signature

CASES = sorted(path.parent.name for path in record.RESULTS.parent.glob("*/test_*.py"))


def test_there_are_cases() -> None:
    assert {"bian2015", "diffusion_water", "poiseuille", "viscosity"} <= set(CASES)


@pytest.mark.parametrize("case", CASES)
def test_the_record_is_of_the_present_sources(case: str) -> None:
    results = record.load()
    assert case in results, f"no record of {case}: run `make validation`"
    entry = results[case]
    assert entry["numbers"], f"the record of {case} is empty"
    reason = record.stale(case)
    assert reason is None, f"the physics has changed since {case}: run `make validation` ({reason})"
    assert entry.get("passed") is True, f"tests of {case} failed when it was recorded"


def test_walled_cases_alone_depend_on_the_files_of_walls() -> None:
    assert set(CASES) >= record.WALLED | record.THERMAL | record.VERLET
    hashes = {record.physics_hash(case) for case in ("thermal_couette", "poiseuille", "bian2015")}
    assert len(hashes) == 3
    assert record.physics_hash("thermal_equilibrium") not in hashes
    assert all((record.ROOT / "src" / name).exists() for name in record.ENERGY if "." in name)
    assert record.physics_hash("poiseuille") != record.physics_hash("bian2015")
    assert record.physics_hash("bian2015") == record.physics_hash("viscosity")
    sources = [path for name in record.WALLS for path in record.ROOT.glob(f"src/{name}*")]
    assert len(sources) >= 4, "src/wall and src/sweep/wall*.rs have moved: see record.WALLS"


@pytest.mark.parametrize("group", ["open", "verlet", "walled", "thermal"])
def test_signatures_tell_other_physics_from_the_same(
    group: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signature, "SIGNATURES", tmp_path / "signatures.json")
    assert signature.difference("a", [group]) == "no signature of those sources is kept"
    signature.store("a", [group], set())
    assert signature.difference("a", [group]) is None
    # of the sources that no record is of any more nothing is kept
    signature.store("b", [group], {"b"})
    kept = signature.load()
    assert set(kept) == {"b"}
    name = list(signature.GROUPS[group])[-1]
    kept["b"][name]["forces"][1] += 1e-6 * kept["b"][name]["forces"][0]
    signature.SIGNATURES.write_text(json.dumps(kept))
    reason = signature.difference("b", [group])
    assert reason is not None and reason.startswith(f"{name}: forces differ by 1.0e-06")


def test_signatures_feel_the_noise() -> None:
    build = signature.OPEN["3D Lucy splitting"]
    sim = build()
    other = sdpd.Simulation(sim.scene, integrator=sim.integrator, seed=4, threads=1)
    other.run(steps=signature.STEPS["pair_splitting"], progress=False)
    numbers, others = signature.numbers(sim), signature.numbers(other)
    for array, values in numbers.items():
        assert np.abs(np.subtract(values, others[array])).max() > 1e-4 * values[0]
