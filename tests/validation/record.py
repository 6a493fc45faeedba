"""The record of the long tests: what they measured, on which sources.

`results.json` holds one entry a case: its numbers, the machine, and a hash of the physics sources
that produced them. A default test (tests/unit/test_validation_results.py) fails when those sources
have changed since, unless short trajectories show that they still make the same physics
(signature.py): then `make validation` is due.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

from tests.validation import signature

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests" / "validation" / "results.json"

# What decides a trajectory. The binding, observers and Python layer are covered by default tests.
# Files of walls count for the cases with walls only: without walls none of their code runs.
WALLED = {
    "channel_noise",
    "conductivity",
    "containment",
    "couette",
    "cylinder",
    "entropy",
    "fuzz",
    "hard",
    "nitrogen",
    "poiseuille",
    "thermal_couette",
    "wall_equilibrium",
    "wall_flows",
    "wall_models",
}
WALLS = ("sweep/wall", "wall/")
# Cases that take velocity Verlet, whose noise is drawn in a way of its own.
VERLET = {"hard", "long_correlator", "wall_models"}
# Likewise for fluids with an energy.
THERMAL = {
    "conductivity",
    "energy_waves",
    "entropy",
    "fuzz",
    "hard",
    "nitrogen",
    "thermal_couette",
    "thermal_equilibrium",
}
ENERGY = (
    "eos/caloric/",
    "integrator/thermal",
    "physics/thermal",
    "sweep/heat_tally.rs",
    "sweep/pair_state.rs",
    "sweep/thermal",
    "sweep/work.rs",
    "thermal.rs",
)
PHYSICS = (
    "domain",
    "effect.rs",
    "eos",
    "integrator",
    "kernel",
    "neighbor",
    "physics",
    "random",
    "relax.rs",
    "simulation",
    "simulation.rs",
    "state.rs",
    "sweep",
    "thermal.rs",
    "units.rs",
    "wall",
)


def physics_hash(case: str) -> str:
    """Hash of the Rust sources that decide the trajectories of a case, comments included."""
    digest = hashlib.sha256()
    source = ROOT / "src"
    for name in PHYSICS:
        path = source / name
        files = sorted(path.rglob("*.rs")) if path.is_dir() else [path]
        for file in files:
            place = file.relative_to(source).as_posix()
            if place.startswith(WALLS) and case not in WALLED:
                continue
            if place.startswith(ENERGY) and case not in THERMAL:
                continue
            digest.update(file.relative_to(ROOT).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def stale(case: str) -> str | None:
    """Why the record of a case is not one of the present sources; None where it is."""
    recorded = load()[case]["physics"]
    if recorded == physics_hash(case):
        return None
    return signature.difference(recorded, groups(case))


def groups(case: str) -> tuple[str, ...]:
    """Groups of scenes that tell whether the physics of a case is the same."""
    more = {
        "verlet": case in VERLET,
        "walled": case in WALLED,
        "thermal": case in THERMAL,
        "wall models": case == "wall_models",
    }
    return ("open", *(name for name, wanted in more.items() if wanted))


def load() -> dict[str, Any]:
    """The record, empty where there is none yet."""
    if not RESULTS.exists():
        return {}
    record: dict[str, Any] = json.loads(RESULTS.read_text())
    return record


def _commit() -> str:
    command = ["git", "rev-parse", "--short", "HEAD"]
    child = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return child.stdout.strip() or "unknown"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def store(case: str, numbers: dict[str, Any]) -> None:
    """Writes one case into the record, with what it was measured on."""
    record = load()
    physics = physics_hash(case)
    kept = {entry["physics"] for name, entry in record.items() if name != case}
    signature.store(physics, groups(case), kept)
    record[case] = {
        "physics": physics,
        "commit": _commit(),
        "machine": f"{_processor()}, {platform.system()}",
        "numbers": numbers,
    }
    _write(record)


def judge(case: str, passed: bool) -> None:
    """Adds whether all tests of a case passed, at the end of the session that recorded it."""
    record = load()
    if case in record and record[case]["physics"] == physics_hash(case):
        record[case]["passed"] = passed
        _write(record)


def _write(record: dict[str, Any]) -> None:
    """Written aside, then renamed: nobody reads half a record."""
    aside = RESULTS.with_suffix(f".{os.getpid()}")
    aside.write_text(json.dumps(record, indent=2, sort_keys=True) + "\n")
    aside.replace(RESULTS)
