"""How long to equilibrate and to sample, and at which step."""

from __future__ import annotations

from dataclasses import dataclass

from sdpd import timestep, validation
from sdpd.scene import Scene

__all__ = ["Plan", "check_scene", "plan_scene"]

BLOCKS = 32
PAIRS = 1.6e8  # pairs visited while sampling; some 20 s of one ordinary core
QUICK_SHARE = 0.08
FEWEST_STEPS = 320
MOST_SAMPLES = 4096


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A run: equilibration, then blocks of samples.

    Parameters
    ----------
    dt : float
        Time step [time], > 0.
    equilibration : int
        Steps before the first sample, >= 0.
    blocks : int
        Blocks behind the standard errors, >= 8.
    samples : int
        Samples in a block, >= 1.
    every : int
        Steps between samples, >= 1.
    """

    dt: float
    equilibration: int
    blocks: int = BLOCKS
    samples: int
    every: int = 1

    def __post_init__(self) -> None:
        validation.positive("dt", self.dt)
        validation.integer("equilibration", self.equilibration, minimum=0)
        validation.integer("blocks", self.blocks, minimum=8)
        validation.integer("samples", self.samples, minimum=1)
        validation.integer("every", self.every, minimum=1)

    @property
    def steps(self) -> int:
        """Steps of all blocks."""
        return self.blocks * self.samples * self.every


def check_scene(scene: Scene) -> None:
    """Refuse a scene that has no equilibrium with fluctuations.

    Raises
    ------
    ValueError
        Without noise, with walls, with a body force, with an energy that does not get about, or with
        a heat capacity that is no constant (the laws of the temperatures are those of one).
    """
    if scene.walls:
        raise ValueError("`scene` must have no walls: the predictions are for periodic boxes")
    active = scene.active_effects
    if not active.fluctuations:
        raise ValueError(
            "`scene` must have thermal fluctuations, got one without: give the fluid a temperature "
            "and leave `effects.fluctuations` on"
        )
    if active.energy and not (active.viscous_heating and active.conduction):
        missing = "heat conduction" if active.viscous_heating else "viscous heating"
        raise ValueError(
            f"`scene` must have {missing} where its fluid has an energy, got none: the particles "
            "would not share their energy"
        )
    if active.variable_heat_capacity:
        raise ValueError(
            "`scene` must have a fluid with a constant heat capacity, got "
            f"{type(scene.fluid.equation_of_state).__name__}: the variances of its temperatures "
            "are not known in closed form"
        )
    if active.body_force:
        raise ValueError("`scene` must be in equilibrium, got one with a body force")


def equilibrium_time_step(scene: Scene) -> float:
    """Largest step for equilibrium, which the splitting keeps however strong friction and heat are.

    Returns
    -------
    float
        [time].
    """
    bounds = timestep.bounds(scene, "pair_splitting")
    return min(bound.value for bound in bounds if bound.name not in ("friction", "conduction"))


def plan_scene(scene: Scene, *, time_factor: float = 1.0, quick: bool = False) -> Plan:
    """Plan a run by the work it takes, so that results do not depend on the clock.

    Parameters
    ----------
    scene : Scene
    time_factor : float
        Longer or shorter than the default, > 0.
    quick : bool
        A twelfth of the work: seconds, with larger errors.

    Returns
    -------
    Plan
    """
    check_scene(scene)
    factor = validation.positive("time_factor", time_factor)
    work = PAIRS * factor * (QUICK_SHARE if quick else 1.0)
    steps = max(FEWEST_STEPS, int(work / (scene.n_particles * scene.pairs_per_particle)))
    every = 1 + steps // MOST_SAMPLES
    samples = max(1, steps // (BLOCKS * every))
    return Plan(
        dt=equilibrium_time_step(scene),
        equilibration=max(FEWEST_STEPS // 2, steps // 4),
        samples=samples,
        every=every,
    )
