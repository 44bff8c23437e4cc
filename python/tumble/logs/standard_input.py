"""`-`: a log that is piped in."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import IO

from tumble.foundation.errors import LogError
from tumble.foundation.files import keep_stream
from tumble.foundation.temporary_folders import temporary_folder

NAME = "-"
_FILE_NAME = "standard_input"


class PipedLog(type(Path())):  # type: ignore[misc]  # the class of paths depends on the system
    """The file in which a piped log is kept; messages name it as it was typed."""

    __slots__ = ()

    def __fspath__(self) -> str:
        """Returns the path of the file, which `str` does not."""
        return str(Path(*self.parts))

    def __str__(self) -> str:
        return NAME


_folder: tempfile.TemporaryDirectory[str] | None = None
_kept: tuple[IO[str], PipedLog] | None = None


def nothing_piped(typed: str) -> LogError:
    """Reports that standard input, as it was typed, is the keyboard or closed."""
    return LogError(f"{typed}: nothing is piped in; give a file, or pipe a log into the command")


def piped_log() -> Path:
    """Copies standard input to a file, once, as a log is read more than once; the file goes with the process.

    Raises `LogError` where nothing is piped in, `OutputError` where there is no room for it.
    """
    global _folder, _kept
    if _kept is not None and _kept[0] is sys.stdin:
        return _kept[1]
    if sys.stdin is None or sys.stdin.isatty():
        raise nothing_piped(NAME)
    _folder = temporary_folder()
    path = PipedLog(_folder.name, _FILE_NAME)
    keep_stream(sys.stdin.buffer, path)
    _kept = (sys.stdin, path)
    return path
