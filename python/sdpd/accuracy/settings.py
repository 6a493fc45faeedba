"""What a study turns: resolution, support, kernel, time step, integrator, noise, walls, length."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sdpd import kernels, validation
from sdpd.integrators import Integrator, PairSplitting, VelocityVerlet, of_scene
from sdpd.resolution import DEFAULT_KERNEL, DEFAULT_SUPPORT
from sdpd.wall_models import MODELS

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["NAMES", "Settings", "grid"]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """One way to run a problem.

    Parameters
    ----------
    across : int
        Particles along the length that the problem resolves.
    support : float
        h/dx [1], > 1.
    kernel : str
        One of ``sdpd.kernels.names()``.
    step : float
        Time step over that of ``dt="auto"`` [1].
    integrator : {"pair_splitting", "velocity_verlet"}, optional
        The default of the scene if None.
    iterations : int
        Of velocity Verlet.
    noise : {"uniform", "gaussian"}, optional
        Variates of velocity Verlet; its own default if None.
    bookkeeping : bool
        Where particles have an energy: whether it is kept to rounding.
    calibrate : bool
        As of `Scene`.
    wall_model : str
        "symmetric_images", "own_foot_images", "completion" or "frozen_particles".
    precision : {"double", "mixed"}
        Of the arithmetic of pairs.
    length : float
        Of the run, over that of the problem [1].

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.
    """

    across: int = 16
    support: float = DEFAULT_SUPPORT
    kernel: str = DEFAULT_KERNEL
    step: float = 1.0
    integrator: str | None = None
    iterations: int = 0
    noise: str | None = None
    bookkeeping: bool = True
    calibrate: bool = False
    wall_model: str = "symmetric_images"
    precision: str = "double"
    length: float = 1.0

    def __post_init__(self) -> None:
        across = validation.integer("across", self.across, minimum=2)
        object.__setattr__(self, "across", across)
        for name in ("support", "step", "length"):
            object.__setattr__(self, name, validation.positive(name, getattr(self, name)))
        if self.support <= 1.0:
            raise ValueError(f"`support` must be > 1, got {self.support:g}")
        validation.choice("kernel", self.kernel, kernels.names())
        if self.integrator is not None:
            names = ("pair_splitting", "velocity_verlet")
            validation.choice("integrator", self.integrator, names)
        iterations = validation.integer("iterations", self.iterations, minimum=0)
        object.__setattr__(self, "iterations", iterations)
        if self.noise is not None:
            validation.choice("noise", self.noise, ("uniform", "gaussian"))
        for name in ("bookkeeping", "calibrate"):
            object.__setattr__(self, name, validation.boolean(name, getattr(self, name)))
        validation.choice("wall_model", self.wall_model, list(MODELS))
        validation.choice("precision", self.precision, validation.PRECISIONS)

    def replace(self, **changes: Any) -> Settings:
        """A copy with some of them changed."""
        return dataclasses.replace(self, **changes)

    def make_integrator(self, scene: Scene) -> Integrator:
        """The integrator, for a scene that may choose it.

        Raises
        ------
        ValueError
            If `iterations` or `noise` are for another one.
        """
        name = self.integrator or of_scene(scene).name
        if name == VelocityVerlet.name:
            return VelocityVerlet(
                iterations=self.iterations,
                energy_bookkeeping=self.bookkeeping,
                noise=self.noise or VelocityVerlet.noise,
            )
        if self.iterations or self.noise not in (None, PairSplitting.noise):
            raise ValueError(
                "`iterations` and `noise` must not be given for the pair splitting, got "
                f"{self.iterations} and {self.noise!r}; name integrator='velocity_verlet'"
            )
        return PairSplitting(energy_bookkeeping=self.bookkeeping)

    def label(self, names: Iterable[str]) -> str:
        """Those of these names in short: ``"32 across, h/dx 3, lucy"``."""
        chosen = set(names)
        words = (_SHORT[name](getattr(self, name)) for name in NAMES if name in chosen)
        return ", ".join(filter(None, words))


NAMES = tuple(field.name for field in dataclasses.fields(Settings))

_SHORT: dict[str, Callable[[Any], str]] = {
    "across": lambda x: f"{x} across",
    "support": lambda x: f"h/dx {x:g}",
    "kernel": lambda x: x.replace("_", " "),
    "step": lambda x: f"dt × {x:g}",
    "integrator": lambda x: {"pair_splitting": "splitting", "velocity_verlet": "Verlet"}.get(x, ""),
    "iterations": lambda x: f"{x} iterations",
    "noise": lambda x: f"{x} noise" if x else "",
    "bookkeeping": lambda x: "books" if x else "no books",
    "calibrate": lambda x: "calibrated" if x else "",
    "wall_model": lambda x: x.replace("_", " "),
    "precision": lambda x: f"{x} precision",
    "length": lambda x: f"length {x:g}",
}


def grid(base: Settings | None = None, **axes: Sequence[Any]) -> tuple[Settings, ...]:
    """All combinations of the given values.

    Parameters
    ----------
    base : Settings, optional
        What is not given; the default settings if None.
    **axes
        Names of settings, each with its values.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown, or its values are none or bad.

    Examples
    --------
    >>> from sdpd import accuracy
    >>> [s.support for s in accuracy.grid(across=(8, 16), support=(2.6, 3.0))]
    [2.6, 3.0, 2.6, 3.0]
    """
    start = Settings() if base is None else base
    validation.instance("base", start, Settings, "sdpd.accuracy.Settings")
    for name, values in axes.items():
        if name not in NAMES:
            raise TypeError(f"settings are {', '.join(NAMES)}; got {name!r}")
        given: Any = values
        if isinstance(given, str) or not isinstance(given, Sequence) or not given:
            raise TypeError(f"`{name}` must be a sequence of at least one value, got {values!r}")
    return tuple(
        start.replace(**dict(zip(axes, values, strict=True)))
        for values in itertools.product(*axes.values())
    )
