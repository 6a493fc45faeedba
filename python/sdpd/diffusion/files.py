"""The study as files: CSV, JSON and the printed text."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdpd.analysis.estimate import Estimate
from sdpd.diffusion.report import report

if TYPE_CHECKING:
    from sdpd.diffusion.results import CaseResult
    from sdpd.diffusion.study import Study

__all__ = ["rows", "write"]


def rows(study: Study) -> list[dict[str, Any]]:
    """One plain dict a case, every estimate with its standard error, in SI units."""
    found = []
    for r, theory in zip(study.results, study.collective, strict=True):
        row: dict[str, Any] = {
            "case": r.case.number,
            "edge_m": r.case.edge,
            "particles": r.scene.n_particles,
            "support_m": r.case.support_radius,
            "support_over_spacing": r.scene.resolution.support,
            "particle_mass_kg": r.scene.particle_mass,
            "size_ratio": r.formulas.size_ratio,
            "stiffness_X": r.scene.stiffness,
            "reduced_viscosity": r.scene.reduced_viscosity,
            "dt_short_s": r.plan.short,
            "dt_long_s": r.plan.long,
            "steps": r.plan.steps,
            "friction_time_s": r.friction_time,
        }
        _put(row, "temperature_K", r.temperature)
        _put(row, "temperature_variance_over_exact", r.temperature_variance)
        _put(row, "density_kg_m3", r.density)
        _put(row, "pressure_Pa", r.pressure)
        for name, drift in r.drifts.items():
            _put(row, f"drift_{name}", drift)
        for name, estimate in _diffusion(r).items():
            _put(row, f"D_{name}_m2_s", estimate)
            _put(row, f"Sc_{name}", r.schmidt(estimate))
        row["short_deviation_in_standard_errors"] = r.deviation
        for name, window in (("msd", r.msd.window), ("integral", r.integral.window)):
            row[f"{name}_lag_first_s"], row[f"{name}_lag_last_s"] = window or (None, None)
        row["msd_step_bias_removed_m2_s"] = r.step_bias
        row |= {
            "D_continuum_m2_s": r.formulas.continuum,
            "D_bird_m2_s": r.formulas.bird,
            "D_dissertation_m2_s": r.formulas.dissertation,
            "D_bird_printed_m2_s": r.case.published_bird,
            "D_dissertation_printed_m2_s": r.case.published_support,
            "collective_gain": theory.gain,
            "caging_loss": theory.loss,
            "D_mean_field_m2_s": theory.long,
            "core_seconds": r.seconds,
            "failures": "; ".join(study.failures.get(r.case.name, [])),
        }
        found.append(row)
    return found


def _diffusion(r: CaseResult) -> dict[str, Estimate]:
    return {
        "short": r.short,
        "short_exact": r.exact,
        "long_msd": r.msd,
        "long_msd_early": r.slopes[0],
        "long_msd_late": r.slopes[1],
        "long_integral": r.integral,
    }


def _put(row: dict[str, Any], name: str, estimate: Estimate) -> None:
    row[name] = estimate.value
    row[f"{name}_stderr"] = estimate.stderr


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write diffusion.csv, diffusion.json and diffusion.txt; the folder is made if need be."""
    from sdpd import __version__

    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    table = rows(study)
    paths = [target / f"diffusion.{ending}" for ending in ("csv", "json", "txt")]
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    summary = {
        "version": __version__,
        "fluid": study.fluid,
        "kernel": study.kernel,
        "equation_of_state": study.results[0].scene.fluid.equation_of_state.kind,
        "sound_ratio": study.sound_ratio,
        "seed": study.seed,
        "quick": study.quick,
        "processes": study.processes,
        "wall_seconds": study.seconds,
        "passed": study.passed,
        "failures": study.failures,
        "cases": table,
    }
    paths[1].write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    paths[2].write_text(report(study) + "\n", encoding="utf-8")
    return paths
