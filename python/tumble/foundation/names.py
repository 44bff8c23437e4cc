"""Names of units, serial numbers and persons: one form of each, of bounded length, wherever they come from.

Text that looks the same on paper has several forms in a computer: with blanks behind it, composed or not
(https://www.unicode.org/reports/tr15), with signs that nobody sees. Two forms of one serial number would be
two units.
"""

from __future__ import annotations

import re
import unicodedata

from tumble.foundation.words import in_utf8

LONGEST_NAME = 1000
"""Letters; the path of a log may be a name."""
_UNSEEN = re.compile("[\u00ad\u034f\u180e\u200b\u2060-\u2064\ufeff]")
"""Signs without a width and a meaning between letters; joiners of scripts are none of them."""


def check_length(text: str) -> None:
    """Raises `ValueError` where a name is longer than any."""
    if len(text) > LONGEST_NAME:
        raise ValueError(f"a name of {len(text)} letters; {LONGEST_NAME} at most")


def normal_name(text: str) -> str:
    """Returns a name in its one form: composed, without unseen signs and without blanks at its ends.

    Bytes that are no UTF-8 are escaped, as in every file that holds the name.

    Raises `ValueError` where it is no text, or longer than any name.
    """
    if not isinstance(text, str):
        kind = type(text).__name__
        raise ValueError(f"a name that is no text but {kind}")  # noqa: TRY004 - callers make a line of it
    check_length(text)
    if text.isascii():
        return text.strip()
    return unicodedata.normalize("NFC", _UNSEEN.sub("", in_utf8(text))).strip()
