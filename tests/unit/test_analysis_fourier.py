"""Fourier components, structure factor and currents: free particles have every answer exactly."""

import numpy as np
import pytest

from sdpd import analysis, theory

BOX3 = np.array([4.0, 5.0, 6.0])
BOX2 = np.array([4.0, 5.0])


def poisson(rows, count, box, seed):
    return np.random.default_rng(seed).uniform(0.0, 1.0, size=(rows, count, len(box))) * box


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_components_equal_the_sum(box):
    position = poisson(3, 20, box, 51) - 3.0 * box
    vectors = np.array([[1, 0, 0], [2, -3, 1], [0, 4, -2], [-1, 0, 2]])[:, : len(box)]
    wave = np.exp(1.0j * np.einsum("kd,tnd->tkn", 2.0 * np.pi * vectors / box, position))
    plain = analysis.fourier_components(position, box, vectors)
    assert plain == pytest.approx(wave.sum(axis=2), abs=1e-11)
    weights = np.random.default_rng(52).normal(size=position.shape)
    weighted = analysis.fourier_components(position, box, vectors, weights)
    assert weighted == pytest.approx(np.einsum("tkn,tnc->tkc", wave, weights), abs=1e-11)
    scalar = analysis.fourier_components(position[0], box, vectors, weights[0, :, 0])
    assert scalar == pytest.approx(weighted[:1, :, 0], abs=1e-11)


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_half_space_of_wave_vectors_is_complete(box):
    limit = 5.0
    vectors = analysis.allowed_wave_vectors(box, limit)
    every = {
        tuple(n)
        for n in np.ndindex(*(np.full(len(box), 13)))
        if 0 < np.sum((2.0 * np.pi * (np.array(n) - 6) / box) ** 2) <= limit**2
    }
    every = {tuple(int(c) - 6 for c in n) for n in every}
    half = {tuple(int(c) for c in v) for v in vectors}
    assert half | {tuple(-c for c in v) for v in half} == every
    assert 2 * len(half) == len(every)
    assert len(half) == len(vectors)
    assert np.all(np.diff(np.sum((vectors / box) ** 2, axis=1)) > -1e-12)


@pytest.mark.parametrize("box", [BOX2, BOX3], ids=["2D", "3D"])
def test_independent_points_have_s_of_one(box):
    s = analysis.structure_factor(poisson(300, 80, box, 53), box, max_wave_number=4.0)
    p = [s.at(k).p(1.0) for k in range(s.wave_number.size)]
    assert analysis.bonferroni(p).smallest > 1e-3
    pooled = np.sum(s.mean * s.counts) / s.counts.sum()
    assert abs(pooled - 1.0) < 4.0 / np.sqrt(s.counts.sum())
    assert s.counts.sum() == 300 * s.n_vectors.sum()


def test_structure_factor_of_a_lattice():
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    s = analysis.structure_factor(grid, [4.0, 4.0, 4.0], max_wave_number=2.0 * np.pi)
    assert s.mean[-1] == pytest.approx(3.0 * 64.0 / s.n_vectors[-1])  # 100, 010, 001 are Bragg
    assert s.mean[:-1] == pytest.approx(np.zeros(s.mean.size - 1), abs=1e-20)
    assert s.wave_number[-1] == pytest.approx(2.0 * np.pi)
    assert s.n_vectors[:3].tolist() == [3, 6, 4]


def test_structure_factor_blocks_are_means_of_frames():
    position = poisson(7, 30, BOX2, 54)
    s = analysis.structure_factor(position, BOX2, max_wave_number=2.0, n_blocks=3)
    vectors = analysis.allowed_wave_vectors(BOX2, 2.0)
    power = np.abs(analysis.fourier_components(position, BOX2, vectors)) ** 2 / 30
    k = np.sqrt(np.sum((2.0 * np.pi * vectors / BOX2) ** 2, axis=1))
    first = np.isclose(k, s.wave_number[0])
    assert s.mean[0] == pytest.approx(power[:, first].mean())
    assert s.blocks[0, 0] == pytest.approx(power[:3, first].mean())


