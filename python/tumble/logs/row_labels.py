"""Rows of a table that a column labels with the IMU they are of: each label is an IMU of its own."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.logs.columns import UNIT_NAMES, ImuColumns, choose_imu
from tumble.logs.options import ReadOptions
from tumble.logs.track import LoggedImu, LoggedMagnetometer, RawMagnetic, RawSamples, Transform, choose

MOST_LABELS = 64
"""Words taken for names of units at most: a corrupted word may read as any."""
_MOST_WORDS = 16 * MOST_LABELS
"""Distinct words of a column beyond which it is no small set, however many rows follow."""
_FEW = 10
"""Labels for each fraction at least, where a torn row may read as one."""
_GROUPS = re.compile(r"[./]")
_SPELLED = tuple(name.replace("_", "") for name in UNIT_NAMES)
_WHOLE = re.compile(r"([+-]?\d{1,18})\.0*")
_NONE = ("nan", "null", "none")
_FRACTION = re.compile(r"[+-]?\d*\.\d*(?:[eE][+-]?\d+)?")
Places = NDArray[np.intp]


@lru_cache(256)
def label_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Returns those names of columns that name the IMU of a row, the surest first."""
    spelled = {name: re.sub(r"[ _-]+", "", _GROUPS.split(name)[-1]).lower() for name in names}
    return tuple(name for each in _SPELLED for name in names if spelled[name] == each)


def repeated(counts: Mapping[str, int]) -> list[str]:
    """Returns the labels that name IMUs; none where most are new in their row, as a counter is.

    A label that comes once may be torn.
    """
    if 2 * len(counts) > sum(counts.values()):
        return []
    return sorted(label for label, count in counts.items() if count > 1)


def labels_for(columns: ImuColumns, names: Iterable[str], stated: Iterable[str] = ()) -> tuple[str, ...]:
    """Returns the columns that may label the rows of an IMU: those in its group, or in one around it."""
    read = [*columns.names, *columns.magnetic_names]
    others = tuple(name for name in names if name not in read and name not in stated)
    axes = columns.accelerometer or columns.gyroscope or columns.magnetic_names
    return tuple(name for name in label_names(others) if axes[0].startswith(_group(name)))


def _group(name: str) -> str:
    last = _GROUPS.split(name)[-1]
    return name[: len(name) - len(last)]


@dataclass(frozen=True, slots=True)
class RowLabels:
    """Labels of all rows of a table."""

    column: str
    names: tuple[str, ...]
    """Those that name IMUs, two at least."""
    places: NDArray[np.int16]
    """(n,) place of the label of each row among the names; -1 where it has none of them."""


class LabelColumn:
    """Gathers the labels in a column, piece after piece."""

    def __init__(self, column: str) -> None:
        self._column = column
        self._known: dict[str, int] = {}
        self._counts = Counter[str]()
        self._fractions = 0
        self._pieces: list[NDArray[np.int16]] = []
        self.is_open = True
        """Indicates whether it may still be a column of labels."""

    def add_words(self, words: Sequence[object]) -> None:
        """Adds the words of successive rows."""
        places = {word: number for number, word in enumerate(dict.fromkeys(words))}
        self.add(tuple(places), np.fromiter((places[word] for word in words), np.intp, len(words)))

    def add_numbers(self, numbers: NDArray[Any]) -> None:
        """Adds the numbers of successive rows."""
        distinct, places = np.unique(numbers, return_inverse=True)
        self.add(distinct.tolist(), places.astype(np.intp).ravel())

    def add(self, distinct: Sequence[object], places: Places) -> None:
        """Adds rows by the places of their words among distinct ones; -1 is no word."""
        self.is_open = self.is_open and max(len(distinct), len(self._known)) <= _MOST_WORDS
        if not self.is_open:
            return
        labels = [_label(word) for word in distinct]
        codes = [self._known.setdefault(label, len(self._known)) if label else -1 for label in labels]
        fractions = [bool(_FRACTION.fullmatch(str(word))) for word in distinct]
        counts = np.bincount(places[places >= 0], minlength=len(labels))
        for label, is_fraction, count in zip(labels, fractions, counts.tolist(), strict=True):
            if label:
                self._counts[label] += count
            elif is_fraction:
                self._fractions += count
        self._pieces.append(np.array([*codes, -1], np.int16)[places])

    def found(self) -> RowLabels | None:
        """Returns the labels where they name several IMUs."""
        # Readings are whole numbers now and then.
        is_reading = self._fractions * _FEW > self._counts.total()
        names = repeated(self._counts) if self.is_open and not is_reading else []
        if not 1 < len(names) <= MOST_LABELS:
            return None
        places = {self._known[name]: number for number, name in enumerate(names)}
        by_code = np.array([*(places.get(code, -1) for code in range(len(self._known))), -1], np.int16)
        return RowLabels(self._column, tuple(names), by_code[np.concatenate(self._pieces)])


def _label(word: object) -> str:
    """Returns the label that a word is; empty where it is none, as a fraction."""
    if word is None or (isinstance(word, float) and not np.isfinite(word)):
        return ""
    text = word.decode("utf-8", "replace") if isinstance(word, bytes) else str(word)
    text = text.strip().strip('"')
    if whole := _WHOLE.fullmatch(text):
        return str(int(whole[1]))
    return "" if _FRACTION.fullmatch(text) or text.lower() in _NONE else text


def first_found(columns: Iterable[LabelColumn]) -> RowLabels | None:
    """Returns the labels of the first column that has several."""
    return next((found for column in columns if (found := column.found()) is not None), None)


