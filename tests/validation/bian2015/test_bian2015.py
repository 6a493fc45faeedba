"""Bian et al. (2015), section III: statistics, space, waves and pressure of his 2D fluid.

The runs are those of docs/scripts/bian2015.py, but fewer. Every verdict is a z-score, beyond the
stated accuracy where theory is approximate; the family of each test fails one time in a hundred.
"""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sdpd.analysis import Estimate, combine
from sdpd.fluctuations import Item, judge
from tests.validation import record

SCRIPTS = Path(__file__).resolve().parents[3] / "docs" / "scripts"
CASE = "bian2015"
NUMBERS: dict[str, Any] = {}  # what the tests measured, written by the last one
FLUIDS = {"1200": (1200.0, 1.0, 8), "600": (600.0, 1.0, 8), "300": (300.0, 1.0, 8)}
FLUIDS["300, nu = 12.43"] = (300.0, 0.25, 5)
SPEEDS = (300.0, 600.0, 1200.0, 2400.0)


@pytest.fixture(scope="module")
def script() -> Any:
    sys.path.insert(0, str(SCRIPTS))
    try:
        yield importlib.import_module("bian2015")
    finally:
        sys.path.remove(str(SCRIPTS))
        for name in ("bian2015", "bian2015_runs", "report"):
            sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def middle(script: Any) -> Any:
    """c_T = 600 at his time step."""
    length = script.Length(runs=4, frames=30, gap=40, settle=1500)
    return script.configurations(script.scene_of(600.0), length, seed=11, dt=script.TIME_STEP)


@pytest.fixture(scope="module")
def space(script: Any, middle: Any) -> Any:
    return script.Space(middle)


@pytest.fixture(scope="module")
def sweep(script: Any) -> Any:
    """c_T from 300 to 2400 at two resolutions."""
    found = {}
    for spacing, runs in ((0.05, 2), (0.025, 1)):
        length = script.Length(runs=runs, frames=16, gap=30, settle=700)
        for speed in SPEEDS:
            scene = script.scene_of(speed, spacing=spacing)
            found[3.0 * spacing, speed] = script.configurations(scene, length, seed=12)
    return found


@pytest.fixture(scope="module", params=list(FLUIDS))
def waves(script: Any, request: pytest.FixtureRequest) -> Any:
    speed, share, runs = FLUIDS[request.param]
    eta = share * script.ETA
    return request.param, script.waves_of(speed, eta=eta, runs=runs, seed=13)


def check(items: list[Item]) -> None:
    """All of a family agree."""
    failed = [
        f"{item.name}: {item.estimate}, expected {item.prediction:.6g} ± {item.accuracy:.2g}, "
        f"z = {item.z:.1f}"
        for item, agreed in zip(items, judge(tuple(items)), strict=True)
        if not agreed
    ]
    assert not failed, "\n".join(failed)


def keep(name: str, estimate: Estimate, expected: float) -> None:
    NUMBERS[name] = estimate.value
    NUMBERS[f"{name}_stderr"] = estimate.stderr
    NUMBERS[f"{name}_expected"] = expected


def test_velocities_are_maxwellian(middle: Any) -> None:
    items = []
    moments = (("skewness", 3, 0.0), ("kurtosis", 4, 3.0))
    members = [("temperature", middle.temperature, 1.0)]
    members += [
        (f"velocity_{n}", middle.standardised_moment("velocity", k), x) for n, k, x in moments
    ]
    for name, estimate, expected in members:
        assert estimate.stderr < 0.02, "too few samples to see a fault"
        items.append(Item(group="v", name=name, estimate=estimate, prediction=expected, unit=1.0))
        keep(name, estimate, expected)
    check(items)


def test_density_of_particles(middle: Any) -> None:
    """Mean 1.001 and variance 2.4e-4 as he finds; RPA: 1.0012 and 2.41e-4 at this step."""
    theory = middle.prediction
    mean, variance = middle.mean_density, middle.variance
    assert mean.stderr < 5e-5 and variance.relative < 0.015
    check(
        [
            Item(
                group="rho",
                name="mean",
                estimate=mean,
                prediction=1.0 + theory.bias,
                accuracy=theory.accuracy("mean"),
            ),
            Item(
                group="rho",
                name="variance",
                estimate=variance,
                prediction=middle.expected_variance,
                accuracy=0.02 * middle.expected_variance,
            ),
        ]
    )
    assert round(mean.value, 3) == 1.001
    assert round(1e4 * variance.value, 1) == 2.4
    skewness = middle.standardised_moment("density", 3)
    assert skewness.stderr < 0.03 and abs(skewness.value) < 0.05
    keep("mean_density", mean, 1.0 + theory.bias)
    keep("density_variance", variance, middle.expected_variance)
    keep("density_skewness", skewness, 0.0)


def test_variance_falls_as_the_square_of_the_speed(sweep: Any) -> None:
    """Each against RPA; over 1/X it is 0.21 to 0.22, not 1 as B 13 has for a cell."""
    items = []
    for (reach, speed), found in sweep.items():
        ratio = found.variance.scaled(1.0 / found.expected_variance)
        assert ratio.stderr < 0.03
        name = f"variance, r_c = {reach:g}, c_T = {speed:g}"
        items.append(
            Item(
                group="variance",
                name=name,
                estimate=ratio,
                prediction=1.0,
                accuracy=0.03,
            )
        )
        keep(name, ratio, 1.0)
        share = found.variance.value * found.scene.stiffness
        assert 0.19 < share < 0.25
    check(items)


