r"""Temperatures, entropies and pressures of a fluid with an energy beside their predictions.

Temperatures are exact (:class:`sdpd.theory.EnergyShell`) and do not know the density, so that to
first order, with b = m (dP/dT)_rho/(rho kB) at the mean density of the particles, k = C/kB, v the
variance of the kernel density over n^2 and What the transform of the kernel

    Var S_i/kB^2          = k^2 psi'(k) + b^2 v
    Var P_i/(rho c_T^2)^2 = v + (b/X)^2 (1 + v) Var T_i/T^2
    <|S_k|^2>/(N kB^2)    = k^2 psi'(k) + b^2 What^2 S(k)
    <|P_k|^2>/N           = What^2 S(k) + (b/X)^2 Var T_i/T^2        over (rho c_T^2)^2.

As k -> 0 the waves are those of Landau and Lifshitz, kB C_p and rho c_S^2 kB T/V: the kernel takes
its share of the density from what single particles show. Short waves are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd.analysis import ensemble
from sdpd.fluctuations.energy_sums import EnergySums
from sdpd.fluctuations.item import SHELLS, Item
from sdpd.fluctuations.predictions import DensityPrediction
from sdpd.fluctuations.sampler import Sampler
from sdpd.scene import Scene
from sdpd.theory import kernel_transform

__all__ = ["EnergyPrediction", "energy_items"]

Array = NDArray[np.float64]

ROUGHEST = 0.25  # waves that are compared, but for the longest


class EnergyPrediction:
    """Entropies and pressures of a scene, as the particles carry them.

    Parameters
    ----------
    scene : Scene
        With an energy.
    density : DensityPrediction
        At the temperature and the time step of the run.

    Attributes
    ----------
    coupling : float
        b = m (dP/dT)_rho/(rho kB) [1]: R m/kB of an ideal gas.
    stiffness : float
        X at this temperature [1].
    """

    def __init__(self, scene: Scene, density: DensityPrediction) -> None:
        self._scene, self._density = scene, density
        self._shell = EnergySums(scene, np.zeros(2)).shell
        mean = 1.0 + density.bias
        unit = scene.particle_mass / (scene.fluid.boltzmann_constant * scene.fluid.density)
        self._hot = density.pressure_coefficient(mean) * unit
        self.coupling = self._hot / mean
        self.stiffness = density.stiffness
        self._scale = (density.warmth * self.stiffness / scene.stiffness) ** 2

    @property
    def heat_ratio(self) -> float:
        """gamma of the particles' own equation of state, without their motion [1]."""
        return 1.0 + self.coupling**2 / (self._shell.heat_capacity * self.stiffness)

    @property
    def _disorder(self) -> float:
        shell = self._shell
        log = shell.logarithmic_variance - shell.logarithmic_covariance
        return shell.heat_capacity**2 * log

    @property
    def _warm(self) -> float:
        shell = self._shell
        return (self._hot / self.stiffness) ** 2 * (shell.variance - shell.covariance)

    @property
    def entropy_variance(self) -> float:
        """Var S_i/kB^2, of one particle against the others [1]."""
        return self._disorder + self.coupling**2 * self._density.variance

    @property
    def pressure_variance(self) -> float:
        """Var P_i/(rho c^2)^2 with c of the scene [1]."""
        v = self._density.variance
        return self._scale * (v + self._warm * (1.0 + v))

    def density_share(self, name: str) -> float:
        """Part of the variance of a particle's "entropy" or "pressure" by its density [1]."""
        v = self._density.variance
        if name == "entropy":
            return self.coupling**2 * v / self.entropy_variance
        return self._scale * v * (1.0 + self._warm) / self.pressure_variance

    def roughness(self, wave_number: ArrayLike) -> Array:
        """What single particles show of the density over what a wave of it does [1].

        The density at a particle knows where the others are: a term of second order, that of short
        waves.
        """
        return np.asarray(self._density.variance / self._smooth(wave_number))

    def entropy_modes(self, wave_number: ArrayLike) -> Array:
        """<|S_k|^2>/(N kB^2) at wave numbers [1/length]."""
        return self._disorder + self.coupling**2 * self._smooth(wave_number)

    def pressure_modes(self, wave_number: ArrayLike) -> Array:
        """<|P_k|^2>/N over (rho c^2)^2 at wave numbers [1/length]."""
        return np.asarray(self._scale * (self._smooth(wave_number) + self._warm))

    def _smooth(self, wave_number: ArrayLike) -> Array:
        scene, k = self._scene, np.asarray(wave_number, dtype=np.float64)
        transform = kernel_transform(
            scene.resolution.kernel, scene.dimension, k * scene.support_radius
        )
        return np.asarray(transform**2 * self._density.structure_factor(k))


