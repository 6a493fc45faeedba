"""How well mean and variance of the density are known, in units of what the accuracy is stated in.

Fluids with m = dx = kT = 1, each from relaxed random places and from the lattice, at the step of
`sdpd fluctuations`. Where both starts agree the fluid has come to its equilibrium. None is a case
of `sdpd nitrogen`, which is judged by what comes out here.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from report import Report, grid, shown

import sdpd
from sdpd.errors import SdpdWarning
from sdpd.fluctuations import DensityPrediction, Plan, plan_scene, run_fluctuations
from sdpd.fluctuations.predictions import LIMITS

SAME = 4.0  # standard errors between both starts, up to which they agree


@dataclass(frozen=True)
class Fluid:
    """What the density depends on."""

    dimension: int
    kernel: str
    support: float
    stiffness: float
    pressure: bool = True  # P = rho c^2 or none

    def scene(self, *, lattice: bool, small: bool) -> sdpd.Scene:
        """Some 500 particles, or two supports."""
        edge = max(22 if self.dimension == 2 else 8, math.ceil(2.0 * self.support))
        if small:
            edge = math.ceil(2.0 * self.support)
        speed = math.sqrt(self.stiffness)
        law = sdpd.eos.IdealGas() if self.pressure else sdpd.eos.ArtificialCompressibility()
        fluid = sdpd.Fluid(
            density=1.0,
            shear_viscosity=0.2 * speed,  # the equilibrium does not depend on it
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=law,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SdpdWarning)
            return sdpd.Scene(
                fluid=fluid,
                box=sdpd.Box((float(edge),) * self.dimension),
                resolution=sdpd.Resolution(spacing=1.0, kernel=self.kernel, support=self.support),
                start=sdpd.LatticeStart() if lattice else sdpd.RandomStart(relax_steps=50),
                sound_speed=speed,
            )


C2, C4, LUCY, QUINTIC = "wendland_c2", "wendland_c4", "lucy", "quintic_spline"
FLUIDS = (
    *(Fluid(3, C2, h, x) for h, x in product((2.2, 3.2), (200.0, 2500.0, 1e4))),
    *(Fluid(3, C2, 2.65, x) for x in (700.0, 2500.0, 1e4)),
    Fluid(3, C2, 4.2, 2500.0),
    *(Fluid(3, C4, h, x) for h, x in product((2.6, 3.2), (200.0, 2500.0, 1e4))),
    *(Fluid(3, C4, 2.3, x) for x in (2500.0, 1e4)),
    Fluid(3, LUCY, 2.65, 200.0),
    *(Fluid(3, QUINTIC, h, 2500.0) for h in (2.4, 3.0)),
    *(Fluid(2, C2, h, x) for h, x in product((2.2, 3.2), (200.0, 2500.0, 1e4))),
    *(Fluid(2, C4, 2.6, x) for x in (200.0, 2500.0, 1e4)),
    Fluid(2, LUCY, 2.65, 200.0),
    Fluid(2, QUINTIC, 3.0, 2500.0),
    Fluid(3, C2, 2.65, 700.0, pressure=False),
    Fluid(3, C2, 2.65, 1e4, pressure=False),
    Fluid(3, C2, 3.2, 2500.0, pressure=False),
    Fluid(2, C2, 2.65, 2500.0, pressure=False),
)
TRIED = (Fluid(3, C2, 2.2, 200.0), Fluid(2, C4, 2.6, 2500.0))  # by --quick
NAMES = {C2: "Wendland C2", C4: "Wendland C4", LUCY: "Lucy", QUINTIC: "quintic"}


@dataclass(frozen=True)
class Run:
    """Mean and variance of d/n, each with its standard error; whether both halves agree."""

    mean: float
    mean_error: float
    variance: float
    variance_error: float
    steady: bool
    stayed: float


@dataclass(frozen=True)
class Case:
    """Both starts of a fluid and its theory."""

    fluid: Fluid
    random: Run
    lattice: Run
    expected_mean: float  # <d>/n
    expected_variance: float  # Var d/n^2
    share: float  # of the variance beyond the Debye wave number
    order: float  # |d/n - 1| of the lattice

    @property
    def excess(self) -> float:
        """Expected <d>/n - 1, the measure of fluctuations."""
        return abs(self.expected_mean - 1.0)

    @property
    def at_rest(self) -> bool:
        """Whether both starts have come to the same variance and mean."""
        a, b = self.random, self.lattice
        spread = math.hypot(a.variance_error, b.variance_error)
        shift = math.hypot(a.mean_error, b.mean_error)
        same = abs(a.variance - b.variance) < SAME * spread and abs(a.mean - b.mean) < SAME * shift
        return same and a.steady and b.steady

    def away(self, quantity: str) -> tuple[float, float]:
        """Mean of both starts off theory, and its error: of the variance relative."""
        a, b = self.random, self.lattice
        if quantity == "mean":
            off = 0.5 * (a.mean + b.mean) - self.expected_mean
            return off, 0.5 * math.hypot(a.mean_error, b.mean_error)
        off = 0.5 * (a.variance + b.variance) / self.expected_variance - 1.0
        error = 0.5 * math.hypot(a.variance_error, b.variance_error)
        return off, error / self.expected_variance

    def fluctuating(self, quantity: str) -> float:
        """Accuracy by the fluctuations alone."""
        stiff, soft, smallest = LIMITS[quantity]
        return max(smallest, (stiff if self.fluid.pressure else soft) * self.excess)


def run(fluid: Fluid, *, lattice: bool, quick: bool) -> tuple[Run, DensityPrediction, sdpd.Scene]:
    """One start."""
    scene = fluid.scene(lattice=lattice, small=quick)
    far = fluid.support > 4.0
    plan = Plan(
        dt=plan_scene(scene).dt,
        equilibration=20 if quick else 1200,
        blocks=32,
        samples=2 if quick else 8 if far else 12,
        every=2 if quick else 5,
    )
    study = run_fluctuations(scene, plan=plan, seed=1, threads=1, progress=False)
    assert study.prediction is not None
    items = {item.name: item.estimate for item in study.items if item.group[:7] == "density"}
    mean, variance = items["mean over n"], items["variance over n^2"]
    found = Run(
        mean.value, mean.stderr, variance.value, variance.stderr, study.steady, study.stayed
    )
    return found, study.prediction, scene


def measure(fluid: Fluid, *, quick: bool) -> Case:
    """Both starts."""
    random, theory, scene = run(fluid, lattice=False, quick=quick)
    lattice, _, _ = run(fluid, lattice=True, quick=quick)
    order = abs(scene.factors.density - 1.0)
    return Case(
        fluid, random, lattice, 1.0 + theory.bias, theory.variance, theory.short_waves, order
    )


def needed(case: Case, quantity: str) -> float | None:
    """Units of share or order that cover the distance; None where fluctuations alone do."""
    off, _ = case.away(quantity)
    if abs(off) <= case.fluctuating(quantity):
        return None
    return abs(off) / unit(case, quantity)


def unit(case: Case, quantity: str) -> float:
    """Share of short waves, or the lattice's distance from n."""
    return case.order if quantity == "mean" else case.share


