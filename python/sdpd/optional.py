"""Libraries that are imported only where they are used."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["need"]


def need(module: str, extra: str, purpose: str) -> Any:
    """The module, imported now.

    Raises
    ------
    ImportError
        If it is not installed; the text names the extra of this package that brings it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(
            f"{package} is needed {purpose}: pip install 'sdpd[{extra}]' ({error})", name=package
        ) from error
