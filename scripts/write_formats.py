"""Write the table of logs that are read into docs/how-to/read-logs.md, or with --check say if it is stale.

A format stands once, in `tumble.log_formats`.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from tumble.log_formats import LOG_FORMATS

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "read-logs.md"
BLOCK = re.compile(r"(<!-- formats -->\n).*?(<!-- /formats -->)", re.DOTALL)


def table() -> Iterator[str]:
    """Give the lines of the table."""
    yield "| format | what | endings | needs | example |"
    yield "|---|---|---|---|---|"
    for each in LOG_FORMATS:
        endings = " ".join(f"`{ending}`" for ending in each.endings)
        needs = f"`tumble-imu[{each.extra}]`" if each.extra else ""
        yield f"| {each.name} | {each.what} | {endings} | {needs} | `{each.example}` |"


def main() -> int:
    """Write or check; the exit code is 1 where the page is out of date."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail where the page is stale")
    check = parser.parse_args().check
    text = PAGE.read_text(encoding="utf-8")
    rows = "".join(f"{line}\n" for line in table())
    printed = BLOCK.sub(lambda found: found[1] + rows + found[2], text)
    if printed == text and BLOCK.search(text):
        return 0
    if check:
        print(f"out of date: {PAGE.name}; run python scripts/write_formats.py", file=sys.stderr)
        return 1
    PAGE.write_text(printed, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
