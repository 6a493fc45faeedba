"""What the figures of all studies share: colours, and files drawn without a display."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["BLUE", "GREEN", "ORANGE", "PURPLE", "SKY", "VERMILION", "figure_or_new", "save"]

# Okabe and Ito, told apart by colour-blind readers, too
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"


def figure_or_new(figure: Any, size: tuple[float, float]) -> Any:
    """The figure, or a new one of pyplot [inch] where it is None."""
    if figure is not None:
        return figure
    from matplotlib import pyplot as plt

    return plt.figure(figsize=size, layout="constrained")


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