VARIANCE, STEP = 0.6, 0.1


@pytest.fixture(scope="module")
def ballistic():
    """Replicas of 60 free particles: F(k, t) = exp(-k^2 v^2 t^2/2) and its derivatives."""
    generator = np.random.default_rng(55)
    replicas = []
    for _ in range(40):
        start = generator.uniform(0.0, 5.0, size=(60, 3))
        velocity = generator.normal(size=(60, 3)) * np.sqrt(VARIANCE)
        position = start + (STEP * np.arange(100))[:, None, None] * velocity
        replicas.append(
            analysis.current_correlations(
                position,
                np.broadcast_to(velocity, position.shape),
                [5.0, 5.0, 5.0],
                STEP,
                wave_vectors=[[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, -1]],
                max_lag=15,
                n_blocks=5,
            )
        )
    return replicas


@pytest.mark.parametrize("shell", [0, 1])
@pytest.mark.parametrize("name", ["density", "longitudinal", "transverse", "cross"])
def test_currents_of_free_particles(ballistic, shell, name):
    k = ballistic[0][shell].wave_number
    assert k == pytest.approx(2.0 * np.pi / 5.0 * np.sqrt(shell + 1.0))
    functions = [getattr(replica[shell], name) for replica in ballistic]
    lag = functions[0].lag
    x = k**2 * VARIANCE * lag**2
    exact = {
        "density": np.exp(-0.5 * x),
        "longitudinal": VARIANCE * (1.0 - x) * np.exp(-0.5 * x),
        "transverse": VARIANCE * np.exp(-0.5 * x),
        "cross": k * VARIANCE * lag * np.exp(-0.5 * x),
    }[name]
    values = np.array([f.mean for f in functions])  # replicas are independent, blocks are not
    p = [analysis.ensemble(values[:, t]).p(exact[t]) for t in range(1, 16, 3)]
    assert analysis.bonferroni(p).smallest > 1e-3
    assert values.std(ddof=1, axis=0).max() / np.sqrt(40) < 0.08


def synthetic(lag, exact, noise, seed):
    """A correlation function of 16 blocks around an exact one, with smooth noise, C(0) = 1."""
    generator = np.random.default_rng(seed)
    wiggle = np.sin(np.outer(generator.uniform(0.5, 3.0, 16), lag) + generator.normal(size=(16, 1)))
    blocks = exact + noise * generator.normal(size=(16, 1)) * wiggle * (lag > 0)
    return analysis.Correlation(
        lag=lag, blocks=blocks, block_counts=np.ones_like(blocks), window=(0.0, 1e3)
    )


FLUID = theory.HydrodynamicTheory(
    dimension=2, density=2.0, shear_viscosity=0.8, bulk_viscosity=0.4, sound_speed=3.0
)


def test_fit_of_the_viscosity():
    lag, k = 0.1 * np.arange(60), 1.3
    exact = synthetic(lag, FLUID.transverse(k, lag), 0.0, 56)
    clean = analysis.fit_transverse(exact, k)
    assert clean.value == pytest.approx(FLUID.kinematic_viscosity, rel=1e-6)
    noisy = analysis.fit_transverse(synthetic(lag, FLUID.transverse(k, lag), 0.02, 57), k)
    assert noisy.relative < 0.05
    assert abs(noisy.z(FLUID.kinematic_viscosity)) < 4.0
    early = analysis.fit_transverse(exact, k, window=(0.0, 0.5))
    assert early.window == pytest.approx((0.0, 0.5))


