"""The table of hard cases, from the record of their long tests, and two of them as curves."""

from __future__ import annotations

import json
import math
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from report import Report, grid, reduced_fluid, subplots

import sdpd

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TESTS = Path(__file__).resolve().parents[2] / "tests"
RATIOS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
SPANS = {12: 100.0, 8: 20.0}  # of a decay [tau] by the edge: whole numbers of every step
WAYS = (  # name, options of the splitting, largest dt/tau, colour
    ("plain", {}, 100.0, "#ff725c"),
    ("compensated", {"compensate": True}, 20.0, "#4269d0"),
    ("10 sweeps", {"sweeps": 10}, 100.0, "#9c6b4e"),
    ("10 sweeps, compensated", {"sweeps": 10, "compensate": True}, 100.0, "#3ca951"),
)


def rows() -> list[dict[str, Any]]:
    """The cases with their limits."""
    text = (TESTS / "hard" / "cases.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)["case"])


def recorded() -> dict[str, Any]:
    """Numbers of the full forms, by case."""
    record = json.loads((TESTS / "validation" / "results.json").read_text(encoding="utf-8"))
    parts = (record.get(name, {"numbers": {}})["numbers"] for name in ("hard", "long_run"))
    return {name: numbers for part in parts for name, numbers in part.items()}


def measured(row: dict[str, Any], numbers: dict[str, Any] | None) -> str:
    """What was found beside its limit, one quantity a line."""
    cells = []
    for key, limit in row["full"]["limits"].items():
        name = key.replace("_", " ")
        if numbers is None:
            cells.append(f"{name} ≤ {limit:g}")
            continue
        if limit == 0:
            cells.append(f"{name}: {numbers[key]:g}")
            continue
        value, error = numbers[key], numbers.get(f"{key}_stderr")
        shown = f"{value:.2g}" + (f" ± {error:.1g}" if error else "")
        cells.append(f"{name} {shown} (≤ {limit:g})")
    return "<br>".join(cells)


def table() -> str:
    """Cases with size, time and what was measured."""
    found = recorded()
    header = ["case", "N", "steps", "s of a core", "conserved", "measured (limit)"]
    lines = []
    for row in rows():
        numbers, form = found.get(row["name"]), row["full"]
        seconds = f"≤ {form['seconds']}"
        if numbers is not None:
            seconds = f"{numbers['seconds']:.0f} ({seconds})"
        cells = [row["title"], f"{form['particles']}", f"{form['steps']}", seconds]
        lines.append([*cells, row["conserved"], measured(row, numbers)])
    return grid(header, lines)


def texts() -> str:
    """What is hard, and what is done about it."""
    header = ["case", "what is hard", "what other methods do", "what `sdpd` does"]
    return grid(header, ([row[k] for k in ("title", "hard", "others", "ours")] for row in rows()))


def decay_rate(edge: int, ratio: float, **options: Any) -> float:
    """Of three shear waves at dt = `ratio` tau in a fluid without order, sound and noise."""
    scene = sdpd.Scene(
        fluid=reduced_fluid(20.0),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, support=3.0),
        start=sdpd.RandomStart(),
        effects=sdpd.Effects(fluctuations=False),
        sound_speed=1e-3,
    )
    dt, k, found = ratio * scene.friction_time, 2.0 * math.pi / edge, []
    for axis in range(3):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sdpd.TimeStepWarning)
            sim = sdpd.Simulation(
                scene, dt=dt, integrator=sdpd.PairSplitting(**options), seed=1, threads=1
            )
        wave = np.sin(k * sim.positions[:, axis])
        sim.velocities[:, axis - 1] = 1e-4 * (wave - wave.mean())
        first = float(sim.velocities[:, axis - 1] @ wave)
        sim.run(round(SPANS[edge] / ratio), progress=False)
        found.append(-math.log(float(sim.velocities[:, axis - 1] @ wave) / first) / sim.time)
    return float(np.mean(found))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("hard_cases", __doc__, argv)
    report.document(
        table(),
        "Errors are relative, momentum is in units of the thermal one (of the flow, in flows "
        "without noise), ± one standard error.",
    )
    report.write("generated", "hard_cases_texts.md", texts() + "\n")
    _plot(report)


def _plot(report: Report) -> None:
    figure, (left, right) = subplots(2, width=7.6, height=3.1)
    edge, ratios = (8, RATIOS[3:4]) if report.quick else (12, RATIOS)
    exact = decay_rate(edge, 2.0 if report.quick else 0.25)
    for name, options, most, colour in WAYS:
        tried = [ratio for ratio in ratios if ratio <= most]
        values = [decay_rate(edge, ratio, **options) / exact for ratio in tried]
        left.plot(tried, values, "o-", color=colour, markersize=3.5, linewidth=1.2, label=name)
    left.axhline(1.0, color="0.5", linewidth=0.8)
    left.set(xscale="log", xlabel=r"$\Delta t/\tau$", ylabel="delivered viscosity", ylim=(0, 1.1))
    left.set_xticks(ratios, [f"{ratio:g}" for ratio in ratios], minor=False)
    left.minorticks_off()
    left.legend(loc="lower left")
    curves = recorded().get("taylor_green_to_1e-4", {}).get("curves", {})
    for reynolds, curve in curves.items():
        right.semilogy(curve["time"], curve["energy"], ".", markersize=3, label=f"Re = {reynolds}")
    time = np.linspace(0.0, 9.3, 50)
    right.semilogy(time, np.exp(-time), color="0.4", linewidth=0.9, label=r"$e^{-4\nu k^2t}$")
    right.set(xlabel=r"$4\nu k^2t$", ylabel="kinetic energy of the vortex / first")
    right.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
