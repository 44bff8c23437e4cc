"""Catalogues of translated texts: files of gettext, looked up by text or by the template it was made of."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "locale"
PLACE = re.compile(r"\{(\w+)\}")
"""A place of a template; doubled braces are no part of our texts."""
VERBATIM = frozenset({"name", "names", "unit", "path", "file", "folder", "log", "about", "serial", "code"})
"""Places that hold names of the user, units or code, and stay as they are."""

_WORD = re.compile(r"[A-Za-z]{2}")
_COUNT = r"[0-9][0-9.,]*"
_SEAMS = (". ", "; ", ": ", ", ", " and ")
"""Seams at which a text is taken apart that is several texts, widest first."""
SEAM = "seam"
"""Context of the seams in a catalogue."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One text of a catalogue."""

    text: str
    translation: str
    context: str = ""
    plural: str = ""
    """The text for several, where it is another; Chinese has one translation for both."""
    fuzzy: bool = False


@dataclass(frozen=True, slots=True)
class _Template:
    pattern: re.Pattern[str]
    landmark: str
    """Longest literal part, which every text made of the template holds."""
    translation: str


class Catalogue:
    """Texts of one language."""

    def __init__(self, entries: Iterable[Entry]) -> None:
        texts: dict[tuple[str, str], str] = {}
        for entry in entries:
            if entry.translation and not entry.fuzzy:
                for text in filter(None, (entry.text, entry.plural)):
                    texts[entry.context, text] = entry.translation
        self._texts = texts
        self._found = lru_cache(maxsize=4096)(self._find)

    def translated(self, text: str, context: str = "", values: Mapping[str, object] | None = None) -> str:
        """Returns the translation of a text or of its parts; the text itself where there is none."""
        if values:
            found = self._texts.get((context, text))
            return text.format_map(values) if found is None else self._filled(found, values)
        if not _WORD.search(text):
            return text
        found = self._found(text, context)
        return text if found is None else found

    def _find(self, text: str, context: str) -> str | None:
        body = text.strip()
        found = self._texts.get((context, body))
        if found is None and not context:
            found = self._by_template(body) or self._by_parts(body)
        return None if found is None else text.replace(body, found)

    def _by_template(self, text: str) -> str | None:
        for template in self._templates():
            if template.landmark in text and (match := template.pattern.fullmatch(text)):
                return self._filled(template.translation, match.groupdict())
        return None

    def _by_parts(self, text: str) -> str | None:
        """Translates a text that consists of several, as far as one of them is known."""
        for seam in _SEAMS:
            first, found, rest = text.partition(seam)
            if found:
                parts = [self._found(part, "") for part in (first, rest)]
                if any(parts):
                    own = self._texts.get((SEAM, seam), seam)
                    return own.join(new or old for new, old in zip(parts, (first, rest), strict=True))
        return None

    def _filled(self, translation: str, values: Mapping[str, object]) -> str:
        return PLACE.sub(lambda place: self._value(place[1], values), translation)

    def _value(self, place: str, values: Mapping[str, object]) -> str:
        value = str(values[place])
        return value if place in VERBATIM else self.translated(value)

    def _templates(self) -> tuple[_Template, ...]:
        if not hasattr(self, "_compiled"):
            made = (_template(text, own) for (context, text), own in self._texts.items() if not context)
            found = [each for each in made if each is not None]
            self._compiled = tuple(sorted(found, key=lambda each: -len(each.pattern.pattern)))
        return self._compiled


def _template(text: str, translation: str) -> _Template | None:
    literals = PLACE.split(text)[::2]
    if len(literals) == 1:
        return None
    pattern, seen = re.escape(literals[0]), set[str]()
    for name, literal in zip(PLACE.findall(text), literals[1:], strict=True):
        wanted = _COUNT if name == "count" else ".*?"
        pattern += f"(?P={name})" if name in seen else f"(?P<{name}>{wanted})"
        pattern += re.escape(literal)
        seen.add(name)
    return _Template(re.compile(pattern, re.DOTALL), max(literals, key=len), translation)


@cache
def catalogue(code: str) -> Catalogue:
    """Returns the catalogue of a language, which is read once."""
    return Catalogue(read_catalogue(catalogue_path(code)))


def catalogue_path(code: str) -> Path:
    """Returns where the catalogue of a language stands, by the rules of gettext."""
    return FOLDER / code.replace("-", "_") / "LC_MESSAGES" / "tumble.po"


def read_catalogue(path: Path) -> Iterator[Entry]:
    """Reads a file of gettext as babel writes it, without the entry that describes the file.

    Source: https://www.gnu.org/software/gettext/manual/html_node/PO-Files.html.
    """
    for block in path.read_text(encoding="utf-8").split("\n\n"):
        fields: dict[str, str] = {}
        key, fuzzy = "", False
        for line in block.splitlines():
            if line.startswith("#"):
                fuzzy = fuzzy or (line.startswith("#,") and "fuzzy" in line)
                continue
            if not line.startswith('"'):
                key, _, line = line.partition(" ")
                fields[key] = ""
            fields[key] += json.loads(line)
        if fields.get("msgid"):
            yield Entry(
                fields["msgid"],
                fields.get("msgstr", fields.get("msgstr[0]", "")),
                fields.get("msgctxt", ""),
                fields.get("msgid_plural", ""),
                fuzzy,
            )
