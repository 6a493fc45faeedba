r"""Thermodynamic fluctuations of a cell in a large reservoir or in a closed box.

Landau and Lifshitz, *Statistical Physics, Part 1*, 3rd ed., 1980, secs. 112 and 114. The pressure
fluctuates with the *adiabatic* compressibility, the density with the isothermal one. Cells must be
large against the correlation length (for particles: against h); below that use
:class:`~sdpd.theory.DensityTheory`.
"""

from __future__ import annotations

from dataclasses import dataclass

from sdpd import validation

__all__ = ["CellVariances", "cell_variances"]


@dataclass(frozen=True)
class CellVariances:
    """Variances of the state of a cell.

    Attributes
    ----------
    density : float
        Mass density, rho kB T/(c_T^2 V) [(mass/length^D)^2].
    velocity : float
        One component of the velocity of the cell's mass, kB T/(rho V) [(length/time)^2].
    pressure_adiabatic : float
        rho c_S^2 kB T/V with c_S^2 = gamma c_T^2 [pressure^2].
    pressure_isothermal : float
        rho c_T^2 kB T/V, that of a fluid whose temperature is held everywhere [pressure^2].
    temperature : float or None
        kB T^2/(rho c_v V) [temperature^2]; None without a heat capacity.
    entropy : float or None
        Of the entropy per mass, kB c_P/(rho V) with c_P = gamma c_v
        [(energy/(mass temperature))^2]; None without a heat capacity.
    """

    density: float
    velocity: float
    pressure_adiabatic: float
    pressure_isothermal: float
    temperature: float | None
    entropy: float | None = None


def cell_variances(
    *,
    density: float,
    thermal_energy: float,
    sound_speed: float,
    volume: float,
    box_volume: float | None = None,
    heat_ratio: float = 1.0,
    temperature: float | None = None,
    specific_heat: float | None = None,
) -> CellVariances:
    """Landau-Lifshitz variances of a cell.

    Parameters
    ----------
    density : float
        Mean mass density rho [mass/length^D], > 0.
    thermal_energy : float
        kB T [energy], >= 0.
    sound_speed : float
        Isothermal sound speed c_T, total (with kB T/m) [length/time], > 0.
    volume : float
        Volume V of the cell [length^D], > 0.
    box_volume : float, optional
        Volume of the closed box the cell is part of [length^D]. What the box conserves (mass,
        momentum, and for the temperature energy) then fluctuates by a factor 1 - V/V_box less:
        the whole box has none. Without it the reservoir is infinite.
    heat_ratio : float
        gamma = c_P/c_v >= 1; 1 for an isothermal fluid.
    temperature, specific_heat : float, optional
        T [temperature] and c_v [energy/(mass temperature)] for the temperature's variance.

    Returns
    -------
    CellVariances

    Raises
    ------
    ValueError
        If a parameter is out of range or only one of `temperature`, `specific_heat` is given.

    Notes
    -----
    The factor 1 - V/V_box is exact for independent wave vectors (S and <|j_k|^2> flat in k) and
    holds to leading order otherwise. The pressure follows the conserved fields and gets it too.
    """
    rho = validation.positive("density", density)
    energy = validation.non_negative("thermal_energy", thermal_energy)
    speed = validation.positive("sound_speed", sound_speed)
    cell = validation.positive("volume", volume)
    gamma = validation.finite("heat_ratio", heat_ratio)
    if gamma < 1.0:
        raise ValueError(f"`heat_ratio` must be >= 1, got {gamma:g}")
    share = 1.0
    if box_volume is not None:
        box = validation.positive("box_volume", box_volume)
        if cell > box * (1.0 + 1e-12):
            raise ValueError(f"`volume` must be <= `box_volume` = {box:g}, got {cell:g}")
        share = max(0.0, 1.0 - cell / box)
    if (temperature is None) != (specific_heat is None):
        raise ValueError("`temperature` and `specific_heat` must be given together")
    warm = disorder = None
    if temperature is not None and specific_heat is not None:
        kelvin = validation.positive("temperature", temperature)
        heat = validation.positive("specific_heat", specific_heat)
        warm = share * energy * kelvin / (rho * heat * cell)
        disorder = share * energy / kelvin * gamma * heat / (rho * cell)
    isothermal = share * rho * speed**2 * energy / cell
    return CellVariances(
        share * rho * energy / (speed**2 * cell),
        share * energy / (rho * cell),
        gamma * isothermal,
        isothermal,
        warm,
        disorder,
    )
