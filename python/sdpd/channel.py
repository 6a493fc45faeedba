"""Flow between two plates from rest beside its closed form; the command is ``sdpd channel``.

The ready scenes `poiseuille` and `couette`: Yang (2013), sections 3.1 and 3.2, without noise.
"""

from __future__ import annotations

import csv
import itertools
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation
from sdpd.drawing import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    figure_or_new,
    save,
)
from sdpd.effects import UniformForce
from sdpd.resolution import Resolution
from sdpd.scene import Scene
from sdpd.theory import couette_velocity, poiseuille_velocity
from sdpd.units import quantity, table

__all__ = ["KINDS", "TIMES", "Moment", "Study", "plot", "run_channel", "write", "write_figure"]

Array = NDArray[np.float64]
KINDS = ("poiseuille", "couette")
TIMES = (0.05, 0.1, 0.2, 0.5, 1.0)  # s, as published
LIMIT = 0.01  # of the rms error over the steady maximum
_QUICK = 20  # layers of particles
_SIZE = (9.0, 3.6)  # inch


@dataclass(frozen=True)
class Moment:
    """The particles at one time.

    Attributes
    ----------
    time : float
        [time].
    z, velocity, expected : ndarray, shape (N,)
        Distance from the lower plate [length], velocity along the plates and that of the closed
        form [length/time].
    density_error : float
        Largest relative deviation of a particle's density from that of the fluid.
    """

    time: float
    z: Array
    velocity: Array
    expected: Array
    density_error: float


@dataclass(frozen=True)
class Study:
    """A transient flow beside its closed form; ``print`` shows the table.

    Attributes
    ----------
    kind : str
        "poiseuille" or "couette".
    scene : Scene
    moments : tuple of Moment
    seconds : float
        Time of the run on the clock.
    """

    kind: str
    scene: Scene
    moments: tuple[Moment, ...]
    seconds: float

    @property
    def largest_velocity(self) -> float:
        """Of the steady flow [length/time]."""
        return float(_closed_form(self.kind, self.scene, 0.5 if self.kind == KINDS[0] else 1.0))

    def errors(self, moment: Moment) -> tuple[float, float]:
        """rms and largest error of the particles' velocities over the steady maximum."""
        error = (moment.velocity - moment.expected) / self.largest_velocity
        return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())

    @property
    def passed(self) -> bool:
        """Whether rms errors are below 1 % at all times."""
        return all(self.errors(moment)[0] < LIMIT for moment in self.moments)

    def __str__(self) -> str:
        si = self.scene.fluid.is_si
        head = (
            f"{self.kind.capitalize()} flow from rest: {self.scene.n_particles} particles, no "
            f"noise; steady maximum {quantity(self.largest_velocity, 'm/s', si=si)}, "
            f"{self.seconds:.0f} s\nerrors of all particles against the closed form, over the "
            "steady maximum"
        )
        rows = []
        for moment in self.moments:
            rms, largest = self.errors(moment)
            time = quantity(moment.time, "s", si=si)
            density = f"{moment.density_error:.1e}"
            rows.append([time, f"{rms:.3%}", f"{largest:.3%}", density])
        shown = table(rows, ["time", "rms error", "largest error", "density error"])
        verdict = f"rms errors {'are' if self.passed else 'are NOT all'} below {LIMIT:.0%}"
        return f"{head}\n\n{shown}\n\n{verdict}"


def _closed_form(kind: str, scene: Scene, share: Any, time: float = math.inf) -> Array:
    """Velocity at a share of the width."""
    width, nu = scene.box.lengths[-1], scene.fluid.kinematic_viscosity
    if kind == "poiseuille":
        assert isinstance(scene.body_force, UniformForce)
        f = scene.body_force.acceleration[0]
        return poiseuille_velocity(
            share * width, time, acceleration=f, kinematic_viscosity=nu, width=width
        )
    speed = scene.walls[1].speed
    return couette_velocity(
        share * width, time, wall_velocity=speed, kinematic_viscosity=nu, width=width
    )


