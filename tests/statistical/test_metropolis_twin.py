"""Positions at equilibrium, sharply: a Metropolis sampler in NumPy, and the hypervirial identity.

The twin samples exp(-U/kT) of U = sum_i u(d_i) at N of about 200. Its proposals are short leapfrog
trajectories from fresh Maxwellian velocities, accepted with min(1, exp(-dH/kT)) (Duane, Kennedy,
Pendleton and Roweth, Phys. Lett. B 195, 216 (1987)): exact whatever the step, and even for wrong
forces, so that only U matters. It begins on a lattice, the core at random positions.

The hypervirial (Yvon) identity <|grad U|^2> = kT <lap U> needs no second sampler.

Reduced units m = dx = kT = 1, X = c^2 = 100. Potentials by integrating u' = P/d^2:

    P = X d             u = X ln d                 u'' = -X/d^2
    P = X (d^2 - 1)/2   u = X/2 (d + 1/d)          u'' = X/d^3

With F = -W'/r: grad_i d_i = -sum_j F r_ij, lap W = -D F - r F', and

    lap U = sum_i { u''_i [|sum_j F r_ij|^2 + sum_j (r F)^2] + 2 u'_i sum_j lap W }.

The core runs at 0.08 of the acoustic limit. A mode of frequency w is then larger by
1/(1 - w^2 dt^2/4) in variance, at most 0.64 %: 0.4 % of the density's variance, a fraction of its
error here; the identity is tested against that interval.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

import sdpd
from sdpd import timestep

Array = NDArray[np.float64]
Index = NDArray[np.intp]

X = 100.0
BLOCKS = 32
MEMBERS = 16
LARGEST_T = float(stats.t.isf(0.5 * 0.01 / MEMBERS, BLOCKS - 1))
FAULT = 0.02
STEP = 0.08  # of the acoustic limit
SAMPLES_CORE, EVERY_CORE = {2: 40, 3: 25}, 6  # a block; steps between them
SAMPLES_TWIN, WARM_UP = 10, 60  # trajectories
NAMES = ("energy", "energy_square", "density", "density_square", "force_square", "laplacian")


class Case(NamedTuple):
    dimension: int
    edge: int
    support: float
    kernel: str
    law: sdpd.eos.EquationOfState


CASES = {
    "3d-lucy-ideal-gas": Case(3, 6, 2.65, "lucy", sdpd.eos.IdealGas()),
    "2d-wendland-artificial": Case(
        2, 14, 2.65, "wendland_c2", sdpd.eos.ArtificialCompressibility()
    ),
}
every_case = pytest.mark.parametrize("case", list(CASES))


class Potential:
    """U and its derivatives from the equations above, all pairs, minimum image."""

    def __init__(self, case: Case) -> None:
        self.case, self.size = case, case.edge**case.dimension
        self.first, self.second = np.triu_indices(self.size, 1)

    def _kernel(self, r: Array) -> tuple[Array, Array, Array, float]:
        """W, F and F' of pairs, and W(0)."""
        h, three = self.case.support, self.case.dimension == 3
        q = r / h
        if self.case.kernel == "lucy":
            top = (105.0 / (16.0 * np.pi) if three else 5.0 / np.pi) / h**self.case.dimension
            gap = 1.0 - q
            scale = 12.0 * top / h**2
            return top * (1 + 3 * q) * gap**3, scale * gap**2, -2.0 * scale / h * gap, top
        top = (21.0 / (2.0 * np.pi) if three else 7.0 / np.pi) / h**self.case.dimension
        gap = 1.0 - q
        scale = 20.0 * top / h**2
        return top * (1 + 4 * q) * gap**4, scale * gap**3, -3.0 * scale / h * gap**2, top

    def _law(self, d: Array) -> tuple[Array, Array, Array]:
        """u, u' and u''."""
        if isinstance(self.case.law, sdpd.eos.IdealGas):
            return X * np.log(d), X / d, -X / d**2
        return 0.5 * X * (d + 1.0 / d), 0.5 * X * (1.0 - d**-2), X / d**3

    def evaluate(self, r: Array) -> tuple[float, Array, Array]:
        """U, the forces (N, D) and the densities (N,)."""
        i, j, gap = self._pairs(r)
        w, f, _, own = self._kernel(np.sqrt(np.sum(gap**2, axis=1)))
        d = own + self._sums(i, j, w)
        energy, first, _ = self._law(d)
        push = ((first[i] + first[j]) * f)[:, None] * gap
        force = np.stack([self._sums(i, j, column, -1.0) for column in push.T], axis=1)
        return float(energy.sum()), force, d

    def laplacian(self, r: Array, d: Array) -> float:
        """Laplacian of U over all coordinates; d are the densities there."""
        i, j, gap = self._pairs(r)
        distance = np.sqrt(np.sum(gap**2, axis=1))
        _, f, slope, _ = self._kernel(distance)
        _, first, second = self._law(d)
        gradient = self._sums(i, j, (f * distance) ** 2)
        for column in gap.T:
            gradient += self._sums(i, j, f * column, -1.0) ** 2
        curvature = self._sums(i, j, -r.shape[1] * f - distance * slope)
        return float(second @ gradient + 2.0 * (first @ curvature))

    def _sums(self, i: Index, j: Index, value: Array, sign: float = 1.0) -> Array:
        """Sum over the pairs of each particle; sign is that of the second one."""
        return np.bincount(i, value, self.size) + sign * np.bincount(j, value, self.size)

    def _pairs(self, r: Array) -> tuple[Index, Index, Array]:
        gap = r[self.first] - r[self.second]
        gap -= self.case.edge * np.rint(gap / self.case.edge)
        near = np.einsum("pd,pd->p", gap, gap) < self.case.support**2
        return self.first[near], self.second[near], gap[near]


