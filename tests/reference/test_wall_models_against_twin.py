"""The wall models for comparison against the NumPy twin: densities, forces, noise, momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sdpd import _core

from .test_walls_against_twin import (
    EDGE,
    Geometry,
    assert_same_forces,
    bent,
    bubble,
    core,
    duct,
    ellipsoid,
    numbers,
    pipe,
    post,
    problem,
    rms,
    slab,
    sphere,
    tilted,
)
from .twin.wall_models import CompletionSystem, FrozenSystem, OwnFootSystem, behind_a_plane
from .twin.walls import NO_EDGE, WallSystem

Array = NDArray[np.float64]

ROUND: list[tuple[Geometry, int]] = [(pipe, 2), (pipe, 3), (post, 2), (post, 3), (sphere, 3)]
ANALYTIC = [(slab, 2), (slab, 3), (tilted, 3), (duct, 2), (duct, 3), *ROUND, (bubble, 3)]
OWN_FOOT = [*ANALYTIC, (bent, 2), (ellipsoid, 3)]


def names(cases: list[tuple[Geometry, int]]) -> list[str]:
    return [f"{geometry.__name__}-{dimension}d" for geometry, dimension in cases]


def as_model(kind: type[Any], system: WallSystem, **more: Any) -> Any:
    fields = {name: getattr(system, name) for name in WallSystem.__dataclass_fields__}
    return kind(**fields, **more)


def own_foot(geometry: Geometry, dimension: int, **more: Any) -> tuple[OwnFootSystem, Any]:
    """The twin and the core's arguments."""
    noise, least = more.pop("noisy", False), more.pop("least", 0.0)
    system = as_model(
        OwnFootSystem, problem(geometry, dimension, **more), noisy=noise, least_distance=least
    )
    return system, {"wall_model": ("own_foot_images", [float(noise), least])}


def completion(geometry: Geometry, dimension: int, **more: Any) -> tuple[CompletionSystem, Any]:
    exact, least = more.pop("exact", False), more.pop("least", 0.1)
    system = as_model(
        CompletionSystem, problem(geometry, dimension, **more), exact=exact, least_distance=least
    )
    return system, {"wall_model": ("completion", [float(exact), least])}


def frozen(geometry: Geometry, dimension: int, **more: Any) -> tuple[FrozenSystem, Any]:
    """A lattice of spacing 0.9 or so behind the walls."""
    least = more.pop("least", 0.1)
    system = problem(geometry, dimension, **more)
    deep = 2.0 * system.support
    axes = []
    for edge in system.box:
        if edge == NO_EDGE:
            axes.append(np.arange(-deep, EDGE + deep, 0.93))
        else:
            count = round(edge / 0.93)
            axes.append((np.arange(count) + 0.3) * (edge / count))
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    phi = np.min([wall.stand(places, system.box).distance for wall in system.walls], axis=0)
    places = places[(phi < 0.0) & (phi > -deep)]
    twin = as_model(FrozenSystem, system, places=places, least_distance=least)
    return twin, {"wall_model": ("frozen_particles", [least]), "frozen": places}


MODELS = [own_foot, completion, frozen]


@pytest.mark.parametrize(("geometry", "dimension"), OWN_FOOT, ids=names(OWN_FOOT))
@pytest.mark.parametrize("noisy", [False, True])
def test_own_foot_images(geometry: Geometry, dimension: int, noisy: bool) -> None:
    system, arguments = own_foot(geometry, dimension, noisy=noisy)
    sim = core(system, **arguments)
    assert_same_forces(sim, system)
    assert np.any(sim.force_parts()["random"] != 0.0)


def test_no_image_nearer_to_the_wall_than_the_least_distance() -> None:
    for geometry, dimension in ((slab, 2), (pipe, 3)):
        system, arguments = own_foot(geometry, dimension, least=0.3)
        assert min(stand.distance.min() for stand in system.stands) < 0.2
        assert_same_forces(core(system, **arguments), system)


