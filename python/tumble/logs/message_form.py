"""Messages of any definition, as columns: numbers by the names of the fields that they stand in.

A field of a field is named `imu.linear_acceleration.x`, the second of three numbers in a row `gyro_rad.1`. A
stamp of whole seconds and nanoseconds is one number, named as the field that holds both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from operator import attrgetter, itemgetter
from typing import Any, Protocol

import numpy as np

from tumble.foundation.bounded_json import JsonError, parse_json
from tumble.foundation.numbers import whole_number
from tumble.foundation.recording import FloatArray
from tumble.logs.columns import recognise
from tumble.logs.rosmsg import MalformedMessageError, seconds

AXES = 3
DEEPEST = 16
"""Messages in one another."""
LATEST = 9e9
"""s since 1970 that nanoseconds in 64 bits can count; more is no stamp."""
MOST_NAMES = 2000
"""Largest number of names of one message; later ones are ignored."""

_SECONDS = ("sec", "secs", "seconds")
_NANOSECONDS = ("nanosec", "nsec", "nsecs", "nanos", "nanoseconds")


@dataclass(frozen=True, slots=True)
class Definition:
    """Definition of the messages of a topic."""

    encoding: str
    """`cdr`, `ros1`, `json` or `protobuf`."""
    type: str
    """Name of the message."""
    text: bytes
    """Text of the definition in the file: a message definition, a schema, or a set of descriptors."""


class MessageForm(Protocol):
    """The numbers in the messages of one topic."""

    @property
    def names(self) -> Sequence[str]:
        """Returns those of all numbers that have a place of their own."""

    @property
    def dates(self) -> frozenset[str]:
        """Returns those of dates, which are read as ns since 1970."""

    def read(self, messages: Sequence[bytes], names: Sequence[str]) -> Mapping[str, FloatArray]:
        """Returns some, (n,) each; raises `MalformedMessageError` where a message has none there."""
        ...

    def frame(self, message: bytes) -> str:
        """Returns the name of the frame that a message is in; empty where it states none."""
        ...

    @property
    def words(self) -> Sequence[str]:
        """Returns the names of fields that hold a number or a text."""

    def read_words(self, messages: Sequence[bytes], name: str) -> Sequence[object]:
        """Returns what a field holds, None where it is not there."""
        ...


@dataclass(frozen=True, slots=True)
class Stamps:
    """Names of a form, those of whole seconds and nanoseconds put together."""

    names: tuple[str, ...]
    parts: Mapping[str, tuple[str, str]]
    """Names of seconds and nanoseconds, by that of the field which holds them."""


def with_stamps(names: Sequence[str]) -> Stamps:
    """Finds the stamps among names."""
    by_parent: dict[str, dict[str, str]] = {}
    for name in names:
        parent, _, last = name.rpartition(".")
        by_parent.setdefault(parent, {})[last] = name
    parts = {}
    for parent, fields in by_parent.items():
        whole = next((fields[key] for key in _SECONDS if key in fields), None)
        rest = next((fields[key] for key in _NANOSECONDS if key in fields), None)
        if parent and whole is not None and rest is not None:
            parts[parent] = (whole, rest)
    used = {name for pair in parts.values() for name in pair}
    return Stamps((*(name for name in names if name not in used), *parts), parts)


def stamps_of(whole: FloatArray, rest: FloatArray) -> FloatArray:
    """Seconds from whole ones and nanoseconds; NaN where they are no stamps."""
    sound = (np.abs(whole) < LATEST) & (np.abs(rest) < LATEST)
    counted = np.where(sound, whole, 0.0).astype(np.int64) * 1_000_000_000
    stamps = seconds(counted + np.where(sound, rest, 0.0).astype(np.int64))
    return np.where(sound, stamps, np.nan)


def is_triad(name: str) -> bool:
    """Returns whether three numbers of that name are readings of a triad."""
    column = recognise(f"{name}.x")
    return column is not None and column.quantity in ("accelerometer", "gyroscope", "magnetometer")


class ObjectForm:
    """Messages that a library makes objects of, with their fields as attributes."""

    def __init__(
        self, names: Sequence[str], parse: Callable[[bytes], Any], texts: Sequence[str] = ()
    ) -> None:
        """Makes objects with `parse`, which have numbers under `names` and `texts`."""
        self.names: Sequence[str] = tuple(names)
        self.words: Sequence[str] = (*self.names, *texts)
        self.dates: frozenset[str] = frozenset()
        self._parse = parse

    def read(self, messages: Sequence[bytes], names: Sequence[str]) -> Mapping[str, FloatArray]:
        """Reads fields by their names."""
        # A number behind the last dot is a place in a row.
        fields = list(dict.fromkeys(name.removesuffix(_place(name)) for name in names))
        get = attrgetter(*fields, fields[0])
        try:
            rows = [get(each) for each in self._objects(messages)]
        except AttributeError:
            # One definition makes them all: what one lacks, the first lacks.
            raise MalformedMessageError(0, "lacks a field by which it is read") from None
        columns = dict(zip(fields, zip(*rows, strict=True), strict=False))
        found = {}
        for name in names:
            place = _place(name)
            try:
                values = np.array(columns[name.removesuffix(place)], np.float64)
                found[name] = values[:, int(place[1:])] if place else values
            except (IndexError, TypeError, ValueError):
                raise MalformedMessageError(0, f"holds no number {name}") from None
        return found

    def read_words(self, messages: Sequence[bytes], name: str) -> Sequence[object]:
        """Reads a field of numbers or text."""
        get = attrgetter(name)
        return [get(each) for each in self._objects(messages)]

    def frame(self, message: bytes) -> str:
        """Returns `header.frame_id`, or `frame_id`."""
        found = self._parse(message)
        return str(getattr(getattr(found, "header", found), "frame_id", ""))

    def _objects(self, messages: Sequence[bytes]) -> Iterator[Any]:
        for index, message in enumerate(messages):
            try:
                yield self._parse(message)
            except Exception as error:  # a library raises anything over damaged bytes
                raise MalformedMessageError(index, f"cannot be read ({type(error).__name__})") from error


def _place(name: str) -> str:
    last = name.rpartition(".")[2]
    return f".{last}" if whole_number(last) is not None else ""


class JsonForm:
    """Messages of JSON; their fields are those of the first."""

    def __init__(self, first: bytes) -> None:
        found = _json(first, 0)
        self.names: Sequence[str] = tuple(islice(_json_names(found, "", 0), MOST_NAMES))
        self.dates = frozenset(name for name in self.names if "T" in str(_at(found, name)))
        self.words: Sequence[str] = tuple(islice(_json_words(found, "", 0), MOST_NAMES))

    def read(self, messages: Sequence[bytes], names: Sequence[str]) -> Mapping[str, FloatArray]:
        """Reads fields by their names; date and time becomes nanoseconds since 1970."""
        objects = self._objects(messages)
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(name.rpartition(".")[0], []).append(name)
        found: dict[str, FloatArray] = {}
        for group, members in groups.items():
            try:
                inner = objects
                for key in filter(None, group.split(".")):
                    inner = [each[key] for each in inner]
                for name in members:
                    last = name.rpartition(".")[2]
                    number = whole_number(last) if isinstance(inner[0], list) else None
                    get = itemgetter(last if number is None else number)
                    found[name] = _numbers([get(each) for each in inner])
            except (KeyError, TypeError, IndexError, ValueError, OverflowError):
                raise MalformedMessageError(
                    self._first_without(objects, members), f"holds no number {members[0]}"
                ) from None
        return found

    def read_words(self, messages: Sequence[bytes], name: str) -> Sequence[object]:
        """Reads a field of numbers or text."""
        words = []
        for each in self._objects(messages):
            try:
                word = _at(each, name)
            except (KeyError, TypeError, IndexError, ValueError):
                word = None
            words.append(word if isinstance(word, str | int | float) else None)
        return words

    def frame(self, message: bytes) -> str:
        """Returns `header.frame_id`, or `frame_id`."""
        found = _json(message, 0)
        inner = found.get("header", found) if isinstance(found, dict) else {}
        frame = inner.get("frame_id", "") if isinstance(inner, dict) else ""
        return frame if isinstance(frame, str) else ""

    def _objects(self, messages: Sequence[bytes]) -> list[Any]:
        try:
            objects: list[Any] = parse_json(b"[" + b",".join(messages) + b"]", only_finite=False)
        except JsonError:
            objects = []
        if len(objects) == len(messages):
            return objects
        return [_json(message, index) for index, message in enumerate(messages)]

    def _first_without(self, objects: Sequence[Any], names: Sequence[str]) -> int:
        for index, each in enumerate(objects):
            have = set(_json_names(each, "", 0))
            if not have.issuperset(names):
                return index
        return 0


def _at(value: Any, name: str) -> Any:  # noqa: ANN401 - JSON is anything
    for key in name.split("."):
        value = value[int(key) if isinstance(value, list) else key]
    return value


def _json(message: bytes, index: int) -> Any:  # noqa: ANN401 - JSON is anything
    try:
        return parse_json(message, only_finite=False)
    except JsonError as error:
        raise MalformedMessageError(index, "is no JSON") from error


def _json_names(value: Any, name: str, depth: int) -> Iterator[str]:  # noqa: ANN401
    """Names of all numbers, of text that is a number or a date, and of lists of three numbers."""
    if depth > DEEPEST:
        return
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _json_names(inner, f"{name}.{key}" if name else key, depth + 1)
    elif isinstance(value, list):
        if len(value) == AXES and is_triad(name):
            yield from (f"{name}.{number}" for number in range(AXES))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name
    elif isinstance(value, str) and whole_number(value[:1]) is not None:
        try:
            _numbers([value])
        except ValueError:
            return
        yield name


def _json_words(value: Any, name: str, depth: int) -> Iterator[str]:  # noqa: ANN401
    """Names of all numbers and texts that stand in no list."""
    if isinstance(value, dict) and depth <= DEEPEST:
        for key, inner in value.items():
            yield from _json_words(inner, f"{name}.{key}" if name else key, depth + 1)
    elif isinstance(value, str | int | float):
        yield name


def _numbers(values: Sequence[Any]) -> FloatArray:
    """Returns numbers, those that JSON of protocol buffers has as text, and dates as ns since 1970."""
    if isinstance(values[0], str) and "T" in values[0]:
        plain = [value.removesuffix("Z") for value in values]
        return np.array(plain, "datetime64[ns]").astype(np.int64).astype(np.float64)
    return np.array([np.nan if value is None else value for value in values], np.float64)
