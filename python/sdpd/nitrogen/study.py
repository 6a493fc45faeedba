"""The study: cases of nitrogen one after the other, and their table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from sdpd import progress as bars
from sdpd import validation
from sdpd.analysis import Estimate
from sdpd.nitrogen.cases import CASES, FROZEN, PUBLISHED_PARTICLES, scene_of
from sdpd.nitrogen.measure import Measured, Plan, measure
from sdpd.nitrogen.rows import LARGEST_T, ROUGH, Row
from sdpd.scene import Scene
from sdpd.units import table

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["DEFAULT", "Study", "run_nitrogen"]

EXACT = 1e-3  # relative standard error of what is expected, up to which it counts as exact
DEFAULT = (1, 5, 9, 13, 17)  # the finest support of each particle size


@dataclass(frozen=True)
class Study:
    """Cases of Tables 9 to 11; ``print`` shows the table."""

    cases: tuple[Measured, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether every prediction was met within its accuracy."""
        return all(case.passed for case in self.cases)

    def __str__(self) -> str:
        rows = []
        for found in self.cases:
            for row in found.rows:
                rows.append(
                    [
                        str(found.case.number) if row is found.rows[0] else "",
                        f"{row.name} [{row.unit}]",
                        f"{row.measured.value:.6g} ± {row.measured.stderr:.2g}",
                        *_prediction(row),
                        _number(row.published),
                        _number(row.analytical),
                    ]
                )
        names = ["case", "quantity", "measured", "expected", "accuracy", "t"]
        names += ["Yang (2013)", '"analytical"']
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
        lines = [line for found in self.cases for line in _remarks(found)]
        judged = [row for found in self.cases for row in found.rows if row.judged]
        met = "met" if self.passed else "NOT met"
        lines.append(f"energy held to {books:.0e}")
        if judged:
            largest = max(row.largest_error for row in judged)
            lines.append(
                f"{len(judged)} predictions were {met}: |t| < {LARGEST_T:g} beyond their accuracy, "
                f"standard errors up to {largest:.1%}; found |t| up to "
                f"{max(abs(row.t) for row in judged):.1f}, errors up to "
                f"{max(row.relative for row in judged):.2%}"
            )
            rough = sum(row.rough for row in judged)
            lines.append(
                f"of them with an accuracy above {ROUGH:.0%}, which guard against gross faults "
                f"only: {rough}"
            )
        lines.append(f"{self.seconds:.0f} s")
        return "\n".join(lines)


def _prediction(row: Row) -> list[str]:
    """What is expected, how well it is known, and the distance beyond that."""
    if not math.isfinite(row.expected):
        return ["-", "", "not judged"]
    known = f"± {100.0 * row.accuracy / abs(row.expected):.2g} %" if row.accuracy else "exact"
    if row.expected_stderr > EXACT * abs(row.expected):
        known = f"SE {100.0 * row.expected_stderr / abs(row.expected):.2g} %"
    if not row.judged:
        return [f"{row.expected:.6g}", "" if known == "exact" else known, "not judged"]
    verdict = f"{row.t:+.1f}" + ("" if row.passed else " FAIL")
    return [f"{row.expected:.6g}", known, verdict]


def _remarks(found: Measured) -> list[str]:
    """Windows, and why a coefficient is not judged."""
    transport = found.transport
    if transport is None:
        return []
    windows = []
    for name, value in (
        ("D long", transport.long),
        ("eta", transport.viscosity),
        ("eta long", transport.long_viscosity),
        ("kappa", transport.conductivity),
    ):
        first, last = value.window or (0.0, 0.0)
        windows.append(f"{name} of {first:.2g} to {last:.2g} s")
    about = (
        f"case {found.case.number}: lags of {', '.join(windows)}; the lattice delivers eta = "
        f"{transport.lattice_viscosity:.4g} Pa s, kappa = "
        f"{transport.lattice_conductivity:.4g} W/(m K)"
    )
    lines = [about]
    if found.moves and not transport.stress_known:
        lines += _stiff(found)
    for row in found.rows:
        if row.judged and row.relative > row.largest_error:
            lines.append(
                f"case {found.case.number}: {row.name} has a standard error of "
                f"{row.relative:.1%}, too large to judge by"
            )
    return lines


def _stiff(found: Measured) -> list[str]:
    """Whether particles too stiff for the theory of the stress have a viscosity."""
    name, transport = f"case {found.case.number}", found.transport
    assert transport is not None
    why = "the mean field of the stress that cages hold is of soft fluids, m c^2/kT near 100"
    lines = [f"{name}: eta is reported, not judged: {why}"]
    response = transport.response
    if response is not None:
        first, last = ((x.window or (0.0, 0.0))[1] for x in (response.viscosity, response.growth))
        verdict = "waves put into another run judge it (eta wave)"
        if not transport.flows:
            verdict = "no viscosity at this time scale, eta wave is not judged"
        lines.append(
            f"{name}: {verdict}: within {last:.2g} s waves have {_times(response.growth)} times "
            f"the viscosity that they have within {first:.2g} s; particles moved by "
            f"{math.sqrt(transport.moved):.2f} spacings (root mean square) in the run"
        )
    return lines


def _times(growth: Estimate) -> str:
    if not math.isfinite(growth.value):
        return "without bound, as in a solid,"
    return f"{growth.value:.3f} ± {growth.stderr:.2g}"


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
    progress: bool | None = False,
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
        A tenth of the samples or fewer: judged with errors up to 6 % where 0.7 % is asked for.
    seed : int
    threads : int, optional
        As for a `Simulation`.
    progress : bool, optional
        Show a progress bar; None: on a terminal or in a notebook.

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

    if cases is not None and not isinstance(cases, Iterable):
        raise TypeError(f"`cases` must be a sequence of numbers, got {cases!r}")
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
    jobs = []
    for number in numbers:
        case = CASES[number]
        scene = scene_of(case, kernel=kernel, heat_capacity=capacity, particles=particles)
        jobs.append((case, scene, Plan.of(case, scene, quick=short, transport=moving)))
    found = []
    with _Bar([(scene, plan) for _, scene, plan in jobs], progress) as bar:
        for case, scene, plan in jobs:
            tell = partial(bar.update, case.number, scene)
            found.append(measure(case, scene, plan, seed=seed, threads=threads, tell=tell))
    return Study(tuple(found), perf_counter() - begun)


class _Bar:
    """Progress over all cases, in pairs visited while sampling."""

    def __init__(self, jobs: list[tuple[Scene, Plan]], progress: bool | None) -> None:
        whole = math.fsum(plan.work(scene) * self._pairs(scene) for scene, plan in jobs)
        self._scale, self._done = 1000.0 / whole, 0.0
        self._bar = None
        if bars.wanted(progress):
            form = "{percentage:3.0f}% |{bar}| {elapsed}, {remaining} left{postfix}"
            self._bar = bars.bar(total=1000, progress=progress, bar_format=form)

    @staticmethod
    def _pairs(scene: Scene) -> float:
        return scene.n_particles * scene.pairs_per_particle

    def update(self, number: int, scene: Scene, steps: int) -> None:
        """Count steps of a case."""
        if self._bar is not None:
            self._done += steps * self._pairs(scene) * self._scale
            self._bar.set_postfix_str(f"case {number}", refresh=False)
            self._bar.update(int(self._done) - self._bar.n)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
