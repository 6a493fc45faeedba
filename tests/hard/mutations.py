"""Damaged scene files and checkpoints: seeds, ways to damage them, and what is right.

Hypothesis draws the damage. Whatever it is, a file is read whole or refused by an error that says
where: ValueError, TypeError or OSError, within seconds, and nothing is left half loaded.
"""

from __future__ import annotations

import copy
import datetime as dt
import io
import json
import math
import struct
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from hypothesis import strategies as st

import sdpd
from sdpd import checkpoint, scenes

from .case import plain_fluid, simulation, tomllib

Tree = dict[str, Any]
_FOLDER = Path(scenes.__file__).parent


def _seeds() -> dict[str, str]:
    """Texts of scenes that between them have the keys of the format, but for meshes."""
    box = sdpd.Box((6.0, 6.0), periodic="")
    corners = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]])
    common: Tree = {"resolution": sdpd.Resolution(spacing=1.0, support=2.2), "sound_speed": 10.0}
    heated = plain_fluid(heat_capacity=50.0, thermal_conductivity=10.0, viscosity_exponent=0.5)
    made = {
        "closed": sdpd.Scene(
            fluid=plain_fluid(), box=box, walls=sdpd.walls.enclosure(box), **common
        ),
        "polygon": sdpd.Scene(
            fluid=plain_fluid(law=sdpd.eos.Polynomial(coefficients=(0.0, 100.0, 1.0))),
            box=box,
            walls=(sdpd.Polyline(points=corners),),
            start=sdpd.RandomStart(relax=False),
            resolution=common["resolution"],
        ),
        "heated": sdpd.Scene(
            fluid=heated,
            box=sdpd.Box((6.0, 6.0), periodic="x"),
            walls=(
                sdpd.Plane(axis="y", at=0.0, heat=sdpd.Isothermal(2.0)),
                sdpd.Plane(axis="y", at=6.0, heat=sdpd.HeatFlux(1.0)),
            ),
            **common,
        ),
        "waves": sdpd.Scene(
            fluid=plain_fluid(
                law=sdpd.eos.Table(densities=(0.5, 1.0, 2.0), pressures=(50.0, 100.0, 200.0))
            ),
            box=sdpd.Box((6.0, 6.0)),
            body_force=sdpd.SinusoidalForce(amplitude=1.0),
            start=sdpd.LatticeStart(jitter=0.1),
            velocity_scale=1.0,
            length_scale=1.0,
            calibrate=True,
            resolution=sdpd.Resolution(particles=(6, 6), support=2.6),
        ),
        "models": sdpd.Scene(
            fluid=plain_fluid(),
            box=box,
            walls=sdpd.walls.enclosure(box),
            wall_model=sdpd.OwnFootImages(),
            **common,
        ),
    }
    texts = {name: scene.to_toml() for name, scene in made.items()}
    ready = {path.stem: path.read_text(encoding="utf-8") for path in _FOLDER.glob("*.toml")}
    return {**texts, **ready}


with warnings.catch_warnings():
    warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
    SEEDS = _seeds()

# Values that somebody's editor, script or disk may put in the place of a right one.
ODD: tuple[Any, ...] = (
    0,
    -1,
    1,
    2**31,
    2**63,
    10**400,
    -(10**30),
    0.0,
    -0.0,
    1e-320,
    1e308,
    -1e-9,
    math.nan,
    math.inf,
    -math.inf,
    True,
    False,
    "",
    "x",
    "nan",
    "../../etc/passwd",
    "no\x00file",
    "ä" * 300,
    [],
    [[]],
    [1.0],
    [1.0] * 7,
    ["x", 1],
    [math.nan, 1.0],
    [[0.0, 0.0], [1.0, 0.0]],
    {},
    {"kind": "plane"},
    {"kind": []},
    {"": 1},
    dt.date(2020, 2, 29),
)
FACTORS = (-1.0, 0.0, 0.5, 2.0, 10.0, 1e-3, 1e3, 1e-12, 1e12, 1e200, 1e-200)


def paths(tree: Any, root: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Ways to every value of nested tables and arrays."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        yield (*root, key)
        if isinstance(value, (dict, list)):
            yield from paths(value, (*root, key))


def _parent(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path[:-1]:
        tree = tree[key]
    return tree


@st.composite
def mutated_trees(draw: st.DrawFn, seed: Any, *, plain: bool = False) -> Any:
    """A tree with one to three values dropped, replaced, scaled, renamed or moved elsewhere."""
    tree = copy.deepcopy(seed)
    odd = [value for value in ODD if not (plain and isinstance(value, dt.date))]
    for _ in range(draw(st.integers(1, 3))):
        places = list(paths(tree))
        if not places:
            break
        path = draw(st.sampled_from(places))
        parent, key = _parent(tree, path), path[-1]
        kind = draw(st.sampled_from(("replace", "replace", "scale", "drop", "rename", "move")))
        value = parent[key]
        if kind == "scale" and isinstance(value, (int, float)) and not isinstance(value, bool):
            factor = draw(st.sampled_from(FACTORS))
            parent[key] = value * (int(factor) if isinstance(value, int) else factor)
        elif kind == "drop":
            del parent[key]
        elif kind == "rename" and isinstance(parent, dict):
            parent[draw(st.sampled_from((f"{key}s", key.upper(), "", "kind", "é")))] = parent.pop(
                key
            )
        elif kind == "move":
            other = draw(st.sampled_from(places))
            parent[key] = copy.deepcopy(_parent(tree, other)[other[-1]])
        else:
            parent[key] = copy.deepcopy(draw(st.sampled_from(odd)))
    return tree


@st.composite
def mutated_bytes(draw: st.DrawFn, seed: bytes) -> bytes:
    """Bytes flipped, cut off, cut out, repeated, overwritten with zeros or with large numbers."""
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 3))):
        if not data:
            break
        kind = draw(st.sampled_from(("flip", "flip", "cut", "drop", "repeat", "zero", "size")))
        at = draw(st.integers(0, len(data) - 1))
        length = draw(st.integers(1, 40))
        if kind == "flip":
            data[at] ^= 1 << draw(st.integers(0, 7))
        elif kind == "cut":
            del data[at:]
        elif kind == "drop":
            del data[at : at + length]
        elif kind == "repeat":
            data[at:at] = data[at : at + length]
        elif kind == "zero":
            data[at : at + length] = bytes(len(data[at : at + length]))
        else:
            data[at : at + 4] = struct.pack("<I", draw(st.sampled_from((2**31, 2**32 - 1, 10**6))))
    return bytes(data)