def energy_items(
    scene: Scene, sampler: Sampler, density: DensityPrediction | None
) -> Iterator[Item]:
    """All items of the energies; without `density` those that do not know it."""
    assert sampler.energy is not None
    shell, table = sampler.energy.shell, sampler.table
    k, means = shell.heat_capacity, table["energies"]
    group = "temperature of particles"
    yield Item(
        group=group,
        name="mean over that of the shell",
        estimate=ensemble(means[:, 0]),
        prediction=1.0,
    )
    yield Item(
        group=group,
        name="variance over T^2 kB/C, shell",
        estimate=ensemble(k * means[:, 1]),
        prediction=k * shell.variance,
    )
    yield Item(
        group=group,
        name="correlation with the density",
        estimate=ensemble(means[:, 4]),
        prediction=0.0,
        unit=1.0,
        accuracy=0.0 if density is None else _step_share(scene, density),
    )
    yield from _in_space(scene, sampler)
    weight = sampler.n_vectors / sampler.n_vectors.sum()
    yield from _modes(sampler, "temperature_modes", "temperature modes", weight)
    yield Item(
        group="temperature modes",
        name="<rho_k* T_k> over both deviations, all k",
        estimate=ensemble(table["density_temperature"] @ weight),
        prediction=0.0,
        unit=1.0,
    )
    for parts in sampler.divisions:
        yield Item(
            group="temperature of cells",
            name=f"variance over T^2 kB/(C N_c), shell, cells L/{parts}",
            estimate=ensemble(table[f"warm_cells_{parts}"][:, 0]),
            prediction=1.0,
        )
    if density is not None:
        yield from _entropies(sampler, EnergyPrediction(scene, density), density, weight)


def _step_share(scene: Scene, density: DensityPrediction) -> float:
    """What a step may make of that correlation: it pulls pressures, not densities, along."""
    return density.step_error * math.sqrt((scene.adiabatic_ratio - 1.0) / scene.pairs_per_particle)


def _in_space(scene: Scene, sampler: Sampler) -> Iterator[Item]:
    assert sampler.energy is not None
    shell, table = sampler.energy.shell, sampler.table
    sums, counts = table["warm_pairs"], table["pairs"][:, 1]
    edges = sampler.distance_edges / scene.support_radius
    for bin_ in range(edges.size - 1):
        if counts[:, bin_].all():
            yield Item(
                group="temperature in space",
                name=f"<dT_i dT_j> C/kB T^2, r/h {edges[bin_]:.1f} to {edges[bin_ + 1]:.1f}",
                estimate=ensemble(sums[:, bin_] / counts[:, bin_]),
                prediction=shell.heat_capacity * shell.covariance,
                unit=1.0,
            )


def _modes(sampler: Sampler, key: str, group: str, weight: Array) -> Iterator[Item]:
    rows = sampler.table[key]
    total = f"<|T_k|^2> C/(kB T^2 N), shell, all {sampler.n_vectors.sum()} k"
    yield Item(group=group, name=total, estimate=ensemble(rows @ weight), prediction=1.0)
    for k in range(min(SHELLS, sampler.n_vectors.size)):
        name = f"k = {sampler.reduced_wave_number[k]:.3f} x 2 pi/L"
        yield Item(group=group, name=name, estimate=ensemble(rows[:, k]), prediction=1.0)


def _entropies(
    sampler: Sampler, theory: EnergyPrediction, density: DensityPrediction, weight: Array
) -> Iterator[Item]:
    table, k = sampler.table, sampler.wave_number
    means, excess = table["energies"], abs(density.bias)
    long = (k == k[0]) | (theory.roughness(k) < ROUGHEST)
    cases = (
        ("entropy", 2, theory.entropy_variance, theory.entropy_modes(k), "kB^2"),
        ("pressure", 3, theory.pressure_variance, theory.pressure_modes(k), "(rho c^2)^2"),
    )
    for name, column, variance, modes, unit in cases:
        share = theory.density_share(name) * density.accuracy("variance") + excess
        yield Item(
            group=f"{name} of particles",
            name=f"variance over {unit}",
            estimate=ensemble(means[:, column]),
            prediction=variance,
            accuracy=share * variance,
        )
        share = density.accuracy("structure") + excess + 0.5 * theory.roughness(k[long]).max()
        some = weight * long / weight[long].sum()
        yield Item(
            group=f"{name} modes",
            name=f"over mean field, {sampler.n_vectors[long].sum()} k",
            estimate=ensemble(table[f"{name}_modes"] / modes @ some),
            prediction=1.0,
            accuracy=share,
        )
        share = density.accuracy("structure") + excess + 0.5 * theory.roughness(k[:1])[0]
        yield Item(
            group=f"{name} modes",
            name=f"over {unit} N, longest wave",
            estimate=ensemble(table[f"{name}_modes"][:, 0]),
            prediction=float(modes[0]),
            accuracy=share * float(modes[0]),
        )
