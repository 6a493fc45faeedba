"""Where the wall time of a run goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sdpd.units import table

__all__ = ["TimeProfile"]

PHASES = {
    "lists": "grid and lists, which pairs to work on, and who is near a wall",
    "densities": "densities, pressures and temperatures",
    "forces": "forces between particles",
    "exchanges": "exchanges of momentum and heat between particles",
    "walls": "densities, forces and exchanges at walls, collisions",
    "motion": "kicks, drifts, books of energies",
    "observers": "observers, without their sums inside the sweeps",
}


@dataclass(frozen=True)
class TimeProfile:
    """Wall time by phase of the step; ``print`` shows the table.

    Attributes
    ----------
    seconds : dict of float
        By phase [s of wall time]: lists, densities, forces, exchanges, walls, motion, observers.
    steps : int
        Done in that time.
    n_particles, threads : int
    instructions : str
        Vector instructions of the loops: avx512, avx2 or portable.

    Examples
    --------
    >>> from sdpd.time_profile import TimeProfile
    >>> profile = TimeProfile({"densities": 1.0, "forces": 3.0}, 2000, 1000, 1, "avx2")
    >>> profile.per_particle_step["forces"]
    1500.0
    """

    seconds: dict[str, float]
    steps: int
    n_particles: int
    threads: int
    instructions: str

    @property
    def total(self) -> float:
        """All phases [s]."""
        return sum(self.seconds.values())

    @property
    def per_particle_step(self) -> dict[str, float]:
        """By phase [ns per particle and step]; 0 where no step was done."""
        count = self.steps * self.n_particles
        return {n: 1e9 * spent / count if count else 0.0 for n, spent in self.seconds.items()}

    def as_dict(self) -> dict[str, Any]:
        """All numbers, for JSON."""
        return {
            "seconds": dict(self.seconds),
            "steps": self.steps,
            "n_particles": self.n_particles,
            "threads": self.threads,
            "instructions": self.instructions,
        }

    def __str__(self) -> str:
        total, each = self.total, self.per_particle_step
        rows = [
            [name, f"{each[name]:.1f}", f"{spent / total if total else 0.0:.1%}", PHASES[name]]
            for name, spent in self.seconds.items()
            if spent > 0.0
        ]
        head = (
            f"{self.steps} steps of {self.n_particles} particles in {total:.3g} s: "
            f"{sum(each.values()):.0f} ns per particle-step, threads = {self.threads}, "
            f"{self.instructions}"
        )
        return "\n".join([head, "", table(rows, ["phase", "ns", "share", ""])])
