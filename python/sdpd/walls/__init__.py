"""Walls of a scene: surfaces that bound the fluid, at rest or in motion.

A wall is a surface with the fluid on one side: a plane, a cylinder, a sphere, or a surface of any
shape, given by a function, by a polyline or by triangles. It may slide along itself or turn, so
that its place never changes. How particles feel it: docs/theory/walls.
"""

from __future__ import annotations

from sdpd.walls.base import BoundaryParticles, Wall
from sdpd.walls.level_set import LevelSet
from sdpd.walls.mesh import Mesh
from sdpd.walls.polyline import Polyline
from sdpd.walls.shaped import ShapedWall
from sdpd.walls.smooth import Cylinder, Plane, Sphere, enclosure, slab

__all__ = [
    "KINDS",
    "BoundaryParticles",
    "Cylinder",
    "LevelSet",
    "Mesh",
    "Plane",
    "Polyline",
    "ShapedWall",
    "Sphere",
    "Wall",
    "enclosure",
    "slab",
]

# Names in scene files; a LevelSet is a function, which no file can hold.
KINDS: dict[str, type[Wall]] = {
    "plane": Plane,
    "cylinder": Cylinder,
    "sphere": Sphere,
    "polyline": Polyline,
    "mesh": Mesh,
}
