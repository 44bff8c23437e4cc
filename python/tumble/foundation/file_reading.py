"""The one place where files are read whole: never more than a limit, and never a device or a pipe."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from tumble.foundation.errors import PlaceError, TumbleError
from tumble.foundation.file_status import unusable
from tumble.foundation.files import note_input
from tumble.foundation.regular_files import UnreadableError, open_regular


def read_whole(
    path: Path | str,
    largest: int,
    what: str = "file",
    *,
    remedy: str = "give another file",
    error: type[TumbleError] = PlaceError,
) -> bytes:
    """Returns the content of a file of at most so many bytes, which is then protected as an input.

    `what` names what it should be. Raises `error`, in one line, for a folder, a device, a pipe or a socket, a
    larger file and one that cannot be read. No more than a byte beyond the limit is read, whatever the file
    system states as its size.
    """
    with opened(path, what, remedy=remedy, error=error) as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise error(f"{path}: is larger than {_size(largest)}, and no {what}; {remedy}")
    return content


@contextmanager
def opened(
    path: Path | str,
    what: str = "file",
    *,
    remedy: str = "give another file",
    error: type[TumbleError] = PlaceError,
) -> Iterator[BinaryIO]:
    """Opens a file of any length to be read piece by piece, which is then protected as an input.

    Raises as `read_whole`, whatever the length.
    """
    try:
        file = open_regular(path)
    except PlaceError as special:
        raise error(f"{path}: is a device or a pipe, and no {what}; {remedy}") from special
    except FileNotFoundError as missing:
        raise error(f"{path}: no such {what}; check the path") from missing
    except IsADirectoryError as folder:
        raise error(f"{path}: is a folder, and no {what}; {remedy}") from folder
    except (OSError, ValueError) as reason:
        raise error(unusable(path, reason)) from reason
    with file:
        note_input(Path(path))
        try:
            yield file
        except UnreadableError as reason:
            raise error(reason.why) from reason
        except (OSError, ValueError) as reason:
            raise error(unusable(path, reason)) from reason


def read_text_whole(
    path: Path | str,
    largest: int,
    what: str = "file",
    *,
    remedy: str = "give another file",
    error: type[TumbleError] = PlaceError,
) -> str:
    """Returns the text of a file in UTF-8, with or without its mark; raises as `read_whole`."""
    content = read_whole(path, largest, what, remedy=remedy, error=error)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise error(f"{path}: is no text in UTF-8, and no {what}; {remedy}") from reason


def bounded_lines(file: BinaryIO, longest: int) -> Iterator[tuple[int, bytes | None]]:
    """Yields the place, bytes from the beginning, and the bytes of each line; None for one that is longer.

    No more than `longest` bytes are held, however long a line is.
    """
    place = file.tell()
    while line := file.readline(longest):
        length, is_whole = len(line), line.endswith(b"\n") or len(line) < longest
        while not is_whole and (rest := file.readline(longest)):
            length, is_whole, line = length + len(rest), rest.endswith(b"\n"), b""
        yield place, line or None
        place += length


def own_text(path: Path) -> str:
    """Returns the text of a file that Tumble itself wrote or brings along."""
    return path.read_text(encoding="utf-8")


def _size(largest: int) -> str:
    return f"{largest >> 20} MiB" if largest >= 1 << 20 else f"{largest >> 10} KiB"
