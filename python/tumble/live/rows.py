"""Rows of text as they come: numbers under column names, or a JSON object a sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from typing import Any, cast

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of, whole_number
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.live.labels import LabelRow
from tumble.live.readings import Readings
from tumble.live.source import SourceChangedError
from tumble.logs.columns import ImuColumns, find_imus, recognise
from tumble.logs.json_objects import numbers_in, with_defined_units
from tumble.logs.options import ReadOptions
from tumble.logs.read_as import ReadAs
from tumble.logs.text import BLANKS, names_delimiter, names_for, numbers_delimiter, split_line
from tumble.logs.track import RawSamples, none_such, several

MOVING = "moving"
"""Name of the state of the wheels in `--columns`."""
MOVING_NAMES = ("moving", "wheels_moving", "wheel_moving", "wheel_speed", "wheels_speed", "motor")
"""Columns, in lower case, that show whether the wheels turn: 0 where they stand, else any other number."""
ROWS_WITHOUT_NAMES = 8
"""Rows to see before columns without names are given the usual ones: the first has to grow, to be time."""
MOST_UNREADABLE = 50
"""Successive lines that hold no sample beyond which something is set wrong."""
MOST_CORRUPTED = 3
"""A line of names is a corrupted one of those before only if fewer than one in so many names differ."""
LIKE = 0.5
"""Share of letters in common from which a name may be another one, corrupted on the way."""
MOST_OTHER_FIELDS = 64
"""Sets of fields of other objects that are kept in mind."""
LONGEST_SHOWN = 300
"""Letters of names that an error shows."""
UNREADABLE_SECONDS = 2.0
"""s without a sample, once there were some, that such lines take at least: others may flood the line."""


class _Layout:
    """Which field of a row is what."""

    def __init__(
        self,
        names: tuple[str, ...],
        delimiter: str,
        columns: ImuColumns,
        moving: str | None,
        notices: tuple[str, ...],
        imu: str,
    ) -> None:
        self.names = names
        self.delimiter = delimiter
        self.columns = columns
        self.notices = notices
        self.imu = imu
        """Prefix of the columns of the unit."""
        self.is_assumed = False
        """Indicates whether rows came without names, so that these are the usual ones."""
        self.is_of_objects = False
        """Indicates whether they are fields of JSON, which have no order."""
        self.may_lack_front = False
        """Indicates whether the names came with the first line, which may have lost its front."""
        self._delimiter = None if delimiter == BLANKS else delimiter
        triads = (*(columns.accelerometer or ()), *(columns.gyroscope or ()))
        magnetic = columns.magnetometer.axes if columns.magnetometer else ()
        further = (name for name in (columns.time, columns.temperature, moving) if name)
        self.wanted = [*triads, *further, *magnetic]
        """Names of the fields to read: both triads first, the magnetometer last."""
        self.of_sample = [*triads, *((columns.time,) if columns.time else ())]
        """Names of those that each sample has."""
        self.fields_of_imu = len(self.wanted) - len(magnetic)
        """Number of those that are not the magnetometer's."""
        self._places = [names.index(name) for name in self.wanted]
        self._time = len(triads) if columns.time else None
        self._temperature = self.wanted.index(columns.temperature) if columns.temperature else None
        self._moving = self.wanted.index(moving) if moving else None
        self._magnetic = len(self.wanted) - 3 if magnetic else None

    def has_places_of(self, other: _Layout) -> bool:
        """Returns whether both read the same quantities from the same fields of a row."""

        def places(layout: _Layout) -> tuple[object, ...]:
            further = (layout._time, layout._temperature, layout._moving, layout._magnetic)
            return (len(layout.names), layout._places, *further, layout.is_of_objects)

        return places(self) == places(other)

    def numbers(self, text: str) -> list[float] | None:
        """Reads a row; None where it has not as many fields as columns, or a wanted one is no number."""
        if self.is_of_objects:
            return None
        fields = text.split(self._delimiter)
        if len(fields) != len(self.names):
            return None
        if text.isascii() and "_" not in text:
            try:
                return [float(fields[place]) for place in self._places]
            except ValueError:
                pass  # It may be empty, or stand in quotes.
        numbers = [number_of(fields[place].strip().strip('"') or "nan") for place in self._places]
        return None if None in numbers else cast("list[float]", numbers)

    def readings(self, rows: FloatArray) -> Readings:
        """Returns rows of what is wanted as samples."""

        def column(place: int | None) -> FloatArray | None:
            return None if place is None else rows[:, place].copy()

        samples = RawSamples(
            column(self._time), rows[:, 0:3].copy(), rows[:, 3:6].copy(), column(self._temperature)
        )
        moving = column(self._moving)
        magnetic = None if self._magnetic is None else rows[:, self._magnetic :].copy()
        return Readings(samples, None if moving is None else _state(moving), magnetic)


