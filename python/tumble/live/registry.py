"""Which source reads which scheme: those that come with Tumble, and those that other packages bring."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import TypeAlias, cast

from tumble.errors import LogError
from tumble.live.address import Address, parse_address
from tumble.live.source import Source
from tumble.logs.options import ReadOptions

GROUP = "tumble.live"
"""Entry points of this group, named as their scheme, are sources that other packages bring."""

Opener: TypeAlias = Callable[[Address, ReadOptions], Source]
"""Makes a source of an address; the line itself is opened when the source is entered."""

OWN: Mapping[str, tuple[str, str]] = {
    "serial": ("tumble.live.text", "open_serial"),
    "udp": ("tumble.live.text", "open_udp"),
    "mavlink": ("tumble.live.mavlink", "open_mavlink"),
    "replay": ("tumble.live.replay", "open_replay"),
}
"""Module and function of each scheme; imported only when it is asked for."""


def open_source(text: str, options: ReadOptions | None = None, sender: str | None = None) -> Source:
    """Find the source for an address; enter it with `with` to open the line.

    `options` say what the stream does not say itself, as for logs. Of a network only `sender` is listened to,
    as if `from=` were part of the address; without it, the first host that sends.

    Raises `LogError` where nothing reads such an address.
    """
    address = parse_address(text)
    if sender is not None:
        address = replace(address, settings={**address.settings, "from": sender})
    return _opener(address)(address, options or ReadOptions())


def schemes() -> tuple[str, ...]:
    """Give the schemes there are sources for, Tumble's own first."""
    return (*OWN, *sorted(set(_installed()) - set(OWN)))


def _opener(address: Address) -> Opener:
    if address.scheme in OWN:
        module, attribute = OWN[address.scheme]
        return cast("Opener", getattr(import_module(module), attribute))
    if address.scheme in (installed := _installed()):
        return cast("Opener", installed[address.scheme].load())
    raise LogError(
        f"{address.text}: nothing reads live from {address.scheme!r}; known: {', '.join(schemes())}"
    )


def _installed() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}
