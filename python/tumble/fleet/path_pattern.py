"""Patterns of paths with named parts: one expression for each, which takes no longer than a path is long.

Paths are matched from their end, and each part between two wildcards stands at the first place where it fits:
nothing that comes later makes another place better, so that no place is tried again. Names of files come from
others, and an expression that tries all ways takes hours for some of 250 letters.
"""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import count, dropwhile
from typing import Final, TypeAlias

_TOKEN: Final = re.compile(
    r"(?P<name>\{\w+\})|(?P<letters>\[(?:!(?:\][^\]]*|[^\]]+)|\][^\]]*|[^\]!][^\]]*)\])"
    r"|(?P<any>\*+)|(?P<one>\?)|(?P<text>[^{\[*?]+|.)",
    re.DOTALL,
)
"""Parts of a pattern between two slashes: a name, one of some letters, wildcards, and text."""
_FOLDERS: Final = "**"
"""Any folders, also none."""
_END: Final = r"(?=/|\Z)"
"""End of a part of a reversed path."""
_INNER: Final = re.compile(r"\(\?s:(.*)\)\\[zZ]", re.DOTALL)
"""Form of what `fnmatch` makes of a pattern."""


_Part: TypeAlias = Sequence[tuple[str, str]]
"""Kinds and texts of the tokens of one part of a path."""
_SAME: Final[tuple[_Part, ...]] = ([], [("text", ".")])
"""Parts of a pattern that lead nowhere."""


class PathPattern:
    """A pattern of a shell in which `{name}` stands for a part of a name that is not empty."""

    def __init__(self, text: str) -> None:
        protocol, is_url, path = text.partition("://") if "://" in text else ("", "", text)
        tokens = [
            [(str(each.lastgroup), each[0]) for each in _TOKEN.finditer(part)] for part in path.split("/")
        ]
        self.names = tuple(each[1:-1] for part in tokens for kind, each in part if kind == "name")
        """Names in their order."""
        self.wildcards = protocol + is_url + "/".join(map(_wide, tokens))
        """Pattern without names that fits all that this one fits, and maybe more."""
        # Files are looked for below the parts without wildcards, so that these fit.
        self._wild = [part for part in dropwhile(_is_text, tokens) if part not in _SAME]

    def facts_in(self, path: str) -> dict[str, str] | None:
        """Returns what the names stand for in a path that `wildcards` fits; None where this does not."""
        if not self._wild:
            return {}
        found = self._expression.match(path.replace(os.sep, "/")[::-1])
        return None if found is None else {name: found[name][::-1] for name in self.names}

    @cached_property
    def _expression(self) -> re.Pattern[str]:
        """Expression of reversed paths; only names of Python, each once, can be in one."""
        return re.compile(_reversed(self._wild))


def _is_text(part: _Part) -> bool:
    return all(kind == "text" for kind, _ in part)


def _is_folders(part: _Part) -> bool:
    return [text for _, text in part] == [_FOLDERS]


def _wide(part: _Part) -> str:
    """Returns a part as a shell has it; one wildcard stands for several, of which libraries try all ways."""
    if _is_folders(part):
        return _FOLDERS
    text = "".join("*" if kind in ("any", "name") else each for kind, each in part)
    if sum(kind in ("any", "name") for kind, _ in part) < 2:
        return text
    return ".*" if text.startswith(".") else "*"


def _reversed(parts: Sequence[_Part]) -> str:
    """Returns the expression of the end of a reversed path."""
    marks = count()
    runs: list[list[str]] = [[]]
    for part in parts:
        if _is_folders(part):
            runs.append([])
        else:
            runs[-1].append(_of_part(part, marks))
    last, *others = ["/".join(reversed(run)) for run in reversed(runs)]
    # `**` at the end stands for all files in any folders.
    expression = last or f"[^/]+{_END}"
    for other in filter(None, others):
        expression += "/" + _first(f"(?:[^/]*/)*?{other}", marks)
    return expression


def _of_part(part: _Part, marks: Iterator[int]) -> str:
    wildcards: list[str] = []
    blocks = [""]
    for kind, text in reversed(part):
        if kind in ("any", "name"):
            wildcards.append("[^/]*?" if kind == "any" else f"(?P<{text[1:-1]}>[^/]+?)")
            blocks.append("")
        else:
            blocks[-1] += _letters(kind, text)
    blocks[-1] += _END
    steps = (_first(wildcard + block, marks) for wildcard, block in zip(wildcards, blocks[1:], strict=True))
    return blocks[0] + "".join(steps)


def _letters(kind: str, text: str) -> str:
    """Returns the expression of a block of so many letters, reversed."""
    if kind == "text":
        return re.escape(text[::-1])
    found = _INNER.fullmatch(fnmatch.translate(text))
    assert found, "the form is that of Python 3.7 to 3.14"
    return f"(?:(?!/){found[1]})"


def _first(expression: str, marks: Iterator[int]) -> str:
    """Has an expression match once, at the first place where it fits: atomic groups came with Python 3.11."""
    mark = f"_{next(marks)}"
    return f"(?=(?P<{mark}>{expression}))(?P={mark})"
