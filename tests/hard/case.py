"""A hard case: what it is made of, how it is run, how its numbers are judged.

`cases.toml` holds one row a case: why it is hard, what other methods do, what this package does,
and for the reduced and the full form the number of particles and steps, the limits and the time. A
function registered under the name of the row runs it. The two must agree.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import sdpd

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["CASES", "FORMS", "Found", "case", "judge", "plain_fluid", "rows", "simulation"]

FORMS = ("reduced", "full")
TABLE = Path(__file__).with_name("cases.toml")


@dataclass
class Found:
    """What a case has done.

    Attributes
    ----------
    particles, steps : int
        Of its longest run.
    numbers : dict
        What was measured; those named among the limits of its row are judged, and a number NAME
        with a NAME_stderr beside it as an estimate.
    """

    particles: int
    steps: int
    numbers: dict[str, Any] = field(default_factory=dict)


CASES: dict[str, Callable[[bool], Found]] = {}


def case(name: str) -> Callable[[Callable[[bool], Found]], Callable[[bool], Found]]:
    """Register the function that runs a case: of whether in full, to what it found."""

    def register(function: Callable[[bool], Found]) -> Callable[[bool], Found]:
        assert name not in CASES, name
        CASES[name] = function
        return function

    return register


def rows() -> dict[str, dict[str, Any]]:
    """The table, by name."""
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))["case"]
    return {row["name"]: row for row in table}


def judge(name: str, *, full: bool) -> dict[str, Any]:
    """Run a case and hold it to its row; its numbers, with the seconds it took.

    An estimate is within its limit if it is so less three standard errors, of which one must be
    smaller than half the limit: a looser one would not see the fault.
    """
    form = rows()[name][FORMS[full]]
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
        found = CASES[name](full)
    seconds = time.process_time() - began
    assert (found.particles, found.steps) == (form["particles"], form["steps"]), found
    for key, limit in form["limits"].items():
        value, error = abs(found.numbers[key]), found.numbers.get(f"{key}_stderr", 0.0)
        assert error <= 0.5 * limit, f"{key}: {error:.3g} is too coarse for {limit:g}"
        assert value <= limit + 3.0 * error, f"{key}: {value:.4g} +- {error:.2g} > {limit:g}"
    assert seconds <= form["seconds"], f"{seconds:.1f} s of one core > {form['seconds']} s"
    return {
        "particles": found.particles,
        "steps": found.steps,
        "seconds": round(seconds, 2),
        **found.numbers,
    }


def plain_fluid(eta: float = 20.0, law: Any = None, **changes: Any) -> sdpd.Fluid:
    """m = dx = k_B T = 1."""
    constants: dict[str, Any] = {
        "density": 1.0,
        "shear_viscosity": eta,
        "temperature": 1.0,
        "boltzmann_constant": 1.0,
        "equation_of_state": law or sdpd.eos.IdealGas(),
    }
    return sdpd.Fluid(**{**constants, **changes})


def simulation(scene: sdpd.Scene, **options: Any) -> sdpd.Simulation:
    """On one thread, with a fixed seed."""
    return sdpd.Simulation(scene, **{"seed": 1, "threads": 1, **options})
