"""Files of a study of effects."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sdpd.effects_study.results import Study

__all__ = ["write"]


def write(study: Study, folder: str | os.PathLike[str]) -> list[Path]:
    """Write effects.json, all of it, and effects.txt, what is printed.

    The folder is made if need be.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / "effects.json", target / "effects.txt"]
    paths[0].write_text(json.dumps(study.to_dict(), indent=1) + "\n", encoding="utf-8")
    paths[1].write_text(f"{study}\n", encoding="utf-8")
    return paths
