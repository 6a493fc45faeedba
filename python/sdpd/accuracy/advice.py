"""The cheapest settings for an error, and what they cost: behind ``scene.cost(error=...)``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile
from typing import TYPE_CHECKING, Any

from sdpd import timestep, validation
from sdpd.accuracy.expectation import (
    QUANTITIES,
    Expected,
    bias_of,
    default_quantity,
    edge_axis,
    flow_orders,
    flow_point,
    sampled_time,
)
from sdpd.accuracy.orders import Orders, Point
from sdpd.accuracy.speed import Speed, kind_of_step, speed_of
from sdpd.box import AXES
from sdpd.errors import silenced
from sdpd.initial import LatticeStart
from sdpd.integrators import Integrator, VelocityVerlet, of_scene
from sdpd.resolution import Resolution
from sdpd.units import quantity as shown
from sdpd.units import table

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["AccuracyCost", "advise"]

_SUPPORTS = (2.4, 2.6, 2.8, 3.0, 3.25, 3.5, 3.75, 4.0)
_STEPS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12)  # over the default, in equilibrium
_FEWEST, _MOST = 6, 400  # particles across a flow
_UNTRIED = 2.0  # factor within which a bias with noise is taken to be that without
_PROMISE = 1.5  # what is asked may be exceeded by that factor, in 1 of 20 settings by more
_SHARE = 0.7  # of the error, at most, that bias may take where there is noise


@dataclass(frozen=True, kw_only=True)
class AccuracyCost:
    """The cheapest settings expected to reach an error; printable.

    Attributes
    ----------
    scene : Scene
        The given one with the settings found.
    integrator : Integrator
    precision : {"double", "mixed"}
        Of the pairs.
    dt : float
        Time step [time].
    quantity : str
        What the error is of.
    error : float
        Asked [1].
    expected : Expected
        Bias of these settings.
    sampling : float
        Standard error by the length of all runs together [1]; 0 without noise.
    time : float
        Simulated in all runs together [time].
    runs : int
        So many, of the same length.
    start : float
        Of each run, before a flow with noise is sampled [time].
    steps : int
        Of all runs.
    seconds : float
        On one core [s].
    uncertainty : float
        Factor by which `seconds` may be off, two standard deviations [1].
    speed : Speed
        What a step was taken to cost.
    """

    scene: Scene
    integrator: Integrator
    precision: str
    dt: float
    quantity: str
    error: float
    expected: Expected
    sampling: float
    time: float
    runs: int
    start: float
    steps: int
    seconds: float
    uncertainty: float
    speed: Speed

    @property
    def total(self) -> float:
        """Bias and sampling together [1]."""
        return math.hypot(self.expected.bias, self.sampling)

    def __str__(self) -> str:
        scene, si = self.scene, self.scene.fluid.is_si
        resolution, expected = scene.resolution, self.expected
        kernel = resolution.kernel.replace("_", " ")
        calibrated = ", calibrated" if scene.calibrate else ""
        long = shown(self.time / self.runs, "s", si=si)
        length = long if self.runs == 1 else f"{self.runs} runs of {long}"
        after = ", once the start is forgotten" if self.sampling else ""
        if self.start:
            after = f", {shown(self.start, 's', si=si)} of each run for the start"
        speed = "measured here" if self.speed.measured else "not measured, a rough estimate"
        factor = f"within a factor {self.uncertainty:.1f} (speed of a step: {speed})"
        rows = [
            ["  particles", f"{scene.n_particles}, spacing {shown(scene.spacing, 'm', si=si)}"],
            ["  kernel", f"{kernel}, h/dx = {resolution.support:g}{calibrated}"],
            ["  integrator", f"{self.integrator.title}, dt = {shown(self.dt, 's', si=si)}"],
            ["  precision", self.precision],
            [
                "  bias",
                f"{expected.bias:.2%}, within a factor {expected.factor:.1f} ({expected.source})",
            ],
        ]
        if self.sampling:
            rows.append(["  sampling", f"{self.sampling:.2%}, one standard error of all runs"])
        rows += [
            ["  length", f"{length}, {self.steps} steps{after}"],
            ["  time", f"{_clock(self.seconds)} on one core, {factor}"],
        ]
        name = self.quantity.replace("_", " ")
        return f"cheapest settings for an error of {self.error:.3g} of the {name}\n" + table(rows)


def _clock(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)):
        if seconds < 100.0 * size or unit == "d":
            return f"{seconds / size:.2g} {unit}"
    raise AssertionError


def advise(
    scene: Scene,
    error: float,
    *,
    integrator: Integrator | str | None = None,
    precision: str | None = None,
    quantity: str | None = None,
    time: float | None = None,
    measure: bool = True,
    refresh: bool = False,
    **accuracy: Any,
) -> AccuracyCost:
    """The cheapest settings expected to reach an error, and the seconds they take.

    Parameters
    ----------
    scene : Scene
    error : float
        Relative, ``0 < error < 1``.
    integrator : Integrator or str, optional
        Only this one; those that suit the scene if None.
    precision : {"double", "mixed"}, optional
        Only this one; the faster one of those that the fluid allows if None. It adds nothing to an
        error that can be asked for here (docs/guide/performance).
    quantity : str, optional
        "flow" (velocities over the fastest, or temperatures over their span), and in equilibrium
        "temperature", "density_variance", "temperature_variance" or "diffusion"; a flow where
        there is one, else the temperature, if None.
    time : float, optional
        To simulate a flow, L^2/nu if None; where there is noise to sample in each run, all in one
        run if None [time].
    measure : bool
        Measure the speed of such steps here where it is not known, which takes a second or two;
        False: a rough estimate.
    refresh : bool
        Measure the speed anew.
    **accuracy
        As of `timestep.bounds`.

    Returns
    -------
    AccuracyCost

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range, or no settings are known to reach the error: the text tells
        the smallest one.

    Notes
    -----
    For a flow resolution, kernel, support and calibration are chosen, from fits to studies of
    :mod:`sdpd.accuracy`. In equilibrium particles, kernel and support stay, since they are the
    fluid; integrator and step are chosen. The time until a start is forgotten counts
    for a flow with noise (L^2/nu), not in equilibrium.

    Examples
    --------
    >>> import sdpd
    >>> found = sdpd.scenes.load("poiseuille").cost(error=0.01, measure=False)
    >>> found.scene.calibrate, found.expected.bias < 0.01
    (True, True)
    """
    error = validation.positive("error", error)
    if error >= 1.0:
        raise ValueError(f"`error` must be < 1, it is relative, got {error:g}")
    what = default_quantity(scene) if quantity is None else quantity
    validation.choice("quantity", what, QUANTITIES)
    span = validation.optional_positive("time", time)
    precisions = _precisions(scene, precision)
    noisy = scene.active_effects.fluctuations
    if what != "flow" and (not noisy or scene.walls):
        raise ValueError(
            f"`quantity` must be 'flow' for a scene {'with walls' if noisy else 'without noise'}, "
            f"got {what!r}"
        )
    limit = _SHARE * error if noisy else error
    search = _flows if what == "flow" else _equilibria
    speeds: dict[str, Speed] = {}
    found, least = [], math.inf
    for made, chosen, dt, expected in search(scene, integrator, what, limit, accuracy):
        least = min(least, expected.bias * _caution(expected.factor))
        if expected.bias * _caution(expected.factor) <= limit:
            for each in precisions:
                kind = kind_of_step(made, chosen, each)
                if kind not in speeds:
                    speeds[kind] = speed_of(
                        made, chosen, precision=each, measure=measure, refresh=refresh
                    )
                settings = (made, chosen, each, dt)
                found.append(_costed(*settings, what, error, expected, span, speeds[kind]))
    if not found:
        smallest = least / limit * error
        raise ValueError(
            f"`error` must be at least {smallest:.2g} for the {what.replace('_', ' ')} of this "
            f"scene by the settings that studies were made of, got {error:g}"
        )
    return min(found, key=lambda cost: cost.seconds)


def _caution(factor: float) -> float:
    """How far below a limit a bias must be that is known within a factor."""
    return max(1.0, factor / _PROMISE)


def _precisions(scene: Scene, asked: str | None) -> tuple[str, ...]:
    """Those to choose from. Without a measurement both count alike, and the first is taken."""
    energy = scene.active_effects.energy
    if asked is None:
        return validation.PRECISIONS[:1] if energy else validation.PRECISIONS
    return (validation.precision(asked, energy=energy),)


def _costed(
    scene: Scene,
    integrator: Integrator,
    precision: str,
    dt: float,
    quantity: str,
    error: float,
    expected: Expected,
    time: float | None,
    speed: Speed,
) -> AccuracyCost:
    """Length and seconds of one setting."""
    sampling, runs, factor, start = 0.0, 1, 1.0, 0.0
    viscous = scene.flow_length**2 / max(scene.fluid.kinematic_viscosity, 1e-300)
    needed = viscous if time is None else time
    if scene.active_effects.fluctuations:
        sampling = math.sqrt(error**2 - expected.bias**2)
        total, factor = sampled_time(scene, quantity, dt, sampling)
        runs = 1 if time is None else max(1, math.ceil(total / time))
        start = viscous if quantity == "flow" else 0.0
        needed = runs * (start + (max(total, dt) if time is None else time))
    steps = math.ceil(needed / dt)
    return AccuracyCost(
        scene=scene,
        integrator=integrator,
        precision=precision,
        dt=dt,
        quantity=quantity,
        error=error,
        expected=expected,
        sampling=sampling,
        time=needed,
        runs=runs,
        start=start,
        steps=steps,
        seconds=steps * speed.seconds(scene, dt, integrator),
        uncertainty=math.exp(2.0 * math.hypot(math.log(speed.uncertainty), 0.5 * math.log(factor))),
        speed=speed,
    )


Candidate = tuple["Scene", Integrator, float, Expected]


def _flows(
    scene: Scene,
    integrator: Integrator | str | None,
    quantity: str,
    limit: float,
    accuracy: dict[str, Any],
) -> Iterator[Candidate]:
    """For each kernel, support and calibration the coarsest resolution that will do."""
    name, length, orders = flow_orders(scene)
    noisy = scene.active_effects.fluctuations
    source = f"study {name!r}{', which has no noise' * noisy}"
    for kernel, known in orders.items():
        for support in _SUPPORTS:
            if not known.supports[0] <= support <= known.supports[-1]:
                continue
            for calibrate in sorted({scene.calibrate, True}):
                make = partial(_at, scene, kernel=kernel, support=support, calibrate=calibrate)

                def timed(made: Scene) -> tuple[Integrator, float, Point]:
                    chosen = of_scene(made, integrator)
                    dt = timestep.auto_time_step(made, chosen, **accuracy).value
                    return chosen, dt, flow_point(made, length, dt, chosen)

                factor = max(known.worst, _UNTRIED) if noisy else known.worst
                own = limit / _caution(factor)
                made = _coarsest(make, timed, _numbers(scene, support, length, known), known, own)
                if made is not None:
                    chosen, dt, point = timed(made)
                    bias = known.error(point)
                    yield made, chosen, dt, Expected(bias=bias, factor=factor, source=source)


def _coarsest(
    make: Callable[[float], Scene | None],
    timed: Callable[[Scene], tuple[Integrator, float, Point]],
    spacings: Sequence[float],
    known: Orders,
    limit: float,
) -> Scene | None:
    """The scene at the coarsest spacing from which on the bias stays within the limit.

    The finest possible one, for the text of the refusal, if there is none; None if the scene is
    impossible at all of them.
    """
    probe = next((made for made in map(make, spacings) if made is not None), None)
    if probe is None:
        return None
    point = timed(probe)[2]  # at other spacings h/L alone differs
    enough = list(
        takewhile(
            lambda s: known.error(replace(point, reach=point.reach * s / probe.spacing)) <= limit,
            spacings,
        )
    )
    return next((made for made in map(make, enough[::-1]) if made is not None), probe)


def _numbers(scene: Scene, support: float, length: float, known: Orders) -> list[float]:
    """Spacings, finest first: as coarse as was fitted at most, and somewhat finer than that."""
    edge = scene.box.lengths[AXES.index(edge_axis(scene))]
    ratio = support * edge / length
    low = max(_FEWEST, math.ceil(ratio / known.reach[1]))
    high = min(_MOST, math.floor(4.0 * ratio / known.reach[0]))
    counts, n = [low], float(low)
    while n < high:
        n = max(n + 1.0, 1.06 * n)
        counts.append(round(n))
    return [edge / count for count in counts[::-1]]


def _at(scene: Scene, spacing: float, kernel: str, support: float, calibrate: bool) -> Scene | None:
    """The scene at a resolution, if it is possible there without particles that clump."""
    kind: dict[str, Any] = {"support": support, "kernel": kernel}
    if isinstance(scene.start, LatticeStart):
        counts = tuple(max(1, round(length / spacing)) for length in scene.box.lengths)
        resolution = Resolution(particles=counts, **kind)
    else:
        resolution = Resolution(spacing=spacing, **kind)
    with silenced():
        try:
            made = scene.replace(
                resolution=resolution, calibrate=calibrate, effects=scene.settled_effects
            )
            clumps = made.starts_thermal and made.pairing[0] > 1.0
        except ValueError:
            return None
    return None if clumps else made


def _equilibria(
    scene: Scene,
    integrator: Integrator | str | None,
    quantity: str,
    limit: float,
    accuracy: dict[str, Any],
) -> Iterator[Candidate]:
    """Integrators and steps."""
    both: list[Integrator | str | None] = [integrator]
    if integrator is None:
        both = ["pair_splitting", VelocityVerlet()]
    for each in both:
        chosen = of_scene(scene, each)
        largest = timestep.auto_time_step(scene, chosen, **accuracy).value
        for share in _STEPS:
            dt = share * largest
            yield scene, chosen, dt, bias_of(scene, quantity, dt, chosen)
