"""What the regime of a scene says on each effect, and what acts: for `Effects(auto=True)`,
`Scene.regime` and the warning about settings that contradict it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sdpd.effect_rules import CRITERIA, NO_ENERGY, ORDER, Criterion, Numbers, missing, required
from sdpd.wall_heat import Isothermal

if TYPE_CHECKING:
    from sdpd.effects import ActiveEffects
    from sdpd.scene import Scene

__all__ = ["CLEAR", "Decision", "contradictions", "decide", "settle"]

CLEAR = 10.0  # times a threshold, from which a setting that differs is warned of


@dataclass(frozen=True)
class Decision:
    """One effect: what the numbers of the scene say, and what acts.

    Attributes
    ----------
    effect : str
        As in `Effects`, or "wall_heat".
    called : bool or None
        Whether the scene calls for it; None where it does not say enough.
    active : bool
        Whether it acts.
    origin : {"regime", "set", "derived", "absent"}
        Who decided: the regime, the user, the derivation from fluid and walls (also of an automatic
        scene that does not say enough), or nobody, as the scene lacks what it takes.
    symbol : str
        Of the number that decided; "" where none did.
    value, threshold : float or None
        [1].
    changes_means : bool
        Whether that number tells of means, not of fluctuations alone.
    reason : str
        In words, with both.
    """

    effect: str
    called: bool | None
    active: bool
    origin: str
    symbol: str
    value: float | None
    threshold: float | None
    changes_means: bool
    reason: str

    @property
    def contradicts(self) -> bool:
        """Whether what acts differs from what is called for, by ten times the threshold.

        Of what the scene cannot have only a missing energy does.
        """
        if self.value is None or self.threshold is None or self.called in (None, self.active):
            return False
        if self.called:
            could = self.origin != "absent" or self.effect == "energy"
            return could and self.value >= CLEAR * self.threshold
        return self.origin == "set" and self.value <= self.threshold / CLEAR

    def __str__(self) -> str:
        return self.reason


@dataclass(frozen=True)
class _Verdict:
    called: bool | None
    criterion: Criterion | None
    value: float | None
    words: str


_UNASKED = _Verdict(False, None, None, "")


def _verdict(effect: str, scene: Scene, numbers: Numbers, on: dict[str, bool]) -> _Verdict:
    """What the criteria say: the one furthest above its threshold speaks, else one not known."""
    found = [(each, each.value(numbers, on)) for each in CRITERIA if each.effect == effect]
    known = [(each, value) for each, value in found if value is not None]
    leading = max(known, key=lambda pair: pair[1] / pair[0].threshold, default=None)
    if leading is not None and leading[1] >= leading[0].threshold:
        criterion, value = leading
        words = f"{criterion.name} = {value:.2g}, at least {criterion.threshold:g}"
        return _Verdict(True, criterion, value, words)
    reason = required(effect, scene, on)
    if reason is not None:
        return _Verdict(True, None, None, reason)
    unknown = next((each for each, value in found if value is None), None)
    if unknown is not None or leading is None:
        assert unknown is not None  # every effect has a criterion
        lacking = "velocity_scale" if numbers.speed is None else "a constant of the fluid"
        return _Verdict(None, unknown, None, f"{unknown.name} unknown, as {lacking} is not given")
    criterion, value = leading
    words = f"{criterion.name} = {value:.2g}, below {criterion.threshold:g}"
    return _Verdict(False, criterion, value, words)


def _derived(effect: str, scene: Scene) -> bool:
    """What `Effects.resolve` makes of an effect that lacks nothing."""
    if effect in ("wall_heat", "energy"):
        return any(wall.heat != Isothermal() for wall in scene.walls)
    return True


def _reason(label: str, verdict: _Verdict, active: bool, origin: str, lack: str | None) -> str:
    state = f"{label} {'on' if active else 'off'}"
    if lack is not None:
        return f"{verdict.words}, but {lack}: {state}" if verdict.called else f"{lack}: {state}"
    if verdict.called is None or origin == "set" or verdict.called == active:
        how = {"set": ", as set", "derived": "" if verdict.called is active else ", as derived"}
        return f"{verdict.words}: {state}{how.get(origin, '')}"
    return f"{verdict.words}, yet {state}, as derived"


def decide(scene: Scene) -> tuple[Decision, ...]:
    """What the numbers of a scene say on each effect, in the order of `effect_rules.ORDER`."""
    given, numbers = scene.effects, Numbers(scene)
    acting = None if given.auto else scene.active_effects
    on: dict[str, bool] = {}
    found = []
    for effect in ORDER:
        lack = missing(effect, scene, numbers, on)
        verdict = _UNASKED if lack == NO_ENERGY else _verdict(effect, scene, numbers, on)
        wish = getattr(given, effect, None)
        active, origin = _derived(effect, scene), "derived"
        if lack is not None:
            active, origin = False, "absent"
        elif wish is not None:
            active, origin = wish, "set"
        elif given.auto and verdict.called is not None:
            active, origin = verdict.called, "regime"
        on[effect] = active = bool(getattr(acting, effect, active))
        criterion = verdict.criterion
        found.append(
            Decision(
                effect=effect,
                called=verdict.called,
                active=active,
                origin=origin,
                symbol="" if criterion is None else criterion.symbol,
                value=verdict.value,
                threshold=None if criterion is None else criterion.threshold,
                changes_means=criterion is not None and criterion.changes_means,
                reason=_reason(effect.replace("_", " "), verdict, active, origin, lack),
            )
        )
    return tuple(found)


def settle(scene: Scene) -> ActiveEffects:
    """The effects of a scene that leaves them to its regime: set ones win, then the numbers."""
    given, decisions = scene.effects, decide(scene)
    by_regime = {each.effect: each.active for each in decisions if each.origin == "regime"}
    heat = by_regime.pop("wall_heat", True)
    settings = replace(given, auto=False, **by_regime)
    heated = heat and any(wall.heat != Isothermal() for wall in scene.walls)
    return settings.resolve(scene.fluid, scene.dimension, scene.body_force, heated=heated)


_LOSS = {
    "fluctuations": "what thermal noise does to the flow is missing",
    "energy": "temperatures and what follows them are missing: effects=sdpd.Effects(energy=True) "
    "or effects='auto'",
    "viscous_heating": "the heat of friction is missing",
    "conduction": "the heat that is conducted is missing",
    "variable_transport": "viscosity and conductivity should follow the temperature",
    "bulk_viscosity": "the stress of compression, or the damping of sound, is missing",
}


def contradictions(scene: Scene) -> Iterator[str]:
    """Warnings on settings that clearly contradict the regime.

    Noise averages out, so that leaving it out is a way to see the mean flow: what changes no means
    is warned of only where the regime was asked, and so are effects that are on without being
    called for, which cost time only.
    """
    asked = scene.effects.auto
    noisy = scene.active_effects.fluctuations
    for each in decide(scene):
        if not each.contradicts or each.effect == "wall_heat":
            continue
        if each.called and (asked or each.changes_means):
            yield f"{each.reason}; {_LOSS[each.effect]}"
        elif not each.called and asked and (each.effect == "fluctuations" or not noisy):
            yield f"{each.reason}; it costs time and changes nothing that is seen"
