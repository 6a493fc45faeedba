"""What the commands share: exit codes, scenes by name, studies shown, lists of numbers."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = [
    "FAILED",
    "INTERRUPTED",
    "NO_PROGRESS",
    "OK",
    "REFUSED",
    "numbers",
    "reals",
    "scene_of",
    "show",
]

OK, FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130
# Of every command that may show a bar: `progress` is None, for it to decide by itself, or False.
NO_PROGRESS: dict[str, Any] = {
    "dest": "progress",
    "action": "store_const",
    "const": False,
    "help": "no progress bar",
}


def scene_of(path: str) -> Scene:
    """From a file, or a ready one by its name."""
    from sdpd import scenes
    from sdpd.scene import Scene

    if not Path(path).exists() and path in scenes.names():
        return scenes.load(path)
    return Scene.from_toml(Path(path))


def show(package: Any, study: Any, output: str | None) -> int:
    """Print a study, write its files and figure where asked, and give its verdict."""
    print(study)
    if output is not None:
        paths = package.write(study, output)
        if importlib.util.find_spec("matplotlib") is not None:
            paths.append(package.write_figure(study, output))
        else:
            print("no figure: matplotlib is missing (pip install 'sdpd[plot]')", file=sys.stderr)
        print("\nwritten: " + ", ".join(map(str, paths)))
    return OK if study.passed else FAILED


def numbers(text: str) -> tuple[int, ...]:
    """Integers between commas."""
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected numbers like 1,3,5, got {text!r}") from None


def reals(text: str) -> tuple[float, ...]:
    """Numbers between commas."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected numbers like 2.4,3.0, got {text!r}") from None
