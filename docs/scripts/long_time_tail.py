"""The tail of the velocity autocorrelation, from what the validation recorded.

Table and figure show tests/validation/results.json, which `make validation` writes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from report import DOCS, Report, grid, shown, subplots

from sdpd import theory
from sdpd.drawing import BLUE, VERMILION

RECORD = DOCS.parent / "tests" / "validation" / "results.json"
COLOURS = {"large": BLUE, "small": VERMILION}


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("long_time_tail", __doc__, argv)
    numbers = json.loads(RECORD.read_text())["long_time_tail"]["numbers"]
    rows = []
    for name in ("large", "small"):
        box = numbers[name]
        error = float(np.hypot(box["amplitude_stderr"], box["amplitude_error_by_viscosity"]))
        rows.append(
            [
                f"{box['edge']}³",
                f"{box['time']:g}",
                f"{box['window'][0]:g} to {box['window'][1]:g}",
                shown(box["self_diffusion"], box["self_diffusion_stderr"]),
                shown(box["exponent"], box["exponent_stderr"], digits=2),
                f"{box['exponent_modes']:.2f}",
                shown(box["amplitude"], error, digits=3),
            ]
        )
    header = ["box", "time sampled", "lags", "$D_s$", "exponent", "of the waves"]
    eta = shown(numbers["eta_delivered"], numbers["eta_delivered_stderr"])
    report.document(
        grid([*header, "amplitude over that of the waves"], rows),
        f"Reduced units; delivered viscosity {eta} at an input of {numbers['eta_asked']:g}. "
        "Exponent: of $At^{-p}$ fitted within the lags, the missing momentum of the box restored; "
        "beside it that of the box's waves within the same lags. One standard error; that of the "
        "amplitude has the viscosity's in it.",
    )
    plot(report, numbers)


def plot(report: Report, numbers: dict[str, Any]) -> None:
    figure, panels = subplots(2, width=8.6, height=3.6)
    for axes, name in zip(panels, ("large", "small"), strict=True):
        box = numbers[name]
        lag, mean, error = (np.array(box[key]) for key in ("lag", "vacf", "stderr"))
        good = mean > 0.0
        axes.errorbar(
            lag[good],
            mean[good],
            np.minimum(error, 0.999 * np.abs(mean))[good],
            fmt="o",
            color=COLOURS[name],
            markersize=3.0,
            linewidth=0.9,
            label="measured",
            zorder=3,
        )
        t = np.geomspace(0.6, lag[-1], 200)
        fluid = theory.HydrodynamicTheory(
            dimension=3,
            density=1.0,
            shear_viscosity=numbers["eta_delivered"],
            sound_speed=1.0,
        )
        free = theory.vacf_tail(
            t, fluid=fluid, thermal_energy=1.0, self_diffusion=box["self_diffusion"]
        )
        axes.plot(t, free, "--", color="0.4", label="$t^{-3/2}$, infinite fluid")
        axes.plot(box["window_lag"], box["window_modes"], color="black", label="waves of the box")
        axes.axvspan(*box["window"], color="0.94", zorder=0)
        axes.set(
            xscale="log",
            yscale="log",
            ylim=(0.3 * float(np.min(np.abs(box["window_modes"]))), 0.5),
            xlabel=r"$t\,\sqrt{k_BT/m}/\Delta x$",
            title=f"{box['edge']}³ particles",
        )
        axes.legend(fontsize=7.5)
    panels[0].set_ylabel(r"$\langle\mathbf{v}(0)\cdot\mathbf{v}(t)\rangle\,m/(3k_BT)$")
    report.figure(figure)


if __name__ == "__main__":
    main()
