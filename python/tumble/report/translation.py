"""Translation of a whole page: every text between its tags, and those that only a screen reader speaks."""

from __future__ import annotations

import html
import re
from collections.abc import Collection
from dataclasses import dataclass

from tumble.foundation.translation import ENGLISH, language, translated

INLINE_TAGS = ("b", "i", "em", "code")
"""Tags within a sentence; a sentence with them is one text of the catalogue, in which they stand."""

_STYLE = re.compile(r"(<style>.*?</style>)", re.DOTALL)
_TAG = re.compile(r"(<[^>]*>)")
_SPOKEN = re.compile(r'\b(aria-label|title|alt)="([^"]*)"')
_SENTENCE_TAG = re.compile(rf"</?(?:{'|'.join(INLINE_TAGS)})>")


def translated_page(page: str, names: Collection[str], context: str = "") -> str:
    """Returns a page of HTML in the language of the context; `names` are texts that stay unchanged.

    `context` is the one of the page in the catalogue, for words that mean another thing elsewhere. Tags and
    styles stay unchanged, byte for byte. Pages are made in English.
    """
    if language() == ENGLISH:
        return page
    parts = _STYLE.split(page)
    words = _Words(names, context)
    return "".join(part if part.startswith("<style>") else words.body(part) for part in parts)


@dataclass(frozen=True, slots=True)
class _Words:
    names: Collection[str]
    context: str

    def body(self, source: str) -> str:
        """Translates a piece of a page."""
        shown, sentence = [], ""
        for part in _TAG.split(source):
            if part.startswith("<") and not _SENTENCE_TAG.fullmatch(part):
                shown += [self._sentence(sentence), _SPOKEN.sub(_spoken, part)]
                sentence = ""
            else:
                sentence += part
        return "".join([*shown, self._sentence(sentence)])

    def _sentence(self, source: str) -> str:
        """Translates the text between two tags as a whole, or else between the tags in it."""
        if "<" not in source:
            return self._text(source)
        plain = " ".join(source.split())
        found = translated(plain)
        if found != plain:
            return found
        return "".join(part if part.startswith("<") else self._text(part) for part in _TAG.split(source))

    def _text(self, source: str) -> str:
        text = html.unescape(source)
        body = " ".join(text.split())
        if not body or (body in self.names and " " not in body):
            return source
        found = translated(body, context=self.context)
        found = translated(body) if found == body else found
        if found == body:
            return source
        begin = len(text) - len(text.lstrip())
        end = len(text.rstrip())
        return html.escape(f"{text[:begin]}{found}{text[end:]}", quote=False)


def _spoken(found: re.Match[str]) -> str:
    return f'{found[1]}="{html.escape(translated(html.unescape(found[2])))}"'
