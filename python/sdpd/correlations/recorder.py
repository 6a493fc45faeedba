"""What watches one run of the ensemble: the correlator of waves, and the friction in place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd import kernels
from sdpd.observers import CurrentCorrelator, Observer

if TYPE_CHECKING:
    from sdpd.analysis import Correlation
    from sdpd.correlations.plan import Plan
    from sdpd.scene import Scene
    from sdpd.simulation import Simulation

__all__ = [
    "ENERGY_FUNCTIONS",
    "FUNCTIONS",
    "FrictionSampler",
    "correlator",
    "function_names",
    "functions",
]

Array = NDArray[np.float64]

FUNCTIONS = ("transverse", "longitudinal", "density", "cross", "reversed_cross")
ENERGY_FUNCTIONS = ("energy", "density_energy", "energy_current")


def function_names(scene: Scene) -> tuple[str, ...]:
    """Functions of a scene: three more where its fluid has an energy."""
    return FUNCTIONS + (ENERGY_FUNCTIONS if scene.active_effects.energy else ())


def correlator(vectors: Sequence[NDArray[np.int64]], plan: Plan) -> CurrentCorrelator:
    """Observer of the wave vectors of all wave numbers."""
    return CurrentCorrelator(
        np.concatenate(vectors), every=plan.every, points=plan.points, levels=plan.levels
    )


def functions(
    recorded: CurrentCorrelator, plan: Plan, names: Sequence[str] = FUNCTIONS
) -> list[dict[str, Correlation]]:
    """The functions of each wave number, ascending."""
    shells = recorded.correlations(n_blocks=plan.blocks)
    return [{name: getattr(shell, name) for name in names} for shell in shells]


def heat_coefficient(scene: Scene) -> float:
    """2 m [kappa + kB (D a + b)/(4 m)]/(C + D kB/2): what takes the place of a friction in q."""
    boltzmann, mass = scene.fluid.boltzmann_constant, scene.particle_mass
    whole = boltzmann * (scene.heat_capacity_number + 0.5 * scene.dimension)
    return 2.0 * mass * (scene.conductivity + friction_conductivity(scene)) / whole


def friction_conductivity(scene: Scene) -> float:
    """Heat conductivity by friction, kB (D a + b)/(4 m) [energy/(time temperature length^(D-2))].

    Friction with a neighbour takes kinetic energy from one particle and heats both.
    """
    trace = scene.dimension * scene.friction_across + scene.friction_along
    return scene.fluid.boltzmann_constant * trace / (4.0 * scene.particle_mass)


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

    with p across or along k. The wave of the energies of a fluid with an energy begins to decay by
    conduction, and by friction, which hands kinetic energy on to the neighbours:

    .. math:: q(k) = \frac{4\,[\kappa + k_B(Da + b)/4m]}{(C + \tfrac D2k_B)\,N}
              \sum_{i<j} g_{ij}\,(1 - \cos\mathbf k\cdot\mathbf r_{ij})
    """

    may_write = False

    def __init__(self, scene: Scene, vectors: Sequence[NDArray[np.int64]], *, every: int) -> None:
        super().__init__(every=every)
        self._scene = scene
        self._vectors = vectors
        self._rows: list[Array] = []

    @property
    def rates(self) -> Array:
        """Mean over the samples, (wave numbers, 2 or 3): across, along, energy [1/time]."""
        return np.asarray(np.mean(self._rows, axis=0))

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

    def _rate(self, pairs: _Pairs, group: NDArray[np.int64]) -> Array:
        scene = self._scene
        a, b, dimension = scene.friction_across, scene.friction_along, scene.dimension
        direction = pairs.separation**2 / np.sum(pairs.separation**2, axis=1)[:, None]
        heat = heat_coefficient(scene) if scene.active_effects.energy else None
        total = np.zeros(2 if heat is None else 3)
        for vector in group:
            k = 2.0 * np.pi * vector / np.asarray(scene.box.lengths)
            along = direction[:, int(np.flatnonzero(vector)[0])]
            wave = pairs.friction * 2.0 * np.sin(0.5 * (pairs.separation @ k)) ** 2
            side = (1.0 - along) / (dimension - 1)
            total[:2] += [wave @ (a + b * side), wave @ (a + b * along)]
            if heat is not None:
                total[2] += heat * float(wave.sum())
        return 2.0 * total / (len(group) * scene.particle_mass * scene.n_particles)
