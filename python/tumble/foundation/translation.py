"""Translation of texts where people read them: on a page, on a screen, in a line of error.

Every text is made in English, in the core as in Python, and results keep it so. Where it is shown,
`translated` looks the text up in the catalogue of the language, then among templates with places, such as
`{count} rests`. Contents of places are translated likewise, unless the place is that of a name. English
needs no catalogue: nothing is read, and every text is returned unchanged.
"""

from __future__ import annotations

import os
from contextvars import ContextVar

TYPE_CHECKING = False  # typing takes longer to import than this module
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from contextlib import AbstractContextManager

ENGLISH = "en"
CHINESE = "zh-CN"
LANGUAGES = {ENGLISH: "English", CHINESE: "简体中文"}
"""Languages by their code of BCP 47, each with its own name."""
VARIABLE = "TUMBLE_LANG"
"""Variable of the environment that names the language before those of the system."""

_OF_THE_SYSTEM = ("LC_ALL", "LC_MESSAGES", "LANG")
_TRADITIONAL = ("hant", "tw", "hk", "mo")
"""Scripts and regions whose readers are served better by English than by simplified Chinese."""
_language: ContextVar[str] = ContextVar("language", default=ENGLISH)


def language() -> str:
    """Returns the code of the language in which texts are shown in this context."""
    return _language.get()


def speaking(code: str) -> AbstractContextManager[None]:
    """Shows texts in a language while the block runs, in this thread or task only.

    Raises `TumbleError` where there is no such language.
    """
    from contextlib import contextmanager

    found = known_language(code)

    @contextmanager
    def block() -> Iterator[None]:
        token = _language.set(found)
        try:
            yield
        finally:
            _language.reset(token)

    return block()


def speak(code: str, about: str = "") -> None:
    """Shows texts in a language from here on in this context; `about` is the place of the code.

    A process, a thread or a task has a context of its own.

    Raises `TumbleError` where there is no such language.
    """
    _language.set(known_language(code, about))


def translated(text: str, /, *, context: str = "", **values: object) -> str:
    """Returns a text in the language of the context, with `values` in its places `{name}`.

    A text that was filled already is found by its template. `context` distinguishes texts that are alike in
    English. A text that the catalogue lacks stays English.
    """
    code = _language.get()
    if code == ENGLISH:
        if not values:
            return text
        from tumble.foundation.template import filled

        return filled(text, values)
    from tumble.foundation.catalogue import catalogue

    return catalogue(code).translated(text, context, values)


def known_language(code: str, about: str = "") -> str:
    """Returns the language that `zh_CN.UTF-8`, `zh-Hans` or `en` names; `about` is the place of the code.

    Raises `TumbleError` for any other.
    """
    found = _matching(code)
    if not found:
        from tumble.foundation.errors import TumbleError

        raise TumbleError(f"no language '{code}'; give {' or '.join(LANGUAGES)}", about)
    return found


def language_of_environment(environment: Mapping[str, str] = os.environ) -> str:
    """Returns the language that `TUMBLE_LANG` or the system names; English where it names one we lack.

    Raises `TumbleError` where `TUMBLE_LANG` itself names one we lack.
    """
    if environment.get(VARIABLE):
        return known_language(environment[VARIABLE], VARIABLE)
    named = next(filter(None, (environment.get(name) for name in _OF_THE_SYSTEM)), "")
    return _matching(named) or ENGLISH


def accepted_language(header: str) -> str:
    """Returns the language that a browser's `Accept-Language` prefers (RFC 9110, section 12.5.4)."""
    ranked = []
    for place, part in enumerate(header.split(",")):
        code, _, weight = part.partition(";")
        ranked.append((-_weight(weight), place, _matching(code)))
    return next((found for weight, _, found in sorted(ranked) if found and weight < 0.0), ENGLISH)


def _weight(text: str) -> float:
    try:
        return float(text.strip().removeprefix("q=")) if text.strip() else 1.0
    except ValueError:
        return 0.0


def _matching(code: str) -> str:
    primary, *rest = code.strip().partition(".")[0].lower().replace("_", "-").split("-")
    if primary == "zh" and not set(rest) & set(_TRADITIONAL):
        return CHINESE
    return ENGLISH if primary == "en" else ""
