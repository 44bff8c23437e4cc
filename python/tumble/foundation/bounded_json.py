"""JSON from anywhere: read in bounded time and depth whatever it holds, or a `JsonError`; and lines of it.

The library leaves five doors open: nesting that exhausts the stack, of its own or of whoever walks through
what it returned; numbers of millions of digits, which take minutes; numbers that are not finite, which JSON
does not have; a key given twice, of which readers take different ones; and three kinds of errors.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

from tumble.foundation.words import quoted

DEEPEST = 64
"""Levels of nesting."""
MOST_DIGITS = 64
"""Characters of a whole number; what is longer is no quantity of ours."""
_OPENING, _BRACKETS = b"[{", b"[]{}"
_OTHERS = bytes(set(range(256)) - {*_BRACKETS})


class JsonError(ValueError):
    """Text that is no JSON, or deeper or longer than any of ours."""


def parse_json(content: str | bytes, *, only_finite: bool = True) -> Any:  # noqa: ANN401 - JSON is anything
    """Returns what JSON stands for; raises `JsonError`, which states the line where that is known.

    Without `only_finite`, `NaN`, `Infinity` and `1e999` are numbers too, as sensors of some programs state.
    """
    others: dict[str, Any] = {"parse_float": _finite, "parse_constant": _finite} if only_finite else {}
    try:
        found = json.loads(content, parse_int=_integer, object_pairs_hook=_mapping, **others)
    except RecursionError:
        raise JsonError(_TOO_DEEP) from None
    except json.JSONDecodeError as error:
        raise JsonError(f"line {error.lineno}: {error.msg}") from None
    except ValueError as error:
        raise JsonError(str(error)) from None
    if _may_be_deep(content) and any(level > DEEPEST for level in _levels(found)):
        raise JsonError(_TOO_DEEP)
    return found


def json_line(content: object) -> str:
    """Prints plain data on one line; names of files that are no UTF-8 read back as they are."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return _SURROGATE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


_SURROGATE = re.compile("[\ud800-\udfff]")
_TOO_DEEP = f"is nested more than {DEEPEST} levels deep"


def _integer(digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        raise JsonError(f"a number of {len(digits)} characters; {MOST_DIGITS} at most")
    return int(digits)


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise JsonError(f"{quoted(text)} is no finite number")
    return number


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        twice = next(key for key, times in Counter(key for key, _ in pairs).items() if times > 1)
        raise JsonError(f"key {quoted(twice)} is given twice")
    return found


def _may_be_deep(content: str | bytes) -> bool:
    """Returns False where there are too few brackets open at a time, those in text among them."""
    encoded = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
    level = deepest = 0
    for bracket in encoded.translate(None, _OTHERS):
        level += 1 if bracket in _OPENING else -1
        deepest = max(deepest, level)
    return deepest > DEEPEST or level != 0


def _levels(found: object) -> Iterator[int]:
    """Yields the level of each list and mapping, the outermost 1."""
    waiting = [(found, 1)]
    while waiting:
        value, level = waiting.pop()
        if isinstance(value, dict | list):
            yield level
            inner = value.values() if isinstance(value, dict) else value
            waiting += [(each, level + 1) for each in inner]
