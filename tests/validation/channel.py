"""The scripts of the docs that measure flows between walls, for the tests beside this file."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

SCRIPTS = Path(__file__).resolve().parents[2] / "docs" / "scripts"


def script(name: str) -> Any:
    """A script of docs/scripts as a module."""
    if str(SCRIPTS) not in sys.path:
        sys.path.insert(0, str(SCRIPTS))
    return importlib.import_module(name)
