"""Measure the viscosity of a scene in every way at hand and set the results side by side."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import numpy as np

from sdpd import validation
from sdpd.agreement import Comparison, judge
from sdpd.analysis import Estimate
from sdpd.errors import TimeStepWarning
from sdpd.scene import Scene
from sdpd.theory import ViscosityTheory
from sdpd.viscosity.arrangement import Arrangement
from sdpd.viscosity.forcing import measure_forced
from sdpd.viscosity.lattice import LatticeDecay, measure_lattice
from sdpd.viscosity.plan import LEVELS, POINTS, Plan, check_scene, plan_scene, sample_scene
from sdpd.viscosity.predictions import viscosity_theory
from sdpd.viscosity.results import (
    SHAPE_ERROR,
    SLOWNESS,
    THINNING,
    Method,
    Stress,
    compare,
    mean_of,
    measure_stress,
)
from sdpd.viscosity.thermostat import Thermostat
from sdpd.viscosity.transverse import Shell, excess, shell_viscosities

__all__ = ["LATTICE_ERROR", "Study", "run_viscosity"]

LATTICE_ERROR = 1e-3  # of the decay of a shear wave at a small step
SMALL_STEP = 0.1  # of tau


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Viscosity of a scene, measured; all viscosities are [pressure x time].

    Attributes
    ----------
    scene, sample : Scene
        As given, and what was run.
    plan, seed
        As run.
    lattice : tuple of LatticeDecay
        At a tenth of the friction time, and at the time step of the plan.
    arrangement : Arrangement
        Friction on the particles as they lay.
    theory : ViscosityTheory
    shells : tuple of Shell
        Transverse currents by wave number.
    stress : Stress
    amplitude : Estimate
        Of the forced flow [length/time].
    methods : tuple of Method
        Helfand moment, transverse currents, forced flow.
    comparisons : tuple of Comparison
    agreed : tuple of bool
        Verdict on each.
    seconds : float
        Wall time [s].
    heating : float
        Of a fluid with an energy: by how much the force would have warmed it, over T; it was taken
        out [1].
    """

    scene: Scene
    sample: Scene
    plan: Plan
    seed: int
    lattice: tuple[LatticeDecay, LatticeDecay]
    arrangement: Arrangement
    theory: ViscosityTheory
    shells: tuple[Shell, ...]
    stress: Stress
    amplitude: Estimate
    methods: tuple[Method, ...]
    comparisons: tuple[Comparison, ...]
    agreed: tuple[bool, ...]
    seconds: float
    heating: float = 0.0

    @property
    def asked(self) -> float:
        """Shear viscosity of the fluid."""
        return self.scene.fluid.shear_viscosity

    @property
    def on_lattice(self) -> float:
        """What the undisturbed lattice delivers to a long wave as dt -> 0."""
        return self.asked * self.sample.factors.viscosity / self.sample.calibration

    @property
    def friction(self) -> float:
        """What friction alone delivers on the arrangements of the run, at its time step."""
        return self.arrangement.friction.value * self.lattice[1].factor.value

    @property
    def viscosity(self) -> Estimate:
        """All methods together, weighted by standard error and accuracy."""
        weight = np.array([1.0 / (e.viscosity.stderr**2 + e.accuracy**2) for e in self.methods])
        return mean_of(self.methods, (weight / weight.sum()).tolist())

    @property
    def unit(self) -> float:
        """sqrt(m kB T)/dx^(D-1): viscosity of the thermal motion of the particles."""
        return self.asked / self.sample.reduced_viscosity

    @property
    def thicker(self) -> Estimate:
        """Delivered less asked viscosity in `unit` [1]."""
        found = self.viscosity
        return Estimate(
            (found.value - self.asked) / self.unit,
            found.stderr / self.unit,
            found.n_effective,
        )

    @property
    def to_come(self) -> float:
        """Mean-field viscosity by stress that relaxes beyond the lags used."""
        left = float(self.theory.remaining(self.plan.stress_window[0]))
        return left * self.theory.configurational()

    @property
    def lattice_holds(self) -> bool:
        """Whether the wave at a small step decays as the lattice sum says."""
        return abs(self.lattice[0].factor.value - 1.0) <= LATTICE_ERROR

    @property
    def passed(self) -> bool:
        """Whether all methods agree, and the lattice with its sum."""
        return all(self.agreed) and self.lattice_holds

    def __str__(self) -> str:
        from sdpd.viscosity.report import report

        return report(self)


