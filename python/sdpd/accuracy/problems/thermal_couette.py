"""Nitrogen sheared between plates of two temperatures: viscous heating and conduction."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sdpd import fluids
from sdpd.accuracy.problem import Problem
from sdpd.accuracy.settings import Settings
from sdpd.analysis import Estimate
from sdpd.box import Box
from sdpd.effects import Effects
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.theory import HeatedShear, thermal_couette
from sdpd.wall_heat import Isothermal
from sdpd.walls import Plane

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

WIDTH, SPEED = 1e-4, 100.0  # m, m/s
TEMPERATURES = (300.0, 300.2)  # K: heated by the shear, Brinkman number 34
RAREFIED = 1.1e-3  # of the published density, so that particles shear as a fluid
EXPONENT = 0.7  # of viscosity and conductivity
SETTLE, SAMPLED, SAMPLES = 1.5, 0.5, 16  # in relaxation times of the flow


def scene(settings: Settings) -> Scene:
    """As wide as the supports need."""
    gas = fluids.nitrogen()
    side = math.ceil(2.0 * settings.support)
    spacing = WIDTH / settings.across
    low, high = (Isothermal(t) for t in TEMPERATURES)
    return Scene(
        fluid=gas.replace(
            density=RAREFIED * gas.density,
            viscosity_exponent=EXPONENT,
            conductivity_exponent=EXPONENT,
        ),
        box=Box((side * spacing, side * spacing, WIDTH), periodic="xy"),
        walls=(
            Plane(axis="z", at=0.0, heat=low),
            Plane(axis="z", at=WIDTH, velocity=(SPEED, 0.0, 0.0), heat=high),
        ),
        resolution=Resolution(
            particles=(side, side, settings.across),
            support=settings.support,
            kernel=settings.kernel,
        ),
        calibrate=settings.calibrate,
        effects=Effects(energy=True, fluctuations=False),
    )


def exact(made: Scene) -> HeatedShear:
    """The closed form."""
    fluid = made.fluid
    return thermal_couette(
        width=WIDTH,
        speed=SPEED,
        temperatures=TEMPERATURES,
        shear_viscosity=fluid.shear_viscosity,
        thermal_conductivity=fluid.thermal_conductivity or 0.0,
        exponent=EXPONENT,
        reference=fluid.temperature,
    )


def measure(sim: Simulation, settings: Settings) -> Estimate:
    """From the closed form, which should stay: rms error of T in layers over its span."""
    flow, number = exact(sim.scene), settings.across
    z = np.array(sim.positions[:, 2])
    velocity, temperature = flow.at(z)
    sim.velocities[:, 0] = velocity
    sim.temperatures = temperature
    unit = WIDTH**2 / math.pi**2 / sim.scene.fluid.kinematic_viscosity
    sim.run(time=SETTLE * unit, progress=False)
    sums = np.zeros((3, number))
    for _ in range(SAMPLES):
        sim.run(time=SAMPLED / SAMPLES * unit, progress=False)
        z = np.array(sim.positions[:, 2])
        layer = np.clip((z / WIDTH * number).astype(int), 0, number - 1)
        for row, values in zip(sums, (np.ones_like(z), z, sim.temperatures), strict=True):
            row += np.bincount(layer, np.asarray(values), number)
    height, found = sums[1:] / sums[0]
    error = found - flow.at(height)[1]
    span = float(np.ptp(flow.temperature))
    return Estimate(float(np.sqrt(np.mean(error**2))) / span, 0.0)


THERMAL_COUETTE = Problem(
    name="thermal_couette",
    title="Couette flow with viscous heating",
    error_of="temperature in layers, rms over its span",
    source="closed form",
    scene=scene,
    measure=measure,
    base=Settings(calibrate=True),
    takes=("across", "support", "kernel", "step", "calibrate"),
)
