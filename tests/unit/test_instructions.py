"""Vector instructions: the same physics by all of them, and a clear word to who asks for others."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

# The integrators and their sweeps from given positions, with noise: positions and velocities at the
# end as exact hexadecimal numbers.
SCRIPT = """
import json, warnings
import sdpd
warnings.simplefilter("ignore", sdpd.errors.SdpdWarning)
found = {}
for energy in (False, True):
    constants = {"heat_capacity": 25.0, "thermal_conductivity": 100.0} if energy else {}
    fluid = sdpd.Fluid(density=1.0, shear_viscosity=20.0, temperature=1.0, boltzmann_constant=1.0,
                       equation_of_state=sdpd.eos.IdealGas(), **constants)
    scene = sdpd.Scene(
        fluid=fluid, box=sdpd.Box((7.0, 7.0, 7.0)),
        resolution=sdpd.Resolution(spacing=1.0, support=2.4, kernel="wendland_c2"),
        sound_speed=10.0, effects=sdpd.Effects(energy=energy))
    uniform, normal = (sdpd.VelocityVerlet(noise=noise) for noise in ("uniform", "gaussian"))
    for integrator in (sdpd.PairSplitting(), uniform, normal):
        sim = sdpd.Simulation(scene, integrator=integrator, dt=0.002, seed=3, threads=1)
        sim.run(steps=20, progress=False)
        found[f"{integrator} {energy}"] = [
            x.hex() for array in (sim.positions, sim.velocities) for x in array.ravel().tolist()]
print(json.dumps([sim.profile().instructions, found]))
"""


def ask(wish: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "SDPD_INSTRUCTIONS": wish}
    command = [sys.executable, "-c", SCRIPT]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def run(wish: str) -> tuple[str, dict[str, list[str]]]:
    child = ask(wish)
    assert child.returncode == 0, child.stderr
    used, found = json.loads(child.stdout)
    return used, found


def test_all_instructions_make_the_same_trajectories() -> None:
    widest, found = run("")
    used, plain = run("portable")
    assert used == "portable"
    for name, numbers in found.items():
        a, b = (np.array([float.fromhex(x) for x in each]) for each in (numbers, plain[name]))
        assert np.abs(a - b).max() < 1e-11, name
    if widest == "portable":
        return
    assert found != plain  # products are fused
    used, narrow = run("avx2")
    assert used == "avx2"
    assert narrow == found


@pytest.mark.parametrize("wish", ["mmx", "AVX2"])
def test_other_wishes_are_refused(wish: str) -> None:
    child = ask(wish)
    assert child.returncode != 0
    last = child.stderr.strip().splitlines()[-1]
    assert last.startswith("ValueError: `SDPD_INSTRUCTIONS` in the environment must be one of")
    assert "portable" in last and wish in last
