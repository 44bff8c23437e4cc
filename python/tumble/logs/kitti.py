"""The oxts folders of KITTI: a file of thirty numbers a sample, and a file with the time of each.

Source: dataformat.txt and readme.txt of the raw data development kit, https://www.cvlibs.net/datasets/kitti.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime, timezone
from itertools import chain, islice
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import note_input
from tumble.foundation.numbers import number_of, whole_number
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.logs.options import ReadOptions
from tumble.logs.track import (
    CHUNK_SAMPLES,
    DATE_AND_TIME,
    DOCUMENTED,
    LoggedImu,
    RawSamples,
    StatedUnit,
    Transform,
    choose,
)

_FIELDS = 30
_HEAD_SAMPLES = 1000
_ACCELEROMETER, _GYROSCOPE = slice(11, 14), slice(17, 20)
"""`ax ay az`, `wx wy wz`: x forward, y left, z up."""
_LARGEST_FILE = 1 << 12
_LONGEST_STAMP = 64
_STAMP = re.compile(rb"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)(?:\.(\d{1,9}))?")


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a folder is an oxts folder, or has one."""
    return not head and _oxts(path) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of a drive, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads the samples of a drive, synchronised or not."""
    choose(path, ("",), imu, "IMU")
    folder = _oxts(path)
    assert folder is not None
    stamps = folder / "timestamps.txt"
    timed = is_file(stamps) and options.rate is None
    if is_file(stamps):
        note_input(stamps)
    files = sorted(file.name for file in entries(folder / "data") if _number(file.name) is not None)
    if not files:
        raise LogError(f"{folder / 'data'}: holds no files of samples named 0000000000.txt; copy it again")

    def read(transform: Transform) -> Iterator[RawSamples]:
        return map(transform, _pieces(folder, files, timed=timed))

    return LoggedImu(
        path=path,
        imu="",
        format="kitti",
        read=read,
        head=lambda: next(_pieces(folder, files[:_HEAD_SAMPLES], timed=timed)),
        locate=lambda sample: f"file data/{files[sample]}",
        accelerometer_unit=StatedUnit("m/s^2", DOCUMENTED),
        gyroscope_unit=StatedUnit("rad/s", DOCUMENTED),
        time_unit=StatedUnit("ns", DATE_AND_TIME),
        frame="oxts",
        clock=f"{stamps.resolve()}",
        name=folder.resolve().parent.name if folder.name == "oxts" else folder.name,
        expected=len(files),
        already_corrected=True,
        notices=("the receiver takes its own estimates of bias off its samples before it gives them out",),
    )


def _oxts(path: Path) -> Path | None:
    """Returns the folder with `data`, where the first file in that is one of thirty numbers."""
    for folder in (path, path / "oxts"):
        data = folder / "data"
        if not is_folder(data):
            continue
        first = next((file for file in entries(data) if _number(file.name) is not None), None)
        if first is not None and (folder.name == "oxts" or len(_fields(first)) == _FIELDS):
            return folder
    return None


def _number(name: str) -> int | None:
    stem, dot, ending = name.partition(".")
    return whole_number(stem) if dot and ending == "txt" else None


def _fields(file: Path) -> list[bytes]:
    with open_regular(file) as stream:
        return stream.read(_LARGEST_FILE).split()


def _pieces(folder: Path, files: list[str], *, timed: bool) -> Iterator[RawSamples]:
    stamps = _stamps(folder / "timestamps.txt") if timed else None
    waiting, data = iter(files), folder / "data"
    while some := list(islice(waiting, CHUNK_SAMPLES)):
        rows = np.array(list(chain.from_iterable(_row(data / name) for name in some)))
        rows = rows.reshape(len(some), -1)
        time = None if stamps is None else _times_of(folder, some, stamps)
        yield RawSamples(time, rows[:, :3].copy(), rows[:, 3:].copy())


def _row(file: Path) -> list[float]:
    fields = _fields(file)
    chosen = (*fields[_ACCELEROMETER], *fields[_GYROSCOPE])
    numbers = [number for field in chosen if (number := number_of(field.decode("latin-1"))) is not None]
    if len(fields) != _FIELDS or len(numbers) != 6:
        raise LogError(f"{file}: does not hold {_FIELDS} numbers; copy it again, or move it elsewhere")
    return numbers


def _times_of(folder: Path, names: list[str], stamps: Iterator[tuple[int, float]]) -> FloatArray:
    """Returns the times of samples, which are numbered as the lines of `timestamps.txt` are, from 0."""
    times = []
    for name in names:
        wanted = _number(name)
        time = next((time for line, time in stamps if line == wanted), None)
        if time is None:
            raise LogError(
                f"{folder / 'timestamps.txt'}: has no time for data/{name}; copy it again, or give the rate "
                "with --rate"
            )
        times.append(time)
    return np.array(times)


def _stamps(file: Path) -> Iterator[tuple[int, float]]:
    """Returns number of line, from 0, and time in ns since 1970."""
    with open_regular(file) as stream:
        for number in range(1 << 62):
            line = stream.readline(_LONGEST_STAMP)
            if not line:
                return
            if line.strip():
                yield number, _nanoseconds(file, number, line.strip())


def _nanoseconds(file: Path, number: int, text: bytes) -> float:
    match = _STAMP.fullmatch(text)
    try:
        second = datetime.fromisoformat(match[1].decode() if match else "").replace(tzinfo=timezone.utc)
    except ValueError:
        shown = ascii(text.decode("ascii", "replace"))
        raise LogError(
            f"{file}: line {number + 1} holds {shown}, which is no date and time; repair that line, or give "
            "the rate with --rate"
        ) from None
    fraction = ((match[2] if match else b"") or b"").ljust(9, b"0")
    return float(int(second.timestamp()) * 1_000_000_000 + int(fraction))
