"""Friction on the particles as they lie: what it delivers before anything moves.

Of an arrangement, the initial decay rate of a shear wave and the size of the random part of the
stress are sums over pairs. On a lattice the first is the lattice sum; a fluid is a little thicker.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import kernels
from sdpd.analysis import Estimate, ensemble
from sdpd.observers import Observer

if TYPE_CHECKING:
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["Arrangement"]

Array = NDArray[np.float64]


class Arrangement(Observer):
    r"""Sums over the pairs of sampled arrangements.

    Parameters
    ----------
    scene : Scene
    wave_vectors : ndarray of int, shape (K, D)
        n of k = 2 pi n/L.
    dt : float
        Time step of the pair splitting [time].
    every : int
        Steps between samples.

    Notes
    -----
    With r the separation of a pair, e its direction, u a unit vector across k and p the wave's,

    .. math::
        \eta_f(k) &= \frac1{V k^2}\Big\langle\sum g\,(a + b\,e_u^2)\,2(1-\cos k\cdot r)\Big\rangle,
        \qquad \eta_f(0) = \frac1V\Big\langle\sum g\,(a + b\,e_u^2)\,r_p^2\Big\rangle \\
        \eta_R &= \frac1{2V k_BT\,\Delta t}
                  \Big\langle\sum r_p^2\,\mathrm{Var}(\Delta p_u)\Big\rangle

    The last is the random part of the stress over a step of two exact half sweeps, each with
    Var = (m/2) kB T (1 - exp(-2 (a + b) g dt/m)) along e and (1 - exp(-2 a g dt/m)) across; it
    tends to the first as dt -> 0. Of a fluid with an energy the friction of a pair is that at its
    temperatures less its share c = 2 (kB/C) T_i T_j/(T_i + T_j)^2, and the variance that of kB
    Tbar/(1 - c), Tbar = 2 T_i T_j/(T_i + T_j).
    """

    may_write: ClassVar[bool] = False

    def __init__(
        self, scene: Scene, *, wave_vectors: NDArray[np.int64], dt: float, every: int
    ) -> None:
        super().__init__(every=every)
        self._scene, self._dt = scene, dt
        box = np.asarray(scene.box.lengths)
        k = 2.0 * np.pi * wave_vectors / box
        length = np.sqrt(np.sum(k**2, axis=1))
        name = np.round(length / length.min(), 9)
        self.wave_number: Array = np.array([length[name == v][0] for v in np.unique(name)])
        self._vectors = [k[name == v] for v in np.unique(name)]
        self._rows: list[Array] = []

    def sample(self, sim: Simulation) -> None:
        """Add the present arrangement."""
        from scipy.spatial import cKDTree

        scene, box = self._scene, np.asarray(self._scene.box.lengths)
        h = scene.support_radius
        tree = cKDTree(sim.positions, boxsize=box)
        i, j = tree.query_pairs(h, output_type="ndarray").T
        r = sim.positions[i] - sim.positions[j]
        r -= box * np.rint(r / box)
        squared = np.sum(r**2, axis=1)
        distance = np.sqrt(squared)
        _, f = kernels.evaluate(scene.resolution.kernel, scene.dimension, distance, h)
        d = sim.number_densities
        g = f / (d[i] * d[j])
        warmth: Array | float = 1.0
        if scene.active_effects.energy:
            share, warmth = self._thermal(sim.temperatures[i], sim.temperatures[j])
            g = g * share
        cosines = r**2 / squared[:, None]
        waves = [self._wave(k, r, squared, g) for k in self._vectors]
        across, along = scene.friction_across, scene.friction_along
        plain = self._straight(r, cosines, across * g, along * g)
        x = -2.0 * g * self._dt / scene.particle_mass
        unit = 0.5 * scene.particle_mass / self._dt * warmth
        side = -unit * np.expm1(across * x)
        rest = -unit * np.expm1((across + along) * x) - side
        self._rows.append(np.array([plain, self._straight(r, cosines, side, rest), *waves]))

    def _thermal(self, first: Array, second: Array) -> tuple[Array, Array]:
        """Share of the friction of a pair that acts, and Tbar/(1 - c) over the fluid's T."""
        scene, kelvin = self._scene, self._scene.fluid.temperature
        k, both = scene.heat_capacity_number, first + second
        c = 2.0 / k * first * second / both**2
        share = 1.0 - c
        if scene.active_effects.variable_transport:
            motion = 0.25 * scene.dimension
            mean = (0.5 * k * both / kelvin + motion) / (k + motion)
            share = share * mean**scene.fluid.viscosity_exponent
        return share, 2.0 * first * second / both / kelvin / (1.0 - c)

    def _straight(self, r: Array, cosines: Array, across: Array, along: Array) -> float:
        """Mean over p != u of sum r_p^2 (across + along e_u^2)/V."""
        dimension = self._scene.dimension
        square = r**2
        others = np.sum(square, axis=1, keepdims=True) - square
        # u runs over the axes, p over the others
        total = np.sum(others * (across[:, None] + along[:, None] * cosines))
        return float(total) / (dimension * (dimension - 1)) / self._scene.box.volume

    def _wave(self, vectors: Array, r: Array, squared: Array, g: Array) -> float:
        """eta_f(k), mean over the wave vectors of one length and directions across."""
        scene, found = self._scene, []
        for k in vectors:
            length = float(np.linalg.norm(k))
            phase = r @ k
            side = (1.0 - (phase / length) ** 2 / squared) / (scene.dimension - 1)
            rate = g * (scene.friction_across + scene.friction_along * side)
            found.append(float(rate @ (2.0 - 2.0 * np.cos(phase))) / length**2)
        return float(np.mean(found)) / scene.box.volume

    @property
    def friction(self) -> Estimate:
        """eta_f(0) [pressure x time]."""
        return ensemble([row[0] for row in self._rows])

    @property
    def random(self) -> Estimate:
        """eta_R, the random part of the stress over a step [pressure x time]."""
        return ensemble([row[1] for row in self._rows])

    @property
    def waves(self) -> list[Estimate]:
        """eta_f of each wave number [pressure x time]."""
        table = np.array(self._rows)[:, 2:]
        return [ensemble(column) for column in table.T]
