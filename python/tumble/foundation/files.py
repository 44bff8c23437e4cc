"""The one place where files are written: whole or not at all, and never over something else.

A file replaces only a regular file of its own kind that bears the mark of Tumble, and never one that the
running command reads. Devices, pipes, folders, links and files with a second name are refused and kept. There
is no `-` for standard output: a result that was cut short must not look like a whole one.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache, wraps
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO, TypeAlias, TypeVar

from tumble.foundation.debugging import debug
from tumble.foundation.errors import OutputError
from tumble.foundation.file_status import (
    entries,
    exists,
    is_file,
    is_folder,
    is_link,
    is_special,
    stands_there,
    status_of,
)
from tumble.foundation.folder_lock import FolderLock, is_lock
from tumble.foundation.regular_files import open_regular
from tumble.foundation.words import utf8

FileIdentity: TypeAlias = tuple[int, int]
"""Device and inode: the same for all names of one file."""

_HEAD_BYTES = 16_384
"""Number of bytes read from a file to detect its kind."""
_TAIL_BYTES = 1 << 17
"""Number of bytes at the end of a file that may hold its mark: metadata of Parquet and PDF are there."""
BY_TUMBLE = re.compile(rb"\bby [Tt]umble\b")
"""Mark of text whose head states in a comment that Tumble wrote it; to name Tumble is no mark."""
HEAD_OF_OURS = "# Written by Tumble"
"""Comment that marks a table."""
NO_MARK = re.compile(rb"(?!)")
"""Mark of formats without a place for one: such a file never replaces another."""
_TEMPORARY = re.compile(r"\.[0-9a-f]{16}\.tmp")
"""Name of a file that is being written, and that a killed process leaves."""
_APPENDING = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
"""Flags that open a file of this very name to append to it, or make it."""
_MOST_NAMED = 20
"""Files of one folder that a remark names one by one."""
_MOST_KEPT = 16
"""Files of which is kept what was read."""

Found = TypeVar("Found")
"""Result of reading a file."""


@dataclass(frozen=True, slots=True)
class FileKind:
    """Kind of a file, as far as its beginning shows."""

    name: str
    """`an HTML page`: for messages."""
    start: re.Pattern[bytes]
    """Pattern in the first bytes of every file of this kind."""
    mark: re.Pattern[bytes] | None = None
    """Pattern in the first or last bytes of every such file that Tumble wrote; None where `start` is one."""

    def begins(self, path: Path) -> bool:
        """Returns whether the file is of this kind; an empty file is of any kind, a device of none."""
        if is_special(path):
            return False
        with open_regular(path) as file:
            head = file.read(_HEAD_BYTES)
        return not head or self.start.search(head) is not None

    def is_marked(self, path: Path) -> bool:
        """Returns whether Tumble wrote a file of this kind; of an empty file nothing could be lost."""
        if not self.begins(path):
            return False
        if self.mark is None:
            return True
        with open_regular(path) as file:
            head = file.read(_HEAD_BYTES)
            file.seek(max(len(head), file.seek(0, os.SEEK_END) - _TAIL_BYTES))
            tail = file.read(_TAIL_BYTES)
        return not head or any(self.mark.search(part) is not None for part in (head, tail))


PAGE = FileKind(
    "an HTML page",
    re.compile(rb"\A\s*<!doctype html", re.IGNORECASE),
    re.compile(rb'<meta name="generator" content="Tumble">'),
)


@dataclass(slots=True)
class FilesOfCommand:
    """Files that the running command reads, has written and has replaced."""

    inputs: dict[FileIdentity, Path] = field(default_factory=dict)
    replaced: list[Path] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    made: list[Path] = field(default_factory=list)
    """Folders, one in another the inner first."""
    documents: dict[Path, object] = field(default_factory=dict)
    """Documents among what was written, as they were before they became text."""
    locks: dict[FileIdentity, FolderLock] = field(default_factory=dict)
    """Locks of the folders that the command writes into."""

    def hold(self, folder: Path) -> None:
        """Locks a folder to the end of the command; raises `OutputError` where another run writes into it."""
        identity = _identity(folder)
        if identity not in self.locks:
            self.locks[identity] = FolderLock(folder)

    def release(self) -> None:
        """Releases the lock for other writers."""
        while self.locks:
            self.locks.popitem()[1].release()

    def remarks(self) -> Iterator[str]:
        """Names every file that was replaced, a line for each folder."""
        for folder in dict.fromkeys(path.parent for path in self.replaced):
            names = [path.name for path in self.replaced if path.parent == folder]
            more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
            yield f"replaced in {folder}: {', '.join(names[:_MOST_NAMED])}{more}"


_running: FilesOfCommand | None = None


@contextmanager
def files_of_command() -> Iterator[FilesOfCommand]:
    """Keeps account, while the block runs, of what is read, which is then protected, and what is replaced.

    Folders that it writes into are its own until then; where it ends with an error none is left empty that it
    made.
    """
    global _running
    outer, files = _running, FilesOfCommand()
    _running = files
    try:
        yield files
    except BaseException:
        files.release()
        remove_empty(files.made)
        raise
    finally:
        _running = outer
        files.release()


def note_input(path: Path) -> None:
    """Protects a file that the running command reads; to be called wherever a file of the user is opened."""
    if _running is not None and is_file(path):
        _running.inputs.setdefault(_identity(path), path)


def note_document(path: Path | str, document: object) -> None:
    """Keeps a document that the running command has written, so that nobody needs to read it again."""
    if _running is not None:
        _running.documents[Path(path)] = document


def files_written() -> tuple[Path, ...]:
    """Return the files that the running command has written so far, each once; none where no command runs."""
    return () if _running is None else tuple(dict.fromkeys(_running.written))


def once_per_file(read: Callable[[Path], Found]) -> Callable[[Path], Found]:
    """Makes a function read a file again only after its size or time of change differs."""

    @lru_cache(_MOST_KEPT)
    def kept(path: Path, _size: int, _changed: int) -> Found:
        return read(path)

    @wraps(read)
    def reading(path: Path) -> Found:
        status = path.stat()
        return kept(path, status.st_size, status.st_mtime_ns)

    return reading


@contextmanager
def replacing(
    path: Path | str,
    kind: FileKind,
    *,
    inputs: Iterable[Path] = (),
    renews: bool = False,
    durable: bool = False,
) -> Iterator[BinaryIO]:
    """Opens a new file, which takes the place of `path` once the block ends without an error.

    `inputs` are not to be replaced, besides those of the running command. With `renews` the old content was
    read and is part of the new one: it is neither a protected input nor reported as replaced. With `durable`
    the file survives a loss of power once the block has ended.

    Raises `OutputError` where the place cannot be written to, or holds anything but a regular file of this
    kind. After any error `path` is as it was.
    """
    path = Path(path)
    try:
        place = check_output(path, kind, inputs=inputs, renews=renews)
        stood_there = stands_there(place)
        temporary = place.with_name(f".{os.urandom(8).hex()}.tmp")
        try:
            with temporary.open("xb") as file:
                yield file
                if durable:
                    file.flush()
                    os.fsync(file.fileno())
            if stands_there(place):  # another process may have put something there meanwhile
                _check_replaceable(place, kind, inputs, renews)
            temporary.replace(place)
            if _running is not None:
                _running.written.append(place)
            if durable:
                _sync_folder(place.parent)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(_cannot_write(path, error)) from error
    debug(__name__, "wrote %s%s", path, " in place of what stood there" if stood_there else "")
    if stood_there and not renews and _running is not None and path not in _running.replaced:
        _running.replaced.append(path)


def _sync_folder(folder: Path) -> None:
    """Flushes the names in a folder to disk; Windows, which opens no folders, does so by itself."""
    if os.name == "nt":
        return
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def check_output(
    path: Path | str, kind: FileKind, *, inputs: Iterable[Path] = (), renews: bool = False
) -> Path:
    """Place that `replacing` would write to, or raises its errors before any long work is done."""
    path = Path(path)
    if str(path) == "-":
        raise OutputError("-: results are written to files, not to standard output; give a file name")
    try:
        place = path.parent.resolve() / path.name
        if is_link(path):
            _check_replaceable(path, kind, inputs, renews)
        if is_folder(place):
            raise OutputError(f"{path}: is a folder, not a file to write to; give a file name")
        if is_file(place.parent):
            raise OutputError(f"{path}: {path.parent} is a file, no folder to write in; give another folder")
        if not is_folder(place.parent):
            raise OutputError(f"{path}: folder {place.parent} does not exist; create it first")
        if stands_there(path):
            _check_replaceable(path, kind, inputs, renews)
    except (OSError, RuntimeError) as error:  # RuntimeError: links that lead around, before Python 3.13
        raise OutputError(_cannot_write(path, error)) from error
    return place


def write_text(path: Path | str, text: str, kind: FileKind, *, renews: bool = False) -> None:
    """Writes text with `replacing`; text that is not UTF-8, as in names of files, is written escaped."""
    with replacing(path, kind, renews=renews) as file:
        file.write(utf8(text))


def append_line(path: Path, line: str) -> int:
    """Appends a line and returns the byte at which it begins; one that was cut short before it ends there.

    Raises `OutputError` where that cannot be done, or the name is no regular file of its own.
    """
    refuse_others_name(path)
    try:
        with os.fdopen(os.open(path, _APPENDING, 0o666), "rb+") as file:
            place = file.seek(0, os.SEEK_END)
            if place:
                file.seek(place - 1)
                place += file.read(1) != b"\n"
            file.write(b"\n" * (place - file.seek(0, 2)) + utf8(line) + b"\n")
    except OSError as error:
        raise OutputError(_cannot_write(path, error)) from error
    return place


def keep_stream(stream: BinaryIO, path: Path) -> None:
    """Copies what is piped in to a new file; raises `OutputError` where that cannot be done."""
    try:
        with path.open("xb") as file:
            shutil.copyfileobj(stream, file)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be kept while it is read: {error.strerror}; name a folder with room by TMPDIR"
        ) from error


def move_into(path: Path, folder: Path, name: str) -> Path:
    """Moves a file to a folder beside it under a name, or under `-2`, `-3` ... of it; returns its place.

    Raises `OutputError` where that cannot be done.
    """
    stem, ending = Path(name).stem, Path(name).suffix
    refuse_others_name(path)
    refuse_linked_folder(folder)
    try:
        folder.mkdir(exist_ok=True)
        free = (folder / f"{stem}{again}{ending}" for again in chain([""], (f"-{n}" for n in count(2))))
        return path.rename(next(place for place in free if not stands_there(place)))
    except OSError as error:
        raise OutputError(f"{path}: cannot be moved to {folder}: {error.strerror}") from error


def move_to(path: Path, place: Path) -> None:
    """Renames a file that we made, once it is whole; raises `OutputError` where that cannot be done."""
    if stands_there(place):
        raise OutputError(f"{place}: is there already, and is kept; give another place")
    try:
        path.rename(place)
    except OSError as error:
        raise OutputError(_cannot_write(place, error)) from error


def set_aside(path: Path) -> Path:
    """Renames a file to the first free of `.rejected`, `.rejected-2` ...: nothing is lost.

    Raises `OutputError` where that cannot be done.
    """
    refuse_others_name(path)
    number, aside = 1, path.with_name(f"{path.name}.rejected")
    while stands_there(aside):
        number += 1
        aside = path.with_name(f"{path.name}.rejected-{number}")
    try:
        return path.rename(aside)
    except OSError as error:
        raise OutputError(f"{path}: cannot be set aside: {error.strerror}; nothing was changed") from error


def write_shared(path: Path, content: bytes, kind: FileKind, root: Path) -> None:
    """Writes a file whole or not at all, in a folder below `root` into which other processes write as well.

    Neither is the folder locked, nor the file protected: whoever writes it last wins. A process that is
    killed leaves an unfinished file, which nothing reads. Raises `OSError`, and `OutputError` where anything
    but a file of Tumble and of this kind stands there.
    """
    refuse_links_to(path, root)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{os.urandom(8).hex()}.unfinished")
    try:
        with unfinished.open("xb") as file:
            file.write(content)
        _refuse_others(path, kind)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def remove_made(*paths: Path, kind: FileKind | None = None) -> None:
    """Removes files that we made and that others of ours replace; one that is gone is no matter.

    Raises `OutputError` where that cannot be done, and for a file that bears no mark of Tumble. Without a
    kind the files are those that this process has just made.
    """
    for path in paths:
        try:
            _refuse_others(path, kind) if kind is not None else refuse_others_name(path)
            path.unlink(missing_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise OutputError(f"{path}: cannot be removed: {reason}; remove it by hand") from error


def remove_folder(folder: Path, kind: FileKind) -> None:
    """Removes the files of a kind from a folder that we made, and the folder unless others' files are in it.

    Raises `OutputError` where that cannot be done, or the name is a link or no folder.
    """
    if not stands_there(folder):
        return
    refuse_linked_folder(folder)
    try:
        for path in entries(folder):
            if not _is_own_name(path):
                continue
            if is_lock(path) or _TEMPORARY.fullmatch(path.name) or kind.is_marked(path):
                path.unlink(missing_ok=True)
        remove_empty([folder])
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"{folder}: cannot be removed: {reason}; remove it by hand") from error


def link(path: Path, target: str) -> None:
    """Creates a symbolic link to a device, in place of one that an earlier run made.

    Raises `OutputError` where it cannot be made, and where anything but a link to a device stands there.
    """
    _made(path.parent)
    try:
        if is_link(path):
            if not str(path.readlink()).startswith("/dev/"):
                raise OutputError(f"{path}: is a link to {path.readlink()}, and is kept; give another name")
            path.unlink()
        path.symlink_to(target)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be linked: {error.strerror or error}; give another folder"
        ) from error


def remove_link(path: Path, target: str) -> None:
    """Removes a symbolic link that we made, if it is still there and leads to its target."""
    if is_link(path) and str(path.readlink()) == target:
        path.unlink()


def set_attribute(path: Path, value: str) -> None:
    """Sets an attribute of a device that sysfs shows as a file; raises `OSError` where the kernel refuses."""
    path.write_text(value)


def prepare_folder(folder: Path | str) -> Path:
    """Creates `folder` where it is missing and proves early that files can be written in it.

    It is then the running command's to write into. Raises `OutputError` where it cannot be made or written
    to, or another command writes into it.
    """
    folder = _made(Path(folder))
    if _running is not None:
        _running.hold(folder)
    return folder


def make_file(path: Path) -> None:
    """Make an empty file where there is none; raises `OutputError` where that cannot be done."""
    refuse_others_name(path)
    try:
        os.close(os.open(path, _APPENDING, 0o666))
    except OSError as error:
        raise OutputError(f"{path}: cannot be made: {error.strerror or error}; give another place") from error


def make_new_file(path: Path, content: bytes, *, is_secret: bool = False) -> None:
    """Write a file that is not there yet, readable by its owner only where it is secret.

    Raises `OutputError` where there is one of that name, or it cannot be written.
    """
    try:
        how = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        opened = os.open(path, how, 0o600 if is_secret else 0o666)
        try:
            with os.fdopen(opened, "wb") as file:
                file.write(content)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
    except FileExistsError:
        raise OutputError(f"{path}: is there already, and is kept; give another name") from None
    except OSError as error:
        raise OutputError(f"{path}: cannot be made: {error.strerror or error}; give another place") from error


def prepare_inner_folder(folder: Path) -> Path:
    """Prepares a folder that we name within another one, as `prepare_folder` does; a link is refused."""
    refuse_linked_folder(folder)
    return prepare_folder(folder)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it where they are missing; raises `OutputError` where that fails.

    A link at the folder itself, which we name, is refused.
    """
    refuse_linked_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{folder}: cannot be made: {error.strerror or error}; give another place"
        ) from error


