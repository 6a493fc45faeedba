"""What is printed of a study of effects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sdpd.analysis import Estimate
from sdpd.units import quantity, table

if TYPE_CHECKING:
    from sdpd.effects_study.results import Change, Comparison, Study

__all__ = ["report"]

COSTS = (
    "what it costs: time of a particle-step, by turns [ns]; the step that each side takes [time]; "
    "wall time of a simulated time, on over off"
)
ERRORS = (
    "errors: one standard error of blocks of time, the sides compared block by block; changed: at "
    "1 % for\nall rows together. Runs without noise have no error (exact): what differs by 0.01 % "
    "has changed."
)


def _shown(value: Estimate, unit: str) -> str:
    """``"300.1 +- 0.4 K"``."""
    error = "" if value.stderr == 0.0 else f" +- {value.stderr:.2g}"
    return f"{value.value:.4g}{error}{' ' if unit else ''}{unit}"


def _row(each: Comparison, change: Change, changed: bool) -> list[str]:
    z = f"{change.z:+.1f}" if math.isfinite(change.z) else "exact"
    return [
        each.effect.replace("_", " "),
        change.observable,
        _shown(change.off, change.unit),
        _shown(change.on, change.unit),
        _shown(change.difference, change.unit),
        f"{change.relative:+.2%}",
        z if change.difference.value != 0.0 else "same",
        "changed" if changed else "",
    ]


def _cost(each: Comparison, si: bool) -> list[str]:
    return [
        each.effect.replace("_", " "),
        "on" if each.own else "off",
        each.cost.base,
        each.cost.without.shown(".0f"),
        each.cost.with_it.shown(".0f"),
        f"{each.ratio:.2f}",
        quantity(each.dt_off, "s", si=si),
        quantity(each.dt_on, "s", si=si),
        f"{each.time_ratio:.2f}",
    ]


def report(study: Study) -> str:
    """Two tables, and what could not be compared."""
    scene, changed = study.scene, study.changed
    si = scene.fluid.is_si
    title = (
        f"effects of a scene, each on and off: {scene.n_particles} particles, "
        f"{scene.resolution.kernel}, h/dx = {scene.resolution.support:g}, "
        f"{len(study.seeds)} seed{'s' * (len(study.seeds) > 1)}"
    )
    changes = [
        _row(each, change, change.observable in changed[each.effect])
        for each in study.comparisons
        for change in each.changes
    ]
    costs = [_cost(each, si) for each in study.comparisons]
    blocks = [title]
    if changes:
        header = ["effect", "observable", "off", "on", "on - off", "relative", "z", ""]
        blocks += ["what it changes", table(changes, header)]
        header = ["effect", "scene", "integrator", "ns off", "ns on", "ratio", "dt off", "dt on"]
        blocks += [COSTS, table(costs, [*header, "time ratio"])]
        reasons = [
            [each.effect.replace("_", " "), each.reason]
            for each in study.comparisons
            if each.reason
        ]
        blocks += ["what the regime says", table(reasons)]
    if study.left_out:
        rows = [[name.replace("_", " "), why] for name, why in study.left_out.items()]
        blocks += ["not switched", table(rows)]
    blocks.append(f"{ERRORS} {study.seconds:.0f} s")
    return "\n\n".join(blocks)
