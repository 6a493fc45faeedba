r"""What can be averaged, and what must be summed for it.

Every average is a function of sums over particles with weights w: those of a kernel around a
point, or one over the volume of the bin a particle is in. Plain sums are densities; means divide by
the sum of the weights (Shepard). Sums of many frames are pooled before a quotient is formed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.box import AXES

if TYPE_CHECKING:
    from .state import State

__all__ = ["BUILT_IN", "DEFAULT", "Quantity", "Recipe", "recipe"]

Array = NDArray[np.float64]
Source = Callable[[Any], Any]

DEFAULT = ("density", "velocity", "temperature", "pressure")
BUILT_IN = (
    "number_density",
    "density",
    "momentum_density",
    "velocity",
    "temperature",
    "pressure",
    "particle_density",
    "internal_temperature",
)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Something to average that each particle has.

    Parameters
    ----------
    name : str
        Its name in the results.
    values : callable
        Called with the simulation (or, for a trajectory, with its `State`); returns an array of
        shape (N,) or (N, C).
    kind : {"mean", "sum"}
        A mean over the particles in reach (Shepard), or a plain sum: an amount per volume.
    unit : str
        Of the values, for labels.
    components : sequence of str
        Names of C components; x, y, z or 0, 1, ... if not given.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpd import fields
    >>> speed = fields.Quantity(
    ...     name="speed", values=lambda sim: np.linalg.norm(sim.velocities, axis=1), unit="m/s"
    ... )
    """

    name: str
    values: Source
    kind: str = "mean"
    unit: str = ""
    components: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        name = validation.text("name", self.name)
        if not name or name in BUILT_IN:
            raise ValueError(f"`name` must be another than those built in, got {name!r}")
        if not callable(self.values):
            raise TypeError(f"`values` must be callable, got {type(self.values).__name__}")
        validation.choice("kind", self.kind, ("mean", "sum"))
        validation.text("unit", self.unit)
        object.__setattr__(self, "components", tuple(self.components))


@dataclass(frozen=True)
class Recipe:
    """How a quantity comes from named columns of sums.

    Attributes
    ----------
    name, unit : str
    columns : tuple of str
        Sums it needs, beside that of the weights.
    components : tuple of str
        Empty for a number.
    kind : str
        What `evaluate` does.
    boltzmann_constant : float
    """

    name: str
    unit: str
    columns: tuple[str, ...]
    components: tuple[str, ...]
    kind: str
    boltzmann_constant: float = 1.0

    def evaluate(self, sums: dict[str, Array], frames: Array | float) -> Array:
        """Value from sums of shape (..., P) or (..., P, C), over so many frames."""
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.kind == "count":
                return sums["one"] / frames
            if self.kind == "temperature":
                return self._temperature(sums)
            first = sums[self.columns[0]]
            if self.kind == "sum":
                return first / frames
            weight = sums[self.columns[1]] if len(self.columns) > 1 else sums["one"]
            return first / (weight[..., None] if first.ndim > weight.ndim else weight)

    def _temperature(self, sums: dict[str, Array]) -> Array:
        """m <|v - u|^2>/(D k_B) with u from the same particles, which takes part of the spread.

        Weights that spread over n = (sum w)^2/sum w^2 particles leave 1 - 1/n of it.
        """
        momentum = sums["momentum"]
        peculiar = sums["twice_kinetic"] - np.square(momentum).sum(axis=-1) / sums["mass"]
        left = 1.0 - sums["square"] / sums["one"] ** 2
        left = np.where(left > 1e-9, left, np.nan)  # one particle has no temperature
        freedom = momentum.shape[-1] * self.boltzmann_constant
        return np.asarray(peculiar / (freedom * sums["one"] * left))


# Columns of sums that are known: what each particle contributes.
def _need(state: State, name: str) -> Array:
    value = getattr(state, name)
    if value is None:
        raise ValueError(
            f"`quantities` has one that needs `{name}` of the particles, which are not given"
        )
    return np.asarray(value)


_COLUMNS: dict[str, Callable[[State], Array]] = {
    "mass": lambda state: np.asarray(state.mass),
    "momentum": lambda state: state.mass[:, None] * _need(state, "velocities"),
    "twice_kinetic": lambda state: state.mass * np.square(_need(state, "velocities")).sum(axis=1),
    "pressure": lambda state: _need(state, "pressures"),
    "particle_density": lambda state: _need(state, "densities"),
    "internal_temperature": lambda state: _need(state, "temperatures"),
}


