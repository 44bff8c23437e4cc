"""`NAME=SOURCE`: several live sources as they are typed, each under the name of its unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tumble.foundation.errors import LogError
from tumble.foundation.file_names import file_stem
from tumble.foundation.words import join
from tumble.live.address import Address, parse_address

EXAMPLE = "imu_a=serial:/dev/ttyUSB0?baud=115200"


def parse_named_sources(words: Sequence[str]) -> Mapping[str, Address]:
    """Parses `NAME=SOURCE` words; the units stay in the order in which they were typed.

    Raises `LogError` where a word has no name, or one that no file can bear, where two bear the same name,
    where two are the same source, and where there is none.
    """
    if not words:
        raise LogError(f"no unit to listen to; give NAME=SOURCE, such as {EXAMPLE}")
    named: dict[str, Address] = {}
    for word in words:
        name, source = _name_and_source(word)
        if name in named:
            raise LogError(f"{word}: {name} is named twice; give each unit a name of its own")
        address = parse_address(source)
        if twin := next((other for other, each in named.items() if _same(each, address)), None):
            raise LogError(f"{word}: {join([twin, name])} are the same source; name each source once")
        named[name] = address
    return named


def _name_and_source(word: str) -> tuple[str, str]:
    name, equals, source = word.partition("=")
    if not equals or not name or ":" in name:
        raise LogError(f"{word}: names no unit; give NAME=SOURCE, such as {EXAMPLE}")
    if file_stem(name) != name:
        raise LogError(
            f"{word}: {name!r} cannot name a unit; give letters, digits, '_', '-', '+' and '.' only, "
            f"such as {file_stem(name)}"
        )
    return name, source


def _same(one: Address, other: Address) -> bool:
    return (one.scheme, one.place, one.unit, one.settings) == (
        other.scheme,
        other.place,
        other.unit,
        other.settings,
    )
