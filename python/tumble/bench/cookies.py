"""Cookies of a request: those of other programs on the same computer are none of ours, however they look."""

from __future__ import annotations

from collections.abc import Iterable, Iterator


def cookie_values(header: bytes, name: str) -> Iterator[str]:
    """Returns the values of the cookies of a name in a `Cookie` header (RFC 6265, section 4.2.1).

    Python's own reader ends at the first cookie that it cannot read, which another program may have set.
    """
    for pair in header.split(b";"):
        key, _, value = pair.strip().partition(b"=")
        if key == name.encode("ascii"):
            yield value.decode("latin-1")


def only_cookies(header: bytes, names: Iterable[str]) -> bytes:
    """Returns a `Cookie` header with the cookies of these names alone."""
    kept = (f"{name}={value}" for name in names for value in cookie_values(header, name))
    return "; ".join(kept).encode("latin-1")
