"""Remarks in files of other programs, where the format of a file has a place for them."""

from __future__ import annotations

import json
from collections.abc import Sequence

_COMMENTS = {
    ".param": "# {}",
    ".params": "# {}",
    ".txt": "# {}",
    ".yaml": "# {}",
    ".param.yaml": "# {}",
    ".h": "/* {} */",
}
"""How a line of a file that ends so is made a comment."""
_HEAD = ("%", "---", "#", "//", "/*")
"""Begin lines before which nothing may stand, and the comments that a file begins with."""
_JSON_COMMENT = "comment"


def with_remarks(content: str, ending: str, remarks: Sequence[str]) -> str | None:
    """Write remarks into the head of a file with that ending; None where its format has no place for them."""
    lines = [" ".join(each.split()).replace("*/", "* /") for each in remarks]
    if ending == ".json":
        return _in_json(content, lines)
    comment = _COMMENTS.get(ending)
    if comment is None:
        return None
    whole = content.splitlines(keepends=True)
    place = next((k for k, line in enumerate(whole) if not line.startswith(_HEAD)), len(whole))
    # A comment over several lines ends in the last of them.
    if place and whole[0].startswith("/*") and "*/" not in whole[0]:
        place = next(k for k, line in enumerate(whole, start=1) if "*/" in line)
    return "".join([*whole[:place], *(f"{comment.format(line)}\n" for line in lines), *whole[place:]])


def _in_json(content: str, lines: Sequence[str]) -> str | None:
    found = json.loads(content)
    if not isinstance(found, dict) or not isinstance(found.get(_JSON_COMMENT), str):
        return None
    found[_JSON_COMMENT] = "; ".join([found[_JSON_COMMENT], *lines])
    return json.dumps(found, indent=2) + "\n"
