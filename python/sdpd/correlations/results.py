"""Each wave number: functions, fits, and every quantity beside its prediction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdpd.analysis import Correlation, Estimate, ensemble
from sdpd.analysis.blocked import BlockedFunction
from sdpd.correlations.predictions import WavePrediction
from sdpd.correlations.recorder import FUNCTIONS
from sdpd.fluctuations.results import Item
from sdpd.scene import Scene

__all__ = ["Shell", "Wave", "assemble_shell", "compare"]

Array = NDArray[np.float64]

FIT_DECAYS = 1.5  # of the slowest factor of a function: where its fit ends
TURNS = 2.5  # periods after which a fit of a wave ends, whatever its decay


@dataclass(frozen=True)
class Wave:
    """Linearised hydrodynamics fitted to one wave number.

    Attributes
    ----------
    viscosity, damping : Estimate
        nu(k) and Gamma(k) [length^2/time].
    sound_speed : Estimate
        c(k) [length/time].
    """

    viscosity: Estimate
    damping: Estimate
    sound_speed: Estimate


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
    prediction : WavePrediction
    fit : Wave
    """

    wave_number: float
    vectors: NDArray[np.int64]
    functions: dict[str, Correlation]
    friction: tuple[Estimate, Estimate]
    prediction: WavePrediction
    fit: Wave

    def normalized(self, name: str) -> tuple[Array, Array, Array]:
        """Lags [time], a function over its value at zero (the root of both), and its error."""
        joined, lag = _joined(self.functions), self.functions[name].lag
        index = FUNCTIONS.index(name)

        def values(mean: Array) -> Array:
            return np.asarray(_normalize(mean.reshape(len(FUNCTIONS), -1))[index])

        leave = np.array([values(row) for row in joined.leave_one_out()])
        count = joined.n_blocks
        spread = np.sum((leave - leave.mean(axis=0)) ** 2, axis=0)
        return lag, values(joined.mean), np.sqrt((count - 1) / count * spread)


def assemble_shell(
    scene: Scene,
    vectors: NDArray[np.int64],
    members: Sequence[dict[str, Correlation]],
    rates: Array,
    prediction: WavePrediction,
) -> Shell:
    """Join the runs of one wave number and fit them.

    Parameters
    ----------
    scene : Scene
    vectors : ndarray of int, shape (K, D)
    members : sequence of dict
        The five functions of each run.
    rates : ndarray, shape (runs, 2)
        Friction in place, across and along, of each run [1/time].
    prediction : WavePrediction
    """
    functions = {name: Correlation.merge([m[name] for m in members]) for name in FUNCTIONS}
    square = prediction.wave_number**2
    friction = (_mean(rates[:, 0] / square), _mean(0.5 * rates[:, 1] / square))
    return Shell(
        wave_number=prediction.wave_number,
        vectors=vectors,
        functions=functions,
        friction=friction,
        prediction=prediction,
        fit=_fit(functions, prediction),
    )


def compare(scene: Scene, shells: Sequence[Shell]) -> tuple[Item, ...]:
    """All quantities beside their predictions."""
    edge = scene.box.lengths[0] / (2.0 * np.pi)
    return tuple(item for shell in shells for item in _items(scene, shell, edge))


def _mean(values: Array) -> Estimate:
    return ensemble(values) if values.size > 1 else Estimate(float(values[0]), 0.0, 1.0)


def _items(scene: Scene, shell: Shell, edge: float) -> Iterator[Item]:
    theory, functions, fit = shell.prediction, shell.functions, shell.fit
    thermal = scene.thermal_speed**2
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
    joined = _joined(functions)
    lags = functions["cross"].lag
    turn = int(np.argmin(np.abs(lags - theory.probe_times("cross")[1])))
    yield item(
        "<rho* j(t)> less <j* rho(t)>",
        joined.derive(lambda mean: _difference(mean, turn)),
        0.0,
        unit=1.0,
    )
    for name, found, expected, accuracy in (
        ("nu(k)", fit.viscosity, theory.viscosity, theory.viscosity_accuracy),
        ("c(k)", fit.sound_speed, theory.sound_speed, theory.sound_accuracy),
        ("Gamma(k)", fit.damping, theory.damping, theory.viscosity_accuracy),
    ):
        yield item(
            f"{name} over its prediction", found.scaled(1.0 / expected), 1.0, accuracy=accuracy
        )
    for name in FUNCTIONS[:4]:
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


