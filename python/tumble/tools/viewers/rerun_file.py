"""Content for viewers as a recording of Rerun, `.rrd`, with the blueprint that arranges it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun
import rerun.blueprint as views

from tumble.foundation.file_names import file_stem
from tumble.foundation.files import FileKind, replacing
from tumble.foundation.recording import Chunk, FloatArray, SampleProgress
from tumble.foundation.units import TRIADS, UNITS
from tumble.logs.spec import files_of
from tumble.tools.viewers.content import (
    Form,
    SegmentState,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    counts_from_1970,
    topic_names,
)

RRD: Final = FileKind("a recording of Rerun", re.compile(rb"\ARRF2"), re.compile(rb"\n\x06tumble"))
TIME: Final = "time"
"""Timeline of all that is in the file."""
EVENTS: Final = "/events"
SET: Final = "/set"
"""Entity under which units stand where the alignment puts them."""
APPLICATION: Final = "tumble"
MAGNETOMETER: Final = "magnetometer"
AXIS_COLOURS: Final = ((214, 69, 65), (63, 153, 79), (52, 101, 196))
STATE_COLOURS: Final[dict[SegmentState, int]] = {
    "rest": 0x3F994FFF,
    "turn": 0x3465C4FF,
    "left out": 0x9A9A9AFF,
    "spin": 0x3465C4FF,
    "disturbance": 0xD98A1EFF,
    "source": 0x3F994FFF,
    "unhealthy": 0xD64541FF,
    "collecting": 0xD98A1EFF,
}
LEVELS: Final = {"info": "INFO", "warning": "WARN", "error": "ERROR"}
ARROW: Final = 0.1
"""Length of the axes of a unit in the view of a set, m."""


def write_rerun(content: ViewerContent, path: Path, progress: SampleProgress | None = None) -> None:
    """Writes content as `.rrd`; memory does not grow with the length of recordings.

    Raises `OutputError` where the file cannot be written, `LogError` where a recording cannot be read.
    """
    inputs = [file for unit in content.units for file in files_of(unit.recording)]
    with replacing(path, RRD, inputs=inputs) as file:
        # Rerun opens files by their names.
        _Recording(content, file.name).write(progress)


class _Recording:
    """One pass over content, sent to Rerun and from there to a file."""

    def __init__(self, content: ViewerContent, path: str) -> None:
        self._content = content
        self._stream = rerun.RecordingStream(APPLICATION, send_properties=False)
        self._stream.save(path, default_blueprint=blueprint(content))
        self._paths = {name: f"/{topic}" for name, topic in topic_names(content.units).items()}
        self._is_dated: bool | None = None

    def write(self, progress: SampleProgress | None) -> None:
        self._stream.send_recording_name(self._content.title)
        done = 0
        for unit in self._content.units:
            self._describe(unit)
            for raw, corrected in unit.samples():
                self._send_samples(unit, raw, corrected)
                done += len(raw)
                if progress is not None:
                    progress(done, None)
            self._send_fields(unit)
            self._send_segments(unit)
        self._send_events()
        # Closes the file, whose end holds its index.
        self._stream.disconnect()

    def _describe(self, unit: ShownUnit) -> None:
        """Sends what holds for all times: names of series, the parameters, the pose in a set."""
        path = self._paths[unit.name]
        for form in forms_of(unit):
            magnetic = (MAGNETOMETER,) if form in unit.field_forms else ()
            for triad in (*unit.recording.metadata.triads, *magnetic):
                names = [f"{unit.name} {axis}, {form}" for axis in "xyz"]
                series = rerun.SeriesLines(names=names, colors=AXIS_COLOURS)
                self._stream.log(f"{path}/{form}/{triad}", series, static=True)
        text = rerun.TextDocument(parameter_table(unit), media_type=rerun.MediaType.MARKDOWN)
        self._stream.log(f"{path}/calibration", text, static=True)
        if unit.pose is not None:
            pose = rerun.Transform3D(mat3x3=unit.pose.rotation, translation=unit.pose.translation)
            place = f"{SET}/{path.strip('/')}"
            self._stream.log(place, pose, rerun.TransformAxes3D(ARROW), static=True)

    def _send_samples(self, unit: ShownUnit, raw: Chunk, corrected: Chunk | None) -> None:
        path, times = self._paths[unit.name], self._times(raw.time)
        for form, chunk in zip(forms_of(unit), (raw, corrected), strict=False):
            assert chunk is not None, "a unit without a calibration has raw readings only"
            for triad in unit.recording.metadata.triads:
                self._send_triad(f"{path}/{form}/{triad}", times, getattr(chunk, triad))
        if raw.temperature is not None:
            columns = rerun.Scalars.columns(scalars=raw.temperature)
            self._stream.send_columns(f"{path}/temperature", [times], columns)

    def _send_fields(self, unit: ShownUnit) -> None:
        for form, track in unit.fields().items():
            if len(track):
                place = f"{self._paths[unit.name]}/{form}/{MAGNETOMETER}"
                self._send_triad(place, self._times(track.time), track.field)

    def _send_triad(self, place: str, times: rerun.TimeColumn, values: FloatArray) -> None:
        columns = rerun.Scalars.columns(scalars=values.ravel()).partition([3] * len(values))
        self._stream.send_columns(place, [times], columns)

    def _send_segments(self, unit: ShownUnit) -> None:
        path = self._paths[unit.name]
        for lane in unit.shown_lanes:
            segments = unit.lanes[lane]
            entity, changes = f"{path}/{file_stem(lane)}", list(unit.changes(lane))
            found = {state_name(each): each.state for each in segments}
            configuration = rerun.StateConfiguration(
                values=list(found),
                labels=list(found),
                colors=[STATE_COLOURS[each] for each in found.values()],
            )
            self._stream.log(entity, configuration, static=True)
            # An empty state ends the one before.
            states = ["" if each is None else state_name(each) for _, each in changes]
            times = self._times(np.array([time for time, _ in changes]))
            columns = rerun.StateChange.columns(state=states)
            self._stream.send_columns(entity, [times], columns)
            self._send_directions(path, unit, segments)

    def _send_directions(self, path: str, unit: ShownUnit, segments: Sequence[ShownSegment]) -> None:
        """Sends which direction of the case pointed up at each rest: all of them, and that of the time."""
        rests = [each for each in segments if each.state == "rest" and each.specific_force is not None]
        if not rests:
            return
        forces = np.array([each.specific_force for each in rests])
        up = forces / np.linalg.norm(forces, axis=1, keepdims=True)
        points = rerun.Points3D(up, labels=[each.label for each in rests], radii=0.02, show_labels=False)
        self._stream.log(f"{path}/up/rests", points, static=True)
        times = self._times(unit.times(np.array([each.start for each in rests])))
        self._stream.send_columns(f"{path}/up/now", [times], rerun.Arrows3D.columns(vectors=up))

    def _send_events(self) -> None:
        events = sorted(self._content.events, key=lambda each: each.time)
        for unit in ("", *(unit.name for unit in self._content.units)):
            own = [each for each in events if each.unit == unit]
            if own:
                times = self._times(np.array([each.time for each in own]))
                columns = rerun.TextLog.columns(
                    text=[each.text for each in own], level=[LEVELS[each.level] for each in own]
                )
                self._stream.send_columns(EVENTS + self._paths.get(unit, ""), [times], columns)

    def _times(self, time: FloatArray) -> rerun.TimeColumn:
        """Returns (n,) s as stamps of the timeline: dates where the clock counts from 1970, else durations.

        One file has one kind of them.
        """
        if self._is_dated is None:
            self._is_dated = counts_from_1970(float(time[0]))
        whole = np.floor(time)
        nanoseconds = whole.astype(np.int64) * 1_000_000_000 + np.rint(1e9 * (time - whole)).astype(np.int64)
        if self._is_dated:
            return rerun.TimeColumn(TIME, timestamp=nanoseconds.astype("datetime64[ns]"))
        return rerun.TimeColumn(TIME, duration=nanoseconds.astype("timedelta64[ns]"))


def forms_of(unit: ShownUnit) -> tuple[Form, ...]:
    """Returns the forms in which its readings are shown."""
    return ("raw",) if unit.calibration is None else ("raw", "calibrated")


def state_name(segment: ShownSegment) -> str:
    """Names a segment: `rest 3: Y up`."""
    return " ".join(filter(None, (segment.state, segment.label))) + (
        f" ({segment.remark})" if segment.remark else ""
    )


def parameter_table(unit: ShownUnit) -> str:
    """Returns verdict and parameters of a unit as a table of Markdown."""
    lines = [f"# {unit.name}", ""]
    if unit.verdict:
        lines += [f"**{unit.verdict}**", ""]
    if unit.parameters:
        lines += ["| sensor | parameter | value |", "|---|---|---|"]
        lines += [f"| {each.sensor} | {each.name} | {each.text} |" for each in unit.parameters]
    return "\n".join(lines)


def blueprint(content: ViewerContent) -> views.Blueprint:
    """Arranges a file: states above readings, directions and parameters beside them, events below."""
    paths = {name: f"/{topic}" for name, topic in topic_names(content.units).items()}
    charts = list(_charts(content, paths))
    return views.Blueprint(
        views.Vertical(
            views.Horizontal(
                views.Vertical(*charts, row_shares=_shares(charts)),
                views.Tabs(*_details(content, paths)),
                column_shares=[3, 1],
            ),
            views.TextLogView(origin=EVENTS, name="Events"),
            row_shares=[5, 1],
        ),
        views.TimePanel(timeline=TIME, state="collapsed", play_state="paused"),
        views.BlueprintPanel(state="collapsed"),
        views.SelectionPanel(state="collapsed"),
    )


def _shares(charts: Sequence[Any]) -> list[int]:
    """Returns the heights of charts: states need less than readings."""
    return [2 if isinstance(each, views.StateTimelineView) else 3 for each in charts]


def _charts(content: ViewerContent, paths: dict[str, str]) -> Iterator[Any]:
    lanes = [f"{paths[unit.name]}/{file_stem(lane)}" for unit in content.units for lane in unit.shown_lanes]
    ends = (rerun.TimeRangeBoundary.infinite(), rerun.TimeRangeBoundary.infinite())
    everything = views.TimeAxis(view_range=rerun.TimeRange(*ends))
    if lanes:
        yield views.StateTimelineView(contents=lanes, name="Rests, turns and states", time_view=everything)
    for triad, name in zip(TRIADS, ("Specific force", "Angular rate"), strict=True):
        shown = [
            f"{paths[unit.name]}/{form}/{triad}"
            for unit in content.units
            for form in forms_of(unit)[-1:]
            if triad in unit.recording.metadata.triads
        ]
        if shown:
            yield views.TimeSeriesView(contents=shown, name=f"{name}, {UNITS[triad]}", axis_x=everything)
    fields = [
        f"{paths[unit.name]}/{form}/{MAGNETOMETER}"
        for unit in content.units
        for form in unit.field_forms[-1:]
    ]
    if fields:
        yield views.TimeSeriesView(contents=fields, name="Magnetic field, uT", axis_x=everything)


def _details(content: ViewerContent, paths: dict[str, str]) -> Iterator[Any]:
    if any(unit.pose is not None for unit in content.units):
        yield views.Spatial3DView(origin=SET, name="Set")
    for unit in content.units:
        yield views.TextDocumentView(origin=f"{paths[unit.name]}/calibration", name=unit.name)
    for unit in content.units:
        if any(each.specific_force is not None for lane in unit.lanes.values() for each in lane):
            yield views.Spatial3DView(origin=f"{paths[unit.name]}/up", name=f"Up, {unit.name}")
