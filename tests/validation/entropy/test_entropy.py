"""Without noise entropy never falls: a million strongly driven steps, with and without walls."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import pytest

from tests.validation import channel, record

CASE = "entropy"
SCRIPT = channel.script("entropy")
SCENES = ("isolated", "between_plates")
FRACTIONS = (0.06, 0.12, 0.25)


@cache
def followed(name: str, books: bool) -> Any:
    """At the default step: a million steps with the books kept, fewer on adiabats."""
    return SCRIPT.follow(
        getattr(SCRIPT, name)(), 0.25, SCRIPT.STEPS if books else 100_000, books=books
    )


@cache
def thin(fraction: float, books: bool) -> Any:
    """Hardly any friction."""
    return SCRIPT.follow(SCRIPT.isolated(SCRIPT.THIN), fraction, 20_000, books=books)


@pytest.mark.parametrize("name", SCENES)
def test_entropy_never_falls(name: str) -> None:
    """Every step is looked at."""
    found = followed(name, True)
    # what is produced is always far above rounding: it is driven all the time
    assert found.falls == 0 and found.least > 1e-4
    # what a million steps of heat and work through the walls leave of sixteen digits
    assert found.energy < (1e-13 if name == "isolated" else 1e-11)


@pytest.mark.parametrize("name", SCENES)
def test_nor_does_it_on_adiabats(name: str) -> None:
    found = followed(name, False)
    assert found.falls == 0 and found.least > 1e-4


def test_what_the_books_cost_where_there_is_hardly_any_friction() -> None:
    """The work of the books is not that of the adiabat: entropy wavers with sound, as dt^2."""
    kept = {fraction: thin(fraction, True) for fraction in FRACTIONS}
    assert kept[0.25].falls > 1000 and -0.03 < kept[0.25].least < -0.003
    assert kept[0.12].least > 0.3 * kept[0.25].least
    adiabats = thin(0.25, False)
    # to rounding; but the energy is not
    assert adiabats.falls == 0 and adiabats.energy > 1e-4


def test_record() -> None:
    found = {f"{name}, books kept": followed(name, True) for name in SCENES}
    found |= {f"{name}, adiabats": followed(name, False) for name in SCENES}
    for fraction in FRACTIONS:
        name = f"hardly any friction, books kept, {fraction:g} of the acoustic limit"
        found[name] = thin(fraction, True)
    found["hardly any friction, adiabats"] = thin(0.25, False)
    record.store(CASE, {name: dataclasses.asdict(each) for name, each in found.items()})
