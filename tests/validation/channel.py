"""Flows between walls as the scripts of the docs measure them, for the tests beside this file."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

import sdpd
from tests.validation import record

SCRIPTS = Path(__file__).resolve().parents[2] / "docs" / "scripts"


def script(name: str) -> Any:
    """A script of docs/scripts as a module."""
    if str(SCRIPTS) not in sys.path:
        sys.path.insert(0, str(SCRIPTS))
    return importlib.import_module(name)


def check_transient(kind: str) -> None:
    """As published within 1 %, better as the support grows; records the case."""
    channel = script("channel")
    moments = channel.flow(kind, sdpd.scenes.load(kind))
    assert max(m.rms for m in moments) < 0.01
    # bulk and wall alike, where the dissertation has 4 % and 5 %
    assert max(m.density for m in moments) < 0.005
    refined = [
        channel.flow(kind, channel.thin_scene(kind, n, support))
        for support, n in channel.REFINEMENT
    ]
    largest = np.array([max(m.rms for m in run) for run in refined])
    # first order or better in the spacing, with h/dx growing as it falls
    assert largest[2] < largest[0] / 4.0 * 1.05
    names = [f"h/dx {s:g}, {n} across" for s, n in channel.REFINEMENT]
    record.store(
        kind,
        {
            "rms_error_over_maximum": {f"{m.time:g} s": m.rms for m in moments},
            "density_error": max(m.density for m in moments),
            "refinement_largest_rms": dict(zip(names, largest.tolist(), strict=True)),
        },
    )


def check_floor(kind: str) -> None:
    """Against the closed form with the viscosity of the lattice, most of the error is gone."""
    channel = script("channel")
    scene = channel.thin_scene(kind, 31, 3.0)
    plain = channel.flow(kind, scene, (0.1, 0.2))
    known = channel.flow(kind, scene, (0.1, 0.2), factor=scene.factors.viscosity)
    assert all(b.rms < 0.6 * a.rms for a, b in zip(plain, known, strict=True))
