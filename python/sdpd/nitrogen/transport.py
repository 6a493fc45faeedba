"""Self-diffusion, viscosity and conductivity of a case, from the run that gives its variances.

The long-time coefficient follows from the displacements and the viscosity from the Helfand moment
of that run; the slope of the velocity autocorrelation from short stretches of small steps after it;
the conductivity from a wave of temperature that dies out on the lattice, and where particles move
also from the heat through a slab.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd import conductivity
from sdpd.analysis import Correlation, Estimate, einstein_diffusion, einstein_viscosity, ensemble
from sdpd.analysis.diffusion import short_time_diffusion
from sdpd.diffusion.collective import collective_theory
from sdpd.diffusion.measure import SLOPE_LAGS, normalized_vacf
from sdpd.effects import Effects
from sdpd.errors import SdpdWarning
from sdpd.scene import Scene
from sdpd.theory import ViscosityTheory
from sdpd.viscosity.arrangement import Arrangement
from sdpd.viscosity.lattice import measure_lattice
from sdpd.viscosity.predictions import viscosity_theory

if TYPE_CHECKING:
    from sdpd.observers import Correlator, StressCorrelator
    from sdpd.simulation import Simulation

__all__ = ["Recorder", "Transport"]

Array = NDArray[np.float64]

BLOCKS = 8  # of time, behind the errors of what needs long lags
SLOPE_STEP = 0.05  # of tau
SETTLING = 8  # of these steps before a stretch: longer ones leave stiff modes a little too hot
LONGEST = 0.04  # window of the Helfand moment, at most this share of the run
WEAK = 0.5  # loss by cages beyond which the mean-field estimate of it means nothing
DIFFERENCE = 0.3  # of temperature across the slab


@dataclass(frozen=True, kw_only=True)
class Transport:
    """Coefficients of a case; what is expected is nan where there is no theory.

    Attributes
    ----------
    short, exact : Estimate
        Short-time self-diffusion by the slope of the velocity autocorrelation, and by the friction
        on the particles as they lay, which is exact [m^2/s].
    long : Estimate
        By the mean-square displacement; ``window`` is the lags used [m^2/s].
    expected_long : float
        Mean-field estimate with cages and returning momentum, for weak cages [m^2/s].
    viscosity : Estimate
        By the Helfand moment; ``window`` is the lags used [Pa s].
    expected_viscosity : float
        Friction on the particles as they lay at the time step of the run, and the mean-field share
        of the pressure forces that builds up within the window [Pa s].
    unrelaxed : float
        Mean-field share that builds up beyond the window [Pa s].
    lattice_viscosity, lattice_conductivity : float
        Delivered on the undisturbed lattice at the time step of the run [Pa s], [W/(m K)].
    asked_viscosity, asked_conductivity : float
        Of the fluid [Pa s], [W/(m K)].
    expected_conductivity : float
        Of the sum over the lattice, at the same wavelength [W/(m K)].
    conductivity : Estimate or None
        By the heat through a slab, with noise [W/(m K)]; None for frozen particles.
    """

    short: Estimate
    exact: Estimate
    long: Estimate
    expected_long: float
    viscosity: Estimate
    expected_viscosity: float
    unrelaxed: float
    lattice_viscosity: float
    lattice_conductivity: float
    asked_viscosity: float
    asked_conductivity: float
    expected_conductivity: float
    conductivity: Estimate | None


class Recorder:
    """What the transport coefficients of a case need from its run of `steps` steps."""

    def __init__(self, scene: Scene, dt: float, steps: int) -> None:
        from sdpd.observers import Correlator, StressCorrelator

        self._scene, self._dt = scene, dt
        self._isothermal = scene.replace(effects=Effects())
        self._theory = _theory(self._isothermal, dt)
        longest = LONGEST * steps * dt
        if self._theory is not None:
            longest = min(longest, 2.0 * self._theory.relaxation_time())
        self._window = 0.5 * longest, longest
        every = max(1, round(longest / (62.0 * dt)))
        self.stress: StressCorrelator = StressCorrelator(
            every=every, points=64, levels=2, parts=True
        )
        levels = 1 + max(0, math.ceil(math.log2(steps / BLOCKS / 31.0)))  # to the end of a block
        self.motion: Correlator = Correlator(every=1, points=32, levels=levels)
        longest_wave = np.array([[1, 0, 0]])
        self._arrangement = Arrangement(self._isothermal, wave_vectors=longest_wave, dt=dt, every=1)
        self._long = 0.4 * steps * dt / BLOCKS, 0.9 * steps * dt / BLOCKS

    def look(self, sim: Simulation) -> None:
        """Note the friction on the particles as they lie, between stretches of the run."""
        self._arrangement.sample(sim)

    def slopes(self, sim: Simulation, stretches: int, steps: int) -> tuple[Estimate, Estimate]:
        """Short-time self-diffusion and its exact value; takes small steps, so it comes last."""
        tau = self._scene.friction_time
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SdpdWarning)
            sim.dt = min(SLOPE_STEP * tau, self._dt)
        rates, blocks = [], []
        for _ in range(stretches):
            sim.run(steps=SETTLING, progress=False)
            velocities = []
            for step in range(steps):
                if step % 8 == 0:
                    rates.append(sim.friction_rate())
                sim.run(steps=1, progress=False)
                velocities.append(sim.velocities.copy())
            blocks.append(normalized_vacf(np.stack(velocities), SLOPE_LAGS))
        table = np.stack(blocks)
        curve = Correlation(
            lag=sim.dt * np.arange(SLOPE_LAGS + 1.0),
            blocks=table,
            block_counts=np.ones_like(table),
            window=(0.0, SLOPE_LAGS * sim.dt),
        )
        # C(0) is (1 - 1/N) k_B T/m at zero total momentum, its slope is not diminished
        number, square = self._scene.n_particles, self._variance
        rate = short_time_diffusion(curve, n_lags=SLOPE_LAGS, order=1).rate
        measured = rate.scaled(1.0 - 1.0 / number).reciprocal(square)
        exact = ensemble([square / value for value in rates])
        return measured, exact

    @property
    def _variance(self) -> float:
        """k_B T/m [m^2/s^2]."""
        return self._scene.thermal_energy / self._scene.particle_mass

    def result(self, slopes: tuple[Estimate, Estimate], slab: Estimate | None) -> Transport:
        """Everything, after the run and after `slopes`."""
        scene, dt, theory = self._scene, self._dt, self._theory
        short, exact = slopes
        # the trapezoid of a step adds dt^2/12 times the slope of C to its integral
        bias = self._variance**2 / exact.value * dt**2 / 12.0
        msd = einstein_diffusion(self.motion.correlation("msd", n_blocks=BLOCKS), window=self._long)
        lattice = measure_lattice(self._isothermal, dt).factor.value
        viscosity = self._helfand()
        friction = self._arrangement.friction.value * lattice
        added = math.nan if theory is None else theory.configurational()
        middle = 0.5 * sum(self._window)
        left = math.nan if theory is None else float(theory.remaining(middle)) * added
        kinetic = 0.5 * scene.fluid.density * exact.value
        wave = conductivity.decay(scene, dt=dt)
        asked = scene.fluid.shear_viscosity
        return Transport(
            short=short,
            exact=exact,
            long=replace(msd, value=msd.value - bias),
            expected_long=_caged(self._isothermal),
            viscosity=viscosity,
            expected_viscosity=friction + added - left + kinetic,
            unrelaxed=left,
            lattice_viscosity=asked * scene.factors.viscosity * lattice,
            lattice_conductivity=wave.delivered,
            asked_viscosity=asked,
            asked_conductivity=wave.asked,
            expected_conductivity=wave.lattice,
            conductivity=slab,
        )

    def _helfand(self) -> Estimate:
        """Slope of the increments, the random part's own square replaced by its exact mean."""
        volume, energy = self.stress.volume, self._scene.thermal_energy
        whole = self.stress.increments(n_blocks=BLOCKS)
        noise = self.stress.increments(part="random", n_blocks=BLOCKS)
        exact = 2.0 * volume * energy * self._arrangement.random.value * whole.lag
        quiet = replace(whole, blocks=whole.blocks - noise.blocks + exact)
        start, stop = self._window[0], min(self._window[1], float(whole.lag[-1]))
        return einstein_viscosity(quiet, volume=volume, thermal_energy=energy, window=(start, stop))


def through_a_slab(scene: Scene, seed: int) -> Estimate:
    """The conductivity by the heat between plates of different temperatures."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SdpdWarning)
        return conductivity.imposed_gradient(
            scene, difference=DIFFERENCE, times=4.0, seed=seed, n_blocks=16
        )


def _theory(scene: Scene, dt: float) -> ViscosityTheory | None:
    """None beyond the pairing limit."""
    try:
        return viscosity_theory(scene, dt)
    except ValueError:
        return None


def _caged(scene: Scene) -> float:
    """Mean-field long-time self-diffusion where cages are weak, else nan."""
    try:
        theory = collective_theory(scene)
    except ValueError:
        return math.nan
    return theory.long if 0.0 <= theory.loss < WEAK else math.nan