def run_channel(
    kind: str = "poiseuille",
    *,
    times: Sequence[float] = TIMES,
    quick: bool = False,
    threads: int | None = None,
    progress: bool | None = None,
) -> Study:
    """Run a ready scene of flow between plates and compare it with its closed form.

    Parameters
    ----------
    kind : {"poiseuille", "couette"}
        Driven by a body force, or by the upper plate.
    times : sequence of float
        When to look [s], increasing.
    quick : bool
        20 layers of particles in place of 31: a third of the particles, a tenth of the work.
    threads : int, optional
        As for a `Simulation`.
    progress : bool, optional
        As for `Simulation.run`.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.

    Examples
    --------
    >>> from sdpd import channel
    >>> study = channel.run_channel("couette", times=(0.01,), quick=True, progress=False)
    >>> study.passed
    True
    """
    from sdpd import scenes
    from sdpd.simulation import Simulation

    validation.choice("kind", kind, KINDS)
    moments = validation.vector("times", times)
    if not moments or min(np.diff(moments, prepend=0.0)) <= 0.0:
        raise ValueError(f"`times` must be > 0 and increase, got {times!r}")
    scene = scenes.load(kind)
    if validation.boolean("quick", quick):
        share = scene.box.lengths[1] / scene.box.lengths[2]
        layers = (_QUICK, round(share * _QUICK), _QUICK)
        scene = scene.replace(resolution=Resolution(particles=layers))
    begun = perf_counter()
    sim = Simulation(scene, threads=threads)
    found = []
    for time in moments:
        sim.run(time=time - sim.time, progress=progress)
        z, velocity = np.array(sim.positions[:, -1]), np.array(sim.velocities[:, 0])
        expected = _closed_form(kind, scene, z / scene.box.lengths[-1], sim.time)
        density = float(np.abs(sim.densities / scene.fluid.density - 1.0).max())
        found.append(Moment(sim.time, z, velocity, expected, density))
    return Study(kind, scene, tuple(found), perf_counter() - begun)


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write KIND.csv, a row for each particle and time, and KIND.txt, the table.

    The folder is made if need be.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"{study.kind}.{ending}" for ending in ("csv", "txt")]
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time", "z", "velocity", "closed_form"])
        for moment in study.moments:
            columns = (moment.z, moment.velocity, moment.expected)
            order = np.argsort(moment.z, kind="stable")
            rows = np.stack(columns, axis=1)[order].tolist()
            writer.writerows([moment.time, *row] for row in rows)
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths


def plot(study: Study, figure: Any = None) -> Any:
    """Draw profiles beside the closed form, and errors.

    Parameters
    ----------
    study : Study
    figure : matplotlib Figure, optional
        Drawn into; a new one of pyplot if None.

    Returns
    -------
    matplotlib Figure
    """
    figure = figure_or_new(figure, _SIZE)
    left, right = figure.subplots(1, 2)
    width, share = study.scene.box.lengths[-1], np.linspace(0.0, 1.0, 300)
    si = study.scene.fluid.is_si
    colours = itertools.cycle((BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY))
    for moment, colour in zip(study.moments, colours, strict=False):
        dots = {"color": colour, "linestyle": "", "marker": "o", "markersize": 2.0}
        text = quantity(moment.time, "s", si=si)
        left.plot(moment.z, moment.velocity, label=text, **dots)
        curve = _closed_form(study.kind, study.scene, share, moment.time)
        left.plot(share * width, curve, color=colour, linewidth=1.0)
        error = 100.0 * (moment.velocity - moment.expected) / study.largest_velocity
        right.plot(moment.z, error, **dots)
    place = f"z [{'m' if si else 'length'}]"
    speed = f"velocity along the plates [{'m/s' if si else 'length/time'}]"
    left.set(xlabel=place, ylabel=speed, title="lines: closed form")
    right.set(xlabel=place, ylabel="error (% of the steady maximum)")
    left.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(color="0.9", linewidth=0.7)
        axes.set_axisbelow(True)
    return figure


def write_figure(study: Study, folder: str | os.PathLike[str]) -> Path:
    """Write KIND.png, the drawing of `plot`; the folder is made if need be."""
    return save(lambda figure: plot(study, figure), folder, study.kind, size=_SIZE)