class Moments(NamedTuple):
    """Block means (B, 6) of the columns in NAMES, per particle but for the squared energy."""

    table: Array
    acceptance: float = 1.0

    def estimates(self) -> dict[str, tuple[float, float]]:
        """Value and standard error of each compared quantity."""
        column = dict(zip(NAMES, self.table.T, strict=True))
        energy, density = column["energy"], column["density"]
        rows = {
            "mean energy": energy,
            "variance of the energy": _spread(column["energy_square"], energy),
            "mean density": density,
            "variance of the density": _spread(column["density_square"], density),
            "mean squared force": column["force_square"],
            "hypervirial ratio": column["force_square"] / column["laplacian"],
        }
        root = np.sqrt(BLOCKS)
        return {name: (row.mean(), row.std(ddof=1) / root) for name, row in rows.items()}


def _spread(square: Array, mean: Array) -> Array:
    """Mean squared deviation from the mean of all blocks, block by block."""
    middle = mean.mean()
    return square - 2.0 * middle * mean + middle**2


def _row(energy: float, force: Array, d: Array, laplacian: float, rest: float) -> list[float]:
    size = d.size
    shifted = (energy - rest) / np.sqrt(size)  # its variance is of order one
    return [
        shifted,
        shifted**2,
        float(d.mean()),
        float(np.mean(d**2)),
        float(np.sum(force**2)) / size,
        laplacian / size,
    ]


@functools.cache
def rest_energy(case: str) -> float:
    """U on the lattice, which both sides take off."""
    return Potential(CASES[case]).evaluate(lattice(CASES[case]))[0]


def lattice(case: Case) -> Array:
    index = np.indices((case.edge,) * case.dimension).reshape(case.dimension, -1).T
    return index + 0.5


def scene(case: Case) -> sdpd.Scene:
    return sdpd.Scene(
        fluid=sdpd.Fluid(
            density=1.0,
            shear_viscosity=2.5,  # low, lest cages outlive a block
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=case.law,
        ),
        box=sdpd.Box((float(case.edge),) * case.dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel=case.kernel, support=case.support),
        sound_speed=np.sqrt(X),
        start=sdpd.RandomStart(),
    )


@functools.cache
def sampled_by_core(case: str) -> Moments:
    """The core's equilibrium; U, forces and densities are its own, lap U is the twin's."""
    chosen = scene(CASES[case])
    step = STEP * timestep.acoustic_limit(chosen)
    sim = sdpd.Simulation(chosen, integrator="pair_splitting", dt=step, seed=21, threads=1)
    potential = Potential(CASES[case])
    sim.run(steps=600, progress=False)
    rows = []
    for _ in range(BLOCKS * SAMPLES_CORE[chosen.dimension]):
        sim.run(steps=EVERY_CORE, progress=False)
        d = sim.number_densities
        laplacian = potential.laplacian(sim.positions, d)
        rows.append(_row(sim.potential_energy, sim.forces, d, laplacian, rest_energy(case)))
    return Moments(_blocks(rows))


