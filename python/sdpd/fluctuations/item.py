"""One quantity beside its prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdpd.analysis import Estimate

__all__ = ["SHELLS", "Item"]

SHELLS = 6  # shells shown one by one


@dataclass(frozen=True, kw_only=True)
class Item:
    """One quantity.

    Attributes
    ----------
    group, name : str
    estimate : Estimate
        Reduced [1]; blocks of one run.
    prediction : float
        [1].
    accuracy : float
        Of the prediction itself, absolute [1]; 0 where theory is exact.
    unit : float or None
        What a fault is relative to [1]; the prediction if None.
    """

    group: str
    name: str
    estimate: Estimate
    prediction: float
    accuracy: float = 0.0
    unit: float | None = None

    @property
    def scale(self) -> float:
        """What a fault is relative to [1]."""
        return abs(self.prediction) if self.unit is None else self.unit

    @property
    def exact(self) -> bool:
        """Whether theory is exact at any time step."""
        return self.accuracy == 0.0

    @property
    def z(self) -> float:
        """Distance from the prediction in standard errors."""
        return self.estimate.z(self.prediction)

    @property
    def p(self) -> float:
        """Two-sided probability of a distance beyond the accuracy of theory, by Student's t."""
        away = self.estimate.value - self.prediction
        beyond = np.sign(away) * max(0.0, abs(away) - self.accuracy)
        return self.estimate.p(self.estimate.value - float(beyond))

    def visible(self, threshold: float) -> float:
        """Smallest relative fault that is beyond `threshold` standard errors and the accuracy."""
        return (self.accuracy + threshold * self.estimate.stderr) / self.scale
