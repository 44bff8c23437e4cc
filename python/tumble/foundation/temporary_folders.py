"""Copies of files of others in a temporary folder: within what is free, and gone however the program ends."""

from __future__ import annotations

import os
import shutil
import signal
import threading
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO
from weakref import WeakSet

from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_status import unusable
from tumble.foundation.regular_files import open_regular

_folders: WeakSet[TemporaryDirectory[str]] = WeakSet()
"""Folders that this process has made, and that are still there."""
_process = 0
"""Number of the process that made them: a fork of it leaves them alone."""


def temporary_folder() -> TemporaryDirectory[str]:
    """Makes a folder that is removed with what is returned, and where a signal ends the program."""
    global _process
    if _process != os.getpid():
        _process = os.getpid()
        _folders.clear()
    folder = TemporaryDirectory(prefix="tumble-")
    _folders.add(folder)
    _heed_signals()
    return folder


def copied_aside(parts: Iterable[Path], name: str = "") -> TemporaryDirectory[str]:
    """Copies files into a temporary folder, or into a folder of that name in it.

    Raises `OutputError` for more bytes than `refuse_large_copy` allows, and what `open_regular` raises.
    """
    aside = temporary_folder()
    folder = Path(aside.name) / name
    try:
        folder.mkdir(exist_ok=True)
        with ExitStack() as stack:
            files = {path: stack.enter_context(open_regular(path)) for path in parts}
            sizes = {path: os.fstat(file.fileno()).st_size for path, file in files.items()}
            if files:
                refuse_large_copy(str(next(iter(files))), sum(sizes.values()), folder, OutputError)
            for path, file in files.items():
                _copy(file, sizes[path], folder / path.name)
    except BaseException:
        aside.cleanup()
        raise
    return aside


def refuse_large_copy(about: str, size: int, folder: Path, error: type[TumbleError]) -> None:
    """Raises `error` where files of so many bytes take more than half of what is free at a folder of ours."""
    free = shutil.disk_usage(folder).free
    if size > free / 2:
        raise error(
            f"{about}: has {size >> 20} MiB, and {free >> 20} MiB are free for copies; name a folder with "
            "room by TMPDIR"
        )


def _copy(file: BinaryIO, size: int, place: Path) -> None:
    """Copies so many bytes at most: a file may grow meanwhile."""
    try:
        with place.open("xb") as copy:
            while size > 0 and (block := file.read(min(size, 1 << 20))):
                size -= len(block)
                copy.write(block)
    except OSError as error:
        raise OutputError(f"{unusable(place, error)}, or name another folder by TMPDIR") from error


def _heed_signals() -> None:
    """Has signals that would end the program at once remove the folders first."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _end)


def _end(number: int, _frame: object) -> None:
    if _process == os.getpid():
        for folder in list(_folders):
            folder.cleanup()
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
