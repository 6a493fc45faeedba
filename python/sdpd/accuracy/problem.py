"""A problem with a reference: a scene made from settings, how it is run, and what is right."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sdpd import validation
from sdpd.accuracy.settings import NAMES, Settings
from sdpd.analysis import Estimate
from sdpd.errors import PairingWarning, ResolutionWarning, TimeStepWarning
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd.simulation import Simulation

__all__ = ["Problem"]

Reference = Callable[[Scene], float] | Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A problem whose right answer is known.

    Parameters
    ----------
    name, title : str
        A word for files, and a line for people.
    error_of : str
        What the error is of, and what it is relative to.
    source : str
        The reference in words.
    scene : callable
        Makes the scene of given `Settings`.
    measure : callable
        Takes a fresh simulation and its settings, runs it and returns an
        :class:`~sdpd.analysis.Estimate`, with a standard error of 0 where there is no noise.
    reference : callable or mapping, optional
        What is right: a function of the scene (closed form, equilibrium value), or the settings to
        change for a finer run (a value, or a function of the present one), which is then run first.
        None if `measure` returns the error itself
        (the rms deviation of a profile, the drift of what should be conserved).
    base : Settings
        What is not turned.
    takes : sequence of str
        Names of the settings that mean something here.
    noisy : bool
        Whether results depend on the seed.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    A wave that decays without noise, against a finer run:

    >>> import sdpd
    >>> import numpy as np
    >>> from sdpd.accuracy import Problem, Settings, study
    >>> from sdpd.analysis import Estimate
    >>> def scene(settings):
    ...     return sdpd.Scene(
    ...         fluid=sdpd.fluids.water().in_plane(1e-4),
    ...         box=sdpd.Box((1e-3, 1e-3)),
    ...         resolution=sdpd.Resolution(particles=(settings.across,) * 2),
    ...         effects=sdpd.Effects(fluctuations=False),
    ...         velocity_scale=1e-5,
    ...     )
    >>> def energy(sim, settings):
    ...     sim.velocities[:, 0] = 1e-5 * np.sin(2e3 * np.pi * sim.positions[:, 1])
    ...     sim.run(time=0.01, progress=False)
    ...     return Estimate(sim.kinetic_energy, 0.0)
    >>> import numpy as np
    >>> mine = Problem(
    ...     name="wave", title="decay of a wave", error_of="kinetic energy", source="finer run",
    ...     scene=scene, measure=energy, reference={"across": 24}, takes=("across",),
    ... )
    >>> found = study(mine, [Settings(across=8), Settings(across=12)])
    >>> found.rows[0].error > found.rows[1].error
    True
    """

    name: str
    title: str
    error_of: str
    source: str
    scene: Callable[[Settings], Scene]
    measure: Callable[[Simulation, Settings], Estimate]
    reference: Reference | None = None
    base: Settings = Settings()
    takes: tuple[str, ...] = ("across", "support", "kernel", "step", "precision")
    noisy: bool = False

    def __post_init__(self) -> None:
        validation.instance("base", self.base, Settings, "sdpd.accuracy.Settings")
        for name in ("scene", "measure"):
            if not callable(getattr(self, name)):
                raise TypeError(f"`{name}` must be callable, got {getattr(self, name)!r}")
        object.__setattr__(self, "takes", tuple(self.takes))
        for name in self.takes:
            validation.choice("takes", name, NAMES)
        if isinstance(self.reference, Mapping):
            self.check(self.finer(self.base))
            return
        given: Any = self.reference
        if given is not None and not callable(given):
            expected = "a function of the scene, a mapping of settings or None"
            raise TypeError(f"`reference` must be {expected}, got {given!r}")

    def finer(self, settings: Settings) -> Settings:
        """Settings of the finer run that is the reference, or the same if another one is."""
        changes = self.reference if isinstance(self.reference, Mapping) else {}
        return settings.replace(
            **{
                name: value(getattr(settings, name)) if callable(value) else value
                for name, value in changes.items()
            }
        )

    def check(self, settings: Settings) -> None:
        """Raise ValueError where settings differ from the base and the problem takes none."""
        for name in NAMES:
            given, usual = getattr(settings, name), getattr(self.base, name)
            if name not in self.takes and given != usual:
                raise ValueError(
                    f"`{name}` must be {usual!r} for the problem {self.name!r}, which takes "
                    f"{', '.join(self.takes)}; got {given!r}"
                )

    def simulation(self, settings: Settings, *, seed: int = 0) -> Simulation:
        """A fresh simulation on one thread; poor settings are meant: their warnings are silent."""
        from sdpd.simulation import Simulation

        with warnings.catch_warnings():
            for kind in (PairingWarning, ResolutionWarning, TimeStepWarning):
                warnings.simplefilter("ignore", kind)
            scene = self.scene(settings)
            sim = Simulation(
                scene,
                integrator=settings.make_integrator(scene),
                precision=settings.precision,
                seed=seed,
                threads=1,
            )
            if settings.step != 1.0:
                sim.dt = settings.step * sim.dt
        return sim
