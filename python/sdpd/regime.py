"""Which effects matter in a scene: its dimensionless numbers, each with what it means here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sdpd import timestep
from sdpd.decisions import Decision, decide
from sdpd.integrators import Integrator, of_scene
from sdpd.units import table

if TYPE_CHECKING:
    from sdpd.scene import Scene

__all__ = ["Regime", "RegimeRow", "regime"]

_WHO = {"regime": "regime", "set": "you", "derived": "derived", "absent": "-"}
_NO_FLOW = "no flow scale given: set velocity_scale"


@dataclass(frozen=True)
class RegimeRow:
    """One dimensionless number of a scene.

    Attributes
    ----------
    name, symbol : str
    value : float or None
        None where the scene does not say enough.
    unit : str
        "1" for all but the few dimensional ones.
    meaning : str
        What the value means for this scene.
    """

    name: str
    symbol: str
    value: float | None
    unit: str
    meaning: str


@dataclass(frozen=True)
class Regime:
    """The dimensionless numbers of a scene: printable, and a mapping from symbol to value.

    Attributes
    ----------
    rows : tuple of RegimeRow
    decisions : tuple of Decision
        Of each effect whether the numbers call for it, whether it acts, and why.

    Examples
    --------
    >>> import sdpd
    >>> regime = sdpd.Scene(
    ...     fluid=sdpd.fluids.water(),
    ...     box=sdpd.Box((1e-8, 1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=3375),
    ... ).regime()
    >>> round(regime["c/v_th"], 6)
    10.0
    >>> regime["Re"] is None
    True
    """

    rows: tuple[RegimeRow, ...]
    decisions: tuple[Decision, ...] = ()

    def decision(self, effect: str) -> Decision:
        """What is said on an effect, e.g. "energy".

        Raises
        ------
        KeyError
            If there is no such effect.
        """
        for each in self.decisions:
            if each.effect == effect:
                return each
        known = ", ".join(each.effect for each in self.decisions)
        raise KeyError(f"{effect!r}; there are {known}")

    def row(self, symbol: str) -> RegimeRow:
        """The row of a symbol.

        Raises
        ------
        KeyError
            If there is none.
        """
        for row in self.rows:
            if row.symbol == symbol:
                return row
        raise KeyError(f"{symbol!r}; there are {', '.join(row.symbol for row in self.rows)}")

    def __getitem__(self, symbol: str) -> float | None:
        return self.row(symbol).value

    def __contains__(self, symbol: object) -> bool:
        return any(row.symbol == symbol for row in self.rows)

    def __iter__(self) -> Iterator[str]:
        return (row.symbol for row in self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def keys(self) -> list[str]:
        """The symbols."""
        return [row.symbol for row in self.rows]

    def to_dict(self) -> dict[str, float | None]:
        """Symbol -> value."""
        return {row.symbol: row.value for row in self.rows}

    def __str__(self) -> str:
        shown = [
            [row.name, row.symbol, "-" if row.value is None else f"{row.value:.4g}", row.meaning]
            for row in self.rows
        ]
        effects = [
            [
                each.effect.replace("_", " "),
                "on" if each.active else "off",
                _WHO[each.origin],
                each.reason,
            ]
            for each in self.decisions
        ]
        numbers = table(shown, header=["number", "symbol", "value", "here"])
        if not effects:
            return numbers
        return f"{numbers}\n\n{table(effects, header=['effect', 'is', 'by', 'why'])}"


def _graded(value: float, *grades: tuple[float, str], beyond: str) -> str:
    """The text of the first grade whose limit the value does not exceed."""
    return next((text for limit, text in grades if value <= limit), beyond)


def _flow_row(
    name: str,
    symbol: str,
    speed: float | None,
    value: Callable[[float], float],
    meaning: Callable[[float], str],
) -> RegimeRow:
    if speed is None:
        return RegimeRow(name, symbol, None, "1", _NO_FLOW)
    number = value(speed)
    return RegimeRow(name, symbol, number, "1", meaning(number))


def _flow_rows(scene: Scene) -> list[RegimeRow]:
    speed, length, fluid = scene.flow_speed, scene.flow_length, scene.fluid
    nu, diffusion = fluid.kinematic_viscosity, scene.self_diffusion
    rows = [
        _flow_row(
            "Reynolds",
            "Re",
            speed,
            lambda v: v * length / nu if nu > 0.0 else math.inf,
            lambda re: _graded(
                re,
                (0.1, "creeping flow, inertia is negligible"),
                (100.0, "laminar, inertia matters"),
                beyond="inertia rules; the spacing must resolve thin layers",
            ),
        ),
        _flow_row(
            "Mach",
            "Ma",
            speed,
            lambda v: v / scene.sound.speed,
            lambda ma: _graded(
                ma,
                (0.1 * (1 + 1e-9), "density varies by at most 1 % with the flow: incompressible"),
                (0.3, f"density varies by about {ma**2:.0%} with the flow"),
                beyond="the flow is compressible: raise sound_speed unless this is meant",
            ),
        ),
        _flow_row(
            "Peclet",
            "Pe",
            speed,
            lambda v: v * length / diffusion if 0.0 < diffusion < math.inf else math.inf,
            lambda pe: _graded(
                pe,
                (1.0, "particles diffuse over the flow faster than it carries them"),
                beyond="the flow carries particles faster than they diffuse",
            ),
        ),
        _flow_row(
            "thermal to flow speed",
            "v_th/V0",
            speed,
            lambda v: scene.thermal_speed / v if v > 0.0 else math.inf,
            lambda ratio: _graded(
                ratio,
                (0.01, "thermal noise is invisible in the flow: fluctuations could be off"),
                (0.3, "thermal noise is visible; average a little"),
                beyond=f"one particle's velocity is mostly noise: 10 % in the flow takes about "
                f"{100.0 * ratio**2:.2g} samples",
            ),
        ),
    ]
    if fluid.thermal_conductivity is not None:
        conductivity, energy = fluid.thermal_conductivity, scene.active_effects.energy
        rows.append(
            _flow_row(
                "viscous heating",
                "dT/T",
                speed,
                lambda v: fluid.shear_viscosity * v**2 / (8.0 * conductivity * fluid.temperature),
                lambda rise: _graded(
                    rise,
                    (1e-3, "the flow hardly heats itself" if energy else "isothermal is right"),
                    (1e-2, "the flow heats itself a little"),
                    beyond="the flow heats itself"
                    + ("" if energy else ": an isothermal model is wrong"),
                ),
            )
        )
    return rows


def _continuum_rows(scene: Scene) -> list[RegimeRow]:
    fluid, rows = scene.fluid, []
    path, diameter = fluid.mean_free_path, fluid.molecular_diameter
    scale = path if path is not None else diameter
    what = "mean free path" if path is not None else "molecular size"
    if scale is not None:
        knudsen = scale / scene.flow_length
        meaning = _graded(
            knudsen,
            (0.01, "a continuum at the scale of the flow"),
            (0.1, "slip at walls; Navier-Stokes in the bulk"),
            beyond="not a continuum: Navier-Stokes is not meaningful at the scale of the flow",
        )
        rows.append(RegimeRow(f"Knudsen ({what}/L0)", "Kn", knudsen, "1", meaning))
        local = scale / scene.spacing
        meaning = _graded(
            local,
            (0.5, f"particles are larger than the {what}"),
            beyond=f"particles are about as small as the {what} or smaller: their own scale is not "
            "continuum",
        )
        rows.append(RegimeRow(f"{what}/spacing", "Kn_dx", local, "1", meaning))
    if fluid.molecular_mass is not None:
        count = scene.particle_mass / fluid.molecular_mass
        meaning = _graded(
            count,
            (1.0, "a particle is less than a molecule: the numbers are formal"),
            (30.0, "a particle is a few molecules: local equilibrium is formal"),
            beyond="molecules a particle stands for",
        )
        rows.append(RegimeRow("molecules per particle", "m/m_mol", count, "1", meaning))
    return rows


def _noise_rows(scene: Scene) -> list[RegimeRow]:
    x = scene.stiffness
    susceptibility, _ = scene.pairing
    margin = 1.0 / susceptibility if susceptibility > 0.0 else math.inf
    thermal = scene.active_effects.fluctuations or scene.starts_thermal
    if margin == math.inf:
        pairing = "this kernel and equation of state do not pair at any X"
    elif not thermal:
        pairing = "thermal criterion; without noise a stiff fluid stays near a crystal"
    elif margin >= 1.0:
        pairing = f"stable up to X = {x * margin:.3g}"
    else:
        pairing = f"particles clump: beyond X = {x * margin:.3g}"
    deviation = scene.density_deviation
    rows = [
        RegimeRow(
            "stiffness m c^2/kT",
            "X",
            x,
            "1",
            _graded(
                x,
                (25.0, "soft: density fluctuates strongly"),
                (1000.0, "density follows the flow and particles still diffuse"),
                beyond="stiff: particles cage each other and hardly diffuse",
            ),
        ),
        RegimeRow("sound to thermal speed", "c/v_th", math.sqrt(x), "1", scene.sound.reason),
        RegimeRow("pairing margin X_max/X", "X_max/X", margin, "1", pairing),
    ]
    if thermal:
        meaning = "random-phase estimate" if deviation is not None else "the fluid clumps"
        rows.append(RegimeRow("density fluctuation, rms", "sigma_rho", deviation, "1", meaning))
    return rows


def _friction_rows(scene: Scene, integrator: Integrator | str | None) -> list[RegimeRow]:
    if not scene.active_effects.dissipation:
        return []
    eta, sc = scene.reduced_viscosity, scene.schmidt_number
    chosen = of_scene(scene, integrator)
    step = timestep.auto_time_step(scene, chosen)
    ratio = step.value / scene.friction_time
    errors = timestep.expected_errors(scene, step.value, chosen)
    return [
        RegimeRow(
            "Schmidt nu/D",
            "Sc",
            sc,
            "1",
            _graded(
                sc,
                (5.0, "gas-like: particles diffuse as fast as momentum"),
                (100.0, "between a gas and a liquid"),
                beyond="liquid-like: momentum spreads far faster than particles",
            ),
        ),
        RegimeRow(
            "reduced viscosity",
            "eta*",
            eta,
            "1",
            _graded(
                eta,
                (10.0, "the motion of particles adds a viscosity as large as the one asked for"),
                (100.0, f"the motion of particles adds about {2.5 / eta:.0%} to the viscosity"),
                beyond="the viscosity is the one asked for",
            ),
        ),
        RegimeRow(
            "time step/friction time",
            "dt/tau",
            ratio,
            "1",
            _graded(
                ratio,
                (0.5, "dt resolves the velocity autocorrelation"),
                beyond="dt does not resolve the velocity autocorrelation",
            )
            + f"; dt = {step.value:.4g} set by {step.bound.name}; expected: {errors}",
        ),
    ]


def regime(scene: Scene, integrator: Integrator | str | None = None) -> Regime:
    """The dimensionless numbers of a scene; see `Scene.regime`."""
    rows: list[Any] = _flow_rows(scene) + _continuum_rows(scene)
    rows += _noise_rows(scene) + _friction_rows(scene, integrator)
    return Regime(tuple(rows), decide(scene))