class NamedImu(NamedTuple):
    """One of the IMUs of a table."""

    prefix: str
    """Front of the names of its columns."""
    labels: RowLabels | None = None
    """Those of the rows of several IMUs with this prefix."""
    label: str = ""


def imus_with_labels(
    prefixes: Iterable[str], labels_of: Callable[[str], RowLabels | None]
) -> dict[str, NamedImu]:
    """Returns the IMUs of a table by name: by the prefix of columns, by the label of rows, or by both."""
    found: dict[str, NamedImu] = {}
    for prefix in prefixes:
        labels = labels_of(prefix)
        if labels is None:
            found[prefix] = NamedImu(prefix)
            continue
        for label in labels.names:
            found[f"{prefix}.{label}" if prefix else label] = NamedImu(prefix, labels, label)
    return found


def named_imus(
    imus: Mapping[str, ImuColumns],
    names: Iterable[str],
    options: ReadOptions,
    gather: Callable[[ImuColumns, str], LabelColumn | None],
) -> dict[str, NamedImu]:
    """Returns the IMUs of a table of columns with these names, as `imus_with_labels` does.

    `gather` reads a column beside those of an IMU; it returns None where that is none of its rows.
    """
    all_names = tuple(names)

    def labels_of(prefix: str) -> RowLabels | None:
        columns = imus[prefix]
        beside = labels_for(columns, all_names, options.columns.values())
        gathered = (gather(columns, name) for name in beside)
        return first_found(column for column in gathered if column is not None)

    return imus_with_labels(imus, labels_of)


def choose_row_imu(
    path: Path, named: Mapping[str, NamedImu], imus: Mapping[str, ImuColumns], wanted: str | None
) -> str:
    """Picks one IMU of a table of text: by label where rows have some, else as `choose_imu` does."""
    if any(each.labels for each in named.values()):
        return choose_named(path, named, wanted, "IMU")
    return choose_imu(path, imus, wanted)


def choose_named(
    path: Path, imus: Mapping[str, NamedImu], wanted: str | None, what: str, typed: str | None = None
) -> str:
    """Picks one IMU, as `tumble.logs.track.choose` does; an error names the column of labels.

    `typed` is how a user names one, up to its name: `FILE:`.
    """
    sought = (wanted or "").strip("/")
    labelled = {
        name: imu.labels
        for name, imu in imus.items()
        if imu.labels and (wanted is None or imu.prefix.strip("/") == sought)
    }
    unlabelled = [name for name, imu in imus.items() if not imu.labels]
    if labelled and (wanted is not None or "" not in unlabelled):
        column = next(labels.column for labels in labelled.values() if labels)
        names = list(labelled) if wanted is not None else list(imus)
        first = f"{path.name}:{names[0]}" if typed is None else typed.format(names[0])
        raise LogError(
            f"{path}: column {column} distinguishes {len(names)} IMUs: name one, as {first} "
            f"(found: {', '.join(names)}), or rename the column if it names no IMU"
        )
    return choose(path, tuple(imus), wanted, what)


def of_label(found: LoggedImu, imu: NamedImu, name: str) -> LoggedImu:
    """Returns the IMU whose rows have the label, of one that all rows are read as."""
    labels = imu.labels
    if labels is None:
        return found
    mine = labels.places == labels.names.index(imu.label)

    def pieces() -> Iterator[RawSamples]:
        row = 0
        for piece in found.read(lambda samples: samples):
            kept = mine[row : row + len(piece)]
            row += len(piece)
            yield _kept(found.path, piece, kept)
        if row != len(mine):
            raise _changed(found.path)

    def read(transform: Transform) -> Iterator[RawSamples]:
        # A piece without any row of the IMU may hold lines that were left out.
        return (transform(piece) for piece in pieces() if len(piece) or piece.bad_lines)

    def head() -> RawSamples:
        return next(piece for piece in pieces() if len(piece))

    return replace(
        found,
        imu=name,
        read=read,
        head=head,
        locate=lambda sample: found.locate(int(np.flatnonzero(mine)[sample])),
        magnetometer=found.magnetometer and _magnetometer(found.path, found.magnetometer, mine),
        alone=False,
        expected=int(np.count_nonzero(mine)),
    )


def _magnetometer(path: Path, found: LoggedMagnetometer, mine: NDArray[np.bool_]) -> LoggedMagnetometer:
    def read() -> RawMagnetic:
        raw = found.read()
        if len(raw.field) != len(mine):
            raise LogError(
                f"{path}: has {len(raw.field)} rows of the magnetometer and {len(mine)} of the IMU; repair "
                "the lines that cannot be read"
            )
        return RawMagnetic(_of(raw.time, mine), raw.field[mine], _of(raw.current, mine))

    return replace(found, read=read)


def _kept(path: Path, piece: RawSamples, mine: NDArray[np.bool_]) -> RawSamples:
    if len(mine) != len(piece):
        raise _changed(path)
    return replace(
        piece,
        time=_of(piece.time, mine),
        accelerometer=piece.accelerometer[mine],
        gyroscope=piece.gyroscope[mine],
        temperature=_of(piece.temperature, mine),
        received=_of(piece.received, mine),
    )


def _of(values: FloatArray | None, mine: NDArray[np.bool_]) -> FloatArray | None:
    return None if values is None else values[mine]


def _changed(path: Path) -> LogError:
    return LogError(f"{path}: changed while it was read; read it again")
