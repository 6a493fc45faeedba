"""Viscosity of the thermal fluid: four ways that must agree, from thin to thick fluids.

Reduced units m = dx = kB T = 1, X = 100, h/dx = 2.65. Without noise a shear wave on the lattice
must decay as the lattice sum says. With noise the transverse currents, the Helfand moment and the
flow under a weak sinusoidal force must give one viscosity, which is not the input's.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy import stats

import sdpd
from sdpd.fluctuations.plan import equilibrium_time_step
from sdpd.viscosity import Study, run_viscosity
from sdpd.viscosity.results import mean_of
from tests.validation import record

EDGE = {2: 16, 3: 8}
# Lags must outlast the relaxation of the stress, whose time goes with the friction.
TIME_FACTOR = {2.0: 0.35, 5.0: 0.35, 20.0: 0.5, 80.0: 2.0}
SHARE = {2: 0.4, 3: 1.0}  # of it
CASES = [
    (dimension, kernel, eta)
    for dimension in (2, 3)
    for kernel in ("lucy", "wendland_c2")
    for eta in TIME_FACTOR
]


@cache
def study_of(dimension: int, kernel: str, eta: float) -> Study:
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=eta,
        temperature=1.0,
        boltzmann_constant=1.0,
        equation_of_state=sdpd.eos.IdealGas(),
    )
    scene = sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((float(EDGE[dimension]),) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel=kernel, support=2.65),
        start=sdpd.RandomStart(),
        sound_speed=10.0,
    )
    return run_viscosity(
        scene,
        dt=min(equilibrium_time_step(scene), 2.2 * scene.friction_time),
        seed=1,
        time_factor=TIME_FACTOR[eta] * SHARE[dimension],
        threads=1,
        progress=False,
    )


def name_of(case: tuple[int, str, float]) -> str:
    dimension, kernel, eta = case
    return f"{dimension}D {kernel} eta*={eta:g}"


@pytest.mark.parametrize("case", CASES, ids=name_of)
def test_methods_agree(case: tuple[int, str, float]) -> None:
    study = study_of(*case)
    assert study.passed, str(study)
    # A method that were off by a tenth would be seen where all cases are judged together, below;
    # alone it must not be so noisy that it says nothing.
    for method in study.methods:
        assert method.viscosity.relative < 0.12, f"{method.name}: too noisy to see a fault"
    # In the thickest fluids pressure forces relax over 4000 tau: a run holds few of those times.
    assert study.viscosity.relative < (0.05 if case[2] > 20.0 else 0.03)


@pytest.mark.parametrize("case", CASES, ids=name_of)
def test_wave_on_the_lattice_decays_as_its_sum_says(case: tuple[int, str, float]) -> None:
    small, step = study_of(*case).lattice
    assert abs(small.factor.value - 1.0) < 1e-3
    assert small.factor.stderr < 1e-4
    assert step.factor.value < 1.0


def test_no_method_is_biased() -> None:
    """Deviations from the mean of the other two, all cases together."""
    for index in range(3):
        pulls, errors = [], []
        for case in CASES:
            methods = study_of(*case).methods
            weight = np.array([m.viscosity.stderr**-2 for m in methods])
            weight[index] = 0.0
            weight /= -weight.sum()
            weight[index] = 1.0
            off = mean_of(methods, weight.tolist())
            slack = max(m.accuracy for m in methods)
            beyond = math.copysign(max(0.0, abs(off.value) - slack), off.value)
            pulls.append(beyond / off.stderr)
            errors.append(off.stderr / methods[index].viscosity.value)
        z = float(np.sum(pulls)) / math.sqrt(len(pulls))
        assert float(np.mean(errors)) / math.sqrt(len(errors)) < 0.015
        assert 2.0 * stats.norm.sf(abs(z)) > 1e-3, f"{methods[index].name}: z = {z:+.1f}"


def test_thin_fluids_are_thicker_than_asked() -> None:
    """Excess over the input in sqrt(m kB T)/dx^(D-1), which mean field foresees in size."""
    for dimension, kernel, eta in CASES:
        study = study_of(dimension, kernel, eta)
        if kernel == "lucy" and eta <= 20.0:
            assert study.thicker.z(0.0) > 5.0
        if eta <= 5.0:  # of first order in the fluctuations, so mostly too low
            measured = study.viscosity.value - study.friction
            expected = study.theory.configurational() + study.theory.kinetic
            noise = 4.0 * study.viscosity.stderr
            assert 0.6 * expected - noise < measured < 2.2 * expected + noise


def test_the_record_is_written() -> None:
    numbers = {}
    for case in CASES:
        study = study_of(*case)
        row = {
            "asked": study.asked,
            "dt_over_tau": study.plan.dt / study.sample.friction_time,
            "lattice": study.on_lattice,
            "lattice_small_step_off_by": study.lattice[0].factor.value - 1.0,
            "lattice_step_factor": study.lattice[1].factor.value,
            "friction": study.friction,
            "kinetic_mean_field": study.theory.kinetic,
            "configurational_mean_field": study.theory.configurational(),
            "thicker": study.thicker.value,
            "thicker_stderr": study.thicker.stderr,
            "delivered": study.viscosity.value,
            "delivered_stderr": study.viscosity.stderr,
        }
        for method in study.methods:
            key = method.name.replace(" ", "_")
            row[key] = method.viscosity.value
            row[f"{key}_stderr"] = method.viscosity.stderr
            row[f"{key}_accuracy"] = method.accuracy
        for each in study.comparisons:
            row[f"z {each.first} - {each.second}"] = each.z
        numbers[name_of(case)] = row
    record.store("viscosity", numbers)
    assert set(record.load()["viscosity"]["numbers"]) == {name_of(case) for case in CASES}