@pytest.mark.parametrize("kind", ["density", "longitudinal"])
def test_fit_of_sound(kind):
    lag, k = 0.05 * np.arange(200), 0.9
    curve = {"density": FLUID.density_correlation, "longitudinal": FLUID.longitudinal}[kind](k, lag)
    clean = analysis.fit_sound(synthetic(lag, curve, 0.0, 58), k, kind=kind)
    assert clean.sound_speed.value == pytest.approx(3.0, rel=1e-6)
    assert clean.damping.value == pytest.approx(FLUID.sound_damping, rel=1e-5)
    noisy = analysis.fit_sound(synthetic(lag, curve, 0.02, 59), k, kind=kind)
    assert noisy.sound_speed.relative < 0.02
    assert abs(noisy.sound_speed.z(3.0)) < 4.0
    assert abs(noisy.damping.z(FLUID.sound_damping)) < 4.0


def uneven_lags(dt):
    """Linear first, then every 2nd and 4th lag, as from a correlator inside the loop."""
    return dt * np.concatenate([np.arange(64), 2 * np.arange(32, 64), 4 * np.arange(32, 64)])


def test_fits_on_uneven_lags():
    k = 0.9
    lag = uneven_lags(0.05)
    clean = analysis.fit_transverse(synthetic(lag, FLUID.transverse(k, lag), 0.0, 62), k)
    assert clean.value == pytest.approx(FLUID.kinematic_viscosity, rel=1e-6)
    assert clean.window[1] == pytest.approx(3.1, abs=0.2)  # where it falls below 1/e
    noisy = analysis.fit_transverse(
        synthetic(lag, FLUID.transverse(k, lag), 0.02, 63), k, window=(0.0, 6.0)
    )
    assert noisy.relative < 0.05
    assert abs(noisy.z(FLUID.kinematic_viscosity)) < 4.0
    for kind in ("density", "longitudinal"):
        curve = FLUID.density_correlation if kind == "density" else FLUID.longitudinal
        for dt in (0.01, 0.05):  # the first minimum on the linear lags, or beyond them
            lag = uneven_lags(dt)
            fit = analysis.fit_sound(synthetic(lag, curve(k, lag), 0.0, 64), k, kind=kind)
            assert fit.sound_speed.value == pytest.approx(3.0, rel=1e-6)
            assert fit.damping.value == pytest.approx(FLUID.sound_damping, rel=1e-5)


def test_fit_of_overdamped_sound_from_a_guess():
    thick = theory.HydrodynamicTheory(
        dimension=3, density=1.0, shear_viscosity=6.0, sound_speed=3.0
    )
    lag, k = 0.05 * np.arange(200), 1.0
    c = synthetic(lag, thick.density_correlation(k, lag), 0.0, 60)
    fit = analysis.fit_sound(c, k, guess=(2.5, 5.0))
    assert fit.sound_speed.value == pytest.approx(3.0, rel=1e-4)
    assert fit.damping.value == pytest.approx(4.0, rel=1e-4)
    with pytest.raises(ValueError, match="`guess` must be given"):
        analysis.fit_sound(c, k)


ARGUMENTS = {"wave_vectors": [[1, 0]], "max_lag": 2, "n_blocks": 2}


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (
            lambda p: analysis.fourier_components(p, BOX2, [[1.0, 0.0]]),
            TypeError,
            "`wave_vectors` must be integers",
        ),
        (lambda p: analysis.fourier_components(p, BOX2, [[0, 0]]), ValueError, "zero vector"),
        (lambda p: analysis.fourier_components(p, BOX2, [[1, 0, 0]]), ValueError, "shape .K, 2."),
        (
            lambda p: analysis.fourier_components(p, BOX2, [[1, 0]], p[:3]),
            ValueError,
            "`value` must start with shape",
        ),
        (
            lambda p: analysis.structure_factor(p, BOX2, max_wave_number=1.0),
            ValueError,
            "the smallest of the box",
        ),
        (
            lambda p: analysis.current_correlations(p, p[:3], BOX2, 1.0, **ARGUMENTS),
            ValueError,
            "`velocity` must have the shape",
        ),
        (
            lambda p: analysis.current_correlations(p, p, BOX2, 0.0, **ARGUMENTS),
            ValueError,
            "`dt` must be finite and > 0",
        ),
    ],
)
def test_bad_input_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call(poisson(8, 10, BOX2, 61))
