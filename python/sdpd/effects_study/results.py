"""Results: what an effect changes, with errors, beside what it costs."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Estimate, bonferroni
from sdpd.bench.effects import Difference
from sdpd.scene import Scene

__all__ = ["LEVEL", "Change", "Comparison", "Study", "estimate", "plain"]

Array = NDArray[np.float64]
LEVEL = 0.01  # probability that anything is called changed where nothing changes
EXACT = 1e-4  # relative difference of runs without noise that counts as a change


def estimate(blocks: Array, *, noisy: bool) -> Estimate:
    """Mean of block means, (seeds, blocks), with its standard error.

    With noise: that of all blocks, widened by what neighbouring blocks share, (1 + r)/(1 - r) in
    the variance with their correlation r where it is > 0. Without, a run has no sampling error: the
    spread of seeds, which are different starts, or 0 for a single one.
    """
    seeds, number = blocks.shape
    mean = float(blocks.mean())
    if not noisy:
        means = blocks.mean(axis=1)
        error = float(means.std(ddof=1)) / math.sqrt(seeds) if seeds > 1 else 0.0
        return Estimate(mean, error, float(seeds) if seeds > 1 else math.inf)
    away = blocks - mean
    variance = float((away**2).sum()) / (blocks.size - 1)
    if variance == 0.0:
        return Estimate(mean, 0.0)
    shared = float((away[:, 1:] * away[:, :-1]).mean()) / variance if number > 1 else 0.0
    shared = min(max(shared, 0.0), 0.9)
    effective = blocks.size * (1.0 - shared) / (1.0 + shared)
    return Estimate(mean, math.sqrt(variance / effective), max(2.0, effective))


@dataclass(frozen=True, kw_only=True)
class Change:
    """One observable with the effect off and on.

    Attributes
    ----------
    observable, unit : str
    off, on : Estimate
    difference : Estimate
        On less off, of blocks of the same seed and time.
    """

    observable: str
    unit: str
    off: Estimate
    on: Estimate
    difference: Estimate

    @property
    def z(self) -> float:
        """Difference in standard errors; infinite where it has none."""
        return self.difference.z(0.0)

    @property
    def relative(self) -> float:
        """Difference over the larger of both values [1]."""
        scale = max(abs(self.off.value), abs(self.on.value))
        return self.difference.value / scale if scale > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """An effect: what it changes and what it costs.

    Attributes
    ----------
    effect : str
    own : bool
        Whether the scene has it.
    noisy : bool
        Whether one of the sides has noise; else what is seen is that of the run, without error.
    changes : tuple of Change
    cost : Difference
        Time of a particle-step, by turns [ns]; ``without`` is off.
    dt : float
        Time step of both [time].
    steps : int
        Of each run.
    dt_off, dt_on : float
        Steps that each side would take by itself [time].
    reason : str
        What the regime says of it.
    """

    effect: str
    own: bool
    noisy: bool
    changes: tuple[Change, ...]
    cost: Difference
    dt: float
    steps: int
    dt_off: float
    dt_on: float
    reason: str

    @property
    def ratio(self) -> float:
        """Time of a step with the effect over one without [1]."""
        return self.cost.with_it.median / self.cost.without.median

    @property
    def time_ratio(self) -> float:
        """Wall time of a simulated time with the effect over one without [1]."""
        return self.ratio * self.dt_off / self.dt_on


@dataclass(frozen=True, kw_only=True)
class Study:
    """Each effect of a scene on and off; ``print`` shows the tables.

    Attributes
    ----------
    scene : Scene
    seeds : tuple of int
    comparisons : tuple of Comparison
    left_out : dict
        Effect -> why it cannot be switched.
    seconds : float
        Wall time [s].
    """

    scene: Scene
    seeds: tuple[int, ...]
    comparisons: tuple[Comparison, ...]
    left_out: dict[str, str]
    seconds: float

    passed = True  # nothing is judged

    def __getitem__(self, effect: str) -> Comparison:
        for each in self.comparisons:
            if each.effect == effect:
                return each
        known = ", ".join(each.effect for each in self.comparisons)
        raise KeyError(f"{effect!r}; there are {known or 'none'}")

    @property
    def changed(self) -> dict[str, tuple[str, ...]]:
        """Effect -> observables that it changes.

        At 1 % for all of the study (Bonferroni); by a ten-thousandth where there is no error.
        """
        rows = [(each.effect, change) for each in self.comparisons for change in each.changes]
        found: dict[str, tuple[str, ...]] = {each.effect: () for each in self.comparisons}
        values = [change.difference.p(0.0) for _, change in rows]
        rejected = bonferroni(values, level=LEVEL).rejected if rows else ()
        for (effect, change), bad in zip(rows, rejected, strict=True):
            if bad and (change.difference.stderr > 0.0 or abs(change.relative) >= EXACT):
                found[effect] += (change.observable,)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Everything but the scene as plain data; numbers that are not finite become None."""
        changed = self.changed
        effects = []
        for each in self.comparisons:
            entry = asdict(each)
            entry |= {"ratio": each.ratio, "time_ratio": each.time_ratio}
            for change, row in zip(each.changes, entry["changes"], strict=True):
                row |= {"z": change.z, "changed": change.observable in changed[each.effect]}
            effects.append(entry)
        found: dict[str, Any] = plain(
            {
                "seeds": self.seeds,
                "effects": effects,
                "left_out": self.left_out,
                "seconds": self.seconds,
            }
        )
        return found

    def __str__(self) -> str:
        from sdpd.effects_study.report import report

        return report(self)


def plain(value: Any) -> Any:
    """Lists, dicts and finite numbers."""
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
