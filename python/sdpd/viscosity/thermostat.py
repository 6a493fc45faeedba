"""Holds the temperature of a fluid with an energy while a force heats it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sdpd.fluctuations.energy_sums import draw_temperatures, shell_of, shell_temperature

if TYPE_CHECKING:
    from sdpd.observers import Observer
    from sdpd.simulation import Simulation

__all__ = ["Thermostat"]

WARMEST = 0.002  # of T between two corrections, as planned from the first stretch


class Thermostat:
    """Takes heat from the internal energies, in proportion to them, so that T stays what it is.

    It touches neither positions nor velocities: the flow and its fluctuations are those of the
    fluid at its temperature. Without an energy it only runs the simulation.

    Parameters
    ----------
    sim : Simulation
        Fresh; a fluid with an energy gets temperatures of equilibrium.
    seed : int
        Of these.

    Attributes
    ----------
    heating : float
        Heat taken out over what the fluid holds at T [1].
    """

    def __init__(self, sim: Simulation, *, seed: int) -> None:
        self._sim, self._active = sim, sim.scene.active_effects.energy
        self.heating = 0.0
        if self._active:
            sim.temperatures = draw_temperatures(sim.scene, seed)

    def run(
        self,
        steps: int,
        *,
        every: int,
        observe: Observer | Sequence[Observer] = (),
        progress: bool | None = None,
    ) -> None:
        """Run so many steps; corrections come after multiples of `every` steps."""
        if not self._active:
            if steps:
                self._sim.run(steps=steps, observe=observe, progress=progress)
            return
        left, stretch = steps, max(every, 16 // every * every)
        while left:
            count = min(left, stretch)
            self._sim.run(steps=count, observe=observe, progress=progress)
            rise = self._correct()
            left -= count
            stretch = self._next(stretch, rise, every)

    def _correct(self) -> float:
        """Bring T back to that of the fluid; by how much it was off [1]."""
        sim = self._sim
        kelvin = sim.scene.fluid.temperature
        rise = shell_temperature(sim) / kelvin - 1.0
        shell = shell_of(sim.scene)
        held = shell.heat_capacity * float(np.sum(sim.temperatures)) / kelvin
        sim.temperatures = sim.temperatures * (1.0 - rise * shell.freedom / held)
        self.heating += rise
        return rise

    @staticmethod
    def _next(stretch: int, rise: float, every: int) -> int:
        """Twice as long a stretch if that keeps the fluid cool enough, else half of it."""
        if abs(rise) < 0.4 * WARMEST:
            return 2 * stretch
        if abs(rise) > WARMEST:
            return max(every, stretch // 2 // every * every)
        return stretch