def run_viscosity(
    scene: Scene,
    *,
    dt: float | str = "auto",
    particles: int | None = None,
    seed: int = 1,
    time_factor: float = 1.0,
    quick: bool = False,
    plan: Plan | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Measure the shear viscosity that a scene delivers to slow flow.

    Parameters
    ----------
    scene : Scene
        With viscosity and fluctuations; its body force is left out.
    dt : float or "auto"
        Time step of the pair splitting [time].
    particles : int, optional
        In the box of the measurement; see `sample_scene`.
    seed : int
        Key of all randomness.
    time_factor : float
        Longer or shorter than the default, > 0.
    quick : bool
        Seconds, with larger errors.
    plan : Plan, optional
        Instead of the one that `dt`, `time_factor` and `quick` make.
    threads : int, optional
        Changes no bit of the result.
    progress : bool, optional
        Show progress bars; None: on a terminal or in a notebook.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        For a bad argument or a scene that has no such viscosity.
    SimulationError
        If a run blows up.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=64),
    ... )
    >>> study = sdpd.viscosity.run_viscosity(scene, quick=True, time_factor=0.1)
    >>> abs(study.lattice[0].factor.value - 1.0) < 1e-3
    True
    """
    validation.instance("scene", scene, Scene, "an sdpd.Scene")
    check_scene(scene)
    seed = validation.integer("seed", seed, minimum=0)
    sample = sample_scene(scene, particles=particles)
    if plan is None:
        plan = plan_scene(sample, dt=dt, time_factor=time_factor, quick=quick)
    began = time.perf_counter()
    small = SMALL_STEP * sample.friction_time
    lattice = (
        measure_lattice(sample, min(small, plan.dt), threads=threads),
        measure_lattice(sample, plan.dt, threads=threads),
    )
    theory = viscosity_theory(sample, plan.dt)
    arrangement, shells, stress = _equilibrium(sample, plan, seed, threads, progress)
    forced, amplitude, heating = measure_forced(
        sample, plan, seed=seed + 1, threads=threads, progress=progress
    )
    factor = lattice[1].factor.value
    methods = _methods(sample, plan, theory, arrangement, shells, stress, forced, factor)
    comparisons = compare(methods, sample.fluid.shear_viscosity)
    return Study(
        scene=scene,
        sample=sample,
        plan=plan,
        seed=seed,
        lattice=lattice,
        arrangement=arrangement,
        theory=theory,
        shells=tuple(shells),
        stress=stress,
        amplitude=amplitude,
        methods=methods,
        comparisons=comparisons,
        agreed=judge(comparisons),
        seconds=time.perf_counter() - began,
        heating=heating,
    )


def _equilibrium(
    scene: Scene, plan: Plan, seed: int, threads: int | None, progress: bool | None
) -> tuple[Arrangement, list[Shell], Stress]:
    """The run without a force."""
    from sdpd.observers import CurrentCorrelator, StressCorrelator
    from sdpd.simulation import Simulation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TimeStepWarning)
        sim = Simulation(scene, integrator="pair_splitting", dt=plan.dt, seed=seed, threads=threads)
    Thermostat(sim, seed=seed).run(plan.equilibration, every=plan.current_every, progress=progress)
    currents = CurrentCorrelator(
        plan.wave_vectors,
        every=plan.current_every,
        points=plan.current_points,
        levels=plan.current_levels,
    )
    stress = StressCorrelator(every=plan.stress_every, points=POINTS, levels=LEVELS, parts=True)
    arrangement = Arrangement(
        scene, wave_vectors=plan.wave_vectors, dt=plan.dt, every=plan.arrangement_every
    )
    sim.run(steps=plan.steps, observe=[currents, stress, arrangement], progress=progress)
    shells = shell_viscosities(
        currents.correlations(n_blocks=plan.blocks),
        density=scene.fluid.density,
        last=plan.current_lag,
    )
    return arrangement, shells, measure_stress(stress, scene, plan, arrangement.random)


def _methods(
    scene: Scene,
    plan: Plan,
    theory: ViscosityTheory,
    arrangement: Arrangement,
    shells: list[Shell],
    stress: Stress,
    forced: Estimate,
    factor: float,
) -> tuple[Method, ...]:
    """Each method's viscosity at k = 0."""
    k = plan.forced_wave_number(scene)
    near = int(np.argmin(np.abs(arrangement.wave_number - k)))
    added = theory.configurational()
    numbers = [shell.wave_number for shell in shells]
    shape = [theory.configurational(q) / added for q in numbers]
    base = [factor * each.value for each in arrangement.waves]
    straight = factor * arrangement.friction.value
    rough = [b + added * s for b, s in zip(base, shape, strict=True)]
    more, leave, reach = excess(shells, base, shape, rough)
    size = max(added, more.value)
    unrelaxed = [
        SLOWNESS * size * float(theory.remaining(lag))
        for lag in (plan.stress_window[0], plan.current_lag)
    ]
    helfand = Method(
        name="Helfand moment",
        viscosity=stress.einstein,
        accuracy=unrelaxed[0],
        wave_number=0.0,
        measured=stress.einstein,
        leave_one_out=stress.leave_one_out,
    )
    transverse = Method(
        name="transverse currents",
        viscosity=Estimate(straight + more.value, more.stderr, more.n_effective, more.window),
        accuracy=unrelaxed[1] + SHAPE_ERROR * size * reach,
        wave_number=shells[0].wave_number,
        measured=shells[0].viscosity,
        leave_one_out=straight + leave,
    )
    here = forced.value - base[near]
    driven = Method(
        name="sinusoidal force",
        viscosity=Estimate(
            straight + here / shape[near],
            forced.stderr / shape[near],
            forced.n_effective,
            forced.window,
        ),
        accuracy=size * (THINNING + SHAPE_ERROR * (1.0 / shape[near] - 1.0)),
        wave_number=k,
        measured=forced,
    )
    return helfand, transverse, driven
