"""What the scripts of this folder share: options, scenes, error bars, tables and figures.

A script measures one thing and writes generated/NAME.md, which a page of the docs includes, and
where it helps figures/NAME.png. `--quick` runs it at a size of seconds, to test the script;
`--output` writes elsewhere.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import sdpd

DOCS = Path(__file__).resolve().parent.parent
KERNEL_COLOURS = {
    "lucy": "#4269d0",
    "quintic_spline": "#ff725c",
    "wendland_c2": "#3ca951",
    "wendland_c4": "#9c6b4e",
}


@dataclass(frozen=True)
class Report:
    """Where a script writes, and whether it is only tried."""

    name: str
    quick: bool
    output: Path

    @classmethod
    def from_arguments(cls, name: str, text: str | None, argv: Sequence[str] | None) -> Report:
        """Read the options of a script; `text` is its docstring."""
        parser = argparse.ArgumentParser(description=text)
        parser.add_argument("--quick", action="store_true", help="a size of seconds, for a test")
        parser.add_argument("--output", type=Path, default=DOCS, help="instead of docs/")
        options = parser.parse_args(argv)
        return cls(name, options.quick, options.output)

    @property
    def command(self) -> str:
        """What writes the table again."""
        return f"python docs/scripts/{self.name}.py{' --quick' * self.quick}"

    def document(self, *parts: str) -> Path:
        """Write generated/NAME.md: tables and what they mean, then the command."""
        text = "\n\n".join([*(part.strip() for part in parts), f"Written by `{self.command}`."])
        return self.write("generated", f"{self.name}.md", text + "\n")

    def write(self, folder: str, file: str, text: str) -> Path:
        """Write a text file below the output folder."""
        path = self.output / folder / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    def figure(self, figure: Any, part: str = "") -> None:
        """Write figures/NAME.png, or NAME_PART.png, and close the figure."""
        import matplotlib.pyplot as plt

        path = self.output / "figures" / f"{'_'.join(filter(None, (self.name, part)))}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150, metadata={"Software": None})
        plt.close(figure)


def grid(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def subplots(columns: int = 1, *, width: float = 7.2, height: float = 3.2, **options: Any) -> Any:
    """A figure in the style of the docs and its axes."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "font.size": 8.5,
            "axes.grid": True,
            "grid.color": "0.9",
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.axisbelow": True,
            "legend.frameon": False,
        }
    )
    return plt.subplots(
        1, columns, figsize=(width, height), layout="constrained", squeeze=True, **options
    )


def reduced_fluid(eta: float, law: Any = None) -> sdpd.Fluid:
    """A fluid with m = dx = k_B T = 1, so that `eta` is eta* and c^2 is X."""
    return sdpd.Fluid(
        density=1.0,
        shear_viscosity=eta,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=law or sdpd.eos.IdealGas(),
    )


def mean_and_error(values: Iterable[float]) -> tuple[float, float]:
    """Mean and standard error of independent values; nan for the error of a single one."""
    array = np.asarray(list(values), dtype=float)
    if len(array) < 2:
        return float(array.mean()), math.nan
    return float(array.mean()), float(array.std(ddof=1) / math.sqrt(len(array)))


def blocked(series: Any, blocks: int = 32) -> tuple[float, float]:
    """Mean and standard error of a correlated series, from block means."""
    array = np.asarray(series, dtype=float)
    blocks = min(blocks, len(array))
    length = len(array) // blocks
    return mean_and_error(array[: blocks * length].reshape(blocks, length).mean(axis=1))


def shown(value: float, error: float, *, digits: int = 4, signed: bool = False) -> str:
    """`0.9987 ± 0.0003`: two digits of the error, but at most so many decimals, and not 0."""
    if math.isfinite(error) and error > 0.0:
        digits = min(digits, max(0, 1 - math.floor(math.log10(error))))
        error = max(error, 10.0**-digits)
    text = f"{value:{'+' if signed else ''}.{digits}f}"
    return f"{text} ± {error:.{digits}f}" if math.isfinite(error) else text
