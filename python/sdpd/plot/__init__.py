"""Pictures: profiles, maps and streamlines with matplotlib, particles and surfaces with PyVista.

Both are imported when they are used: ``pip install 'sdpd[plot]'`` and ``'sdpd[visual]'``; pages in
HTML need ``'sdpd[html]'`` as well.
"""

from __future__ import annotations

from .curves import profile
from .gl import require_gl
from .maps import field_map, streamlines
from .overview import overview
from .spatial import (
    boundary_particles,
    new_plotter,
    particles,
    save,
    slices,
    stream_tubes,
    surface,
)

__all__ = [
    "boundary_particles",
    "field_map",
    "new_plotter",
    "overview",
    "particles",
    "profile",
    "require_gl",
    "save",
    "slices",
    "stream_tubes",
    "streamlines",
    "surface",
]
