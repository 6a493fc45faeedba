"""What accuracy costs: the ready problems over their settings, and the fits behind predictions.

`--store DIR` keeps finished settings, so that a stopped run goes on; `--only NAME,NAME` runs some.
Without `--quick` and `--only` the fits are written into the package (accuracy/orders.json).
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from report import DOCS, Report, grid, subplots

import sdpd
from sdpd import accuracy
from sdpd.accuracy import PROBLEMS, Settings, Study
from sdpd.accuracy.expectation import flow_orders, flow_point, sampled_time
from sdpd.accuracy.orders import Orders, Point, fit
from sdpd.accuracy.speed import speed_of
from sdpd.bench import Machine

TWO = ("wendland_c2", "lucy")
KERNELS = ("wendland_c2", "lucy", "quintic_spline", "wendland_c4")
FEWEST = 50  # steps of a run whose time is compared
LEVELS = (0.1, 0.03, 0.01, 0.003, 0.001)


@dataclass(frozen=True)
class Case:
    """Settings of one problem: for the figure, further ones to fit, and those held out."""

    figure: list[dict[str, Sequence[Any]]]
    fitted: dict[str, Sequence[Any]] = field(default_factory=dict)
    held_out: dict[str, Sequence[Any]] = field(default_factory=dict)
    length: str = ""  # what h is compared with: an attribute below
    seeds: tuple[int, ...] = (1,)
    quick: dict[str, Sequence[Any]] = field(default_factory=dict)


def flows(across: Sequence[int], others: Sequence[int], least: float = 2.4) -> dict[str, Any]:
    """What flows on a lattice have in common."""
    more = {"kernel": KERNELS, "calibrate": (False, True)}
    return {
        "fitted": {"across": across, "support": sorted({least, 2.6, 3.0, 3.5, 4.0}), **more},
        "held_out": {"across": others, "support": (2.5, 2.8, 3.25, 3.75)[least > 2.5 :], **more},
    }


CHANNEL = Case(
    figure=[
        {
            "across": (8, 16, 32, 48),
            "support": (2.4, 3.0, 4.0),
            "kernel": TWO,
            "calibrate": (False, True),
        },
        {"across": (16,), "calibrate": (True,), "step": (0.5, 1.5)},
        {"across": (16, 32, 48), "calibrate": (True,), "precision": ("mixed",), "kernel": TWO},
        {
            "across": (16, 32),
            "calibrate": (True,),
            "wall_model": ("own_foot_images", "completion", "frozen_particles"),
        },
    ],
    **flows((8, 12, 16, 24, 32), (10, 20, 28)),
    quick={"across": (8, 12), "support": (2.4, 3.0)},
)
SPLIT, VERLET = ("pair_splitting",), ("velocity_verlet",)
CASES = {
    "poiseuille": CHANNEL,
    "couette": CHANNEL,
    "cylinder": Case(
        figure=[{"across": (20, 28, 40), "support": (2.6, 3.0, 3.5, 4.0), "kernel": TWO}],
        fitted={
            "across": (20, 28, 40),
            "support": (2.6, 3.0, 3.5, 4.0),
            "kernel": TWO,
            "calibrate": (False, True),
        },
        held_out={"across": (24, 34), "support": (2.8, 3.75), "kernel": TWO},
        seeds=(1, 2, 3),
        quick={"across": (16,), "support": (2.6,)},
    ),
    "taylor_green": Case(
        figure=[
            {"across": (16, 32, 64), "support": (2.6, 3.0, 4.0), "kernel": TWO},
            {"across": (32,), "support": (4.0,), "step": (0.5, 2.0)},
            {"across": (32,), "support": (4.0,), "integrator": SPLIT},
        ],
        **flows((16, 24, 32, 48, 64), (20, 28, 40), least=2.6),
        quick={"across": (16, 20)},
    ),
    "temperature": Case(
        figure=[
            {"step": (2.0,), "length": (0.1, 0.5, 2.0)},
            {"step": (2.0,), "length": (0.5, 4.0), "precision": ("mixed",)},
            {"step": (0.5, 1.0, 2.0), "length": (4.0,)},
            {"integrator": VERLET, "step": (0.5, 1.0, 2.0), "length": (2.0,)},
            {"integrator": VERLET, "iterations": (1,), "step": (4.0, 8.0, 16.0)},
            {"integrator": VERLET, "noise": ("gaussian",), "length": (2.0,)},
            {"support": (3.0,), "kernel": TWO},
        ],
        seeds=(1, 2),
        quick={"step": (2.0,), "length": (0.05,)},
    ),
    "density_variance": Case(
        figure=[
            {"step": (0.5, 1.0, 1.5, 2.0), "length": (2.0,)},
            {"integrator": VERLET, "length": (2.0,)},
            {"step": (1.0, 2.0), "length": (0.25,)},
        ],
        seeds=(1, 2),
        quick={"step": (2.0,), "length": (0.05,)},
    ),
    "temperature_variance": Case(
        figure=[
            {"step": (0.5, 1.0, 2.0), "length": (0.25, 2.0)},
            {"bookkeeping": (False,), "length": (2.0,)},
            {"integrator": VERLET, "step": (1.0, 2.0, 4.0), "length": (2.0,)},
        ],
        seeds=(1, 2),
        quick={"step": (2.0,), "length": (0.05,)},
    ),
    "diffusion": Case(
        figure=[{"support": (2.4, 2.65, 3.0, 3.5, 4.0), "kernel": KERNELS}, {"step": (0.25, 0.5)}],
        quick={"support": (2.4,), "length": (0.2,)},
    ),
    "shear_wave": Case(
        figure=[
            {
                "across": (8, 12, 16, 24),
                "support": (2.4, 3.0, 4.0),
                "kernel": TWO,
                "calibrate": (False, True),
            },
            {"across": (16,), "calibrate": (True,), "step": (0.25, 0.5), "kernel": TWO},
            {"across": (12, 16, 24), "calibrate": (True,), "integrator": VERLET},
            {
                "across": (16, 24),
                "calibrate": (True,),
                "integrator": VERLET,
                "precision": ("mixed",),
            },
        ],
        **flows((8, 12, 16, 20), (10, 14, 18)),
        quick={"across": (8, 10)},
    ),
    "thermal_couette": Case(
        figure=[
            {"across": (10, 12, 16, 24), "support": (2.6, 3.0, 4.0), "kernel": TWO},
            {"across": (16,), "step": (0.5,), "support": (2.6, 3.0)},
        ],
        fitted={"across": (10, 12, 16, 20, 24), "support": (2.6, 3.0, 3.5), "kernel": TWO},
        held_out={"across": (14, 18), "support": (2.8, 3.25), "kernel": TWO},
        quick={"across": (8, 10), "support": (2.4,)},
    ),
    "energy_slope": Case(
        figure=[
            {"integrator": SPLIT, "bookkeeping": (True, False), "step": (0.25, 0.5, 1.0, 2.0)},
            {"integrator": VERLET, "bookkeeping": (True, False), "step": (0.5, 1.0, 2.0)},
        ],
        quick={"step": (2.0,), "bookkeeping": (False,), "length": (0.05,)},
    ),
}
# supports at which the floor is free, where not at all that are fitted
NODES = {"couette": (2.4, 3.0, 3.5, 4.0), "thermal_couette": (2.6, 3.5)}


def settings(name: str, axes: list[dict[str, Sequence[Any]]]) -> list[Settings]:
    base = PROBLEMS[name].base
    return [point for each in axes for point in accuracy.grid(base, **each)]


def run(
    name: str, axes: list[dict[str, Sequence[Any]]], store: Path | None, **options: Any
) -> Study:
    return accuracy.study(name, settings(name, axes), folder=store, progress=None, **options)


# --- fits -------------------------------------------------------------------------------------


def points(study: Study, kernel: str) -> list[Point]:
    """Rows of a kernel as the fit sees them."""
    found = []
    for row in study.rows:
        if row.settings.kernel != kernel or not 0.0 < row.error < math.inf:
            continue
        sim = study.problem.simulation(row.settings)
        _, length, _ = flow_orders(sim.scene)
        point = flow_point(sim.scene, length, sim.dt, sim.integrator)
        found.append(replace(point, error=row.error))
    return found


def fits(name: str, case: Case, store: Path | None) -> dict[str, Orders]:
    """Orders by kernel."""
    options = {"seeds": case.seeds}
    known = run(name, [case.fitted], store, **options)
    others = run(name, [case.held_out], store, **options)
    nodes = NODES.get(name, sorted(set(case.fitted["support"])))
    found = {}
    for kernel in dict.fromkeys(row.settings.kernel for row in known.rows):
        found[kernel] = fit(points(known, kernel), points(others, kernel), nodes)
    return found


def sampling(studies: dict[str, Study]) -> dict[str, tuple[float, float]]:
    """Sampling errors over those of `sampled_time` with a constant of 1, and their spread."""
    found = {}
    for name in ("temperature", "density_variance", "temperature_variance", "diffusion"):
        ratios = []
        for row in studies[name].rows:
            sim = studies[name].problem.simulation(row.settings)
            time = sampled_time(sim.scene, name, row.dt, row.sampling)[0]
            settle = 60.0 * sim.scene.friction_time
            ratios.append(math.sqrt((row.steps * row.dt - settle) / time))
        logs = np.log(ratios)
        found[name] = (float(np.exp(logs.mean())), float(np.exp(max(logs.std(), 0.1))))
    return found


def write_orders(path: Path, orders: dict[str, Any], constants: dict[str, Any]) -> None:
    machine = Machine.here()
    document = {
        "made": {
            "script": "docs/scripts/accuracy.py",
            "date": machine.date,
            "sdpd": machine.version,
        },
        "orders": {
            name: {kernel: each.record() for kernel, each in kernels.items()}
            for name, kernels in orders.items()
        },
        "sampling": constants,
    }
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


# --- the page ---------------------------------------------------------------------------------


def front_table(study: Study) -> str:
    """The settings worth their time."""
    rows = []
    for row in study.pareto():
        noisy = row.stderr > 0.0
        error = f"{row.error:.2g} ± {row.stderr:.1g}" if noisy else f"{row.error:.2g}"
        bias = f"{row.bias:+.2g} ± {row.bias_stderr:.1g}" if noisy else f"{row.bias:+.2g}"
        sampling = f"{row.sampling:.1g}" if noisy else "none"
        cost = [f"{row.seconds:.3g}", f"{row.steps}", f"{row.memory / 1e6:.2g}"]
        rows.append([study.label(row), error, bias, sampling, *cost])
    return grid(["settings", "error", "bias", "sampling", "s", "steps", "MB"], rows)


def time_table(studies: dict[str, Study]) -> str:
    """Measured over predicted seconds of a step, by problem."""
    rows, everything = [], []
    for name, study in studies.items():
        logs = []
        for row in study.rows:
            if row.steps < FEWEST or row.settings.precision != "double":
                continue
            sim = study.problem.simulation(row.settings)
            expected = speed_of(sim.scene, sim.integrator)
            seconds = row.steps * expected.seconds(sim.scene, sim.dt, sim.integrator)
            logs.append(math.log(row.seconds / seconds))
        everything += logs
        if logs:
            rows.append([name.replace("_", " "), *factors(logs)])
    rows.append(["all", *factors(everything)])
    return grid(["problem", "settings", "mean", "factor: rms", "19 of 20"], rows)


def factors(logs: list[float]) -> list[str]:
    away = np.abs(logs)
    numbers = (np.mean(logs), np.sqrt(np.mean(away**2)), np.quantile(away, 0.95))
    return [f"{len(logs)}", *(f"{math.exp(x):.2f}" for x in numbers)]


def price_table(studies: dict[str, Study]) -> str:
    """Seconds to each level of error."""
    rows = []
    for name, study in studies.items():
        front = study.pareto()
        cells = []
        for level in LEVELS:
            enough = [row.seconds for row in front if row.error + row.stderr <= level]
            cells.append(f"{min(enough):.2g}" if enough else "")
        best = min(front, key=lambda row: row.error)
        smallest = f"{best.error:.2g} in {best.seconds:.2g} s"
        rows.append([name.replace("_", " "), study.problem.error_of, *cells, smallest])
    header = ["problem", "error of", *(f"{level:.1%}" for level in LEVELS), "smallest error"]
    return grid(header, rows)


def order_table(orders: dict[str, dict[str, Orders]]) -> str:
    rows = [
        [
            name.replace("_", " "),
            kernel.replace("_", " "),
            f"{o.order:.2f}",
            f"{o.amplitude:.3g}",
            f"{o.viscosity:.2f}",
            ", ".join(f"{f:+.2%}" for f in o.floors),
            f"{o.fitted}, {o.held_out}",
            f"{o.scatter:.2f}, {o.worst:.2f}",
        ]
        for name, kernels in orders.items()
        for kernel, o in kernels.items()
    ]
    header = ["problem", "kernel", "order $p$", "$a$", "$c$", "floors $f$", "fitted, held out"]
    return grid([*header, "factor: rms, 19 of 20"], rows)


def overview(report: Report, studies: dict[str, Study]) -> None:
    figure, axes = subplots(width=6.6, height=4.2)
    for number, (name, study) in enumerate(studies.items()):
        front = [row for row in study.pareto() if row.error > 1e-9]
        axes.loglog(
            [row.seconds for row in front],
            [row.error for row in front],
            marker="osv^D"[number % 5],
            markersize=3.5,
            linewidth=1.0,
            color=f"C{number % 10}" if number < 10 else "0.2",
            label=name.replace("_", " "),
        )
    axes.set(xlabel="seconds on one core [s]", ylabel="relative error [1]")
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    report.figure(figure)


def main(argv: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--only", type=lambda text: text.split(","), default=list(CASES))
    own, rest = parser.parse_known_args(argv)
    report = Report.from_arguments("accuracy", __doc__, rest)
    studies = {}
    for name in own.only:
        case = CASES[name]
        axes = [case.quick] if report.quick else case.figure
        repeats = 1 if report.quick or PROBLEMS[name].noisy else 3
        seeds = case.seeds[:1] if report.quick else case.seeds
        studies[name] = run(
            name, axes, own.store and own.store / "figure", seeds=seeds, repeats=repeats
        )
    fitted = {}
    if not report.quick:
        fitted = {n: fits(n, CASES[n], own.store) for n in own.only if CASES[n].fitted}
        if len(own.only) == len(CASES):
            package = DOCS.parent / "python" / "sdpd" / "accuracy" / "orders.json"
            write_orders(package, fitted, sampling(studies))
            report.write("generated", "accuracy_orders.md", order_table(fitted) + "\n")
            with TemporaryDirectory() as folder:
                os.environ["SDPD_CACHE"] = folder  # measured now, not taken from the user's cache
                report.write("generated", "accuracy_seconds.md", time_table(studies) + "\n")
    for name, study in studies.items():
        report.write("generated", f"accuracy_{name}.md", front_table(study) + "\n")
        figure, panel = subplots(width=6.4, height=4.2)
        study.plot(panel)
        report.figure(figure, name)
    report.document(
        price_table(studies),
        "Seconds on one core of the cheapest setting whose error and standard error together are "
        "below what is on top, and the "
        f"smallest error of all ({Machine.here().processor}, sdpd {sdpd.__version__}).",
    )
    overview(report, studies)


if __name__ == "__main__":
    main()
