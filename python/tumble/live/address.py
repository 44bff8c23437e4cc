"""`SCHEME:PLACE:UNIT?KEY=VALUE&...`: where a live stream comes from, as it is typed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from ipaddress import IPv6Address
from pathlib import Path
from urllib.parse import parse_qsl

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import exists
from tumble.foundation.numbers import number_of

LOOPBACK = "127.0.0.1"
"""Default address to listen at: this computer only."""
CLOCK_RATE = "clock-rate"
STANDARD_INPUT = "stdin"
"""Scheme of what is piped into the program; `-` is the same."""
_ON_NETWORK = re.compile(r"(?P<place>(?:(?:udpin|udp|tcp):)?(?:\[[^\]]*\]|[^:\[\]]*):\d+):(?P<unit>.+)")
_HOST = re.compile(r"[^\s:/?#@\[\]%]*")
_NETWORK_SCHEMES, _PATH_SCHEMES = ("udp", "tcp", "mavlink"), ("serial", "file", "mavlink")


@dataclass(frozen=True, slots=True)
class Address:
    """A typed address, taken apart."""

    text: str
    """Text as the user typed it; messages name the source by it."""
    scheme: str
    """`serial`, `udp`, `mavlink`, `replay` ..."""
    place: str
    """Part after the scheme, without leading slashes where there are two of them."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Settings after the question mark."""
    unit: str | None = None
    """Which of several IMUs that are received there, where one is named."""
    clock_rate: float = 1.0
    """Seconds of its clock per second, `?clock-rate=`: for simulations that run faster than real time."""

    @property
    def line(self) -> str:
        """Line to be opened: sources that differ only in their unit, or message, share it."""
        settings = sorted((key, value) for key, value in self.settings.items() if key != "message")
        query = "&".join(f"{key}={value}" for key, value in settings)
        return f"{self.scheme}:{self.place}?{query}"

    def refuse_other_settings(self, *known: str) -> None:
        """Raises `LogError` where a setting is none of `known`: a misspelt one would be passed over."""
        for key in self.settings:
            if key not in known:
                listed = ", ".join(known) or "none"
                raise LogError(f"{self.text}: no setting {key!r} for {self.scheme}; known: {listed}")

    def number(self, key: str, default: float, *, least: float | None = None) -> float:
        """Returns a setting that is a number above zero, or `least` or more; `LogError` where it is none."""
        text = self.settings.get(key)
        if text is None:
            return default
        value = number_of(text)
        lowest = math.ulp(0.0) if least is None else least
        if value is None or not lowest <= value < math.inf:
            wanted = "above zero" if least is None else f"of {least:g} or more"
            raise LogError(f"{self.text}: {key}={text}: give a number {wanted}")
        return value


def parse_address(text: str) -> Address:
    """Parses an address.

    Raises `LogError` where it has no scheme, names no place, or holds settings that are no pairs.

    >>> parse_address("serial:/dev/ttyUSB0?baud=921600").settings
    {'baud': '921600'}
    >>> parse_address("udp://0.0.0.0:9000:left").unit
    'left'
    """
    scheme, colon, rest = text.partition(":")
    scheme = STANDARD_INPUT if scheme == "-" else scheme.lower()
    place, _, query = rest.partition("?")
    place = place.removeprefix("//")
    if scheme != STANDARD_INPUT and not (colon and scheme and place):
        raise LogError(
            f"{text}: no live source; expected SCHEME:PLACE, such as serial:/dev/ttyUSB0?baud=115200"
        )
    try:
        settings = dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True)) if query else {}
    except ValueError:
        raise LogError(f"{text}: what follows the question mark is no list of KEY=VALUE&KEY=VALUE") from None
    place, unit = _place_and_unit(scheme, place)
    found = Address(text, scheme, place, settings, unit)
    rate = found.number(CLOCK_RATE, 1.0)
    return replace(
        found, settings={key: value for key, value in settings.items() if key != CLOCK_RATE}, clock_rate=rate
    )


def _place_and_unit(scheme: str, place: str) -> tuple[str, str | None]:
    """Splits `PLACE:UNIT`, where UNIT names one of several IMUs."""
    if scheme == STANDARD_INPUT:
        return "", place or None
    if scheme in _NETWORK_SCHEMES and (found := _ON_NETWORK.fullmatch(place)):
        return found["place"], found["unit"]
    head, colon, unit = place.rpartition(":")
    # Names of devices may hold colons, as those in /dev/serial/by-path do.
    if scheme in _PATH_SCHEMES and colon and unit and exists(Path(head)) and not exists(Path(place)):
        return head, unit
    return place, None


def host_and_port(address: Address, place: str) -> tuple[str, int]:
    """Reads `HOST:PORT`, or `:PORT` for programs on this machine; raises `LogError` where it is neither."""
    host, _, port = place.rpartition(":")
    number = number_of(port) if port.isalnum() else None
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if number is None or not 0.0 < number < 1 << 16 or not _is_host(host):
        raise LogError(f"{address.text}: expected HOST:PORT, such as 0.0.0.0:9000")
    return host or LOOPBACK, int(number)


def _is_host(text: str) -> bool:
    """Returns whether a text may name a host, or is an address of IPv6: libraries stumble over others."""
    if ":" not in text:
        return _HOST.fullmatch(text) is not None
    try:
        IPv6Address(text)
    except ValueError:
        return False
    return True