def test_velocities_are_white_in_space(space: Any) -> None:
    """Exactly -1/N at every distance; with the density, 0."""
    number = space.found.density.shape[1]
    items = []
    for profile, expected in ((space.velocity, -1.0 / number), (space.cross, 0.0)):
        seen = np.flatnonzero(profile.counts > 20_000)
        assert seen.size >= 20
        for index in seen:
            estimate = profile.at(int(index))
            items.append(
                Item(
                    group="v",
                    name=f"{expected:.1g} at {profile.centers[index] / space.reach:.3f} r_c",
                    estimate=estimate,
                    prediction=expected,
                    unit=1.0,
                )
            )
    assert np.median([item.estimate.stderr for item in items]) < 0.003
    check(items)


def test_density_is_correlated_over_the_support(space: Any) -> None:
    """The RPA coefficient within 0.02; 0.01 is left at r_c, and the semivariogram follows."""
    value, error = space.coefficient()
    items = []
    for index, centre in enumerate(space.density.centers / space.reach):
        if centre < 0.3:  # few pairs come so close, where both densities are high
            continue
        estimate = Estimate(float(value[index]), float(error[index]), float(space.density.n_blocks))
        assert estimate.stderr < 0.015
        items.append(
            Item(
                group="rho",
                name=f"C at {centre:.3f} r_c",
                estimate=estimate,
                prediction=float(space.expected[index]),
                accuracy=0.02,
                unit=1.0,
            )
        )
        if centre in (0.325, 0.525, 0.975):
            keep(f"density correlation at {centre} r_c", estimate, items[-1].prediction)
    check(items)
    assert items[0].estimate.value > 0.4 and abs(items[-1].estimate.value) < 0.02
    sill, reach = space.model.sill, space.model.range
    assert round(1e4 * sill.value, 1) == 2.4
    assert reach.stderr < 0.005 and round(reach.value, 2) == 0.13  # his two digits
    keep("range of the spherical model", reach, 0.13)


def test_effective_pressure_is_the_model(script: Any, sweep: Any) -> None:
    """Virial pressure: c^2 rho to 1.5 %, and below it by what density waves take, in RPA."""
    items = []
    for (reach, speed), found in sweep.items():
        scene, pressure = found.scene, found.pressure
        ideal = scene.thermal_energy * scene.n_particles / scene.box.volume
        model = scene.fluid.density * scene.sound.speed**2
        assert abs(pressure.value / model - 1.0) < 0.02
        shift = replace(pressure, value=pressure.value - model).scaled(1.0 / ideal)
        expected = (script.rpa_pressure(scene) - model) / ideal
        name = f"pressure shift, r_c = {reach:g}, c_T = {speed:g}"
        keep(name, shift, expected)
        if scene.stiffness < 5000.0:  # far below the pairing limit, 2.3e4, of RPA
            assert shift.stderr < 0.15
            items.append(
                Item(group="P", name=name, estimate=shift, prediction=expected, accuracy=0.5)
            )
    assert len(items) == 7
    check(items)


def test_waves_follow_linearised_theory(waves: Any) -> None:
    name, study = waves
    assert study.passed, str(study)
    for shell, number in zip(study.shells, study.waves, strict=True):
        fit, theory = shell.fit, shell.prediction
        assert fit.sound_speed.relative < 0.04 and fit.damping.relative < 0.10
        label = f"c_T = {name}, n_w = {number}"
        keep(f"nu, {label}", fit.viscosity, theory.viscosity)
        keep(f"c, {label}", fit.sound_speed, theory.sound_speed)
        keep(f"Gamma, {label}", fit.damping, theory.damping)


def test_damping_is_that_of_two_dimensions(waves: Any) -> None:
    """3 nu/4, not 2 nu/3 (B 21): pooled over the wave numbers, and more than 4 errors away."""
    _, study = waves
    ratios = [s.fit.damping.scaled(1.0 / s.prediction.damping) for s in study.shells]
    pooled = combine(ratios, weights="inverse_variance")
    assert pooled.stderr < 0.025
    assert pooled.z(8.0 / 9.0) > 4.0


def test_published_forms_fail_where_the_wave_is_damped(script: Any, waves: Any) -> None:
    """B 21b leaves out terms of order Gamma k/c: its distance grows with that, ours does not."""
    name, study = waves
    for index, shell in enumerate(study.shells):
        ours, error = script.misfit(study, index, "longitudinal", None)
        his, _ = script.misfit(study, index, "longitudinal", 2.0 / 3.0)
        ratio = shell.prediction.sound_rate / shell.prediction.frequency
        NUMBERS[f"off theory, c_T = {name}, n_w = {study.waves[index]}"] = [ours, his, error]
        if ratio > 0.3:
            assert his > 0.15 and his > 2.5 * ours


def test_the_record_is_written() -> None:
    assert len(NUMBERS) > 60
    record.store(CASE, NUMBERS)
    assert set(record.load()[CASE]["numbers"]) == set(NUMBERS)
