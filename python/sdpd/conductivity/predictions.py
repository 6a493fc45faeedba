r"""What a fluid of particles conducts, in mean field: asked conduction, friction, convection.

Conduction delivers what was asked times the factor of the lattice. Friction hands over kinetic
energy at the mean velocity of a pair, and so does its noise: pairs are independent, and the sum of
r^2 g is what makes conduction, too, so that (D a + b) k_B/(4 m) comes on top, in three dimensions
without bulk viscosity (5/3) eta k_B/m. Particles that move carry their fluctuations of energy along
for as long as both velocity and temperature last: n C (k_B T/m)/(1/tau + 1/tau_q).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sdpd import validation
from sdpd.scene import Scene

__all__ = ["Prediction", "predict", "warm_pairs"]


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Conductivity of a fluid in mean field [energy/(time temperature length^(D-2))].

    Attributes
    ----------
    conduction : float
        Asked, times the factor of the lattice (over that divided out where it is calibrated), and
        times `warm_pairs` where it follows the temperature.
    friction : float
        (D a + b) k_B/(4 m), times the same factor; short steps.
    convection : float
        n C (k_B T/m)/(1/tau + 1/tau_q), at the time step: an order of magnitude, as correlations of
        particles are left out.
    """

    conduction: float
    friction: float
    convection: float

    @property
    def total(self) -> float:
        """All three."""
        return self.conduction + self.friction + self.convection


def predict(scene: Scene, *, dt: float = 0.0) -> Prediction:
    """Mean-field conductivity of a scene with heat conduction.

    Parameters
    ----------
    scene : Scene
    dt : float
        Time step [time], >= 0: over one, particles keep their velocity, which lengthens what they
        remember.

    Returns
    -------
    Prediction

    Raises
    ------
    TypeError, ValueError
        If the fluid does not conduct, or `dt` is negative.
    """
    from sdpd.conductivity.lattice import check_conduction

    check_conduction(scene)
    kb, mass = scene.fluid.boltzmann_constant, scene.particle_mass
    factor = scene.factors.conductivity
    moving = scene.active_effects
    capacity = scene.heat_capacity_number * kb
    rate = 1.0 / scene.conduction_time
    friction = 0.0
    if moving.dissipation:
        rate += 1.0 / scene.friction_time
        trace = scene.dimension * scene.friction_across + scene.friction_along
        friction = trace * kb / (4.0 * mass) * factor
    density = scene.n_particles / scene.box.volume
    turns = 0.5 * rate * validation.non_negative("dt", dt)
    slower = turns / math.tanh(turns) if turns > 0.0 else 1.0
    warmer = 1.0
    if moving.fluctuations and moving.variable_transport:
        warmer = warm_pairs(scene.fluid.conductivity_exponent, scene.heat_capacity_number)
    return Prediction(
        conduction=scene.conductivity * factor * warmer,
        friction=friction if moving.viscous_heating else 0.0,
        convection=density * capacity * scene.thermal_energy / mass / rate * slower,
    )


def warm_pairs(exponent: float, k: float) -> float:
    r"""Conduction of fluctuating temperatures over that at their mean, kappa going as T^exponent.

    Parameters
    ----------
    exponent : float
        n [1].
    k : float
        C/k_B [1], > 0.

    Returns
    -------
    float
        1 where n = 0; about 1 + n (n + 3)/(4 k) [1].

    Notes
    -----
    The mean over pairs of T_i T_j ((T_i + T_j)/2)^n over T^(n + 2), of independent temperatures
    that are Gamma distributed:

    .. math:: \frac{\Gamma(2k+n+2)}{\Gamma(2k+2)\,(2k)^n}

    Examples
    --------
    >>> from sdpd.conductivity.predictions import warm_pairs
    >>> f"{warm_pairs(0.7, 25.0):.3f}"
    '1.026'
    """
    return math.exp(
        math.lgamma(2.0 * k + exponent + 2.0)
        - math.lgamma(2.0 * k + 2.0)
        - exponent * math.log(2.0 * k)
    )
