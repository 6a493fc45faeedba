"""Without noise entropy never falls: a million strongly driven steps, with and without walls."""

from __future__ import annotations

import dataclasses

import pytest

from tests.validation import channel, record

CASE = "entropy"
NUMBERS: dict[str, object] = {}


def _record(name: str, found: object) -> None:
    NUMBERS[name] = dataclasses.asdict(found)  # type: ignore[call-overload]


@pytest.mark.parametrize("name", ["isolated", "between_plates"])
def test_entropy_never_falls(name: str) -> None:
    """At the default step, the books kept; every step is looked at."""
    script = channel.script("entropy")
    found = script.follow(getattr(script, name)(), 0.25, script.STEPS, books=True)
    # what is produced is always far above rounding: it is driven all the time
    assert found.falls == 0 and found.least > 1e-4
    # what a million steps of heat and work through the walls leave of sixteen digits
    assert found.energy < (1e-13 if name == "isolated" else 1e-11)
    _record(f"{name}, books kept", found)


@pytest.mark.parametrize("name", ["isolated", "between_plates"])
def test_nor_does_it_on_adiabats(name: str) -> None:
    script = channel.script("entropy")
    found = script.follow(getattr(script, name)(), 0.25, 100_000, books=False)
    assert found.falls == 0 and found.least > 1e-4
    _record(f"{name}, adiabats", found)


def test_what_the_books_cost_where_there_is_hardly_any_friction() -> None:
    """The work of the books is not that of the adiabat: entropy wavers with sound, as dt^2."""
    script = channel.script("entropy")
    thin = script.isolated(script.THIN)
    kept = {x: script.follow(thin, x, 20_000, books=True) for x in (0.06, 0.12, 0.25)}
    assert kept[0.25].falls > 1000 and -0.03 < kept[0.25].least < -0.003
    assert kept[0.12].least > 0.3 * kept[0.25].least
    adiabats = script.follow(thin, 0.25, 20_000, books=False)
    # to rounding; but the energy is not
    assert adiabats.falls == 0 and adiabats.energy > 1e-4
    for fraction, found in kept.items():
        _record(f"hardly any friction, books kept, {fraction:g} of the acoustic limit", found)
    _record("hardly any friction, adiabats", adiabats)
    record.store(CASE, NUMBERS)
