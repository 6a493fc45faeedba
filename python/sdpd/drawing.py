"""What the figures of all studies share: colours, and files drawn without a display."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = [
    "BLUE",
    "GREEN",
    "ORANGE",
    "PURPLE",
    "SKY",
    "VERMILION",
    "figure_or_new",
    "finish",
    "save",
]

# Okabe and Ito, told apart by colour-blind readers, too
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"


def figure_or_new(figure: Any, size: tuple[float, float]) -> Any:
    """The figure, or a new one of pyplot [inch] where it is None."""
    if figure is not None:
        return figure
    from matplotlib import pyplot as plt

    return plt.figure(figsize=size, layout="constrained")


def finish(
    figure: Any,
    panels: Iterable[Any],
    sample: Scene,
    *more: str,
    note: str = "bars: one standard error",
) -> None:
    """Grids behind the curves, and a title: the scene that was run, `more` of it, and a note."""
    for axes in panels:
        axes.grid(color="0.9", linewidth=0.7)
        axes.set_axisbelow(True)
    title = (
        f"{sample.n_particles} particles in {sample.dimension}D",
        sample.resolution.kernel.replace("_", " "),
        f"h/dx = {sample.resolution.support:g}",
        *more,
    )
    figure.suptitle(", ".join(title) + f"; {note}", fontsize=10)


def save(
    draw: Callable[[Any], Any],
    folder: str | os.PathLike[str],
    name: str,
    *,
    size: tuple[float, float],
    dpi: int = 120,
) -> Path:
    """Draw into a figure that no display knows of and write it as PNG.

    Parameters
    ----------
    draw : callable
        Takes the matplotlib figure.
    folder : path
        Made if need be.
    name : str
        Of the file, without its suffix.
    size : tuple of float
        [inch].
    dpi : int

    Returns
    -------
    Path
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    path = target / f"{name}.png"
    figure.savefig(path, dpi=dpi)
    return path
