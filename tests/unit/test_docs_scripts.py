"""Each script of docs/scripts runs at a size of seconds and writes its table."""

import importlib
import json
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "docs" / "scripts"
# a piece that each table must hold
TABLES = {
    "discrete_factors": "| Lucy | 2.2 | 22 | 1.0159 | 0.950 | 0.983 | 0.963 | 0.810 |",
    "density_accuracy": "| 2 | Wendland C4 | 2.6 |",
    "default_kernel": "| **Wendland C2** | none |",
    "delivered_viscosity": "| $\\Delta t/\\tau$ | Lucy 3 | Wendland C2 3 |",
    "verlet_temperature": "| one mode, slope | +0.000 | -0.250 | -0.500 |",
    "fields": "| $t$ | $U e^{-2\\nu k^2t}$ | amplitude |",
    "observers": "| `StressCorrelator(parts=True)` |",
    "bian2015": "| mean density of particles | 1.001 |",
    "noise": "| excess kurtosis of the velocity components |",
    "performance": "| lucy | pair splitting | 1 | 2.000 |",
    "poiseuille": "| 0.05 s |",
    "couette": "| 1.00 s |",
    "wall_equilibrium": "| slab | ",
    "wall_flows": "| oscillating plate | 96 |",
    "channel_noise": "| Couette | 0.10 s |",
    "cylinder": "Re = 0.05 |",
    "conductivity": "| liquid in two dimensions |",
    "effects": "| fluctuations | kinetic temperature, flow included |",
    "energy": "| $C/k_B$ |",
    "hard_cases": "| a density ratio of 1000 | 8000 | 0 |",
    "thermal_integrators": "| Verlet without books |",
    "energy_waves": "| $(c_S/c)^2$ |",
    "entropy": "| isolated, shaken | 0.25 |",
    "nitrogen": "| case | $N_i$ |",
    "nitrogen_time_step": "| dt / default |",
    "image_forces": "| plate | distance / h |",
    "thermal_couette": "| published | ",
    "shaped_walls": "| circle, inside, R = 2h | lucy |",
    "wall_models": "| own-foot images, as published | ",
    "accuracy": "| couette | velocity, rms over the speed of the plate",
}
FIGURES = {
    "accuracy",
    "channel_noise",
    "couette",
    "cylinder",
    "conductivity",
    "default_kernel",
    "delivered_viscosity",
    "discrete_factors",
    "effects",
    "energy",
    "energy_waves",
    "fields",
    "hard_cases",
    "image_forces",
    "nitrogen",
    "nitrogen_time_step",
    "performance",
    "poiseuille",
    "shaped_walls",
    "thermal_couette",
    "verlet_temperature",
    "wall_flows",
    "wall_models",
}


@pytest.fixture
def script(monkeypatch):
    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(SCRIPTS))
    yield importlib.import_module
    for name in {"bian2015_runs", "channel", "report", *TABLES} & (set(sys.modules) - before):
        del sys.modules[name]


@pytest.mark.parametrize("name", TABLES)
def test_script_writes_its_table(script, name, tmp_path):
    if name in FIGURES:
        pytest.importorskip("matplotlib")
    script(name).main(["--quick", "--output", str(tmp_path)])
    text = (tmp_path / "generated" / f"{name}.md").read_text(encoding="utf-8")
    assert TABLES[name] in text
    assert "nan" not in text
    assert f"`python docs/scripts/{name}.py --quick`" in text
    columns = {line.count("|") for line in text.split("\n\n")[0].splitlines() if line[:1] == "|"}
    assert len(columns) <= 1
    assert (tmp_path / "figures" / f"{name}.png").exists() == (name in FIGURES)
    if name == "performance":
        document = json.loads((tmp_path / "generated" / f"{name}.json").read_text())
        assert {"speed", "wendland_c2", "effects"} <= set(document)
        assert {"time", "pairs", "bytes_per_particle"} <= set(document["speed"]["rows"][0])
        effects = (tmp_path / "generated" / "performance_effects.md").read_text(encoding="utf-8")
        assert "| conduction | splitting, energy |" in effects
        assert (tmp_path / "figures" / "performance_effects.png").exists()


def test_averages(script):
    report = script("report")
    mean, error = report.mean_and_error([1.0, 2.0, 3.0])
    assert (mean, error) == (2.0, pytest.approx(3**-0.5))
    assert report.blocked([1.0, 3.0, 1.0, 3.0], 2) == (2.0, 0.0)
    assert report.shown(0.12345, 0.0012) == "0.1235 ± 0.0012"
    assert report.shown(0.5, float("nan"), signed=True) == "+0.5000"


def test_orientation_average_is_the_sum_over_all_directions(script):
    """sum of F s^2 [a/D + b/(D (D + 2))] d^-2 n/2 over the lattice (docs/theory)."""
    import numpy as np

    import sdpd

    factors = script("discrete_factors")
    axis = np.arange(-3, 4.0)
    offsets = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    square = np.square(offsets).sum(axis=1)
    w, f = sdpd.kernels.evaluate("wendland_c2", 3, np.sqrt(square), 2.6)
    expected = 0.5 * (f * square).sum() / w.sum() ** 2 * (5 / 9 + 1 / 9)
    row = sdpd.discretization.kernel_table(names=["wendland_c2"], supports=[2.6])[0]
    diagonal = factors.diagonal_viscosity("wendland_c2", 3, 2.6)
    found = factors.average_viscosity(row.viscosity, diagonal, 3)
    assert found == pytest.approx(expected, rel=1e-5)


def test_delivered_viscosity_of_a_lattice_is_its_average_over_directions(script):
    """What the scripts of flows between walls find in an arrangement, against the lattice sum."""
    import numpy as np

    import sdpd

    scene = sdpd.Scene(
        fluid=sdpd.fluids.water(),
        box=sdpd.Box((1e-3, 1e-3, 1e-3)),
        resolution=sdpd.Resolution(particles=(7, 7, 7), kernel="wendland_c2", support=2.6),
        effects=sdpd.Effects(fluctuations=False),
    )
    sim = sdpd.Simulation(scene, threads=1)
    everywhere = np.ones(sim.n_particles, dtype=bool)
    found = script("channel").delivered_viscosity(sim, everywhere)
    axis = np.arange(-3, 4.0)
    offsets = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    square = np.square(offsets).sum(axis=1)
    w, f = sdpd.kernels.evaluate("wendland_c2", 3, np.sqrt(square), 2.6)
    assert found == pytest.approx(
        0.5 * (f * square).sum() / w.sum() ** 2 * (5 / 9 + 1 / 9), rel=1e-9
    )


def test_frozen_factors_of_a_lattice_are_the_lattice_sums(script):
    """On a lattice plane waves are eigenvectors: nothing relaxes."""
    import numpy as np

    import sdpd

    default = script("default_kernel")
    grid = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)
    found = default.frozen_factors(grid, 6.0, "wendland_c2", 2.6)
    row = sdpd.discretization.kernel_table(names=["wendland_c2"], supports=[2.6])[0]
    _, average = default.lattice("wendland_c2", 2.6)
    assert found.density == pytest.approx(row.density, rel=1e-12)
    assert found.friction == pytest.approx(row.friction, rel=1e-12)
    assert found.affine == pytest.approx(average, rel=1e-5)
    assert found.relaxed == pytest.approx(found.affine, rel=1e-6)
