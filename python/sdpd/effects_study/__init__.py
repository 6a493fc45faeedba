"""What each effect changes in a scene, beside what it costs; ``sdpd effects``.

`compare_effects` runs a scene briefly with each effect on and off, from the same seeds, and times
both by turns. Whether a scene calls for an effect is said beforehand by `Scene.regime`.
"""

from __future__ import annotations

from sdpd.effects_study.figures import plot, write_figure
from sdpd.effects_study.files import write
from sdpd.effects_study.results import Change, Comparison, Study
from sdpd.effects_study.study import compare_effects
from sdpd.effects_study.variants import EFFECTS

__all__ = [
    "EFFECTS",
    "Change",
    "Comparison",
    "Study",
    "compare_effects",
    "plot",
    "write",
    "write_figure",
]
