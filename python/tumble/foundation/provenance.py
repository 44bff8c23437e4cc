"""Where a result comes from: when, by whom, at which station, and from which bytes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from tumble.foundation import clock
from tumble.foundation.days import moment_text
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.files import once_per_file
from tumble.foundation.folder_lock import LOCK_FILE
from tumble.foundation.log_reading import LogReading
from tumble.foundation.log_time import UNKNOWN_TIME, LogTime
from tumble.foundation.regular_files import open_regular

_EPOCH = "SOURCE_DATE_EPOCH"
_BLOCK = 1 << 20


@dataclass(frozen=True, slots=True)
class Provenance:
    """When and by whom a calibration was made; what is not known is empty."""

    date: str = ""
    """UTC, ISO 8601: `2026-11-22T06:20:00Z`."""
    operator: str = ""
    station: str = ""

    def content(self) -> dict[str, str]:
        """Returns date, operator and station as a calibration file states them."""
        return {"date": self.date, "operator": self.operator, "station": self.station}


@dataclass(frozen=True, slots=True)
class LogFacts:
    """The log that a result was found from."""

    sha256: str = ""
    """SHA-256 of its bytes, in hexadecimal; empty for arrays in memory."""
    duration: float = 0.0
    """s, from the first sample to the last; of several files their sum."""
    axes: str = ""
    """Directions of the case axes in a vehicle, such as FRD; empty where the log does not define them."""
    reading: LogReading = field(default_factory=dict)
    """Options that changed its readings; empty where they are not known."""
    has_assumed_unit: bool = False
    """True if neither the log, nor an option, nor its readings show the unit of a sensor."""
    time: LogTime = UNKNOWN_TIME
    """Time by its own clock; of several files, that of the first."""


UNKNOWN = Provenance()
NO_LOG = LogFacts()
_maker: ContextVar[tuple[str, str]] = ContextVar("maker", default=("", ""))
"""Operator and station of what is made now."""


@contextmanager
def made_by(operator: str, station: str) -> Iterator[None]:
    """States who makes, and where, what is found while the block runs."""
    token = _maker.set((operator, station))
    try:
        yield
    finally:
        _maker.reset(token)


def provenance_now() -> Provenance:
    """Returns when and by whom a result is made; raises `TumbleError` as `date_now`."""
    return Provenance(date_now(), *_maker.get())


def date_now() -> str:
    """Returns the time of a run, to the second, or that of `SOURCE_DATE_EPOCH`, in seconds since 1970.

    Source: https://reproducible-builds.org/specs/source-date-epoch/. Raises `TumbleError` where it is no
    number of seconds.
    """
    stated = os.environ.get(_EPOCH)
    try:
        return moment_text(clock.utc() if stated is None else int(stated))
    except (ValueError, OverflowError, OSError):
        raise TumbleError(f"{_EPOCH}={stated}: give whole seconds since 1970, or unset it") from None


def sha256_of(path: Path) -> str:
    """Digest of a file, in hexadecimal; of a folder that of the names and digests of its files."""
    import hashlib  # brings a library of the system, for which commands that read logs would wait

    if is_folder(path):
        files = sorted(each for each in path.rglob("*") if is_file(each) and each.name != LOCK_FILE)
        lines = [f"{sha256_of(each)}  {each.relative_to(path).as_posix()}\n" for each in files]
        return hashlib.sha256("".join(lines).encode()).hexdigest()
    digest = hashlib.sha256()
    with open_regular(path) as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def log_digest(path: Path) -> str:
    """SHA-256 of a log, in hexadecimal; of several IMUs in one file it is computed once."""
    return _digest(path.resolve())


_digest = once_per_file(sha256_of)
