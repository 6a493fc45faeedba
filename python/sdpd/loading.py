"""How many particles fill a geometry with walls, and on which lattice sites."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sdpd.geometry import Geometry
from sdpd.resolution import LARGEST_NUMBER, Layout, Resolution

__all__ = ["lattice_sites", "layout", "quasi_random_sites"]

Array = NDArray[np.float64]
# Sites of a lattice nearer to a wall than this, in spacings, are left out.
_CLEARANCE = 0.1


def layout(resolution: Resolution, geometry: Geometry, *, lattice: bool) -> Layout:
    """Number and spacing of the particles that a resolution puts into the fluid.

    Raises
    ------
    ValueError
        If a lattice does not fit, or the number does not.
    """
    if geometry.is_cuboid:
        return resolution.layout(geometry.cuboid, lattice=lattice)
    dimension, volume = geometry.box.dimension, geometry.volume
    if volume <= 0.0:
        raise ValueError(f"`walls` must leave room for the fluid, got a volume of {volume:g}")
    if isinstance(resolution.particles, tuple):
        raise ValueError(
            "`particles` must be one number, or `spacing` be given, where the fluid does not fill "
            f"a box, got {resolution.particles}"
        )
    if lattice:
        if resolution.spacing is None:
            raise ValueError(
                "`particles` must be None on a lattice that walls cut, which has as many as fit: "
                "give `spacing`, or use start=sdpd.RandomStart(), which takes any number"
            )
        number = len(lattice_sites(geometry, resolution.spacing))
    elif resolution.particles is not None:
        number = resolution.particles
    else:
        assert resolution.spacing is not None
        number = max(1, round(volume / resolution.spacing**dimension))
    if not 0 < number <= LARGEST_NUMBER:
        raise ValueError(f"`walls` must leave room for particles, got {number} of them")
    return Layout(number, float((volume / number) ** (1.0 / dimension)), None)


def lattice_sites(geometry: Geometry, spacing: float) -> Array:
    """Sites of about that spacing in the fluid, (N, D) [length], centred between plane walls."""
    axes = []
    for low, high in geometry.extents:
        count = max(1, round((high - low) / spacing))
        axes.append(low + (np.arange(count) + 0.5) * ((high - low) / count))
    if math.prod(len(axis) for axis in axes) > LARGEST_NUMBER:
        raise ValueError(f"`spacing` must leave at most {LARGEST_NUMBER:.0e} particles")
    sites = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return np.asarray(sites[geometry.distance(sites) > _CLEARANCE * spacing])


def quasi_random_sites(geometry: Geometry, number: int) -> Array:
    """The first `number` points in the fluid of an additive recurrence, (N, D) [length].

    With the generalised golden ratio (Roberts 2018): without long density waves, which are slow
    to decay.
    """
    dimension = geometry.box.dimension
    ratio = 2.0
    for _ in range(60):  # the root of x^(D+1) = x + 1
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1))
    steps = ratio ** -np.arange(1.0, dimension + 1.0)
    low, high = np.asarray(geometry.extents).T
    found: list[Array] = []
    have, first = 0, 0
    chunk = 2 * number + 1024
    while have < number:
        index = np.arange(first, first + chunk)[:, None]
        points = low + ((0.5 + index * steps) % 1.0) * (high - low)
        points = points[geometry.distance(points) > 0.0]
        found.append(points)
        have, first = have + len(points), first + chunk
        if first > 10**4 * chunk:
            raise ValueError("`walls` must leave room for particles, got next to none")
    return np.concatenate(found)[:number]
