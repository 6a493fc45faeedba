"""The periodic runs of Bian et al. (2015), section III, and what is measured in them.

rho = k_B T = 1, eta = 49.71, quintic spline with its support r_c = 3 dx, P = c_T^2 rho, in two
dimensions. His friction, a = 3 eta/2 and b = 2 eta, is that of a bulk viscosity eta/2. Our runs
take the exact pair splitting; his take velocity Verlet with dt = 1.4e-5.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import sdpd
from sdpd.analysis import Correlation, Estimate, ensemble
from sdpd.correlations import Study, plan_scene, run_correlations
from sdpd.fluctuations import DensityPrediction
from sdpd.theory import DensityTheory

ETA = 49.71
SPACING = 0.05
SUPPORT = 3.0
BOX = 2.0
TIME_STEP = 1.4e-5  # his
WAVES = (1, 2, 4)
ACOUSTIC_SHARE = 0.25


def scene_of(
    sound_speed: float, *, spacing: float = SPACING, eta: float = ETA, box: float = BOX
) -> sdpd.Scene:
    """His fluid in a square box."""
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=eta,
        bulk_viscosity=0.5 * eta,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    return sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((box, box)),
        resolution=sdpd.Resolution(spacing=spacing, kernel="quintic_spline", support=SUPPORT),
        start=sdpd.RandomStart(),
        sound_speed=sound_speed,
    )


def density_theory(scene: sdpd.Scene) -> DensityTheory:
    """Random-phase approximation without a time step."""
    return DensityTheory(
        kernel=scene.resolution.kernel,
        dimension=scene.dimension,
        support=scene.support_radius,
        number_density=scene.n_particles / scene.box.volume,
        stiffness=scene.stiffness,
        compressibility_factor=scene.pressure_number,
    )


# --- configurations ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Length:
    """Independent runs, frames of each, steps between them and before the first."""

    runs: int
    frames: int
    gap: int
    settle: int


class Frames(sdpd.Observer):
    """Keeps whole configurations."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.kept: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def sample(self, sim: sdpd.Simulation) -> None:
        """Add the present state."""
        rho = sim.densities.copy()
        self.kept.append((sim.positions.copy(), sim.velocities.copy(), rho))


@dataclass(frozen=True)
class Configurations:
    """Frames of independent runs, one after the other, and the virial pressure of each run.

    `position`, `velocity` (T, N, 2), `density` (T, N); `virial` is its conservative part, in the
    halves of the runs.
    """

    scene: sdpd.Scene
    dt: float
    runs: int
    position: np.ndarray
    velocity: np.ndarray
    density: np.ndarray
    virial: np.ndarray

    @property
    def prediction(self) -> DensityPrediction:
        """Random-phase approximation at this time step."""
        return DensityPrediction(self.scene, self.dt)

    @property
    def expected_variance(self) -> float:
        """Of the density of particles."""
        return self.prediction.variance

    def by_run(self, values: np.ndarray) -> Estimate:
        """Mean of one value a frame, with the error of the spread of the runs' halves."""
        parts = values.reshape(2 * self.runs, -1).mean(axis=1)
        return ensemble(parts)

    @property
    def mean_density(self) -> Estimate:
        """<rho_i>."""
        return self.by_run(self.density.mean(axis=1))

    @property
    def variance(self) -> Estimate:
        """Variance of the density of particles."""
        shift = self.density - self.density.mean()
        return self.by_run(np.mean(shift**2, axis=1))

    @property
    def temperature(self) -> Estimate:
        """Variance of a velocity component over k_B T/m."""
        number = self.density.shape[1]
        square = np.sum(self.velocity**2, axis=(1, 2)) / (2.0 * (number - 1))
        return self.by_run(square / self.scene.thermal_speed**2)

    def standardised_moment(self, name: str, order: int) -> Estimate:
        """<x^order> of a velocity component or the density, with mean 0 and deviation 1."""
        data = self.velocity if name == "velocity" else self.density
        flat = data.reshape(len(data), -1)
        parts = flat.reshape(2 * self.runs, -1)
        whole = (flat - flat.mean()) / flat.std()
        value = float(np.mean(whole**order))
        left = []
        for index in range(len(parts)):
            rest = np.delete(parts, index, axis=0)
            left.append(np.mean(((rest - rest.mean()) / rest.std()) ** order))
        number = len(left)
        spread = np.sqrt((number - 1) * np.var(left))
        return Estimate(value, float(spread), float(number))

    @property
    def pressure(self) -> Estimate:
        """Effective pressure n k_B T + tr(sum r F^C)/(D V)."""
        ideal = self.scene.thermal_energy * self.scene.n_particles / self.scene.box.volume
        return replace(ensemble(self.virial), value=float(self.virial.mean()) + ideal)