@pytest.mark.parametrize(("geometry", "dimension"), ANALYTIC, ids=names(ANALYTIC))
def test_completion(geometry: Geometry, dimension: int) -> None:
    """Noise is the root of what the closed forms leave of unity at the end of the support: 1e-8."""
    system, arguments = completion(geometry, dimension)
    sim = core(system, **arguments)
    assert_same_forces(core(system, **{**arguments, "noise": "none"}), system.at(noise="none"))
    random = system.forces().random
    assert np.abs(sim.force_parts()["random"] - random).max() < 1e-8 * rms(random)


@pytest.mark.parametrize(("geometry", "dimension"), [(slab, 3), (duct, 2), (pipe, 2), (post, 3)])
def test_completed_pressure(geometry: Geometry, dimension: int) -> None:
    """The twin differentiates by fourth-order differences, which holds the bound at 1e-8."""
    system, arguments = completion(geometry, dimension, exact=True)
    sim = core(system, **arguments)
    assert_same_forces(sim, system, 1e-8)
    assert np.abs(sim.pressures / system.pressures - 1.0).max() < 1e-11


@pytest.mark.parametrize(("geometry", "dimension"), ANALYTIC, ids=names(ANALYTIC))
def test_frozen_particles(geometry: Geometry, dimension: int) -> None:
    system, arguments = frozen(geometry, dimension)
    assert len(system.seen.i) > 50
    assert_same_forces(core(system, **arguments), system)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("friction", ["central", "none"])
def test_every_friction(model: Any, friction: str) -> None:
    for geometry, dimension in ((pipe, 2), (duct, 3)):
        system, arguments = model(geometry, dimension, friction=friction)
        assert_same_forces(core(system, **arguments), system, 1e-8)


@pytest.mark.parametrize("model", [own_foot, frozen])
@pytest.mark.parametrize("kernel", ["quintic_spline", "wendland_c2", "wendland_c4"])
def test_other_kernels(model: Any, kernel: str) -> None:
    system, arguments = model(pipe, 3, kernel=kernel)
    assert_same_forces(core(system, **arguments), system)


def test_own_foot_images_at_planes_are_the_symmetric_ones() -> None:
    """Density and pressure force; friction differs in the part along e e."""
    for dimension in (2, 3):
        system, arguments = own_foot(slab, dimension)
        sim, symmetric = core(system, **arguments), core(system)
        d = symmetric.number_densities
        assert np.abs(sim.number_densities - d).max() < 1e-13 * d.mean()
        one, other = sim.force_parts(), symmetric.force_parts()
        scale = rms(other["conservative"])
        assert np.abs(one["conservative"] - other["conservative"]).max() < 1e-13 * scale
        assert np.abs(one["dissipative"] - other["dissipative"]).max() > 1e-3 * scale


@pytest.mark.parametrize("dimension", [2, 3])
def test_closed_forms(dimension: int) -> None:
    """Delta, psi, psi1, psi2 and C against quadrature of the kernel over the solid."""
    s = np.array([0.0001, 0.001, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])
    got = _core.wall_completion(dimension, s)
    expected = behind_a_plane("lucy", dimension, s, points=120)
    volume, psi, across, along, curved, slope = got.T
    assert np.abs(volume - expected[:, 0]).max() < 1e-10
    assert np.abs(psi - expected[:, 1]).max() < 1e-10
    assert np.abs(across - expected[:, 2]).max() < 1e-10
    assert np.abs(across + along - expected[:, 3]).max() < 1e-10
    assert np.abs(curved - expected[:, 4]).max() < 1e-10
    assert np.abs(dimension * across + along - psi).max() < 1e-13
    step = 1e-5
    middle = s[1:-1]
    up, down = (_core.wall_completion(dimension, middle + sign * step) for sign in (1.0, -1.0))
    assert np.abs((up[:, 0] - down[:, 0]) / (2.0 * step) + psi[1:-1]).max() < 1e-8
    assert np.abs((up[:, 4] - down[:, 4]) / (2.0 * step) - slope[1:-1]).max() < 1e-8
    ends = {2: (4.0 / np.pi, 4.0 / (3.0 * np.pi)), 3: (21.0 / 16.0, 21.0 / 64.0)}[dimension]
    first = _core.wall_completion(dimension, np.array([0.0]))[0]
    assert first[:4] == pytest.approx((0.5, ends[0], ends[1], ends[1]), abs=1e-14)
    assert np.array_equal(_core.wall_completion(dimension, np.array([1.0, 1.7])), np.zeros((2, 6)))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 2), (pipe, 3), (post, 3)])
