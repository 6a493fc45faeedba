"""``python -m sdpd`` is the command ``sdpd``."""

from __future__ import annotations

import sys

from sdpd.cli import main

if __name__ == "__main__":
    sys.exit(main())
