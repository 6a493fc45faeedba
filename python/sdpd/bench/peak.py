"""What the machine can do at best, and what share of that a step reaches.

Operations of a pair are counted by hand from the loops, additions and multiplications alike, roots
and divisions as one each; the integers of the random numbers, about 80 a pair of an exchange and 15
of an explicit force, are left out. Bytes are those that must come from memory once the particles
outgrow the caches.
"""

from __future__ import annotations

from dataclasses import dataclass

from sdpd import validation

__all__ = ["Peak", "Work", "work"]

# A pair of the list: separation and square. One within the support, by what is done with it.
LISTED = 23
DENSITY, PRESSURE, FRICTION = 19, 45, 47
UNIFORM, GAUSSIAN, EXCHANGE = 7, 150, 140
# Bytes of a particle: densities and forces read and written, kicks and drift; of its pairs.
PARTICLE, EXCHANGED = 420, 140
SLOT, COUPLE = 4, 4


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The best of a loop of products and sums, and of one of loads and stores.

    Attributes
    ----------
    threads : int
    flops : float
        Operations of all threads together, in double precision [1/s].
    bandwidth : float
        Bytes moved by a <- b + s c [1/s].
    """

    threads: int
    flops: float
    bandwidth: float

    @classmethod
    def measure(cls, threads: int = 1) -> Peak:
        """Of this machine, in about half a second.

        Parameters
        ----------
        threads : int
            At most 256; each takes 48 MB for the while.
        """
        from sdpd import _core

        number = validation.integer("threads", threads, minimum=1, maximum=256)
        flops, bandwidth = _core.peak(number)
        return cls(threads=number, flops=flops, bandwidth=bandwidth)

    def __str__(self) -> str:
        threads = "one thread" if self.threads == 1 else f"{self.threads} threads"
        return (
            f"{threads} at best: {self.flops * 1e-9:.0f} GFlop/s in double precision, "
            f"{self.bandwidth * 1e-9:.0f} GB/s"
        )


@dataclass(frozen=True, kw_only=True)
class Work:
    """What a step has to do a particle.

    Attributes
    ----------
    flops : float
        Additions and multiplications.
    bytes : float
        From and to memory, where nothing is in a cache.
    """

    flops: float
    bytes: float


def work(pairs: float, near: float, listed: float, *, noise: str, splitting: bool) -> Work:
    """Of a step of an isothermal fluid.

    Parameters
    ----------
    pairs, near, listed : float
        Pairs a particle, each counted once: within the support, within the skin, and in the list.
    noise : {"none", "uniform", "gaussian"}
    splitting : bool
        Whether by the pair splitting rather than velocity Verlet.
    """
    noisy = {"none": 0, "uniform": UNIFORM, "gaussian": GAUSSIAN}[noise]
    flops = near * LISTED + pairs * (DENSITY + PRESSURE)
    moved = PARTICLE + 2.0 * SLOT * near
    if splitting:
        flops += 2.0 * (listed * LISTED + pairs * (EXCHANGE + noisy))
        moved += 2.0 * (EXCHANGED + COUPLE * listed)
    else:
        flops += pairs * (FRICTION + noisy)
    return Work(flops=flops, bytes=moved)
