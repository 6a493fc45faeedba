"""An O(N^2) NumPy twin of SDPD, written from the equations, never from the Rust.

Signs: r_ij = r_i - r_j, v_ij = v_i - v_j, F = -W'/r >= 0, h = full support of the kernel.
It is slow and plain on purpose: every pair is visited, nothing is sorted, nothing is cached.
What is exported here is isothermal; `walls` and `thermal` build upon it.
"""

from .integrators import Trajectory, pair_splitting_step, velocity_verlet_step
from .kernels import KERNELS, force_factor, kernel_value
from .noise import STREAMS, force_variates, pair_counters, pair_variates, philox4x32
from .states import pressure, sound_speed_squared, specific_potential
from .system import Forces, Pairs, System

__all__ = [
    "KERNELS",
    "STREAMS",
    "Forces",
    "Pairs",
    "System",
    "Trajectory",
    "force_factor",
    "force_variates",
    "kernel_value",
    "pair_counters",
    "pair_splitting_step",
    "pair_variates",
    "philox4x32",
    "pressure",
    "sound_speed_squared",
    "specific_potential",
    "velocity_verlet_step",
]
