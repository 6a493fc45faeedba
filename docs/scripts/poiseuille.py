"""Transient Poiseuille flow without noise against its series (Yang 2013, section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence

import channel


def main(argv: Sequence[str] | None = None) -> None:
    channel.main("poiseuille", __doc__, argv)


if __name__ == "__main__":
    main()
