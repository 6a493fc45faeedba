"""How heat passes a wall; of use where the fluid has an energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from sdpd import validation
from sdpd.box import AXES, Box

__all__ = ["Adiabatic", "HeatFlux", "Isothermal", "WallHeat"]


class WallHeat:
    """Base of the thermal conditions at walls."""

    kind: ClassVar[str] = ""

    def check(self, box: Box, name: str) -> None:
        """Raise ValueError if it does not go with the box."""

    def core(self, temperature: float, area: float, dimension: int) -> tuple[str, list[float]]:
        """Name and numbers for the core; `temperature` is that of the fluid."""
        raise NotImplementedError

    def temperature_at(self, points: Any, temperature: float) -> Any:
        """Temperature of the wall at points (N, D); that of the fluid if it has none of its own."""
        import numpy as np

        return np.full(len(points), temperature)


@dataclass(frozen=True)
class Isothermal(WallHeat):
    """A wall of given temperature.

    Parameters
    ----------
    temperature : float, optional
        [temperature]; that of the fluid if None. With a gradient: at the origin of the box.
    gradient : sequence of float, D of them, optional
        Of the temperature along the wall [temperature/length]; 0 along periodic axes.

    Raises
    ------
    ValueError
        If the temperature is not finite and > 0.
    """

    kind: ClassVar[str] = "isothermal"

    temperature: float | None = None
    gradient: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        value = validation.optional_positive("temperature", self.temperature)
        object.__setattr__(self, "temperature", value)
        if self.gradient is not None:
            gradient = validation.vector("gradient", self.gradient)
            object.__setattr__(self, "gradient", gradient)

    def check(self, box: Box, name: str) -> None:  # noqa: D102
        if self.gradient is None:
            return
        if len(self.gradient) != box.dimension:
            raise ValueError(
                f"`{name}.gradient` must have {box.dimension} entries, got {len(self.gradient)}"
            )
        for axis, slope in zip(AXES, self.gradient, strict=False):
            if slope != 0.0 and axis in box.periodic_axes:
                raise ValueError(
                    f"`{name}.gradient` must be 0 along the periodic axis {axis}, got {slope:g}"
                )

    def core(self, temperature: float, area: float, dimension: int) -> tuple[str, list[float]]:  # noqa: D102
        gradient = self.gradient or (0.0,) * dimension
        return self.kind, [self.temperature or temperature, *gradient]

    def temperature_at(self, points: Any, temperature: float) -> Any:  # noqa: D102
        import numpy as np

        own = self.temperature or temperature
        return own + np.asarray(points) @ np.asarray(self.gradient or (0.0,) * points.shape[1])


@dataclass(frozen=True)
class Adiabatic(WallHeat):
    """A wall that no heat passes; friction with it heats the fluid all the same."""

    kind: ClassVar[str] = "adiabatic"

    def core(self, temperature: float, area: float, dimension: int) -> tuple[str, list[float]]:  # noqa: D102
        return self.kind, []


@dataclass(frozen=True)
class HeatFlux(WallHeat):
    """A wall through which a given heat flows.

    Parameters
    ----------
    density : float
        q into the fluid [energy/(time length^(D-1))]; negative: out of it.
    """

    kind: ClassVar[str] = "flux"

    density: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", validation.finite("density", self.density))

    def core(self, temperature: float, area: float, dimension: int) -> tuple[str, list[float]]:  # noqa: D102
        return self.kind, [self.density * area]


KINDS: dict[str, type[WallHeat]] = {kind.kind: kind for kind in (Isothermal, Adiabatic, HeatFlux)}
