"""Translation of a whole page: every text between its tags, and those that only a screen reader speaks."""

from __future__ import annotations

import html
import re
from collections.abc import Collection

from tumble.foundation.translation import ENGLISH, language, translated

INLINE_TAGS = ("b", "i", "em", "code")
"""Tags within a sentence; a sentence with them is one text of the catalogue, in which they stand."""

_STYLE = re.compile(r"(<style>.*?</style>)", re.DOTALL)
_TAG = re.compile(r"(<[^>]*>)")
_SPOKEN = re.compile(r'\b(aria-label|title|alt)="([^"]*)"')
_SENTENCE_TAG = re.compile(rf"</?(?:{'|'.join(INLINE_TAGS)})>")


def translated_page(page: str, names: Collection[str]) -> str:
    """Returns a page of HTML in the language of the context; `names` are texts that stay as they are.

    Everything in it that is no text stays as it is, byte for byte. English is what pages are made in.
    """
    if language() == ENGLISH:
        return page
    parts = _STYLE.split(page)
    return "".join(part if part.startswith("<style>") else _body(part, names) for part in parts)


def _body(source: str, names: Collection[str]) -> str:
    shown, sentence = [], ""
    for part in _TAG.split(source):
        if part.startswith("<") and not _SENTENCE_TAG.fullmatch(part):
            shown += [_sentence(sentence, names), _SPOKEN.sub(_spoken, part)]
            sentence = ""
        else:
            sentence += part
    return "".join([*shown, _sentence(sentence, names)])


def _sentence(source: str, names: Collection[str]) -> str:
    """Translates what stands between two tags: as one text, or else what stands between tags in it."""
    if "<" not in source:
        return _text(source, names)
    plain = " ".join(source.split())
    found = translated(plain)
    if found != plain:
        return found
    return "".join(part if part.startswith("<") else _text(part, names) for part in _TAG.split(source))


def _text(source: str, names: Collection[str]) -> str:
    text = html.unescape(source)
    body = " ".join(text.split())
    if not body or body in names:
        return source
    found = translated(body)
    if found == body:
        return source
    begin = len(text) - len(text.lstrip())
    end = len(text.rstrip())
    return html.escape(f"{text[:begin]}{found}{text[end:]}", quote=False)


def _spoken(found: re.Match[str]) -> str:
    return f'{found[1]}="{html.escape(translated(html.unescape(found[2])))}"'
