"""What follows from a scene: particles, scales, speed of sound, friction, discrete factors.

Friction f_i = -sum_j g_ij [a v_ij + b e e.v_ij] with a = eta (1 + 2/D) - zeta and
b = (D + 2)(zeta + eta (1 - 2/D)); central form a = 0, b = 2 (D + 2) eta (docs/theory).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from sdpd import kernels, loading, structure
from sdpd.box import AXES, Box
from sdpd.discretization import DiscreteFactors, discrete_factors, pairs_per_particle
from sdpd.effects import ActiveEffects, BodyForce, Effects, SinusoidalForce, UniformForce
from sdpd.equations_of_state import IdealGas
from sdpd.fluids import Fluid
from sdpd.geometry import Geometry
from sdpd.initial import LatticeStart, Start
from sdpd.resolution import Layout, Resolution
from sdpd.sound import CompressedState, SoundSpeed, choose_sound_speed
from sdpd.wall_heat import Isothermal
from sdpd.walls import Wall

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["SceneQuantities"]


class SceneQuantities:
    """Derived quantities of `Scene`, which adds the arguments named here."""

    fluid: Fluid
    box: Box
    resolution: Resolution
    start: Start
    effects: Effects
    body_force: BodyForce | None
    sound_speed: float | None
    velocity_scale: float | None
    length_scale: float | None
    calibrate: bool
    walls: tuple[Wall, ...]

    # --- geometry and particles -------------------------------------------------------------

    @property
    def dimension(self) -> int:
        """D."""
        return self.box.dimension

    @cached_property
    def layout(self) -> Layout:
        """Number, spacing and lattice counts of the particles."""
        lattice = isinstance(self.start, LatticeStart)
        if not self.walls:
            return self.resolution.layout(self.box, lattice=lattice)
        return loading.layout(self.resolution, self.geometry, lattice=lattice)

    @cached_property
    def geometry(self) -> Geometry:
        """Where the fluid is."""
        return Geometry(self.box, self.walls)

    @property
    def fluid_volume(self) -> float:
        """V [length^D]: of the box, less what lies behind walls."""
        return self.geometry.volume

    @property
    def n_particles(self) -> int:
        """N."""
        return self.layout.n_particles

    @property
    def spacing(self) -> float:
        """dx = (V/N)^(1/D) [length]."""
        return self.layout.spacing

    @property
    def support_radius(self) -> float:
        """h, where the kernel ends [length]."""
        return self.resolution.support * self.spacing

    @property
    def particle_mass(self) -> float:
        """m = rho V/N [mass]; with walls over d/n, so that the *summed* density is rho.

        Walls are places to compare a density with, and the sum over neighbours on a lattice is
        not quite N/V: see `nominal_density`.
        """
        mass = self.fluid.density * self.fluid_volume / self.n_particles
        return mass / self.factors.density if self.walls else mass

    @property
    def nominal_density(self) -> float:
        """m N/V [mass/length^D], which differs from the summed density by the lattice factor."""
        return self.particle_mass * self.n_particles / self.fluid_volume

    @property
    def pairs_per_particle(self) -> float:
        """Mean number of pairs a particle counts."""
        return pairs_per_particle(self.dimension, self.resolution.support)

    # --- scales -----------------------------------------------------------------------------

    @property
    def thermal_energy(self) -> float:
        """k_B T [energy]."""
        return self.fluid.thermal_energy

    @property
    def hottest_speed(self) -> float:
        """v_th at the hottest wall [length/time], for bounds on the time step."""
        return self.thermal_speed * math.sqrt(self.temperature_range[1] / self.fluid.temperature)

    @property
    def thermal_speed(self) -> float:
        """v_th = sqrt(k_B T/m), of one component [length/time]."""
        return math.sqrt(self.thermal_energy / self.particle_mass)

    @cached_property
    def active_effects(self) -> ActiveEffects:
        """What acts, after derivation or the regime, and overrides."""
        if self.effects.auto:
            from sdpd.decisions import settle

            return settle(cast("Scene", self))
        heated = any(wall.heat != Isothermal() for wall in self.walls)
        return self.effects.resolve(self.fluid, self.dimension, self.body_force, heated=heated)

    @property
    def settled_effects(self) -> Effects:
        """`effects`, or where they are left to the regime what it says, each set."""
        return self.active_effects.settings() if self.effects.auto else self.effects

    @property
    def starts_thermal(self) -> bool:
        """Whether the initial velocities are Maxwellian."""
        choice, active = self.start.velocities, self.active_effects
        automatic = active.fluctuations or not active.dissipation
        return automatic if choice == "auto" else choice == "thermal"

    @property
    def flow_length(self) -> float:
        """L0 [length]."""
        if self.length_scale is not None:
            return self.length_scale
        if isinstance(self.body_force, SinusoidalForce) and self.active_effects.body_force:
            return self._wavelength(self.body_force)
        if self.walls:
            return self.geometry.width
        return min(self.box.lengths)

    def _wavelength(self, force: SinusoidalForce) -> float:
        return self.box.lengths[AXES.index(force.along)] / force.wavenumber

    @property
    def flow_speed(self) -> float | None:
        """V0 [length/time]; None if there is no way to know."""
        if self.velocity_scale is not None:
            return self.velocity_scale
        force, nu = self.body_force, self.fluid.kinematic_viscosity
        transverse = isinstance(force, SinusoidalForce) and force.along != force.direction
        if transverse and self.active_effects.body_force and self.active_effects.dissipation:
            assert isinstance(force, SinusoidalForce)
            return force.peak / (nu * (2.0 * math.pi / self._wavelength(force)) ** 2)
        moving = max((wall.speed_in(self.box) for wall in self.walls), default=0.0)
        driven = isinstance(force, UniformForce) and self.active_effects.body_force
        if self.walls and driven and self.active_effects.dissipation:
            assert force is not None
            # of a channel of that width; a pipe has half of it
            moving += force.peak * self.flow_length**2 / (8.0 * nu)
        return moving if moving > 0.0 else None

    @cached_property
    def sound(self) -> SoundSpeed:
        """Speed of sound at the density of the fluid, with the term of the rule that won."""
        law = self.fluid.equation_of_state
        own = law.sound_speed is not None or "sound_speed" in law.unused
        if own and self.sound_speed is not None:
            raise ValueError(
                "`sound_speed` must be None as the equation of state has its own, got "
                f"{self.sound_speed:g}"
            )
        if own:
            squared = self._equation_of_state(self.fluid.density, law.sound_speed or 1.0)[1]
            if squared <= 0.0:
                raise ValueError(
                    "`fluid.equation_of_state` must have dP/drho > 0 at the density of the fluid "
                    f"{self.fluid.density:g}, got {squared:g}"
                )
            return SoundSpeed(math.sqrt(squared), "given by the equation of state", ())
        if isinstance(law, IdealGas) and self.active_effects.energy:
            return self._sound_of_gas()
        if self.sound_speed is not None:
            return SoundSpeed(self.sound_speed, "given", ())
        force = self.body_force if self.active_effects.body_force else None
        return choose_sound_speed(
            thermal_speed=self.thermal_speed,
            kinematic_viscosity=self.fluid.kinematic_viscosity,
            flow_speed=self.flow_speed,
            length_scale=self.flow_length,
            peak_force=0.0 if force is None else force.peak,
            true_speed=self.fluid.sound_speed,
        )

    def _sound_of_gas(self) -> SoundSpeed:
        """c = sqrt(R T) of a gas with an energy: a softer one would have another gamma."""
        fluid, given = self.fluid, self.sound_speed
        molecule = fluid.molecular_mass
        true = fluid.sound_speed
        if molecule is not None:
            true = math.sqrt(fluid.thermal_energy / molecule)
        if true is None and given is None:
            raise ValueError(
                "`sound_speed` must be given for a gas with an energy, or `fluid.molecular_mass`: "
                "c = sqrt(R T), with R and the heat capacity, decides gamma"
            )
        if true is None:
            assert given is not None
            return SoundSpeed(given, "given", ())
        if given is not None and abs(given / true - 1.0) > 0.01:
            raise ValueError(
                "`sound_speed` must be that of the gas where it has an energy, sqrt(R T) = "
                f"{true:.6g}, or None, got {given:g}"
            )
        return SoundSpeed(true, "that of the gas, which has an energy", ())

    def _equation_of_state(self, density: float, c: float) -> tuple[float, float]:
        """P and dP/drho."""
        pressure, squared, _ = self.fluid.equation_of_state.evaluate(
            density, reference_density=self.fluid.density, sound_speed=c
        )
        return float(pressure), float(squared)

    @cached_property
    def _state(self) -> tuple[float, float]:
        return self._equation_of_state(self.fluid.density, self.sound.speed)

    @property
    def stiffness(self) -> float:
        """X = m c^2/(k_B T) = (c/v_th)^2 at the density of the fluid [1]."""
        return self.particle_mass * self._state[1] / self.thermal_energy

    @property
    def pressure_number(self) -> float:
        """Y = P/(n k_B T) at the density of the fluid [1]."""
        return self._state[0] * self.particle_mass / (self.fluid.density * self.thermal_energy)

    @cached_property
    def pairing(self) -> tuple[float, float]:
        """Susceptibility to clumping, beyond 1 particles pair, and its k h (`structure`)."""
        return structure.pairing_susceptibility(
            self.resolution.kernel, self.dimension, self.stiffness, self.pressure_number
        )

    @cached_property
    def density_deviation(self) -> float | None:
        """Relative rms deviation of the density by thermal noise [1]; None if the fluid clumps."""
        if not (self.active_effects.fluctuations or self.starts_thermal):
            return 0.0
        return structure.density_deviation(
            self.resolution.kernel,
            self.dimension,
            self.resolution.support,
            self.stiffness,
            self.pressure_number,
        )

    @cached_property
    def compressed_state(self) -> CompressedState:
        """The fluid where it is compressed by three rms deviations (10 % where unknown)."""
        deviation = self.density_deviation
        strain = 3.0 * deviation if deviation is not None else 0.1
        return self._compressed(self.fluid.density * (1.0 + strain))

    def compressed_to(self, density: float) -> CompressedState:
        """The fluid at a density [mass/length^D], or `compressed_state` if that is denser."""
        usual = self.compressed_state
        return usual if density <= usual.density else self._compressed(density)

    def _compressed(self, density: float) -> CompressedState:
        pressure, squared = self._equation_of_state(density, self.sound.speed)
        squared = max(squared, self._state[1])
        ratio = max(pressure, self._state[0]) / (density * squared)
        return CompressedState(density, math.sqrt(squared), max(0.0, ratio))

    # --- friction ---------------------------------------------------------------------------

    def _friction(self) -> tuple[float, float]:
        """a and b of the asked viscosities."""
        active, eta, d = self.active_effects, self.fluid.shear_viscosity, self.dimension
        if not active.dissipation:
            return 0.0, 0.0
        if active.central_friction:
            return 0.0, 2.0 * (d + 2) * eta
        zeta = active.effective_bulk_viscosity
        return max(0.0, eta * (1.0 + 2.0 / d) - zeta), (d + 2) * (zeta + eta * (1.0 - 2.0 / d))

    @cached_property
    def factors(self) -> DiscreteFactors:
        """Lattice factors d/n, eta_eff/eta and friction rate of kernel and support."""
        across, along = self._friction()
        if across + along == 0.0:
            across = along = 1.0
        return discrete_factors(
            self.resolution.kernel,
            self.dimension,
            self.resolution.support,
            across=across,
            along=along,
        )

    @property
    def calibration(self) -> float:
        """What a and b are divided by: eta_eff/eta with `calibrate`, else 1."""
        return self.factors.viscosity if self.calibrate else 1.0

    @property
    def friction_across(self) -> float:
        """a, as used [mass/(length^(D-2) time)]."""
        return self._friction()[0] / self.calibration

    @property
    def friction_along(self) -> float:
        """b, as used [mass/(length^(D-2) time)]."""
        return self._friction()[1] / self.calibration

    @property
    def friction_time_continuum(self) -> float:
        """tau = rho/((a + b/D) I_F), for many neighbours [time]; inf without friction."""
        rate = self.friction_across + self.friction_along / self.dimension
        integral = kernels.get(self.resolution.kernel).friction_integral[self.dimension - 2]
        if rate == 0.0:
            return math.inf
        return self.fluid.density * self.support_radius**2 / (rate * integral)

    @property
    def friction_time(self) -> float:
        """tau = m/<sum_j g_ij (a + b/D)> of a particle, with its lattice factor [time]."""
        return self.friction_time_continuum / self.factors.friction

    # --- energy -----------------------------------------------------------------------------

    @property
    def caloric(self) -> tuple[str, list[float], str]:
        """Caloric equation of state for the core, of a fluid with an energy."""
        law = self.fluid.equation_of_state
        return law.caloric(self.fluid, self.fluid.density, self.sound.speed)

    @property
    def heat_capacity_number(self) -> float:
        """C/k_B of a particle [1]; inf where the fluid has no heat capacity."""
        if self.fluid.heat_capacity is None:
            return math.inf
        return self.fluid.heat_capacity * self.particle_mass / self.fluid.boltzmann_constant

    @property
    def least_heat_capacity_number(self) -> float:
        """The least C/k_B of a particle between the temperatures of the scene [1]."""
        law, found = self.fluid.equation_of_state, [self.heat_capacity_number]
        for temperature in self.temperature_range:
            capacity = law.heat_capacity(self.fluid.density, temperature)
            if capacity is not None:
                found.append(capacity * self.particle_mass / self.fluid.boltzmann_constant)
        return min(found)

    @cached_property
    def adiabatic_ratio(self) -> float:
        """Square of the adiabatic over the isothermal speed of sound [1]; 1 without an energy."""
        return self._adiabatic(self.fluid.temperature)

    @cached_property
    def stiffest_ratio(self) -> float:
        """The same with the adiabatic speed at the hottest wall, for bounds on dt [1]."""
        return max(self.adiabatic_ratio, self._adiabatic(self.temperature_range[1]))

    def _adiabatic(self, temperature: float) -> float:
        if not self.active_effects.energy:
            return 1.0
        from sdpd import _core

        rho = np.array([self.fluid.density] * 2)
        parts = _core.caloric_evaluate(
            self.caloric, rho, np.array([temperature, self.fluid.temperature])
        )
        return float(parts[4][0] / parts[3][1])

    @cached_property
    def temperature_range(self) -> tuple[float, float]:
        """Lowest and highest temperature of the fluid at the start and of the walls."""
        found = [self.fluid.temperature]
        for wall in self.walls if self.active_effects.energy else ():
            if isinstance(wall.heat, Isothermal):
                points = wall.points_on(self.box, max(self.box.lengths) / 20.0)
                values = wall.heat.temperature_at(points, self.fluid.temperature)
                found += [float(values.min()), float(values.max())]
        return min(found), max(found)

    def transport_factor(self, exponent: float) -> float:
        """Largest factor (T/T_0)^n of a coefficient over the temperatures of the scene [1]."""
        if not self.active_effects.variable_transport:
            return 1.0
        ends = (value / self.fluid.temperature for value in self.temperature_range)
        return float(max(1.0, *(end**exponent for end in ends)))

    @property
    def conductivity(self) -> float:
        """kappa, as used [energy/(time temperature length^(D-2))]."""
        kappa = self.fluid.thermal_conductivity or 0.0
        return kappa / self.factors.conductivity if self.calibrate else kappa

    @property
    def conduction_time(self) -> float:
        """tau_q = rho c_v/(2 kappa I_F), in which conduction evens a particle out [time].

        With the lattice factor of the friction rate; inf without conduction.
        """
        fluid, active = self.fluid, self.active_effects
        if not active.conduction or not fluid.thermal_conductivity or not fluid.heat_capacity:
            return math.inf
        integral = kernels.get(self.resolution.kernel).friction_integral[self.dimension - 2]
        rate = 2.0 * self.conductivity * integral * self.factors.friction
        return fluid.density * fluid.heat_capacity * self.support_radius**2 / rate

    @property
    def self_diffusion_continuum(self) -> float:
        """K h^2 rho k_B T/(m eta) = k_B T tau/m for many neighbours [length^2/time]."""
        return self.thermal_energy * self.friction_time_continuum / self.particle_mass

    @property
    def self_diffusion(self) -> float:
        """Short-time k_B T tau/m with the lattice factor of the friction rate [length^2/time]."""
        return self.thermal_energy * self.friction_time / self.particle_mass

    @property
    def schmidt_number(self) -> float:
        """Sc = nu/D with the short-time self-diffusion [1]; inf without noise."""
        nu = self.fluid.kinematic_viscosity
        return nu / self.self_diffusion if self.self_diffusion < math.inf else 0.0

    @property
    def reduced_viscosity(self) -> float:
        """eta* = eta dx^(D-1)/sqrt(m k_B T) [1]; the input viscosity rules where it is >> 10."""
        length = self.spacing ** (self.dimension - 1)
        momentum = math.sqrt(self.particle_mass * self.thermal_energy)
        return self.fluid.shear_viscosity * length / momentum
