"""Secrets in text: passwords and tokens of addresses, hidden wherever text is shown."""

from __future__ import annotations

import re

HIDDEN = "***"
_SCHEME = r"(?:[a-zA-Z][\w+.-]{0,60}://|(?<![\w.+-])[a-zA-Z][\w+-]+:/)"
"""Beginning of an address; one that was taken for a path has lost a slash. A scheme may begin
at each letter, so that it has a longest length: time would grow with its square."""
_ADDRESS = re.compile(rf"{_SCHEME}[^\s\"<>]*")
"""An address, with those that `::` chains to it; a quotation mark ends it, as RFC 3986 allows none in one."""
_CHAINED = re.compile(rf"::(?={_SCHEME})")
_PARTS = re.compile("([^:]*)(://?)(.*)", re.DOTALL)
_BUCKETS = ("s3", "s3a", "gs", "gcs", "file", "local", "memory")
"""Schemes in which an `@` behind a slash belongs to the name of a file."""
_QUERY = re.compile(
    r"(?i)([?&#;][\w.-]{0,200}(?:sig|key|secret|token|pass|pwd|cred|auth)[\w.-]{0,200}=)[^&#\s\"<>]+"
)
_STATED = re.compile(r"(?i)\b((?:secret|token|password|signature|sig)=)(?!\*)[^&\s\"<>]+")
_BARE = re.compile(r"(?<![^\s\"'/(\[{=,])[^/@\s:\"'(\[{=,]+:(?!\*{3}@)[^/@\s\"]{1,4096}@")
"""User and password without a scheme: repeated by a library, or in a path that was meant as an address."""


def without_secrets(text: str) -> str:
    """Returns text in which users, passwords and signatures of addresses are hidden, whatever the scheme."""
    if "@" in text:
        text = _BARE.sub(f"{HIDDEN}@", _ADDRESS.sub(lambda found: _without_users(found[0]), text))
    if "=" in text:
        text = _STATED.sub(rf"\1{HIDDEN}", _QUERY.sub(rf"\1{HIDDEN}", text))
    return text


def _without_users(address: str) -> str:
    return "::".join(map(_without_user, _CHAINED.split(address)))


def _without_user(address: str) -> str:
    """Hides what stands before the last `@`, as a password may hold slashes."""
    scheme, slashes, rest = _PARTS.fullmatch(address).groups()  # type: ignore[union-attr]
    user, sign, place = rest.rpartition("@")
    is_name = scheme in _BUCKETS and "/" in user and ":" not in user.partition("/")[0]
    if not sign or is_name or user.endswith(HIDDEN):
        return address
    return f"{scheme}{slashes}{HIDDEN}@{place}"
