"""The virial pressure of moving particles against theory: it is not P(rho).

Density fluctuations lower the pressure of P = c^2 rho and raise that of the artificial
compressibility, by 1 to 2 n kB T at X = 100. The prediction is of the order of the random-phase
approximation, good to 15 % of that share; the conservative virial is summed here from positions by
NumPy, with the minimum image, so that nothing of the stress observers enters.
"""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import sdpd
from sdpd import analysis, kernels, theory

CASES = {
    "3d-lucy-ideal": (3, "lucy", 2.65, 6, sdpd.eos.IdealGas(), 100.0, 0.0),
    "2d-lucy-artificial": (2, "lucy", 3.0, 14, sdpd.eos.ArtificialCompressibility(), 0.0, 100.0),
    "2d-quintic-ideal": (2, "quintic_spline", 3.0, 14, sdpd.eos.IdealGas(), 100.0, 0.0),
}


def conservative_pressure(sim, kernel, support):
    """sum over pairs of r.f/(D V), f = (P_i/d_i^2 + P_j/d_j^2) F(r) r."""
    box = np.array(sim.scene.box.lengths)
    position = sim.positions - box * np.floor(sim.positions / box)
    pairs = cKDTree(position, boxsize=box).query_pairs(support, output_type="ndarray")
    between = position[pairs[:, 0]] - position[pairs[:, 1]]
    between -= box * np.round(between / box)
    distance = np.linalg.norm(between, axis=1)
    _, f = kernels.evaluate(kernel, box.size, distance, support)
    strength = sim.pressures / sim.number_densities**2
    return np.sum(strength[pairs].sum(axis=1) * f * distance**2) / (box.size * np.prod(box))


@pytest.mark.parametrize("case", CASES)
def test_share_of_the_fluctuations(case):
    dimension, kernel, support, edge, law, factor, slope = CASES[case]
    scene = sdpd.Scene(
        fluid=sdpd.Fluid(
            density=1.0,
            shear_viscosity=14.0,
            temperature=1.0,
            boltzmann_constant=1.0,
            equation_of_state=law,
        ),
        box=sdpd.Box((float(edge),) * dimension),
        resolution=sdpd.Resolution(spacing=1.0, kernel=kernel, support=support),
        sound_speed=10.0,
        start=sdpd.RandomStart(),
    )
    sim = sdpd.Simulation(scene, seed=5, threads=1)
    sim.run(steps=600)
    series = []
    for _ in range(224):
        sim.run(steps=5)
        series.append(conservative_pressure(sim, kernel, support))
    measured = analysis.block_average(series, n_blocks=32)
    fluid = theory.DensityTheory(
        kernel=kernel,
        dimension=dimension,
        support=support,
        number_density=1.0,
        stiffness=100.0,
        compressibility_factor=factor,
    )
    share = fluid.virial_pressure(thermal_energy=1.0, stiffness_slope=slope) - 1.0 - factor
    assert abs(share) > 1.0
    assert measured.stderr < 0.04 * abs(share)
    assert abs(measured.value - factor - share) < 0.15 * abs(share) + 4.0 * measured.stderr
    assert abs(measured.z(factor)) > 20.0  # it is not the equation of state at n
