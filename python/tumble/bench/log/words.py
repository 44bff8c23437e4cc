"""Texts of the page, all of them through one function."""

from __future__ import annotations


def translated(text: str, /, **values: object) -> str:
    """Returns a text with `values` in its places `{name}`."""
    return text.format_map(values) if values else text
