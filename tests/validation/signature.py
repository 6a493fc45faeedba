"""Short trajectories that tell whether changed sources still make the same physics.

The long cases take hours, and most changes of the sources (a split file, a new integrator beside
the old ones) alter none of their trajectories. So the record keeps, with the hash of the sources it
was made on, the end states of some forty steps of scenes that between them enter every loop the
cases enter. It stands as long as the sources have that hash, or the present sources bring the same
end states to rounding. Trajectories part exponentially: other physics or other noise is far above
the tolerance, another order of sums far below.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import sdpd

SIGNATURES = Path(__file__).with_name("signatures.json")
TOLERANCE = 1e-7  # of the root mean square of an array
STEPS = {"pair_splitting": 40, "velocity_verlet": 300}
PROBES = 3  # weighted sums of an array: none of them could be blind to a fault alone


def _scene(dimension: int, edge: float, kernel: str = "lucy", **more: Any) -> sdpd.Scene:
    """m = dx = k_B T = 1."""
    constants = {"density": 1.0, "shear_viscosity": 20.0, "temperature": 1.0}
    fluid = sdpd.Fluid(boltzmann_constant=1.0, **{**constants, **more.pop("fluid", {})})
    support = more.pop("support", 2.4)
    arguments: dict[str, Any] = {
        "fluid": fluid,
        "box": sdpd.Box((edge,) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0, support=support, kernel=kernel),
        "start": sdpd.RandomStart(relax_steps=20),
        "sound_speed": 10.0,
    }
    return sdpd.Scene(**{**arguments, **more})


def _run(scene: sdpd.Scene, integrator: Any = "pair_splitting", **options: Any) -> sdpd.Simulation:
    sim = sdpd.Simulation(scene, integrator=integrator, seed=3, threads=1, **options)
    sim.run(steps=STEPS[sim.integrator.name], progress=False)
    return sim


def _deterministic(**more: Any) -> sdpd.Simulation:
    effects = sdpd.Effects(fluctuations=False)
    force = sdpd.SinusoidalForce(amplitude=1.0)
    scene = _scene(3, 8.0, effects=effects, body_force=force, start=sdpd.LatticeStart(), **more)
    return _run(scene, "velocity_verlet")


def _slab(integrator: Any, slip: bool = False, **options: Any) -> sdpd.Simulation:
    box = sdpd.Box((7.0, 7.0, 7.0), periodic="xy")
    walls = (
        sdpd.Plane(axis="z", at=0.0),
        sdpd.Plane(
            axis="z", at=7.0, velocity=(0.0, 0.0, 0.0) if slip else (1.0, 0.5, 0.0), slip=slip
        ),
    )
    force = sdpd.UniformForce((0.5, 0.0, 0.0))
    return _run(_scene(3, 7.0, box=box, walls=walls, body_force=force), integrator, **options)


def _closed(dimension: int, **more: Any) -> sdpd.Simulation:
    box = sdpd.Box((7.0,) * dimension, periodic="")
    return _run(_scene(dimension, 7.0, box=box, walls=sdpd.walls.enclosure(box), **more))


def _round(wall: sdpd.Cylinder | sdpd.Sphere, edge: float) -> sdpd.Simulation:
    dimension = 3 if isinstance(wall, sdpd.Sphere) else 2
    return _run(_scene(dimension, edge, walls=(wall,), support=2.2))


def _polyline() -> sdpd.Simulation:
    points = ((3.0, 3.0), (11.0, 4.0), (8.0, 8.0), (11.5, 11.0), (4.0, 11.0))
    return _run(_scene(2, 14.0, walls=(sdpd.Polyline(points=points),)))


OPEN: dict[str, Callable[[], sdpd.Simulation]] = {
    "3D Lucy splitting": lambda: _run(_scene(3, 8.0)),
    "3D Lucy splitting at 4 times the step": lambda: _run(_scene(3, 8.0), dt=0.08),
    "2D Lucy splitting, ideal gas": lambda: _run(
        _scene(2, 14.0, fluid={"equation_of_state": sdpd.eos.IdealGas()}, sound_speed=None)
    ),
    "3D Wendland C2 splitting, bulk viscosity": lambda: _run(
        _scene(3, 8.0, "wendland_c2", fluid={"bulk_viscosity": 5.0})
    ),
    "3D Wendland C4 splitting": lambda: _run(_scene(3, 8.0, "wendland_c4", support=2.6)),
    "3D Lucy, sinusoidal force, no noise": _deterministic,
}
VERLET: dict[str, Callable[[], sdpd.Simulation]] = {
    "3D Wendland C2 Verlet, uniform noise": lambda: _run(
        _scene(3, 8.0, "wendland_c2"), sdpd.VelocityVerlet(noise="uniform"), dt=0.002
    ),
    "2D quintic Verlet, central friction, iterated": lambda: _run(
        _scene(2, 14.0, "quintic_spline", effects=sdpd.Effects(central_friction=True)),
        sdpd.VelocityVerlet(noise="gaussian", iterations=2),
        dt=0.002,
    ),
    "3D Lucy Verlet, nitrogen": lambda: _run(
        sdpd.Scene(
            fluid=sdpd.fluids.nitrogen(),
            box=sdpd.Box((1e-7, 1e-7, 1e-7)),
            resolution=sdpd.Resolution(particles=343, support=2.2),
        ),
        "velocity_verlet",
    ),
    "slab, Verlet": lambda: _slab(sdpd.VelocityVerlet(noise="gaussian", iterations=1), dt=0.002),
}
WALLED: dict[str, Callable[[], sdpd.Simulation]] = {
    "slab, splitting": lambda: _slab("pair_splitting"),
    "slab, one wall slips": lambda: _slab("pair_splitting", slip=True),
    "square": lambda: _closed(2, kernel="wendland_c2"),
    "cube": lambda: _closed(3),
    "pipe": lambda: _run(
        _scene(
            3,
            30.0,
            box=sdpd.Box((7.0, 23.0, 23.0), periodic="x"),
            walls=(sdpd.Cylinder(radius=11.0, centre=(0.0, 11.5, 11.5), axis="x", fluid="inside"),),
            support=2.2,
        )
    ),
    "post": lambda: _round(sdpd.Cylinder(radius=11.0, centre=(14.0, 14.0)), 28.0),
    "sphere": lambda: _round(sdpd.Sphere(radius=5.0, centre=(7.0, 7.0, 7.0)), 14.0),
    "polyline": _polyline,
}


def _model(model: Any) -> sdpd.Simulation:
    """A pipe, whose curvature every model of walls feels."""
    verlet = isinstance(model, sdpd.OwnFootImages)
    scene = _scene(
        3,
        30.0,
        box=sdpd.Box((7.0, 23.0, 23.0), periodic="x"),
        walls=(sdpd.Cylinder(radius=11.0, centre=(0.0, 11.5, 11.5), axis="x", fluid="inside"),),
        support=2.2,
        wall_model=model,
    )
    integrator: Any = sdpd.VelocityVerlet(noise="gaussian") if verlet else "pair_splitting"
    sim = sdpd.Simulation(scene, integrator=integrator, dt=0.002, seed=3, threads=1)
    sim.run(steps=STEPS["pair_splitting"], progress=False)
    return sim


MODELS: dict[str, Callable[[], sdpd.Simulation]] = {
    "own-foot images": lambda: _model(sdpd.OwnFootImages(noise=True)),
    "completion": lambda: _model(sdpd.Completion()),
    "completed pressure": lambda: _model(sdpd.Completion(pressure="completion")),
    "frozen particles": lambda: _model(sdpd.FrozenParticles()),
}


def _gas(exponent: float = 0.0, **more: Any) -> sdpd.Scene:
    fluid = {
        "heat_capacity": 25.0,
        "thermal_conductivity": 500.0,
        "viscosity_exponent": exponent,
        "conductivity_exponent": exponent,
        "equation_of_state": sdpd.eos.IdealGas(),
    }
    return _scene(3, 8.0, **{"fluid": fluid, "effects": sdpd.Effects(energy=True), **more})


def _heated() -> sdpd.Simulation:
    box = sdpd.Box((7.0, 7.0, 7.0), periodic="xy")
    hot = sdpd.Isothermal(1.2)
    walls = (
        sdpd.Plane(axis="z", at=0.0, heat=sdpd.HeatFlux(2.0)),
        sdpd.Plane(axis="z", at=7.0, velocity=(1.0, 0.5, 0.0), heat=hot),
    )
    return _run(_gas(0.7, box=box, walls=walls))


THERMAL: dict[str, Callable[[], sdpd.Simulation]] = {
    "gas with an energy": lambda: _run(_gas()),
    "gas with an energy, eta(T) and kappa(T)": lambda: _run(_gas(0.7)),
    "gas with an energy, on adiabats": lambda: _run(
        _gas(), sdpd.PairSplitting(energy_bookkeeping=False)
    ),
    "gas with an energy between plates": _heated,
}
GROUPS = {
    "open": OPEN,
    "verlet": VERLET,
    "walled": WALLED,
    "thermal": THERMAL,
    "wall models": MODELS,
}


def numbers(sim: sdpd.Simulation) -> dict[str, list[float]]:
    """For each array its root mean square, and weighted sums over rows."""
    found: dict[str, list[float]] = {}
    names = ["positions", "velocities", "forces", "number_densities", "pressures"]
    names += ["temperatures"] if sim.scene.active_effects.energy else []
    for name in names:
        array = np.asarray(getattr(sim, name)).ravel()
        size = float(np.sqrt(np.mean(array**2)))
        place = np.arange(array.size, dtype=float)
        weights = [(place * (k + 0.618) * 0.7548776662) % 1.0 - 0.5 for k in range(PROBES)]
        sums = [float(w @ array) / array.size for w in weights]
        found[name] = [size, *sums]
    return found


@cache
def _present(group: str) -> dict[str, dict[str, list[float]]]:
    with warnings.catch_warnings():
        # steps that are too long for accuracy pass more of the loops in less time
        warnings.simplefilter("ignore", sdpd.SdpdWarning)
        return {name: numbers(build()) for name, build in GROUPS[group].items()}


def present(groups: Sequence[str]) -> dict[str, dict[str, list[float]]]:
    """End states with the present sources, by scene."""
    return {name: state for group in groups for name, state in _present(group).items()}


def load() -> dict[str, Any]:
    """Signatures of the sources that records were made on, by their hash."""
    if not SIGNATURES.exists():
        return {}
    signatures: dict[str, Any] = json.loads(SIGNATURES.read_text())
    return signatures


def store(physics: str, groups: Sequence[str], keep: set[str]) -> None:
    """Keeps the present signature under a hash, and of the others those in `keep`."""
    signatures = {key: value for key, value in load().items() if key in keep}
    # Cases of several groups share a hash: each adds what the others did not need.
    kept = signatures.get(physics, {})
    if not kept.keys() >= {name for group in groups for name in GROUPS[group]}:
        signatures[physics] = {**kept, **present(groups)}
        SIGNATURES.write_text(json.dumps(signatures, indent=1, sort_keys=True) + "\n")


def difference(physics: str, groups: Sequence[str]) -> str | None:
    """The first scene whose end state is another one than with the sources of that hash."""
    recorded = load().get(physics)
    if recorded is None:
        return "no signature of those sources is kept"
    for name, numbers in present(groups).items():
        if name not in recorded:
            return f"{name}: not in the signature"
        for array, values in numbers.items():
            old = recorded[name][array]
            largest = max(abs(a - b) for a, b in zip(values, old, strict=True))
            if not largest <= TOLERANCE * abs(old[0]):
                return f"{name}: {array} differ by {largest / old[0]:.1e} of their size"
    return None
