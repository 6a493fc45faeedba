r"""Sums over the energies of the particles at equilibrium, block by block.

Temperatures are over T = (E - E_cold)/(A kB) of the sample, E - E_cold the thermal and the kinetic
energy: with that unit they share a constant sum whatever the positions, so that at given positions
<t_i t_j> of t = T_i/T - 1 is exact (:class:`sdpd.theory.EnergyShell`). A mode has N (v - c) + c
|rho_k|^2, a cell N_c (v - c) + N_c^2 c, a pair c, with variance v and covariance c.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.theory import EnergyShell

if TYPE_CHECKING:
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["EnergySums", "draw_temperatures", "shell_of", "shell_temperature"]

Array = NDArray[np.float64]
Add = Callable[[str, Array], None]


def shell_of(scene: Scene) -> EnergyShell:
    """The particles of a scene."""
    return EnergyShell(
        particles=scene.n_particles,
        dimension=scene.dimension,
        heat_capacity=scene.heat_capacity_number,
    )


def shell_temperature(sim: Simulation) -> float:
    """(E - E_cold)/(A kB) [temperature]: thermal and kinetic energy over what shares them."""
    scene = sim.scene
    boltzmann, shell = scene.fluid.boltzmann_constant, shell_of(scene)
    thermal = shell.heat_capacity * float(np.sum(sim.temperatures))
    return (thermal + sim.kinetic_energy / boltzmann) / shell.freedom


def draw_temperatures(scene: Scene, seed: int) -> Array:
    """Temperatures at equilibrium with the mean of the fluid, shape (N,) [temperature].

    Conduction alone would take the time of the longest wave to spread them.
    """
    random = np.random.default_rng([seed, 1])
    drawn = random.gamma(scene.heat_capacity_number, size=scene.n_particles)
    return np.asarray(scene.fluid.temperature * drawn / drawn.mean())


class EnergySums:
    """What a `Sampler` adds up of a fluid with an energy.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    shell : EnergyShell
    histogram : ndarray, shape (100,)
        Of (T_i/T - 1) sqrt(k) in bins of 0.1 from -5.
    temperatures : list of float
        T of each sample [temperature].
    """

    def __init__(self, scene: Scene, edges: Array) -> None:
        self._scene, self._edges = scene, edges
        self._unit = scene.stiffness * scene.thermal_energy * scene.n_particles / scene.box.volume
        self.shell = shell_of(scene)
        self.histogram: Array = np.zeros(edges.size - 1)
        self.temperatures: list[float] = []

    def begin(self, sim: Simulation) -> float:
        """T of a sample over that of the fluid [1]."""
        self.temperatures.append(shell_temperature(sim))
        return self.temperatures[-1] / self._scene.fluid.temperature

    def deviations(self, sim: Simulation) -> Array:
        """T_i/T - 1, entropies over kB and pressures over rho c^2 less their means, (N, 3)."""
        boltzmann = self._scene.fluid.boltzmann_constant
        found = np.stack(
            [
                sim.temperatures / self.temperatures[-1] - 1.0,
                (sim.entropies - sim.entropies.mean()) / boltzmann,
                (sim.pressures - sim.pressures.mean()) / self._unit,
            ],
            axis=1,
        )
        self.histogram += np.histogram(
            found[:, 0] * np.sqrt(self.shell.heat_capacity), self._edges
        )[0]
        return found

    def particles(self, add: Add, deviations: Array, density: Array) -> None:
        """Means over particles; `density` over its mean."""
        warm, disorder, pressure = deviations.T
        count = warm.size
        away = density - density.mean()
        cross = float(warm @ away) / np.sqrt(float(warm @ warm) * float(away @ away))
        add(
            "energies",
            np.array(
                [
                    1.0 + warm.mean(),
                    np.mean(warm**2),
                    float(disorder @ disorder) / (count - 1),
                    float(pressure @ pressure) / (count - 1),
                    cross,
                ]
            ),
        )

    def modes(self, waves: NDArray[np.complex128], power: Array) -> tuple[Array, ...]:
        """Of waves (K, 4) of density, temperature, entropy and pressure, each (K,).

        Temperature over what it is at these positions, correlation of temperature and density,
        entropy and pressure by particle; `power` is |rho_k|^2/N.
        """
        count, shell = self.shell.particles, self.shell
        rho, warm = waves[:, 0], waves[:, 1]
        expected = count * (shell.variance - shell.covariance) + shell.covariance * count * power
        cross = (rho.conj() * warm).real / (count * np.sqrt(power.mean() * shell.variance))
        square = np.abs(waves[:, 2:]) ** 2 / count
        return np.abs(warm) ** 2 / expected, cross, square[:, 0], square[:, 1]

    def cell(self, warm: Array, number: Array) -> float:
        """Squared sums of T_i/T - 1 over cells over what they are at these numbers [1]."""
        v, c = self.shell.variance, self.shell.covariance
        expected = float(np.sum(number * (v - c) + number**2 * c))
        return float(np.sum(warm**2)) / expected
