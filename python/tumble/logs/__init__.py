"""Logs in: any file that holds IMU samples becomes a `Recording`. Logs out: a recording becomes a file.

Start at `open_recording`; `formats` finds the reader, a reader gives a `LoggedImu`, `conversion` makes it SI,
`checks` sees that it is fit to use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tumble.foundation import lazy

if TYPE_CHECKING:
    from tumble.logs.checks import ChunkStream, Counts
    from tumble.logs.folder import FolderStream
    from tumble.logs.options import ReadOptions, options_for
    from tumble.logs.reading import list_imus, open_recording
    from tumble.logs.single_axes import SingleAxes, open_single_axes
    from tumble.logs.spec import LogSpec, parse_spec
    from tumble.logs.writer import Facts, Writer
    from tumble.logs.writers import open_mcap_writer, open_writer

__all__ = [
    "ChunkStream",
    "Counts",
    "Facts",
    "FolderStream",
    "LogSpec",
    "ReadOptions",
    "SingleAxes",
    "Writer",
    "list_imus",
    "open_mcap_writer",
    "open_recording",
    "open_single_axes",
    "open_writer",
    "options_for",
    "parse_spec",
]

__getattr__ = lazy.attributes(
    __name__,
    {
        "tumble.logs.checks": ("ChunkStream", "Counts"),
        "tumble.logs.folder": ("FolderStream",),
        "tumble.logs.options": ("ReadOptions", "options_for"),
        "tumble.logs.reading": ("list_imus", "open_recording"),
        "tumble.logs.single_axes": ("SingleAxes", "open_single_axes"),
        "tumble.logs.spec": ("LogSpec", "parse_spec"),
        "tumble.logs.writer": ("Facts", "Writer"),
        "tumble.logs.writers": ("open_mcap_writer", "open_writer"),
    },
)


def __dir__() -> list[str]:
    return __all__
