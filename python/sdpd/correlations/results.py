"""Each wave number: functions, fits, and every quantity beside its prediction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Correlation, Estimate, ensemble
from sdpd.correlations.energy_fits import EnergyWave, fit_energy_wave
from sdpd.correlations.energy_wave import EnergyWavePrediction
from sdpd.correlations.fits import Wave, fit_wave, joined, normalized_table
from sdpd.correlations.wave import WavePrediction
from sdpd.fluctuations.results import Item
from sdpd.scene import Scene

__all__ = ["Shell", "assemble_shell", "compare"]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Shell:
    """One wave number of an ensemble.

    Attributes
    ----------
    wave_number : float
        k [1/length].
    vectors : ndarray of int, shape (K, D)
        The wave vectors averaged.
    functions : dict of str to Correlation
        "transverse", "longitudinal" [length^2/time^2], "density" [1], "cross" Im <rho_k(0)* j_k(t)>
        and "reversed_cross" Im <j_k(0)* rho_k(t)> [length/time], all per particle.
    friction : tuple of Estimate
        nu(k) and Gamma(k) by the friction among the particles where they are, at zero time step
        [length^2/time].
    continuum : WavePrediction
        With the plane-wave rates of the continuum.
    prediction : WavePrediction
        With the friction in place: what fits and functions are compared with.
    fit : Wave
        `EnergyWave` of a fluid with an energy.
    warmth : float
        T of the runs over that of the fluid [1]; 1 without an energy.
    conduction : Estimate or None
        q(k)/k^2 by conduction and friction in place [length^2/time]; None without an energy.
    """

    wave_number: float
    vectors: NDArray[np.int64]
    functions: dict[str, Correlation]
    friction: tuple[Estimate, Estimate]
    continuum: WavePrediction
    prediction: WavePrediction
    fit: Wave
    warmth: float = 1.0
    conduction: Estimate | None = None

    def normalized(self, name: str) -> tuple[Array, Array, Array]:
        """Lags [time], a function over its value at zero (the root of both), and its error."""
        names = list(self.functions)
        whole, index, number = joined(self.functions), names.index(name), len(names)
        leave = np.array([normalized_table(row, number)[index] for row in whole.leave_one_out()])
        count = whole.n_blocks
        spread = np.sum((leave - leave.mean(axis=0)) ** 2, axis=0)
        value = normalized_table(whole.mean, number)[index]
        return self.functions[name].lag, value, np.sqrt((count - 1) / count * spread)


def assemble_shell(
    scene: Scene,
    vectors: NDArray[np.int64],
    members: Sequence[dict[str, Correlation]],
    rates: Array,
    continuum: WavePrediction,
    *,
    warmth: float = 1.0,
) -> Shell:
    """Join the runs of one wave number and fit them.

    Parameters
    ----------
    scene : Scene
    vectors : ndarray of int, shape (K, D)
    members : sequence of dict
        The five functions of each run.
    rates : ndarray, shape (runs, 2 or 3)
        Friction in place, across and along, and what damps the energy, of each run [1/time].
    continuum : WavePrediction
    warmth : float
        T of the runs over that of the fluid [1].
    """
    functions = {name: Correlation.merge([m[name] for m in members]) for name in members[0]}
    square = continuum.wave_number**2
    friction = (_mean(rates[:, 0] / square), _mean(0.5 * rates[:, 1] / square))
    prediction = continuum.with_friction(friction[0].value, friction[1].value)
    speed = scene.thermal_speed * float(np.sqrt(warmth))
    conduction = None
    if isinstance(prediction, EnergyWavePrediction):
        conduction = _mean(rates[:, 2] / square)
        prediction = prediction.with_conduction(conduction.value * square)
        fit: Wave = fit_energy_wave(functions, prediction, speed)
    else:
        fit = fit_wave(functions, prediction, speed)
    return Shell(
        wave_number=continuum.wave_number,
        vectors=vectors,
        functions=functions,
        friction=friction,
        continuum=continuum,
        prediction=prediction,
        fit=fit,
        warmth=warmth,
        conduction=conduction,
    )


def compare(scene: Scene, shells: Sequence[Shell]) -> tuple[Item, ...]:
    """All quantities beside their predictions."""
    edge = scene.box.lengths[0] / (2.0 * np.pi)
    return tuple(item for shell in shells for item in _items(scene, shell, edge))


def _mean(values: Array) -> Estimate:
    return ensemble(values) if values.size > 1 else Estimate(float(values[0]), 0.0, 1.0)


def _items(scene: Scene, shell: Shell, edge: float) -> Iterator[Item]:
    theory, functions, fit = shell.prediction, shell.functions, shell.fit
    thermal = scene.thermal_speed**2 * shell.warmth
    group = (
        f"k = {shell.wave_number * edge:.3g} x 2 pi/L, kh = "
        f"{shell.wave_number * scene.support_radius:.2f}"
        + (", overdamped" if theory.overdamped else "")
    )
    count = scene.n_particles
    share = 1.0 - theory.structure_factor / count  # no net momentum

    def item(name: str, estimate: Estimate, prediction: float, **more: Any) -> Item:
        return Item(group=group, name=name, estimate=estimate, prediction=prediction, **more)

    for name in ("transverse", "longitudinal"):
        power = functions[name].at(0).scaled(1.0 / thermal)
        yield item(f"<|j_k|^2> {name} over m kT N", power, share)
    structure = functions["density"].at(0).scaled(1.0 / theory.structure_factor)
    yield item("S(k)/S_RPA(k)", structure, 1.0, accuracy=theory.structure_accuracy)
    lags = functions["cross"].lag
    turn = int(np.argmin(np.abs(lags - theory.probe_times("cross")[1])))
    yield item(
        "<rho* j(t)> less <j* rho(t)>",
        joined(functions).derive(lambda mean: _difference(mean, turn, len(functions))),
        0.0,
        unit=1.0,
    )
    for symbol, found, expected in (
        ("nu(k)", shell.friction[0], shell.continuum.viscosity),
        ("Gamma(k)", shell.friction[1], shell.continuum.damping),
    ):
        yield item(
            f"{symbol}, in place over continuum",
            found.scaled(theory.delivered / expected),
            1.0,
            accuracy=theory.friction_accuracy,
        )
    for symbol, found, expected, accuracy in (
        ("nu(k)", fit.viscosity, theory.viscosity, theory.viscosity_accuracy),
        ("c(k)", fit.sound_speed, theory.sound_speed, theory.sound_accuracy),
        ("Gamma(k)", fit.damping, theory.damping, theory.viscosity_accuracy),
    ):
        yield item(f"{symbol} over theory", found.scaled(1.0 / expected), 1.0, accuracy=accuracy)
    yield item(
        "c(k)^2 m S(k)/kT, both measured",
        fit.sum_rule,
        theory.sum_rule,
        accuracy=2.0 * theory.sound_accuracy - theory.structure_accuracy,
    )
    names = [name for name in functions if name != "reversed_cross"]
    if isinstance(theory, EnergyWavePrediction) and isinstance(fit, EnergyWave):
        yield from (item(*row[:3], **row[3]) for row in _energy_rows(scene, shell, theory, fit))
    for name in names:
        lag, mean, error = shell.normalized(name)
        blocks = float(functions[name].n_blocks)
        for wanted in theory.probe_times(name):
            at = int(np.argmin(np.abs(lag - wanted)))
            yield item(
                f"{name} at {_scaled(name, theory, float(lag[at]))}",
                Estimate(float(mean[at]), float(error[at]), blocks),
                float(theory.function(name, lag[at])),
                accuracy=float(theory.accuracy(name, lag[at])),
                unit=1.0,
            )


def _energy_rows(
    scene: Scene, shell: Shell, theory: EnergyWavePrediction, fit: EnergyWave
) -> Iterator[tuple[str, Estimate, float, dict[str, Any]]]:
    """Name, estimate, prediction and the rest of what an energy adds."""
    count, square = scene.n_particles, theory.wave_number**2
    capacity = scene.heat_capacity_number + 0.5 * scene.dimension
    unit = (scene.thermal_energy * shell.warmth) ** 2 * capacity
    power = shell.functions["energy"].at(0).scaled(1.0 / unit)
    share = 1.0 - theory.structure_factor / count
    yield "<|e_k|^2> over kB T^2 (C + D kB/2) N", power, share, {"accuracy": 2.0 / count}
    assert shell.conduction is not None
    sound, heat = theory.sound_accuracy, theory.conduction_accuracy
    system = theory.system
    share = (theory.heat_ratio - 1.0) / theory.heat_ratio
    mixed = theory.viscosity_accuracy + share * heat
    for name, found, expected, accuracy in (
        ("c_S(k)", fit.adiabatic_speed, theory.adiabatic_speed, sound),
        ("gamma(k)", fit.heat_ratio, theory.heat_ratio, 2.0 * sound * share),
        ("q(k)", fit.conduction, theory.conduction / square, heat),
        ("decay of the heat mode", fit.heat_rate, system.heat_rate / square, heat + sound * share),
        ("decay of sound", fit.sound_rate, system.sound_rate / square, mixed),
    ):
        yield f"{name} over theory", found.scaled(1.0 / expected), 1.0, {"accuracy": accuracy}


def _scaled(name: str, theory: WavePrediction, lag: float) -> str:
    if name == "transverse":
        return f"nu k^2 t = {theory.shear_rate * lag:.2f}"
    return f"c k t = {theory.frequency * lag:.2f}"


def _difference(mean: Array, turn: int, number: int) -> float:
    table = normalized_table(mean, number)
    return float(table[3, turn] - table[4, turn])
