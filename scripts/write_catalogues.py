"""Write the catalogues of translations: all texts that people read, each with its translation.

Wanted are the texts of templates, sentences of modules that write pages and screens, and the first argument
of every call of `translated`. Any other text of the sources may be translated too, such as a message of
error. With values in it, `f"{len(rests)} rests"`, a text is the template `{count} rests`.

With --check nothing is written. It fails where a wanted text is missing, untranslated or fuzzy; where a
translation has other places or tags than its text; where no source has a text any more; and where a
translation lacks the term that the glossary has for a word of its text. With --missing it prints all that.
"""

from __future__ import annotations

import argparse
import io
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po
from catalogue_sources import ROOT, SourceText, source_texts

from tumble.foundation.catalogue import PART, SEAM, TERM, CatalogueText, catalogue_path, read_catalogue
from tumble.foundation.template import PLACE
from tumble.foundation.translation import ENGLISH, LANGUAGES

GLOSSARY = ROOT / "docs" / "glossary.md"
TERMS_HEADING = "## Chinese terms\n"
GLOSSARY_EXEMPT = {
    "scale",
    "rest",
    "reference",
    "source",
    "pose",
    "turn",
    "mounting",
    "window",
    "unit",
    "log",
}
"""Words of the glossary that are ordinary words too, and mean another thing in some text."""
OWN_CONTEXTS = (SEAM, TERM, PART)
"""Contexts of texts that stand in no source."""
Terms: TypeAlias = Mapping[str, Sequence[str]]
"""Terms of a language that may stand for a word of English."""
_TYPED = re.compile(r"--\S+|\b[a-z-]+ \d+\.\d+|'[^']*'|\btumble( \w+)+|\b[A-Z]{2,}s?\b")
"""Parts of a text that users type, or read in capitals in the help."""
_TAG = re.compile(r"</?\w+>")
HEAD = """\
msgid ""
msgstr ""
"Language: {language}\\n"
"MIME-Version: 1.0\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"Content-Transfer-Encoding: 8bit\\n"
"Plural-Forms: nplurals=1; plural=0;\\n"

"""
"""Head of a catalogue without dates and versions, so that it changes only where a text does."""


def faults(texts: Iterable[SourceText], entries: Iterable[CatalogueText], terms: Terms) -> Iterator[str]:
    """Returns what is wrong with a catalogue, a line each."""
    held = {(entry.context, entry.text): entry for entry in entries}
    known: set[str] = set()
    for text in texts:
        known |= {text.text, text.plural}
        entry = held.get((text.context, text.text))
        if text.wanted and (entry is None or not entry.translation):
            yield f"untranslated: {text.text!r} of {text.path}"
    for entry in held.values():
        if entry.fuzzy:
            yield f"fuzzy: {entry.text!r}"
        if entry.context not in OWN_CONTEXTS and entry.text not in known:
            yield f"in no source: {entry.text!r}"
        if entry.translation:
            yield from _wrong_translation(entry, terms)


def _wrong_translation(entry: CatalogueText, terms: Terms) -> Iterator[str]:
    for pattern, what in ((PLACE, "places"), (_TAG, "tags")):
        if set(pattern.findall(entry.text)) != set(pattern.findall(entry.translation)):
            yield f"other {what}: {entry.text!r}, {entry.translation!r}"
    plain = _TYPED.sub("", PLACE.sub("", entry.text))
    for word, allowed in terms.items():
        is_used = any(term in entry.translation for term in allowed)
        if not is_used and re.search(rf"(?<!-)\b{re.escape(word)}s?\b", plain, re.IGNORECASE):
            yield f"no '{allowed[0]}' for '{word}': {entry.text!r}, {entry.translation!r}"


def glossary_terms(page: str) -> Terms:
    """Returns the Chinese terms of each word of the glossary that has a single meaning."""
    section = page.partition(TERMS_HEADING)[2].partition("\n## ")[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if "|" in line
    ]
    return {word: term.split("、") for word, term, *_ in rows[2:] if word not in GLOSSARY_EXEMPT}


def updated(code: str, texts: Iterable[SourceText]) -> bytes:
    """Returns the catalogue of a language with all wanted texts, as babel writes it."""
    path = catalogue_path(code)
    with path.open("rb") as file:
        catalog = read_po(file, locale=code.replace("-", "_"))
    held = {
        (message.context or "", _first(message.id))
        for message in catalog
        if message.id and message.string and not message.fuzzy
    }
    template = Catalog()
    for context, identity in held:
        if context in OWN_CONTEXTS:
            template.add(identity, context=context)
    found = list(texts)
    sources = {text.text for text in found}
    kept = {(context, text) for context, text in held if text in sources}
    for text in found:
        if text.wanted or ("", text.text) in kept:
            both = (text.text, text.plural) if text.plural else text.text
            template.add(both, locations=[(text.path, 0)], context=text.context or None)
    for context, identity in kept:
        if context and context not in OWN_CONTEXTS:
            template.add(identity, context=context)
    catalog.update(template)
    for message in catalog:
        message.flags -= {"python-format", "python-brace-format"}
    written = io.BytesIO()
    write_po(
        written,
        catalog,
        width=0,
        omit_header=True,
        sort_output=True,
        include_lineno=False,
        ignore_obsolete=True,
    )
    return HEAD.format(language=code.replace("-", "_")).encode() + written.getvalue()


def _first(identity: str | tuple[str, ...] | list[str]) -> str:
    return identity if isinstance(identity, str) else identity[0]


def main() -> int:
    """Writes the catalogues, or with --check reports what is wrong with them; 1 if anything is."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument(
        "--check", action="store_true", help="write nothing, and fail where anything is wrong"
    )
    parser.add_argument("--missing", action="store_true", help="print texts that are not translated yet")
    arguments = parser.parse_args()
    texts = list(source_texts())
    terms = glossary_terms(GLOSSARY.read_text(encoding="utf-8"))
    wrong = 0
    for code in LANGUAGES.keys() - {ENGLISH}:
        if not arguments.check:
            catalogue_path(code).write_bytes(updated(code, texts))
        entries = list(read_catalogue(catalogue_path(code)))
        found = list(dict.fromkeys(faults(texts, entries, terms)))
        for fault in found if arguments.check or arguments.missing else ():
            print(f"{code}: {fault}", file=sys.stderr)
        print(f"{code}: {len(entries)} texts, {len(found)} faults")
        wrong += len(found)
    return int(arguments.check and wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
