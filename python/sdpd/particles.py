"""The particles of a simulation: live views of their arrays, and numbers that follow from them."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import initial, validation
from sdpd.scene import Scene

if TYPE_CHECKING:
    from sdpd._core import Core

__all__ = ["EnergyAccounts", "Particles"]

Array = NDArray[np.float64]


def _without_energy(name: str) -> AttributeError:
    return AttributeError(
        f"`{name}` are those of a fluid with an energy: make the scene with "
        "effects=sdpd.Effects(energy=True)"
    )


@dataclass(frozen=True, eq=False)
class EnergyAccounts:
    """Energy that a fluid has exchanged, see `Simulation.energy_accounts`.

    The total energy has changed by `gained`, to rounding where the integrator keeps the books (and
    friction heats: without viscous heating it exchanges energy with a bath that has no account).

    Attributes
    ----------
    body_work : float
        Work of the body force [energy]; kept where the integrator keeps the books.
    wall_heat : ndarray of float64, shape (walls,)
        Heat that each wall has received [energy].
    wall_work : ndarray of float64, shape (walls,)
        Work that each wall has done on the fluid by moving [energy].
    discarded : float
        What adiabats alone would have added to the energy [energy].
    unbooked : float
        What has come in where the work of a step was more than a particle had, and its adiabat
        stood [energy]: 0 but for temperatures near zero.
    refused : int
        Updates of pairs that would have left a particle without energy and were not made.
    """

    body_work: float
    wall_heat: Array
    wall_work: Array
    discarded: float
    unbooked: float
    refused: int

    @property
    def gained(self) -> float:
        """Body work and wall work, less wall heat, and what was not booked [energy]."""
        walls = float(self.wall_work.sum() - self.wall_heat.sum())
        return self.body_work + walls + self.unbooked


class Particles:
    """Arrays and totals of `Simulation`, which adds the scene and the core named here."""

    _scene: Scene
    _core: Core
    _settings: dict[str, Any]
    _runner: int | None  # the thread whose run is under way

    # --- arrays ------------------------------------------------------------------------------

    @property
    def positions(self) -> Array:
        """Positions inside the box, (N, D) [length]; a live view, writable."""
        return self._core.positions

    @positions.setter
    def positions(self, value: ArrayLike) -> None:
        self._assign(self._core.positions, initial.check_positions(self._scene, value))

    @property
    def velocities(self) -> Array:
        """Velocities, (N, D) [length/time]; a live view, writable."""
        return self._core.velocities

    @velocities.setter
    def velocities(self, value: ArrayLike) -> None:
        self._assign(self._core.velocities, initial.check_velocities(self._scene, value))

    def _assign(self, view: Array, value: Array) -> None:
        if self._runner not in (None, threading.get_ident()):
            raise RuntimeError(
                "the simulation is running in another thread; wait until its run() returns, "
                "or assign in a callback"
            )
        before = view.copy()
        view[...] = value
        try:
            self.refresh()
        except (RuntimeError, ValueError):  # someone else holds the core, or has written nonsense
            view[...] = before
            raise

    @property
    def unwrapped(self) -> Array:
        """Positions that went on through the periodic boundaries, (N, D) [length]; a copy."""
        return np.asarray(self.positions + self.images * np.asarray(self._scene.box.lengths))

    @property
    def images(self) -> NDArray[np.int32]:
        """How often each particle has crossed the box along each axis, (N, D); read-only view."""
        return self._core.images

    @property
    def forces(self) -> Array:
        """Force between the particles, (N, D) [mass length/time^2]; read-only view.

        Of the pressure alone under the pair splitting, which has no friction and no random force
        but exchanges of momentum; all three under velocity Verlet, as the step evaluated them.
        A body force is not contained.
        """
        return self._core.forces

    @property
    def number_densities(self) -> Array:
        """Sum of the kernel over all particles, itself included, (N,) [1/length^D]; read-only."""
        return self._core.number_densities

    @property
    def densities(self) -> Array:
        """Mass densities, (N,) [mass/length^D]; read-only view."""
        return self._core.densities

    @property
    def pressures(self) -> Array:
        """Pressures of the equation of state, (N,) [energy/length^D]; read-only view."""
        return self._core.pressures

    @property
    def temperatures(self) -> Array:
        """Temperatures of the particles, (N,) [temperature]; a live view, writable.

        Only of a fluid with an energy (``sdpd.Effects(energy=True)``), like the next two; their
        motion has a temperature of its own, `temperature`.
        """
        return self._energetic("temperatures", self._core.temperatures)

    @temperatures.setter
    def temperatures(self, value: ArrayLike) -> None:
        self._assign(self.temperatures, initial.check_temperatures(self._scene, value))

    @property
    def internal_energies(self) -> Array:
        """Internal energies of the particles, (N,) [energy]; read-only view.

        Their zero depends on the equation of state.
        """
        return self._energetic("internal_energies", self._core.internal_energies)

    @property
    def entropies(self) -> Array:
        """Entropies of the particles, (N,) [energy/temperature]; read-only view.

        Absolute for a monatomic gas in SI units, else zero at the state that the equation of state
        refers to.
        """
        return self._energetic("entropies", self._core.entropies)

    def _energetic(self, name: str, view: Array | None) -> Array:
        if view is None:
            raise _without_energy(name)
        return view

    @property
    def ids(self) -> NDArray[np.uint64]:
        """Persistent ids, (N,); read-only view."""
        return self._core.ids

    # --- numbers -----------------------------------------------------------------------------

    @property
    def momentum(self) -> Array:
        """Total momentum, (D,) [mass length/time]."""
        return np.asarray(self._scene.particle_mass * self.velocities.sum(axis=0))

    @property
    def kinetic_energy(self) -> float:
        """Sum of m v^2/2 [energy]."""
        return float(0.5 * self._scene.particle_mass * np.square(self.velocities).sum())

    @property
    def potential_energy(self) -> float:
        """Sum of m e(rho), e the integral of P/rho^2 [energy]; its zero depends on the EOS.

        Of a fluid without an energy of its own: see `internal_energy`.
        """
        from sdpd import _core

        if self._scene.active_effects.energy:
            raise AttributeError(
                "`potential_energy` is that of an isothermal fluid; this one has an "
                "`internal_energy`"
            )

        kind, parameters = self._settings["eos"]
        specific = _core.eos_evaluate(kind, list(parameters), self.densities)[2]
        return float(self._scene.particle_mass * specific.sum())

    @property
    def temperature(self) -> float:
        """Kinetic temperature m sum |v - <v>|^2/(D (N - 1) k_B) [temperature]; 0 for N = 1."""
        number, dimension = self.velocities.shape
        peculiar = self.velocities - self.velocities.mean(axis=0)
        energy = self._scene.particle_mass * float(np.square(peculiar).sum())
        freedom = dimension * max(1, number - 1)
        return float(energy / (freedom * self._scene.fluid.boltzmann_constant))

    @property
    def internal_energy(self) -> float:
        """Sum of the particles' internal energies [energy]."""
        return float(self.internal_energies.sum())

    @property
    def total_energy(self) -> float:
        """Kinetic and internal energy [energy]; of an isothermal fluid kinetic and potential."""
        if self._scene.active_effects.energy:
            return self.kinetic_energy + self.internal_energy
        return self.kinetic_energy + self.potential_energy

    @property
    def entropy(self) -> float:
        """Sum of the particles' entropies [energy/temperature]."""
        return float(self.entropies.sum())

    def energy_accounts(self) -> EnergyAccounts:
        """Where energy has come from and gone to since the simulation was made.

        Returns
        -------
        EnergyAccounts

        Raises
        ------
        AttributeError
            If the fluid has no energy.
        """
        accounts = self._core.energy_accounts()
        if accounts is None:
            raise _without_energy("energy_accounts")
        return EnergyAccounts(
            body_work=accounts["body_work"],
            wall_heat=accounts["walls"][:, 0].copy(),
            wall_work=accounts["walls"][:, 1].copy(),
            discarded=accounts["discarded"],
            unbooked=accounts["unbooked"],
            refused=accounts["refused"],
        )

    def force_parts(self, step: int | None = None, *, walls_only: bool = False) -> dict[str, Array]:
        """The force of the present state, part by part.

        Friction is that of constant coefficients; of a fluid with an energy the random part is 0:
        its noise is exchanged pair by pair.

        Parameters
        ----------
        step : int, optional
            Step whose noise is wanted; the present one if None.
        walls_only : bool
            Of what is behind walls alone: of virtual particles, that is images.

        Returns
        -------
        dict of ndarray, shape (N, D)
            "conservative", "dissipative", and "random" as velocity Verlet draws it
            [mass length/time^2].
        """
        if step is not None:
            step = validation.integer("step", step, minimum=0, maximum=validation.LARGEST)
        walls = validation.boolean("walls_only", walls_only)
        return self._core.force_parts(step, walls)

    def friction_rate(self) -> float:
        """Initial decay rate of the velocity autocorrelation in the present state [1/time].

        (1/m) <sum_j g_ij> (a + b/D), without a fit: k_B T/m over it is the short-time diffusion.
        """
        return self._core.friction_rate()

    def statistics(self) -> dict[str, Any]:
        """Sizes and counts: pairs, bytes, skin, margin, renewals, prunings, wall crossings."""
        return self._core.statistics()

    def refresh(self) -> None:
        """Bring derived arrays up to date with what was written into the state's arrays.

        Raises
        ------
        ValueError
            If a written value is not finite, or a temperature not > 0.
        """
        self._core.refresh()
