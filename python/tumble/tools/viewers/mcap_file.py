"""Content for viewers as MCAP: for Foxglove, with a layout that arranges it, for PlotJuggler and for ROS 2.

Topics are `/UNIT/raw` and `/UNIT/calibrated` (sensor_msgs/Imu), with a magnetometer `/UNIT/raw/mag` and
`/UNIT/calibrated/mag` (sensor_msgs/MagneticField), `/UNIT/LANE` (segments), `/UNIT/up`,
`/events`, `/calibration` and `/tf`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from tumble.foundation.errors import OutputError
from tumble.foundation.files import FileKind, write_text
from tumble.foundation.recording import Chunk, FloatArray, SampleProgress
from tumble.foundation.units import TRIADS
from tumble.logs import Facts, open_mcap_writer
from tumble.logs.spec import files_of
from tumble.logs.writer_mcap import McapWriter, nanoseconds_of
from tumble.tools.viewers import ros_messages
from tumble.tools.viewers.content import GOOD_VERDICTS, ShownParameter, ShownUnit, ViewerContent, topic_names
from tumble.tools.viewers.foxglove_layout import lane_topic, layout_of

LAYOUT: Final = FileKind(
    "a layout of Foxglove", re.compile(rb'\A\{\s*"configById"'), re.compile(rb'"StateTransitions!tumble"')
)
EVENTS: Final = "/events"
CALIBRATION: Final = "/calibration"
TRANSFORMS: Final = "/tf"
PIECE: Final = 64
"""Samples of a topic that are written before those of the others."""
_LEVELS: Final = {"info": 2, "warning": 3, "error": 4}
"""Levels of `foxglove.Log`."""
_COLOUR: Final = (0.25, 0.6, 0.31)


@dataclass(frozen=True, slots=True)
class _Pending:
    """A message that is written once the samples are as far."""

    stamp: int
    topic: str
    message: Any


def layout_path(path: Path) -> Path:
    """Returns where the layout of an MCAP file is written."""
    return path.with_name(f"{path.stem}-layout.json")


def write_mcap(content: ViewerContent, path: Path, progress: SampleProgress | None = None) -> None:
    """Writes content as MCAP, and beside it the layout with which Foxglove shows it.

    Raises `OutputError` where a file cannot be written, a recording lacks a triad, or its stamps do not fit
    messages; `LogError` where a recording cannot be read.
    """
    for unit in content.units:
        if unit.recording.metadata.triads not in (TRIADS, ()):
            raise OutputError(
                f"{path}: an MCAP message holds both triads, and {unit.name} has "
                f"{unit.recording.metadata.triads[0]} readings only; leave out --mcap"
            )
    inputs = [file for unit in content.units for file in files_of(unit.recording)]
    with open_mcap_writer(path, Facts(), inputs=inputs) as writer:
        _write(writer, content, path, progress)
    write_text(layout_path(path), json.dumps(layout_of(content), indent=2) + "\n", LAYOUT)


def _write(writer: McapWriter, content: ViewerContent, path: Path, progress: SampleProgress | None) -> None:
    names = topic_names(content.units)
    streams = [(unit, _pieces(unit)) for unit in content.units]
    waiting = [(unit, stream, first) for unit, stream in streams if (first := next(stream, None)) is not None]
    starts = {unit.name: float(first[0].time[0]) for unit, _, first in waiting}
    fields = {unit.name: _Fields(unit, names[unit.name]) for unit in content.units}
    starts = {name: each.start for name, each in fields.items() if each.start < np.inf} | starts
    pending = sorted(_pending(content, names, starts, path), key=lambda each: each.stamp, reverse=True)
    done = 0
    while waiting:
        unit, stream, (raw, corrected) = waiting.pop(
            min(range(len(waiting)), key=lambda place: float(waiting[place][2][0].time[0]))
        )
        # Messages that belong before these samples come first, so that players need not sort.
        _write_until(writer, pending, int(nanoseconds_of(raw.time[:1], path)[0]))
        fields[unit.name].write_until(writer, float(raw.time[-1]))
        for form, chunk in (("raw", raw), ("calibrated", corrected)):
            if chunk is not None:
                writer.write(chunk, f"{names[unit.name]}/{form}", frame=names[unit.name])
        done += len(raw)
        if progress is not None:
            progress(done, None)
        if (following := next(stream, None)) is not None:
            waiting.append((unit, stream, following))
    _write_until(writer, pending, None)
    for each in fields.values():
        each.write_until(writer, np.inf)


class _Fields:
    """Readings of the magnetometer of a unit, which are written as far as its samples are."""

    def __init__(self, unit: ShownUnit, topic: str) -> None:
        self._topic = topic
        self._tracks = unit.fields()
        self._written = 0

    @property
    def start(self) -> float:
        """Returns the time of the first reading, s; infinite where there is none."""
        return min((float(track.time[0]) for track in self._tracks.values() if len(track)), default=np.inf)

    def write_until(self, writer: McapWriter, time: float) -> None:
        """Writes the readings up to a time, s of the clock of the first unit."""
        before = self._written
        for form, track in self._tracks.items():
            self._written = int(np.searchsorted(track.time, time, side="right"))
            part = track.chosen(slice(before, self._written))
            writer.write_magnetic(part, f"{self._topic}/{form}", frame=self._topic)


def _pieces(unit: ShownUnit) -> Iterator[tuple[Chunk, Chunk | None]]:
    """Passes over samples, few at a time, so that messages of all topics are nearly in order of time."""
    for raw, corrected in unit.samples():
        for first in range(0, len(raw), PIECE):
            part = slice(first, first + PIECE)
            yield _part(raw, part), None if corrected is None else _part(corrected, part)


def _part(chunk: Chunk, part: slice) -> Chunk:
    temperature = None if chunk.temperature is None else chunk.temperature[part]
    return Chunk(chunk.time[part], chunk.accelerometer[part], chunk.gyroscope[part], temperature)


def _write_until(writer: McapWriter, pending: list[_Pending], stamp: int | None) -> None:
    while pending and (stamp is None or pending[-1].stamp <= stamp):
        each = pending.pop()
        kind = each.message.__msgtype__
        writer.write_message(
            each.topic, kind, ros_messages.definition_of(kind), each.stamp, ros_messages.cdr(each.message)
        )


def _pending(
    content: ViewerContent, names: dict[str, str], starts: dict[str, float], path: Path
) -> Iterator[_Pending]:
    def stamp_of(time: float) -> int:
        return int(nanoseconds_of(np.array([time]), path)[0])

    for event in content.events:
        stamp = stamp_of(event.time)
        line = ros_messages.log(stamp, _LEVELS[event.level], event.text, names.get(event.unit, "tumble"))
        yield _Pending(stamp, EVENTS, line)
    for unit in content.units:
        name = names[unit.name]
        for lane in unit.shown_lanes:
            for time, begun in unit.changes(lane):
                stamp = stamp_of(time)
                said = ("none", "", "") if begun is None else (begun.state, begun.label, begun.remark)
                yield _Pending(stamp, f"/{name}/{lane_topic(lane)}", ros_messages.segment(stamp, name, *said))
                if begun is not None and begun.state == "rest" and begun.specific_force is not None:
                    up = begun.specific_force / float(np.linalg.norm(begun.specific_force))
                    label = f"rest {begun.label}"
                    scene = ros_messages.arrow(stamp, name, label, up, _COLOUR)
                    yield _Pending(stamp, f"/{name}/up", scene)
    if starts:
        first = stamp_of(min(starts.values()))
        statuses = [_status(unit, names[unit.name]) for unit in content.units]
        yield _Pending(first, CALIBRATION, ros_messages.diagnostics(first, statuses))
        yield from _transforms(content.units, names, first)


def _transforms(units: Iterable[ShownUnit], names: dict[str, str], stamp: int) -> Iterator[_Pending]:
    first = next(iter(names.values()))
    for unit in units:
        if unit.pose is not None and names[unit.name] != first:
            turn = quaternion_of(unit.pose.rotation)
            moved = ros_messages.transform(stamp, first, names[unit.name], unit.pose.translation, turn)
            yield _Pending(stamp, TRANSFORMS, moved)


def _status(unit: ShownUnit, name: str) -> Any:  # noqa: ANN401 - classes of messages are made at run time
    level = 0 if unit.verdict in ("", *GOOD_VERDICTS) else 1
    level = 2 if unit.verdict in ("fail", "not calibrated") else level
    values = {name: text for each in unit.parameters for name, text in _values(each)}
    return ros_messages.status(level, name, unit.verdict, unit.recording.metadata.serial, values)


def _values(parameter: ShownParameter) -> Iterator[tuple[str, str]]:
    """Returns value and 1-sigma of a parameter as numbers alone, which PlotJuggler plots."""
    name = f"{parameter.sensor} {parameter.name}".strip()
    unit = "" if parameter.unit == "1" else f", {parameter.unit}"
    if not np.isfinite(parameter.value):
        yield f"{name}{unit}", "not observable"
        return
    yield f"{name}{unit}", f"{parameter.value:.9g}"
    if np.isfinite(parameter.sigma):
        yield f"{name}, 1-sigma{unit}", f"{parameter.sigma:.3g}"


def quaternion_of(rotation: FloatArray) -> FloatArray:
    """Returns the quaternion (4,) x, y, z, w of a rotation (3, 3), by its largest component.

    Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1(3), 1978.
    """
    trace = float(np.trace(rotation))
    squares = np.array([*(1.0 + 2.0 * np.diag(rotation) - trace), 1.0 + trace])
    differences = rotation - rotation.T
    w_products = np.array([differences[2, 1], differences[0, 2], differences[1, 0]])
    sums = rotation + rotation.T
    products = np.zeros((4, 4))
    products[:3, :3] = sums
    products[3, :3] = products[:3, 3] = w_products
    np.fill_diagonal(products, squares)
    row = products[int(np.argmax(squares))]
    found: FloatArray = row / float(np.linalg.norm(row))
    return found