def factor(cases: Sequence[Case], quantity: str) -> tuple[float, float, float]:
    """Largest distance of what counts, its error, and both errors more rounded up to a half.

    In units of `unit`. What counts: fluids in equilibrium, further off than fluctuations allow.
    """
    found = []
    for case in cases:
        if case.at_rest and needed(case, quantity) is not None:
            off, error = case.away(quantity)
            found.append((abs(off) / unit(case, quantity), error / unit(case, quantity)))
    if not found:
        return 0.0, 0.0, 0.0
    largest, error = max(found, key=lambda each: each[0] + 2.0 * each[1])
    return largest, error, 0.5 * math.ceil(2.0 * (largest + 2.0 * error))


def said(cases: Sequence[Case], quantity: str) -> str:
    """The factors in words."""
    parts = []
    for pressure, name in ((True, "high"), (False, "low")):
        chosen = [case for case in cases if case.fluid.pressure == pressure]
        largest, error, rounded = factor(chosen, quantity)
        if rounded:
            found = shown(largest, error, digits=2)
            parts.append(f"at {name} pressure {found}, from which {rounded:g}")
    return f"Largest of what counts: {'; '.join(parts)}." if parts else "Nothing counts."


def table(cases: Sequence[Case], quantity: str) -> str:
    """Distances in units of `unit`, by kind of fluid and stiffness."""
    columns = sorted({case.fluid.stiffness for case in cases})
    kinds: dict[tuple[object, ...], dict[float, str]] = {}
    for case in sorted(cases, key=_place):
        fluid = case.fluid
        name = NAMES[fluid.kernel] + ("" if fluid.pressure else ", no pressure")
        off, error = (x / unit(case, quantity) for x in case.away(quantity))
        text = shown(off, error, digits=2, signed=True)
        if needed(case, quantity) is not None:
            text = f"**{text}**"
        key = (str(fluid.dimension), name, f"{fluid.support:g}")
        kinds.setdefault(key, {})[fluid.stiffness] = text if case.at_rest else f"[{text}]"
    rows = [[*map(str, key), *(cells.get(x, "") for x in columns)] for key, cells in kinds.items()]
    header = ["$D$", "kernel", r"$h/\Delta x$", *(f"$X={x:.0f}$" for x in columns)]
    return grid(header, rows)


def _place(case: Case) -> tuple[bool, int, int, float]:
    fluid = case.fluid
    return not fluid.pressure, -fluid.dimension, [*NAMES].index(fluid.kernel), fluid.support


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("density_accuracy", __doc__, argv)
    fluids = TRIED if report.quick else FLUIDS
    cases = [measure(fluid, quick=report.quick) for fluid in fluids]
    report.document(
        table(cases, "variance"),
        r"$\operatorname{Var}d$ off RPA, in shares of the waves beyond $k_D$. "
        + said(cases, "variance"),
        table(cases, "mean"),
        r"$\langle d\rangle$ off RPA, in distances of the lattice's density from $n$. "
        + said(cases, "mean"),
        "Some 500 particles, two runs each, one standard error; $P=\\rho c^2$ unless stated. Bold, "
        "and what counts: further off than fluctuations alone allow. In brackets, not counted: "
        "relaxed random places and the lattice differ in mean or variance by more than "
        f"{SAME:g} standard errors, or drift: the fluid has not come to its equilibrium. Factors: "
        "two standard errors more, rounded up to the next half.",
    )


if __name__ == "__main__":
    main()
