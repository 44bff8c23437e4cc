"""`SCHEME:PLACE?KEY=VALUE&...`: where a live stream comes from, as it is typed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import parse_qsl

from tumble.errors import LogError
from tumble.numbers import number_of

LOOPBACK = "127.0.0.1"
"""Where to listen if no address is written: not to everybody on the network."""


@dataclass(frozen=True, slots=True)
class Address:
    """What was typed, taken apart."""

    text: str
    """As it was typed: what messages call the source."""
    scheme: str
    """`serial`, `udp`, `mavlink`, `replay` ..."""
    place: str
    """Between the scheme and the question mark, without leading slashes where there are two of them."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """What follows the question mark."""

    def refuse_other_settings(self, *known: str) -> None:
        """Raise `LogError` where a setting is none of `known`: a misspelt one would be passed over."""
        for key in self.settings:
            if key not in known:
                listed = ", ".join(known) or "none"
                raise LogError(f"{self.text}: no setting {key!r} for {self.scheme}; known: {listed}")

    def number(self, key: str, default: float) -> float:
        """Give a setting that is a number above zero; raises `LogError` where it is none."""
        text = self.settings.get(key)
        if text is None:
            return default
        value = number_of(text)
        if value is None or not 0.0 < value < math.inf:
            raise LogError(f"{self.text}: {key}={text}: give a number above zero")
        return value


def parse_address(text: str) -> Address:
    """Take an address apart.

    Raises `LogError` where it has no scheme, names no place, or holds settings that are no pairs.

    >>> parse_address("serial:/dev/ttyUSB0?baud=921600").settings
    {'baud': '921600'}
    """
    scheme, colon, rest = text.partition(":")
    place, _, query = rest.partition("?")
    place = place.removeprefix("//")
    if not colon or not scheme or not place:
        raise LogError(
            f"{text}: no live source; expected SCHEME:PLACE, such as serial:/dev/ttyUSB0?baud=115200"
        )
    try:
        settings = dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True)) if query else {}
    except ValueError:
        raise LogError(f"{text}: what follows the question mark is no list of KEY=VALUE&KEY=VALUE") from None
    return Address(text, scheme.lower(), place, settings)


def host_and_port(address: Address, place: str) -> tuple[str, int]:
    """Read `HOST:PORT`, or `:PORT` for programs on this machine; raises `LogError` where it is neither."""
    host, _, port = place.rpartition(":")
    number = number_of(port) if port.isalnum() else None
    if number is None or not 0.0 < number < 1 << 16:
        raise LogError(f"{address.text}: expected HOST:PORT, such as 0.0.0.0:9000")
    return host.strip("[]") or LOOPBACK, int(number)