class RowReader:
    """Finds out how rows are laid out and reads them.

    `joined_midway` marks that the first line may have begun before reading: a number cut off at its
    front reads as another number, so the first row is left out. `whole` marks that lines come in datagrams.
    """

    def __init__(self, address: Address, options: ReadOptions, *, joined_midway: bool, whole: bool) -> None:
        self.unreadable = 0
        """Lines so far that held no sample and no column names."""
        self.prefix: str | None = None
        """Prefix of the columns of the unit that is read, where one is selected."""
        self._source = address.text
        self._typed = address.text.partition("?")[0]
        self._moving_column = options.columns.get(MOVING)
        columns = {key: name for key, name in options.columns.items() if key != MOVING}
        self._options = replace(options, columns=columns)
        self._first = joined_midway
        self._unnamed: list[str] = []
        self._unreadable_in_succession = 0
        self._read_at = -math.inf
        """s of `clock.now()` at which the last row was read."""
        self._most_in_succession = MOST_UNREADABLE
        self._is_whole = whole
        self._no_imu: LogError | None = None
        """Error of names that came so far and are no IMU's; the device may yet send others."""
        self._layout: _Layout | None = None
        self._layout_is_doubtful = False
        """Indicates whether its names came with the first line, and no row has shown that it was whole."""
        self._other_fields: set[tuple[str, ...]] = set()
        """Fields of objects that hold no sample of this unit."""
        self._before: ReadAs | None = None
        """Columns under which an earlier process read the rows, whose recording goes on."""
        self.refusal: LogError | None = None
        """Error after the rows that `read` returned last, from which on nothing is read."""

    @property
    def columns(self) -> ImuColumns:
        """The columns, once `read` has given a sample."""
        assert self._layout is not None, "columns are known once a row was read"
        return self._layout.columns

    @property
    def keeps(self) -> bool:
        """Indicates whether rows are kept back until their layout is known."""
        return bool(self._unnamed)

    @property
    def notices(self) -> tuple[str, ...]:
        """Notices for the user on how rows were read."""
        notices = () if self._layout is None else self._layout.notices
        if self.unreadable:
            notices += (f"left out {count_of('line', self.unreadable)} without a sample",)
        return notices

    def read_as(self, units: dict[str, str]) -> ReadAs | None:
        """Returns how rows are read, with the units of their quantities; None until columns are known."""
        if self._layout is None or self._layout_is_doubtful:
            return None
        layout = self._layout
        return ReadAs(
            columns=layout.names,
            delimiter=layout.delimiter,
            is_without_names=layout.is_assumed,
            is_of_objects=layout.is_of_objects,
            units=units,
        )

    def go_on_as(self, before: ReadAs) -> None:
        """Reads under the columns of a recording that goes on."""
        self._before = before if before.columns else None

    def follow(self, previous: RowReader) -> None:
        """Reads on under the columns of the source that this one is the return of."""
        self.prefix, self.unreadable = previous.prefix, previous.unreadable
        self._no_imu, self._before = previous._no_imu, previous._before
        if not previous._layout_is_doubtful:
            self._layout = previous._layout

    def read(self, rows: Sequence[LabelRow]) -> Readings | None:
        """Reads lines or objects; None where they hold no sample, or the columns are not known yet.

        Raises `LogError` where line after line holds no sample, with what columns lack if they were named,
        and `SourceChangedError` where columns are named otherwise than before. An error after samples is
        `refusal` instead.
        """
        if self._is_whole:
            # However many lines it holds, one datagram is no reason to give up.
            self._most_in_succession = self._unreadable_in_succession + 1
        if rows and self._layout is None and self._before is not None:
            self._go_on(self._before)
        numbers: list[list[float]] = []
        for row in rows:
            try:
                numbers += self._numbers(row)
            except LogError as error:
                if not numbers:
                    raise
                self.refusal = error
                break
        if not numbers:
            return None
        assert self._layout is not None, "rows are read once columns are known"
        self._read_at = clock.now()
        return self._layout.readings(np.array(numbers, dtype=np.float64))

    def _go_on(self, before: ReadAs) -> None:
        self._layout = self._layout_for(before.columns, before.delimiter)
        self._layout.is_assumed = before.is_without_names
        self._layout.is_of_objects = before.is_of_objects
        self._before = None

    def _numbers(self, row: LabelRow) -> list[list[float]]:
        if isinstance(row, dict):
            return self._numbers_of_object(row)
        layout = None if self._first or self._layout_is_doubtful else self._layout
        if layout is not None and (numbers := layout.numbers(row)) is not None:
            self._unreadable_in_succession = 0
            return [numbers]
        return self._numbers_of_text(row)

    def _numbers_of_text(self, text: str) -> list[list[float]]:
        """Rows that become readable with a line: none, one, or those kept back for want of names."""
        if text.startswith(("{", "[")):
            self._count_unreadable(text)
            return []
        body = text.lstrip("#%").strip()
        if (delimiter := names_delimiter(body, self._options)) is not None:
            self._take_names(split_line(body, delimiter), delimiter)
            return []
        if self._first:
            self._first = False
            return []
        if self._layout_is_doubtful:
            self._keep_names_that_fit(text)
        if self._layout is None and not self._find_layout_without_names(text):
            return []
        kept_back, self._unnamed = self._unnamed or [text], []
        assert self._layout is not None, "rows are read once columns are known"
        return [
            row for line in kept_back for row in self._sample_or_complaint(line, self._layout.numbers(line))
        ]

    def _take_names(self, names: list[str], delimiter: str) -> None:
        """Accepts column names; a device that starts anew sends them again."""
        if self._layout is None and not (self._first and self._may_be_incomplete(names)):
            self._unnamed = []
            self._layout = self._layout_or_complaint(tuple(names), delimiter)
            if self._layout is not None:
                self._layout_is_doubtful = self._layout.may_lack_front = self._first
        elif self._layout is not None and (self._layout.names != tuple(names) or self._layout.is_of_objects):
            self._take_other_names(self._layout, tuple(names), delimiter)
        self._first = False

    def _take_other_names(self, known: _Layout, names: tuple[str, ...], delimiter: str) -> None:
        """Accepts names that mean the columns that are read; leaves out those that are damaged or no IMU's.

        Raises `SourceChangedError` for all others: rows after them are not laid out as those before.
        """
        try:
            layout = self._layout_for(names, delimiter)
        except LogError:
            layout = None
        if layout is not None and _adds_to(known, layout):
            self._layout = layout
            return
        torn = self._first and _is_torn(known.names, names)
        # Rows of another length are never read as those of before.
        harmless = layout is None and (len(names) != len(known.names) or known.is_of_objects)
        if torn or harmless or _is_corrupted(known, names):
            self._count_unreadable(delimiter.join(names))
            return
        raise self._changed(known, names)

    def _changed(self, known: _Layout, names: Sequence[str]) -> SourceChangedError:
        before = "read as, without names," if known.is_assumed else "named"
        return SourceChangedError(
            f"{self._source}: columns were {before} {_shown(known.names)!a} so far, and are now named "
            f"{_shown(names)!a}: rows under other names are another recording; start again"
        )

    def _keep_names_that_fit(self, row: str) -> None:
        """Drops names that do not fit the first row after them."""
        self._layout_is_doubtful = False
        if self._layout is not None and self._layout.numbers(row) is None:
            self._layout = None

    def _may_be_incomplete(self, names: list[str]) -> bool:
        """Returns whether names may lack those before them, or the first of them its front."""
        columns = [recognise(name) for name in names]
        if any(column and column.quantity == "time" for column in columns):
            return False
        triads = [
            column for column in columns if column and column.quantity in ("accelerometer", "gyroscope")
        ]
        return columns[0] is None or len(triads) < 6

    def _find_layout_without_names(self, text: str) -> bool:
        """Stores rows until there are enough to find their layout; returns whether there are now."""
        # Rows under names that are those of no IMU are no rows without names.
        if self._no_imu is not None or numbers_delimiter(text) is None:
            self._count_unreadable(text)
            return False
        self._unnamed.append(text)
        if len(self._unnamed) < ROWS_WITHOUT_NAMES:
            return False
        delimiter = numbers_delimiter(text) or ","
        lengths = [len(split_line(row, delimiter)) for row in self._unnamed]
        count = max(set(lengths), key=lengths.count)
        rows = [row for row, length in zip(self._unnamed, lengths, strict=True) if length == count]
        names, notices = names_for(self._source, rows, delimiter, count, self._options)
        self._layout = self._layout_for(names, delimiter, notices)
        self._layout.is_assumed = True
        return True

    def _layout_or_complaint(self, names: tuple[str, ...], delimiter: str) -> _Layout | None:
        """Layout under these names; None, and a line that is no sample, where they are no IMU's."""
        try:
            layout = self._layout_for(names, delimiter)
        except LogError as error:
            self._no_imu = error
            self._count_unreadable(delimiter.join(names))
            return None
        self._no_imu = None
        return layout

    def _layout_for(self, names: tuple[str, ...], delimiter: str, notices: tuple[str, ...] = ()) -> _Layout:
        imus = find_imus(names, self._source, self._options)
        if self.prefix is None and len(imus) > 1 and "" not in imus:
            raise several(self._source, self._typed, list(imus))
        imu = self.prefix if self.prefix is not None else ("" if "" in imus else next(iter(imus)))
        if imu not in imus:
            raise none_such(self._source, "column prefix", imu, list(imus))
        if (recorded := imus[imu].triads) != TRIADS:
            missing = "gx, gy, gz" if "accelerometer" in recorded else "ax, ay, az"
            raise LogError(
                f"{self._source}: no column for {missing}; columns found: {', '.join(names)}; a spin needs "
                "accelerometer and gyroscope of one unit"
            )
        columns = with_defined_units(imus[imu], names)
        return _Layout(names, delimiter, columns, self._moving_among(names), notices, imu)

    def _moving_among(self, names: tuple[str, ...]) -> str | None:
        stated = self._moving_column
        if stated is None:
            return next((name for name in names if name.lower() in MOVING_NAMES), None)
        if stated in names:
            return stated
        if 1 <= (number := whole_number(stated) or 0) <= len(names):
            return names[number - 1]
        raise LogError(f"{self._source}: no column {stated!r} for moving; columns found: {', '.join(names)}")

    def _numbers_of_object(self, value: dict[str, Any]) -> list[list[float]]:
        """Reads a JSON object; what it lacks is no number. None where it lacks everything."""
        numbers = numbers_in(value)
        if numbers is None:
            return self._sample_or_complaint(str(value), None)
        if self._layout is None:
            self._layout = self._layout_or_complaint(tuple(numbers), ",")
            if self._layout is None:
                return []
            self._layout.is_of_objects = True
        elif not all(name in numbers for name in self._layout.of_sample):
            self._refuse_other_fields(self._layout, tuple(numbers))
        row = [numbers.get(name, math.nan) for name in self._layout.wanted]
        if not any(map(math.isfinite, row[: self._layout.fields_of_imu])):
            # An object without any of its fields is that of another unit.
            return [] if self.prefix else self._sample_or_complaint(str(value), None)
        self._unreadable_in_succession = 0
        return [row]

    def _refuse_other_fields(self, known: _Layout, names: tuple[str, ...]) -> None:
        """Raises `SourceChangedError` for an object that holds a whole sample of the unit in other fields.

        One that lacks its time holds none; what else it lacks, such as temperature, comes with others.
        """
        if names in self._other_fields:
            return
        try:
            layout = self._layout_for(names, ",")
        except LogError:
            layout = None
        if layout is not None and layout.imu == known.imu and set(layout.of_sample) - set(known.of_sample):
            raise self._changed(known, names)
        if len(self._other_fields) < MOST_OTHER_FIELDS:
            self._other_fields.add(names)

    def _sample_or_complaint(self, text: str, row: list[float] | None) -> list[list[float]]:
        if row is None:
            self._count_unreadable(text)
            return []
        self._unreadable_in_succession = 0
        return [row]

    def _count_unreadable(self, text: str) -> None:
        self.unreadable += 1
        self._unreadable_in_succession = min(self._unreadable_in_succession + 1, self._most_in_succession)
        if (
            self._unreadable_in_succession >= MOST_UNREADABLE
            and clock.now() - self._read_at >= UNREADABLE_SECONDS
        ):
            if self._no_imu is not None:
                raise self._no_imu
            raise LogError(
                f"{self._source}: {MOST_UNREADABLE} lines in a row hold no sample, such as "
                f"{text[:60]!a}; check the baud rate, and what the device sends against --columns"
            )


