"""Catalogues of translated texts: files of gettext, looked up by text or by the template it was made of."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import TypeAlias

from tumble.foundation.bounded_json import parse_json
from tumble.foundation.file_reading import own_text
from tumble.foundation.template import PLACE, filled

FOLDER = Path(__file__).parents[1] / "locale"
NAMED = frozenset({"name", "names", "path", "file", "folder", "log", "about", "serial", "page", "pages"})
"""Places that hold names: a single word stays as it is, unless the catalogue has it."""

SEAM = "seam"
"""Context of the seams between the parts of a text."""
PART = "part"
"""Context of parts that texts are put together from while they are made, so that no source has them whole."""
TERM = "term"
"""Context of the terms that names are made of, such as those of `gyroscope scale x`."""

_WORD = re.compile(r"[A-Za-z]{2}")
_SAME = re.compile(
    r"\b(?:[mµn]?rad|deg|ppm|Hz|Tumble|[xyz]{2}|[A-Z]{2,})\b|--[\w-]+|[\w.+-]*(?:[\d_/]|\.\w)[\w.+/-]*"
)
"""Units, options, names of units and files, and abbreviations, which are the same in every language."""
_COUNT = r"[0-9][0-9.,]*"
_OF_A_SENTENCE = r"(?:(?!\. [A-Z]).)*?"
_OF_A_CLAUSE = r"(?:(?!\. [A-Z]|, |; |: |\(|\)).)*?"
"""Contents of a place in a template that has several clauses itself, or too few letters to be known by."""
_FEW_LETTERS = 12
_SENTENCES = re.compile(r"[.}] [A-Z{]")
"""Seam of a template of several sentences."""
_SEAMS = ("\n", "  ", "] ", ". ", ": ", "; ", ", ", " or its ", " and ", " or ")
"""Seams at which a text is taken apart that is several texts, widest first."""
_BRACKETED = re.compile(r"(.*?) ?\((.*)\)", re.DOTALL)
_ENDS = (".", ":", ";")
_CONTINUED = (", ", "; ")
"""Seams with which texts begin that continue another."""
_MOST_STEPS = 2000
"""Steps to find one text; our longest take a third of it."""
_LETTERS_A_STEP = 64
_LONGEST_FILLED = 600
"""Letters of a text that may be made of a template; our longest have two thirds of it."""
_BETWEEN_CHINESE = re.compile(r"(?<=[\u3400-\u9fff]) (?=[\u3400-\u9fff])")


@dataclass(frozen=True, slots=True)
class CatalogueText:
    """One text of a catalogue."""

    text: str
    translation: str
    context: str = ""
    plural: str = ""
    """The text for several, where it is another; Chinese has one translation for both."""
    fuzzy: bool = False


@dataclass(frozen=True)
class _Template:
    text: str
    translation: str
    wanted: str
    """Pattern of what may stand in a place."""

    @cached_property
    def literals(self) -> Sequence[str]:
        """Parts between the places."""
        return PLACE.split(self.text)[::2]

    @cached_property
    def landmark(self) -> str:
        """Longest literal part, which every text made of the template holds."""
        return max(self.literals, key=len)

    def match(self, body: str) -> re.Match[str] | None:
        """Returns the match of a text that is made of it."""
        is_near = self.landmark in body and len(body) <= _LONGEST_FILLED and self._has_literals(body)
        return self.pattern.fullmatch(body) if is_near else None

    def _has_literals(self, body: str) -> bool:
        """Looks for the literals one behind the other; without that, a pattern may try for hours to fit."""
        first, *inner, last = self.literals
        at = len(first) if body.startswith(first) else -1
        for literal in inner:
            at = at if at < 0 else body.find(literal, at) + len(literal)
            at = at if at >= len(literal) else -1
        return 0 <= at <= len(body) - len(last) and body.endswith(last)

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """Pattern of the texts made of it; to compile all of a catalogue takes longer than a command."""
        literals = self.literals
        pattern, seen = re.escape(literals[0]), set[str]()
        for name, literal in zip(PLACE.findall(self.text), literals[1:], strict=True):
            place = _COUNT if name == "count" else self.wanted
            pattern += f"(?P={name})" if name in seen else f"(?P<{name}>{place})"
            pattern += re.escape(literal)
            seen.add(name)
        return re.compile(pattern, re.DOTALL)


_steps: ContextVar[list[int] | None] = ContextVar("steps", default=None)
"""Steps that the search of a text may still take, as an only item."""


class _TooManyStepsError(Exception):
    """A text has more parts than any of ours."""


def _count_steps(part: str) -> None:
    """Counts the steps to look a part up, which grow with its length."""
    left = _steps.get()
    assert left, "a search has begun"
    left[0] -= 1 + len(part) // _LETTERS_A_STEP
    if left[0] < 0:
        raise _TooManyStepsError


FindPart: TypeAlias = Callable[[str], "str | None"]
"""Finds the translation of a part of a text, or None."""


class Catalogue:
    """Texts of one language."""

    def __init__(self, entries: Iterable[CatalogueText]) -> None:
        texts: dict[tuple[str, str], str] = {}
        for entry in entries:
            if entry.translation and not entry.fuzzy:
                context = "" if entry.context == PART else entry.context
                for text in filter(None, (entry.text, entry.plural)):
                    texts[context, text] = entry.translation
                    if text.startswith(_CONTINUED):
                        texts.setdefault((context, text[2:]), entry.translation[1:])
        self._texts = texts
        self._found = lru_cache(maxsize=4096)(self._find)
        self._complete = lru_cache(maxsize=8192)(self._find_complete)

    def translated(self, text: str, context: str = "", values: Mapping[str, object] | None = None) -> str:
        """Returns the translation of a text or of its parts; the text itself where there is none."""
        if values:
            found = self._texts.get((context, text))
            return filled(text, values) if found is None else self._filled(found, values)
        found = self._searched(text, context) if _WORD.search(text) else None
        return text if found is None else found

    def _searched(self, text: str, context: str) -> str | None:
        """Finds a text in a bounded number of steps: one from outside may be parted in ever so many ways."""
        token = None if _steps.get() else _steps.set([_MOST_STEPS])
        try:
            return self._found(text, context)
        except _TooManyStepsError:
            return None
        finally:
            if token is not None:
                _steps.reset(token)

    def _find(self, text: str, context: str) -> str | None:
        """Finds all of a text, else by a template that holds what is unknown, else some parts of it."""
        _count_steps(text)
        text = text.strip()
        if context:
            return self._texts.get((context, text))
        found = self._complete(text)
        if found is None:
            found = self._by_template(text, self._loose_templates, self._as_far)
        if found is None:
            found = self._by_parts(text, self._complete, self._as_far)
        if found is None:
            found = self._by_parts(text, self._as_far, self._complete)
        if found is None:
            found = self._by_parts(text, self._as_far, self._as_far)
        return found

    def _find_complete(self, text: str) -> str | None:
        """Finds a text by itself, by its template, by its parts, or by the terms it consists of."""
        _count_steps(text)
        if not _WORD.search(_SAME.sub("", text)):
            return f"{text[:-1]}{self._seam(text[-1])}" if text.endswith((":", ";")) else text
        found = self._by_template(text, self._templates, self._complete)
        found = self._by_parts(text, self._complete, self._complete) if found is None else found
        return self._by_terms(text) if found is None else found

    def _as_far(self, text: str) -> str | None:
        return self._found(text, "") or text

    def _by_template(self, text: str, templates: Sequence[_Template], part: FindPart) -> str | None:
        """Finds a text in any case of its first letter, and by `part` all that stands in its places."""
        for body in dict.fromkeys((text, text[:1].lower() + text[1:], text[:1].upper() + text[1:])):
            if (found := self._texts.get(("", body))) is not None:
                return found
            for template in templates:
                match = template.match(body)
                if match and (found := self._made_of(template, match.groupdict(), part)) is not None:
                    return found
        return None

    def _made_of(self, template: _Template, values: Mapping[str, str], part: FindPart) -> str | None:
        found = {
            name: value if name in NAMED and " " not in value else part(value)
            for name, value in values.items()
        }
        if any(value is None or value.endswith(_ENDS) for value in found.values()):
            return None
        return self._filled(template.translation, found)

    def _by_parts(self, text: str, find_first: FindPart, find_rest: FindPart) -> str | None:
        """Translates a text that consists of several; None where no way to part it leads to both parts."""
        for first, seam, rest in _partings(text):
            ended = find_first(first + seam[0]) if seam[0] in _ENDS else None
            is_ended = ended not in (None, first + seam[0])
            own, other = ended if is_ended else find_first(first), find_rest(rest)
            if own and other and (own, other) != (first, rest):
                return f"{own}{'' if is_ended else self._seam(seam)}{other}"
        if (bracketed := _BRACKETED.fullmatch(text)) is not None:
            own, other = find_first(bracketed[1]) if bracketed[1] else "", find_rest(bracketed[2])
            if own is not None and other and (own, other) != bracketed.groups():
                return f"{own}{self._seam(' (')}{other}{self._seam(')')}"
        if text.endswith(_ENDS) and (found := find_first(text[:-1])) not in (None, text[:-1]):
            return f"{found}{self._seam(text[-1])}"
        return None

    def _by_terms(self, text: str) -> str | None:
        """Translates a name that consists of terms, numbers and units."""
        found, count = self._terms.subn(lambda term: self._texts[TERM, term[0].lower()], text)
        if not count or _WORD.search(_SAME.sub("", found)):
            return None
        return _BETWEEN_CHINESE.sub("", found)

    def _seam(self, seam: str) -> str:
        return self._texts.get((SEAM, seam), seam)

    def _filled(self, translation: str, values: Mapping[str, object]) -> str:
        return _BETWEEN_CHINESE.sub("", filled(translation, values, self._value))

    def _value(self, place: str, given: object) -> str:
        value = str(given)
        if _is_name(place, value):
            return self._texts.get(("", value), value)
        return self.translated(value)

    @cached_property
    def _templates(self) -> Sequence[_Template]:
        """Templates whose places hold no end of a sentence, and of some no more than a clause."""
        return self._made(
            lambda text: _OF_A_CLAUSE if _is_vague(text) or re.search("[,;:] ", text) else _OF_A_SENTENCE
        )

    @cached_property
    def _loose_templates(self) -> Sequence[_Template]:
        """Templates whose places hold anything, of a single sentence nothing beyond it."""
        return self._made(
            lambda text: "" if _is_vague(text) else ".*?" if _SENTENCES.search(text) else _OF_A_SENTENCE
        )

    def _made(self, wanted: Callable[[str], str]) -> Sequence[_Template]:
        texts = {
            text: own for (context, text), own in self._texts.items() if not context and PLACE.search(text)
        }
        ordered = sorted(texts, key=lambda text: -len(PLACE.sub("", text)))
        return [_Template(text, texts[text], wanted(text)) for text in ordered if wanted(text)]

    @cached_property
    def _terms(self) -> re.Pattern[str]:
        terms = sorted((text for context, text in self._texts if context == TERM), key=len, reverse=True)
        return re.compile(rf"\b(?:{'|'.join(map(re.escape, terms))})\b", re.IGNORECASE)


def _partings(text: str) -> Iterator[tuple[str, str, str]]:
    """Returns each way to part a text at a seam: the widest seam first, the longest first part first."""
    for seam in _SEAMS:
        place = text.rfind(seam)
        while place > 0:
            yield text[:place], seam, text[place + len(seam) :]
            place = text.rfind(seam, 0, place)


def _is_name(place: str, value: str) -> bool:
    return place in NAMED and " " not in value


def _is_vague(text: str) -> bool:
    return len(re.findall("[A-Za-z]", PLACE.sub("", text))) < _FEW_LETTERS


@cache
def catalogue(code: str) -> Catalogue:
    """Returns the catalogue of a language, which is read once."""
    return Catalogue(read_catalogue(catalogue_path(code)))


def catalogue_path(code: str) -> Path:
    """Returns where the catalogue of a language stands, by the rules of gettext."""
    return FOLDER / code.replace("-", "_") / "LC_MESSAGES" / "tumble.po"


def read_catalogue(path: Path) -> Iterator[CatalogueText]:
    """Reads a file of gettext as babel writes it, without the entry that describes the file.

    Source: https://www.gnu.org/software/gettext/manual/html_node/PO-Files.html.
    """
    for block in own_text(path).split("\n\n"):
        fields: dict[str, str] = {}
        key, fuzzy = "", False
        for line in block.splitlines():
            if line.startswith("#"):
                fuzzy = fuzzy or (line.startswith("#,") and "fuzzy" in line)
                continue
            if line and not line.startswith('"'):
                key, _, line = line.partition(" ")
                fields[key] = ""
            if line:
                fields[key] += parse_json(line)
        if fields.get("msgid"):
            yield CatalogueText(
                fields["msgid"],
                fields.get("msgstr", fields.get("msgstr[0]", "")),
                fields.get("msgctxt", ""),
                fields.get("msgid_plural", ""),
                fuzzy,
            )
