"""Sums over particles at the points of a target: by a kernel, or by bins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdpd import kernels, validation

from .state import State
from .targets import Bins, Target

__all__ = ["BinSampler", "KernelSampler", "Sampler", "kernel_sums", "make_sampler"]

Array = NDArray[np.float64]


def kernel_sums(
    points: ArrayLike,
    positions: ArrayLike,
    values: ArrayLike,
    *,
    box: ArrayLike,
    length: float,
    kernel: str = "wendland_c2",
    periodic: tuple[bool, ...] | None = None,
    threads: int = 1,
) -> Array:
    r"""Sums of the kernel, of its square, and of the kernel times each value, at points.

    Parameters
    ----------
    points : array_like, shape (P, D)
        [length].
    positions : array_like, shape (N, D)
        Wrapped or not [length].
    values : array_like, shape (N, C)
        What particles carry; C may be 0.
    box : array_like, shape (D,)
        Edge lengths [length].
    length : float
        Support radius l_d of the kernel [length], at most the edge of each periodic axis.
    kernel : str
        See `sdpd.kernels`.
    periodic : tuple of bool, length D, optional
        The periodic axes; all if None.
    threads : int
        Changes no bit of the result.

    Returns
    -------
    ndarray, shape (P, 2 + C)
        :math:`\sum_i W, \sum_i W^2, \sum_i W a_i` with :math:`W = W(|\mathbf r-\mathbf r_i|)` of
        unit integral [1/length^D, 1/length^(2 D), unit of a/length^D].

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong shape, is not finite or is out of range.
    """
    from sdpd import _core

    place = validation.real_array("positions", positions, (None, None))
    dimension = place.shape[1]
    if dimension not in (2, 3):
        raise ValueError(f"`positions` must have 2 or 3 columns, got {dimension}")
    where = validation.real_array("points", points, (None, dimension))
    carried = validation.real_array("values", values, (len(place), None))
    edges = validation.real_array("box", box, (dimension,))
    length = validation.positive("length", length)
    name = kernels.get(kernel).name
    flags = (True,) * dimension if periodic is None else periodic
    _check_length(length, edges.tolist(), flags)
    threads = validation.integer("threads", threads, minimum=1)
    sums = _core.kernel_sums(
        where,
        place,
        carried,
        edges=[float(edge) if turns else 0.0 for edge, turns in zip(edges, flags, strict=True)],
        support=length,
        kernel=name,
        threads=threads,
    )
    sums /= length**dimension
    sums[:, 1] /= length**dimension
    return sums


def _check_length(length: float, edges: Sequence[float], periodic: Sequence[bool]) -> None:
    for axis, (edge, turns) in enumerate(zip(edges, periodic, strict=True)):
        if turns and length > edge * (1.0 + 1e-12):
            raise ValueError(
                f"`length` must be at most the edge of each periodic axis, {edge:g} along axis "
                f"{axis}, got {length:g}"
            )


@dataclass(frozen=True)
class KernelSampler:
    """Kernel sums at the points of a target."""

    target: Target
    length: float
    kernel: str
    threads: int = 1

    def sums(self, state: State, positions: Array, values: Array) -> Array:
        """See `kernel_sums`, (P, 2 + C)."""
        return kernel_sums(
            self.target.points,
            positions,
            values,
            box=state.box,
            length=self.length,
            kernel=self.kernel,
            periodic=state.periodic,
            threads=self.threads,
        )


@dataclass(frozen=True)
class BinSampler:
    """Sums over the particles in each bin, per volume."""

    target: Bins

    def sums(self, state: State, positions: Array, values: Array) -> Array:
        """The same columns with weights 1/volume."""
        bins = self.target
        where = positions[:, bins.axis]
        assert state.periodic is not None
        if state.periodic[bins.axis]:
            edge = state.box[bins.axis]
            where = where - edge * np.floor(where / edge)
            where = np.where(where >= edge, 0.0, where)  # -tiny folds to the edge itself
        size = len(bins)
        index = np.searchsorted(bins.edges, where, side="right") - 1
        index[where == bins.edges[-1]] = size - 1
        inside = (index >= 0) & (index < size)
        index = index[inside]
        counts = np.bincount(index, minlength=size) / bins.volumes
        carried = [np.bincount(index, column, size) for column in values[inside].T]
        columns = [counts, counts / bins.volumes, *(column / bins.volumes for column in carried)]
        return np.stack(columns, axis=1)


Sampler = KernelSampler | BinSampler


def make_sampler(
    target: Target, state: State, *, length: float | None, kernel: str, threads: int = 1
) -> Sampler:
    """The sampler of a target, checked against the box.

    Raises
    ------
    TypeError, ValueError
        If the target has another dimension, or the averaging length is missing or too long.
    """
    validation.instance("target", target, Target, "a target, e.g. sdpd.fields.Grid.over(box, ...)")
    if target.dimension != state.dimension:
        raise ValueError(
            f"`target` must have {state.dimension} dimensions as the box, got {target.dimension}"
        )
    if isinstance(target, Bins):
        return BinSampler(target)
    if length is None:
        raise ValueError("`length` must be given, the support radius of the averaging kernel")
    length = validation.positive("length", length)
    assert state.periodic is not None
    _check_length(length, state.box, state.periodic)
    return KernelSampler(target, length, kernels.get(kernel).name, threads)