def configurations(
    scene: sdpd.Scene, length: Length, *, seed: int, dt: float = 0.0
) -> Configurations:
    """Run `length.runs` simulations and keep frames; dt 0: a quarter of the acoustic limit."""
    step = dt or ACOUSTIC_SHARE * sdpd.timestep.acoustic_limit(scene)
    frames, virial = Frames(every=length.gap), []
    kept = []
    for run in range(length.runs):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sdpd.TimeStepWarning)
            sim = sdpd.Simulation(
                scene,
                integrator="pair_splitting",
                dt=step,
                seed=1000 * seed + run,
                threads=1,
            )
        sim.run(length.settle, progress=False)
        frames, stress = Frames(every=length.gap), sdpd.Stress(every=length.gap)
        sim.run(length.frames * length.gap, observe=[frames, stress], progress=False)
        kept += frames.kept[: length.frames]
        trace = np.trace(stress.data["conservative"], axis1=1, axis2=2) / scene.dimension
        virial += [float(half.mean()) for half in np.array_split(trace, 2)]
    position, velocity, density = (np.stack(part) for part in zip(*kept, strict=True))
    return Configurations(scene, step, length.runs, position, velocity, density, np.array(virial))


# --- theory of the random-phase approximation -------------------------------------------------


def rpa_correlation(scene: sdpd.Scene, distance: np.ndarray) -> np.ndarray:
    """Correlation coefficient of the density, without the wave k = 0 of a closed box."""
    theory = density_theory(scene)
    missing = float(theory.structure_factor(0.0)) / scene.n_particles / theory.variance()
    return np.asarray((theory.correlation(distance) - missing) / (1.0 - missing))


def rpa_pressure(scene: sdpd.Scene) -> float:
    """Virial pressure; n dX/dn is 0 for P = c^2 rho."""
    theory = density_theory(scene)
    return theory.virial_pressure(thermal_energy=scene.thermal_energy, stiffness_slope=0.0)


# --- waves ------------------------------------------------------------------------------------


def waves_of(
    sound_speed: float,
    *,
    eta: float = ETA,
    runs: int = 16,
    seed: int = 1,
    waves: Sequence[int] = WAVES,
    box: float = BOX,
    quick: bool = False,
) -> Study:
    """Correlation functions of the waves of one fluid, at his time step or below."""
    scene = scene_of(sound_speed, eta=eta, box=box)
    plan = plan_scene(scene, waves=waves, runs=runs, quick=quick)
    return run_correlations(scene, waves=waves, seed=seed, plan=plan, threads=1, progress=False)


def stress_of(
    sound_speed: float,
    *,
    runs: int,
    seed: int,
    box: float = BOX,
    quick: bool = False,
) -> dict[str, Correlation]:
    """Squared increments of the shear stress in time, whole and of the conservative part."""
    scene = scene_of(sound_speed, box=box)
    plan = plan_scene(scene, runs=runs, quick=quick)
    members: dict[str, list[Correlation]] = {"total": [], "conservative": []}
    for run in range(runs):
        sim = sdpd.Simulation(
            scene, integrator="pair_splitting", dt=plan.dt, seed=1000 * seed + run, threads=1
        )
        sim.run(plan.equilibration, progress=False)
        stress = sdpd.StressCorrelator(every=2, points=16, levels=8, parts=True)
        sim.run(plan.run_steps, observe=stress, progress=False)
        for part, found in members.items():
            found.append(stress.increments("shear", part=part, n_blocks=2))
    return {part: Correlation.merge(found) for part, found in members.items()}


def viscosity_within(increments: Correlation, scene: sdpd.Scene, time: float) -> Estimate:
    """Helfand viscosity from the increments between half of a time and all of it."""
    first, last = (int(np.argmin(np.abs(increments.lag - t))) for t in (0.5 * time, time))
    unit = 2.0 * scene.box.volume * scene.thermal_energy
    span = float(increments.lag[last] - increments.lag[first])
    return increments.derive(lambda mean: float(mean[last] - mean[first]) / span / unit)


def published(study: Study, index: int, name: str, time: np.ndarray, damping: float) -> np.ndarray:
    """B 21, normalised: no shift of the frequency, no G/w terms; `damping` Gamma_T over nu."""
    scene, k = study.scene, study.shells[index].wave_number
    nu, speed = scene.fluid.kinematic_viscosity, scene.sound.speed
    if name == "transverse":
        return np.exp(-nu * k**2 * time)
    shape = np.sin if "cross" in name else np.cos
    return np.asarray(np.exp(-damping * nu * k**2 * time) * shape(speed * k * time))


def misfit(study: Study, index: int, name: str, damping: float | None) -> tuple[float, float]:
    """Largest distance of theory (ours if `damping` is None) from a function, and the error there.

    Up to three decay times of the wave.
    """
    shell = study.shells[index]
    lag, mean, error = shell.normalized(name)
    inside = lag * shell.prediction.slowest_rate <= 3.0
    lag, mean, error = lag[inside], mean[inside], error[inside]
    theory = (
        shell.prediction.function(name, lag)
        if damping is None
        else published(study, index, name, lag, damping)
    )
    worst = int(np.argmax(np.abs(mean - theory)))
    return float(abs(mean[worst] - theory[worst])), float(error[worst])
