"""Measure the conductivity of a scene in every way at hand and set the results side by side."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from sdpd import validation
from sdpd.agreement import Comparison, judge
from sdpd.analysis import Estimate
from sdpd.conductivity.equilibrium import BLOCKS, PAIRS, Equilibrium, equilibrium
from sdpd.conductivity.gradient import imposed_gradient
from sdpd.conductivity.lattice import Decay, check_conduction, decay
from sdpd.conductivity.predictions import Prediction, predict
from sdpd.scene import Scene

__all__ = ["Study", "run_conductivity"]

QUICK_SHARE = 0.12
DIFFERENCE = 0.8  # of the plates' temperatures, over that of the fluid
GRADIENT_TIMES = 8.0  # of the slowest wave of the slab, at least, and before as well
ACCURACY = 0.01  # of the delivered value: what the layers next to the plates may change
# Of the sum over the lattice, by dimension: particles that have left it conduct 4 and 2 % less.
CONDUCTION_ACCURACY = {2: 0.06, 3: 0.04}


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Conductivity of a scene, measured; all values are [energy/(time temperature length^(D-2))].

    Attributes
    ----------
    scene : Scene
        As given.
    seed : int
    decay : Decay
        Of a wave on the lattice: conduction alone.
    equilibrium : Equilibrium
    gradient : Estimate
        From the heat between plates.
    prediction : Prediction
        Mean field.
    comparisons : tuple of Comparison
        Helfand moment and imposed gradient; the conduction in the Helfand moment and the sum over
        the lattice at this step, which tells a fault that both of the former have.
    agreed : tuple of bool
        Verdict on each.
    seconds : float
        Wall time [s].
    """

    scene: Scene
    seed: int
    decay: Decay
    equilibrium: Equilibrium
    gradient: Estimate
    prediction: Prediction
    comparisons: tuple[Comparison, ...]
    agreed: tuple[bool, ...]
    seconds: float

    @property
    def asked(self) -> float:
        """Conductivity of the fluid."""
        return self.scene.fluid.thermal_conductivity or 0.0

    @property
    def step_factor(self) -> float:
        """What the time step leaves of the conduction on the lattice [1]."""
        return self.decay.delivered / self.decay.lattice

    @property
    def conductivity(self) -> Estimate:
        """Both ways that know of the moving fluid, weighted by their standard errors."""
        both = (self.equilibrium.helfand, self.gradient)
        return Estimate.merge(both, weights="inverse_variance")

    @property
    def passed(self) -> bool:
        """Whether the ways agree."""
        return all(self.agreed)

    def __str__(self) -> str:
        from sdpd.conductivity.report import report

        return report(self)


def run_conductivity(
    scene: Scene,
    *,
    dt: float | str = "auto",
    particles: int | None = None,
    seed: int = 1,
    time_factor: float = 1.0,
    quick: bool = False,
    threads: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Measure the thermal conductivity that a scene delivers.

    Parameters
    ----------
    scene : Scene
        With heat conduction and fluctuations; its walls and body force are left out.
    dt : float or "auto"
        Time step of the decay and in equilibrium [time].
    particles : int, optional
        In equilibrium; see `equilibrium`.
    seed : int
        Key of all randomness.
    time_factor : float
        Longer or shorter than the default, > 0.
    quick : bool
        Seconds, with larger errors.
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
        For a bad argument, or a scene without such a conductivity.
    SimulationError
        If a run blows up.
    """
    check_conduction(scene)
    seed = validation.integer("seed", seed, minimum=0)
    factor = validation.positive("time_factor", time_factor)
    factor *= QUICK_SHARE if validation.boolean("quick", quick) else 1.0
    began = time.perf_counter()
    at_rest = equilibrium(
        scene,
        dt=dt,
        particles=particles,
        seed=seed,
        work=factor * PAIRS,
        threads=threads,
        progress=progress,
    )
    wave = decay(at_rest.sample, dt=at_rest.dt)
    heated = imposed_gradient(
        at_rest.sample,
        difference=DIFFERENCE,
        times=max(1.0, GRADIENT_TIMES * min(factor, 1.0)),
        work=factor * PAIRS,
        seed=seed + 1,
        n_blocks=BLOCKS,
        dt=at_rest.dt,
        threads=threads,
        progress=progress,
    )
    expected = predict(at_rest.sample, dt=at_rest.dt)
    found, conduction = at_rest.helfand, at_rest.shares["conduction"]
    lattice = expected.conduction * wave.delivered / wave.lattice
    unit = scene.fluid.thermal_conductivity or 1.0
    comparisons = (
        Comparison(
            first="Helfand moment",
            second="imposed gradient",
            difference=Estimate(
                found.value - heated.value,
                math.hypot(found.stderr, heated.stderr),
                min(found.n_effective, heated.n_effective),
            ),
            accuracy=ACCURACY * found.value,
            unit=unit,
        ),
        Comparison(
            first="conduction alone",
            second="lattice",
            difference=replace(conduction, value=conduction.value - lattice),
            accuracy=CONDUCTION_ACCURACY[scene.dimension] * lattice,
            unit=unit,
        ),
    )
    return Study(
        scene=scene,
        seed=seed,
        decay=wave,
        equilibrium=at_rest,
        gradient=heated,
        prediction=expected,
        comparisons=comparisons,
        agreed=judge(comparisons),
        seconds=time.perf_counter() - began,
    )
