"""The study: cases of nitrogen one after the other, and their table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

from sdpd import validation
from sdpd.nitrogen.cases import CASES, FROZEN, PUBLISHED_PARTICLES, scene_of
from sdpd.nitrogen.measure import LARGEST_ERROR, LARGEST_T, SHORT_ERROR, Measured, Plan, measure
from sdpd.units import table

__all__ = ["DEFAULT", "Study", "run_nitrogen"]

DEFAULT = (1, 5, 9, 13, 17)  # the finest support of each particle size


@dataclass(frozen=True)
class Study:
    """Cases of Tables 9 to 11; ``print`` shows the table."""

    cases: tuple[Measured, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether all that is exact was met."""
        return all(case.passed for case in self.cases)

    def __str__(self) -> str:
        rows = []
        for found in self.cases:
            for row in found.rows:
                known = math.isfinite(row.expected)
                verdict = f"{row.t:+.1f}" if row.judged else "not judged"
                rows.append(
                    [
                        str(found.case.number) if row is found.rows[0] else "",
                        f"{row.name} [{row.unit}]",
                        f"{row.measured.value:.6g} ± {row.measured.stderr:.2g}",
                        f"{row.expected:.6g}" if known else "",
                        verdict,
                        _number(row.published),
                        _number(row.analytical),
                    ]
                )
        names = ["case", "quantity", "measured", "expected", "t", "Yang (2013)", '"analytical"']
        return "\n\n".join([self._head(), table(rows, names), self._end()])

    def _head(self) -> str:
        scene = self.cases[0].scene
        kernel, gamma = scene.resolution.kernel, scene.adiabatic_ratio
        lines = [
            f"nitrogen with an energy at equilibrium: {kernel}, {gamma = :.3f}",
            f"variances of particles; those of Yang (2013) times {PUBLISHED_PARTICLES}",
        ]
        frozen = ", ".join(str(found.case.number) for found in self.cases if not found.moves)
        if frozen:
            lines.append(
                f"cases {frozen} are glasses (m c^2/kT >= {FROZEN:g}): their arrangement runs down "
                "for longer than any run, and keeps their motion hot"
            )
        for found in self.cases:
            if found.pairs:
                lines.append(
                    f"case {found.case.number} is beyond the limit of the kernel: particles pair, "
                    f"{found.paired:.0%} have another one within half a spacing"
                )
        return "\n".join(lines)

    def _end(self) -> str:
        books = max(abs(found.energy_change) for found in self.cases)
        lines = []
        for found in self.cases:
            transport = found.transport
            if transport is None:
                continue
            window = transport.long.window or (0.0, 0.0)
            stress = transport.viscosity.window or (0.0, 0.0)
            lines.append(
                f"case {found.case.number}: D long of lags {window[0]:.2g} to {window[1]:.2g} s, "
                f"eta of {stress[0]:.2g} to {stress[1]:.2g} s; the lattice delivers eta = "
                f"{transport.lattice_viscosity:.4g} Pa s, kappa = "
                f"{transport.lattice_conductivity:.4g} W/(m K)"
            )
        met = "met" if self.passed else "NOT met"
        limits = (
            f"|t| < {LARGEST_T:g}, errors below {LARGEST_ERROR:.1%}, of D short {SHORT_ERROR:.0%}"
        )
        lines.append(f"energy held to {books:.0e}; what is exact was {met} ({limits})")
        lines.append(f"{self.seconds:.0f} s")
        return "\n".join(lines)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"


def run_nitrogen(
    cases: Sequence[int] | None = None,
    *,
    kernel: str = "wendland_c2",
    heat_capacity: float = 2.5,
    particles: int | None = None,
    transport: bool = True,
    quick: bool = False,
    seed: int = 1,
    threads: int | None = None,
) -> Study:
    """Run cases of Tables 9 to 11 at equilibrium.

    Parameters
    ----------
    cases : sequence of int, optional
        1 to 20; (1, 5, 9, 13, 17) if None.
    kernel : str
        The published Lucy kernel pairs beyond 287 molecules a particle, from case 5 on.
    heat_capacity : float
        C/(N k_B) [1]: 5/2 of a diatomic gas, 3/2 in chapter 4 of the dissertation.
    particles : int, optional
        About so many, 3375 as published; 512 or what two supports ask for if None.
    transport : bool
        Whether to measure self-diffusion, viscosity and conductivity as well.
    quick : bool
        A fifth of the samples: errors may be too large to judge by.
    seed : int
    threads : int, optional
        As for a `Simulation`.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Examples
    --------
    >>> from sdpd import nitrogen
    >>> nitrogen.CASES[1].spacing
    1.67e-08
    """
    from sdpd import kernels

    numbers = DEFAULT if cases is None else tuple(cases)
    for number in numbers:
        validation.integer("cases", number, minimum=1, maximum=len(CASES))
    if not numbers:
        raise ValueError("`cases` must name at least one of 1 to 20, got none")
    validation.choice("kernel", kernel, kernels.names())
    capacity = validation.positive("heat_capacity", heat_capacity)
    if particles is not None:
        particles = validation.integer("particles", particles, minimum=8)
    moving = validation.boolean("transport", transport)
    short = validation.boolean("quick", quick)
    begun = perf_counter()
    found = []
    for number in numbers:
        case = CASES[number]
        scene = scene_of(case, kernel=kernel, heat_capacity=capacity, particles=particles)
        plan = Plan.of(scene, quick=short, transport=moving)
        found.append(measure(case, scene, plan, seed=seed, threads=threads))
    return Study(tuple(found), perf_counter() - begun)
