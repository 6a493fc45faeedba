"""A time step that follows the fluid: its fastest, hardest pushed and densest particle.

It is chosen at steps whose number is a multiple of `every`, from the state at that step alone, and
on a ladder of fixed ratios. So it depends neither on threads nor on how a run is cut, and a
checkpoint needs nothing but the present step to go on with the same bits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sdpd import timestep, validation
from sdpd.timestep import TimeStepBound

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["AdaptiveStep"]

RUNG = 2.0**-0.25  # ratio of neighbouring steps of the ladder
# A Maxwellian has no particle faster than this many standard deviations; what is faster flows.
THERMAL_EXTREME = 6.0
_REPLACED = ("acoustic accuracy", "acoustic stability", "thermal motion")


@dataclass(frozen=True, kw_only=True)
class AdaptiveStep:
    r"""Choose the time step anew every few steps; give it to `Simulation` as `dt`.

    Parameters
    ----------
    every : int
        Steps between two choices.
    safety : float
        Multiplies the limits that follow the fluid [1], at most 2: above it sound is unstable.
    largest : float, optional
        No step is larger [time]; the ``dt="auto"`` of the scene if None, which the fluid in
        equilibrium runs at.
    smallest : float
        No step is smaller than this times `largest` [1]: a run that would need one ends with an
        error rather than never.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Notes
    -----
    The smallest of the bounds of the scene that do not follow the motion (friction and conduction,
    times the least density of a particle where that is below its usual spread, body force), of

    - :math:`0.25\cdot2h/[s\,(c+V)]`: c and s at the largest density (and temperature) of a
      particle, V the speed of the fastest beyond six thermal speeds, at least the flow speed of
      the scene,
    - :math:`0.6\,\Delta x/v_\max`, which in equilibrium is a tenth of the spacing a step,
    - :math:`0.25\sqrt{h/a_\max}` with the largest acceleration,

    and of `largest`, rounded down to ``largest * 2**(-n/4)``. A change costs one evaluation of the
    forces. What is written into the arrays counts from the next choice on.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=512),
    ... )
    >>> sim = sdpd.Simulation(scene, dt=sdpd.AdaptiveStep(every=20))
    >>> sim.run(time=1e-12)
    """

    every: int = 10
    safety: float = 1.0
    largest: float | None = None
    smallest: float = 1e-4

    def __post_init__(self) -> None:
        every = validation.integer("every", self.every, minimum=1, maximum=validation.LARGEST)
        safety = validation.positive("safety", self.safety)
        smallest = validation.positive("smallest", self.smallest)
        if safety > 2.0:
            raise ValueError(f"`safety` must be <= 2, got {safety:g}")
        if smallest > 1.0:
            raise ValueError(f"`smallest` must be <= 1, the share of `largest`, got {smallest:g}")
        for name, value in (("every", every), ("safety", safety), ("smallest", smallest)):
            object.__setattr__(self, name, value)
        largest = validation.optional_positive("largest", self.largest)
        object.__setattr__(self, "largest", largest)

    def limits(self, sim: Simulation) -> list[TimeStepBound]:
        """What limits the step in the present state, smallest first."""
        scene = sim.scene
        found = self._diluted(sim)
        top = float(np.sqrt(np.einsum("ij,ij->i", sim.velocities, sim.velocities).max()))
        push = float(np.sqrt(np.einsum("ij,ij->i", sim.forces, sim.forces).max()))
        hottest = 1.0
        if scene.active_effects.energy:
            hottest = max(1.0, float(sim.temperatures.max()) / scene.temperature_range[1])
        noisy = scene.starts_thermal or scene.active_effects.fluctuations
        thermal = THERMAL_EXTREME * scene.hottest_speed * math.sqrt(hottest) if noisy else 0.0
        flow = max(scene.flow_speed or 0.0, top - thermal)
        densest = float(sim.densities.max())
        sound = timestep.acoustic_limit(scene, flow=flow, density=densest, hotter=hottest)
        values = [
            ("sound and flow", timestep.ACOUSTIC_ACCURACY * sound, "0.25 x 2h/(s (c + V))"),
        ]
        if top > 0.0:
            path = 0.1 * THERMAL_EXTREME * scene.spacing / top
            values.append(("fastest particle", path, "0.6 dx/v_max"))
        if push > 0.0:
            root = math.sqrt(scene.support_radius * scene.particle_mass / push)
            values.append(("largest acceleration", 0.25 * root, "0.25 sqrt(h/a_max)"))
        reason = "the present state asks for it"
        found += [TimeStepBound(n, self.safety * v, "accuracy", f, reason) for n, v, f in values]
        return sorted(found, key=lambda bound: bound.value)

    def _diluted(self, sim: Simulation) -> list[TimeStepBound]:
        """Bounds of the scene that stay, where friction is stronger between fewer particles."""
        scene = sim.scene
        usual = scene.fluid.density * max(0.1, 1.0 - 4.0 * (scene.density_deviation or 0.0))
        share = min(1.0, float(sim.densities.min()) / usual)
        kept = [bound for bound in sim.bounds if bound.name not in _REPLACED]
        return [
            bound if bound.name == "body force" else replace(bound, value=share * bound.value)
            for bound in kept
        ]

    def choose(self, sim: Simulation) -> float:
        """The step for the present state [time].

        Raises
        ------
        ArithmeticError
            If it would be smaller than `smallest` allows.
        """
        most = self.largest or sim.bounds[0].value
        limit = self.limits(sim)[0]
        if limit.value < most * self.smallest:
            raise ArithmeticError(
                f"dt must fall to {limit.value:.4g} by `{limit.name}` = {limit.formula}, "
                f"below `smallest` = {self.smallest:g} of {most:.4g}"
            )
        rungs = math.ceil(math.log(min(1.0, limit.value / most), RUNG) - 1e-9)
        return float(most * RUNG**rungs)
