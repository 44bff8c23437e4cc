"""Write the table of logs that are read into docs/how-to/read-logs.md, or with --check report if it is stale.

A format stands once, in `tumble.foundation.log_formats`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from made_files import ROOT, page_with, write_or_check

from tumble.foundation.log_formats import LOG_FORMATS

PAGE = ROOT / "docs" / "how-to" / "read-logs.md"


def table() -> Iterator[str]:
    """Returns the lines of the table."""
    yield "| format | what | endings | magnetometer | needs | example |"
    yield "|---|---|---|---|---|---|"
    for each in LOG_FORMATS:
        endings = " ".join(f"`{ending}`" for ending in each.endings)
        needs = f"`tumble-imu[{each.extra}]`" if each.extra else ""
        cells = (each.name, each.what, endings, each.magnetometer, needs, f"`{each.example}`")
        yield f"| {' | '.join(cells)} |"


def made() -> Iterator[tuple[Path, str]]:
    """Returns the page with the table in its place."""
    yield PAGE, page_with(PAGE, "formats", "".join(f"{line}\n" for line in table()))


if __name__ == "__main__":
    sys.exit(write_or_check(made(), __doc__, __file__))
