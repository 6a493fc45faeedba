"""Self-diffusion, viscosity and conductivity of a case, from the run that gives its variances.

The long-time coefficient follows from the displacements, viscosity and conductivity from the
Helfand moments of momentum and heat of that run; the slope of the velocity autocorrelation from
short stretches of small steps after it. Where the stress of pressure forces is known by no theory,
shear waves of the run are set beside shear waves that are put into another one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd import conductivity
from sdpd.analysis import Correlation, Estimate, einstein_diffusion, einstein_viscosity, ensemble
from sdpd.analysis.diffusion import short_time_diffusion
from sdpd.conductivity.study import CONDUCTION_ACCURACY
from sdpd.diffusion.collective import collective_theory
from sdpd.diffusion.measure import SLOPE_LAGS, normalized_vacf
from sdpd.effects import Effects
from sdpd.errors import silenced
from sdpd.nitrogen.cases import FROZEN
from sdpd.nitrogen.waves import Response, Waves
from sdpd.scene import Scene
from sdpd.theory import ViscosityTheory
from sdpd.viscosity.arrangement import Arrangement
from sdpd.viscosity.lattice import measure_lattice
from sdpd.viscosity.predictions import viscosity_theory

if TYPE_CHECKING:
    from sdpd.observers import Correlator, CurrentCorrelator, StressCorrelator
    from sdpd.observers.base import Observer
    from sdpd.simulation import Simulation

__all__ = ["Recorder", "Transport", "puts_waves_in"]

Array = NDArray[np.float64]

BLOCKS = 32  # of time, behind the errors of what is judged
LONG_BLOCKS = 8  # likewise of what needs long lags, at least
BLOCK_LAGS = 4  # their length in longest lags, where there are more
SLOPE_STEP = 0.05  # of tau
SETTLING = 8  # of these steps before a stretch: longer ones leave stiff modes a little too hot
STRESS_LAGS = (10, 20)  # steps: what longer lags add is ever less certain
DIFFUSION_LAGS = (64, 128)
LONGEST = 0.04  # long window of the Helfand moment, at most this share of the run
# Stiffness m c^2/kT up to which the mean field of cages is taken for known: it was tried near 100.
# Stiffer fluids have more stress: case 11 is 2.8 % of its viscosity above it within these lags, and
# cages take nearly half of its self-diffusion where mean field has a sixth. Waves judge those.
SOFT = 200.0
WEAK = 0.2  # loss of self-diffusion by cages, in mean field, up to which it is an estimate
ROUNDING = 1e-6  # of a lag: a window holds the lags it ends at
STRESS_ACCURACY = 1.0 / 3.0  # of the mean-field stress (sdpd.theory.ViscosityTheory)


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
        Mean-field estimate with cages and returning momentum, of soft fluids with weak cages
        [m^2/s].
    loss : float
        Of self-diffusion by cages, in mean field [1]; nan beyond the pairing limit.
    viscosity : Estimate
        By the Helfand moment; ``window`` is the lags used [Pa s].
    expected_viscosity, viscosity_accuracy : float
        Friction on the particles as they lay at the time step of the run, the mean-field share of
        the pressure forces that builds up within the window, and what particles carry; a third of
        the second [Pa s].
    stress_known : bool
        Whether that share has been tried for such fluids: soft ones.
    long_viscosity : Estimate
        By the Helfand moment at long lags: what the pressure forces add beyond the first window
        [Pa s].
    unrelaxed : float
        Mean-field share that builds up beyond the first window [Pa s].
    lattice_viscosity, lattice_conductivity : float
        Delivered on the undisturbed lattice at the time step of the run [Pa s], [W/(m K)].
    asked_viscosity, asked_conductivity : float
        Of the fluid [Pa s], [W/(m K)].
    lattice_sum : float
        Conductivity of the sum over the lattice, at the wavelength of `lattice_conductivity`.
    conductivity : Estimate
        By the Helfand moment of heat [W/(m K)].
    expected_conductivity, conductivity_accuracy : float
        Of the lattice at the time step, with what friction and motion carry; what disorder takes
        at most, and all that motion carries [W/(m K)].
    moved : float
        Mean-square displacement of the particles in the run, over dx^2 [1].
    wave, wave_temperature : Estimate or None
        Viscosity [Pa s] and temperature [K] of shear waves in equilibrium, of stiff particles.
    response : Response or None
        Viscosity of shear waves put into another run.
    """

    short: Estimate
    exact: Estimate
    long: Estimate
    expected_long: float
    loss: float
    viscosity: Estimate
    expected_viscosity: float
    viscosity_accuracy: float
    stress_known: bool
    long_viscosity: Estimate
    unrelaxed: float
    lattice_viscosity: float
    lattice_conductivity: float
    asked_viscosity: float
    asked_conductivity: float
    lattice_sum: float
    conductivity: Estimate
    expected_conductivity: float
    conductivity_accuracy: float
    moved: float
    wave: Estimate | None = None
    wave_temperature: Estimate | None = None
    response: Response | None = None

    @property
    def flows(self) -> bool:
        """Whether the waves put in show one viscosity, at first and twenty times later."""
        return self.response is not None and self.response.flows


