"""Densities of the proposals of an exchange, of which acceptance needs the ratio.

Metropolis and Hastings: a proposal x -> x' with density q is accepted with probability
p(x') q(x' -> x)/(p(x) q(x -> x')). Of a pair p = exp((S_i + S_j)/k_B)/(T_i T_j) in energies, since
the measure is dS_i dS_j and dS = dE/T.
"""

from __future__ import annotations

import math


def log_normal(x: float, mean: float, variance: float) -> float:
    """ln of the density of a normal distribution."""
    return -0.5 * ((x - mean) ** 2 / variance + math.log(2.0 * math.pi * variance))


def log_relaxation(
    start: list[float],
    end: list[float],
    axis: list[float],
    rates: tuple[float, float],
    width: float,
) -> float:
    """ln of the density with which an Ornstein-Uhlenbeck process ends there.

    `rates` times the time, across `axis` and along it; `width` is the stationary variance of each
    component. Nothing moves across where that rate is 0.
    """
    across, along = rates
    first, last = (sum(map(float.__mul__, axis, u)) for u in (start, end))
    variance = -width * math.expm1(-2.0 * along)
    total = log_normal(last, first * math.exp(-along), variance)
    if across > 0.0:
        kept, variance = math.exp(-across), -width * math.expm1(-2.0 * across)
        rest = [
            (y - last * e) - kept * (x - first * e)
            for x, y, e in zip(start, end, axis, strict=True)
        ]
        # D - 1 directions, whichever they are
        square = sum(x * x for x in rest)
        normal = math.log(2.0 * math.pi * variance)
        total -= 0.5 * (square / variance + (len(axis) - 1) * normal)
    return total
