"""What one run of the ensemble leaves behind: correlation functions and the friction in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import kernels
from sdpd.analysis import Correlation, fourier_components
from sdpd.analysis.correlation import assemble
from sdpd.analysis.lagged_products import block_plan, product_sums
from sdpd.observers import Observer

if TYPE_CHECKING:
    from sdpd.correlations.plan import Plan
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = ["FUNCTIONS", "FrictionSampler", "Recorder"]

Array = NDArray[np.float64]

FUNCTIONS = ("transverse", "longitudinal", "density", "cross", "reverse")


class Recorder(Observer):
    """Python form, for development."""

    may_write = False

    def __init__(self, scene: Scene, vectors: list[Any], plan: Plan) -> None:
        super().__init__(every=plan.every)
        self._box = np.asarray(scene.box.lengths)
        self._count = scene.n_particles
        self._sizes = [len(group) for group in vectors]
        self._vectors = np.concatenate(vectors)
        self._plan = plan
        self._rows: list[Any] = []

    def sample(self, sim: Simulation) -> None:
        """Add the present state."""
        weights = np.concatenate([np.ones((self._count, 1)), sim.velocities], axis=1)
        self._rows.append(fourier_components(sim.positions, self._box, self._vectors, weights)[0])

    def functions(self) -> list[dict[str, Correlation]]:
        """The five functions of each wave number."""
        modes = np.array(self._rows) / self._count**0.5
        k = self._vectors / self._box
        unit = k / np.linalg.norm(k, axis=1)[:, None]
        rho, current = modes[..., 0], modes[..., 1:]
        along = np.einsum("tkc,kc->tk", current, unit)
        across = current - along[..., None] * unit
        plan = self._plan
        lags = min(int(plan.longest_lag / plan.dt / plan.every), len(modes) // plan.blocks - 1)
        found, start = [], 0
        for size in self._sizes:
            part = slice(start, start + size)
            start += size
            block = block_plan((len(modes), size), lags, max(plan.blocks, 2), "time")
            dt, others = plan.dt * plan.every, across.shape[2] - 1
            r, l, t = rho[:, part, None], along[:, part, None], across[:, part]
            sums = {
                "transverse": product_sums(t, t, block).real / others,
                "longitudinal": product_sums(l, l, block).real,
                "density": product_sums(r, r, block).real,
                "cross": product_sums(r, l, block).imag,
                "reverse": product_sums(l, r, block).imag,
            }
            found.append({name: assemble(s, block, dt, 1) for name, s in sums.items()})
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pairs:
    """Separations (P, D) and g = F/(d_i d_j) (P,) of the pairs within a support."""

    separation: Array
    friction: Array


class FrictionSampler(Observer):
    r"""Rates at which currents begin to decay by the friction among the particles where they are.

    At given positions -d<|j_k|^2>/dt = 2 lambda <|j_k|^2> exactly, by the dissipative forces alone:

    .. math:: \lambda(k) = \frac{2}{mN}\sum_{i<j} g_{ij}\,[a + b\,(e\cdot p)^2]\,
              (1 - \cos\mathbf k\cdot\mathbf r_{ij})

    with p across or along k.
    """

    may_write = False

    def __init__(self, scene: Scene, vectors: list[Any], *, every: int) -> None:
        super().__init__(every=every)
        self._scene = scene
        self._vectors = vectors
        self._rows: list[Array] = []

    @property
    def rates(self) -> Array:
        """Mean over the samples, shape (wave numbers, 2), across and along [1/time]."""
        return np.mean(self._rows, axis=0)

    def sample(self, sim: Simulation) -> None:
        """Add the present state."""
        pairs = self._pairs(sim)
        self._rows.append(np.array([self._rate(pairs, group) for group in self._vectors]))

    def _pairs(self, sim: Simulation) -> _Pairs:
        from scipy.spatial import cKDTree

        scene = self._scene
        box, h = np.asarray(scene.box.lengths), scene.support_radius
        folded = sim.positions - box * np.floor(sim.positions / box)
        folded = np.where(folded >= box, 0.0, folded)
        i, j = cKDTree(folded, boxsize=box).query_pairs(h, output_type="ndarray").T
        gap = folded[i] - folded[j]
        gap -= box * np.rint(gap / box)
        distance = np.linalg.norm(gap, axis=1)
        _, f = kernels.evaluate(scene.resolution.kernel, scene.dimension, distance, h)
        d = sim.number_densities
        return _Pairs(separation=gap, friction=f / (d[i] * d[j]))

    def _rate(self, pairs: _Pairs, group: Any) -> Array:
        scene = self._scene
        a, b, dimension = scene.friction_across, scene.friction_along, scene.dimension
        direction = pairs.separation**2 / np.sum(pairs.separation**2, axis=1)[:, None]
        total = np.zeros(2)
        for vector in group:
            k = 2.0 * np.pi * vector / np.asarray(scene.box.lengths)
            along = direction[:, int(np.flatnonzero(vector)[0])]
            wave = pairs.friction * 2.0 * np.sin(0.5 * (pairs.separation @ k)) ** 2
            side = (1.0 - along) / (dimension - 1)
            total += [wave @ (a + b * side), wave @ (a + b * along)]
        return 2.0 * total / (len(group) * scene.particle_mass * scene.n_particles)
