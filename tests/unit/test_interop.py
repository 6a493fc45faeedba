"""Exchange with MDAnalysis and ASE."""

import sys
import warnings

import numpy as np
import pytest

import sdpd
from sdpd import interop

from .sims import assert_same_bits, small, small_scene

AVOGADRO = 6.02214076e23


@pytest.fixture
def water():
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water(),
        box=sdpd.Box((1e-8, 1e-8, 1e-8)),
        resolution=sdpd.Resolution(particles=216),
    )
    sim = sdpd.Simulation(scene, seed=1)
    sim.run(steps=3)
    return sim


class TestMDAnalysis:
    def test_present_state(self, water):
        universe = water.to_mdanalysis()
        atoms = universe.atoms
        np.testing.assert_allclose(atoms.positions, water.positions * 1e10, rtol=1e-6)
        np.testing.assert_allclose(atoms.velocities, water.velocities * 1e-2, rtol=1e-6)
        force = AVOGADRO * 1e-13
        np.testing.assert_allclose(atoms.forces, water.forces * force, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(universe.dimensions, [100, 100, 100, 90, 90, 90])
        assert universe.trajectory.ts.time == pytest.approx(water.time * 1e12)
        assert atoms.masses[0] == pytest.approx(water.scene.particle_mass * AVOGADRO * 1e3)
        np.testing.assert_array_equal(atoms.ids, water.ids)

    def test_reduced_units_and_two_dimensions(self):
        sim = small()
        universe = sim.to_mdanalysis()
        np.testing.assert_allclose(universe.atoms.positions[:, :2], sim.positions, rtol=1e-6)
        assert np.all(universe.atoms.positions[:, 2] == 0.0)
        np.testing.assert_allclose(universe.dimensions[:3], [10, 10, 1])

    def test_trajectory(self, water):
        positions = np.stack([water.positions, water.positions + 1e-10])
        velocities = np.stack([water.velocities, -water.velocities])
        universe = interop.to_mdanalysis(
            water, positions=positions, velocities=velocities, dt=2e-12
        )
        assert [ts.time for ts in universe.trajectory] == pytest.approx([0.0, 2.0])
        universe.trajectory[1]
        np.testing.assert_allclose(universe.atoms.positions, positions[1] * 1e10, rtol=1e-6)
        np.testing.assert_allclose(universe.atoms.velocities, velocities[1] * 1e-2, rtol=1e-6)
        universe = interop.to_mdanalysis(water, positions=positions, dt=2e-12)
        assert not universe.trajectory.ts.has_velocities

    def test_its_analysis_works(self, water):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from MDAnalysis.analysis.rdf import InterRDF

            atoms = water.to_mdanalysis().atoms
            rdf = InterRDF(atoms, atoms, nbins=20, range=(1.0, 40.0), exclusion_block=(1, 1)).run()
        assert rdf.results.rdf[-5:].mean() == pytest.approx(1.0, abs=0.2)


class TestASE:
    def test_present_state(self, water):
        units = pytest.importorskip("ase.units")
        atoms = water.to_ase()
        np.testing.assert_allclose(atoms.positions, water.positions * 1e10, rtol=1e-12)
        speed = units.m / units.s
        np.testing.assert_allclose(atoms.get_velocities(), water.velocities * speed, rtol=1e-12)
        assert atoms.get_masses()[0] == pytest.approx(water.scene.particle_mass * units.kg)
        kinetic = atoms.get_kinetic_energy() * units._e
        assert kinetic == pytest.approx(water.kinetic_energy, rel=1e-6)
        assert atoms.pbc.all() and atoms.cell.lengths() == pytest.approx([100.0] * 3)
        np.testing.assert_array_equal(atoms.arrays["ids"], water.ids)
        np.testing.assert_array_equal(atoms.arrays["densities"], water.densities)
        np.testing.assert_array_equal(atoms.arrays["pressures"], water.pressures)
        assert atoms.info == {"step": 3, "time": water.time, "dimension": 3}

    def test_it_is_a_copy(self, water):
        before = water.positions.copy()
        atoms = water.to_ase()
        atoms.positions[:] = 0.0
        atoms.arrays["densities"][:] = 0.0
        np.testing.assert_array_equal(water.positions, before)

    @pytest.mark.parametrize("dimension", [2, 3])
    def test_round_trip_in_reduced_units_is_exact(self, dimension):
        sim = small(scene=small_scene(edge=7, dimension=dimension))
        sim.run(steps=4)
        atoms = sim.to_ase()
        state = interop.from_ase(atoms, sim.scene)
        np.testing.assert_array_equal(state.positions, sim.positions)
        np.testing.assert_array_equal(state.velocities, sim.velocities)
        assert interop.box_from_ase(atoms, si=False) == sim.scene.box
        twin = sdpd.Simulation(
            sim.scene, seed=8, positions=state.positions, velocities=state.velocities
        )
        assert_same_bits(twin, sdpd.Simulation.from_ase(atoms, sim.scene, seed=8))

    def test_round_trip_in_si_units(self, water):
        state = interop.from_ase(water.to_ase(), water.scene)
        np.testing.assert_allclose(state.positions, water.positions, rtol=1e-13)
        np.testing.assert_allclose(state.velocities, water.velocities, rtol=1e-12)
        assert interop.box_from_ase(water.to_ase()).lengths == pytest.approx((1e-8,) * 3)

    def test_extended_xyz_keeps_everything(self, water, tmp_path):
        from ase.io import read, write

        write(tmp_path / "water.xyz", water.to_ase(), format="extxyz")
        atoms = read(tmp_path / "water.xyz")
        np.testing.assert_array_equal(atoms.arrays["ids"], water.ids)
        np.testing.assert_allclose(atoms.arrays["densities"], water.densities, rtol=1e-10)
        np.testing.assert_allclose(atoms.arrays["pressures"], water.pressures, rtol=1e-10)
        assert atoms.info["step"] == 3 and atoms.info["time"] == pytest.approx(water.time)
        state = interop.from_ase(atoms, water.scene)
        np.testing.assert_allclose(state.positions, water.positions, atol=1e-17)
        speed = np.abs(water.velocities).max()
        np.testing.assert_allclose(state.velocities, water.velocities, atol=1e-6 * speed)

    def test_atoms_without_momenta(self, water):
        atoms = water.to_ase()
        del atoms.arrays["momenta"]
        assert interop.from_ase(atoms, water.scene).velocities is None
        sim = sdpd.Simulation.from_ase(atoms, water.scene, seed=1)
        assert sim.temperature == pytest.approx(300.0, rel=0.3)


def bulk(**changes):
    from ase import Atoms

    arguments = {"numbers": [0] * 100, "cell": [10.0, 10.0, 0.0], "pbc": [True, True, False]}
    index = np.arange(100)
    points = np.stack([index % 10, index // 10, 0 * index], axis=1) + 0.5
    return Atoms(positions=points, **{**arguments, **changes})


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (
            lambda: interop.from_ase([1, 2], small_scene()),
            TypeError,
            "`atoms` must be ase.Atoms, got list",
        ),
        (
            lambda: interop.from_ase(bulk(), "water"),
            TypeError,
            "`scene` must be an sdpd.Scene, got 'water' of type str",
        ),
        (
            lambda: interop.from_ase(bulk()[:99], small_scene()),
            ValueError,
            "`atoms` must be as many as the scene has particles, 100, got 99",
        ),
        (
            lambda: interop.from_ase(bulk(cell=[10.0, 9.0, 0.0]), small_scene()),
            ValueError,
            "`atoms` must have the cell of the scene's box, 10 along y, got 9",
        ),
        (
            lambda: interop.box_from_ase(bulk(cell=[[10, 1, 0], [0, 10, 0], [0, 0, 10]])),
            ValueError,
            (
                "`atoms` must have a rectangular cell along the axes, got [[10.0, 1.0, 0.0], "
                "[0.0, 10.0, 0.0], [0.0, 0.0, 10.0]]"
            ),
        ),
        (
            lambda: interop.to_mdanalysis(small(), positions=np.zeros((2, 99, 2)), dt=1.0),
            ValueError,
            "`positions` must be an array of shape (any, 100, 2), got (2, 99, 2)",
        ),
        (
            lambda: interop.to_mdanalysis(small(), positions=np.zeros((0, 100, 2)), dt=1.0),
            ValueError,
            "`positions` must hold at least one frame, got shape (0, 100, 2)",
        ),
        (
            lambda: interop.to_mdanalysis(small(), positions=np.zeros((2, 100, 2))),
            TypeError,
            "`dt` must be a number (finite and > 0), got None of type NoneType",
        ),
        (
            lambda: interop.to_mdanalysis(small(), dt=1.0),
            ValueError,
            "`positions` must be given with `velocities` or `dt`, got None",
        ),
    ],
)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text


@pytest.mark.parametrize("name", ["MDAnalysis", "ase"])
def test_a_missing_library_is_named_with_its_extra(monkeypatch, name):
    sim = small()
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=rf"{name} is needed .*: pip install 'sdpd\[io\]'"):
        sim.to_ase() if name == "ase" else sim.to_mdanalysis()
