"""Words that messages, screens, files and pages share: counted nouns, lists, and names that are no text."""

from __future__ import annotations

import codecs
import re
import reprlib
from collections.abc import Sequence
from typing import Final, Literal, TypeAlias

from tumble.foundation.secrets import without_secrets

ESCAPED = "tumble-escaped"
"""Name, for `errors` of `str.encode`, of the way to write what an encoding cannot represent: `rob\\xe9t`."""


_OBEYED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Characters that a terminal obeys instead of showing: control characters except tab and newline, and those
that change the direction of the following text (https://www.unicode.org/reports/tr9/, section 2). Lone
surrogates too, by which Python keeps bytes that are no UTF-8: no file and no library takes them."""
_OF_FORMULAS = r"=+\-@\uff1d\uff0b\uff0d\uff20"
"""Letters that begin what spreadsheets compute, of full width too."""
_FORMULA = re.compile(rf"(^|[;|\t\n\r])(?=[ '\"]*[{_OF_FORMULAS}]|[\t\r])")
"""The begin of one, at the start of a cell, or behind a sign that separates cells in some countries."""
_NUMBER = re.compile(r"[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|nan)")
_LENGTHS = {"min": 60.0, "h": 3600.0, "days": 86400.0}
"""Units in which lengths of time are shown, s."""

Listening: TypeAlias = Literal["listening"]
LIVE_OUTPUTS = "stdout, udp://HOST:PORT, mavlink:udpout:HOST:PORT, ros2:///TOPIC"
"""Places for corrected samples as they are typed, files aside; `tumble.live.outputs` opens them."""
LISTENING: Final[Listening] = "listening"
"""First event of every live command with `--json`: all lines are open, and whoever sends may begin."""


def count_of(thing: str, count: int) -> str:
    """Prints `1 target`, `5 targets`."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def join(names: Sequence[str]) -> str:
    """Joins to `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


_LONGEST_QUOTED = 60
_CONTROL = re.compile(f"[\t\n]|{_OBEYED.pattern}")
"""The same with those that begin a line or a column."""


def plain(text: str) -> str:
    """Writes control characters of text from outside as escapes, so that no terminal obeys them."""
    return _CONTROL.sub(_escaped, text)


def quoted(text: str) -> str:
    """Quotes text from outside: its beginning, without control characters and secrets of addresses."""
    text = without_secrets(text, is_message=True)
    short = text if len(text) <= _LONGEST_QUOTED else f"{text[:_LONGEST_QUOTED]}..."
    return f"'{plain(short)}'"


def length_of_time(seconds: float) -> str:
    """Prints how long something takes: `40 s`, `7.5 min`, `3 h`, `2.5 days`."""
    unit, scale = "s", 1.0
    for name, size in _LENGTHS.items():
        if seconds >= 2.0 * size:
            unit, scale = name, size
    shown = seconds / scale
    return f"{shown:.2g} {unit}" if shown < 100.0 else f"{shown:.0f} {unit}"


def printable(text: str) -> str:
    """Escapes what a terminal would obey, such as the escape sequences that a name from outside may hold."""
    return _OBEYED.sub(_escaped, text)


def defused(text: str) -> str:
    """Returns text of others for a cell of a CSV file, so that no spreadsheet takes any part for a formula.

    Numbers stay as they are. Source: https://owasp.org/www-community/attacks/CSV_Injection.
    """
    safe = text if _NUMBER.fullmatch(text) else _FORMULA.sub(r"\1'", text)
    # The end of a line ends a row for some readers, quoted or not, and commas separate cells there.
    return safe.replace("\r", " ").replace("\n", " ")


def utf8(text: str) -> bytes:
    """Encodes text; bytes of names that are no UTF-8 are escaped, as a shell would show them."""
    return text.encode("utf-8", ESCAPED)


def in_utf8(text: str) -> str:
    """Returns text that every library can encode: that of `utf8`."""
    return text if text.isascii() else utf8(text).decode()


def _escaped(found: re.Match[str]) -> str:
    letter = found[0]
    is_byte = "\ud800" <= letter <= "\udfff"
    return in_utf8(letter) if is_byte else letter.encode("unicode_escape").decode()


def _escape(error: UnicodeError) -> tuple[str | bytes, int]:
    """Escapes a byte of a name, which Python keeps as a lone surrogate, by its value, others by number."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letter = error.object[error.start]
    byte = ord(letter) - 0xDC00
    shown = f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else letter.encode("ascii", "backslashreplace").decode()
    return shown, error.start + 1


codecs.register_error(ESCAPED, _escape)


class _Short(reprlib.Repr):
    """Looks at no more of a value than it shows."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxlist, self.maxdict, self.maxtuple, self.maxset = 4, 10, 6, 10, 10
        self.maxstring = self.maxother = _SHORT

    def repr_str(self, x: str, level: int) -> str:
        """Hides secrets before the text is cut, as nobody sees them in a part of an address."""
        return super().repr_str(without_secrets(x[:_LOOKED_AT], is_message=True), level)


_SHORT = 60
_LOOKED_AT = 10_000
"""Letters, more than any address has."""
_short = _Short()


def short(value: object) -> str:
    """Shows a value in a message: at most 60 characters of it, however large it is."""
    text = _short.repr(value)
    return text if len(text) <= _SHORT else f"{text[: _SHORT - 3]}..."
