"""The viscosity that the pair splitting delivers at a large step, and the friction that mends it.

At dt >> tau an exchange hands over what the first partners leave, so that less momentum crosses the
fluid than the friction asks for (docs/theory/time_integration). How much less is measured: a shear
wave on a lattice of the scene's kernel, support and step decays without noise within a few steps.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sdpd import discretization, kernels, validation
from sdpd.errors import silenced

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["delivered_viscosity", "friction_scale"]

# Friction may be raised this much; beyond it little more is delivered.
LARGEST_SCALE = 2.0
# The wave is so weak, and the sound so slow, that nothing but friction acts.
_AMPLITUDE, _SOUND = 1e-4, 1e-2
# The wave is watched while it falls to 1/e, but not longer than this.
_STEPS = 64
# Below this dt/tau less than 1e-4 is lost, and the wave would take many steps.
_EXACT = 0.1
# Edge of the lattice in supports, which is the length of the wave.
_EDGE = {2: 6, 3: 4}


def delivered_viscosity(scene: Scene, dt: float, *, scale: float = 1.0, sweeps: int = 1) -> float:
    """Viscosity that the pair splitting delivers over that of an infinitely small step.

    Parameters
    ----------
    scene : Scene
        Without an energy; its kernel, support and friction count, its particles do not.
    dt : float
        Time step [time].
    scale : float
        Multiplies the friction in the exchanges, not in what the result is relative to [1].
    sweeps : int
        Sweeps in half a step, see `PairSplitting`.

    Returns
    -------
    float
        Mean over the directions of wave and velocity [1].

    Raises
    ------
    ValueError
        If an argument is out of range, or the scene has no viscosity.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=3375),
    ... )
    >>> round(sdpd.compensation.delivered_viscosity(scene, 10 * scene.friction_time), 2)
    0.91
    """
    step = validation.positive("dt", dt)
    factor = validation.positive("scale", scale)
    number = validation.integer("sweeps", sweeps, minimum=1, maximum=255)
    if not scene.active_effects.dissipation:
        raise ValueError("`scene` must have a viscosity, got one without friction")
    if step < _EXACT * scene.friction_time:
        return factor
    total = scene.friction_across + scene.friction_along
    return _delivered(
        scene.resolution.kernel,
        scene.dimension,
        scene.resolution.support,
        scene.friction_along / total,
        float(f"{step / scene.friction_time:.3e}"),  # run(time=) changes dt by less
        factor,
        number,
    )


@lru_cache(maxsize=1024)
def _delivered(
    kernel: str,
    dimension: int,
    support: float,
    along: float,
    ratio: float,
    scale: float,
    sweeps: int,
) -> float:
    """Decay rate of shear waves over the lattice sum at dt = `ratio` tau; m = dx = a + b = 1."""
    from sdpd import _core

    edge = math.ceil(_EDGE[dimension] * support)
    across = 1.0 - along
    factors = discretization.discrete_factors(
        kernel, dimension, support, across=across, along=along
    )
    integral = kernels.get(kernel).friction_integral[dimension - 2]
    dt = ratio * support**2 / ((across + along / dimension) * integral * factors.friction)
    index = np.stack(np.unravel_index(np.arange(edge**dimension), (edge,) * dimension), axis=-1)
    places = np.asarray(index + 0.5, dtype=np.float64)
    found = []
    for axis in range(dimension):
        k = np.zeros(dimension)
        k[axis] = 2.0 * math.pi / edge
        wave, other = np.sin(places @ k), (axis + 1) % dimension
        rate = discretization.lattice_rates(
            kernel, dimension, support, k, spacing=1.0, across=across, along=along, mass=1.0
        )[other, other]
        velocities = np.zeros(places.shape)
        velocities[:, other] = _AMPLITUDE * wave
        core = _core.Core(
            places,
            velocities,
            box=[float(edge)] * dimension,
            support=support,
            mass=1.0,
            thermal_energy=0.0,
            kernel=kernel,
            friction="general" if across > 0.0 else "central",
            friction_across=scale * across,
            friction_along=scale * along,
            eos=("ideal_gas", [(_SOUND / dt) ** 2]),
            noise="none",
            integrator="pair_splitting",
            iterations=sweeps,
            body_force=None,
            dt=dt,
            seed=0,
            skin=None,
            threads=1,
        )
        steps = min(max(1, round(1.0 / (rate * dt))), _STEPS)
        core.run(steps, dt)
        left = float(core.velocities[:, other] @ wave) / (_AMPLITUDE * float(wave @ wave))
        found.append(-math.log(left) / (steps * dt * rate))
    return float(np.mean(found))


def friction_scale(scene: Scene, dt: float, *, sweeps: int = 1) -> float:
    """What the friction must be multiplied by at a step, for the viscosity asked for to come out.

    Parameters
    ----------
    scene : Scene
    dt : float
        Time step [time].
    sweeps : int
        Sweeps in half a step.

    Returns
    -------
    float
        Rounded to six decimals, so that the last bits of a machine do not matter [1].

    Raises
    ------
    ValueError
        If more than twice the friction would be needed; names the step that can be mended.
    """
    with silenced():

        def excess(scale: float) -> float:
            return delivered_viscosity(scene, dt, scale=scale, sweeps=sweeps) - 1.0

        if excess(LARGEST_SCALE) < 0.0:
            delivered = excess(1.0) + 1.0
            raise ValueError(
                f"`compensate` must be False at dt = {dt:.4g} = {dt / scene.friction_time:.3g} tau "
                f"in {sweeps} sweep{'s' * (sweeps > 1)} a half step, which deliver "
                f"{delivered:.3g} of the viscosity, and less than all with twice the friction; "
                "lower dt or raise `sweeps` of PairSplitting"
            )
        low, high = 1.0, LARGEST_SCALE
        below, above = excess(low), excess(high)
        for _ in range(12):  # regula falsi, halving the weight of the end that stays (Illinois)
            scale = round(high - above * (high - low) / (above - below), 6)
            value = excess(scale)
            if abs(value) < 1e-5 or not low < scale < high:
                break
            if value < 0.0:
                low, below, above = scale, value, 0.5 * above
            else:
                high, above, below = scale, value, 0.5 * below
    return scale
