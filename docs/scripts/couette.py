"""Transient Couette flow without noise against its series (Yang 2013, section 3.2)."""

from __future__ import annotations

from collections.abc import Sequence

import channel


def main(argv: Sequence[str] | None = None) -> None:
    channel.main("couette", __doc__, argv)


if __name__ == "__main__":
    main()
