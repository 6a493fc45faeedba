"""Mean-square displacement and velocity autocorrelation inside the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdpd import validation

from .base import Array
from .lagged import BLOCKS, FEWEST, LaggedObserver

if TYPE_CHECKING:
    from sdpd.analysis.correlation import Correlation
    from sdpd.simulation import Simulation

__all__ = ["Correlator"]


class Correlator(LaggedObserver):
    """Mean-square displacement and velocity autocorrelation on logarithmic lags.

    No trajectory is kept: level l holds the last `points` samples taken every 2^l samples, so both
    functions are exact at every lag, at 48 `levels` `points` bytes a particle however long the run.

    Parameters
    ----------
    every : int, optional
        Steps between samples; that of the run if None.
    points : int
        Lags on the first level, even; half as many on each further one.
    levels : int
        The longest lag is ``(points - 1) 2^(levels - 1)`` samples.

    Notes
    -----
    Consecutive runs with the same observers and the same dt continue. After a run without it, with
    other observers, or after `Simulation.restore`, new time origins are taken: no lag spans the
    gap.

    References
    ----------
    .. [1] J. Ramirez et al., J. Chem. Phys. 133 (2010) 154103.

    Examples
    --------
    >>> import sdpd
    >>> scene = sdpd.Scene(
    ...     fluid=sdpd.fluids.water().in_plane(1e-9),
    ...     box=sdpd.Box((1e-8, 1e-8)),
    ...     resolution=sdpd.Resolution(particles=100),
    ... )
    >>> correlator = sdpd.Correlator(every=1, points=4, levels=2)
    >>> sdpd.Simulation(scene, seed=1).run(steps=20, observe=correlator)
    >>> correlator.data["lag"].tolist()
    [0, 1, 2, 3, 4, 6]
    """

    def __init__(self, *, every: int | None = None, points: int = 8, levels: int = 12) -> None:
        super().__init__(every=every, points=points, levels=levels)

    def _attach(self, sim: Simulation, every: int) -> Any:
        return sim._core.attach_correlator(every, self.points, self.levels)

    def correlation(self, kind: str = "vacf", *, n_blocks: int = BLOCKS) -> Correlation:
        """One of the functions with its blocks, for the estimators of `sdpd.analysis`.

        Parameters
        ----------
        kind : {"vacf", "msd"}
            ``<v(t).v(0)>/D`` [length^2/time^2], or ``<|r(t) - r(0)|^2>`` [length^2].
        n_blocks : int
            Blocks of time behind the standard error, >= 2; lags longer than a block are left out,
            so fewer blocks give longer lags.

        Returns
        -------
        sdpd.analysis.Correlation
            At lags that are not equally spaced.

        Raises
        ------
        ValueError
            If `kind` is unknown, or nothing was sampled yet.
        """
        validation.choice("kind", kind, ("vacf", "msd"))
        groups, longest = self._grouped(self._checked_blocks(n_blocks))
        sums = groups[..., 1] if kind == "msd" else groups[..., 2] / self._dimension
        return self._as_correlation(sums, groups[..., 0], longest, dimension=self._dimension)

    @property
    def data(self) -> NDArray[np.void]:
        """The functions so far, one row for each lag that has samples: a structured array.

        Fields are ``lag`` (in steps) [1], ``time`` of the lag [time], ``origins`` (number of time
        origins) [1], ``msd`` <|r(t) - r(0)|^2> summed over the components [length^2], ``vacf``
        <v(t).v(0)>/D [length^2/time^2], ``msd_stderr`` and ``vacf_stderr`` their standard errors:
        from 32 blocks of time, from 8 for lags longer than those, NaN for lags longer still.
        """
        kinds = [("lag", np.int64), ("time", float), ("origins", np.int64)]
        kinds += [(name, float) for name in ("msd", "vacf", "msd_stderr", "vacf_stderr")]
        blocks = self._blocks()
        if not len(blocks):
            return np.zeros(0, dtype=kinds)
        sums = blocks.sum(axis=0)
        seen = sums[:, 0] > 0
        sums, steps = sums[seen], self._lags[seen] * (self._every or 1)
        result = np.zeros(len(sums), dtype=kinds)
        result["lag"], result["origins"] = steps, sums[:, 0]
        result["time"] = steps * self._dt
        result["msd"] = sums[:, 1] / sums[:, 0]
        result["vacf"] = sums[:, 2] / sums[:, 0] / self._dimension
        for kind in ("msd", "vacf"):
            error = np.full(len(sums), np.nan)
            for n_blocks in (FEWEST, BLOCKS):  # the shorter lags once more, and better
                function = self.correlation(kind, n_blocks=n_blocks)
                error[: function.lag.size] = function.stderr
            result[f"{kind}_stderr"] = error
        return result

    @property
    def time(self) -> Array:
        """Lags [time]."""
        return np.asarray(self.data["time"])

    @property
    def msd(self) -> Array:
        """Mean-square displacement at each lag [length^2]."""
        return np.asarray(self.data["msd"])

    @property
    def vacf(self) -> Array:
        """Velocity autocorrelation at each lag [length^2/time^2]."""
        return np.asarray(self.data["vacf"])
