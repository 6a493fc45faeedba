"""Transient Couette flow without noise: within 1 %, better as the support grows."""

from __future__ import annotations

from tests.validation import channel

KIND = "couette"


def test_as_published_within_one_per_cent() -> None:
    channel.check_transient(KIND)


def test_the_floor_is_the_viscosity_of_the_lattice() -> None:
    channel.check_floor(KIND)
