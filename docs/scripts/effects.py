"""Which effects a channel calls for, by width and speed; and what they do in one, on and off."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from report import Report, grid, subplots

import sdpd
from sdpd import effect_rules, effects_study

LAYERS = 20  # particles across
WIDTHS, SPEEDS = (-8.0, -2.0), (-4.0, 2.5)  # powers of ten, m and m/s
# zeta of water is beyond what the particles carry (docs/guide/scenes); this is as much as they can
FLUIDS = {
    "water": sdpd.fluids.water(bulk_viscosity=1.6e-3),
    "air": sdpd.fluids.nitrogen(properties="measured", bulk_viscosity=1.3e-5).replace(
        name="air", viscosity_exponent=0.7, conductivity_exponent=0.7
    ),
}
SHOWN = {
    "fluctuations": ("#0072B2", "-"),
    "energy": ("#D55E00", "-"),
    "variable_transport": ("#E69F00", "--"),
    "bulk_viscosity": ("#009E73", ":"),
}


def channel(fluid: sdpd.Fluid, width: float, speed: float, **changes: Any) -> sdpd.Scene:
    """Flow at a speed between plates at rest, as hot as the fluid."""
    spacing = width / LAYERS
    box = sdpd.Box((8.0 * spacing, 8.0 * spacing, width), periodic="xy")
    arguments = {
        "fluid": fluid,
        "box": box,
        "walls": sdpd.walls.slab(box, "z"),
        "resolution": sdpd.Resolution(particles=(8, 8, LAYERS), support=2.6),
        "velocity_scale": speed,
        "effects": "auto",
        **changes,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.SdpdWarning)
        return sdpd.Scene(**arguments)


def distances(fluid: sdpd.Fluid, widths: np.ndarray, speeds: np.ndarray) -> dict[str, np.ndarray]:
    """Logarithm of the number of each effect over its threshold, > 0 where it is on."""
    found = {name: np.full((len(speeds), len(widths)), -1.0) for name in SHOWN}
    for row, speed in enumerate(speeds):
        for column, width in enumerate(widths):
            regime = channel(fluid, float(width), float(speed)).regime()
            for name, table in found.items():
                each = regime.decision(name)
                if each.origin == "regime" and each.value and each.threshold:
                    table[row, column] = np.log10(each.value / each.threshold)
    return found


def draw_map(axes: Any, name: str, count: int) -> None:
    """Lines across which an effect comes in, on its shaded side."""
    widths, speeds = np.logspace(*WIDTHS, count), np.logspace(*SPEEDS, count)
    for effect, distance in distances(FLUIDS[name], widths, speeds).items():
        colour, line = SHOWN[effect]
        axes.plot([], [], color=colour, linestyle=line, label=effect.replace("_", " "))
        if distance.min() < 0.0 < distance.max():
            axes.contour(widths, speeds, distance, [0.0], colors=colour, linestyles=line)
            axes.contourf(widths, speeds, distance, [0.0, 99.0], colors=colour, alpha=0.1)
    axes.set(xscale="log", yscale="log", xlabel="width [m]", title=f"{name} between plates")


def nanochannel() -> sdpd.Scene:
    """Water between plates 20 nm apart, one of which moves at 50 m/s; by the regime."""
    box = sdpd.Box((8e-9, 8e-9, 2e-8), periodic="xy")
    return sdpd.Scene(
        fluid=sdpd.fluids.water(bulk_viscosity=1.6e-3),
        box=box,
        walls=sdpd.walls.slab(box, "z", upper_velocity=(50.0, 0.0, 0.0)),
        resolution=sdpd.Resolution(particles=(8, 8, 20)),
        start=sdpd.RandomStart(),
        effects="auto",
    )


def table_of_changes(study: effects_study.Study) -> str:
    """The observables with their differences, in Markdown."""
    rows = []
    for each in study.comparisons:
        for change in each.changes:
            rows.append(
                [
                    each.effect.replace("_", " "),
                    change.observable,
                    change.unit,
                    f"{change.off.value:.4g} ± {change.off.stderr:.1g}",
                    f"{change.on.value:.4g} ± {change.on.stderr:.1g}",
                    f"{change.z:+.1f}",
                    "changed" if change.observable in study.changed[each.effect] else "",
                ]
            )
    return grid(["effect", "observable", "unit", "off", "on", "z", ""], rows)


def table_of_costs(study: effects_study.Study) -> str:
    """Time of a particle-step, in Markdown."""
    header = ["effect", "in the scene", "ns off", "ns on", "ratio", "time ratio"]
    rows = [
        [
            each.effect.replace("_", " "),
            "on" if each.own else "off",
            each.cost.without.shown(".0f"),
            each.cost.with_it.shown(".0f"),
            f"{each.ratio:.2f}",
            f"{each.time_ratio:.2f}",
        ]
        for each in study.comparisons
    ]
    return grid(header, rows)


def table_of_criteria() -> str:
    """Numbers and thresholds, from the package."""
    rows = [
        [each.effect.replace("_", " "), each.name, f"`{each.symbol}`", f"{each.threshold:g}"]
        for each in effect_rules.CRITERIA
    ]
    return grid(["effect", "number", "symbol", "on from"], rows)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("effects", __doc__, argv)
    report.write("generated", "effects_criteria.md", table_of_criteria() + "\n")
    figure, panels = subplots(2, width=8.4, height=3.6, sharey=True)
    for axes, name in zip(panels, FLUIDS, strict=True):
        draw_map(axes, name, 5 if report.quick else 40)
    panels[0].set_ylabel("speed of the flow [m/s]")
    panels[0].legend(loc="lower left", fontsize=7)
    report.figure(figure)
    study = effects_study.compare_effects(
        nanochannel(),
        effects=("fluctuations", "energy", "viscous_heating"),
        steps=16 if report.quick else None,
        seeds=1 if report.quick else 4,
        quick=report.quick,
        progress=False,
    )
    report.document(
        table_of_changes(study),
        table_of_costs(study),
        f"{study.scene.n_particles} particles, {len(study.seeds)} seeds, "
        f"{study.comparisons[0].steps} steps each; z: on less off over its standard error. Costs "
        "are medians and quartiles of turns on one core of a shared machine.",
    )
    from matplotlib import pyplot as plt

    picture = plt.figure(figsize=(10.0, 4.6), layout="constrained")
    effects_study.plot(study, picture)
    report.figure(picture, "study")


if __name__ == "__main__":
    main()
