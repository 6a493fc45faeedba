"""The compiled core. Users want `sdpd.Scene` and `sdpd.Simulation`; this is what those call."""

from collections.abc import Callable
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Float: TypeAlias = NDArray[np.float64]

__all__ = [
    "Core",
    "Correlator",
    "Currents",
    "HeatCorrelator",
    "HeatCurrent",
    "Profile",
    "Solid",
    "Stress",
    "StressCorrelator",
    "Thermodynamics",
    "WallField",
    "WallForces",
    "__version__",
    "caloric_evaluate",
    "check_walls",
    "curvature_weight",
    "eos_evaluate",
    "kernel_names",
    "kernel_profile",
    "kernel_sums",
    "list_margin",
    "normal_velocities",
    "pair_variates",
    "philox4x32",
    "registry_table",
    "relax_positions",
    "uniform_positions",
    "wall_completion",
]
__version__: str

def kernel_names() -> list[str]: ...
def kernel_profile(kernel: str, dimension: int, q: _Float) -> tuple[_Float, _Float]: ...
def eos_evaluate(
    kind: str, parameters: list[float], density: _Float
) -> tuple[_Float, _Float, _Float]: ...
def caloric_evaluate(
    eos: tuple[str, list[float], str], densities: _Float, temperatures: _Float
) -> tuple[_Float, _Float, _Float, _Float, _Float, _Float]: ...
def philox4x32(counter: list[int], key: list[int]) -> list[int]: ...
def pair_variates(
    seed: int,
    stream: str,
    step: int,
    draw: int,
    id_a: NDArray[np.uint64],
    id_b: NDArray[np.uint64],
    variate: str,
    dimension: int,
) -> _Float: ...
def registry_table() -> list[dict[str, Any]]: ...
def normal_velocities(n: int, dimension: int, seed: int) -> _Float: ...
def uniform_positions(n: int, dimension: int, seed: int) -> _Float: ...
def list_margin(
    *,
    particles: int,
    dimension: int,
    shortest_edge: float,
    dt: float,
    thermal_speed: float,
    flow_speed: float,
    friction_time: float,
    shuffles: bool,
) -> float: ...
def relax_positions(
    positions: _Float,
    edges: list[float],
    support: float,
    iterations: int,
    first: int = 0,
    last: int | None = None,
    threads: int = 1,
    periodic: list[bool] = ...,
    walls: list[tuple[str, list[float]]] = ...,
    fields: list[WallField] = ...,
    volume: float | None = None,
) -> tuple[_Float, float]: ...
def kernel_sums(
    points: _Float,
    positions: _Float,
    values: _Float,
    *,
    edges: list[float],
    support: float,
    kernel: str,
    threads: int = 1,
) -> _Float: ...
def curvature_weight(kernel: str, dimension: int, q: _Float) -> tuple[_Float, _Float]: ...
def wall_completion(dimension: int, s: _Float) -> _Float: ...
def check_walls(
    edges: list[float],
    support: float,
    periodic: list[bool],
    walls: list[tuple[str, list[float]]],
    fields: list[WallField] = ...,
) -> None: ...

@final
class Thermodynamics:
    @property
    def columns(self) -> list[str]: ...
    def table(self) -> _Float: ...

@final
class Solid:
    def __new__(cls, points: _Float, triangles: NDArray[np.uint32], threads: int) -> Solid: ...
    def distances(self, points: _Float) -> NDArray[np.float64]: ...
    def crossing(self) -> tuple[int, int] | list[int] | None: ...

@final
class WallField:
    def __new__(
        cls,
        distance: Callable[[_Float], _Float],
        edges: list[float],
        periodic: list[bool],
        support: float,
        kernel: str,
        threads: int,
        spacing: float | None = None,
    ) -> WallField: ...
    def evaluate(self, points: _Float) -> tuple[_Float, _Float, _Float, _Float]: ...
    def surface(self) -> tuple[_Float, _Float]: ...
    def report(self) -> dict[str, Any]: ...

@final
class WallForces:
    def table(self) -> _Float: ...

@final
class Profile:
    def table(self) -> _Float: ...

@final
class Correlator:
    def lags(self) -> _Float: ...
    def blocks(self) -> _Float: ...
    def block_length(self) -> int: ...
    def units(self) -> tuple[float, float]: ...

