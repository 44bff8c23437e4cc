"""A folder that one run writes into at a time.

The lock is the kernel's, on a file in the folder: it ends with the process, however that ends, so that what a
killed run leaves stops nobody.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from tumble.foundation.errors import OutputError
from tumble.foundation.numbers import whole_number
from tumble.foundation.regular_files import open_regular

LOCK_FILE = ".tumble.lock"
_LONGEST_OWNER = 20


def is_lock(path: Path) -> bool:
    """Returns whether a file that bears the name of a lock is one, of this run or of one that was killed."""
    if path.name != LOCK_FILE:
        return False
    with open_regular(path) as file:
        owner = file.read(_LONGEST_OWNER + 1).decode("ascii", "replace")
    return not owner or whole_number(owner) is not None


class FolderLock:
    """Holds a folder from when it is made until `release`, or the end of the process.

    Raises `OutputError` where another run holds it, or the name of the lock is a link or another's file,
    which is kept. File systems that have no locks are not held.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOCK_FILE
        self._file = _opened(self.path)
        while not self._is_ours():
            os.close(self._file)
            self._file = _opened(self.path)
        self._refuse_foreign()
        with suppress(OSError):  # on a full disk a lock holds that names nobody
            os.truncate(self._file, 0)
            os.write(self._file, str(os.getpid()).encode())

    def release(self) -> None:
        """Releases the lock. The file is removed while locked: a moment later it could be of another run."""
        if os.name != "nt":
            self._remove()
        os.close(self._file)
        if os.name == "nt":
            self._remove()

    def _remove(self) -> None:
        try:
            self.path.unlink(missing_ok=True)
        except NotADirectoryError as error:
            raise OutputError(
                f"{self.path.parent}: was a folder that this run wrote into, and is none any more; restore it"
            ) from error

    def _refuse_foreign(self) -> None:
        """Raises `OutputError` for a file that holds anything but the number of a process."""
        if whole_number(owner := self._owner()) is None and owner:
            os.close(self._file)
            raise _kept(self.path)

    def _owner(self) -> str:
        """Returns the beginning of the lock: the process that made it."""
        return os.pread(self._file, _LONGEST_OWNER, 0).decode("ascii", "replace") if _PREAD else ""

    def _is_ours(self) -> bool:
        """Locks the file, unless who held it has removed it meanwhile."""
        try:
            _lock(self._file)
        except BlockingIOError:
            owner = self._owner()
            os.close(self._file)
            by = f" (process {owner})" if whole_number(owner) is not None else ""
            raise OutputError(
                f"{self.path.parent}: another run{by} writes into this folder; wait for it to end, or give "
                "another folder"
            ) from None
        except OSError:
            return True
        try:
            return os.path.samestat(self.path.lstat(), os.fstat(self._file))
        except FileNotFoundError:
            return False


_PREAD = hasattr(os, "pread")
_OPENING = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


def _opened(path: Path) -> int:
    """Opens the lock, or makes it; never what a link leads to, and nothing that has a second name."""
    try:
        file = os.open(path, _OPENING, 0o666)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.EMLINK):  # a link, as systems report it
            raise _kept(path) from error
        raise
    status = os.fstat(file)
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        os.close(file)
        raise _kept(path)
    return file


def _kept(path: Path) -> OutputError:
    return OutputError(
        f"{path}: has the name of Tumble's lock and is none, and is kept; give another folder, or remove it"
    )


def _locking() -> Callable[[int], None]:
    """Returns what locks an open file; it raises `BlockingIOError` where another process has."""
    try:
        import fcntl
    except ImportError:
        import msvcrt

        def lock(file: int) -> None:
            try:
                msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
            except PermissionError as error:
                raise BlockingIOError from error
    else:

        def lock(file: int) -> None:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    return lock


_lock = _locking()