@st.composite
def scene_texts(draw: st.DrawFn) -> str:
    """Texts of damaged scene files: values of the tables, or characters of the file."""
    text = SEEDS[draw(st.sampled_from(sorted(SEEDS)))]
    if draw(st.booleans()):
        return tomli_w.dumps(draw(mutated_trees(tomllib.loads(text))))
    return draw(mutated_bytes(text.encode())).decode("utf-8", errors="replace")


def read_scene(text: str, *, run: bool) -> str:
    """What comes of a scene file: "read" or the name of the error; anything else is raised.

    Raises
    ------
    AssertionError
        If an error does not say where.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
        try:
            scene = sdpd.Scene.from_toml(text + "\n")
            scene.cost()
            str(scene)
            if run and scene.n_particles < 1500:
                simulation(scene).run(2, progress=False)
        except sdpd.SimulationError:
            return "SimulationError"
        except (ValueError, TypeError, OSError) as error:
            said = str(error)
            if "`" in said or "TOML" in said or isinstance(error, OSError):
                return type(error).__name__
            raise AssertionError(f"an error without a place: {error!r}") from error
    return "read"


# --- checkpoints -----------------------------------------------------------------------------


def saved(folder: Path) -> dict[str, Path]:
    """Checkpoints of small simulations: open, between walls, with energies."""
    found = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
        for name in ("waves", "closed", "heated"):
            sim = simulation(sdpd.Scene.from_toml(SEEDS[name]), dt="adaptive")
            sim.run(3, progress=False)
            found[name] = folder / f"{name}.sdpd"
            sim.save(found[name])
    return found


def _odd_array(draw: st.DrawFn, array: np.ndarray) -> np.ndarray:
    """One value, the shape or the type of an array changed."""
    kind = draw(st.sampled_from(("value", "value", "value", "shape", "type")))
    if kind == "shape" or not array.size:
        return array[draw(st.integers(0, max(0, len(array) - 1))) :]
    if kind == "type":
        return array.astype(draw(st.sampled_from(("<f4", ">f8", "<i8", "<c16", "|b1"))))
    changed = array.copy()
    at = draw(st.integers(0, array.size - 1))
    values: tuple[Any, ...] = (0, 1, 10**6, 2**31 - 1)
    if array.dtype.kind == "f":
        values = (math.nan, math.inf, -1.0, 0.0, 1e300, 1e-300, -7.5)
    changed.reshape(-1)[at] = draw(st.sampled_from(values))
    return changed


@st.composite
def checkpoints(draw: st.DrawFn, files: dict[str, Path]) -> bytes:
    """Damaged checkpoints: bytes of the file, or its content with a digest that fits again."""
    path = files[draw(st.sampled_from(sorted(files)))]
    if draw(st.booleans()):
        return draw(mutated_bytes(path.read_bytes()))
    header, arrays = checkpoint._Reader(path).read()
    if draw(st.booleans()):
        header = draw(mutated_trees(header, plain=True))
    else:
        name = draw(st.sampled_from(sorted(arrays)))
        arrays[name] = _odd_array(draw, arrays[name])
    header["digest"] = checkpoint._digest(header, arrays)
    file = io.BytesIO()
    packing = draw(st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))
    with zipfile.ZipFile(file, "w", packing) as archive:
        archive.writestr("header.json", json.dumps(header))
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array, allow_pickle=False)
            archive.writestr(f"{name}.npy", member.getvalue())
    return file.getvalue()


def read_checkpoint(content: bytes, path: Path, victims: dict[str, sdpd.Simulation]) -> str:
    """What comes of a checkpoint: "read", or the name of the error; anything else is raised.

    Raises
    ------
    AssertionError
        If an error does not name the file, or a refused restore has changed a simulation.
    """
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
        for victim in victims.values():
            before = (victim.step, victim.dt, victim.positions.tobytes(), victim.forces.tobytes())
            try:
                victim.restore(path)
            except sdpd.CheckpointError:
                after = (
                    victim.step,
                    victim.dt,
                    victim.positions.tobytes(),
                    victim.forces.tobytes(),
                )
                assert after == before, "a refused checkpoint has changed a simulation"
        try:
            sdpd.load(path, threads=1).run(2, progress=False)
        except sdpd.SimulationError:
            return "SimulationError"
        except sdpd.CheckpointError as error:
            if str(path) in str(error):
                return "CheckpointError"
            raise AssertionError(f"an error without the file: {error!r}") from error
    return "read"
