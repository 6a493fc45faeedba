"""Wall models as users choose them: scenes, files, simulations, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import sdpd
from sdpd import _core

from . import thermal

LAW = sdpd.eos.Linear(background_pressure=100.0)
FLUID = sdpd.Fluid(
    density=1.0,
    shear_viscosity=20.0,
    temperature=1.0,
    boltzmann_constant=1.0,
    equation_of_state=LAW,
)
MODELS = [
    sdpd.OwnFootImages(),
    sdpd.OwnFootImages(noise=True, least_distance=0.05),
    sdpd.Completion(),
    sdpd.Completion(pressure="completion", least_distance=0.2),
    sdpd.FrozenParticles(),
    sdpd.FrozenParticles(spacing=0.8, least_distance=0.2),
]
each_model = pytest.mark.parametrize("model", MODELS, ids=repr)


def scene_with(model, **changes):
    box = sdpd.Box((6.0, 8.0), periodic="x")
    arguments = {
        "fluid": FLUID,
        "box": box,
        "walls": sdpd.walls.slab(box, "y", upper_velocity=(0.5, 0.0)),
        "resolution": sdpd.Resolution(spacing=1.0, support=2.65, kernel="lucy"),
        "sound_speed": 10.0,
        "wall_model": model,
    }
    return sdpd.Scene(**{**arguments, **changes})


def integrator_of(model):
    own_foot = isinstance(model, sdpd.OwnFootImages)
    return sdpd.VelocityVerlet() if own_foot else sdpd.PairSplitting()


def simulation(model, **changes):
    scene = scene_with(model, **changes)
    dt = 0.2 * scene.friction_time
    return sdpd.Simulation(scene, integrator=integrator_of(model), dt=dt, seed=3, threads=1)


def test_symmetric_images_are_the_default():
    scene = scene_with(sdpd.SymmetricImages())
    assert scene == sdpd.Scene(
        **{k: getattr(scene, k) for k in ("fluid", "box", "walls", "resolution", "sound_speed")}
    )
    assert "wall_model" not in scene.to_toml()
    assert "wall_model" not in scene.core_arguments()
    assert "wall model" not in str(scene)


@each_model
def test_files_and_text(model):
    scene = scene_with(model)
    assert sdpd.Scene.from_toml(scene.to_toml()) == scene
    assert repr(model) in str(scene)
    for integrator in ("velocity_verlet", "pair_splitting"):
        assert str(scene.regime(integrator)) and str(scene.cost(integrator))


@each_model
def test_saved_simulations_go_on_with_the_same_bits(model, tmp_path):
    sim = simulation(model)
    sim.run(steps=15)
    sim.save(tmp_path / "state.sdpd")
    again = sdpd.load(tmp_path / "state.sdpd")
    assert again.scene.wall_model == model
    sim.run(steps=15)
    again.run(steps=15)
    assert np.array_equal(sim.positions, again.positions)
    assert np.array_equal(sim.velocities, again.velocities)
    sim.restore(tmp_path / "state.sdpd")
    sim.run(steps=15)
    assert np.array_equal(sim.velocities, again.velocities)


@each_model
def test_momentum_goes_to_the_walls(model):
    sim = simulation(model)
    before = sim.momentum
    forces = sdpd.WallForces(every=5)
    sim.run(steps=40, observe=forces)
    interval = np.diff(forces.time, prepend=0.0)
    received = (forces.force.sum(axis=1) * interval[:, None]).sum(axis=0)
    scale = np.abs(forces.force).sum() * interval[0]
    assert np.abs(sim.momentum - before + received).max() < 1e-12 * scale
    assert sim.statistics()["wall_particles"] > 0


def test_frozen_particles_go_on_with_the_lattice():
    scene = scene_with(sdpd.FrozenParticles())
    places = scene.wall_model.places(scene)
    layers = np.unique(np.round(places[:, 1], 9))
    assert np.allclose(layers[layers < 0.0], [-4.5, -3.5, -2.5, -1.5, -0.5])
    assert np.allclose(np.sort(layers), np.sort(8.0 - layers))
    # so that the densities of a lattice start are those of the bulk
    still = sdpd.Simulation(scene.replace(start=sdpd.LatticeStart(jitter=0.0)), seed=1, threads=1)
    assert np.ptp(still.number_densities) < 1e-12
    denser = sdpd.FrozenParticles(spacing=0.5).places(scene)
    assert len(denser) == pytest.approx(4 * len(places), rel=0.15)


def test_shaped_walls():
    """Own-foot images take them; the others need a distance in closed form."""
    box = sdpd.Box((8.0, 8.0), periodic="")
    outline = sdpd.Polyline(points=[(0, 0), (8, 0), (8, 8), (0, 8)])
    options = {"box": box, "walls": [outline]}
    sim = simulation(sdpd.OwnFootImages(), **options)
    sim.run(steps=10)
    for model in (sdpd.Completion(), sdpd.FrozenParticles()):
        with pytest.raises(
            ValueError, match=r"needs walls that are a Plane, a Cylinder or a Sphere"
        ):
            scene_with(model, **options)


def test_what_is_refused():
    with pytest.raises(TypeError, match=r"`wall_model` must be one of sdpd\.SymmetricImages, Own"):
        scene_with("completion")
    with pytest.raises(ValueError, match=r"`least_distance` must be .*>= 0"):
        sdpd.OwnFootImages(least_distance=-1.0)
    with pytest.raises(TypeError, match=r"`noise`"):
        sdpd.OwnFootImages(noise="yes")
    with pytest.raises(ValueError, match=r"`pressure` must be one of"):
        sdpd.Completion(pressure="none")
    with pytest.raises(ValueError, match=r"`spacing`"):
        sdpd.FrozenParticles(spacing=0.0)
    with pytest.raises(ValueError, match=r"`wall_model\.spacing` must be at most a support"):
        scene_with(sdpd.FrozenParticles(spacing=3.0))
    with pytest.raises(ValueError, match=r"needs Resolution\(kernel='lucy'\).*got 'wendland_c2'"):
        scene_with(sdpd.Completion(), resolution=sdpd.Resolution(spacing=1.0, support=2.65))
    with pytest.raises(ValueError, match=r"OwnFootImages needs integrator=sdpd\.VelocityVerlet"):
        sdpd.Simulation(scene_with(sdpd.OwnFootImages()))
    for model in (sdpd.Completion(), sdpd.FrozenParticles()):
        with pytest.raises(ValueError, match=r"needs `least_distance` > 0.*PairSplitting"):
            sdpd.Simulation(scene_with(model), integrator="velocity_verlet")
    text = scene_with(sdpd.Completion()).to_toml()
    with pytest.raises(ValueError, match=r"`wall_model.kind` must be one of.*'completeness'"):
        sdpd.Scene.from_toml(text.replace('"completion"', '"completeness"'))
    with pytest.raises(ValueError, match=r"`wall_model.pressure` must be one of"):
        sdpd.Scene.from_toml(text.replace('"images"', '"image"'))


def test_fluids_with_an_energy_are_refused():
    """At the edge of the package, and at that of the core."""
    box = sdpd.Box((8.0, 8.0, 8.0), periodic="xy")
    warm = thermal.scene(box=box, walls=sdpd.walls.slab(box))
    with pytest.raises(
        ValueError, match="`wall_model` must be SymmetricImages where the fluid has"
    ):
        warm.replace(wall_model=sdpd.Completion())
    sim = sdpd.Simulation(warm, threads=1)
    settings = {**sim._settings, "wall_model": sdpd.Completion().core()}
    with pytest.raises(ValueError, match='"symmetric_images" where the fluid has an energy'):
        _core.Core(sim.positions, sim.velocities, threads=1, **settings)


def test_without_walls_a_model_does_nothing():
    plain = scene_with(sdpd.SymmetricImages(), box=sdpd.Box((6.0, 8.0)), walls=())
    chosen = plain.replace(wall_model=sdpd.Completion())
    assert plain.core_arguments() == chosen.core_arguments()


def test_without_friction_every_integrator_will_do():
    model = sdpd.OwnFootImages()
    still = sdpd.Effects(fluctuations=False, dissipation=False)
    sim = sdpd.Simulation(scene_with(model, effects=still), integrator="pair_splitting", threads=1)
    sim.run(steps=3)
