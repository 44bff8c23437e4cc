"""The one place where a file of others is opened to be read: a regular one, whatever was put there since.

To open a pipe waits until somebody writes to it, and to read a device may never end. A look beforehand is not
enough, as a name can stand for another file a moment later. A library is given the opened file, never its
name: it would open whatever that names by then, and some take a name for the address of another place.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from io import DEFAULT_BUFFER_SIZE, BufferedReader, FileIO
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

from tumble.foundation.errors import PlaceError

_WITHOUT_WAITING = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Opening a pipe that nobody writes to would wait."""


_Read = TypeVar("_Read", int, bytes)


class UnreadableError(PlaceError):
    """A file that was opened and gives no bytes."""


def open_regular(path: Path | str) -> BufferedReader:
    """Opens a file to be read as bytes.

    Raises `PlaceError`, in one line, for a device, a pipe or a socket, and `OSError` otherwise, as `open`.
    Reading raises `UnreadableError` where the file system fails, and where it has nothing to give yet.
    """
    raw = _RegularFile(path, opener=_opened)
    try:
        return BufferedReader(raw, max(os.fstat(raw.fileno()).st_blksize, DEFAULT_BUFFER_SIZE))
    except BaseException:
        raw.close()
        raise


class _RegularFile(FileIO):
    """A file whose reading gives bytes or raises `UnreadableError`.

    Regular files of some systems, such as /proc/kmsg, may have nothing to read yet. Python then reads None,
    which no library expects.
    """

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Reads into a buffer, and returns the number of bytes."""
        count: int = self._read(super().readinto, buffer)
        return count

    def read(self, size: int | None = -1) -> bytes:
        """Reads as many bytes at most, or all."""
        content: bytes = self._read(super().read, size)
        return content

    def readall(self) -> bytes:
        """Reads all that is left."""
        return self._read(super().readall)

    def _read(self, read: Callable[..., _Read | None], *arguments: object) -> _Read:
        try:
            found = read(*arguments)
        except OSError as error:
            why = f"cannot be read: {error.strerror}; copy it elsewhere, or give another file"
            raise UnreadableError(f"{self.name}: {why}") from error
        if found is None:
            raise UnreadableError(
                f"{self.name}: has nothing to read yet, as a device; give a file that is whole"
            )
        return found


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
