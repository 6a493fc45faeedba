"""Averaged fields with their standard errors."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import validation

from .quantities import Recipe
from .targets import Bins, Target

if TYPE_CHECKING:
    from sdpd.analysis.blocked import BlockedFunction

__all__ = ["Field", "FieldSet", "FrameStatistics", "ensemble"]

Array = NDArray[np.float64]


class FrameStatistics:
    """Running mean and spread of the instantaneous values at each point (Welford)."""

    def __init__(self) -> None:
        self.count: Any = 0.0
        self.mean: Any = 0.0
        self.square: Any = 0.0

    def add(self, value: Array) -> None:
        """Take a frame; points where it is NaN (no particle in reach) are passed over."""
        there = np.isfinite(value)
        self.count = self.count + there
        safe = np.where(there, value, self.mean)
        delta = safe - self.mean
        self.mean = self.mean + delta / np.maximum(self.count, 1.0)
        self.square = self.square + delta * (safe - self.mean)

    def copy(self) -> FrameStatistics:
        """Another one with the same contents."""
        return self.joined(FrameStatistics())

    def joined(self, other: FrameStatistics) -> FrameStatistics:
        """Of the frames of both."""
        both = FrameStatistics()
        both.count = self.count + other.count
        total = np.maximum(both.count, 1.0)
        delta = other.mean - self.mean
        both.mean = self.mean + delta * other.count / total
        both.square = self.square + other.square + delta**2 * self.count * other.count / total
        return both

    @property
    def average(self) -> Array:
        """Mean over frames; NaN where no frame had a value."""
        return np.where(self.count > 0, self.mean, np.nan)

    @property
    def deviation(self) -> Array:
        """Standard deviation between frames; NaN from fewer than two."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.count > 1, np.sqrt(self.square / (self.count - 1.0)), np.nan)