class Recorder:
    """What the transport coefficients of a case need from its run of `steps` steps."""

    def __init__(self, scene: Scene, dt: float, steps: int) -> None:
        from sdpd.observers import Correlator, CurrentCorrelator, StressCorrelator

        self._scene, self._dt = scene, dt
        self._isothermal = scene.replace(effects=Effects())
        self._theory = _theory(self._isothermal, dt)
        first, last = (lag * dt for lag in STRESS_LAGS)
        self._steps = steps
        self._window = first * (1.0 - ROUNDING), last * (1.0 + ROUNDING)
        longest = max(LONGEST * steps * dt, last)
        if self._theory is not None:
            longest = max(min(longest, 2.0 * self._theory.relaxation_time()), last)
        self._late = 0.5 * longest, longest
        levels = 1 + max(0, math.ceil(math.log2(longest / dt / 31.0)))
        self._stress: StressCorrelator = StressCorrelator(
            every=1, points=32, levels=levels, parts=True
        )
        block = 0.9 * steps / self._motion_blocks  # lags end within a block
        first, last = (min(lag, block * lag / DIFFUSION_LAGS[1]) * dt for lag in DIFFUSION_LAGS)
        self._long = first * (1.0 - ROUNDING), last * (1.0 + ROUNDING)
        levels = 1 + max(0, math.ceil(math.log2(last / dt / 30.0)))
        self._motion: Correlator = Correlator(every=1, points=32, levels=levels)
        self._heat = conductivity.HeatMoment(scene, dt)
        self._waves = Waves(scene, dt) if puts_waves_in(scene) else None
        self._currents: CurrentCorrelator | None = None
        if self._waves is not None:
            points = 2 * (self._waves.lag // 2 + 1)
            self._currents = CurrentCorrelator(
                self._waves.vectors, every=1, points=points, levels=1
            )
        longest_wave = np.array([[1, 0, 0]])
        self._arrangement = Arrangement(scene, wave_vectors=longest_wave, dt=dt, every=1)

    @property
    def observers(self) -> list[Observer]:
        """Of the run."""
        waves = [] if self._currents is None else [self._currents]
        return [self._stress, self._motion, self._heat.observer, *waves]

    def begin(self, sim: Simulation) -> None:
        """Note where particles are as the run begins."""
        self._places = sim.unwrapped.copy()

    def end(self, sim: Simulation) -> None:
        """Note how far they have come."""
        way = sim.unwrapped - self._places
        way -= way.mean(axis=0)
        self._moved = float(np.square(way).sum(axis=1).mean()) / self._scene.spacing**2

    def answer(
        self,
        *,
        starts: int,
        equilibration: int,
        seed: int,
        threads: int | None,
        tell: Callable[[int], object] | None,
    ) -> Response | None:
        """Put waves into a run of its own; None where theory knows the stress."""
        if self._waves is None:
            return None
        return self._waves.put_in(
            starts=starts, equilibration=equilibration, seed=seed, threads=threads, tell=tell
        )

    def look(self, sim: Simulation) -> None:
        """Note the friction on the particles as they lie, between stretches of the run."""
        self._arrangement.sample(sim)

    def slopes(self, sim: Simulation, stretches: int, steps: int) -> tuple[Estimate, Estimate]:
        """Short-time self-diffusion and its exact value; takes small steps, so it comes last."""
        tau = self._scene.friction_time
        with silenced():
            sim.dt = min(SLOPE_STEP * tau, self._dt)
        rates, blocks = [], []
        for _ in range(stretches):
            sim.run(steps=SETTLING, progress=False)
            velocities, friction = [], []
            for step in range(steps):
                if step % 8 == 0:
                    friction.append(sim.friction_rate())
                sim.run(steps=1, progress=False)
                velocities.append(sim.velocities.copy())
            rates.append(float(np.mean(friction)))
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

    def result(
        self, slopes: tuple[Estimate, Estimate], temperature: float, response: Response | None
    ) -> Transport:
        """Everything, after the run and after `slopes`; `temperature` is the mean of the run."""
        scene, dt, theory = self._scene, self._dt, self._theory
        short, exact = slopes
        # the trapezoid of a step adds dt^2/12 times the slope of C to its integral
        bias = self._variance**2 / exact.value * dt**2 / 12.0
        curve = self._motion.correlation("msd", n_blocks=self._motion_blocks)
        msd = einstein_diffusion(curve, window=self._long)
        lattice = measure_lattice(self._isothermal, dt).factor.value
        friction = self._arrangement.friction.value * lattice
        added = math.nan if theory is None else theory.configurational()
        middle = 0.5 * sum(self._window)
        left = math.nan if theory is None else float(theory.remaining(middle)) * added
        kinetic = 0.5 * scene.fluid.density * exact.value
        caged, loss = _caged(self._isothermal)
        wave = conductivity.decay(scene, dt=dt)
        heat = conductivity.predict(scene, dt=dt)
        conduction = heat.conduction * wave.delivered / wave.lattice
        asked = scene.fluid.shear_viscosity
        wave_viscosity = warmth = None
        if self._waves is not None and self._currents is not None:
            blocks = self._blocks(self._waves.lag)
            wave_viscosity, warmth = self._waves.correlated(
                self._currents.correlations(n_blocks=blocks)
            )
        return Transport(
            short=short,
            exact=exact,
            long=replace(msd, value=msd.value - bias),
            expected_long=caged,
            loss=loss,
            viscosity=self._helfand(self._window, self._blocks(STRESS_LAGS[1])),
            expected_viscosity=friction + added - left + kinetic,
            viscosity_accuracy=STRESS_ACCURACY * (added - left),
            stress_known=scene.stiffness < SOFT,
            long_viscosity=self._helfand(self._late, LONG_BLOCKS),
            unrelaxed=left,
            lattice_viscosity=asked * scene.factors.viscosity * lattice,
            lattice_conductivity=wave.delivered,
            asked_viscosity=asked,
            asked_conductivity=wave.asked,
            lattice_sum=wave.lattice,
            conductivity=self._heat.slope(temperature, n_blocks=self._blocks(self._heat.steps)),
            expected_conductivity=conduction + heat.friction + heat.convection,
            conductivity_accuracy=CONDUCTION_ACCURACY[3] * conduction + heat.convection,
            moved=self._moved,
            wave=wave_viscosity,
            wave_temperature=warmth,
            response=response,
        )

    @property
    def _motion_blocks(self) -> int:
        return min(BLOCKS, max(LONG_BLOCKS, self._steps // (BLOCK_LAGS * DIFFUSION_LAGS[1])))

    def _blocks(self, lags: int) -> int:
        """Of time: each lasts twice the lags."""
        return max(2, min(BLOCKS, self._steps // (2 * lags)))

    def _helfand(self, window: tuple[float, float], blocks: int) -> Estimate:
        """Slope of the increments, the random part's own square replaced by its exact mean."""
        volume, energy = self._stress.volume, self._scene.thermal_energy
        whole = self._stress.increments(n_blocks=blocks)
        noise = self._stress.increments(part="random", n_blocks=blocks)
        exact = 2.0 * volume * energy * self._arrangement.random.value * whole.lag
        quiet = replace(whole, blocks=whole.blocks - noise.blocks + exact)
        start, stop = window[0], min(window[1], float(whole.lag[-1]))
        return einstein_viscosity(quiet, volume=volume, thermal_energy=energy, window=(start, stop))


def puts_waves_in(scene: Scene) -> bool:
    """Whether particles move, and no theory knows their stress."""
    return SOFT <= scene.stiffness < FROZEN


def _theory(scene: Scene, dt: float) -> ViscosityTheory | None:
    """None beyond the pairing limit."""
    try:
        return viscosity_theory(scene, dt)
    except ValueError:
        return None


def _caged(scene: Scene) -> tuple[float, float]:
    """Mean-field long-time self-diffusion of soft fluids with weak cages, else nan; their loss."""
    try:
        theory = collective_theory(scene)
    except ValueError:
        return math.nan, math.nan
    known = 0.0 <= theory.loss < WEAK and scene.stiffness < SOFT
    return theory.long if known else math.nan, theory.loss
