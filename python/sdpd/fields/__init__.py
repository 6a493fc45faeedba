"""Eulerian fields from particles: kernel averages and bins, with standard errors (Yang 2.2.9)."""

from __future__ import annotations

from .evaluate import average, diffusivity_profile, snapshot
from .field_set import Field, FieldSet, ensemble
from .quantities import BUILT_IN, DEFAULT, Quantity
from .sampling import kernel_sums
from .state import State
from .targets import Bins, Grid, Line, Mesh, Plane, Points, Target

__all__ = [
    "BUILT_IN",
    "DEFAULT",
    "Bins",
    "Field",
    "FieldSet",
    "Grid",
    "Line",
    "Mesh",
    "Plane",
    "Points",
    "Quantity",
    "State",
    "Target",
    "average",
    "diffusivity_profile",
    "ensemble",
    "kernel_sums",
    "snapshot",
]
