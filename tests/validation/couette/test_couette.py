"""Transient Couette flow without noise: within 1 %, better as the support grows."""

from __future__ import annotations

import numpy as np

import sdpd
from tests.validation import record
from tests.validation.channel import script

channel = script("channel")
KIND = "couette"


def test_as_published_within_one_per_cent() -> None:
    scene = sdpd.scenes.load(KIND)
    moments = channel.flow(KIND, scene)
    assert max(m.rms for m in moments) < 0.01
    # bulk and wall alike, where the dissertation has 4 % and 5 %
    assert max(m.density for m in moments) < 0.005
    refined = [
        channel.flow(KIND, channel.thin_scene(KIND, n, support))
        for support, n in channel.REFINEMENT
    ]
    largest = np.array([max(m.rms for m in run) for run in refined])
    # first order or better in the spacing, with h/dx growing as it falls
    assert largest[2] < largest[0] / 4.0 * 1.05
    record.store(
        KIND,
        {
            "rms_error_over_maximum": {f"{m.time:g} s": m.rms for m in moments},
            "density_error": max(m.density for m in moments),
            "refinement_largest_rms": dict(
                zip(
                    (f"h/dx {s:g}, {n} across" for s, n in channel.REFINEMENT),
                    largest.tolist(),
                    strict=True,
                )
            ),
        },
    )


def test_the_floor_is_the_viscosity_of_the_lattice() -> None:
    """Against the closed form with eta_eff, most of the error is gone."""
    scene = channel.thin_scene(KIND, 31, 3.0)
    plain = channel.flow(KIND, scene, (0.1, 0.2))
    known = channel.flow(KIND, scene, (0.1, 0.2), factor=scene.factors.viscosity)
    assert all(b.rms < 0.6 * a.rms for a, b in zip(plain, known, strict=True))