def hold_folder(folder: Path) -> Callable[[], None]:
    """Locks a folder until the returned function is called; a running command locks it to its end.

    Raises `OutputError` where another run writes into it.
    """
    if _running is None:
        return FolderLock(folder).release
    _running.hold(folder)
    return lambda: None


def _made(folder: Path) -> Path:
    """Creates a folder where it is missing; raises `OutputError` where it cannot."""
    if _running is not None:
        _running.made[:0] = missing_folders(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{os.urandom(8).hex()}.tmp"
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as error:
        raise OutputError(
            f"{folder}: cannot write in this output folder: {error.strerror}; choose another one"
        ) from error
    return folder


def missing_folders(folder: Path) -> list[Path]:
    """Lists the folders that are to be made for `folder` to be there, itself first."""
    return [each for each in (folder, *folder.parents) if not exists(each)]


def remove_empty(folders: Iterable[Path]) -> None:
    """Removes folders that we made, one in another, as far as there is nothing in them."""
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            continue


@contextmanager
def no_empty_folder(folder: Path) -> Iterator[None]:
    """Removes a folder that the block created and left empty with an error."""
    missing = missing_folders(folder)
    try:
        yield
    except BaseException:
        remove_empty(missing)
        raise


def _is_own_name(path: Path) -> bool:
    """Returns whether a regular file stands there that has no other name, neither by a link."""
    status = status_of(path, follow=False)
    return status is not None and stat.S_ISREG(status.st_mode) and status.st_nlink == 1


def refuse_others_name(path: Path) -> None:
    """Raises `OutputError` where writing would reach another file, or wait: by a link, a device or a pipe."""
    # Another program may remove it at any time: one look decides.
    status = status_of(path, follow=False)
    if status is None or stat.S_ISDIR(status.st_mode):
        return
    if stat.S_ISLNK(status.st_mode):
        raise OutputError(f"{path}: is a link, and is kept; give a name that is none, or remove it first")
    if not stat.S_ISREG(status.st_mode):
        raise OutputError(f"{path}: is a device or a pipe, not a file to write to; give a file name")
    if status.st_nlink > 1:
        raise OutputError(
            f"{path}: is another file too, by a hard link, and is kept; give another name, or remove it first"
        )


def refuse_links_to(path: Path, root: Path) -> None:
    """Raises `OutputError` where a link is among the folders below `root`, which are ours, of a file."""
    for folder in (each for each in path.parents if root in each.parents):
        refuse_linked_folder(folder)


def refuse_linked_folder(folder: Path) -> None:
    """Raises `OutputError` where a link, or anything but a folder, has the name of a folder that we make."""
    if is_link(folder):
        raise OutputError(f"{folder}: is a link, and is kept; give another folder, or remove it first")
    if stands_there(folder) and not is_folder(folder):
        raise OutputError(f"{folder}: is no folder, and is kept; give another folder, or remove it first")


def _refuse_others(path: Path, kind: FileKind) -> None:
    """Raises `OutputError` for a file that Tumble did not write; another process may remove it meanwhile."""
    with suppress(FileNotFoundError, NotADirectoryError):
        _refuse_unmarked(path, kind)


def _refuse_unmarked(path: Path, kind: FileKind) -> None:
    """Raises `OutputError` for a file that Tumble did not write."""
    refuse_others_name(path)
    if not kind.begins(path):
        raise OutputError(f"{path}: is not {kind.name}, and is kept; give another name, or remove it first")
    if not kind.is_marked(path):
        raise OutputError(
            f"{path}: is not of Tumble, which marks its own files, and is kept; give another name, or remove "
            "it first"
        )


def _check_replaceable(path: Path, kind: FileKind, inputs: Iterable[Path], renews: bool) -> None:
    read = {} if renews or _running is None else _running.inputs
    read = read | {_identity(each): each for each in inputs if is_file(each)}
    with suppress(OSError):  # a link that leads nowhere, or around
        if (source := read.get(_identity(path))) is not None:
            raise OutputError(f"{path}: is what is read ({source}); give another name, so that it is kept")
    _refuse_unmarked(path, kind)


def _identity(path: Path) -> FileIdentity:
    status = path.stat()
    return status.st_dev, status.st_ino


def _cannot_write(path: Path, error: OSError | RuntimeError) -> str:
    reason = getattr(error, "strerror", None) or error
    return f"{path}: cannot be written: {reason}; what was there before is untouched"
