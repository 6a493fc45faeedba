"""The command ``sdpd``: the main job, and a look at scenes without writing Python."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from sdpd.commands.shared import FAILED, INTERRUPTED, REFUSED
from sdpd.errors import SdpdWarning, SimulationError

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process if None.

    Returns
    -------
    int
        0, or 1 if a criterion or a run failed, 2 for bad arguments, 130 after Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # Greek letters on a terminal that knows none
            stream.reconfigure(errors="replace")
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            warnings.simplefilter("always", SdpdWarning)
            return int(options.run(options))
    except BrokenPipeError:
        # Whoever reads, `head` say, has seen enough; Python must not try to flush the rest.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, TypeError, OSError, ImportError) as error:
        print(f"sdpd {options.command}: {error}", file=sys.stderr)
        return REFUSED
    except SimulationError as error:
        print(f"sdpd {options.command}: the run blew up: {error}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print(f"sdpd {options.command}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _show_warning(message: Any, category: type[Warning], *_: Any, **__: Any) -> None:
    print(f"sdpd: {category.__name__}: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    from sdpd import __version__
    from sdpd.commands import accuracy, bench, effects, fields, lists, scenes, studies

    parser = argparse.ArgumentParser(
        prog="sdpd",
        description="Fluctuating hydrodynamics with particles (SDPD). `sdpd diffusion` is the main "
        "job.",
    )
    parser.add_argument("--version", action="version", version=f"sdpd {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in (studies, bench, effects, accuracy, scenes, fields, lists):
        module.add_to(commands)
    return parser
