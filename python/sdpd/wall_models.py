"""How walls act on particles: the model of a scene's walls, as plain data for the compiled core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.box import AXES
from sdpd.initial import LatticeStart
from sdpd.walls import Cylinder, Sphere

if TYPE_CHECKING:
    from sdpd.integrators import Integrator
    from sdpd.scene import Scene

__all__ = ["Completion", "FrozenParticles", "OwnFootImages", "SymmetricImages", "WallModel"]

Array = NDArray[np.float64]

_DEPTH = 2.0  # of frozen places, in supports: the deeper half completes the density of the other
_PRESSURES = ("images", "completion")


class WallModel:
    """Base of the models of walls."""

    name: ClassVar[str] = ""

    def core(self) -> tuple[str, list[float]]:
        """Name and numbers for the core."""
        raise NotImplementedError

    def check(self, scene: Scene) -> None:
        """Raise ValueError if the model does not go with the scene."""

    def check_integrator(self, scene: Scene, integrator: Integrator) -> None:
        """Raise ValueError if the model does not go with the integrator."""

    def arguments(self, scene: Scene) -> dict[str, Any]:
        """Keyword arguments of the core."""
        return {"wall_model": self.core()}


@dataclass(frozen=True, kw_only=True)
class SymmetricImages(WallModel):
    """Images that act on each other symmetrically: the model of this package.

    Distances and weights of images are symmetric in the two particles, forces the gradient of a
    potential at walls of any shape, and drag and noise in balance. See `docs/theory/walls.md`.
    """

    name: ClassVar[str] = "symmetric_images"

    def core(self) -> tuple[str, list[float]]:  # noqa: D102
        return self.name, []

    def arguments(self, scene: Scene) -> dict[str, Any]:  # noqa: D102
        return {}


@dataclass(frozen=True, kw_only=True)
class OwnFootImages(WallModel):
    """Each particle mirrored at the foot of its own perpendicular: Yang (2013), 2.2.4 to 2.2.6.

    For comparison. At curved walls what i feels from the image of j is not what j feels from that
    of i: the force is no gradient, and energy is not conserved. Where walls meet, each has images
    of its own, and there are no images of images.

    Parameters
    ----------
    noise : bool
        Whether the friction with images has noise, drawn for each particle and image on its own.
        Without it, as published, the layer at a wall is too cold by a quarter to a half; with it
        by some per cent.
    least_distance : float
        No image of a particle nearer to the wall than that [length]: l_min of Yang's Table 3.

    Examples
    --------
    >>> import sdpd
    >>> sdpd.OwnFootImages(noise=True).core()
    ('own_foot_images', [1.0, 0.0])
    """

    name: ClassVar[str] = "own_foot_images"

    noise: bool = False
    least_distance: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", validation.boolean("noise", self.noise))
        _set_least_distance(self)

    def core(self) -> tuple[str, list[float]]:  # noqa: D102
        return self.name, [float(self.noise), self.least_distance]

    def check_integrator(self, scene: Scene, integrator: Integrator) -> None:  # noqa: D102
        if scene.active_effects.dissipation and integrator.name != "velocity_verlet":
            raise ValueError(
                "`wall_model` OwnFootImages needs integrator=sdpd.VelocityVerlet(): its friction "
                f"is not symmetric and cannot be split into exchanges, got {integrator.title}"
            )


@dataclass(frozen=True, kw_only=True)
class Completion(WallModel):
    """Density and friction completed in closed form, as in Yang (2013), appendix B.

    For comparison; with Lucy's kernel at planes, cylinders and spheres. The density is the sum over
    particles over 1 - Delta, to first order in the curvature of the wall; friction is
    that with a solid in which the velocity goes on linearly, with the noise that belongs to it.
    Where walls meet, the factors 1 - Delta are multiplied.

    Parameters
    ----------
    pressure : {"images", "completion"}
        Whether pressure forces are those of symmetric images, or the gradient of the completed
        density: under the latter particles sit on the wall and cross it.
    least_distance : float
        Distances below it count as that in the friction [length], which has no bound at the wall.
        Velocity Verlet needs one > 0.
    """

    name: ClassVar[str] = "completion"

    pressure: str = "images"
    least_distance: float = 0.0

    def __post_init__(self) -> None:
        validation.choice("pressure", self.pressure, _PRESSURES)
        _set_least_distance(self)

    def core(self) -> tuple[str, list[float]]:  # noqa: D102
        return self.name, [float(self.pressure == "completion"), self.least_distance]

    def check(self, scene: Scene) -> None:  # noqa: D102
        _refuse_shaped(self, scene)
        kernel = scene.resolution.kernel
        if kernel != "lucy":
            raise ValueError(
                "`wall_model` Completion needs Resolution(kernel='lucy'), whose integrals over a "
                f"solid are known in closed form, got {kernel!r}"
            )

    def check_integrator(self, scene: Scene, integrator: Integrator) -> None:  # noqa: D102
        _check_bound(self, self.least_distance, scene, integrator)


@dataclass(frozen=True, kw_only=True)
class FrozenParticles(WallModel):
    """Particles that do not move, behind the wall, as in Bian et al. (2015), appendix G.

    For comparison; at planes, cylinders and spheres. A lattice of the fluid's spacing goes on
    behind the wall. Its particles have density and pressure, and in friction the velocity that
    makes the fluid's vanish at the wall. Each belongs to the wall it is deepest behind.

    Parameters
    ----------
    spacing : float, optional
        Of their lattice [length]; that of the scene if None.
    least_distance : float
        Distances of fluid particles to the wall below it count as that in the friction [length],
        which has no bound at the wall. Velocity Verlet needs one > 0.
    """

    name: ClassVar[str] = "frozen_particles"

    spacing: float | None = None
    least_distance: float = 0.0

    def __post_init__(self) -> None:
        value = validation.optional_positive("spacing", self.spacing)
        object.__setattr__(self, "spacing", value)
        _set_least_distance(self)

    def core(self) -> tuple[str, list[float]]:  # noqa: D102
        return self.name, [self.least_distance]

    def check(self, scene: Scene) -> None:  # noqa: D102
        _refuse_shaped(self, scene)
        if self.spacing is not None and self.spacing > scene.support_radius:
            raise ValueError(
                f"`wall_model.spacing` must be at most a support, {scene.support_radius:.6g}, got "
                f"{self.spacing:.6g}"
            )

    def check_integrator(self, scene: Scene, integrator: Integrator) -> None:  # noqa: D102
        _check_bound(self, self.least_distance, scene, integrator)

    def arguments(self, scene: Scene) -> dict[str, Any]:  # noqa: D102
        return {"wall_model": self.core(), "frozen": self.places(scene)}

    def places(self, scene: Scene) -> Array:
        """A lattice behind the walls, to twice the support, (M, D) [length].

        The lattice of a `LatticeStart` goes on; of another start, or with a spacing of its own, it
        has the number density of the fluid, and its layers begin half a spacing behind planes.
        """
        depth, geometry = _DEPTH * scene.support_radius, scene.geometry
        sites = np.stack(np.meshgrid(*self._axes(scene, depth), indexing="ij"), axis=-1)
        sites = sites.reshape(-1, scene.dimension)
        distance = geometry.distance(sites)
        behind = (distance < -1e-9 * scene.spacing) & (distance > -depth)
        return np.asarray(sites[behind])

    def _axes(self, scene: Scene, depth: float) -> list[Array]:
        """Coordinates of the lattice along each axis."""
        geometry, extents = scene.geometry, scene.geometry.extents
        if self.spacing is None and isinstance(scene.start, LatticeStart):
            given = None if geometry.is_cuboid else scene.resolution.spacing
            axes: list[Array] = []
            for axis, (low, high) in enumerate(extents):
                count = max(1, round((high - low) / (given or scene.spacing)))
                step = (high - low) / count
                beyond = 0 if _is_periodic(scene, axis) else int(np.ceil(depth / step))
                axes.append(np.asarray(low + (np.arange(-beyond, count + beyond) + 0.5) * step))
            return axes
        spacing = scene.spacing if self.spacing is None else self.spacing
        whole = [axis for axis in range(scene.dimension) if _goes_round(scene, axis)]
        counts = {k: max(1, round((extents[k][1] - extents[k][0]) / spacing)) for k in whole}
        steps = {k: (extents[k][1] - extents[k][0]) / counts[k] for k in whole}
        # the other axes make up for what whole numbers of spacings have changed
        free = scene.dimension - len(whole)
        left = spacing**scene.dimension / float(np.prod(list(steps.values()) or [1.0]))
        step = left ** (1.0 / free) if free else spacing
        axes = []
        for axis, (low, high) in enumerate(extents):
            if axis in whole:
                axes.append(np.asarray(low + (np.arange(counts[axis]) + 0.5) * steps[axis]))
            elif geometry.is_cuboid:
                layers = (np.arange(np.ceil(depth / step)) + 0.5) * step
                axes.append(np.concatenate([low - layers[::-1], high + layers]))
            else:
                reach = 0.5 * (high - low) + (0.0 if _is_periodic(scene, axis) else depth)
                half = (np.arange(np.floor(reach / step)) + 0.5) * step
                axes.append(0.5 * (low + high) + np.concatenate([-half[::-1], half]))
        return axes


MODELS: dict[str, type[WallModel]] = {
    model.name: model for model in (SymmetricImages, OwnFootImages, Completion, FrozenParticles)
}


def _is_periodic(scene: Scene, axis: int) -> bool:
    return AXES[axis] in scene.box.periodic_axes


def _goes_round(scene: Scene, axis: int) -> bool:
    """Whether what is behind the walls goes on through a periodic face."""
    if not _is_periodic(scene, axis):
        return False
    for wall in scene.walls:
        if not isinstance(wall, (Cylinder, Sphere)) or wall.fluid == "inside":
            return True
        along = getattr(wall, "axis", None)
        centre, length = wall.centre[axis], scene.box.lengths[axis]
        inside = wall.radius <= centre <= length - wall.radius
        if along == AXES[axis] or not inside:
            return True
    return False


def _set_least_distance(model: Any) -> None:
    value = validation.non_negative("least_distance", model.least_distance)
    object.__setattr__(model, "least_distance", value)


def _refuse_shaped(model: WallModel, scene: Scene) -> None:
    if scene.geometry.is_shaped:
        raise ValueError(
            f"`wall_model` {type(model).__name__} needs walls that are a Plane, a Cylinder or a "
            "Sphere; SymmetricImages and OwnFootImages work at walls of any shape"
        )


def _check_bound(model: WallModel, least: float, scene: Scene, integrator: Integrator) -> None:
    split = integrator.name == "pair_splitting"
    if least == 0.0 and scene.active_effects.dissipation and not split:
        raise ValueError(
            f"`wall_model` {type(model).__name__} needs `least_distance` > 0, a tenth of the "
            "spacing say, or integrator=sdpd.PairSplitting(): its friction has no bound at the "
            f"wall, got {integrator.title}"
        )
