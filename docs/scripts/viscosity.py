"""Viscosity of the thermal fluid: what the validation recorded, shear thinning, one study drawn.

Table and first figure show tests/validation/results.json, which `make validation` writes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from report import DOCS, KERNEL_COLOURS, Report, grid, reduced_fluid, shown, subplots

import sdpd
from sdpd import kernels, viscosity
from sdpd.viscosity.predictions import friction_theory

RECORD = DOCS.parent / "tests" / "validation" / "results.json"
METHODS = (("Helfand_moment", "o"), ("transverse_currents", "s"), ("sinusoidal_force", "^"))
SPEEDS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # of the plan's, which is a Weissenberg number of 0.1
THICK = 20.0


def recorded() -> list[dict[str, Any]]:
    """Rows of the record, with dimension, kernel and eta* from their names."""
    rows = []
    for name, numbers in json.loads(RECORD.read_text())["viscosity"]["numbers"].items():
        dimension, kernel, eta = name.split()
        rows.append(
            numbers
            | {"dimension": int(dimension[0]), "kernel": kernel, "eta": float(eta.split("=")[1])}
        )
    return sorted(rows, key=lambda r: (r["dimension"], r["kernel"], r["eta"]))


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("viscosity", __doc__, argv)
    rows = recorded()
    thinning = shear_thinning(report.quick)
    report.document(
        table(rows),
        "Viscosities over the input, one standard error, $X=100$, $h/\\Delta x=2.65$. *Lattice*: "
        "$\\Delta t\\to0$, undisturbed. *Friction*: on the particles as they lie, at this "
        "$\\Delta t$. *Mean field*: with the momentum that particles and pressure forces carry. "
        "*Thicker*: delivered less input in $\\sqrt{mk_BT}/\\Delta x^{D-1}$, as $\\eta^*$. "
        "*z*: Helfand less currents, Helfand less force, currents less force, in standard errors.",
        f"Shear thinning, 3D, Lucy 2.65, $\\eta^*={THICK:g}$, $kh=2.08$:",
        grid(
            [
                "amplitude over $v_\\mathrm{th}$",
                "$\\dot\\gamma\\,t_s$",
                "$\\eta(k)$ over the input",
            ],
            [[f"{v:.3f}", f"{w:.2f}", shown(m, e)] for v, w, m, e in thinning],
        ),
        "$\\dot\\gamma=kV$ is the largest shear rate and $t_s$ the mean relaxation time of the "
        "stress in mean field.",
    )
    plot_methods(report, rows)
    plot_thinning(report, thinning)
    draw_study(report)


def table(rows: Iterable[dict[str, Any]]) -> str:
    header = ["$D$", "kernel", "$\\eta^*$", "$\\Delta t/\\tau$", "lattice", "friction"]
    header += ["mean field", "Helfand", "currents", "force", "all", "thicker", "z"]
    lines = []
    for row in rows:
        asked = row["asked"]
        field = row["friction"] + row["kinetic_mean_field"] + row["configurational_mean_field"]
        measured = [shown(row[n] / asked, row[f"{n}_stderr"] / asked, digits=3) for n, _ in METHODS]
        scores = ", ".join(f"{value:+.1f}" for key, value in row.items() if key[:2] == "z ")
        lines.append(
            [
                f"{row['dimension']}",
                kernels.get(row["kernel"]).title,
                f"{row['eta']:g}",
                f"{row['dt_over_tau']:.2f}",
                f"{row['lattice'] / asked:.3f}",
                f"{row['friction'] / asked:.3f}",
                f"{field / asked:.3f}",
                *measured,
                shown(row["delivered"] / asked, row["delivered_stderr"] / asked, digits=3),
                shown(row["thicker"], row["thicker_stderr"], digits=2, signed=True),
                scores,
            ]
        )
    return grid(header, lines)


def thermal_scene(eta: float) -> sdpd.Scene:
    return sdpd.Scene(
        fluid=reduced_fluid(eta),
        box=sdpd.Box((8.0,) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel="lucy", support=2.65),
        start=sdpd.RandomStart(),
        sound_speed=10.0,
    )


def shear_thinning(quick: bool) -> list[tuple[float, float, float, float]]:
    """Amplitude of the flow, Weissenberg number, eta(k) over the input and its error."""
    scene = thermal_scene(THICK)
    plan = viscosity.plan_scene(scene, time_factor=0.05 if quick else 0.8)
    plan = replace(plan, forced_steps=plan.forced_steps + plan.steps)
    time = viscosity.viscosity_theory(scene, plan.dt).stress_time
    k = plan.forced_wave_number(scene)
    found = []
    for speed in SPEEDS[2:4] if quick else SPEEDS:
        force = replace(plan.force, amplitude=speed * plan.force.amplitude)
        share = min(1.0, max(0.15, (2.0 / speed) ** 2))  # strong flows need less time
        short = replace(plan, force=force, forced_steps=max(256, int(share * plan.forced_steps)))
        eta, amplitude, _ = viscosity.measure_forced(
            scene, short, seed=5, threads=1, progress=False
        )
        flow = amplitude.value / scene.thermal_speed
        found.append((flow, k * amplitude.value * time, eta.value / THICK, eta.stderr / THICK))
    return found


def plot_methods(report: Report, rows: Sequence[dict[str, Any]]) -> None:
    figure, panels = subplots(2, width=8.6, height=3.6, sharey=True)
    for axes, dimension in zip(panels, (2, 3), strict=True):
        for kernel in ("lucy", "wendland_c2"):
            mine = [r for r in rows if (r["dimension"], r["kernel"]) == (dimension, kernel)]
            eta = np.array([r["eta"] for r in mine])
            color, title = KERNEL_COLOURS[kernel], kernels.get(kernel).title
            asked = np.array([r["asked"] for r in mine])
            field = [
                r["friction"] + r["kinetic_mean_field"] + r["configurational_mean_field"]
                for r in mine
            ]
            axes.plot(eta, [r["friction"] for r in mine] / asked, ":", color=color, linewidth=1.2)
            axes.plot(eta, field / asked, "--", color=color, linewidth=1.2)
            for index, (name, marker) in enumerate(METHODS):
                axes.errorbar(
                    eta * (0.93 + 0.07 * index),
                    [r[name] for r in mine] / asked,
                    [r[f"{name}_stderr"] for r in mine] / asked,
                    color=color,
                    marker=marker,
                    markersize=4.0,
                    linestyle="none",
                    linewidth=1.2,
                    label=f"{title}, {name.replace('_', ' ')}",
                )
        axes.axhline(1.0, color="0.5", linewidth=0.8)
        axes.set(xscale="log", xlabel=r"input $\eta^*$", title=f"{dimension}D")
        axes.set_xticks([2, 5, 20, 80], ["2", "5", "20", "80"])
        axes.minorticks_off()
    panels[0].set_ylabel("delivered over input viscosity")
    panels[1].legend(fontsize=7)
    panels[0].text(
        0.97,
        0.97,
        "dotted: friction alone\ndashed: with mean field of the rest",
        transform=panels[0].transAxes,
        ha="right",
        va="top",
        color="0.3",
        fontsize=7.5,
    )
    report.figure(figure, "methods")


def plot_thinning(report: Report, found: Sequence[tuple[float, float, float, float]]) -> None:
    scene = thermal_scene(THICK)
    step = viscosity.plan_scene(scene).dt
    theory = viscosity.viscosity_theory(scene, step)
    k = 2.0 * math.pi / 8.0
    friction = float(friction_theory(scene).viscosity_ratio(k)) * scene.factors.viscosity
    full = friction + (theory.configurational(k) + theory.kinetic) / THICK
    figure, axes = subplots(width=4.6, height=3.2)
    _, rate, mean, error = (np.array(column) for column in zip(*found, strict=True))
    axes.errorbar(rate, mean, error, fmt="o", color=KERNEL_COLOURS["lucy"], markersize=4.5)
    axes.axhline(friction, color="0.4", linestyle=":", label="friction alone, lattice")
    axes.axhline(full, color="0.4", linestyle="--", label="with mean field of the rest, slow flow")
    axes.set(
        xscale="log",
        xlabel=r"shear rate times relaxation time of the stress, $\dot\gamma\,t_s$",
        ylabel=r"$\eta(k)$ over the input",
    )
    axes.legend(fontsize=7.5)
    report.figure(figure, "thinning")


def draw_study(report: Report) -> None:
    subplots()  # sets the style
    from matplotlib import pyplot as plt

    plt.close("all")
    study = viscosity.run_viscosity(
        thermal_scene(5.0),
        seed=1,
        time_factor=0.03 if report.quick else 1.0,
        threads=1,
        progress=False,
    )
    figure = plt.figure(figsize=(10.0, 7.2), layout="constrained")
    viscosity.plot(study, figure)
    report.figure(figure, "study")


if __name__ == "__main__":
    main()
