"""Secrets in text: passwords and tokens of addresses, hidden wherever text is shown.

They are found by where they stand in an address (RFC 3986, sections 3.2.1, 3.4 and 3.5), whatever they are
called: all before the last `@`, and all values behind `?` and `#` but those of settings that hold no secret.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

HIDDEN = "***"
HARMLESS = frozenset(
    (
        *("baud", "clock-rate", "domain", "from", "magnetometer", "message", "profile", "qos", "rate"),
        *("reorder", "root", "router", "speed", "system", "trigger"),
        *("application_name", "connect_timeout", "host", "hostaddr", "port", "sslmode", "user"),
    )
)
"""Settings of addresses that are shown: those of live sources and tables, and some of PostgreSQL."""
_SCHEME = r"(?:[a-zA-Z][\w+.-]{0,60}://|(?<![\w.+-])[a-zA-Z][\w+-]{1,60}:/)"
"""Beginning of an address; one that was taken for a path has lost a slash. A scheme may begin
at each letter, so that it has a longest length: time would grow with its square."""
_SOURCE = r"(?<![\w.+-])[a-zA-Z][\w+-]{0,60}:(?=[^\s/?\"<>][^\s?\"<>]{0,200}\?)"
"""Beginning of a live source without slashes that has settings: `mavlink:udpin:HOST:PORT?rate=100`."""
_BEGIN = re.compile(f"(?P<scheme>{_SCHEME})|{_SOURCE}")
_WITHOUT_BLANK = re.compile(r"[^\s\"<>]*")
"""All that an address may hold by RFC 3986: a blank or a quotation mark ends it."""
_AUTHORITY = re.compile(r"[^/?#]*")
_OPENED = re.compile(r"[^\s/?#@:]*:(?=[^\s/])")
"""A user before a password, or a host before a port."""
_PORT = re.compile(r"\d{1,5}(?=[\s/:;,)'\"?#]|$)")
_END_OF_PRINTED = re.compile(r"[\"<>\t\n]|  ")
_END_OF_WORD = re.compile(r"[\s\"<>]|$")
_END_OF_MESSAGE = re.compile(r"[:;](?=\s)|$")
_NEXT = re.compile(r"[&#]|$")
_SETTING = re.compile(r"[?&#;](?:(?P<key>[^\s=&#?;\"<>]{0,200})=|(?<!;)(?<!\s.)(?=[\w%+/]))")
"""Beginning of a setting with its key, or of what stands behind `?` or `#` without one."""
_HARMLESS_VALUE = re.compile(r"[\w.,:/+~-]*(?=[&#;?\s\"'<>)\]}]|$)")
_HIDDEN_VALUE = re.compile(r"\*{3}(?![\w%*])")
_BUCKETS = ("s3", "s3a", "gs", "gcs", "file", "local", "memory")
"""Schemes in which an `@` behind a slash belongs to the name of a file."""
_NAMED = re.compile(r"([?&#;])([\w.%-]{1,200})=(?!\*)[^&#\s\"<>]+")
_SECRET_NAME = re.compile("(?i)sig|key|secret|token|pass|pwd|cred|auth|jwt|bearer|code|session")
"""Names of secrets, where a library repeats a part of an address without its beginning."""
_STATED = re.compile(r"(?i)\b((?:secret|token|password|signature|sig)=)(?!\*)[^&\s\"<>]+")
_BARE = re.compile(r"(?<![^\s\"'/(\[{=,])[^/@\s:\"'(\[{=,]+:(?!\*{3}@)[^/@\s\"]{1,4096}@")
"""User and password without a scheme: repeated by a library, or in a path that was meant as an address."""


def without_secrets(text: str, *, is_message: bool = False) -> str:
    """Returns text in which users, passwords, tokens and signatures of addresses are hidden.

    Printed text may be JSON or a table, where a quotation mark or a column ends an address. In a message an
    address may hold blanks and quotation marks, as somebody typed it, up to the reason behind a colon.
    """
    if ":" in text and not {"@", "?", "#", ";"}.isdisjoint(text):
        text = "".join(_pieces(text, is_message=is_message))
    if "@" in text:
        text = _BARE.sub(f"{HIDDEN}@", text)
    if "=" in text:
        text = _STATED.sub(rf"\1{HIDDEN}", _NAMED.sub(_without_value, text))
    return text


def _pieces(text: str, *, is_message: bool) -> Iterator[str]:
    """Yields text between addresses as it is, and addresses without their secrets."""
    at = 0
    found = _BEGIN.search(text)
    while found:
        yield text[at : found.end()]
        at = found.end()
        following = _BEGIN.search(text, at)
        end = following.start() if following else len(text)
        if not is_message and (printed := _END_OF_PRINTED.search(text, at, end)):
            end = printed.start()
        if found["scheme"] and (length := _length_of_user(found["scheme"], text[at:end])):
            yield HIDDEN
            at += length
        shown, at = _settings(text, at, end, is_message=is_message)
        yield from shown
        found = following if following is None or following.start() >= at else _BEGIN.search(text, at)
    yield text[at:]


def _length_of_user(scheme: str, rest: str) -> int:
    """Returns how long the text before the last `@` is, as a password may hold any sign; 0 for none."""
    user, sign, _ = _WITHOUT_BLANK.match(rest)[0].rpartition("@")  # type: ignore[index]
    if user.endswith(HIDDEN):
        return 0
    ends = [0]
    is_name = scheme.partition(":")[0] in _BUCKETS and "/" in user and ":" not in user.partition("/")[0]
    if sign and not is_name:
        ends.append(len(user))
    reason = _END_OF_MESSAGE.search(rest).start()  # type: ignore[union-attr]
    ends.append(_AUTHORITY.match(rest)[0].rfind("@", 0, reason))  # type: ignore[index]
    if opened := _OPENED.match(rest):
        is_port = _PORT.match(rest, opened.end())
        ends.append(rest.rfind("@", 0, reason if is_port else None))
    return max(ends)


def _settings(text: str, at: int, end: int, *, is_message: bool) -> tuple[list[str], int]:
    """Returns what is shown of the place and the settings of an address, and where the text goes on."""
    shown, last = [], at
    ends = _END_OF_MESSAGE if is_message else _END_OF_WORD
    end = ends.search(text, at, end).start()  # type: ignore[union-attr]
    while setting := _SETTING.search(text, at, end):
        value = setting.end()
        shown.append(text[at:value])
        at = value
        known = _HARMLESS_VALUE if setting["key"] in HARMLESS else _HIDDEN_VALUE
        if harmless := known.match(text, value):
            at = harmless.end()
            shown.append(harmless[0])
        else:
            # A value in a message may hold blanks, and the beginning of another address.
            if last <= value:
                last = ends.search(text, value).start()  # type: ignore[union-attr]
            at = _NEXT.search(text, value, last).start()  # type: ignore[union-attr]
            shown.append(HIDDEN if at > value else "")
            end = max(end, last)
    return shown, at


def _without_value(found: re.Match[str]) -> str:
    from urllib.parse import unquote  # seldom needed, and all commands would wait for it

    is_secret = _SECRET_NAME.search(unquote(found[2]))
    return f"{found[1]}{found[2]}={HIDDEN}" if is_secret else found[0]
