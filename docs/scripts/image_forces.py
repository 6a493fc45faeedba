"""Forces of virtual particles in Poiseuille flow by the distance from the plates (Y, Figure 15)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from report import Report, grid, subplots

import sdpd


def profiles(scene: sdpd.Scene, time: float, samples: int) -> list[sdpd.WallForceProfile]:
    """At both plates, at the end of a run from rest."""
    found = [sdpd.WallForceProfile(wall=wall, bins=12, every=1) for wall in (0, 1)]
    sim = sdpd.Simulation(scene, integrator="velocity_verlet", threads=1)
    sim.run(time=time, progress=False)
    sim.run(steps=samples, observe=found, progress=False)
    return found


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("image_forces", __doc__, argv)
    scene = sdpd.scenes.load("poiseuille")
    found = profiles(scene, 0.02 if report.quick else 1.0, 5 if report.quick else 200)
    weight = scene.particle_mass * 1e-4  # of the body force on a particle
    rows, figure_data = [], []
    for wall, profile in enumerate(found):
        seen = profile.counts > 0.0
        at = profile.centers[seen] / scene.support_radius
        parts = {
            "conservative, normal": profile.normal("conservative")[seen],
            "dissipative, normal": profile.normal("dissipative")[seen],
            "conservative, along x": profile.tangential("conservative")[seen][:, 0],
            "dissipative, along x": profile.tangential("dissipative")[seen][:, 0],
        }
        figure_data.append((at, parts))
        for k in range(len(at)):
            values = [f"{part[k] / weight:.3g}" for part in parts.values()]
            rows.append([("lower", "upper")[wall], f"{at[k]:.3f}", *values])
    names = list(figure_data[0][1])
    report.document(grid(["plate", "distance / h", *(f"{name} / mf" for name in names)], rows))
    figure, axes = subplots(2)
    for wall, (at, parts) in enumerate(figure_data):
        for name, values in parts.items():
            axis = axes[0] if "normal" in name else axes[1]
            marker = ("o", "s")[wall] if "conservative" in name else ("^", "v")[wall]
            label = f"{name.split(',')[0]}, {('lower', 'upper')[wall]}"
            axis.plot(at, np.abs(values) / weight, marker, ms=4, label=label)
    axes[0].set_ylabel("normal force / m f [1]")
    axes[1].set_ylabel("|force along the flow| / m f [1]")
    for axis in axes:
        axis.set_xlabel("distance from the plate / h [1]")
        axis.legend()
    report.figure(figure)


if __name__ == "__main__":
    main()