def _scaled(name: str, theory: WavePrediction, lag: float) -> str:
    if name == "transverse":
        return f"nu k^2 t = {theory.shear_rate * lag:.2f}"
    return f"c k t = {theory.frequency * lag:.2f}"


def _joined(functions: dict[str, Correlation]) -> BlockedFunction:
    """All functions side by side, so that what needs several has one jackknife."""
    members = [functions[name] for name in FUNCTIONS]
    return BlockedFunction(
        blocks=np.concatenate([member.blocks for member in members], axis=1),
        block_counts=np.concatenate([member.block_counts for member in members], axis=1),
        window=members[0].window,
    )


def _normalize(table: Array) -> Array:
    """Over the value at zero lag; the crossed ones over the root of both."""
    shear, sound, density = table[:3, 0]
    root = np.sqrt(sound * density)
    return np.asarray(table / np.array([shear, sound, density, root, root])[:, None])


def _difference(mean: Array, turn: int) -> float:
    table = _normalize(mean.reshape(len(FUNCTIONS), -1))
    return float(table[3, turn] - table[4, turn])


def _fit(functions: dict[str, Correlation], theory: WavePrediction) -> Wave:
    joined, lag = _joined(functions), functions["density"].lag
    shear_end = FIT_DECAYS / theory.shear_rate
    sound_end = min(
        FIT_DECAYS / min(theory.sound_rate, theory.frequency**2 / theory.sound_rate),
        TURNS * 2.0 * np.pi / theory.frequency,
    )
    shear, sound = (
        np.flatnonzero(lag <= max(end, lag[min(4, lag.size - 1)])) for end in (shear_end, sound_end)
    )
    k = theory.wave_number

    def table(mean: Array) -> Array:
        return _normalize(mean.reshape(len(FUNCTIONS), -1))

    def viscosity(mean: Array) -> float:
        return _decay_rate(lag[shear], table(mean)[0, shear], theory.shear_rate) / k**2

    def wave(mean: Array) -> Array:
        return _wave(lag[sound], table(mean)[1:, sound], (theory.frequency, theory.sound_rate))

    window = (0.0, float(lag[sound[-1]]))
    return Wave(
        joined.derive(viscosity, window=(0.0, float(lag[shear[-1]]))),
        joined.derive(lambda mean: float(wave(mean)[1]) / k**2, window=window),
        joined.derive(lambda mean: float(wave(mean)[0]) / k, window=window),
    )


def _decay_rate(time: Array, value: Array, guess: float) -> float:
    """Least squares of exp(-rate t), each lag with the length of time it stands for."""
    from scipy import optimize

    weight = np.sqrt(_spans(time))

    def residual(p: Array) -> Array:
        return np.asarray(weight * (np.exp(-np.exp(p[0]) * guess * time) - value))

    return guess * float(np.exp(optimize.least_squares(residual, [0.0]).x[0]))


def _wave(time: Array, values: Array, guess: tuple[float, float]) -> Array:
    """Frequency w_k and damping rate from longitudinal, density and crossed functions at once."""
    from scipy import optimize

    from sdpd.theory.hydrodynamics import damped_wave

    weight = np.sqrt(_spans(time))
    start = np.array(guess)

    def residual(p: Array) -> Array:
        frequency, damping = start * np.exp(p)
        even, odd, _ = damped_wave(time, float(frequency), float(damping))
        rows = (even - damping * odd, even + damping * odd, frequency * odd, frequency * odd)
        return np.asarray((weight * (np.array(rows) - values)).ravel())

    return np.asarray(start * np.exp(optimize.least_squares(residual, [0.0, 0.0]).x))


def _spans(time: Array) -> Array:
    """Share of the time axis that each lag stands for."""
    return np.asarray(np.gradient(time) / (time[-1] - time[0]))
