"""Which reader a file needs: by its first bytes, and by its contents where those do not decide.

A reader, and the library it is made with, is imported when a file needs it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol, cast

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, exists, is_file, is_folder, is_special
from tumble.foundation.files import note_input
from tumble.foundation.log_formats import LOG_FORMATS, NO_LOGS, LogFormat, NoLog, Packing, packing_of
from tumble.foundation.regular_files import open_regular
from tumble.logs.damage import COPY_OR_SAVE, damage_said
from tumble.logs.optional import imported
from tumble.logs.options import ReadOptions
from tumble.logs.text_file import open_text
from tumble.logs.track import LoggedImu, LoggedMagnetometer, RawMagnetic, RawSamples, Transform

HEAD_BYTES = 4096
"""Number of bytes of a file by which its reader is found."""
_ZIP_INDEX_BYTES = 1 << 16
_FEW_ZEROS = 4
"""Bytes that a serial line garbles in a text, which is text all the same."""
FOLDER = "folder"
"""Format of a folder that is none of the others: it may hold one log a pose."""


class Reader(Protocol):
    """Interface of the module of a format."""

    def recognises(self, path: Path, head: bytes) -> bool:
        """Returns whether a file, or a folder, is of this format; `head` is empty for a folder."""
        ...

    def open_logged_imu(self, path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
        """Finds one IMU; raises `LogError` where there is no such one, or several and none is named."""
        ...

    def list_imus(self, path: Path, options: ReadOptions) -> tuple[str, ...]:
        """Returns the names of its IMUs; one that needs no name has an empty one."""
        ...


class ParameterReader(Reader, Protocol):
    """Interface of the module of a format whose logs hold the parameters of firmware."""

    def parameters_in(self, path: Path) -> Mapping[str, float]:
        """Returns the parameters as they were when the log ended."""
        ...


def reader_of(log_format: LogFormat, path: Path) -> Reader:
    """Imports the reader of a format; raises `LogError` where a library that it needs is not installed."""
    return cast("Reader", imported(f"tumble.logs.{log_format.module}", path, log_format.extra))


def find_format(path: Path) -> str:
    """Returns the name of a file's format, or `FOLDER`.

    Raises `LogError` where the file is empty, cannot be opened, or is known not to be a log.
    """
    found = _find(path)
    return FOLDER if found is None else found.name


def firmware_parameters(path: Path) -> tuple[str, Mapping[str, float]] | None:
    """Returns the firmware whose log this is, and its parameters; None for what is no log of firmware.

    Raises `LogError` where the log is damaged before it holds any.
    """
    if not is_file(path) or not path.stat().st_size:
        return None
    head = _head(path)
    for each in LOG_FORMATS:
        if each.firmware and head.startswith(each.begins):
            return each.firmware, cast("ParameterReader", reader_of(each, path)).parameters_in(path)
    return None


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Opens a file, or a bag folder, with the reader it needs."""
    reader = _reader_for(path)
    with damage_said(path, COPY_OR_SAVE):
        return _with_damage_said(reader.open_logged_imu(path, imu, options))


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of the IMUs in a file or bag folder; an IMU that needs no name has an empty one."""
    reader = _reader_for(path)
    with damage_said(path, COPY_OR_SAVE):
        return reader.list_imus(path, options)


def _with_damage_said(log: LoggedImu) -> LoggedImu:
    """Returns an IMU whose samples are read within `damage_said`, too: damage stands anywhere in a file."""
    read, magnetometer = log.read, log.magnetometer

    def samples(transform: Transform) -> Iterator[RawSamples]:
        with damage_said(log.path, COPY_OR_SAVE):
            yield from read(transform)

    def head() -> RawSamples:
        with damage_said(log.path, COPY_OR_SAVE):
            return log.head()

    return replace(
        log, read=samples, head=head, magnetometer=magnetometer and _with_its_damage_said(log, magnetometer)
    )


def _with_its_damage_said(log: LoggedImu, magnetometer: LoggedMagnetometer) -> LoggedMagnetometer:
    def readings() -> RawMagnetic:
        with damage_said(log.path, COPY_OR_SAVE):
            return magnetometer.read()

    return replace(magnetometer, read=readings)


def _reader_for(path: Path) -> Reader:
    found = _find(path)
    if found is None:
        raise LogError(f"{path}: a folder, not a log; name one of its files")
    return reader_of(found, path)


def _find(path: Path) -> LogFormat | None:
    """Finds the format of a file, or of a folder; None for a folder of none."""
    if is_folder(path):
        return _folder_of(path) or _recognised(path, b"")
    if is_special(path):
        raise LogError(f"{path}: is a device or a pipe, not a log; give a file, or pipe it in and give -")
    head = _head(path)
    packing = packing_of(head)
    if packing is None and (begun := _begun(head)):
        return begun
    with open_text(path) as file:
        head = file.read(HEAD_BYTES)
    if packing is not None:
        _refuse_packed(path, head, packing)
    # First bytes decide before patterns do, which stand anywhere in the head.
    no_log = next((each for each in NO_LOGS if each.begins and head.startswith(each.begins)), None)
    if no_log is None or head.startswith(b"PK"):
        found = _recognised(path, head)
        if found is not None:
            return found
        no_log = _no_log(path, head)
    if no_log is not None:
        raise LogError(f"{path}: not a log but {no_log.what}; {no_log.remedy}")
    if any(each.binary and path.suffix in each.endings for each in LOG_FORMATS):
        raise LogError(f"{path}: does not start like a {path.suffix} file; copy it again, or rename it")
    return LOG_FORMATS[-1]


def _begun(head: bytes) -> LogFormat | None:
    return next((each for each in LOG_FORMATS if head.startswith(each.begins)), None)


def _no_log(path: Path, head: bytes) -> NoLog | None:
    """Finds what a file that is no log is; the names in a ZIP archive stand at its end."""
    if head.startswith(b"PK"):
        with open_regular(path) as file:
            file.seek(max(0, path.stat().st_size - _ZIP_INDEX_BYTES))
            head += file.read()
    for each in NO_LOGS:
        if head.startswith(each.begins) or (each.pattern and re.search(each.pattern, head)):
            return each
    return None


def _refuse_packed(path: Path, head: bytes, packing: Packing) -> None:
    """Raises `LogError` where what is packed is no text, which alone is read packed."""
    if not head:
        raise LogError(f"{path}: holds nothing, packed by {packing.name}; record or copy it again")
    binary = _begun(head)
    what = f"the format {binary.name}" if binary else ""
    if not binary and (no_log := _no_log(path, head)):
        what = f"{no_log.what}; {no_log.remedy}"
    elif not binary and head.count(b"\x00") > _FEW_ZEROS:
        what = "no text"
    if what:
        unpack = f"{packing.unpack} {path.name}"
        raise LogError(
            f"{path}: only text is read packed, and this {packing.name} file holds {what}: {unpack}"
        )


def _folder_of(path: Path) -> LogFormat | None:
    for each in LOG_FORMATS:
        if each.folder_with and exists(path / each.folder_with):
            for part in entries(path):
                if is_special(part):
                    raise LogError(f"{part}: is a device or a pipe, not a part of a log; remove it")
                note_input(part)
            return each
    return None


def _head(path: Path) -> bytes:
    note_input(path)
    try:
        with open_regular(path) as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise LogError(f"{path}: cannot be opened: {error.strerror}") from error
    if not head:
        raise LogError(f"{path}: is empty; record or copy it again")
    return head


def _recognised(path: Path, head: bytes) -> LogFormat | None:
    """Finds the pattern of a format, and asks those readers that look inside, in their order."""
    for each in LOG_FORMATS:
        if head and each.pattern:
            if not re.search(each.pattern, head):
                continue
            if not each.looks_inside:
                return each
        if each.looks_inside and reader_of(each, path).recognises(path, head):
            return each
    return None
