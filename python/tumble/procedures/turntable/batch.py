"""The batch in a folder: every attempt at every target, whichever run made it.

`batch.jsonl` is the one place where the batch is kept: a line an attempt, appended once the files of that
attempt are whole. Summary and report are made of it. A line that was cut short is no attempt.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from tumble.calibration.document import KIND
from tumble.foundation.errors import OutputError
from tumble.foundation.file_names import ATTEMPTS, EARLIER, TAKEN, file_stem
from tumble.foundation.file_reading import bounded_lines
from tumble.foundation.file_status import exists, is_file, is_special
from tumble.foundation.files import PAGE, FileKind, append_line, move_into, replacing
from tumble.foundation.provenance import sha256_of
from tumble.foundation.regular_files import open_regular
from tumble.procedures.turntable.record import TargetRecord

_ATTEMPTS_KIND = FileKind("a batch of tumble turntable", re.compile(rb""))
"""Whatever it begins with: it was read line by line."""
LONGEST_LINE = 1 << 20
"""Bytes of a line; that of a target takes a hundredth."""
CALIBRATION_ENDING, PAGE_ENDING = ".yaml", ".html"


@dataclass(frozen=True, slots=True)
class LastAttempt:
    """Where the last attempt at a target stands, and what decides whether it has to be repeated."""

    place: int
    """Bytes from the beginning of the file."""
    attempt: int
    stem: str
    serial: str
    verdict: str
    key: str
    calibration_sha256: str
    page: bool


class Batch:
    """The targets of one folder, in the order in which they were first attempted."""

    def __init__(self, folder: Path) -> None:
        """Reads what is there; raises `OutputError` where the file of that name is not ours."""
        self.folder = folder
        self.path = folder / ATTEMPTS
        self.last: dict[str, LastAttempt] = {}
        self.lost_lines: list[int] = []
        """Numbers of lines that could not be read."""
        self._stems = set(TAKEN)
        self._names_by_serial: dict[str, str] = {}
        if exists(self.path):
            self._read()

    def __len__(self) -> int:
        return len(self.last)

    def counts(self) -> str:
        """Describes the number of targets with each verdict."""
        verdicts = Counter(last.verdict for last in self.last.values())
        return ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())

    def remarks(self) -> Iterator[str]:
        """Describes what of the file could not be read."""
        for number in self.lost_lines:
            yield (
                f"{self.path}: line {number} was cut short or changed; that attempt does not count, and the "
                "line is dropped"
            )

    def latest(self) -> Iterator[TargetRecord]:
        """Reads the last attempt at each target, one after another."""
        if not self.last:
            return
        with open_regular(self.path) as file:
            for attempt in list(self.last.values()):
                file.seek(attempt.place)
                yield TargetRecord.from_line(file.readline(LONGEST_LINE))

    def record(self, name: str) -> TargetRecord:
        """Reads the last attempt at one target."""
        with open_regular(self.path) as file:
            file.seek(self.last[name].place)
            return TargetRecord.from_line(file.readline(LONGEST_LINE))

    def attempt(self, name: str) -> int:
        """Returns the number of the next attempt at a target."""
        return self.last[name].attempt + 1 if name in self.last else 1

    def stem(self, name: str) -> str:
        """Returns the name of a target's files: its own where a file can bear it, and none twice."""
        if name in self.last:
            return self.last[name].stem
        stem = file_stem(name)
        numbered = (f"{stem}-{number}" for number in count(2))
        chosen = next(each for each in chain([stem], numbered) if each.casefold() not in self._stems)
        self._stems.add(chosen.casefold())
        return chosen

    def namesake(self, name: str, serial: str) -> str:
        """Other serial that a target of that name has in this batch; empty where there is none."""
        known = self.last[name].serial if name in self.last else ""
        return known if serial and known and known != serial else ""

    def bearer(self, serial: str) -> str:
        """Returns the target of this batch that has that serial; empty where there is none."""
        return self._names_by_serial.get(serial, "")

    def is_done(self, name: str, key: str, *, page: bool) -> bool:
        """Returns whether the last attempt had this key and its files exist, the page too if `page`."""
        last = self.last.get(name)
        if last is None or last.key != key or (page and not last.page):
            return False
        if last.page and not exists(self._file(last.stem, PAGE_ENDING)):
            return False
        file = self._file(last.stem, CALIBRATION_ENDING)
        return not last.calibration_sha256 or (is_file(file) and sha256_of(file) == last.calibration_sha256)

    def set_aside(self, name: str, stem: str, *, calibration: bool, page: bool) -> list[Path]:
        """Moves files that a new attempt does not replace to `earlier`; returns their paths.

        Raises `OutputError` where that cannot be done.
        """
        number = self.last[name].attempt if name in self.last else 0
        moved = []
        for ending, replaced in ((CALIBRATION_ENDING, calibration), (PAGE_ENDING, page)):
            path = self._file(stem, ending)
            kind = KIND if ending == CALIBRATION_ENDING else PAGE
            if replaced or not is_file(path) or not kind.is_marked(path):
                continue
            moved.append(move_into(path, self.folder / EARLIER, f"{stem}-attempt-{number}{ending}"))
        return moved

    def add(self, record: TargetRecord) -> None:
        """Appends an attempt; raises `OutputError` where that cannot be done."""
        self.drop_lost_lines()
        self._note(record, append_line(self.path, record.line()))

    def drop_lost_lines(self) -> None:
        """Writes the file again without the lines that could not be read; the others get new places.

        Raises `OutputError` where that cannot be done.
        """
        if not self.lost_lines:
            return
        with (
            open_regular(self.path) as old,
            replacing(self.path, _ATTEMPTS_KIND, renews=True, durable=True) as new,
        ):
            for number, (_, line) in enumerate(bounded_lines(old, LONGEST_LINE), start=1):
                if line is not None and number not in self.lost_lines:
                    new.write(line if line.endswith(b"\n") else line + b"\n")
        self.lost_lines.clear()
        self._read()

    def _file(self, stem: str, ending: str) -> Path:
        return self.folder / f"{stem}{ending}"

    def _read(self) -> None:
        if is_special(self.path):
            raise OutputError(f"{self.path}: is a device or a pipe, and no batch; choose another folder")
        try:
            with open_regular(self.path) as file:
                for number, (place, line) in enumerate(bounded_lines(file, LONGEST_LINE), start=1):
                    try:
                        if line is None or line.strip():
                            self._note(TargetRecord.from_line(line or b""), place)
                    except ValueError:
                        self.lost_lines.append(number)
        except OSError as error:
            raise OutputError(
                f"{self.path}: cannot be read: {error.strerror}; choose another folder"
            ) from error
        if self.lost_lines and not self.last:
            raise OutputError(
                f"{self.path}: is no batch of tumble turntable, and is kept; choose another folder"
            )

    def _note(self, record: TargetRecord, place: int) -> None:
        self.last[record.target] = LastAttempt(
            place,
            record.attempt,
            record.stem,
            record.serial,
            record.verdict,
            record.key,
            record.calibration_sha256,
            record.page,
        )
        self._stems.add(record.stem.casefold())
        if record.serial:
            self._names_by_serial.setdefault(record.serial, record.target)
