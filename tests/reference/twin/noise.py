"""Counter-based pair noise: Philox4x32-10 in NumPy, key layout, Gaussian and uniform variates.

Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Words = NDArray[np.uint64]

STREAMS = {
    "pair_force": 1,
    "pair_exchange": 2,
    "initial_velocity": 3,
    "initial_position": 4,
    "pair_thermal": 5,
    "pair_acceptance": 6,
    "pair_thermal_force": 7,
}

_LOW32 = np.uint64(0xFFFFFFFF)
_SHIFT32 = np.uint64(32)
_LOW10 = np.uint64(2**10 - 1)


def _low(x: Words) -> Words:
    return x & _LOW32


def _high(x: Words) -> Words:
    return x >> _SHIFT32


def philox4x32(counter: Words, key: Words) -> Words:
    """Ten rounds of Philox4x32; `counter` (n, 4) and `key` (n, 2) hold 32-bit words."""
    c0, c1, c2, c3 = (np.array(c, dtype=np.uint64) for c in np.asarray(counter).T)
    k0, k1 = (np.array(k, dtype=np.uint64) for k in np.asarray(key).T)
    for _ in range(10):
        first = np.uint64(0xD2511F53) * c0
        second = np.uint64(0xCD9E8D57) * c2
        c0, c1, c2, c3 = (
            _high(second) ^ c1 ^ k0,
            _low(second),
            _high(first) ^ c3 ^ k1,
            _low(first),
        )
        k0 = _low(k0 + np.uint64(0x9E3779B9))
        k1 = _low(k1 + np.uint64(0xBB67AE85))
    return np.stack([c0, c1, c2, c3], axis=-1)


def fmix64(x: Words) -> Words:
    """Finaliser of MurmurHash3 (Appleby); a bijection that keeps zero."""
    x = np.array(x, dtype=np.uint64)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xFF51AFD7ED558CCD)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xC4CEB9FE1A85EC53)
    return x ^ (x >> np.uint64(33))


def fmix32(x: Words) -> Words:
    """The same of 32-bit words."""
    x = _low(np.array(x, dtype=np.uint64))
    x ^= x >> np.uint64(16)
    x = _low(x * np.uint64(0x85EBCA6B))
    x ^= x >> np.uint64(13)
    x = _low(x * np.uint64(0xC2B2AE35))
    return x ^ (x >> np.uint64(16))


def pair_counters(stream: str, step: int, draw: int, id_a: Words, id_b: Words) -> Words:
    """Counters (n, 4) of the pairs; symmetric in the two ids."""
    a, b = np.asarray(id_a, dtype=np.uint64), np.asarray(id_b, dtype=np.uint64)
    lo, hi = np.minimum(a, b), np.maximum(a, b)
    mixed = fmix64(_high(lo) | (_high(hi) << _SHIFT32))
    c2 = np.full_like(lo, step & 0xFFFFFFFF)
    c3 = ((step >> 32) & 0xFFFF) | ((draw & 0xFF) << 16) | ((STREAMS[stream] & 0xFF) << 24)
    return np.stack(
        [_low(lo) ^ _low(mixed), _low(hi) ^ _high(mixed), c2, np.full_like(lo, c3)], axis=-1
    )


def variates_of_words(words: Words, variate: str, dimension: int) -> Array:
    """Zero mean, unit variance numbers (n, dimension) from Philox words (n, 4)."""
    w = words.astype(np.float64)
    if variate == "uniform":
        return np.sqrt(12.0) * ((w[:, :dimension] + 0.5) * 2.0**-32 - 0.5)
    if variate != "gaussian":
        raise ValueError(f"unknown variate {variate!r}")
    radius = np.sqrt(-2.0 * np.log((w[:, 0::2] + 0.5) * 2.0**-32))
    angle = 2.0 * np.pi * (w[:, 1::2] * 2.0**-32)
    z = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    return z.reshape(len(w), 4)[:, :dimension]


def pair_words(seed: int, stream: str, step: int, draw: int, id_a: Words, id_b: Words) -> Words:
    """Philox words (n, 4) of the pairs."""
    counter = pair_counters(stream, step, draw, id_a, id_b)
    key = np.empty((len(counter), 2), dtype=np.uint64)
    key[:] = seed & 0xFFFFFFFF, (seed >> 32) & 0xFFFFFFFF
    return philox4x32(counter, key)


def particle_words(seed: int, step: int, ids: Words) -> Words:
    """The 32-bit words (n,) of particles, from which velocity Verlet makes those of its pairs."""
    return pair_words(seed, "pair_force", step, 0, ids, ids)[:, 0]


def force_variates(
    seed: int, step: int, id_a: Words, id_b: Words, variate: str, dimension: int
) -> Array:
    """Variates (n, dimension) of pairs under velocity Verlet: (a, b) has minus those of (b, a)."""
    a, b = (particle_words(seed, step, np.asarray(ids, np.uint64)) for ids in (id_a, id_b))
    turns = [_low(np.uint64(turn * 0x9E3779B9)) for turn in range(4)]
    words = np.stack([fmix32(_low(a + b) ^ turn) for turn in turns], axis=-1)
    if variate == "uniform":
        tenths = np.stack([(words[:, 0] >> np.uint64(2 + 10 * n)) & _LOW10 for n in range(3)], -1)
        levels = (tenths[:, :dimension].astype(np.float64) + 0.5) * 2.0**-10 - 0.5
        xi = levels * np.sqrt(12.0 / (1.0 - 2.0**-20))
    else:
        # The core draws normal ones in single precision: from its fractions, in double precision.
        upper = (words >> np.uint64(1)).astype(np.float32)
        half = np.float32(0.5)
        u = np.where([True, False] * 2, upper + half, upper).astype(np.float64) * 2.0**-31
        radius, angle = np.sqrt(-2.0 * np.log(u[:, 0::2])), 2.0 * np.pi * u[:, 1::2]
        z = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
        xi = z.reshape(len(words), 4)[:, :dimension]
    return np.where(a > b, -1.0, 1.0)[:, None] * xi


def pair_variates(
    seed: int,
    stream: str,
    step: int,
    draw: int,
    id_a: Words,
    id_b: Words,
    variate: str,
    dimension: int,
) -> Array:
    """Variates (n, dimension) of the pairs, up to four, the same for (a, b) and (b, a)."""
    words = pair_words(seed, stream, step, draw, id_a, id_b)
    return variates_of_words(words, variate, dimension)
