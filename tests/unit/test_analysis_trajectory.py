"""The analysis of a real trajectory from its file: MDAnalysis and plain NumPy say the same."""

import warnings

import numpy as np
import pytest

import sdpd
from sdpd import analysis

FRAMES, EVERY, ANGSTROM = 60, 4, 1e-10


@pytest.fixture(scope="module", params=[2, 3], ids=["2D", "3D"])
def trajectory(request, tmp_path_factory):
    """Path and frames of a short run of water, in which many particles cross the boundary."""
    dimension = request.param
    scene = sdpd.Scene(
        fluid=sdpd.fluids.water() if dimension == 3 else sdpd.fluids.water().in_plane(1e-9),
        box=sdpd.Box((1e-8,) * dimension),
        resolution=sdpd.Resolution(particles=216 if dimension == 3 else 144),
        start=sdpd.RandomStart(),
    )
    sim = sdpd.Simulation(scene, seed=3, threads=1)
    sim.run(steps=200)
    path = tmp_path_factory.mktemp("trajectory") / "water.h5md"
    writer = sdpd.Trajectory(path, every=EVERY, precision="float64")
    sim.run(steps=EVERY * (FRAMES - 1), observe=writer)
    frames = sdpd.h5md.read(path)
    assert len(frames) == FRAMES
    assert (frames.unwrapped != frames.positions).any()
    return path, frames


def universe_of(position, box):
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.coordinates.memory import MemoryReader

    padded = np.zeros((*position.shape[:2], 3), dtype=np.float32)
    padded[..., : position.shape[2]] = position / ANGSTROM
    edges = [*(box / ANGSTROM), *[1000.0] * (3 - len(box)), 90.0, 90.0, 90.0]
    universe = mda.Universe.empty(position.shape[1], trajectory=True)
    universe.load_new(padded, format=MemoryReader, order="fac", dimensions=np.float32(edges))
    return universe


@pytest.mark.parametrize("fft", [True, False])
def test_msd_agrees_with_mdanalysis_and_numpy(trajectory, fft):
    from MDAnalysis.analysis.msd import EinsteinMSD

    if fft:
        pytest.importorskip("tidynamics")
    _, frames = trajectory
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # MDAnalysis warns of its own defaults
        theirs = EinsteinMSD(universe_of(frames.unwrapped, frames.box), msd_type="xyz", fft=fft)
        theirs.run()
    ours = analysis.msd(frames.unwrapped, frames.dt, max_lag=40, n_blocks=3, by="particles")
    assert ours.mean / ANGSTROM**2 == pytest.approx(
        theirs.results.timeseries[:41], rel=2e-4, abs=1e-4 * ours.mean[-1] / ANGSTROM**2
    )
    for lag in (1, 7, 40):
        moved = frames.unwrapped[lag:] - frames.unwrapped[:-lag]
        assert ours.mean[lag] == pytest.approx(np.mean(np.sum(moved**2, axis=2)), rel=1e-10)
    assert ours.lag[1] == pytest.approx(frames.dt)


def test_radial_distribution_agrees_with_mdanalysis_and_numpy(trajectory):
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.analysis.rdf import InterRDF

    path, frames = trajectory
    half = 0.5 * float(frames.box.min())
    limits = np.linspace(0.0, 0.99 * half, 31)
    ours = analysis.radial_distribution(frames.positions, frames.box, bins=limits)
    dimension, count = frames.box.size, frames.positions.shape[1]
    histogram = np.zeros(30)
    for position in frames.positions:
        between = position[:, None] - position
        between -= frames.box * np.round(between / frames.box)
        distance = np.sqrt(np.sum(between**2, axis=2))[~np.eye(count, dtype=bool)]
        histogram += np.histogram(distance, limits)[0]
    shell = np.diff(limits**dimension) * (np.pi if dimension == 2 else 4.0 * np.pi / 3.0)
    ideal = FRAMES * count * (count - 1.0) * shell / np.prod(frames.box)
    assert ours.mean == pytest.approx(histogram / ideal, rel=1e-9)
    if dimension == 2:
        return  # InterRDF knows shells in three dimensions only
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        universe = mda.Universe(str(path))
        theirs = InterRDF(
            universe.atoms,
            universe.atoms,
            nbins=30,
            range=(0.0, limits[-1] / ANGSTROM),
            exclusion_block=(1, 1),
        ).run()
    # single precision moves pairs across the edges of bins
    assert ours.mean == pytest.approx(theirs.results.rdf, rel=1e-3, abs=2e-3)


def test_velocities_agree_with_numpy(trajectory):
    _, frames = trajectory
    v = frames.velocities
    ours = analysis.vacf(v, frames.dt, max_lag=9, n_blocks=5)
    for lag in (0, 1, 9):
        product = v[: FRAMES - lag] * v[lag:]
        assert ours.mean[lag] == pytest.approx(product.mean(), rel=1e-9, abs=1e-12 * ours.mean[0])
    momentum = frames.mass[:, None] * v
    c = analysis.spatial_correlation(frames.positions, frames.box, momentum, bins=8, n_blocks=6)
    assert c.local.value == pytest.approx(np.mean(momentum**2))


def test_hydrodynamic_modes_agree_with_numpy(trajectory):
    _, frames = trajectory
    dimension = frames.box.size
    vector = np.eye(dimension, dtype=int)[:1]
    (shell,) = analysis.current_correlations(
        frames.positions,
        frames.velocities,
        frames.box,
        frames.dt,
        wave_vectors=vector,
        max_lag=9,
        n_blocks=5,
    )
    k = 2.0 * np.pi / frames.box[0]
    wave = np.exp(1.0j * k * frames.unwrapped[..., 0])  # wrapped or not is all the same
    count = frames.positions.shape[1]
    density = wave.sum(axis=1)
    current = np.einsum("tn,tnc->tc", wave, frames.velocities)
    assert shell.wave_number == pytest.approx(k)
    for lag in (0, 1, 9):
        early, late = slice(0, FRAMES - lag), slice(lag, FRAMES)
        rho = np.mean(density[early].conj() * density[late]).real / count
        along = np.mean(current[early, 0].conj() * current[late, 0]).real / count
        across = np.mean(current[early, 1:].conj() * current[late, 1:]).real / count
        cross = np.mean(density[early].conj() * current[late, 0]).imag / count
        scale = (shell.density.mean[0], shell.longitudinal.mean[0])
        assert shell.density.mean[lag] == pytest.approx(rho, abs=1e-9 * scale[0])
        assert shell.longitudinal.mean[lag] == pytest.approx(along, abs=1e-9 * scale[1])
        assert shell.transverse.mean[lag] == pytest.approx(across, abs=1e-9 * scale[1])
        assert shell.cross.mean[lag] == pytest.approx(
            cross, abs=1e-9 * np.sqrt(scale[0] * scale[1])
        )
    power = analysis.structure_factor(frames.positions, frames.box, max_wave_number=1.01 * k)
    axes = [np.exp(1.0j * k * frames.positions[..., a]).sum(axis=1) for a in range(dimension)]
    assert power.mean[0] == pytest.approx(np.mean(np.abs(axes) ** 2) / count, rel=1e-9)
