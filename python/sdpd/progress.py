"""Progress bars: on a terminal or in a notebook, once the work takes more than two seconds."""

from __future__ import annotations

import sys
import time
import warnings
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["RunProgress", "wanted"]

DELAY = 2.0  # seconds before an automatic bar appears


def _in_notebook() -> bool:
    module = sys.modules.get("IPython")
    shell = None if module is None else module.get_ipython()
    return type(shell).__name__ == "ZMQInteractiveShell"


def wanted(progress: bool | None) -> bool:
    """Whether to show progress: as told, or (None) where somebody is likely to look."""
    if progress is not None:
        return progress
    return _in_notebook() or bool(getattr(sys.stderr, "isatty", bool)())


def bar(*, total: int, progress: bool | None, **options: Any) -> Any:
    """A tqdm bar of the kind that fits where we run; it stays away where nobody wants it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # tqdm's advice to install notebook widgets
        if _in_notebook():
            from tqdm.auto import tqdm
        else:
            from tqdm import tqdm
    delay = DELAY if progress is None else 0.0
    absent = not wanted(progress)
    return tqdm(total=total, delay=delay, dynamic_ncols=True, disable=absent, **options)


class RunProgress:
    """Steps of a run with the simulated time and the rate in particle-steps per second."""

    def __init__(self, steps: int, n_particles: int, progress: bool | None) -> None:
        self._n_particles = n_particles
        self._done = 0
        self._began = time.perf_counter()
        shown = steps > 0 and wanted(progress)
        self._bar = (
            bar(total=steps, progress=progress, unit="step", unit_scale=True) if shown else None
        )

    def __enter__(self) -> Self:
        return self

    def update(self, steps: int, simulated_time: float) -> None:
        """Count steps done."""
        self._done += steps
        if self._bar is None:
            return
        seconds = max(time.perf_counter() - self._began, 1e-9)
        rate = self._done * self._n_particles / seconds
        text = f"t = {simulated_time:.4g}, {rate:.3g} particle-steps/s"
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(steps)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
