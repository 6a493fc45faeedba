"""Conductivity that a fluid delivers: at equilibrium, between plates and on the lattice."""

from __future__ import annotations

from collections.abc import Sequence

from report import Report, grid, shown, subplots

import sdpd
from sdpd import conductivity

# dimension, equation of state, C/k_B, kappa/C, eta, and exponent of kappa and eta in T
CASES = {
    "liquid, conduction rules": (3, "liquid", 50.0, 10.0, 20.0, 0.0),
    "liquid, friction matters": (3, "liquid", 50.0, 1.0, 20.0, 0.0),
    "liquid, thin": (3, "liquid", 50.0, 1.0, 2.0, 0.0),
    "gas": (3, "gas", 25.0, 4.0, 20.0, 0.0),
    "gas, as T^0.7": (3, "gas", 25.0, 4.0, 20.0, 0.7),
    "liquid in two dimensions": (2, "liquid", 50.0, 1.0, 20.0, 0.0),
}
EDGE = {2: 16.0, 3: 8.0}
# How long, over the default: where motion carries much, the flux is noisy.
LENGTH = {
    "liquid, conduction rules": 1.0,
    "liquid, friction matters": 0.5,
    "liquid, thin": 1.5,
    "gas": 0.6,
    "gas, as T^0.7": 0.6,
    "liquid in two dimensions": 0.4,
}


def scene(
    dimension: int,
    kind: str,
    capacity: float,
    diffusivity: float,
    viscosity: float,
    exponent: float,
) -> sdpd.Scene:
    """m = dx = k_B = T_0 = 1, X = 100; kappa = C times the diffusivity, at T_0."""
    law = sdpd.eos.IdealGas() if kind == "gas" else sdpd.eos.Linear(background_pressure=100.0)
    fluid = sdpd.Fluid(
        density=1.0,
        shear_viscosity=viscosity,
        temperature=1.0,
        boltzmann_constant=1.0,
        heat_capacity=capacity,
        thermal_conductivity=diffusivity * capacity,
        viscosity_exponent=exponent,
        conductivity_exponent=exponent,
        equation_of_state=law,
        dimension=dimension,
    )
    return sdpd.Scene(
        fluid=fluid,
        box=sdpd.Box((EDGE[dimension],) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, support=2.64, kernel="lucy"),
        start=sdpd.RandomStart(),
        sound_speed=10.0,
        effects=sdpd.Effects(energy=True),
    )


def study(name: str, share: float = 1.0) -> conductivity.Study:
    """All ways for one case."""
    return conductivity.run_conductivity(
        scene(*CASES[name]), seed=1, time_factor=share * LENGTH[name], threads=1, progress=False
    )


def row(name: str, found: conductivity.Study) -> list[str]:
    """One line of the table, over the conductivity asked for."""
    asked, prediction, rest = found.asked, found.prediction, found.equilibrium

    def over(estimate: sdpd.analysis.Estimate) -> str:
        return shown(estimate.value / asked, estimate.stderr / asked)

    return [
        name,
        f"{rest.dt / rest.sample.conduction_time:.2f}",
        f"{found.decay.delivered / asked:.3f}",
        f"{prediction.friction / asked:.3f}",
        f"{prediction.convection / asked:.3f}",
        over(rest.shares["conduction"]),
        over(rest.shares["friction"]),
        over(rest.shares["convection"]),
        over(rest.helfand),
        over(found.gradient),
        f"{found.comparisons[0].z:+.1f}",
    ]


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("conductivity", __doc__, argv)
    names = [*CASES][-1:] if report.quick else [*CASES]
    studies = {name: study(name, 0.01 if report.quick else 1.0) for name in names}
    header = [
        "fluid",
        r"$\Delta t/\tau_q$",
        "lattice decay",
        "friction, mean field",
        "convection, mean field",
        "conduction",
        "friction",
        "convection",
        "**Helfand moment**",
        "**imposed gradient**",
        "z",
    ]
    report.document(
        grid(header, [row(name, found) for name, found in studies.items()]),
        "Everything over the conductivity asked for; errors are standard errors. Parts alone leave "
        "out their correlations with each other.",
    )
    subplots()  # sets the style
    from matplotlib import pyplot as plt

    plt.close("all")
    figure = plt.figure(figsize=(10.0, 4.2), layout="constrained")
    conductivity.plot(studies[names[0] if report.quick else "liquid, friction matters"], figure)
    report.figure(figure)


if __name__ == "__main__":
    main()
