"""What turns with another code have given: speeds, temperatures, times to a result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from sdpd.analysis import ensemble
from sdpd.bench.lammps import Lammps
from sdpd.bench.study import Study
from sdpd.bench.turns import Spread
from sdpd.scene import Scene
from sdpd.units import table

__all__ = ["BIAS", "TIME_STEP", "Contest", "Journey", "Peer", "Temperature"]

TIME_STEP = 1e-10  # s, of both codes; LAMMPS is 3 % too cold at it
BIAS = 0.01  # of the temperature, allowed in the time to a result


@dataclass(frozen=True)
class Temperature:
    """A kinetic temperature and its standard error [K]."""

    mean: float
    stderr: float

    @classmethod
    def of(cls, values: Sequence[float], scene: Scene, span: float) -> Temperature:
        """From means over turns that take a time `span` together [s].

        The error is that from turn to turn, but no less than what a thermostat of the friction time
        tau leaves: a variance 2/(D N) T^2, forgotten in tau/2. Turns in succession are correlated.
        """
        mean = float(np.mean(values))
        share = min(1.0, scene.friction_time / span)
        least = mean * math.sqrt(2.0 / (scene.dimension * scene.n_particles) * share)
        seen = ensemble(values).stderr if len(values) > 1 else 0.0
        return cls(mean, max(seen, least))

    def __str__(self) -> str:
        return f"{self.mean:.1f} ± {self.stderr:.1f}"


@dataclass(frozen=True, kw_only=True)
class Contest:
    """One kind of step of ours against theirs, at the same time step.

    Attributes
    ----------
    particles : int
    support : float
        h/dx [1].
    step : str
        Of `OURS`.
    dt : float
        [s].
    theirs, ours : Spread
        Particle-steps a second [1/s].
    ratio : Spread
        Ours over theirs, round by round [1].
    lowest, highest : float
        Of the ratio.
    their_temperature, our_temperature : Temperature or None
        Delivered at this time step; None without noise.
    """

    particles: int
    support: float
    step: str
    dt: float
    theirs: Spread
    ours: Spread
    ratio: Spread
    lowest: float
    highest: float
    their_temperature: Temperature | None
    our_temperature: Temperature | None


@dataclass(frozen=True, kw_only=True)
class Journey:
    """Time to simulate one h^2 rho/eta.

    Attributes
    ----------
    particles : int
    support : float
        h/dx [1].
    code : str
    dt : float
        [s]; of LAMMPS where its bias reaches `BIAS`, by a line through biases at two steps.
    dt_error : float
        Relative standard error of it [1]; 0 where it is given.
    seconds : Spread
        Wall time on one core [s].
    ratio : Spread
        LAMMPS over this one, round by round [1].
    temperature : Temperature
        Delivered at this time step.
    diffusion_error : float
        Short-time self-diffusion of the configurations that it visits, over that at the small time
        step of the contest, less 1 [1]; nan if not checked.
    diffusion_stderr : float
        [1].
    shear_error : float
        Viscosity that a shear wave on the lattice decays with at this step, over that of dt -> 0,
        less 1 [1]; nan if not checked.
    """

    particles: int
    support: float
    code: str
    dt: float
    dt_error: float
    seconds: Spread
    ratio: Spread
    temperature: Temperature
    diffusion_error: float
    diffusion_stderr: float
    shear_error: float


@dataclass(frozen=True, kw_only=True)
class Peer(Study):
    """Ours beside LAMMPS; ``print`` shows both tables."""

    kind: ClassVar[str] = "peer"

    lammps: Lammps
    core: int | None
    contests: tuple[Contest, ...]
    journeys: tuple[Journey, ...]

    def document(self) -> dict[str, Any]:
        """Everything as plain data; of LAMMPS its version."""
        return {**super().document(), "lammps": self.lammps.version}

    def __str__(self) -> str:
        header = ["N", "h/dx", "here", "LAMMPS, k/s", "here, k/s", "ratio", "lowest-highest"]
        header += ["T LAMMPS [K]", "T here [K]"]
        rows = [
            [
                f"{row.particles:,}",
                f"{row.support:g}",
                row.step,
                row.theirs.scaled(1e-3).shown(".0f"),
                row.ours.scaled(1e-3).shown(".0f"),
                row.ratio.shown(".1f"),
                f"{row.lowest:.1f}-{row.highest:.1f}",
                "" if row.their_temperature is None else str(row.their_temperature),
                "" if row.our_temperature is None else str(row.our_temperature),
            ]
            for row in self.contests
        ]
        where = "not pinned" if self.core is None else f"pinned to core {self.core}"
        contest = (
            f"LAMMPS ({self.lammps.version}) and sdpd in turns, one core each ({where}), "
            f"dt = {TIME_STEP:g} s; particle-steps a second"
        )
        journey = f"time to simulate one h^2 rho/eta; LAMMPS at the dt that makes it {BIAS:.0%} off"
        checks = (
            "D: friction on the configurations that are visited, over those at the first dt; "
            "shear: decay of a wave\non the lattice over dt -> 0, by the pair splitting; neither "
            "was checked for LAMMPS, whose step is shorter"
        )
        blocks = [contest, table(rows, header), journey, self._journeys(), checks]
        return "\n\n".join([*blocks, self._foot()])

    def _journeys(self) -> str:
        header = ["N", "h/dx", "code", "dt [s]", "seconds", "ratio", "T [K]", "D", "shear"]
        rows = [
            [
                f"{row.particles:,}",
                f"{row.support:g}",
                row.code,
                f"{row.dt:.3g}" + f" ± {row.dt_error:.0%}" * (row.dt_error > 0.0),
                row.seconds.shown(),
                row.ratio.shown(),
                str(row.temperature),
                _error(row.diffusion_error, row.diffusion_stderr),
                _error(row.shear_error),
            ]
            for row in self.journeys
        ]
        return table(rows, header)


def _error(value: float, stderr: float = math.nan) -> str:
    if not math.isfinite(value):
        return "not checked"
    return f"{value:+.2%}" + (f" ± {stderr:.2%}" if math.isfinite(stderr) else "")
