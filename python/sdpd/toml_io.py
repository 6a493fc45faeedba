"""Scenes to and from TOML; a wrong key or value is named by its path in the file."""

from __future__ import annotations

import os
import sys
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sdpd import (
    equations_of_state,
    fluids,
    initial,
    validation,
    wall_heat,
    wall_models,
    walls,
)
from sdpd.box import Box
from sdpd.effects import BodyForce, Effects, SinusoidalForce, UniformForce
from sdpd.fluids import Fluid
from sdpd.resolution import Resolution

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["build", "scene_from_toml", "scene_to_dict", "scene_to_toml"]

T = TypeVar("T")
FORMAT = 1
_FORCES: dict[str, type[BodyForce]] = {"uniform": UniformForce, "sinusoidal": SinusoidalForce}


def _prefixed(message: str, where: str) -> str:
    """Put the path before the first name in a message of `validation`."""
    if where and message.startswith("`") and not message.startswith(f"`{where}"):
        return f"`{where}.{message[1:]}"
    return f"{where}: {message}" if where and not message.startswith("`") else message


def build(kind: type[T], data: Any, where: str) -> T:
    """An instance of a dataclass from a table of a TOML file.

    Raises
    ------
    ValueError, TypeError
        If a key is unknown or missing or a value is refused; the text starts with its path.
    """
    if not isinstance(data, dict):
        raise TypeError(f"`{where}` must be a table, got {data!r}")
    known = {field.name: field for field in fields(kind) if field.init}  # type: ignore[arg-type]
    _refuse_unknown(data, known, where)
    for name, field in known.items():
        required = field.default is MISSING and field.default_factory is MISSING
        if required and name not in data:
            raise ValueError(f"`{where}.{name}` is missing")
    try:
        return kind(**data)
    except (TypeError, ValueError) as error:
        raise type(error)(_prefixed(str(error), where)) from None


def _refuse_unknown(data: dict[str, Any], known: Any, where: str) -> None:
    for key in data:
        if key not in known:
            path = f"{where}.{key}" if where else key
            listed = ", ".join(known)
            hint = validation.suggestion(key, known)
            raise ValueError(f"`{path}` is not a known key; expected one of {listed}{hint}")


