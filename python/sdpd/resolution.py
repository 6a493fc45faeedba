"""How finely the fluid is cut into particles, and with which kernel they see each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sdpd import kernels, validation
from sdpd.box import AXES, Box

__all__ = ["DEFAULT_KERNEL", "DEFAULT_SUPPORT", "Layout", "Resolution"]

# Chosen from the measured table in docs/theory/kernels: Wendland C2 never pairs, whatever the
# equation of state, and at 3.0 a fluid loses 3.2 % of the viscosity. Where Lucy does not pair it is
# better at two thirds of the pairs (2.64: 2.0 %).
DEFAULT_KERNEL = "wendland_c2"
DEFAULT_SUPPORT = 3.0

# A lattice cut unequally along the axes is no longer the cubic one of the discrete factors.
_LARGEST_ANISOTROPY = 1.1

LARGEST_SUPPORT = 50.0  # in spacings: lattice sums grow with its power of D
LARGEST_NUMBER = 10**18  # of particles: beyond any memory, and exact enough as a float


@dataclass(frozen=True)
class Layout:
    """The particles a resolution puts into a box.

    Attributes
    ----------
    n_particles : int
        N.
    spacing : float
        dx = (V/N)^(1/D) [length].
    counts : tuple of int or None
        Particles along each axis if they fit a lattice.
    """

    n_particles: int
    spacing: float
    counts: tuple[int, ...] | None


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """Number of particles, support of the kernel and the kernel.

    Parameters
    ----------
    spacing : float, optional
        dx [length]: edge of the volume of a particle. Exactly one of `spacing` and `particles`.
    particles : int or sequence of int, optional
        Their number, or their number along each axis of a lattice.
    support : float
        h/dx [1], with h the full support radius of the kernel; > 1.
    kernel : str
        One of ``sdpd.kernels.names()``.

    Raises
    ------
    ValueError
        If both or none of `spacing` and `particles` are given, or a value is out of range.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.Resolution(particles=3375, kernel="lucy", support=2.64).support
    2.64
    """

    spacing: float | None = None
    particles: int | tuple[int, ...] | None = None
    support: float = DEFAULT_SUPPORT
    kernel: str = DEFAULT_KERNEL

    def __post_init__(self) -> None:
        if (self.spacing is None) == (self.particles is None):
            got = "neither" if self.spacing is None else "both"
            raise ValueError(f"exactly one of `spacing` and `particles` must be given, got {got}")
        object.__setattr__(self, "spacing", validation.optional_positive("spacing", self.spacing))
        if isinstance(self.particles, (list, tuple, np.ndarray)):
            counts = tuple(
                validation.integer(f"particles[{k}]", n, minimum=1, maximum=LARGEST_NUMBER)
                for k, n in enumerate(self.particles)
            )
            object.__setattr__(self, "particles", counts)
        elif self.particles is not None:
            count = validation.integer(
                "particles", self.particles, minimum=1, maximum=LARGEST_NUMBER
            )
            object.__setattr__(self, "particles", count)
        support = validation.positive("support", self.support)
        if support <= 1.0:
            raise ValueError(
                f"`support` must be > 1 (in units of the spacing: particles further apart than h "
                f"do not interact), got {support:g}"
            )
        if support > LARGEST_SUPPORT:
            raise ValueError(
                f"`support` must be <= {LARGEST_SUPPORT:g} spacings (a particle then has half a "
                f"million neighbours in 3D), got {support:g}"
            )
        object.__setattr__(self, "support", support)
        validation.choice("kernel", self.kernel, kernels.names())

    def layout(self, box: Box, *, lattice: bool) -> Layout:
        """Particles in that box, on a lattice or anywhere.

        Raises
        ------
        ValueError
            If the particles do not fit a lattice, with what would if that has two supports along
            every axis; or if they are more than 10^18.
        """
        if isinstance(self.particles, tuple):
            return self._from_counts(box, self.particles, "particles")
        if self.particles is not None:
            return self._from_number(box, self.particles, lattice)
        return self._from_spacing(box, lattice)

    def _from_counts(self, box: Box, counts: tuple[int, ...], name: str) -> Layout:
        if len(counts) != box.dimension:
            raise ValueError(
                f"`{name}` must have one count per axis of the box ({box.dimension}), "
                f"got {len(counts)}: {counts}"
            )
        edges = [length / count for length, count in zip(box.lengths, counts, strict=True)]
        if max(edges) > _LARGEST_ANISOTROPY * min(edges):
            shown = ", ".join(f"{edge:.4g} along {a}" for edge, a in zip(edges, AXES, strict=False))
            raise ValueError(
                f"`{name}` must give spacings within {_LARGEST_ANISOTROPY - 1:.0%} of each other, "
                f"got {shown}"
            )
        number = _checked_number(math.prod(counts), name)
        return Layout(number, _mean_spacing(box, number), counts)

    def _hints(self, box: Box, counts: tuple[int, ...], lattice: str) -> str:
        """What to do instead: only what leaves two supports along every axis."""
        edges = [length / count for length, count in zip(box.lengths, counts, strict=True)]
        even = max(edges) <= _LARGEST_ANISOTROPY * min(edges)
        spacing = _mean_spacing(box, math.prod(counts))
        roomy = min(box.lengths) >= 2.0 * self.support * spacing * (1.0 - 1e-12)
        return lattice if even and roomy else ""

    def _random_hint(self, box: Box, spacing: float, what: str = "") -> str:
        if min(box.lengths) < 2.0 * self.support * spacing * (1.0 - 1e-12):
            return ""
        return f"use start=sdpd.RandomStart(){what}"

    def _from_number(self, box: Box, number: int, lattice: bool) -> Layout:
        spacing = _mean_spacing(box, number)
        counts = tuple(max(1, round(length / spacing)) for length in box.lengths)
        if math.prod(counts) == number:
            try:
                return self._from_counts(box, counts, "particles")
            except ValueError:
                if lattice:
                    raise
        if lattice:
            fit = f"{math.prod(counts)} = {' x '.join(map(str, counts))} would fit"
            hints = (
                self._hints(box, counts, fit),
                self._random_hint(box, spacing, ", which takes any number"),
            )
            raise ValueError(
                "`particles` must fill a lattice of about equal spacing in the box, got "
                + _joined(str(number), hints)
            )
        return Layout(number, spacing, None)

    def _from_spacing(self, box: Box, lattice: bool) -> Layout:
        spacing = self.spacing
        assert spacing is not None
        ratios = [length / spacing for length in box.lengths]
        if not math.prod(ratios) <= LARGEST_NUMBER:
            raise ValueError(
                f"`spacing` must leave at most {LARGEST_NUMBER:.0e} particles in the box, got "
                f"{spacing:g}, which makes {math.prod(ratios):.3g}"
            )
        counts = tuple(max(1, round(ratio)) for ratio in ratios)
        fits = all(
            abs(length - count * spacing) <= 1e-6 * length
            for length, count in zip(box.lengths, counts, strict=True)
        )
        if fits:
            number = math.prod(counts)
            return Layout(number, _mean_spacing(box, number), counts)
        if lattice:
            axis = next(
                k
                for k, length in enumerate(box.lengths)
                if abs(length - counts[k] * spacing) > 1e-6 * length
            )
            got = (
                f"{spacing:g} with length {box.lengths[axis]:g} along {AXES[axis]} (ratio "
                f"{box.lengths[axis] / spacing:.6g})"
            )
            hints = (
                self._hints(box, counts, f"particles={counts} is the nearest lattice"),
                self._random_hint(box, spacing),
            )
            raise ValueError(
                "`spacing` must divide every length of the box for a lattice, got "
                + _joined(got, hints)
            )
        number = max(1, round(box.volume / spacing**box.dimension))
        return Layout(number, _mean_spacing(box, number), None)


def _checked_number(number: int, name: str) -> int:
    return validation.integer(f"product of {name}", number, maximum=LARGEST_NUMBER)


def _joined(got: str, hints: tuple[str, ...]) -> str:
    given = ", or ".join(hint for hint in hints if hint)
    return f"{got}; {given}" if given else got


def _mean_spacing(box: Box, number: int) -> float:
    return float((box.volume / number) ** (1.0 / box.dimension))
