"""Files that are made from what stands elsewhere: written by a script, or with --check compared."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]


def write_or_check(made: Iterable[tuple[Path, str]], about: str | None, script: str) -> int:
    """Writes each file with its text, or with --check report which are stale; the exit code is then 1.

    `about` describes the script, for its help; `script` is its file.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--check", action="store_true", help="write nothing, fail where a file is stale")
    check = parser.parse_args().check
    stale = [(path, text) for path, text in made if not _holds(path, text)]
    if not check:
        for path, text in stale:
            path.write_text(text, encoding="utf-8")
    elif stale:
        names = ", ".join(path.relative_to(ROOT).as_posix() for path, _ in stale)
        print(f"out of date: {names}; run python scripts/{Path(script).name}", file=sys.stderr)
    return int(check and bool(stale))


def _holds(path: Path, text: str) -> bool:
    return path.is_file() and path.read_text(encoding="utf-8") == text


def page_with(page: Path, block: str, content: str) -> str:
    """Text of a page with that content, whole lines, between `<!-- BLOCK -->` and `<!-- /BLOCK -->`.

    Raises `ValueError` where the page has no such place.
    """
    begin, end = f"<!-- {block} -->\n", f"<!-- /{block} -->\n"
    head, rest = page.read_text(encoding="utf-8").split(begin)
    _, tail = rest.split(end)
    return head + begin + content + end + tail
