"""A scene with each effect on and off, as far as it can be either."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from sdpd import validation
from sdpd.effects import Effects
from sdpd.equations_of_state import IdealGas
from sdpd.errors import silenced
from sdpd.integrators import Integrator, PairSplitting, of_scene
from sdpd.scene import Scene

__all__ = ["EFFECTS", "Variant", "variants"]

EFFECTS = (
    "fluctuations",
    "bulk_viscosity",
    "body_force",
    "energy",
    "viscous_heating",
    "conduction",
    "variable_transport",
)
_OF_ENERGY = ("viscous_heating", "conduction", "variable_transport")


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A scene with an effect on and with it off.

    Attributes
    ----------
    effect : str
    on, off : Scene
        One of them has the effects of the scene itself.
    own : bool
        Whether the effect acts in the scene itself.
    integrator : Integrator
        Of both: the pair splitting where one of them takes it by default.
    """

    effect: str
    on: Scene
    off: Scene
    own: bool
    integrator: Integrator


def _flipped(effects: Effects, name: str) -> Effects:
    """With one effect the other way; what hangs on it is derived anew."""
    loose: dict[str, tuple[str, ...]] = {
        "energy": _OF_ENERGY,
        "viscous_heating": ("variable_transport",),
        "conduction": ("variable_transport",),
    }
    changes: dict[str, Any] = dict.fromkeys(loose.get(name, ()))
    return replace(effects, **changes, **{name: not getattr(effects, name)})


def _sound(scene: Scene, name: str) -> float | None:
    """Speed of sound of both sides: that of the scene, unless there is no choice."""
    law = scene.fluid.equation_of_state
    given = law.sound_speed is not None or "sound_speed" in law.unused
    gas = isinstance(law, IdealGas) and name == "energy"  # with an energy it has its own
    return scene.sound_speed if given or gas else scene.sound.speed


def variants(scene: Scene, effects: tuple[str, ...]) -> tuple[list[Variant], dict[str, str]]:
    """The pairs of scenes to compare, and why there is none for the other effects.

    Parameters
    ----------
    scene : Scene
    effects : tuple of str
        Of `EFFECTS`.
    """
    found, left_out = [], {}
    fixed = scene.active_effects.settings()
    with silenced():  # the scene itself has warned
        for name in effects:
            validation.choice("effects", name, EFFECTS)
            own = bool(getattr(scene.active_effects, name))
            try:
                sound = _sound(scene, name)
                other = scene.replace(effects=_flipped(fixed, name), sound_speed=sound)
                kinds = (of_scene(scene), of_scene(other))
            except ValueError as error:
                left_out[name] = str(error)
                continue
            splitting = any(isinstance(kind, PairSplitting) for kind in kinds)
            on, off = (scene, other) if own else (other, scene)
            kind = PairSplitting() if splitting else kinds[0]
            found.append(Variant(effect=name, on=on, off=off, own=own, integrator=kind))
    return found, left_out