def test_reaction_and_impulse_of_the_walls(model: Any, geometry: Geometry, dimension: int) -> None:
    """Walls feel what the fluid feels, and get the momentum it loses, bounces included."""
    options = {"noisy": True} if model is own_foot else {"least": 0.3}
    system, arguments = model(geometry, dimension, **options)
    integrators = (
        ["velocity_verlet"] if model is own_foot else ["velocity_verlet", "pair_splitting"]
    )
    for integrator in integrators:
        sim = core(system, integrator, **arguments)
        scale = rms(sim.forces) * np.sqrt(system.size)
        total = sim.wall_forces()[:, :dimension].sum(axis=0) + sim.forces.sum(axis=0)
        assert np.abs(total).max() < 1e-12 * scale
        sim.run(7, 0.001)
        sim.run(13, 0.001)
        lost = (system.velocities - sim.velocities).sum(axis=0)
        received = sim.wall_impulses()[:, :dimension].sum(axis=0)
        size = np.abs(sim.wall_impulses()).sum()
        assert size > 1.0
        assert np.abs(lost - received).max() < 1e-12 * size


@pytest.mark.parametrize("model", MODELS)
def test_bits(model: Any) -> None:
    """On any number of threads, however a run is cut, across save and load."""
    system, arguments = model(post, 3)
    for integrator in (
        ("velocity_verlet",)
        if model is own_foot
        else (
            "velocity_verlet",
            "pair_splitting",
        )
    ):
        sims = [core(system, integrator, threads=k, **arguments) for k in (1, 2, 3)]
        for sim in sims:
            sim.run(20, 0.001)
        for sim in sims[1:]:
            assert np.array_equal(sim.positions, sims[0].positions)
            assert np.array_equal(sim.velocities, sims[0].velocities)
            assert np.array_equal(sim.wall_impulses(), sims[0].wall_impulses())
        whole, part, again = (
            core(system, integrator, skin=0.02, threads=k, **arguments) for k in (1, 2, 3)
        )
        whole.run(20, 0.001)
        part.run(11, 0.001)
        again.set_state(part.state())
        again.run(9, 0.001)
        assert whole.statistics()["prunings"] > whole.statistics()["grid_renewals"]
        assert np.array_equal(again.positions, whole.positions)
        assert np.array_equal(again.velocities, whole.velocities)
        if model is own_foot:
            # Half way between two copies of the post a particle changes from one to the other, and
            # its image with it: a jump that one list sees and another does not.
            system, arguments = model(pipe, 3)
            sims = [core(system, integrator, **arguments)]
            whole = core(system, integrator, skin=0.02, **arguments)
            for sim in (whole, *sims):
                sim.run(20, 0.001)
        # and a skin is only speed: nobody who came near was missed
        assert np.abs(whole.velocities - sims[0].velocities).max() < 1e-9


@pytest.mark.parametrize("model", [completion, frozen])
def test_exact_friction_of_short_steps_is_the_force(model: Any) -> None:
    """Without noise: what two half exchanges of a step do, to first order in it."""
    for geometry, dimension in ((pipe, 3), (slab, 2)):
        system, arguments = model(geometry, dimension, noise="none", least=0.3)
        dt = 1e-7
        sim = core(system, "pair_splitting", dt=dt, **arguments)
        force = sim.force_parts()
        expected = force["conservative"] + force["dissipative"]
        sim.run(1, dt)
        got = (sim.velocities - system.velocities) / dt
        # lost precision: 1e-16 * v/dt against forces of hundreds
        assert np.abs(got - expected).max() < 2e-4 * rms(expected)


