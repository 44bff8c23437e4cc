"""A folder that one run writes into at a time.

The lock is the kernel's, on a file in the folder: it ends with the process, however that ends, so that what a
killed run leaves stops nobody.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from tumble.foundation.errors import OutputError
from tumble.foundation.numbers import whole_number

LOCK_FILE = ".tumble.lock"
_LONGEST_OWNER = 20


class FolderLock:
    """Holds a folder from when it is made until `release`, or the end of the process.

    Raises `OutputError` where another run holds it. File systems that have no locks are not held.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOCK_FILE
        self._file = _opened(self.path)
        while not self._is_ours():
            os.close(self._file)
            self._file = _opened(self.path)
        with suppress(OSError):  # on a full disk a lock holds that names nobody
            os.truncate(self._file, 0)
            os.write(self._file, str(os.getpid()).encode())

    def release(self) -> None:
        """Releases the lock. The file is removed while locked: a moment later it could be of another run."""
        if os.name != "nt":
            self.path.unlink(missing_ok=True)
        os.close(self._file)
        if os.name == "nt":
            self.path.unlink(missing_ok=True)

    def _is_ours(self) -> bool:
        """Locks the file, unless who held it has removed it meanwhile."""
        try:
            _lock(self._file)
        except BlockingIOError:
            owner = os.pread(self._file, _LONGEST_OWNER, 0).decode("ascii", "replace") if _PREAD else ""
            os.close(self._file)
            by = f" (process {owner})" if whole_number(owner) is not None else ""
            raise OutputError(
                f"{self.path.parent}: another run{by} writes into this folder; wait for it to end, or give "
                "another folder"
            ) from None
        except OSError:
            return True
        try:
            return os.path.samestat(self.path.stat(), os.fstat(self._file))
        except FileNotFoundError:
            return False


_PREAD = hasattr(os, "pread")


def _opened(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)


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