@functools.cache
def sampled_by_metropolis(case: str) -> Moments:
    chosen = CASES[case]
    potential, random = Potential(chosen), np.random.default_rng(5)
    step = 0.3 * timestep.acoustic_limit(scene(chosen))
    r = lattice(chosen) + random.uniform(-0.2, 0.2, (potential.size, chosen.dimension))
    here = potential.evaluate(r)
    rows, accepted = [], 0
    for trajectory in range(WARM_UP + BLOCKS * SAMPLES_TWIN):
        v = random.standard_normal(r.shape)
        there, place, kinetic = here, r, 0.5 * np.sum(v**2)
        for _ in range(random.integers(6, 13)):  # random, lest a mode return to its start
            v = v + 0.5 * step * there[1]
            place = place + step * v
            there = potential.evaluate(place)
            v = v + 0.5 * step * there[1]
        change = there[0] - here[0] + 0.5 * np.sum(v**2) - kinetic
        if random.random() < np.exp(-change):
            r, here = place, there
            accepted += trajectory >= WARM_UP
        if trajectory >= WARM_UP:
            rows.append(_row(*here, potential.laplacian(r, here[2]), rest_energy(case)))
    return Moments(_blocks(rows), accepted / len(rows))


def _blocks(rows: list[list[float]]) -> Array:
    return np.array(rows).reshape(BLOCKS, -1, len(NAMES)).mean(axis=1)


@every_case
def test_core_evaluates_the_same_potential(case: str) -> None:
    """U, forces and densities at one disordered configuration, and lap U by differences."""
    chosen = CASES[case]
    random = np.random.default_rng(1)
    r = lattice(chosen) + random.uniform(-0.3, 0.3, (chosen.edge**chosen.dimension, 1))
    r = r + random.uniform(-0.2, 0.2, r.shape)
    sim = sdpd.Simulation(scene(chosen), dt=1e-3, seed=1, threads=1, positions=r % chosen.edge)
    potential = Potential(chosen)
    energy, force, d = potential.evaluate(r)
    np.testing.assert_allclose(sim.number_densities, d, rtol=1e-12)
    np.testing.assert_allclose(sim.forces, force, rtol=1e-9, atol=1e-9)
    assert sim.potential_energy == pytest.approx(energy, rel=1e-9)
    total, step = 0.0, 1e-6
    for n, axis in np.ndindex(r.shape):
        moved = r.copy()
        moved[n, axis] += step
        total -= (potential.evaluate(moved)[1][n, axis] - force[n, axis]) / step
    assert potential.laplacian(r, d) == pytest.approx(total, rel=1e-5)


@every_case
def test_core_and_metropolis_agree(case: str) -> None:
    """Mean and variance of energy and density, by Welch's t."""
    core, twin = sampled_by_core(case).estimates(), sampled_by_metropolis(case)
    assert 0.5 < twin.acceptance < 0.99
    theirs = twin.estimates()
    wrong = []
    for name, (value, error) in core.items():
        other, its = theirs[name]
        t = (value - other) / np.hypot(error, its)
        if abs(t) > LARGEST_T:
            wrong.append(
                f"{name}: {value:.6g} +- {error:.2g}, twin {other:.6g} +- {its:.2g}, {t=:.1f}"
            )
    assert not wrong, "\n".join(wrong)


@every_case
def test_errors_of_the_comparison_are_small(case: str) -> None:
    """What would be seen: 2 % of the mean energy, of the mean density's excess and so on."""
    core, twin = sampled_by_core(case).estimates(), sampled_by_metropolis(case).estimates()
    relative = {name: np.hypot(core[name][1], twin[name][1]) / abs(core[name][0]) for name in core}
    assert relative["mean density"] < FAULT / 20.0
    assert relative["mean energy"] < FAULT
    assert relative["variance of the density"] < 1.5 * FAULT
    assert relative["mean squared force"] < FAULT
    assert relative["variance of the energy"] < 0.2


@pytest.mark.parametrize("sampler", [sampled_by_core, sampled_by_metropolis])
def test_hypervirial_identity(sampler: Callable[[str], Moments]) -> None:
    """<|grad U|^2> = kT <lap U> in each case and over both; the core at its known step."""
    highest = 1.0 / (1.0 - STEP**2) if sampler is sampled_by_core else 1.0
    found = [sampler(case).estimates()["hypervirial ratio"] for case in CASES]
    values, errors = np.array(found).T
    overall = (float(values.mean()), float(np.sqrt(np.sum(errors**2)) / errors.size))
    for value, error in [*found, overall]:
        beyond = max(0.0, value - highest) + min(0.0, value - 1.0)
        assert abs(beyond) < LARGEST_T * error, f"{value:.4f} +- {error:.4f}"
    if sampler is sampled_by_core:
        assert overall[1] < FAULT / 2.5, "too few samples to see a fault of 2 %"