@final
class Currents:
    def lags(self) -> _Float: ...
    def blocks(self) -> _Float: ...
    def block_length(self) -> int: ...
    def units(self) -> tuple[float, float]: ...

@final
class Stress:
    def table(self) -> _Float: ...

@final
class StressCorrelator:
    def lags(self) -> _Float: ...
    def blocks(self) -> _Float: ...
    def block_length(self) -> int: ...
    def units(self) -> tuple[float, float]: ...

@final
class HeatCurrent:
    def table(self) -> _Float: ...

@final
class HeatCorrelator:
    def lags(self) -> _Float: ...
    def blocks(self) -> _Float: ...
    def block_length(self) -> int: ...
    def units(self) -> tuple[float, float]: ...

@final
class Core:
    def __new__(
        cls,
        positions: _Float,
        velocities: _Float,
        *,
        box: list[float],
        support: float,
        mass: float,
        thermal_energy: float,
        kernel: str,
        friction: str,
        friction_across: float,
        friction_along: float,
        eos: tuple[str, list[float]],
        noise: str,
        integrator: str,
        iterations: int,
        body_force: tuple[list[float], tuple[int, int] | None] | None,
        dt: float,
        seed: int,
        skin: float | None,
        threads: int,
        flow_speed: float = 0.0,
        periodic: list[bool] = ...,
        walls: list[tuple[str, list[float]]] = ...,
        fields: list[WallField] = ...,
        wall_model: tuple[str, list[float]] | None = None,
        frozen: _Float | None = None,
        exchanges: str = ...,
        thermal: dict[str, Any] | None = ...,
        temperatures: _Float | None = ...,
    ) -> Core: ...
    @property
    def positions(self) -> _Float: ...
    @property
    def velocities(self) -> _Float: ...
    @property
    def forces(self) -> _Float: ...
    @property
    def number_densities(self) -> _Float: ...
    @property
    def densities(self) -> _Float: ...
    @property
    def pressures(self) -> _Float: ...
    @property
    def temperatures(self) -> _Float | None: ...
    @property
    def internal_energies(self) -> _Float | None: ...
    @property
    def entropies(self) -> _Float | None: ...
    @property
    def ids(self) -> NDArray[np.uint64]: ...
    @property
    def images(self) -> NDArray[np.int32]: ...
    @property
    def step(self) -> int: ...
    @property
    def time(self) -> float: ...
    def run(self, steps: int, dt: float) -> None: ...
    def refresh(self) -> None: ...
    def move_wall(self, index: int, wall: tuple[str, list[float]]) -> None: ...
    def force_parts(self, step: int | None = None, walls: bool = False) -> dict[str, _Float]: ...
    def pair_order(self) -> NDArray[np.uint32]: ...
    def pairs_by_round(self) -> list[int]: ...
    def wall_link_order(self) -> NDArray[np.uint32]: ...
    def wall_forces(self) -> _Float: ...
    def wall_impulses(self) -> _Float: ...
    def energy_accounts(self) -> dict[str, Any] | None: ...
    def friction_rate(self) -> float: ...
    def statistics(self) -> dict[str, Any]: ...
    def attach_thermodynamics(self, every: int) -> Thermodynamics: ...
    def attach_stress(self, every: int) -> Stress: ...
    def attach_correlator(self, every: int, points: int, levels: int) -> Correlator: ...
    def attach_wall_forces(self, every: int) -> WallForces: ...
    def attach_profile(
        self,
        every: int,
        wall: bool,
        index: int,
        interval: tuple[float, float],
        bins: int,
        block: int,
    ) -> Profile: ...
    def attach_stress_correlator(
        self, every: int, points: int, levels: int, parts: bool
    ) -> StressCorrelator: ...
    def attach_heat_current(self, every: int) -> HeatCurrent: ...
    def attach_heat_correlator(self, every: int, points: int, levels: int) -> HeatCorrelator: ...
    def attach_currents(
        self, every: int, wave_vectors: list[list[int]], points: int, levels: int
    ) -> Currents: ...
    def detach_all(self) -> None: ...
    def state(self) -> dict[str, Any]: ...
    def set_state(self, state: dict[str, Any]) -> None: ...
