"""No particle gets out in a million steps (fewer where they cost more) of the noisiest fluid.

Reduced units m = dx = k_B T = 1. The fluid is soft (X = 10: thermal particles come close to the
walls and cross them often) and the step is the largest that stability allows, so that a particle
goes as far in one step as it ever will. A run stops with an error if a particle is outside after
bounces; here its place is looked at besides, and so is the energy of the motion.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

import sdpd
from sdpd.walls.shaped import ROUNDING
from tests.validation import record

LOOKS = 500
STIFFNESS, ETA, SUPPORT = 10.0, 2.0, 2.2
KINDS = {  # steps; in the corners of 3D a particle has 26 images
    "corners in 2D": 1_000_000,
    "corners in 3D": 100_000,
    "circle inside": 300_000,
    "circle outside": 300_000,
    "star": 1_000_000,
}
FOUND: dict[str, dict[str, float]] = {}


def scene_of(kind: str) -> sdpd.Scene:
    dimension = 3 if kind.endswith("3D") else 2
    radius = 2.0 * SUPPORT
    walls: tuple[sdpd.walls.Wall, ...]
    if kind.startswith("corners"):
        box = sdpd.Box((6.0,) * dimension, periodic="")
        walls = sdpd.walls.enclosure(box)
    elif kind == "star":  # tips of 50 degrees and re-entrant edges
        angle = 0.1 + np.arange(10) * np.pi / 5.0
        reach = np.where(np.arange(10) % 2, 3.2, 7.0)[:, None]
        points = 7.5 + reach * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        box = sdpd.Box((15.0, 15.0), periodic="")
        walls = (sdpd.Polyline(points=points),)
    elif kind.endswith("inside"):
        box = sdpd.Box((2.0 * radius,) * 2, periodic="")
        walls = (sdpd.Cylinder(radius=radius, centre=(radius, radius), fluid="inside"),)
    else:
        radius = 1.01 * SUPPORT
        edge = 2.0 * radius + 1.5 * SUPPORT
        box = sdpd.Box((edge, edge))
        walls = (sdpd.Cylinder(radius=radius, centre=(0.5 * edge, 0.5 * edge)),)
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=ETA,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    with warnings.catch_warnings():  # curvature and the size of the boxes
        warnings.simplefilter("ignore", sdpd.errors.ResolutionWarning)
        return sdpd.Scene(
            fluid=fluid,
            box=box,
            walls=walls,
            resolution=sdpd.Resolution(spacing=1.0, support=SUPPORT, kernel="lucy"),
            start=sdpd.RandomStart(),
            sound_speed=math.sqrt(STIFFNESS),
        )


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_gets_out(kind: str) -> None:
    scene = scene_of(kind)
    step = 0.6 * sdpd.timestep.acoustic_limit(scene)  # beyond it sound is unstable
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.errors.TimeStepWarning)
        sim = sdpd.Simulation(scene, integrator="pair_splitting", dt=step, seed=1, threads=1)
    thermo = sdpd.Thermodynamics(every=50)
    deepest, touched = math.inf, 0
    for _ in range(LOOKS):
        sim.run(steps=KINDS[kind] // LOOKS, observe=thermo, progress=False)
        x = np.array(sim.positions)
        distance = np.min([wall.distance(x, scene.box) for wall in scene.walls], axis=0)
        deepest = min(deepest, float(distance.min()))
        touched += int(np.sum(distance < 0.1 * step * scene.thermal_speed))
    assert sim.step == KINDS[kind]
    # Distances to lines are exact, the wall of the star is a spline that rounds off its edges.
    behind = ROUNDING[2] if kind == "star" else 1e-10
    assert deepest > -behind * scene.support_radius
    # Walls were reached: particles lie so near to them that the next step may cross.
    assert touched > 20, touched
    # At the limit of stability the forces of bounced particles are no longer harmonic over a step,
    # which shows as some tenths of a per cent.
    temperature = sdpd.analysis.time_average(thermo["temperature"])
    assert temperature.stderr < 2.5e-3
    assert abs(temperature.value - 1.0) < 0.01 + 3.0 * temperature.stderr
    FOUND[kind] = {
        "particles": scene.n_particles,
        "steps": KINDS[kind],
        "dt_over_tau": step / scene.friction_time,
        "thermal_path_over_dx": step * scene.thermal_speed / scene.spacing,
        "closest_over_h": deepest / scene.support_radius,
        "temperature": temperature.value,
        "temperature_stderr": temperature.stderr,
    }


def test_the_record_is_written() -> None:
    assert set(FOUND) == set(KINDS), "a case failed"
    record.store("containment", FOUND)
