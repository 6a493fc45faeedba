"""Sums over particles of an equilibrium run, block by block; no trajectory is kept.

With u = v/sqrt(kB T/m) and N particles of zero total momentum, the expectations at given positions
are exact: <u_i.u_j> = D (delta_ij - 1/N), so that sum u^2 has D (N - 1) degrees of freedom, a mode
|j_k|^2/N = 1 - |rho_k|^2/N^2 per component, a cell N_c - N_c^2/N, and a pair -1/N. Where the fluid
has an energy, T is that of its shell in each sample (`EnergySums`), with which this stays exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import allowed_wave_vectors, fourier_components
from sdpd.analysis.fourier import shells
from sdpd.fluctuations.energy_sums import EnergySums
from sdpd.observers import Observer

if TYPE_CHECKING:
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["Sampler"]

Array = NDArray[np.float64]

MOST_VECTORS = 48
FEWEST_SHELLS = 4
PAIR_EVERY = 4  # samples between sums over pairs, which cost most
CELL_DIVISIONS = (2, 4)  # cells along each axis
HISTOGRAM = np.linspace(-5.0, 5.0, 101)


class Sampler(Observer):
    """Collects what is compared with theory; all sums are of reduced quantities.

    Parameters
    ----------
    scene : Scene
    samples : int
        Samples in a block, >= 1.
    every : int
        Steps between samples.

    Attributes
    ----------
    wave_number, n_vectors : ndarray, shape (M,)
        Shells of wave vectors: |k| [1/length] and how many of one half space.
    distance_edges : ndarray, shape (R + 1,)
        Bins of the velocity correlation [length].
    histogram : ndarray, shape (100,)
        Velocity components over sqrt(kB T/m), in bins of 0.1 from -5.
    energy : EnergySums or None
        Of a fluid with an energy.
    """

    def __init__(self, scene: Scene, *, samples: int, every: int = 1) -> None:
        super().__init__(every=every)
        self._samples = samples
        self._box = np.asarray(scene.box.lengths, dtype=np.float64)
        self._n = scene.n_particles
        self._density = self._n / scene.box.volume
        self._speed = scene.thermal_speed
        self._pressure = scene.stiffness * scene.thermal_energy * self._density
        self._vectors = _wave_vectors(self._box)
        k = 2.0 * np.pi * self._vectors / self._box
        length = np.sqrt(np.sum(k**2, axis=1))
        self._unit = k / length[:, None]
        self.wave_number, self.n_vectors = shells(length)
        self._starts = np.concatenate([[0], np.cumsum(self.n_vectors)[:-1]])
        self.distance_edges: Array = np.linspace(0.0, scene.support_radius, 6)
        self.histogram: Array = np.zeros(HISTOGRAM.size - 1)
        self.energy = EnergySums(scene, HISTOGRAM) if scene.active_effects.energy else None
        self._row: dict[str, Array] = {}
        self._count = 0
        self._blocks: list[dict[str, Array]] = []

    @property
    def divisions(self) -> tuple[int, ...]:
        """Cells along each axis."""
        return CELL_DIVISIONS

    @property
    def reduced_wave_number(self) -> Array:
        """Wave numbers of the shells over 2 pi/L, L the longest edge [1]."""
        return np.asarray(self.wave_number * self._box.max() / (2.0 * np.pi))

    @property
    def table(self) -> dict[str, Array]:
        """Sums of each complete block over the number of its samples, shapes (B, ...)."""
        return {name: np.stack([b[name] for b in self._blocks]) for name in self._blocks[0]}

    def sample(self, sim: Simulation) -> None:
        """Add the present state."""
        r, d = sim.positions, sim.number_densities / self._density
        warmth = 1.0 if self.energy is None else self.energy.begin(sim)
        u = sim.velocities / (self._speed * np.sqrt(warmth))
        more = np.zeros((self._n, 0)) if self.energy is None else self.energy.deviations(sim)
        self._velocities(u)
        self._modes(r, u, more)
        self._cells(r, u, more)
        self._add("density", np.array([d.mean(), np.mean((d - 1.0) ** 2)]))
        self._add("pressure", np.array([sim.pressures.mean() / self._pressure]))
        if self.energy is not None:
            self.energy.particles(self._add, more, d)
        if self._count % PAIR_EVERY == 0:
            self._pairs(r, u, more)
        self._count += 1
        if self._count == self._samples:
            self._blocks.append({name: a / self._samples for name, a in self._row.items()})
            self._row, self._count = {}, 0

    def _add(self, name: str, value: Array) -> None:
        self._row[name] = self._row[name] + value if name in self._row else value

    def _velocities(self, u: Array) -> None:
        self._add("square", np.sum(u**2, axis=0) / (self._n - 1))
        expected = 3.0 * (1.0 - 1.0 / self._n) ** 2
        if self.energy is not None:
            expected *= self.energy.shell.velocity_fourth_moment
        self._add("fourth", np.array([np.mean(u**4)]) / expected)
        self.histogram += np.histogram(u, HISTOGRAM)[0]

    def _modes(self, r: Array, u: Array, more: Array) -> None:
        dimension = u.shape[1]
        weights = np.concatenate([np.ones((self._n, 1)), u, more], axis=1)
        waves = fourier_components(r, self._box, self._vectors, weights)[0]
        density, current = waves[:, 0], waves[:, 1 : 1 + dimension]
        power = np.abs(density) ** 2 / self._n
        along = np.sum(current * self._unit, axis=1)
        total = np.sum(np.abs(current) ** 2, axis=1)
        forward = np.abs(along) ** 2
        expected = self._n - power
        across = (total - forward) / (self._unit.shape[1] - 1)
        self._add("structure", self._shells(power))
        self._add("longitudinal", self._shells(forward / expected))
        self._add("transverse", self._shells(across / expected))
        if self.energy is not None:
            chosen = np.concatenate([waves[:, :1], waves[:, 1 + dimension :]], axis=1)
            names = ("temperature_modes", "density_temperature", "entropy_modes", "pressure_modes")
            for name, value in zip(names, self.energy.modes(chosen, power), strict=True):
                self._add(name, self._shells(value))

    def _shells(self, value: Array) -> Array:
        return np.asarray(np.add.reduceat(value, self._starts) / self.n_vectors)

    def _cells(self, r: Array, u: Array, more: Array) -> None:
        dimension = r.shape[1]
        share = r / self._box
        for parts in CELL_DIVISIONS:
            cells = parts**dimension
            index = np.minimum((share * parts).astype(np.int64), parts - 1)
            flat = index @ (parts ** np.arange(dimension))
            number = np.bincount(flat, minlength=cells)
            momentum = np.array([np.bincount(flat, c, cells) for c in u.T])
            free = float(np.sum(number - number**2 / self._n))
            spread = float(np.mean((number - self._n / cells) ** 2))
            moved = float(np.sum(momentum**2)) / (dimension * free)
            self._add(f"cells_{parts}", np.array([spread, moved]))
            if self.energy is not None:
                warm = np.bincount(flat, more[:, 0], cells)
                self._add(
                    f"warm_cells_{parts}",
                    np.array([self.energy.cell(np.asarray(warm), number.astype(float))]),
                )

    def _pairs(self, r: Array, u: Array, more: Array) -> None:
        from scipy.spatial import cKDTree

        edges, number, dimension = self.distance_edges, self.distance_edges.size - 1, u.shape[1]
        found = cKDTree(r, boxsize=self._box).query_pairs(edges[-1], output_type="ndarray")
        i, j = found.T
        gap = r[i] - r[j]
        gap -= self._box * np.rint(gap / self._box)
        place = (np.sqrt(np.sum(gap**2, axis=1)) * (number / edges[-1])).astype(np.int64)
        place = np.minimum(place, number - 1)
        product = np.einsum("pd,pd->p", u[i], u[j]) / dimension
        sums = [np.bincount(place, weights, number) for weights in (product, None)]
        self._add("pairs", np.array(sums, dtype=np.float64))
        if self.energy is not None:
            warm = self.energy.shell.heat_capacity * more[i, 0] * more[j, 0]
            self._add("warm_pairs", np.bincount(place, warm, number).astype(np.float64))


def _wave_vectors(box: Array) -> NDArray[np.int64]:
    """The shortest whole shells: at least `FEWEST_SHELLS`, then up to `MOST_VECTORS`."""
    reach = 2.0 * np.pi / float(box.min()) * (6.5 if box.size == 2 else 3.2)
    vectors = allowed_wave_vectors(box, reach)
    length = np.sqrt(np.sum((vectors / box) ** 2, axis=1))
    ends = np.cumsum(shells(length)[1])
    whole = int(np.searchsorted(ends, MOST_VECTORS, side="right"))
    return vectors[: ends[min(max(whole, FEWEST_SHELLS), ends.size) - 1]]
