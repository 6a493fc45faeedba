"""A few hundred damaged scene files and checkpoints; `make validation` takes a hundred thousand."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import sdpd

from . import fuzzing, mutations
from .case import tomllib

FILES = 300


def test_scenes() -> None:
    found = fuzzing.fuzz_scenes(FILES)
    assert found["files"] >= FILES and found["ValueError"] > 0.3 * FILES


def test_checkpoints(tmp_path: Path) -> None:
    found = fuzzing.fuzz_checkpoints(FILES, tmp_path)
    assert found["files"] >= FILES and found["CheckpointError"] > 0.5 * FILES


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    return mutations.saved(tmp_path)["waves"]


def rewrite(path: Path, packing: int, members: dict[str, bytes]) -> None:
    """The archive with some members replaced."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", packing) as archive:
        for name, data in {**content, **members}.items():
            archive.writestr(name, data)


def test_a_size_is_not_taken_at_its_word(whole: Path) -> None:
    """An array that claims 10^15 rows is refused before anything is allocated for it."""
    header = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (10**15, 4)}
    np.lib.format.write_array_header_1_0(header, claim)
    rewrite(whole, zipfile.ZIP_STORED, {"position.npy": header.getvalue()})
    before = fuzzing._memory()
    with pytest.raises(sdpd.CheckpointError, match="its array 'position'"):
        sdpd.load(whole)
    assert fuzzing._memory() - before < 100.0


def test_what_is_compressed_is_not_unpacked(whole: Path) -> None:
    """A megabyte of zeros packs into a kilobyte, a terabyte into a gigabyte."""
    rewrite(whole, zipfile.ZIP_DEFLATED, {"position.npy": bytes(10**6)})
    with pytest.raises(sdpd.CheckpointError, match="compressed"):
        sdpd.load(whole)


def test_deep_nesting_is_refused(whole: Path) -> None:
    deep = "[" * 100_000
    with pytest.raises(ValueError, match="nested too deeply"):
        sdpd.Scene.from_toml(f"walls = {deep}\n")
    rewrite(whole, zipfile.ZIP_STORED, {"header.json": f'{{"format": {deep}'.encode()})
    with pytest.raises(sdpd.CheckpointError):
        sdpd.load(whole)
    rewrite(whole, zipfile.ZIP_STORED, {"header.json": json.dumps([]).encode()})
    with pytest.raises(sdpd.CheckpointError, match="not a checkpoint of sdpd"):
        sdpd.load(whole)


FOUND = [  # seed, changes of values, a piece of the error: what longer runs have found
    ("heated", {("fluid", "conductivity_exponent"): 2**31}, "scales within double precision"),
    ("heated", {("fluid", "density"): 1e201}, "scales within double precision"),
    ("closed", {("fluid", "shear_viscosity"): 1e308}, "scales within double precision"),
    ("cylinder", {("walls", 0, "radius"): 1e308}, "scales within double precision"),
    ("waves", {("resolution", "support"): 2200.0}, "`resolution.support` must be <= 50 spacings"),
    ("polygon", {("walls", 0, "points", 1, 0): 1e200}, "must be within 1e75 of the origin"),
]


@pytest.mark.parametrize(("seed", "changes", "text"), FOUND)
def test_what_was_found(seed: str, changes: dict[tuple[str | int, ...], float], text: str) -> None:
    tree = tomllib.loads(mutations.SEEDS[seed])
    for path, value in changes.items():
        parent = tree
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = value
    with pytest.raises(ValueError, match=text):
        sdpd.Scene.from_toml(tomli_w.dumps(tree) + "\n")


def test_a_surface_in_a_box_of_millions_of_supports_is_refused() -> None:
    corners = 1e7 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    box = sdpd.Box((1e7, 1e7), periodic="")
    with pytest.raises(ValueError, match="bricks of 8 cells"):
        sdpd.Polyline(points=corners).field(box, 1.0, "lucy", name="wall")
