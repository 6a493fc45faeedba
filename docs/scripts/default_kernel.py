"""Factors of kernels and supports in an equilibrium fluid, which choose the default."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from report import (
    KERNEL_COLOURS,
    Report,
    grid,
    mean_and_error,
    reduced_fluid,
    shown,
    subplots,
)

import sdpd
from sdpd import discretization, kernels, resolution
from sdpd.theory import friction_coefficients

ETA = 20.0  # eta*; equilibrium configurations do not depend on it
SOUND_SPEED = 10.0  # X = 100
SUPPORTS = (2.2, 2.64, 3.0, 3.5)
ACROSS, ALONG = friction_coefficients(1.0, 0.0, 3)


@dataclass(frozen=True)
class Frozen:
    """Factors of one configuration at rest."""

    density: float  # d/n
    affine: float  # eta_eff/eta of the velocity field u exp(ik.r)
    relaxed: float  # the same once the velocities have adapted to their neighbours
    friction: float  # friction rate over its mean field


@dataclass(frozen=True)
class Case:
    """A kernel and support: estimates and standard errors, in the order of `Frozen`."""

    kernel: str
    support: float
    pairs: float
    mean: Frozen
    error: Frozen


def frozen_factors(positions: np.ndarray, edge: float, kernel: str, support: float) -> Frozen:
    """Factors of one configuration of unit density in a cube, from sums over its pairs.

    The friction matrix G of the frozen configuration acts on plane waves f = u cos(k.r), u
    perpendicular to k, over axes, polarisations and phases: <f|G|f>/<f|f> is the rate at which the
    wave decays at first, <f|f>/<f|G^-1|f> the rate once its short-lived part, what the disorder
    makes of it, is gone. The first is taken in the limit k -> 0 and averaged over directions, the
    second by its ratio to the first at the longest wave of the box.
    """
    from scipy.sparse import coo_matrix, csr_matrix, diags
    from scipy.sparse.linalg import cg
    from scipy.spatial import cKDTree

    number = len(positions)
    pairs = cKDTree(positions, boxsize=edge).query_pairs(support, output_type="ndarray")
    i, j = pairs.T
    separation = positions[i] - positions[j]
    separation -= edge * np.round(separation / edge)
    distance = np.linalg.norm(separation, axis=1)
    w, f = kernels.evaluate(kernel, 3, distance, support)
    own = float(kernels.evaluate(kernel, 3, 0.0, support)[0])
    density = own + np.bincount(i, w, number) + np.bincount(j, w, number)
    g = f / (density[i] * density[j])

    along = ALONG * g[:, None, None] * np.einsum("pi,pj->pij", separation, separation)
    block = ACROSS * g[:, None, None] * np.eye(3) + along / np.square(distance)[:, None, None]
    component = np.arange(3)
    row = np.broadcast_to((3 * i)[:, None, None] + component[:, None], block.shape).ravel()
    column = np.broadcast_to((3 * j)[:, None, None] + component, block.shape).ravel()
    half = coo_matrix((block.ravel(), (row, column)), (3 * number, 3 * number))
    off = csr_matrix(half + half.T)
    local = np.zeros((number, 3, 3))
    np.add.at(local, i, block)
    np.add.at(local, j, block)
    row = np.broadcast_to((3 * np.arange(number))[:, None, None] + component[:, None], local.shape)
    column = np.broadcast_to((3 * np.arange(number))[:, None, None] + component, local.shape)
    on = coo_matrix((local.ravel(), (row.ravel(), column.ravel())), off.shape)
    matrix = csr_matrix(on - off)
    scale = diags(1.0 / matrix.diagonal())

    first = last = 0.0
    for axis in range(3):
        phase = 2.0 * np.pi / edge * positions[:, axis]
        for polarisation in {0, 1, 2} - {axis}:
            for wave in (np.cos(phase), np.sin(phase)):
                field = np.zeros((number, 3))
                field[:, polarisation] = wave - wave.mean()  # no net momentum
                flat = field.ravel()
                answer, failed = cg(matrix, flat, rtol=1e-8, M=scale)
                if failed:
                    raise RuntimeError(f"the friction matrix of {kernel} {support} was not solved")
                square = flat @ flat
                first += flat @ (matrix @ flat) / square
                last += square / (flat @ answer)
    square = np.square(distance)
    affine = float(g @ square) * (ACROSS / 3.0 + ALONG / 15.0) / number
    mean_field = kernels.get(kernel).friction_integral[1] / support**2
    return Frozen(
        float(density.mean()), affine, affine * last / first, 2.0 * g.sum() / number / mean_field
    )


def simulate(
    kernel: str, support: float, *, edge: int, samples: int, apart: float, wait: float, seed: int
) -> list[Frozen]:
    """Configurations of an equilibrium fluid, some time apart."""
    scene = sdpd.Scene(
        fluid=reduced_fluid(ETA),
        box=sdpd.Box((float(edge),) * 3),
        resolution=sdpd.Resolution(spacing=1.0, kernel=kernel, support=support),
        start=sdpd.RandomStart(),
        sound_speed=SOUND_SPEED,
    )
    sim = sdpd.Simulation(scene, seed=seed, threads=1, resolve_vacf=True)
    sim.run(time=wait, progress=False)
    found = []
    for _ in range(samples):
        sim.run(time=apart, progress=False)
        found.append(frozen_factors(np.array(sim.positions), float(edge), kernel, support))
    return found


def measure(kernel: str, support: float, *, quick: bool) -> Case:
    """Averages over configurations; errors from means of successive ones."""
    edge, samples, apart, wait = (7, 4, 0.02, 0.1) if quick else (10, 20, 1.0, 8.0)
    found = simulate(kernel, support, seed=1, edge=edge, samples=samples, apart=apart, wait=wait)
    columns = np.array([[x.density, x.affine, x.relaxed, x.friction] for x in found])
    blocks = columns.reshape(-1, 2 if quick else 4, 4).mean(axis=1)
    estimates = [mean_and_error(column) for column in blocks.T]
    return Case(
        kernel,
        support,
        discretization.pairs_per_particle(3, support),
        Frozen(*(mean for mean, _ in estimates)),
        Frozen(*(error for _, error in estimates)),
    )


def lattice(kernel: str, support: float) -> tuple[float, float]:
    """eta_eff/eta of the cubic lattice: along an axis, and averaged over orientations."""
    from discrete_factors import average_viscosity, diagonal_viscosity

    row = discretization.kernel_table(names=[kernel], supports=[support])[0]
    diagonal = diagonal_viscosity(kernel, 3, support)
    return row.viscosity, average_viscosity(row.viscosity, diagonal, 3)


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("default_kernel", __doc__, argv)
    names = ("lucy", "wendland_c2") if report.quick else tuple(kernels.names())
    supports = (2.2, 3.0) if report.quick else SUPPORTS
    cases = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sdpd.PairingWarning)
        cases = [measure(name, s, quick=report.quick) for s in supports for name in names]
    rows = []
    for case in cases:
        axis, average = lattice(case.kernel, case.support)
        default = (resolution.DEFAULT_KERNEL, resolution.DEFAULT_SUPPORT)
        title = kernels.get(case.kernel).title
        limit = kernels.get(case.kernel).pairing_limit[1]
        rows.append(
            [
                f"{case.support:g}",
                f"{case.pairs:.0f}",
                f"**{title}**" if (case.kernel, case.support) == default else title,
                f"{limit:.3g}" if np.isfinite(limit) else "none",
                shown(case.mean.density, case.error.density),
                shown(case.mean.affine, case.error.affine),
                shown(case.mean.relaxed, case.error.relaxed),
                f"{axis:.3f}",
                f"{average:.3f}",
                shown(case.mean.friction, case.error.friction),
            ]
        )
    header = [
        "$h/\\Delta x$",
        "pairs per particle",
        "kernel",
        "$X_\\max$",
        "$d/n$",
        "$\\eta_\\mathrm{eff}/\\eta$, at first",
        "$\\eta_\\mathrm{eff}/\\eta$",
        "lattice axis",
        "lattice average",
        "friction rate",
    ]
    number = 7**3 if report.quick else 10**3
    report.document(
        grid(header, rows),
        f"All columns are dimensionless. 3D, $X={SOUND_SPEED**2:g}$, ideal-gas pressure "
        f"$P=c^2\\rho$, $\\zeta=0$, $N={number}$; one standard error. The default is printed bold.",
    )
    _plot(report, cases)


def _plot(report: Report, cases: Sequence[Case]) -> None:
    figure, axes = subplots(3, width=8.6, height=3.0)
    panels = (("density", "density $d/n$"), ("relaxed", r"viscosity $\eta_\mathrm{eff}/\eta$"))
    for panel, (name, title) in zip(axes, (*panels, ("friction", "friction rate")), strict=True):
        for kernel in dict.fromkeys(case.kernel for case in cases):
            mine = [case for case in cases if case.kernel == kernel]
            panel.errorbar(
                [case.pairs for case in mine],
                [getattr(case.mean, name) for case in mine],
                [getattr(case.error, name) for case in mine],
                color=KERNEL_COLOURS[kernel],
                marker="o",
                markersize=3.5,
                linewidth=1.2,
                label=kernels.get(kernel).title,
            )
        panel.axhline(1.0, color="0.5", linewidth=0.8)
        panel.set(title=title, xlabel="pairs per particle")
    axes[2].legend(loc="lower right")
    report.figure(figure)


if __name__ == "__main__":
    main()
