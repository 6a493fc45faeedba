"""Each quantity beside its prediction, with z and a verdict over the whole family."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Estimate, bonferroni, ensemble
from sdpd.fluctuations.energy_items import energy_items
from sdpd.fluctuations.item import SHELLS, Item

if TYPE_CHECKING:
    from sdpd.fluctuations.predictions import DensityPrediction
    from sdpd.fluctuations.sampler import Sampler
    from sdpd.scene import Scene

__all__ = ["LEVEL", "Item", "compare", "drift", "judge"]

Array = NDArray[np.float64]

LEVEL = 0.01  # probability that any item of a right simulation fails


def judge(items: tuple[Item, ...]) -> tuple[bool, ...]:
    """Whether each item agrees, at `LEVEL` for all of them together (Bonferroni)."""
    rejected = bonferroni([item.p for item in items], level=LEVEL).rejected
    return tuple(not bool(value) for value in rejected)


def compare(
    scene: Scene, sampler: Sampler, prediction: DensityPrediction | None
) -> tuple[Item, ...]:
    """All quantities of a run.

    Parameters
    ----------
    scene : Scene
    sampler : Sampler
        After the run.
    prediction : DensityPrediction, optional
        Without it the density is left out.

    Returns
    -------
    tuple of Item
    """
    items = [*_velocities(scene, sampler), *_currents(sampler)]
    if prediction is not None:
        items += _density(sampler, prediction)
    if sampler.energy is not None:
        items += energy_items(scene, sampler, prediction)
    return tuple(items)


def drift(sampler: Sampler) -> Estimate:
    """Variance of the density in the second half over that in the first, less 1 [1]."""
    variance = _variance(sampler.table["density"])
    half = variance.size // 2
    first, second = variance[:half], variance[-half:]
    error = np.hypot(first.std(ddof=1), second.std(ddof=1)) / np.sqrt(half) / first.mean()
    return Estimate(float(second.mean() / first.mean() - 1.0), float(error), 2.0 * half - 1.0)


def _velocities(scene: Scene, sampler: Sampler) -> Iterator[Item]:
    table = sampler.table
    for axis, column in zip("xyz", table["square"].T, strict=False):
        name = f"variance of v_{axis} over kT/m, N - 1"
        yield Item(group="velocity", name=name, estimate=ensemble(column), prediction=1.0)
    fourth = ensemble(table["fourth"][:, 0])
    name = "fourth moment over 3 (kT/m)^2"
    yield Item(group="velocity", name=name, estimate=fourth, prediction=1.0)
    sums, counts = table["pairs"][:, 0], table["pairs"][:, 1]
    edges = sampler.distance_edges / scene.support_radius
    for k in range(edges.size - 1):
        if not counts[:, k].all():
            continue
        yield Item(
            group="velocity in space",
            name=f"<v_i.v_j>/(D kT/m), r/h {edges[k]:.1f} to {edges[k + 1]:.1f}",
            estimate=ensemble(sums[:, k] / counts[:, k]),
            prediction=-1.0 / scene.n_particles,
            unit=1.0,
        )
    for parts in sampler.divisions:
        yield Item(
            group="momentum of cells",
            name=f"variance over m kT (N_c - N_c^2/N), cells L/{parts}",
            estimate=ensemble(table[f"cells_{parts}"][:, 1]),
            prediction=1.0,
        )


def _currents(sampler: Sampler) -> Iterator[Item]:
    weight = sampler.n_vectors / sampler.n_vectors.sum()
    for kind in ("longitudinal", "transverse"):
        rows, group = sampler.table[kind], f"{kind} momentum modes"
        name = f"<|j_k|^2>/(m kT N), all {sampler.n_vectors.sum()} k"
        yield Item(group=group, name=name, estimate=ensemble(rows @ weight), prediction=1.0)
        for k in range(min(SHELLS, sampler.n_vectors.size)):
            name = f"k = {sampler.reduced_wave_number[k]:.3f} x 2 pi/L"
            yield Item(group=group, name=name, estimate=ensemble(rows[:, k]), prediction=1.0)


def _density(sampler: Sampler, theory: DensityPrediction) -> Iterator[Item]:
    table = sampler.table
    weight = sampler.n_vectors / sampler.n_vectors.sum()
    expected = theory.structure_factor(sampler.wave_number)
    share = theory.accuracy("structure")
    name = f"S(k)/S_RPA(k), all {sampler.n_vectors.sum()} k"
    pooled = ensemble(table["structure"] / expected @ weight)
    group = "structure factor"
    yield Item(group=group, name=name, estimate=pooled, prediction=1.0, accuracy=share)
    for k in range(min(SHELLS, sampler.n_vectors.size)):
        yield Item(
            group=group,
            name=f"k = {sampler.reduced_wave_number[k]:.3f} x 2 pi/L",
            estimate=ensemble(table["structure"][:, k]),
            prediction=float(expected[k]),
            accuracy=share * float(expected[k]),
        )
    group = "density of particles"
    yield Item(
        group=group,
        name="mean over n",
        estimate=ensemble(table["density"][:, 0]),
        prediction=1.0 + theory.bias,
        accuracy=theory.accuracy("mean"),
    )
    yield Item(
        group=group,
        name="variance over n^2",
        estimate=ensemble(_variance(table["density"])),
        prediction=theory.variance,
        accuracy=theory.accuracy("variance") * theory.variance,
    )
    for parts in sampler.divisions:
        variance = theory.cell_variance(parts)
        yield Item(
            group="particles in cells",
            name=f"variance of their number, cells L/{parts}",
            estimate=ensemble(table[f"cells_{parts}"][:, 0]),
            prediction=variance,
            accuracy=theory.accuracy("cells") * variance,
        )
    yield Item(
        group="pressure",
        name="mean of P(rho_i) over rho c^2",
        estimate=ensemble(table["pressure"][:, 0]),
        prediction=theory.pressure,
        unit=1.0,
        accuracy=theory.accuracy("mean"),
    )


def _variance(density: Array) -> Array:
    """Mean squared deviation from the mean of the whole run, of each block."""
    shift = density[:, 0] - 1.0
    mean = shift.mean()
    return np.asarray(density[:, 1] - 2.0 * mean * shift + mean**2)