def _plain(value: Any) -> Any:
    """Nested dict of a dataclass without what is None."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if not is_dataclass(value):
        return value
    pairs = ((field.name, getattr(value, field.name)) for field in fields(value))
    return {name: _plain(item) for name, item in pairs if item is not None}


def _wall(wall: walls.Wall) -> dict[str, Any]:
    """A wall less what has its default, so that a Mesh is its points and triangles alone."""
    shaped = isinstance(wall, walls.ShapedWall)
    defaults = {field.name: field.default for field in fields(wall)} if shaped else {}  # type: ignore[arg-type]
    plain = _plain(wall)
    del plain["heat"]
    if wall.heat != wall_heat.Isothermal():
        kind = _name_of(wall.heat, wall_heat.KINDS, "heat")
        plain["heat"] = {"kind": kind, **_plain(wall.heat)}
    return {name: value for name, value in plain.items() if value != defaults.get(name)}


def _name_of(value: object, table: dict[str, Any], where: str) -> str:
    for name, kind in table.items():
        if type(value) is kind:
            return name
    known = ", ".join(kind.__name__ for kind in table.values())
    if isinstance(value, walls.LevelSet):
        raise TypeError(
            f"`{where}` is a LevelSet, a function, which no file can hold: a scene with one cannot "
            f"be written, nor a simulation of it saved; use one of {known}"
        )
    raise TypeError(
        f"`{where}` must be of a built-in class ({known}) to be written to TOML, got an object of "
        f"the class {type(value).__name__}"
    )


def _effects(effects: Effects) -> str | dict[str, Any]:
    """Table of the effects, which names `auto` only where it is on; the word where it is alone."""
    if effects == Effects(auto=True):
        return "auto"
    plain: dict[str, Any] = _plain(effects)
    return plain if effects.auto else {k: v for k, v in plain.items() if k != "auto"}


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """The scene as plain tables, keys in the order of the file."""
    data: dict[str, Any] = {"format": FORMAT}
    for name in ("sound_speed", "velocity_scale", "length_scale", "calibrate"):
        if getattr(scene, name) is not None:
            data[name] = getattr(scene, name)
    fluid = _plain(scene.fluid)
    law = scene.fluid.equation_of_state
    kind = _name_of(law, equations_of_state.KINDS, "fluid.equation_of_state")
    fluid["equation_of_state"] = {"kind": kind, **_plain(law)}
    data["fluid"] = fluid
    data["box"] = _plain(scene.box)
    data["resolution"] = _plain(scene.resolution)
    kind = _name_of(scene.start, initial.STARTS, "start")
    data["start"] = {"kind": kind, **_plain(scene.start)}
    data["effects"] = _effects(scene.effects)
    if scene.walls:
        data["walls"] = [
            {"kind": _name_of(wall, walls.KINDS, f"walls[{index}]"), **_wall(wall)}
            for index, wall in enumerate(scene.walls)
        ]
    if scene.wall_model != wall_models.SymmetricImages():
        kind = _name_of(scene.wall_model, wall_models.MODELS, "wall_model")
        data["wall_model"] = {"kind": kind, **_plain(scene.wall_model)}
    if scene.body_force is not None:
        force = scene.body_force
        kind = _name_of(force, _FORCES, "body_force")
        data["body_force"] = {"kind": kind, **_plain(force)}
    return data


def scene_to_toml(scene: Scene, path: str | os.PathLike[str] | None = None) -> str:
    """TOML text of a scene, also written to `path` if one is given."""
    import tomli_w

    content = tomli_w.dumps(scene_to_dict(scene))
    if path is not None:
        Path(path).write_text(content, encoding="utf-8")
    return content


def _fluid(data: Any) -> Fluid:
    """A fluid from its values, or from `preset`, in a plane with `thickness`, and changes to it."""
    if not isinstance(data, dict):
        raise TypeError(f"`fluid` must be a table, got {data!r}")
    values = dict(data)
    if "equation_of_state" in values:
        law = values["equation_of_state"]
        if not isinstance(law, dict):
            raise TypeError(f"`fluid.equation_of_state` must be a table, got {law!r}")
        values["equation_of_state"] = equations_of_state.from_dict(law, "fluid.equation_of_state")
    if "preset" not in values:
        for name in ("properties", "pressure", "thickness"):
            if name in values:
                raise ValueError(f"`fluid.{name}` needs `fluid.preset`")
        return build(Fluid, values, "fluid")
    preset = validation.choice("fluid.preset", values.pop("preset"), list(fluids.PRESETS))
    known = [field.name for field in fields(Fluid)] + [
        "preset",
        "properties",
        "pressure",
        "thickness",
    ]
    _refuse_unknown(values, known, "fluid")
    names = ("temperature", "properties", "pressure", "bulk_viscosity")
    arguments = {name: values.pop(name) for name in names if name in values}
    try:
        fluid: Fluid = fluids.PRESETS[preset](**arguments)
        if "thickness" in values:
            fluid = fluid.in_plane(values.pop("thickness"))
        return fluid.replace(**values)
    except TypeError as error:
        if "unexpected keyword" not in str(error):
            raise TypeError(_prefixed(str(error), "fluid")) from None
        raise ValueError(f"`fluid.preset` {preset!r}: {error}") from None
    except ValueError as error:
        raise ValueError(_prefixed(str(error), "fluid")) from None


def _kind(data: Any, where: str, table: dict[str, type[T]]) -> T:
    """An instance of the class that `kind` names."""
    if not isinstance(data, dict):
        raise TypeError(f"`{where}` must be a table, got {data!r}")
    rest = dict(data)
    if "kind" not in rest:
        raise ValueError(f"`{where}.kind` is missing; expected one of {', '.join(table)}")
    chosen = validation.choice(f"{where}.kind", rest.pop("kind"), list(table))
    return build(table[chosen], rest, where)


def _found(wall: Any, folder: Path, where: str) -> Any:
    """The table of a wall with the path of its file, and its thermal condition built."""
    if not isinstance(wall, dict):
        return wall
    found = dict(wall)
    if isinstance(wall.get("file"), str):
        found["file"] = str(folder / wall["file"])
    if "heat" in wall:
        found["heat"] = _kind(wall["heat"], f"{where}.heat", wall_heat.KINDS)
    return found


def scene_from_toml(kind: type[Scene], source: str | os.PathLike[str]) -> Scene:
    """A scene from TOML text, or from the file of a path object or of a name ending in .toml."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib

    is_name = isinstance(source, str) and "\n" not in source and source.endswith(".toml")
    folder = Path()
    if isinstance(source, os.PathLike) or is_name:
        content = Path(source).read_text(encoding="utf-8")
        folder = Path(source).parent  # names of files in it are relative to it
    else:
        content = validation.text("source", source)
    try:
        data = tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"not a TOML file: {error}") from None
    except RecursionError:
        raise ValueError("not a TOML file of a scene: nested too deeply") from None
    version = data.pop("format", FORMAT)
    if version != FORMAT:
        raise ValueError(f"`format` must be {FORMAT}, got {version!r}")
    _refuse_unknown(data, [field.name for field in fields(kind)], "")
    arguments = dict(data)
    for name in ("fluid", "box", "resolution"):
        if name not in data:
            raise ValueError(f"`{name}` is missing")
    arguments["fluid"] = _fluid(data["fluid"])
    arguments["box"] = build(Box, data["box"], "box")
    arguments["resolution"] = build(Resolution, data["resolution"], "resolution")
    if "start" in data:
        arguments["start"] = _kind(data["start"], "start", initial.STARTS)
    if "effects" in data and not isinstance(data["effects"], str):
        arguments["effects"] = build(Effects, data["effects"], "effects")
    if "walls" in data:
        if not isinstance(data["walls"], list):
            raise TypeError(f"`walls` must be an array of tables, got {data['walls']!r}")
        arguments["walls"] = tuple(
            _kind(_found(wall, folder, f"walls[{index}]"), f"walls[{index}]", walls.KINDS)
            for index, wall in enumerate(data["walls"])
        )
    if "wall_model" in data:
        arguments["wall_model"] = _kind(data["wall_model"], "wall_model", wall_models.MODELS)
    if "body_force" in data:
        arguments["body_force"] = _kind(data["body_force"], "body_force", _FORCES)
    return kind(**arguments)
