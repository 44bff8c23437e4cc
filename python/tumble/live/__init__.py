"""Samples as they come: from a serial line, over UDP, by MAVLink, or from a log replayed at its own pace.

>>> from tumble.live import open_source
>>> with open_source("udp://0.0.0.0:9000") as source:  # doctest: +SKIP
...     for chunk in source:
...         print(len(chunk), "samples")

Like `tumble.logs` it gives SI units and the case frame, and knows nothing of what is made of them. Whoever
reads several sources at once waits for their `fileno()`, then asks each for what has come, with `read()`.

To bring a source of your own, write an `Opener`, a function that makes a `Source` of an address:

>>> from tumble.live import Address, LiveChunk, Source
>>> from tumble.logs import ReadOptions
>>> def open_board(address: Address, options: ReadOptions) -> Source:
...     return Board(address.place)  # a class of yours that does what `Source` asks for

A subclass of `PolledSource` returns what to wait for and what has come, and is iterated for you; a class that
can just be iterated will do, and is read by a thread where there are several sources. Name the opener in the
`pyproject.toml` of your package. `tumble spin --live board:1` then finds it:

    [project.entry-points."tumble.live"]
    board = "your_package:open_board"
"""

from __future__ import annotations

from tumble.live.address import Address, parse_address
from tumble.live.multi_source import LiveSet, SourceEvent, open_set
from tumble.live.registry import Opener, open_source, schemes
from tumble.live.shared_line import SharedLines
from tumble.live.source import FIRST_SAMPLE_WITHIN, HEARTBEAT, LiveChunk, PolledSource, Source, nothing_came

__all__ = [
    "FIRST_SAMPLE_WITHIN",
    "HEARTBEAT",
    "Address",
    "LiveChunk",
    "LiveSet",
    "Opener",
    "PolledSource",
    "SharedLines",
    "Source",
    "SourceEvent",
    "nothing_came",
    "open_set",
    "open_source",
    "parse_address",
    "schemes",
]


def __dir__() -> list[str]:
    return __all__