@dataclass(frozen=True, kw_only=True, eq=False)
class Field:
    r"""One averaged field.

    Attributes
    ----------
    name, unit : str
    mean, stderr : ndarray, shape (\*shape) or (\*shape, C)
        Estimate from the pooled sums, and its standard error by the jackknife over blocks; NaN
        where no particle was in reach, the error also from a single block.
    frame_mean, frame_deviation : ndarray, same shape
        Mean and standard deviation of the instantaneous fields: for a quotient the mean differs
        from `mean` by about its relative fluctuation squared.
    components : tuple of str
        Empty for a scalar.
    n_blocks : int
    target : Target
    length_unit : str
        Of coordinates.
    """

    name: str
    unit: str
    mean: Array
    stderr: Array
    frame_mean: Array
    frame_deviation: Array
    components: tuple[str, ...]
    n_blocks: int
    target: Target
    length_unit: str = ""

    def component(self, which: str | int) -> Field:
        """One component as a scalar field.

        Raises
        ------
        ValueError
            If there is no such component.
        """
        names = self.components
        if isinstance(which, str):
            index = names.index(validation.choice("component", which, names))
        else:
            index = validation.integer("component", which, minimum=0)
            if index >= len(names):
                raise ValueError(f"`component` must be below {len(names)}, got {index}")
        cut = {
            name: getattr(self, name)[..., index]
            for name in ("mean", "stderr", "frame_mean", "frame_deviation")
        }
        return replace(self, name=f"{self.name}_{names[index]}", components=(), **cut)

    def z(self, expected: ArrayLike) -> Array:
        """Distance of `mean` from expected values in standard errors."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray((self.mean - np.asarray(expected)) / self.stderr)

    def p(self, expected: ArrayLike) -> Array:
        """Two-sided probability of a distance at least as large, by Student's t."""
        from scipy import stats

        return np.asarray(2.0 * stats.t.sf(np.abs(self.z(expected)), self.n_blocks - 1))

    def __repr__(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        return f"<sdpd.fields.Field {self.name}{unit}: shape {self.mean.shape}>"


@dataclass(frozen=True, kw_only=True, eq=False)
class FieldSet:
    """Averaged fields on one target: ``fields["velocity"]`` or ``fields["velocity_x"]``.

    Attributes
    ----------
    target : Target
        Where.
    recipes : tuple of Recipe
        What; see `names`.
    columns : dict
        Where each sum lies in the last axis of `sums`.
    sums : ndarray, shape (B, P, K)
        Sums over the frames of each block.
    frames : ndarray, shape (B,)
        Frames of each block.
    statistics : dict of FrameStatistics
        Of the instantaneous fields.
    time : tuple of float
        First and last frame [time].
    length : float or None
        Support radius of the averaging kernel [length]; None for bins.
    kernel : str or None
        Its name.
    length_unit : str
        Of coordinates.
    """

    target: Target
    recipes: tuple[Recipe, ...]
    columns: dict[str, tuple[int, int]]
    sums: Array
    frames: Array
    statistics: dict[str, FrameStatistics]
    time: tuple[float, float]
    length: float | None
    kernel: str | None
    length_unit: str
    _known: dict[str, Field] = field(default_factory=dict, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities."""
        return tuple(made.name for made in self.recipes)

    @property
    def n_frames(self) -> int:
        """Frames behind the averages."""
        return int(self.frames.sum())

    @property
    def n_blocks(self) -> int:
        """Blocks behind the errors."""
        return len(self.frames)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Field:
        if name in self._known:
            return self._known[name]
        for made in self.recipes:
            if name == made.name:
                self._known[name] = self._field(made)
                return self._known[name]
            if name in [f"{made.name}_{component}" for component in made.components]:
                return self[made.name].component(name[len(made.name) + 1 :])
        validation.choice("name", name, self.names)
        raise AssertionError

    @property
    def particles_in_reach(self) -> Array:
        r"""Effective number of particles behind an instantaneous value, (\*shape).

        (sum W)^2/sum W^2; in bins the mean number of particles. Below about 5 the kernel is too
        narrow for an instantaneous field.
        """
        sums = named_sums(self.columns, self.sums.sum(axis=0))
        with np.errstate(invalid="ignore", divide="ignore"):
            number = sums["one"] ** 2 / sums["square"] / self.n_frames
        return np.asarray(np.nan_to_num(number).reshape(self.target.shape))

    def block_growth(self, name: str) -> float:
        """By how much the standard error grows if neighbouring blocks are joined in pairs.

        About 1 if blocks are longer than the correlation time, up to the root of 2 if they are much
        shorter: then the error is too small, and the run too short for its number of blocks. Root
        mean square over points and components; NaN from fewer than 8 blocks.
        """
        if self.n_blocks < 8:
            return np.nan
        even = self.n_blocks // 2 * 2
        halves = [a[:even].reshape(even // 2, 2, *a.shape[1:]) for a in (self.sums, self.frames)]
        sums, frames = (each.sum(axis=1) for each in halves)
        if even < self.n_blocks:
            sums[-1] += self.sums[-1]
            frames[-1] += self.frames[-1]
        joined = replace(self, sums=sums, frames=frames, _known={})
        with np.errstate(invalid="ignore", divide="ignore"):
            square = (joined[name].stderr ** 2).ravel(), (self[name].stderr ** 2).ravel()
        known = np.isfinite(square[0]) & np.isfinite(square[1])
        below = float(square[1][known].sum())
        return float(np.sqrt(square[0][known].sum() / below)) if below > 0.0 else np.nan

    def _field(self, made: Recipe) -> Field:
        total, count = self.sums.sum(axis=0), float(self.frames.sum())
        mean = made.evaluate(named_sums(self.columns, total), count)
        stderr = np.full_like(mean, np.nan)
        number = self.n_blocks
        if number > 1:
            # Distances of the delete-one values from their mean, without keeping all of them.
            plain, square = np.zeros_like(mean), np.zeros_like(mean)
            for block, frames in zip(self.sums, self.frames, strict=True):
                left = made.evaluate(named_sums(self.columns, total - block), count - frames)
                plain += left - mean
                square += (left - mean) ** 2
            spread = np.maximum(square - plain**2 / number, 0.0)
            stderr = np.sqrt((number - 1.0) / number * spread)
        statistics = self.statistics[made.name]
        shape = (*self.target.shape, *mean.shape[1:])

        def shaped(values: Array) -> Array:
            return np.asarray(np.broadcast_to(values, mean.shape).reshape(shape))

        return Field(
            name=made.name,
            unit=made.unit,
            mean=shaped(mean),
            stderr=shaped(stderr),
            frame_mean=shaped(statistics.average),
            frame_deviation=shaped(statistics.deviation),
            components=made.components,
            n_blocks=number,
            target=self.target,
            length_unit=self.length_unit,
        )

    def blocked(self, name: str) -> BlockedFunction:
        """A number per point as a function of `sdpd.analysis`, whose `derive` fits with errors.

        Parameters
        ----------
        name : str
            A scalar quantity or a component, e.g. ``"velocity_x"``; not the temperature, which is
            no quotient of two sums.

        Returns
        -------
        sdpd.analysis.Profile or sdpd.analysis.blocked.BlockedFunction
            The former for bins.
        """
        from sdpd.analysis.blocked import BlockedFunction, Profile, block_means

        scalar = self[name]
        if scalar.components:
            raise ValueError(f"`name` must be that of a component, got {name!r}")
        made = next(r for r in self.recipes if name == r.name or name.startswith(f"{r.name}_"))
        if made.kind == "temperature":
            raise ValueError("`name` must be a plain or a weighted mean, got 'temperature'")
        sums = named_sums(self.columns, self.sums)
        weights = np.broadcast_to(self.frames[:, None], sums["one"].shape)
        if made.kind == "mean":
            weights = sums[made.columns[1]] if len(made.columns) > 1 else sums["one"]
        values = sums["one"] if made.kind == "count" else sums[made.columns[0]]
        if values.ndim == 3:
            values = values[..., made.components.index(name[len(made.name) + 1 :])]
        blocks = block_means(np.ascontiguousarray(values), weights)
        if isinstance(self.target, Bins):
            return Profile(
                edges=self.target.edges, blocks=blocks, block_counts=weights, window=self.time
            )
        return BlockedFunction(blocks=blocks, block_counts=weights, window=self.time)

    def to_xarray(self) -> Any:
        """An xarray.Dataset: each quantity, and with ``_stderr`` its standard error.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        from .export import to_xarray

        return to_xarray(self)

    def to_meshio(self) -> Any:
        """A meshio.Mesh with each quantity and its ``_stderr`` as point data.

        Raises
        ------
        ImportError
            If meshio is not installed.
        """
        from .export import to_meshio

        return to_meshio(self)

    def to_pyvista(self) -> Any:
        """A pyvista.ImageData (a grid), StructuredGrid (a plane) or UnstructuredGrid.

        Raises
        ------
        ImportError
            If pyvista is not installed.
        """
        from .export import to_pyvista

        return to_pyvista(self)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a file: ``.csv``, or what meshio knows by its ending (``.vtu``, ``.vtk``, ...).

        Raises
        ------
        ImportError
            If meshio is needed and not installed.
        ValueError
            If the ending is unknown.
        """
        from .export import write

        return write(self, path)

    def __str__(self) -> str:
        """A row for each component; growth: see `block_growth`, above some 1.2 is a warning."""
        from sdpd.units import table

        rows = []
        for name in self:
            whole = self[name]
            for part in map(whole.component, whole.components) if whole.components else [whole]:
                growth = self.block_growth(part.name)
                shown = f"{growth:.2f}" if np.isfinite(growth) else "-"
                rows.append([part.name, part.unit, *map(_shown, _summary(part)), shown])
        frames = f"{self.n_frames} frames in {self.n_blocks} blocks, {len(self.target)} points"
        header = ["field", "unit", "lowest", "mean", "highest", "standard error", "growth"]
        return f"{frames}\n{table(rows, header)}"

    def __repr__(self) -> str:
        return (
            f"<sdpd.fields.FieldSet on {type(self.target).__name__} {self.target.shape}: "
            f"{', '.join(self.names)}; {self.n_frames} frames in {self.n_blocks} blocks>"
        )


def _summary(part: Field) -> tuple[float, float, float, float]:
    """Lowest, mean and highest value, and the mean standard error, of the points that have one."""
    known, errors = (each[np.isfinite(each)] for each in (part.mean, part.stderr))
    if not known.size:
        return (np.nan,) * 4
    error = float(errors.mean()) if errors.size else np.nan
    return float(known.min()), float(known.mean()), float(known.max()), error


def _shown(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


def ensemble(members: Sequence[FieldSet]) -> FieldSet:
    """Pool the same fields of independent runs; the errors come from their spread.

    Parameters
    ----------
    members : sequence of FieldSet
        Of equal targets and quantities, at least 2; at one time or averaged over a time.

    Returns
    -------
    FieldSet
        Each member is one block. Frames are pooled: members of more frames weigh more.

    Raises
    ------
    ValueError
        If there are fewer than 2 or they differ in what they hold.
    """
    members = list(members)
    for index, member in enumerate(members):
        validation.instance(f"members[{index}]", member, FieldSet, "an sdpd.fields.FieldSet")
    if len(members) < 2:
        raise ValueError(f"`members` must be at least 2, got {len(members)}")
    first = members[0]
    for index, other in enumerate(members[1:], start=1):
        alike = (
            other.target.shape == first.target.shape
            and np.array_equal(other.target.points, first.target.points)
            and (other.recipes, other.columns) == (first.recipes, first.columns)
            and (other.length, other.kernel) == (first.length, first.kernel)
        )
        if not alike:
            raise ValueError(
                f"`members[{index}]` must have the target, quantities, length and kernel of the "
                f"first, got {other!r}"
            )
    statistics = {name: each.copy() for name, each in first.statistics.items()}
    for other in members[1:]:
        for name, each in other.statistics.items():
            statistics[name] = statistics[name].joined(each)
    return replace(
        first,
        sums=np.stack([member.sums.sum(axis=0) for member in members]),
        frames=np.array([member.frames.sum() for member in members]),
        statistics=statistics,
        time=(min(m.time[0] for m in members), max(m.time[1] for m in members)),
        _known={},
    )


def named_sums(columns: dict[str, tuple[int, int]], sums: Array) -> dict[str, Array]:
    """Sums by name; the last axis of what is not a vector is dropped."""
    return {
        name: sums[..., at] if width == 0 else sums[..., at : at + width]
        for name, (at, width) in columns.items()
    }
