"""Comments in files of other programs, and remarks where the format of a file has a place for them."""

from __future__ import annotations

import json
from collections.abc import Sequence

from tumble.foundation.bounded_json import parse_json

_COMMENTS = {
    ".param": "# {}",
    ".params": "# {}",
    ".txt": "# {}",
    ".yaml": "# {}",
    ".param.yaml": "# {}",
    ".h": "/* {} */",
}
"""Comment marks, by the ending of the file."""
_HEAD = ("%", "---", "#", "//", "/*")
"""Begin lines before which nothing may stand, and the comments that a file begins with."""
_JSON_COMMENT = "comment"
_LONGEST = 80
"""Characters of a name in a comment."""


def comment(text: str) -> str:
    """Returns text as part of a comment that ends with its line: printable characters, 80 at most."""
    line = _printable(text)
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3]}..."


def c_comment(text: str) -> str:
    """Returns text as part of a comment of C, which it neither ends nor continues on the next line."""
    return _within_c(comment(text))


def _printable(text: str) -> str:
    return "".join(each if each.isprintable() else " " for each in text)


def _within_c(line: str) -> str:
    return line.replace("\\", "/").replace("??", "? ?").replace("*/", "* /").replace("/*", "/ *")


def with_remarks(content: str, ending: str, remarks: Sequence[str]) -> str | None:
    """Writes remarks into the head of a file with that ending; None where its format has no remarks."""
    lines = [" ".join(_printable(each).split()) for each in remarks]
    if ending == ".json":
        return _in_json(content, lines)
    form = _COMMENTS.get(ending)
    if form is None:
        return None
    if form.endswith("*/"):
        lines = list(map(_within_c, lines))
    whole = content.splitlines(keepends=True)
    place = next((k for k, line in enumerate(whole) if not line.startswith(_HEAD)), len(whole))
    # A comment over several lines ends in the last of them.
    if place and whole[0].startswith("/*") and "*/" not in whole[0]:
        place = next(k for k, line in enumerate(whole, start=1) if "*/" in line)
    return "".join([*whole[:place], *(f"{form.format(line)}\n" for line in lines), *whole[place:]])


def _in_json(content: str, lines: Sequence[str]) -> str | None:
    found = parse_json(content)
    if not isinstance(found, dict) or not isinstance(found.get(_JSON_COMMENT), str):
        return None
    found[_JSON_COMMENT] = "; ".join([found[_JSON_COMMENT], *lines])
    return json.dumps(found, indent=2) + "\n"
