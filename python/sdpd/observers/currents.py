"""Density and current correlations in Fourier space inside the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .lagged import BLOCKS, LaggedObserver

if TYPE_CHECKING:
    from sdpd.analysis.currents import CurrentCorrelations
    from sdpd.simulation import Simulation

__all__ = ["CurrentCorrelator"]


class CurrentCorrelator(LaggedObserver):
    r"""Correlation functions of density and current at wave vectors of the box.

    Parameters
    ----------
    wave_vectors : array_like of int, shape (K, D)
        n of k = 2 pi n / L, not 0; those of equal |k| are averaged. Give k or -k, not both.
    every : int, optional
        Steps between samples; that of the run if None.
    points : int
        Lags on the first level, even: equally spaced ones, for fits; half as many on each further
        level.
    levels : int
        The longest lag is ``(points - 1) 2^(levels - 1)`` samples.

    Raises
    ------
    TypeError, ValueError
        If `wave_vectors` are not integers, twice the same, or not of the scene's dimension.

    Notes
    -----
    .. math:: \rho_k = N^{-1/2} \sum e^{i k\cdot r}, \qquad j_k = N^{-1/2} \sum v\, e^{i k\cdot r}

    The density correlation starts at S(k), each current correlation at k_B T/m. Segments join as
    those of `Correlator` do. Where the fluid has an energy, that of the particles (thermal and
    kinetic) makes waves as well: three more functions.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> currents = sdpd.CurrentCorrelator([(1, 0), (0, 1)], every=2, points=8, levels=1)
    >>> sdpd.Simulation(scene, seed=1).run(steps=200, observe=currents)
    >>> [shell] = currents.correlations(n_blocks=8)
    >>> shell.transverse.lag.size
    8
    """

    between_walls: ClassVar[bool] = False

    def __init__(
        self,
        wave_vectors: ArrayLike,
        *,
        every: int | None = None,
        points: int = 64,
        levels: int = 4,
    ) -> None:
        super().__init__(every=every, points=points, levels=levels)
        self.wave_vectors = _integers(wave_vectors)
        self._lengths: NDArray[np.float64] = np.zeros(0)
        self._columns = 5

    def check(self, sim: Simulation, every: int, dt: float) -> None:
        """Refuse another simulation, other lags, and vectors of another dimension."""
        super().check(sim, every, dt)
        if self.wave_vectors.shape[1] != sim.scene.dimension:
            raise ValueError(
                f"`wave_vectors` must have shape (K, {sim.scene.dimension}), got "
                f"{self.wave_vectors.shape}"
            )

    def _attach(self, sim: Simulation, every: int) -> Any:
        self._lengths = np.asarray(sim.scene.box.lengths, dtype=np.float64)
        self._columns = 8 if sim.scene.active_effects.energy else 5
        vectors = self.wave_vectors.tolist()
        return sim._core.attach_currents(every, vectors, self.points, self.levels)

    def correlations(self, *, n_blocks: int = BLOCKS) -> list[CurrentCorrelations]:
        """The correlation functions so far, one set for each |k|, ascending.

        Parameters
        ----------
        n_blocks : int
            Blocks of time behind the standard errors, >= 2; lags longer than a block are left out.

        Returns
        -------
        list of sdpd.analysis.CurrentCorrelations
            At lags that are equally spaced on the first level only.

        Raises
        ------
        ValueError
            If nothing was sampled yet.
        """
        from sdpd.analysis.currents import CurrentCorrelations

        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        counts = groups[..., 0]
        columns = groups[..., 1:].reshape(*counts.shape, len(self.wave_vectors), self._columns)
        length = np.linalg.norm(2.0 * np.pi * self.wave_vectors / self._lengths, axis=1)
        name = np.round(length / length.min(), 9)
        result = []
        for value in np.unique(name):
            chosen = np.flatnonzero(name == value)
            mean = columns[:, :, chosen].mean(axis=2)
            functions = [
                self._as_correlation(
                    mean[..., column],
                    counts,
                    longest,
                    dimension=max(1, self._dimension - 1) if column == 2 else 1,
                )
                for column in range(self._columns)
            ]
            result.append(
                CurrentCorrelations(float(length[chosen[0]]), self.wave_vectors[chosen], *functions)
            )
        return result


def _integers(value: ArrayLike) -> NDArray[np.int64]:
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise TypeError(f"`wave_vectors` must be integers, got dtype {array.dtype}")
    if array.ndim != 2 or array.shape[0] == 0 or array.shape[1] not in (2, 3):
        raise ValueError(f"`wave_vectors` must have shape (K, 2) or (K, 3), got {array.shape}")
    vectors = array.astype(np.int64)
    if not vectors.any(axis=1).all():
        raise ValueError("`wave_vectors` must not be 0, got one that is")
    if np.abs(vectors).max() > 10_000:
        raise ValueError(f"`wave_vectors` must be at most 10000, got {np.abs(vectors).max()}")
    turned = {min(tuple(v), tuple(-v)) for v in vectors.tolist() for v in [np.array(v)]}
    if len(turned) != len(vectors):
        raise ValueError("`wave_vectors` must hold k or -k once, got one twice")
    return vectors
