"""The one place where a file of others is opened to be read: a regular one, whatever was put there since.

To open a pipe waits until somebody writes to it, and to read a device may never end. A look beforehand is not
enough, as a name can stand for another file a moment later. A library is given the opened file, never its
name: it would open whatever that names by then, and some take a name for the address of another place.
"""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from pathlib import Path

from tumble.foundation.errors import PlaceError

_WITHOUT_WAITING = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Opening a pipe that nobody writes to would wait."""


def open_regular(path: Path | str) -> BufferedReader:
    """Opens a file to be read as bytes.

    Raises `PlaceError`, in one line, for a device, a pipe or a socket, and `OSError` otherwise, as `open`.
    """
    return open(path, "rb", opener=_opened)


def _opened(path: str, _flags: int) -> int:
    _refuse_special(path, Path(path).stat().st_mode)  # to open a device may move it
    descriptor = os.open(path, _WITHOUT_WAITING)
    try:
        _refuse_special(path, os.fstat(descriptor).st_mode)  # put there since
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _refuse_special(path: str, mode: int) -> None:
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise PlaceError(f"{path}: is a device or a pipe, from which reading may never end; give a file")