def column_values(name: str, state: State, source: Any, custom: dict[str, Quantity]) -> Array:
    """What each particle contributes to a column, (N,) or (N, C); `source` is for custom ones."""
    if name in _COLUMNS:
        return _COLUMNS[name](state)
    values = np.asarray(custom[name].values(source))
    count = len(state.positions)
    if values.ndim not in (1, 2) or len(values) != count:
        raise ValueError(
            f"`values` of quantity {name!r} must have shape ({count},) or ({count}, C), got "
            f"{values.shape}"
        )
    shape = (count,) if values.ndim == 1 else (count, None)
    return validation.real_array(f"values of {name}", values, shape)


def recipe(quantity: str | Quantity, state: State) -> Recipe:
    """The recipe of a quantity; that of a custom one lacks its components.

    Raises
    ------
    ValueError
        If there is no quantity of that name.
    """
    if isinstance(quantity, Quantity):
        columns = (quantity.name,)
        return Recipe(quantity.name, quantity.unit, columns, quantity.components, quantity.kind)
    name = validation.choice("quantities", quantity, BUILT_IN)
    axes = tuple(AXES[: state.dimension])
    made = {
        "number_density": Recipe(name, "", (), (), "count"),
        "density": Recipe(name, "", ("mass",), (), "sum"),
        "momentum_density": Recipe(name, "", ("momentum",), axes, "sum"),
        "velocity": Recipe(name, "", ("momentum", "mass"), axes, "mean"),
        "temperature": Recipe(name, "", ("momentum", "mass", "twice_kinetic"), (), "temperature"),
        "pressure": Recipe(name, "", ("pressure",), (), "mean"),
        "particle_density": Recipe(name, "", ("particle_density",), (), "mean"),
        "internal_temperature": Recipe(name, "", ("internal_temperature",), (), "mean"),
    }[name]
    unit = built_in_unit(name, state.dimension, si=state.si)
    return replace(made, unit=unit, boltzmann_constant=state.boltzmann_constant)


def with_components(made: Recipe, values: Array) -> Recipe:
    """The recipe of a custom quantity, components named once its values are known."""
    width = 0 if values.ndim == 1 else values.shape[1]
    names = made.components
    if not names and width:
        names = tuple(AXES[:width]) if width in (2, 3) else tuple(map(str, range(width)))
    if len(names) != width:
        raise ValueError(
            f"`components` of quantity {made.name!r} must name {width} components, got {names}"
        )
    return replace(made, components=names)


def built_in_unit(name: str, dimension: int, *, si: bool) -> str:
    """Unit in the SI, or dimension."""
    volume = f"m^{dimension}" if si else f"length^{dimension}"
    flux = f"kg/(m^{dimension - 1} s)" if si else f"mass/(length^{dimension - 1} time)"
    if dimension == 2:
        flux = flux.replace("^1", "")
    mass, pressure = ("kg", "Pa" if dimension == 3 else "N/m") if si else ("mass", "")
    return {
        "number_density": f"1/{volume}",
        "density": f"{mass}/{volume}",
        "particle_density": f"{mass}/{volume}",
        "momentum_density": flux,
        "velocity": "m/s" if si else "length/time",
        "temperature": "K" if si else "temperature",
        "internal_temperature": "K" if si else "temperature",
        "pressure": pressure or f"energy/length^{dimension}",
        "diffusivity": "m^2/s" if si else "length^2/time",
    }[name]


def check_quantities(quantities: Sequence[str | Quantity] | str | Quantity) -> tuple[Any, ...]:
    """The quantities, each once."""
    if isinstance(quantities, (str, Quantity)):
        quantities = (quantities,)
    for index, item in enumerate(quantities):
        if isinstance(item, str):
            validation.choice(f"quantities[{index}]", item, BUILT_IN)
        else:
            expected = "a name or an sdpd.fields.Quantity"
            validation.instance(f"quantities[{index}]", item, Quantity, expected)
    names = [item if isinstance(item, str) else item.name for item in quantities]
    if len(set(names)) != len(names) or not names:
        raise ValueError(f"`quantities` must name at least one, each once, got {names}")
    return tuple(quantities)
