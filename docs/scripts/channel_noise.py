"""Transient Poiseuille and Couette flow with noise, means over many runs (Yang 3.1, 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from channel import TIMES, TOP, WIDTH, exact
from report import Report, grid, shown, subplots

import sdpd
from sdpd import fields

RUNS = 50  # as published
BINS = 20  # one layer of particles each


@dataclass(frozen=True)
class Moment:
    """Mean over the runs at one time, with its error, the closed form, and a run without noise."""

    time: float
    z: np.ndarray
    velocity: np.ndarray
    error: np.ndarray
    expected: np.ndarray
    quiet: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """From the closed form, in standard errors."""
        return (self.velocity - self.expected) / self.error

    @property
    def from_quiet(self) -> np.ndarray:
        """From the run without noise, in standard errors."""
        return (self.velocity - self.quiet) / self.error

    @property
    def mean_flow(self) -> tuple[float, float]:
        """Mean over the channel over that of the closed form, and its error."""
        ratio = self.velocity.mean() / self.expected.mean()
        return float(ratio), float(np.sqrt(np.sum(self.error**2)) / BINS / self.expected.mean())


def noisy_scene(kind: str) -> sdpd.Scene:
    """The ready scene with noise: 20 layers, and a box 0.3 mm instead of 1 mm along the flow."""
    box = sdpd.Box((3e-4, 3e-4, WIDTH), periodic="xy")
    return sdpd.scenes.load(kind).replace(
        box=box,
        resolution=sdpd.Resolution(particles=(6, 6, BINS)),
        effects=sdpd.Effects(fluctuations=True),
    )


def profile(sim: sdpd.Simulation) -> fields.FieldSet:
    """Velocity in bins, of one moment."""
    return fields.snapshot(sim, fields.Bins.over(sim.scene.box, "z", BINS), quantities="velocity")


def run(scene: sdpd.Scene, times: Sequence[float], seed: int = 0) -> list[fields.FieldSet]:
    """Profiles of one run at the given times.

    With noise or without, the integrator is the pair splitting at the step tau, not 2 tau: on the
    lattice that the particles still form it loses 2 % of the viscosity at 2 tau and 0.5 % at tau.
    """
    sim = sdpd.Simulation(
        scene, integrator="pair_splitting", dt=scene.friction_time, seed=seed, threads=1
    )
    found = []
    for time in times:
        sim.run(time=time - sim.time, progress=False)
        found.append(profile(sim))
    return found


def measure(kind: str, runs: int, times: Sequence[float] = TIMES) -> list[Moment]:
    """The ensemble; seeds are 1 to `runs`."""
    scene = noisy_scene(kind)
    members = [run(scene, times, seed) for seed in range(1, runs + 1)]
    quiet = run(scene.replace(effects=sdpd.Effects(fluctuations=False)), times)
    fine = (np.arange(BINS * 20) + 0.5) / (BINS * 20) * WIDTH
    moments = []
    for index, time in enumerate(times):
        pooled = fields.ensemble([member[index] for member in members])["velocity_x"]
        curve = exact(kind, scene, fine, time, 1.0).reshape(BINS, 20).mean(axis=1)
        moments.append(
            Moment(
                time,
                pooled.target.points.reshape(BINS, -1)[:, -1],
                pooled.mean,
                pooled.stderr,
                curve,
                quiet[index]["velocity_x"].mean,
            )
        )
    return moments


def main(argv: Sequence[str] | None = None) -> None:
    """Write table and figure."""
    report = Report.from_arguments("channel_noise", __doc__, argv)
    runs, times = (4, TIMES[:2]) if report.quick else (RUNS, TIMES)
    flows = {kind: measure(kind, runs, times) for kind in ("poiseuille", "couette")}
    rows = [
        [
            kind.capitalize(),
            f"{moment.time:.2f} s",
            f"{moment.error.mean() / TOP:.2%}",
            shown(*moment.mean_flow, digits=3),
            f"{np.sum(moment.deviation**2):.1f}",
            f"{np.abs(moment.deviation).max():.2f}",
            f"{np.sum(moment.from_quiet**2):.1f}",
        ]
        for kind, moments in flows.items()
        for moment in moments
    ]
    header = ["flow", "time", "error of a bin", "mean flow", "$\\chi^2$", "largest z"]
    report.document(
        grid([*header, "$\\chi^2$, without noise"], rows),
        f"Means over {runs} runs in {BINS} bins. Standard error of a bin over the steady maximum; "
        "mean over the channel over that of the closed form; sum of squared deviations from the "
        f"closed form in standard errors ({BINS} expected, 90 % of such sums lie below 29), the "
        "largest of them, and the sum against a run of the same steps without noise.",
    )
    _plot(report, flows)


def _plot(report: Report, flows: dict[str, list[Moment]]) -> None:
    figure, axes = subplots(2, width=7.2, height=3.2)
    colours = ("#4269d0", "#3ca951", "#ff725c", "#9c6b4e", "#a463f2")
    fine = np.linspace(0.0, WIDTH, 300)
    for ax, (kind, moments) in zip(axes, flows.items(), strict=True):
        scene = noisy_scene(kind)
        for moment, colour in zip(moments, colours, strict=False):
            sdpd.plot.profile(
                (1e3 * moment.z, 1e6 * moment.velocity, 1e6 * moment.error),
                label=f"{moment.time:g} s",
                axes=ax,
                color=colour,
                markersize=2.5,
                elinewidth=0.8,
            )
            curve = exact(kind, scene, fine, moment.time, 1.0)
            ax.plot(1e3 * fine, 1e6 * curve, color=colour, linewidth=1.0)
        ax.set(title=kind.capitalize(), xlabel="z (mm)", ylabel="velocity (μm/s)")
    axes[1].legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
