"""Conductivity of a fluid in equilibrium, from the fluctuations of its current of heat."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sdpd import validation
from sdpd.analysis import (
    Correlation,
    Estimate,
    block_average,
    einstein_conductivity,
    green_kubo_conductivity,
    running_conductivity,
)
from sdpd.conductivity.lattice import check_conduction, scene_step
from sdpd.scene import Scene
from sdpd.viscosity.plan import sample_scene

if TYPE_CHECKING:
    from sdpd.observers import HeatCurrentCorrelator
    from sdpd.simulation import Simulation

__all__ = ["Equilibrium", "HeatMoment", "equilibrium"]

BLOCKS = 32
PARTS = ("total", "conduction", "friction", "pressure", "convection")
PAIRS = 3e8  # pairs visited; some 50 s of one ordinary core
SETTLE = 600  # steps before the first sample
MEMORIES = 8.0  # until the slope is that of slow flow
THERMAL = 0.5  # but no less than so many conduction times
SAMPLES = 6  # up to the first lag of the window


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """Conductivities from one run in equilibrium [energy/(time temperature length^(D-2))].

    Attributes
    ----------
    helfand : Estimate
        From the slope of the Helfand moment; ``window`` is the lags fitted.
    green_kubo : Estimate
        From the sum over the autocorrelation of the flux up to the end of that window: the same
        data, not a way of its own.
    shares : dict of Estimate
        Helfand slopes of conduction, friction, pressure and convection alone. Parts are correlated:
        the rest to `helfand` are their cross correlations.
    noise : Estimate
        What the noise alone makes, delta-correlated in time.
    increments : dict of Correlation
        Of the Helfand moment, in all and by part [(energy length)^2].
    running : Correlation
        Green-Kubo sum against its cut-off.
    temperature : Estimate
        Mean over the run [temperature].
    asked : float
        Of the fluid.
    dt : float
        [time].
    steps : int
    sample : Scene
        What was run.
    """

    helfand: Estimate
    green_kubo: Estimate
    shares: dict[str, Estimate]
    noise: Estimate
    increments: dict[str, Correlation]
    running: Correlation
    temperature: Estimate
    asked: float
    dt: float
    steps: int
    sample: Scene

    @property
    def helfand_blocks(self) -> int:
        """Blocks of time behind the errors."""
        return self.increments["total"].n_blocks

    @property
    def unit(self) -> float:
        """2 V k_B T^2: what increments are divided by, and by the lag, to be a conductivity."""
        scene, t = self.sample, self.temperature.value
        return 2.0 * scene.box.volume * scene.fluid.boltzmann_constant * t * t


class HeatMoment:
    """The Helfand moment of heat of a run in equilibrium, and its slope.

    Parameters
    ----------
    scene : Scene
    dt : float
        Of the run [time].
    window : tuple of float, optional
        First and last lag of the fit [time]; as for `equilibrium` if None.

    Attributes
    ----------
    observer : HeatCurrentCorrelator
        For the run.
    window : tuple of float
        [time].
    steps : int
        Which the lags span.
    """

    def __init__(self, scene: Scene, dt: float, window: tuple[float, float] | None = None) -> None:
        from sdpd.observers import HeatCurrentCorrelator

        self._scene = scene
        self.window = first, last = _window(window, scene, dt)
        every = max(1, int(min(first / SAMPLES, (last - first) / 4.0) / dt))
        points = 2 * math.ceil(0.5 * (last / (every * dt) + 2.0))
        self.steps = points * every
        self.observer: HeatCurrentCorrelator = HeatCurrentCorrelator(
            every=every, points=points, levels=1
        )

    def slope(self, temperature: float, *, n_blocks: int = BLOCKS) -> Estimate:
        """The conductivity at the mean temperature of the run."""
        return self.slope_of(self.observer.increments(n_blocks=n_blocks), temperature)

    def slope_of(self, curve: Correlation, temperature: float) -> Estimate:
        """That of increments of the moment, or of a part of it."""
        return einstein_conductivity(
            curve,
            volume=self._scene.box.volume,
            temperature=temperature,
            boltzmann_constant=self._scene.fluid.boltzmann_constant,
            window=self.window,
        )


def equilibrium(
    scene: Scene,
    *,
    dt: float | str = "auto",
    particles: int | None = None,
    steps: int | None = None,
    work: float = PAIRS,
    window: tuple[float, float] | None = None,
    seed: int = 1,
    n_blocks: int = BLOCKS,
    threads: int | None = None,
    progress: bool | None = False,
) -> Equilibrium:
    r"""The conductivity by the fluctuations of the current of heat in equilibrium.

    Parameters
    ----------
    scene : Scene
        Its fluid, kernel, support, spacing and effects count; walls and body force are left out.
    dt : float or "auto"
        [time].
    particles : int, optional
        In a cube (square); if None the box of the scene, or a cube of 1000 (a square of 1024) where
        that is larger or has walls.
    steps : int, optional
        To sample; by the work if None.
    work : float
        Pairs of particles to visit, 3e8 (some 50 s of one core) unless told otherwise.
    window : tuple of float, optional
        First and last lag of the fit [time]; if None from 8/(1/tau + 1/tau_q), after which no
        particle has both its velocity and its temperature left, or tau_q/2, to twice that.
    seed : int
    n_blocks : int
        Of time, for the errors; each must outlast the window.
    threads : int, optional
        Changes no bit of the result.
    progress : bool, optional
        Show progress bars; None: on a terminal or in a notebook.

    Returns
    -------
    Equilibrium

    Raises
    ------
    TypeError, ValueError
        If the fluid does not conduct or has no noise, or an argument is out of range.

    Notes
    -----
    .. math:: \kappa = \frac{1}{2Vk_BT^2}\frac{\mathrm d}{\mathrm dt}\langle\Delta G_a^2\rangle,
              \qquad G_a=\int_0^t V q_a\,\mathrm dt

    with the moment exact for the discrete steps (`sdpd.HeatCurrent`), and the mean square of what
    noise hands over taken from its pair sums. This is what the fluid delivers to slow, long waves
    of temperature: the asked conduction as the particles lie, and the heat that friction, pressure
    and moving particles carry on top.
    """
    from sdpd.observers import Thermodynamics
    from sdpd.simulation import Simulation

    _check(scene)
    blocks = validation.integer("n_blocks", n_blocks, minimum=2)
    sample = sample_scene(
        scene.replace(effects=replace(scene.settled_effects, energy=True)), particles=particles
    )
    step = scene_step(sample, dt)
    moment = HeatMoment(sample, step, window)
    span = moment.steps
    if steps is None:
        steps = int(
            validation.positive("work", work) / (sample.n_particles * sample.pairs_per_particle)
        )
        steps = max(steps, 2 * blocks * span)
    number = validation.integer("steps", steps, minimum=blocks * span)
    sim = Simulation(sample, dt=step, seed=seed, threads=threads)
    _settle(sim, progress)
    current = moment.observer
    thermo = Thermodynamics(every=max(1, number // (8 * blocks)))
    sim.run(steps=number, observe=[current, thermo], progress=progress)
    temperature = block_average(thermo["internal_temperature"], n_blocks=blocks)
    kelvin = temperature.value
    fluid = {
        "volume": sample.box.volume,
        "temperature": kelvin,
        "boltzmann_constant": sample.fluid.boltzmann_constant,
    }
    increments = {name: current.increments(name, n_blocks=blocks) for name in PARTS}
    function = current.autocorrelation(n_blocks=blocks)
    slopes = {name: moment.slope_of(curve, kelvin) for name, curve in increments.items()}
    noise = current.noise_increments(n_blocks=blocks)
    return Equilibrium(
        helfand=slopes.pop("total"),
        green_kubo=green_kubo_conductivity(function, cutoff=moment.window[1], **fluid),
        shares=slopes,
        noise=moment.slope_of(noise, kelvin),
        increments=increments,
        running=running_conductivity(function, **fluid),
        temperature=temperature,
        asked=sample.fluid.thermal_conductivity or 0.0,
        dt=step,
        steps=number,
        sample=sample,
    )


def _check(scene: Scene) -> None:
    check_conduction(scene)
    active = scene.active_effects
    if not active.fluctuations:
        raise ValueError(
            "`scene` must have thermal fluctuations, got one without: what it delivers is the "
            "lattice's, see sdpd.conductivity.decay"
        )
    if active.dissipation and not active.viscous_heating:
        raise ValueError(
            "`scene` must have viscous heating, got one without: friction then exchanges energy "
            "with a bath, and there is no current of it"
        )


def _window(window: tuple[float, float] | None, scene: Scene, step: float) -> tuple[float, float]:
    """First and last lag of the fit, some steps apart."""
    if window is None:
        thermal = scene.conduction_time
        moving = scene.friction_time if scene.active_effects.dissipation else math.inf
        memory = 1.0 / (1.0 / thermal + 1.0 / moving)
        first = max(MEMORIES * memory, THERMAL * thermal, 2.0 * step)
        return first, max(2.0 * first, first + 4.0 * step)
    first, last = validation.vector("window", window, length=2)
    if not 0.0 <= first < last - step:
        raise ValueError(
            f"`window` must ascend from >= 0 by more than a step of {step:.4g}, got {window}"
        )
    return first, last


def _settle(sim: Simulation, progress: bool | None) -> None:
    """Bring the fluid to equilibrium at the temperature of its scene."""
    for _ in range(2):
        sim.run(steps=SETTLE // 2, progress=progress)
        # What the arrangement gave off or took up while it relaxed is put right.
        warm = np.asarray(sim.temperatures)
        sim.temperatures = warm * (sim.scene.fluid.temperature / warm.mean())
    sim.run(steps=SETTLE // 4, progress=progress)