def _adds_to(known: _Layout, named: _Layout) -> bool:
    """Returns whether names state the columns that are read, of which they were not yet known in full."""
    if not known.has_places_of(named):
        return False
    return known.is_assumed or (known.may_lack_front and _is_torn(named.names, known.names))


def _is_torn(whole: Sequence[str], names: Sequence[str]) -> bool:
    """Returns whether names are the last of others, perhaps without the front of the first."""
    if not 0 < len(names) <= len(whole):
        return False
    first, *others = whole[len(whole) - len(names) :]
    return first.endswith(names[0]) and others == list(names[1:])


def _is_corrupted(known: _Layout, names: Sequence[str]) -> bool:
    """Returns whether names are those of before but for a letter or two that changed on the way."""
    if len(names) != len(known.names) or known.is_assumed:
        return False
    changed = [(old, new) for old, new in zip(known.names, names, strict=True) if old != new]
    few = MOST_CORRUPTED * len(changed) < len(names)
    return few and all(new not in known.names and _is_corrupted_name(known, old, new) for old, new in changed)


def _is_corrupted_name(known: _Layout, old: str, new: str) -> bool:
    """Returns whether a name may be `old`, corrupted: it means nothing, or the same without its unit."""
    # A column that only the user knows may have been given any other name.
    if recognise(old) is None and old in known.wanted:
        return False
    column = recognise(new)
    if column is None:
        return SequenceMatcher(None, old, new).ratio() >= LIKE
    letters = sum(one != other for one, other in zip(old, new, strict=False))
    before = recognise(old)
    same = before is not None and replace(before, unit=None) == replace(column, unknown="")
    return same and len(old) == len(new) and letters == 1


def _shown(names: Sequence[str]) -> str:
    text = ",".join(names)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def _state(values: FloatArray) -> FloatArray:
    """1 where a number other than zero stands, 0 where zero stands, NaN where nothing does."""
    return np.where(np.isnan(values), np.nan, (values != 0.0).astype(np.float64))
