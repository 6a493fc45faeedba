r"""Viscosity of shear waves: their correlations in equilibrium, and how waves put in die away.

A wave u of velocities, added at once to an equilibrium, changes its probability by m/(kB T) sum
v.u to first order. What is left of it after a time t is therefore C(t)/C(0), C the autocorrelation
of the current sum v.u in equilibrium (Onsager's regression), whatever the fluid: a run that is
driven and one that is not must agree, at every lag and wave number, without any theory of stress.

Two copies of a run with the same noise get the wave with opposite signs; half their difference is
the answer without most of the noise. In fluids of strong friction they stay together for long.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import CurrentCorrelations, Estimate, allowed_wave_vectors, jackknife
from sdpd.analysis.fourier import shells
from sdpd.effects import Effects
from sdpd.errors import silenced
from sdpd.scene import Scene
from sdpd.viscosity.predictions import friction_theory
from sdpd.viscosity.transverse import decay_rate

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Response", "Waves"]

Array = NDArray[np.float64]

SHELLS = 3  # lengths of waves: 13 wave vectors of a cube
DECAYS = 1.5  # times in which friction alone damps a wave by e: lags of the viscosity
LATE_DECAYS = 30.0  # likewise, of the viscosity that waves have much later
SPEED = 0.05  # of a wave put in: root mean square of a component, in thermal speeds
LARGEST_GROWTH = 0.08  # of the viscosity from the first lags to the late ones, where there is one


@dataclass(frozen=True)
class Response:
    """What waves put in tell.

    Attributes
    ----------
    viscosity : Estimate
        Within `DECAYS` decay times [pressure x time].
    growth : Estimate
        Viscosity within `LATE_DECAYS` over it [1]; infinite where waves swing back, as in a solid.
    """

    viscosity: Estimate
    growth: Estimate

    @property
    def flows(self) -> bool:
        """Whether there is one viscosity, to `LARGEST_GROWTH`, and growth is known as well."""
        return bool(abs(self.growth.value - 1.0) + self.growth.stderr < LARGEST_GROWTH)


class Waves:
    """The shear waves of the longest three lengths of a cube, and their viscosity.

    Parameters
    ----------
    scene : Scene
        A periodic cube.
    dt : float
        Time step of the pair splitting [time].

    Attributes
    ----------
    vectors : ndarray of int, shape (K, 3)
    lag, late_lag : int
        Steps that the lags of the viscosity and of the late one reach to.
    """

    def __init__(self, scene: Scene, dt: float) -> None:
        box = np.asarray(scene.box.lengths)
        reach = math.sqrt(SHELLS) * 2.0 * np.pi / float(box.max()) * 1.001
        self.vectors = allowed_wave_vectors(box, reach)
        self._k: Array = 2.0 * np.pi * self.vectors / box
        # two unit vectors across each, (K, 2, 3)
        self._across: Array = np.stack([np.linalg.svd(k[None])[2][1:] for k in self._k])
        number, sizes = shells(np.linalg.norm(self._k, axis=1))
        self._shell = np.repeat(np.arange(len(sizes)), sizes)
        theory = friction_theory(scene.replace(effects=Effects()))
        self._rates: Array = theory.plane_wave_rates(number)[0]
        weight = sizes * self._rates  # independent samples of a run
        self._unit: Array = theory.shear_viscosity * weight / weight.sum() / self._rates
        self._scene, self._dt = scene, dt
        self.lag, self.late_lag = self._last(0, DECAYS), self._last(0, LATE_DECAYS)

    def _last(self, shell: int, decays: float) -> int:
        """Steps of so many decay times of a shell, two at least."""
        return max(2, math.ceil(decays / (float(self._rates[shell]) * self._dt)))

    def viscosity(self, functions: Sequence[Array], decays: float = DECAYS) -> float:
        """Mean viscosity of the shells [pressure x time].

        Each is the asked one times the decay rate over that of friction in a continuum of the same
        kernel, which knows that short waves feel less of it; inf where no decay has that sum.

        Parameters
        ----------
        functions : sequence of ndarray
            What is left of the waves of each shell at lags of whole steps from 0.
        decays : float
            Times of decay that lags reach to.
        """
        total = 0.0
        for shell, function in enumerate(functions):
            used = function[: self._last(shell, decays) + 1]
            try:
                rate = decay_rate(self._dt * np.arange(float(used.size)), used)
            except ValueError:
                return math.inf
            total += self._unit[shell] * rate
        return total

    def correlated(self, currents: Sequence[CurrentCorrelations]) -> tuple[Estimate, Estimate]:
        """Viscosity [pressure x time] and temperature of the waves in equilibrium.

        Parameters
        ----------
        currents : sequence of CurrentCorrelations
            At `vectors` and lags of whole steps, those of `lag` at least.
        """
        whole = [each.transverse.mean for each in currents]
        left = [each.transverse.leave_one_out() for each in currents]
        reach = (0.0, self.lag * self._dt)
        parts = list(zip(*left, strict=True))  # a block left out, every shell
        viscosity = _estimate([self.viscosity(p) for p in parts], self.viscosity(whole), reach)
        warm = _estimate([self._temperature(p) for p in parts], self._temperature(whole), reach)
        return viscosity, warm

    def _temperature(self, functions: Sequence[Array]) -> float:
        """Of the kinetic energy of the waves; shells by their number of independent samples."""
        unit = self._scene.particle_mass / self._scene.fluid.boltzmann_constant
        weight = self._unit * self._rates
        return float(weight @ [f[0] for f in functions]) / float(weight.sum()) * unit

    def put_in(
        self,
        *,
        starts: int,
        equilibration: int,
        seed: int,
        speed: float = SPEED,
        threads: int | None = None,
        tell: Callable[[int], object] | None = None,
    ) -> Response:
        """Put waves of random signs into a run of its own, again and again, and watch them die.

        Parameters
        ----------
        starts : int
            How often, >= 2.
        equilibration : int
            Steps before the first time.
        seed : int
        speed : float
            Root mean square of a component of the waves, in thermal speeds.
        threads : int, optional
        tell : callable, optional
            Hears of the steps done.
        """
        from sdpd.simulation import Simulation

        with silenced():
            pair = [Simulation(self._scene, dt=self._dt, seed=seed, threads=threads) for _ in "+-"]
        for sim in pair:  # both: noise goes with the number of the step
            sim.run(steps=equilibration, progress=False)
        random = np.random.default_rng([seed, 2])
        size = speed * self._scene.thermal_speed * math.sqrt(1.5 / len(self._k))
        rows = []
        for _ in range(starts):
            signs = random.choice((-size, size), size=(2, len(self._k), 2))
            rows.append(self._difference(pair, signs))
            if tell is not None:
                tell(2 * self.late_lag)
        table = np.stack(rows)  # starts, lags, shells
        whole = table.mean(axis=0)
        left = [(table.sum(axis=0) - row) / (starts - 1) for row in table]
        first, growth = self._read(whole)
        values = np.array([self._read(each) for each in left])
        reach = (0.0, self.lag * self._dt)
        late = (0.0, self.late_lag * self._dt)
        return Response(
            _estimate(values[:, 0], first, reach), _estimate(values[:, 1], growth, late)
        )

    def _read(self, table: Array) -> tuple[float, float]:
        """Viscosity, and the late one over it, of what is left of waves, (lags, shells)."""
        functions = list(table.T)
        first = self.viscosity(functions)
        late = self.viscosity(functions, LATE_DECAYS)
        return first, late / first if math.isfinite(first) else math.inf

    def _difference(self, pair: Sequence[Simulation], signs: Array) -> Array:
        """Half the difference of two copies along the waves put in, (lags, shells)."""
        base = pair[0]
        places, speeds, warmth = (
            x.copy() for x in (base.positions, base.velocities, base.temperatures)
        )
        wave = np.einsum("skp,snk,kpd->nd", signs, self._phases(places), self._across)
        for sim, sign in zip(pair, (1.0, -1.0), strict=True):
            sim.positions, sim.temperatures = places, warmth
            sim.velocities = speeds + sign * wave
        left = [self._along(pair, signs)]
        for _ in range(self.late_lag):
            for sim in pair:
                sim.run(steps=1, progress=False)
            left.append(self._along(pair, signs))
        return np.stack(left)

    def _along(self, pair: Sequence[Simulation], signs: Array) -> Array:
        """Present difference of the currents along the waves put in, by shell."""
        currents = [
            np.einsum("snk,nd->skd", self._phases(sim.positions), sim.velocities) for sim in pair
        ]
        parts = np.einsum("skp,skd,kpd->k", signs, currents[0] - currents[1], self._across)
        return np.asarray(np.bincount(self._shell, 0.5 * parts), dtype=np.float64)

    def _phases(self, positions: Array) -> Array:
        """Cosines and sines of k.r, shape (2, N, K)."""
        angle = positions @ self._k.T
        return np.stack([np.cos(angle), np.sin(angle)])


def _estimate(
    leave_one_out: Sequence[float] | Array, value: float, window: tuple[float, float]
) -> Estimate:
    """By the jackknife; without an error where a value is infinite."""
    if not np.isfinite([value, *leave_one_out]).all():
        return Estimate(math.inf, math.nan, len(leave_one_out), window)
    return Estimate(*jackknife(leave_one_out, value), len(leave_one_out), window)
