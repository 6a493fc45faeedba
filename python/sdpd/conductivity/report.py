"""The study as text and files: what was asked, what each way found, how they agree."""

from __future__ import annotations

import csv
import os
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.agreement import LEVEL, columns, comparison_table, threshold
from sdpd.analysis import Estimate
from sdpd.units import quantity

if TYPE_CHECKING:
    from sdpd.conductivity.study import Study

__all__ = ["report", "rows", "write"]


def report(study: Study) -> str:
    """Everything the command prints."""
    bound = threshold(study.comparisons, study.equilibrium.helfand_blocks)
    return "\n\n".join(
        [
            _head(study),
            _table(study),
            comparison_table(study.comparisons, study.agreed, bound),
            _words(study, bound),
        ]
    )


def rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict a value; all in the unit of the fluid's conductivity."""
    found = study.equilibrium
    prediction = study.prediction
    values: list[tuple[str, Estimate | float]] = [
        ("asked", study.asked),
        ("lattice sum", study.decay.lattice),
        ("lattice decay", study.decay.delivered),
        ("conduction, mean field", prediction.conduction),
        ("friction, mean field", prediction.friction),
        ("convection, order of magnitude", prediction.convection),
        ("Helfand moment", found.helfand),
        ("Green-Kubo", found.green_kubo),
        ("imposed gradient", study.gradient),
        ("both", study.conductivity),
        ("noise alone", found.noise),
        *((f"{name} alone", share) for name, share in found.shares.items()),
    ]
    return [
        {
            "name": name,
            "conductivity": value.value if isinstance(value, Estimate) else value,
            "stderr": value.stderr if isinstance(value, Estimate) else 0.0,
        }
        for name, value in values
    ]


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write conductivity.csv and conductivity.txt; the folder is made if need be."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"conductivity.{ending}" for ending in ("csv", "txt")]
    table = rows(study)
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    paths[1].write_text(report(study) + "\n", encoding="utf-8")
    return paths


def _head(study: Study) -> str:
    found = study.equilibrium
    sample, si = found.sample, found.sample.fluid.is_si
    first, last = found.helfand.window or (0.0, 0.0)
    tau = sample.conduction_time
    return (
        f"Delivered conductivity: {sample.n_particles} particles in {sample.dimension}D, "
        f"{sample.resolution.kernel} kernel, h/dx = {sample.resolution.support:g}, "
        f"C = {sample.heat_capacity_number:.4g} kB a particle"
        f"{', calibrated' if sample.calibrate else ''}\n"
        f"dt = {quantity(found.dt, 's', si=si)} = {found.dt / tau:.2f} tau_q = "
        f"{found.dt / sample.friction_time:.2f} tau; equilibrium: {found.steps} steps, lags "
        f"{first / tau:.3g} to {last / tau:.3g} tau_q\n"
        f"mean temperature {quantity(found.temperature.value, 'K', si=si)}; seed {study.seed}, "
        f"{study.seconds:.0f} s"
    )


def _table(study: Study) -> str:
    unit = "W/(m K)" if study.equilibrium.sample.dimension == 3 else "W/K"
    shown = f" [{unit}]" if study.equilibrium.sample.fluid.is_si else ""
    asked = study.asked
    lines = [["", f"conductivity{shown}", "SE", "over asked", "SE"]]
    for row in rows(study):
        value, stderr = row["conductivity"], row["stderr"]
        errors = [f"{stderr:.2g}", f"{stderr / asked:.4f}"] if stderr else ["", ""]
        lines.append([row["name"], f"{value:.5g}", errors[0], f"{value / asked:.4f}", errors[1]])
    return columns(lines)


def _words(study: Study, bound: float) -> str:
    share = study.conductivity.scaled(1.0 / study.asked)
    prediction = study.prediction
    text = (
        f"The fluid delivers {share.value:.3f} ± {share.stderr:.3f} of the conductivity asked for; "
        f"in mean field {prediction.total / study.asked:.3f}: conduction on the lattice, the "
        "kinetic energy that friction and its noise hand over, (D a + b) kB/(4 m), and particles "
        "that take their energy along. The time step leaves "
        f"{study.step_factor:.4f} of the conduction."
    )
    about = (
        "Parts alone leave out their correlations with the others. Green-Kubo is the same data as "
        "the Helfand moment. Sum and decay on the lattice are those of a wave 16 spacings long. "
        "The accuracy is what the layers next to the plates may change, and what particles off the "
        "lattice may."
    )
    if study.passed:
        verdict = (
            f"PASS: the ways agree; they fail beyond their accuracy and {bound:.1f} SE "
            f"(Student t, {LEVEL:.0%})."
        )
    else:
        verdict = "FAIL: " + "; ".join(
            f"{each.first} against {each.second}"
            for each, good in zip(study.comparisons, study.agreed, strict=True)
            if not good
        )
    return "\n".join(textwrap.fill(part, 100) for part in (text, about, verdict))
