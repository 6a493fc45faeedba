"""The record of the long tests exists, is complete and belongs to the present physics sources."""

from __future__ import annotations

import pytest

from tests.validation import record

CASES = sorted(path.parent.name for path in record.RESULTS.parent.glob("*/test_*.py"))


def test_there_are_cases() -> None:
    assert {"bian2015", "diffusion_water", "poiseuille", "viscosity"} <= set(CASES)


@pytest.mark.parametrize("case", CASES)
def test_the_record_is_of_the_present_sources(case: str) -> None:
    results = record.load()
    assert case in results, f"no record of {case}: run `make validation`"
    entry = results[case]
    assert entry["numbers"], f"the record of {case} is empty"
    assert entry["physics"] == record.physics_hash(case), (
        f"the physics sources have changed since {case} was recorded: run `make validation`"
    )
    assert entry.get("passed") is True, f"tests of {case} failed when it was recorded"


def test_walled_cases_alone_depend_on_the_files_of_walls() -> None:
    assert set(CASES) >= record.WALLED
    assert record.physics_hash("poiseuille") != record.physics_hash("bian2015")
    assert record.physics_hash("bian2015") == record.physics_hash("viscosity")
    sources = [path for name in record.WALLS for path in record.ROOT.glob(f"src/{name}*")]
    assert len(sources) >= 4, "src/wall and src/sweep/wall*.rs have moved: see record.WALLS"
