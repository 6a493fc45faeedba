"""Ready scenes: TOML files that ship with the package, for `sdpd run NAME` and to begin with."""

from __future__ import annotations

from importlib import resources

from sdpd import validation
from sdpd.scene import Scene

__all__ = ["describe", "load", "names", "text"]


def names() -> list[str]:
    """Names of the ready scenes."""
    files = resources.files(__name__).iterdir()
    return sorted(file.name[:-5] for file in files if file.name.endswith(".toml"))


def text(name: str) -> str:
    """The file of a ready scene.

    Raises
    ------
    ValueError
        If there is no such scene.
    """
    validation.choice("name", name, names())
    return resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")


def describe(name: str) -> str:
    """What a ready scene is: the first line of its file."""
    return text(name).splitlines()[0].lstrip("# ")


def load(name: str) -> Scene:
    """A ready scene.

    Raises
    ------
    ValueError
        If there is no such scene.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.scenes.load("couette").walls[1].speed
    1.25e-05
    """
    return Scene.from_toml(text(name))
