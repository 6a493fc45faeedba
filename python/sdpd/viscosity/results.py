"""From runs to viscosities at k = 0 with their errors, and the verdict on how they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.agreement import Comparison
from sdpd.analysis import (
    Correlation,
    Estimate,
    einstein_viscosity,
    green_kubo_viscosity,
    jackknife,
)

if TYPE_CHECKING:
    from sdpd.observers import StressCorrelator
    from sdpd.scene import Scene
    from sdpd.viscosity.plan import Plan

__all__ = [
    "Method",
    "Stress",
    "compare",
    "mean_of",
    "measure_stress",
]

Array = NDArray[np.float64]

SHAPE_ERROR = 0.4  # of what theory says about how the excess falls with k
SLOWNESS = 2.0  # stress still to relax over what theory says
THINNING = 0.05  # of the excess: what the forced flow may lose by its shear rate


@dataclass(frozen=True, kw_only=True, eq=False)
class Method:
    """One way to the viscosity.

    Attributes
    ----------
    name : str
    viscosity : Estimate
        At k = 0 [pressure x time]; ``window`` is the lags or the time used.
    accuracy : float
        What it may be off by beyond its standard error: stress still to relax, the way to k = 0,
        shear thinning [pressure x time].
    wave_number : float
        k at which it was measured [1/length].
    measured : Estimate
        At that k [pressure x time].
    leave_one_out : ndarray, shape (B,), or None
        `viscosity` without each block of the run at equilibrium, so that what methods of this one
        run have in common is not counted twice; None for a run of its own.
    """

    name: str
    viscosity: Estimate
    accuracy: float
    wave_number: float
    measured: Estimate
    leave_one_out: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Stress:
    """The shear stress at equilibrium.

    Attributes
    ----------
    increments : Correlation
        Of the Helfand moment, the random part's own replaced by its exact mean
        [(energy time)^2].
    parts : dict of Correlation
        Increments of the kinetic, collisional, conservative, dissipative and random parts, and of
        all together, as sampled.
    autocorrelation : Correlation
        Of the mean stress over the intervals [pressure^2].
    einstein, green_kubo : Estimate
        Viscosities [pressure x time].
    leave_one_out : ndarray, shape (B,)
        `einstein` without each block.
    shares : dict of Estimate
        Viscosities by the kinetic, collisional, conservative and dissipative parts alone.
    delta : Estimate
        The random part, delta-correlated in time: its share of C(0) in the Green-Kubo sum.
    """

    increments: Correlation
    parts: dict[str, Correlation]
    autocorrelation: Correlation
    einstein: Estimate
    green_kubo: Estimate
    leave_one_out: Array
    shares: dict[str, Estimate]
    delta: Estimate


PARTS = ("kinetic", "collisional", "conservative", "dissipative", "random", "total")


def measure_stress(
    observer: StressCorrelator, scene: Scene, plan: Plan, random: Estimate
) -> Stress:
    """Both routes from the stress to the viscosity.

    Parameters
    ----------
    observer : StressCorrelator
        After the run.
    scene : Scene
    plan : Plan
    random : Estimate
        eta_R of `Arrangement`: impulses of different steps are independent, so that the mean
        square of their moment is exactly 2 V kB T eta_R t, and its noise can be taken off.
    """
    volume, energy = observer.volume, scene.thermal_energy
    parts = {name: observer.increments(part=name, n_blocks=plan.blocks) for name in PARTS}
    whole, noise = parts["total"], parts["random"]
    exact = 2.0 * volume * energy * random.value * whole.lag
    quiet = replace(whole, blocks=whole.blocks - noise.blocks + exact)
    function = observer.autocorrelation(n_blocks=plan.blocks)
    start, stop = plan.stress_window
    window = (start, min(stop, float(whole.lag[-1])))

    def slope(curve: Correlation) -> Estimate:
        return einstein_viscosity(curve, volume=volume, thermal_energy=energy, window=window)

    names = ("kinetic", "collisional", "conservative", "dissipative")
    return Stress(
        increments=quiet,
        parts=parts,
        autocorrelation=function,
        einstein=slope(quiet),
        leave_one_out=np.array([slope(_without(quiet, b)).value for b in range(quiet.n_blocks)]),
        green_kubo=green_kubo_viscosity(
            function,
            volume=volume,
            thermal_energy=energy,
            cutoff=min(window[1], float(function.lag[-1])),
        ),
        shares={name: slope(parts[name]) for name in names},
        delta=random,
    )


def _without(curve: Correlation, block: int) -> Correlation:
    return replace(
        curve,
        blocks=np.delete(curve.blocks, block, axis=0),
        block_counts=np.delete(curve.block_counts, block, axis=0),
    )


def compare(methods: Sequence[Method], unit: float) -> tuple[Comparison, ...]:
    """Every method against every other one at k = 0, and those of the same k there."""
    found = []
    for index, first in enumerate(methods):
        for second in methods[index + 1 :]:
            found.append(
                Comparison(
                    first=first.name,
                    second=second.name,
                    difference=_difference(first, second),
                    accuracy=first.accuracy + second.accuracy,
                    unit=unit,
                )
            )
    return tuple(found)


def mean_of(methods: Sequence[Method], weights: Sequence[float]) -> Estimate:
    """Weighted mean; methods of one run share their blocks.

    Parameters
    ----------
    methods : sequence of Method
    weights : sequence of float
        Their sum is 1 for a mean, 0 for a difference.
    """
    value = sum(w * m.viscosity.value for w, m in zip(weights, methods, strict=True))
    shared: dict[int, Array] = {}
    parts: list[tuple[float, float]] = []  # standard error and degrees of freedom
    for weight, method in zip(weights, methods, strict=True):
        leave, own = method.leave_one_out, method.viscosity
        if leave is None:
            parts.append((abs(weight) * own.stderr, max(own.n_effective - 1.0, 1.0)))
        else:
            shared[leave.size] = shared.get(leave.size, 0.0) + weight * leave
    parts += [(jackknife(sum_of, 0.0)[1], size - 1.0) for size, sum_of in shared.items()]
    square = sum(error**2 for error, _ in parts)
    fourth = sum(error**4 / freedom for error, freedom in parts)  # Welch and Satterthwaite
    freedom = square**2 / fourth if fourth > 0.0 else np.inf
    return Estimate(value, float(np.sqrt(square)), freedom + 1.0)


def _difference(first: Method, second: Method) -> Estimate:
    return mean_of((first, second), (1.0, -1.0))
