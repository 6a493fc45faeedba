"""One case of nitrogen: its run at equilibrium, and each quantity beside what is expected."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sdpd.analysis.estimate import Estimate
from sdpd.errors import SdpdWarning
from sdpd.nitrogen.cases import FROZEN, PUBLISHED_PARTICLES, Case
from sdpd.nitrogen.transport import Recorder, Transport, through_a_slab
from sdpd.scene import Scene
from sdpd.theory import DensityTheory

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["LARGEST_ERROR", "LARGEST_T", "Measured", "Plan", "Row", "measure"]

Array = NDArray[np.float64]

BLOCKS = 32
# In standard errors, with 31 degrees of freedom: p = 4e-4, and 0.03 that any of the judged rows,
# seven in each of the twelve cases whose particles move, is beyond it (Bonferroni; three of the
# seven are one statistic, and self-diffusion at short times has fewer blocks: 0.09 if `quick`).
LARGEST_T = 4.0
LARGEST_ERROR = 0.007  # relative, of what is judged
SHORT_ERROR = 0.03  # likewise of the short-time self-diffusion
CONDUCTED = 0.04  # loss by the time step of what conducts on the lattice
MANY_PAIRS = 45.0  # pairs a particle, beyond which a case is sampled less: its cost goes with them
CLOSE = 0.5  # spacings between particles that are a pair


@dataclass(frozen=True)
class Row:
    """A quantity of a case beside what is expected and what was published.

    Attributes
    ----------
    name, unit : str
    measured : Estimate
    expected : float
        nan where there is no theory.
    published : float or None
    judged : bool
        Whether the expected value is exact, and particles move.
    analytical : float or None
        "Analytical" value of the dissertation.
    largest_error : float
        Relative standard error up to which a verdict means something.
    """

    name: str
    unit: str
    measured: Estimate
    expected: float
    published: float | None
    judged: bool
    analytical: float | None = None
    largest_error: float = LARGEST_ERROR

    @property
    def t(self) -> float:
        """Distance from what is expected in standard errors."""
        return self.measured.z(self.expected)

    @property
    def passed(self) -> bool:
        """Within `LARGEST_T` standard errors that are small enough to tell; else not judged."""
        if not self.judged:
            return True
        return abs(self.t) < LARGEST_T and self.measured.relative < self.largest_error


@dataclass(frozen=True)
class Plan:
    """How long a case is run: steps before the first sample, and of each block behind an error.

    Attributes
    ----------
    equilibration, steps : int
        Steps; samples are five apart.
    stretches, stretch : int
        Of small steps, for the slope of the velocity autocorrelation; none if 0.
    slab : bool
        Whether heat is sent through a slab.
    """

    equilibration: int = 600
    steps: int = 200
    stretches: int = 16
    stretch: int = 24
    slab: bool = True

    @classmethod
    def of(cls, scene: Scene, *, quick: bool, transport: bool) -> Plan:
        """Of a scene; a fifth of the samples if `quick`, fewer where neighbours are many.

        Frozen particles are not judged, and a longer run would not thaw them.
        """
        moves = scene.stiffness < FROZEN
        share = min(1.0, MANY_PAIRS / scene.pairs_per_particle) if moves else 0.0
        samples = max(4, round((8 if quick else 40) * share))
        stretches = (16 if moves and not quick else 8) if transport else 0
        return cls(600 if moves else 300, 5 * samples, stretches, slab=transport and moves)


@dataclass(frozen=True)
class Measured:
    """A case that was run.

    Attributes
    ----------
    case : Case
    scene : Scene
    rows : tuple of Row
    transport : Transport or None
    paired : float
        Share of the particles that have another one within half a spacing [1].
    energy_change : float
        Relative.
    refused, steps : int
        Exchanges that would have left no energy; steps.
    """

    case: Case
    scene: Scene
    rows: tuple[Row, ...]
    transport: Transport | None
    paired: float
    energy_change: float
    refused: int
    steps: int

    @property
    def moves(self) -> bool:
        """Whether particles come to equilibrium in a run."""
        return self.scene.stiffness < FROZEN

    @property
    def pairs(self) -> bool:
        """Whether the stiffness is beyond the pairing limit of the kernel."""
        return self.scene.density_deviation is None

    @property
    def conducts(self) -> bool:
        """Whether the lattice conducts as its sum says, but for the time step."""
        found = self.transport
        if found is None:
            return True
        ratio = found.lattice_conductivity / found.expected_conductivity
        return 1.0 - CONDUCTED < ratio < 1.001

    @property
    def passed(self) -> bool:
        """Whether all that is exact was met."""
        return self.conducts and all(row.passed for row in self.rows)


def measure(case: Case, scene: Scene, plan: Plan, *, seed: int, threads: int | None) -> Measured:
    """Run a case: equilibrate, sample, then small steps; the slab is a run of its own."""
    from sdpd.simulation import Simulation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SdpdWarning)
        sim = Simulation(scene, seed=seed, threads=threads)
    number, k = scene.n_particles, scene.heat_capacity_number
    sim.run(steps=plan.equilibration, progress=False)
    energy = sim.total_energy
    # the energy of an ideal gas is that of its temperatures
    freedom = number * k + 1.5 * (number - 1)
    mean = float(energy / (freedom * scene.fluid.boltzmann_constant))
    recorder = Recorder(scene, sim.dt, BLOCKS * plan.steps) if plan.stretches else None
    observers = [] if recorder is None else [recorder.stress, recorder.motion]
    blocks = []
    for block in range(BLOCKS):
        values = []
        for _ in range(plan.steps // 5):
            sim.run(steps=5, observe=observers, progress=False)
            values.append(_state(sim, mean))
        blocks.append(np.mean(values, axis=0))
        if recorder is not None and block % 4 == 0:
            recorder.look(sim)
    change, steps = (sim.total_energy - energy) / energy, sim.step
    rows = _rows(case, scene, mean, np.asarray(blocks))
    paired = _paired(scene, np.asarray(sim.positions))
    transport = None
    if recorder is not None:
        slopes = recorder.slopes(sim, plan.stretches, plan.stretch)
        transport = recorder.result(slopes, through_a_slab(scene, seed) if plan.slab else None)
        rows += _transport_rows(case, scene, transport)
    refused = sim.energy_accounts().refused
    return Measured(case, scene, rows, transport, paired, change, refused, steps)


def _state(sim: Simulation, mean: float) -> Array:
    """Means over particles: T, (T - mean)^2, d, Var d, P, Var P, v^2 of a component."""
    t, d, p = (np.asarray(x) for x in (sim.temperatures, sim.densities, sim.pressures))
    v = np.asarray(sim.velocities) - sim.velocities.mean(axis=0)
    square = float(np.square(v).sum()) / (3.0 * (len(v) - 1))
    spread = np.square(t - mean).mean()
    return np.array([t.mean(), spread, d.mean(), d.var(), p.mean(), p.var(), square])


def _rows(case: Case, scene: Scene, mean: float, blocks: Array) -> tuple[Row, ...]:
    """Means and variances beside what is exact (T, V, P at the mean density) or expected."""
    moves = scene.stiffness < FROZEN
    mass, boltzmann = scene.particle_mass, scene.fluid.boltzmann_constant
    number, k = scene.n_particles, scene.heat_capacity_number
    whole = number * k + 1.5 * (number - 1)
    gas = boltzmann / (scene.fluid.molecular_mass or 1.0)
    deviation = scene.density_deviation
    v = math.nan if deviation is None else deviation**2
    warm = (whole - k) / (k * (whole + 1.0))
    t, var_t, rho, var_rho, p, var_p, square = blocks.T
    density = float(rho.mean())
    exact_t = warm * mean**2
    pressure = _estimate(p)
    apart = _estimate(p - gas * rho * t)  # T and rho of a particle are independent
    speed = _estimate(np.sqrt(3.0 * square))
    scale = float(PUBLISHED_PARTICLES)
    return (
        Row("T", "K", _estimate(t), mean, case.temperature, moves),
        Row("T_kin", "K", _estimate(square * mass / boltzmann), mean, case.temperature, moves),
        Row("c_rms", "m/s", speed, math.sqrt(3.0 * boltzmann * mean / mass), case.speed, moves),
        Row("rho", "kg/m^3", _estimate(rho), _expected_density(scene), case.density, False),
        Row(
            "P",
            "Pa",
            Estimate(pressure.value, apart.stderr, BLOCKS),
            pressure.value - apart.value,
            case.pressure,
            moves,
        ),
        Row(
            "Var T",
            "K^2",
            _estimate(var_t),
            exact_t,
            scale * case.temperature_variance,
            moves,
            scale * case.box_temperature_variance,
        ),
        Row(
            "Var V",
            "m^2/s^2",
            _estimate(3.0 * square),
            3.0 * boltzmann * mean / mass,
            scale * case.velocity_variance,
            moves,
            scale * case.box_velocity_variance,
        ),
        Row(
            "Var rho",
            "kg^2/m^6",
            _estimate(var_rho),
            v * density**2,
            scale * case.density_variance,
            False,
            scale * case.box_density_variance,
        ),
        Row(
            "Var P",
            "Pa^2",
            _estimate(var_p),
            (warm + v + warm * v) * (density * gas * mean) ** 2,
            scale * case.pressure_variance,
            False,
            scale * case.box_pressure_variance,
        ),
    )


def _transport_rows(case: Case, scene: Scene, found: Transport) -> tuple[Row, ...]:
    """Coefficients beside what is exact (short times) or expected."""
    moves = scene.stiffness < FROZEN
    short = Row(
        "D short",
        "m^2/s",
        found.short,
        found.exact.value,
        None,
        moves,
        largest_error=SHORT_ERROR,
    )
    caged = found.expected_long if moves else math.nan
    rows = [
        short,
        Row("D long", "m^2/s", found.long, caged, case.diffusion, False),
        Row("eta", "Pa s", found.viscosity, found.expected_viscosity, case.viscosity, False),
    ]
    if found.conductivity is not None:
        # long waves: the factor of the lattice, and what the time step leaves of it
        delivered = found.lattice_conductivity / found.expected_conductivity
        expected = found.asked_conductivity * scene.factors.conductivity * delivered
        rows.append(Row("kappa", "W/(m K)", found.conductivity, expected, None, False))
    return tuple(rows)


def _estimate(series: Array) -> Estimate:
    error = float(series.std(ddof=1) / math.sqrt(len(series)))
    return Estimate(float(series.mean()), error, len(series))


def _expected_density(scene: Scene) -> float:
    """Mean over particles in the random-phase approximation; nan beyond the pairing limit."""
    try:
        theory = DensityTheory(
            kernel=scene.resolution.kernel,
            dimension=scene.dimension,
            support=scene.support_radius,
            number_density=scene.n_particles / scene.box.volume,
            stiffness=scene.stiffness,
            compressibility_factor=scene.pressure_number,
        )
    except ValueError:
        return math.nan
    return scene.fluid.density * (1.0 + theory.bias())


def _paired(scene: Scene, positions: Array) -> float:
    """Share of the particles with another one nearer than half a spacing."""
    tree = cKDTree(positions, boxsize=scene.box.lengths)
    nearest = tree.query(positions, k=2)[0][:, 1]
    return float(np.mean(nearest < CLOSE * scene.spacing))
