"""Entropy without noise: whether it ever falls, step by step, in fluids that are driven hard.

An isolated box is shaken every few steps, a slab is sheared and heated by its walls. The entropy
is that of the fluid plus Q/T_w of each wall, Q being the heat that the wall has received. A third
fluid has hardly any friction: there the books of the work, which give up the exact adiabat for the
exact energy, show in the entropy.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import Report, grid

import sdpd

FRACTIONS = (0.06, 0.12, 0.25)  # of the acoustic limit; the default step is at 0.25
STEPS = 1_000_000
SHAKEN = 25  # steps between shakes
SPEED = 3.0  # of shakes and of the upper plate, in thermal speeds
PLATES = (0.7, 1.4)  # temperatures
VISCOSITY, THIN = 5.0, 0.005


def gas(
    box: sdpd.Box, walls: Sequence[sdpd.Plane] = (), *, viscosity: float = VISCOSITY
) -> sdpd.Scene:
    """m = dx = k_B = T_0 = 1, C = 10, X = 100, and a Prandtl number of 2.5."""
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=viscosity,
        temperature=1.0,
        boltzmann_constant=1.0,
        heat_capacity=10.0,
        thermal_conductivity=4.0 * viscosity,
        viscosity_exponent=0.7,
        conductivity_exponent=0.7,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.SdpdWarning)  # few particles on purpose
        return sdpd.Scene(
            fluid=fluid,
            box=box,
            walls=tuple(walls),
            resolution=sdpd.Resolution(spacing=1.0, support=2.0, kernel="lucy"),
            start=sdpd.RandomStart(relax_steps=100),
            sound_speed=10.0,
            effects=sdpd.Effects(energy=True, fluctuations=False),
        )


def isolated(viscosity: float = VISCOSITY) -> sdpd.Scene:
    """64 particles in a periodic cube."""
    return gas(sdpd.Box((4.0, 4.0, 4.0)), viscosity=viscosity)


def between_plates() -> sdpd.Scene:
    """96 particles between a cold plate at rest and a hot one that moves along itself."""
    cold, hot = (sdpd.Isothermal(t) for t in PLATES)
    walls = (
        sdpd.Plane(axis="z", at=0.0, heat=cold),
        sdpd.Plane(axis="z", at=6.0, velocity=(SPEED, 0.0, 0.0), heat=hot),
    )
    return gas(sdpd.Box((4.0, 4.0, 6.0), periodic="xy"), walls)


def shake(sim: sdpd.Simulation, random: np.random.Generator) -> None:
    """A wave of velocity, partly along itself, and halves of 0.5 and 2 times the temperature."""
    axis, phase = int(random.integers(3)), random.uniform(0.0, 2.0 * np.pi)
    place = 2.0 * np.pi * np.asarray(sim.positions[:, axis]) / sim.scene.box.lengths[axis] + phase
    direction = random.normal(size=3)
    direction *= SPEED / np.linalg.norm(direction)
    sim.velocities = np.sin(place)[:, None] * direction
    sim.temperatures = np.where(np.cos(place) < 0.0, 0.5, 2.0)


class Entropy(sdpd.Observer):
    """Entropy of the fluid and what it has given to walls, every step."""

    may_write = False

    def __init__(self, sim: sdpd.Simulation) -> None:
        super().__init__(every=1)
        walls = (wall.heat for wall in sim.scene.walls)
        self._cold = np.array([1.0 / heat.temperature for heat in walls])
        self.last = self._entropy(sim)
        self.least, self.falls, self.sum = np.inf, 0, 0.0

    def _entropy(self, sim: sdpd.Simulation) -> float:
        given = self._cold @ sim.energy_accounts().wall_heat if self._cold.size else 0.0
        return float(sim.entropy + given)

    def sample(self, sim: sdpd.Simulation) -> None:
        now = self._entropy(sim)
        change, self.last = now - self.last, now
        self.least = min(self.least, change)
        self.falls += change < 0.0
        self.sum += change

    def forget(self, sim: sdpd.Simulation) -> None:
        """Begin anew after a shake."""
        self.last = self._entropy(sim)


@dataclass(frozen=True)
class Found:
    """Changes of the entropy from step to step, in k_B a particle; energies over the total."""

    step: float  # dt over the acoustic limit
    mean: float
    least: float
    falls: int
    energy: float  # largest change of the total energy that no account explains


def follow(scene: sdpd.Scene, fraction: float, steps: int, *, books: bool) -> Found:
    """So many steps of a fraction of the acoustic limit, shaken where there are no walls."""
    limit = sdpd.timestep.acoustic_limit(scene)
    integrator = sdpd.PairSplitting(energy_bookkeeping=books)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.TimeStepWarning)
        sim = sdpd.Simulation(scene, dt=fraction * limit, integrator=integrator, seed=1, threads=1)
    random = np.random.default_rng(1)
    entropy = Entropy(sim)
    worst = 0.0
    for _ in range(steps // SHAKEN):
        if not scene.walls:
            shake(sim, random)
            entropy.forget(sim)
        before = sim.total_energy - sim.energy_accounts().gained
        sim.run(steps=SHAKEN, observe=entropy, progress=False)
        after = sim.total_energy - sim.energy_accounts().gained
        worst = max(worst, abs(after - before) / sim.total_energy)
    number = scene.n_particles
    done = steps // SHAKEN * SHAKEN
    return Found(
        fraction, entropy.sum / number / done, entropy.least / number, entropy.falls, worst
    )


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("entropy", __doc__, argv)
    steps, fractions = (100, FRACTIONS[-1:]) if report.quick else (5_000, FRACTIONS)
    scenes = {
        "isolated, shaken": isolated(),
        "between plates": between_plates(),
        "isolated, shaken, hardly any friction": isolated(THIN),
    }
    rows = []
    for name, scene in scenes.items():
        for fraction in fractions:
            kept, lost = (follow(scene, fraction, steps, books=b) for b in (True, False))
            rows.append(
                [name, f"{fraction:g}", f"{kept.mean:.2g}"]
                + [cell for x in (kept, lost) for cell in (f"{x.least:+.1e}", f"{x.falls}")]
                + [f"{x.energy:.0e}" for x in (kept, lost)]
            )
    header = [
        "fluid",
        r"$\Delta t$ / acoustic limit",
        "mean change",
        "smallest, books kept",
        "falls",
        "smallest, adiabats",
        "falls",
        r"$\Delta E/E$, books kept",
        "adiabats",
    ]
    report.document(
        grid(header, rows),
        f"Changes of the entropy in a step, in $k_B$ a particle, over {steps} steps, with $Q/T_w$ "
        f"of the walls; largest change of the total energy in {SHAKEN} steps that no account "
        "explains.",
    )


if __name__ == "__main__":
    main()
