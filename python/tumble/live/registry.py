"""Which source reads which scheme: those that come with Tumble, and those that other packages bring."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from tumble.foundation.debugging import debug
from tumble.foundation.errors import LogError
from tumble.live.address import Address, parse_address
from tumble.live.shared_line import SharedLine, SharedLines
from tumble.live.source import Source
from tumble.logs.optional import imported
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.live.text import TextLine

GROUP = "tumble.live"
"""Entry points of this group, named as their scheme, are sources that other packages bring."""

Opener: TypeAlias = Callable[[Address, ReadOptions], Source]
"""Makes a source of an address; the line itself is opened when the source is entered."""

LineMaker: TypeAlias = Callable[[Address, ReadOptions], SharedLine[Any]]
"""Makes a line of an address, on which several units may be received."""

TEXT = "tumble.live.text"
LINES: Mapping[str, tuple[str, str]] = {
    "serial": (TEXT, "serial_line"),
    "udp": (TEXT, "udp_line"),
    "tcp": (TEXT, "tcp_line"),
    "stdin": (TEXT, "piped_line"),
    "file": (TEXT, "file_line"),
    "mavlink": ("tumble.live.mavlink", "mavlink_line"),
}
"""Module and `LineMaker` of each scheme of lines; imported only when it is asked for."""
SENT_BY_ANYBODY = ("udp", "mavlink")
"""Schemes of lines to which several hosts may send."""
OWN: Mapping[str, tuple[str, str, str]] = {
    "iio": ("tumble.live.iio", "open_iio", ""),
    "replay": ("tumble.live.replay", "open_replay", ""),
    "ros2": ("tumble.live.ros2", "open_ros2", "ros2"),
    "ros2+zenoh": ("tumble.live.ros2_zenoh", "open_zenoh", "zenoh"),
    "foxglove": ("tumble.live.foxglove", "open_foxglove", "foxglove"),
}
"""The same, with `Opener` and the extra that it needs, of sources that hold one unit."""


def open_source(
    text: str,
    options: ReadOptions | None = None,
    sender: str | None = None,
    lines: SharedLines | None = None,
) -> Source:
    """Finds the source for an address; enter it with `with` to open the line.

    `options` state what the stream does not, as for logs. A network line accepts only `sender`, as if `from=`
    were part of the address; without it, the first host that sends. Sources that are found with
    the same `lines` share a line where they differ in their unit only.

    Raises `LogError` where nothing reads such an address.
    """
    address = parse_address(text)
    if sender is not None:
        address = _heard_from(address, sender)
    options = options or ReadOptions()
    debug(__name__, "opening %s, to be read as %s", address.text, options)
    if address.scheme in LINES:
        make = cast("LineMaker", _imported(*LINES[address.scheme]))
        line = (lines or SharedLines()).line(address, lambda: make(address, options))
        return line.unit(address, options)
    return _opener(address)(address, options)


def text_line(text: str, options: ReadOptions, sender: str | None = None) -> TextLine:
    """Creates the line of an address that carries text; `options` are as for `open_source`.

    A `sender` counts where any host may send. Raises `LogError` where no text comes from there.
    """
    address = parse_address(text)
    if sender is not None and address.scheme in SENT_BY_ANYBODY:
        address = _heard_from(address, sender)
    module, maker = LINES.get(address.scheme, ("", ""))
    if module != TEXT:
        known = [scheme for scheme, (module, _) in LINES.items() if module == TEXT]
        raise LogError(f"{text}: no rows of text come from {address.scheme!r}; known: {', '.join(known)}")
    make = cast("Callable[[Address, ReadOptions], TextLine]", _imported(module, maker))
    return make(address, options)


def _heard_from(address: Address, sender: str) -> Address:
    return replace(address, settings={**address.settings, "from": sender})


def schemes() -> tuple[str, ...]:
    """Returns the schemes there are sources for, Tumble's own first."""
    own = (*LINES, *OWN)
    return (*own, *sorted(set(_installed()) - set(own)))


def _opener(address: Address) -> Opener:
    if address.scheme in OWN:
        module, opener, extra = OWN[address.scheme]
        return cast("Opener", getattr(imported(module, address.text, extra), opener))
    if address.scheme in (installed := _installed()):
        return cast("Opener", installed[address.scheme].load())
    raise LogError(
        f"{address.text}: nothing reads live from {address.scheme!r}; known: {', '.join(schemes())}"
    )


def _imported(module: str, name: str) -> object:
    return getattr(import_module(module), name)


def _installed() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}
