"""Files of bags as `rosbags` opens them: by the one door, and databases without a name.

The library makes the address of a database from its path, in which `%`, `#` and `?` have a meaning: SQLite
would open another file than the one that was named.
"""

from __future__ import annotations

import os
from io import RawIOBase, TextIOWrapper
from itertools import count
from pathlib import Path
from typing import IO, Any

import apsw

from tumble.foundation.regular_files import open_regular
from tumble.logs.bounded_bags import bound_queries

_BEFORE, _BEHIND = "file:", "?immutable=1"
"""Text of the library before and behind the path of a database."""
_ADDRESS = f"{_BEFORE}/bag{_BEHIND}"
"""Address by which SQLite knows each database: nobody changes it, so that no journal is looked for."""
_numbers = count()


class BagPath(type(Path())):  # type: ignore[misc]  # Path itself has no subclasses before Python 3.12
    """Path of a bag, or of a file in it, that is opened as a regular file."""

    def open(self, mode: str = "r", *_: object, encoding: str | None = None, **__: object) -> IO[Any]:
        """Opens it to be read; raises `PlaceError` for a device or a pipe."""
        if mode == "rb":
            return open_regular(self)
        if mode != "r":
            raise ValueError(f"bags are read, and never opened with mode {mode}")
        return TextIOWrapper(open_regular(self), encoding=encoding or "utf-8")


class RegularDatabases:
    """Takes the place of `apsw` in the library: a database is the opened file, with bounded queries."""

    SQLITE_OPEN_READONLY = apsw.SQLITE_OPEN_READONLY
    SQLITE_OPEN_URI = apsw.SQLITE_OPEN_URI
    Error = apsw.Error

    @staticmethod
    def Connection(address: str, flags: int, vfs: str | None = None) -> apsw.Connection:  # noqa: N802
        """Opens the database at the path in an address; raises `PlaceError`, `OSError` and `ValueError`."""
        path = address.removeprefix(_BEFORE).removesuffix(_BEHIND)
        if vfs is not None or address != f"{_BEFORE}{path}{_BEHIND}":
            raise ValueError(f"the library opens its databases by another way: {address}")
        file = open_regular(path).detach()
        files = _OneFile(file)
        try:
            made = apsw.Connection(_ADDRESS, flags=flags, vfs=files.name)
        except BaseException:
            file.close()
            raise
        try:
            bound_queries(made, os.fstat(file.fileno()).st_size)
        except BaseException:
            made.close()
            raise
        return made


class _OneFile(apsw.VFS):
    """Lets SQLite see one file, and open any temporary one, but no other."""

    def __init__(self, file: RawIOBase) -> None:
        self.name = f"tumble-bag-{next(_numbers)}"
        self._file = file
        super().__init__(self.name, "")

    def xOpen(self, name: str | apsw.URIFilename | None, flags: list[int]) -> apsw.VFSFile:  # noqa: N802
        """Opens the one file, whatever it is called."""
        if name is None:  # rows that are sorted
            return super().xOpen(name, flags)
        return _File(self, self._file)


class _File(apsw.VFSFile):
    """A file that is read only."""

    def __init__(self, files: _OneFile, file: RawIOBase) -> None:
        self._files = files  # which SQLite needs for as long as this
        self._file = file

    def xDeviceCharacteristics(self) -> int:  # noqa: N802
        """Returns that nothing is known of the disk."""
        return 0

    def xSectorSize(self) -> int:  # noqa: N802
        """Returns that nothing is known of the disk."""
        return 0

    def xFileControl(self, op: int, ptr: int) -> bool:  # noqa: N802
        """Returns False: no control is known."""
        return False

    def xFileSize(self) -> int:  # noqa: N802
        """Returns the size, bytes."""
        return os.fstat(self._file.fileno()).st_size

    def xRead(self, amount: int, offset: int) -> bytes:  # noqa: N802
        """Returns some bytes, fewer at the end."""
        self._file.seek(offset)
        return self._file.read(amount) or b""

    def xClose(self) -> None:  # noqa: N802
        """Closes the file."""
        self._file.close()
