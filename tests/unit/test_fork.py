"""A forked child has none of the threads of its parent's simulations: it is told so, and may make
its own."""

from __future__ import annotations

import multiprocessing
import sys
from typing import Any

import pytest

import sdpd


def scene() -> sdpd.Scene:
    return sdpd.Scene(
        fluid=sdpd.fluids.water(),
        box=sdpd.Box((1e-7,) * 3),
        resolution=sdpd.Resolution(particles=216, support=2.2, kernel="lucy"),
        start=sdpd.RandomStart(),
    )


def child(answers: Any, inherited: sdpd.Simulation) -> None:
    try:
        inherited.run(steps=1)
    except RuntimeError as error:
        answers.put(str(error))
    own = sdpd.Simulation(scene(), threads=2)
    own.run(steps=2)
    answers.put(own.step)


@pytest.mark.skipif(sys.platform == "win32", reason="no fork there")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_simulation_does_not_cross_a_fork() -> None:
    sim = sdpd.Simulation(scene(), threads=2)
    sim.run(steps=2)
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    process = context.Process(target=child, args=(answers, sim))
    process.start()
    try:
        assert "forked" in answers.get(timeout=30)
        assert answers.get(timeout=30) == 2
    finally:
        process.join(10)
        process.kill()
    sim.run(steps=1)
    assert sim.step == 3


def test_a_correlator_that_does_not_fit_is_refused_before_the_run() -> None:
    sim = sdpd.Simulation(scene())
    with pytest.raises(MemoryError, match="does not fit in memory"):
        sim.run(steps=1, observe=sdpd.Correlator(points=2**40, levels=1))
    sim.run(steps=1)
    assert sim.step == 1