@pytest.mark.parametrize(("geometry", "dimension"), [(duct, 2), (pipe, 3)])
def test_friction_rate(geometry: Geometry, dimension: int) -> None:
    """Mean trace of what multiplies a particle's own velocity in the drag."""
    system, arguments = own_foot(geometry, dimension)
    a, b = system.across_along
    one = a + b / dimension
    direct = system.friction_rates().sum()
    links = 0.0
    d = system.number_densities
    for s in system.seen:
        g = system.slope(s) / (d[s.i] * d[s.k])
        links += one * np.sum(g * np.where(s.i == s.k, 2.0, 1.0))
    rate = core(system, **arguments).friction_rate()
    assert rate == pytest.approx((direct + links) / system.size, rel=1e-11)

    filled, arguments = completion(geometry, dimension)
    links = 0.0
    for wall in range(len(filled.walls)):
        across, along = filled.grips(wall)
        links += np.sum((dimension - 1) * across + along) / dimension
    direct = filled.friction_rates().sum()
    rate = core(filled, **arguments).friction_rate()
    assert rate == pytest.approx((direct + links) / filled.size, rel=1e-11)

    icy, arguments = frozen(geometry, dimension)
    links = one * icy.links()[0].sum()
    direct = icy.friction_rates().sum()
    rate = core(icy, **arguments).friction_rate()
    assert rate == pytest.approx((direct + links) / icy.size, rel=1e-11)


@pytest.mark.parametrize("model", MODELS)
def test_walls_on_which_the_fluid_slips(model: Any) -> None:
    """They push, but have no friction: all that is left acts between particles."""
    system, arguments = model(slab, 3)
    walls = [(kind, [*rest[:-1], 1.0]) for kind, rest in (numbers(w, 3) for w in system.walls)]
    parts = core(system, walls=walls, **arguments).force_parts()
    for name in ("dissipative", "random"):
        size = np.abs(parts[name]).sum()
        assert size > 1.0
        assert np.abs(parts[name].sum(axis=0)).max() < 1e-13 * size
    sticky = core(system, **arguments).force_parts()
    assert np.array_equal(parts["conservative"], sticky["conservative"])


def test_models_that_do_not_fit_are_refused() -> None:
    system, arguments = own_foot(slab, 3)
    with pytest.raises(ValueError, match='needs the integrator "velocity_verlet"'):
        core(system, "pair_splitting", **arguments)
    system, arguments = completion(slab, 3, kernel="wendland_c2")
    with pytest.raises(ValueError, match='needs the kernel "lucy"'):
        core(system, **arguments)
    for model in (completion, frozen):
        system, arguments = model(slab, 3, least=0.0)
        with pytest.raises(ValueError, match='needs the integrator "pair_splitting", or a least'):
            core(system, **arguments)
        core(system, "pair_splitting", **arguments)
        system, _ = model(slab, 2)
        shaped = problem(bent, 2)
        with pytest.raises(ValueError, match="needs walls that are planes"):
            core(shaped, **arguments)
    system, arguments = frozen(slab, 3)
    inside = np.concatenate([arguments["frozen"], [[1.0, 1.0, 1.0]]])
    with pytest.raises(ValueError, match="`frozen` must lie behind the walls"):
        core(system, **{**arguments, "frozen": inside})
    with pytest.raises(ValueError, match="none within a support"):
        core(system, **{**arguments, "frozen": inside[:0]})
    with pytest.raises(ValueError, match='`wall_model` must be "symmetric_images"'):
        core(system, wall_model=("mirrors", []))
    with pytest.raises(ValueError, match="`wall_model` must have 2 numbers, got 1"):
        core(system, wall_model=("completion", [1.0]))
