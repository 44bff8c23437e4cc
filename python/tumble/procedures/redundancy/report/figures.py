"""The figures of a replay: its time line, deviations against thresholds, secondary minus primary."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.foundation.units import UNITS
from tumble.foundation.words import count_of
from tumble.procedures.redundancy.report.difference import QUANTITIES, SENSORS, difference, thinned
from tumble.procedures.redundancy.report.text import event_details, mark_text
from tumble.procedures.redundancy.report.timeline import (
    WAITING,
    Evaluations,
    Lane,
    TimeLine,
    evaluations,
    is_verdict,
    merged,
)
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult, Sensor
from tumble.procedures.redundancy.spans import Span
from tumble.report.canvas import Axes, Figure, Side
from tumble.report.figures import COMPENSATED, FULL_WIDTH, RIGHT, UNCOMPENSATED, shade
from tumble.report.numbers import readable_unit, significant
from tumble.report.panel import LABEL_SIZE, horizontal_axis, numbered_value_axis, row_label, short
from tumble.report.svg import ALARM, GRID, INK, REST, SOFT, UNUSED, X_AXIS, Y_AXIS, Z_AXIS, inline_svg

MOST_POINTS = 400
"""Points of one line or kind in a panel; more cannot be distinguished, and make the page heavy."""
MOST_POINTS_OF_ALL = 1200
"""Evaluations of one check of one sensor, of all units together."""
MOST_MARKS = 150
"""Marks on the lane of a unit; where there are more, every so-manyth is drawn."""

NAME_ROOM = 1.05
"""Inches left of the lanes, for the names of units."""
LANE = 0.62
"""Inches a lane is high."""
PANEL_HEIGHT, PANEL_GAP = 0.82, 0.28

MARKS = {
    "triggered": ("v", INK, False),
    "adopted": ("D", Z_AXIS, False),
    "refused": ("X", ALARM, False),
    "abandoned": ("s", ALARM, True),
    "withheld": ("o", SOFT, True),
    "restored": ("^", Z_AXIS, True),
    "record rejected": ("P", ALARM, True),
    "found wrong": ("x", ALARM, False),
}
"""Marker, colour and whether hollow, of each event: distinguished by shape alone."""

_LETTER = 0.062
"""Inches that a letter of a mark's text is wide."""
_SHORTEST_SEEN = 1 / 700
"""Share of the time axis below which a gap cannot be seen."""
EXCEEDED = {"o": "x", "D": "X"}
"""Markers of deviations beyond their threshold: distinguished by shape too."""
_CHECKS = (("norm", "o", X_AXIS, True), ("vector", "D", Z_AXIS, False))
_SMALLEST_DECADES = 2


def timeline_figure(line: TimeLine, prefix: str) -> Markup:
    """Draws a lane for each unit: source, mode, health and marks; rests shaded over all lanes."""
    bottom, top = 0.45, 0.62
    height = bottom + top + LANE * len(line.lanes)
    figure = Figure(FULL_WIDTH, height)
    axes = figure.add_axes((NAME_ROOM, bottom, FULL_WIDTH - NAME_ROOM - RIGHT, LANE * len(line.lanes)))
    axes.set_ylim(len(line.lanes), 0)
    horizontal_axis(axes, line.start, line.end, "time, s", most=12)
    gap = (line.end - line.start) * _SHORTEST_SEEN
    shade(axes, [(span.start, span.end) for span in merged(line.rests, gap)], REST, "")
    for place, lane in enumerate(line.lanes):
        _draw_lane(axes, line, lane, float(place), gap)
    _draw_disagreements(axes, line, gap)
    _draw_key(figure, line, height)
    _bars(axes, merged(line.no_source, gap), 0.0, 0.07, ALARM, "")
    for jump in line.jumps[:MOST_MARKS]:
        axes.line([jump, jump], axes.get_ylim(), ALARM, dash="1 1.65")
    return inline_svg(figure, prefix, f"Time line of {len(line.lanes)} units: source, mode, health and marks")


def _draw_lane(axes: Axes, line: TimeLine, lane: Lane, top: float, gap: float) -> None:
    row_label(axes, top + 0.55, short(lane.unit), 8)
    axes.line([line.start, line.end], [top, top], GRID, 0.8, order=0.5)
    _bars(axes, merged(lane.source, gap), top + 0.12, 0.1, INK, "")
    waiting = [span for span in lane.modes if span.kind == WAITING]
    collecting = [span for span in lane.modes if span.kind != WAITING]
    _bars(axes, merged(waiting, gap), top + 0.56, 0.17, UNUSED, "////")
    _bars(axes, merged(collecting, gap), top + 0.56, 0.17, X_AXIS, "")
    _bars(axes, _wide_enough(merged(lane.unhealthy, gap), 2 * gap), top + 0.78, 0.17, ALARM, "xxxx")
    _draw_marks(axes, line, lane, top + 0.38)


def _draw_marks(axes: Axes, line: TimeLine, lane: Lane, place: float) -> None:
    shown: dict[tuple[float, str], RedundancyEvent] = {}
    for kind, (marker, colour, hollow) in MARKS.items():
        own = {event.time: event for event in lane.marks if _kind(event) == kind}
        times = list(own)[:: max(1, -(-len(own) // MOST_MARKS))]
        shown |= {(time, kind): own[time] for time in times}
        titles = [f"{time:.2f} s: {mark_text(own[time])}, {event_details(own[time])}" for time in times]
        _points(axes, times, [place] * len(times), marker, colour, hollow, 5.0, titles)
    # A text is written where it has room up to the next mark; refusals go before what went well.
    inches = (FULL_WIDTH - NAME_ROOM - RIGHT) / (line.end - line.start)
    taken = [(time * inches - 0.06, time * inches + 0.06) for time, _ in shown]
    for (time, _), event in sorted(
        shown.items(), key=lambda item: item[1].event not in ("unhealthy", "refused", "abandoned")
    ):
        text, at = mark_text(event), time * inches
        for side, start in _sides(at, text):
            end = start + _LETTER * len(text)
            inside = line.start * inches <= start and end <= line.end * inches
            if inside and not any(first < end and last > start for first, last in taken):
                taken.append((start, end))
                axes.text(
                    time,
                    place,
                    text,
                    shift=(6 if side == "left" else -6, 0),
                    ha=side,
                    va="center",
                    size=LABEL_SIZE,
                    color=INK,
                )
                break


def _kind(event: RedundancyEvent) -> str:
    """Returns which of `MARKS` an event is."""
    return "found wrong" if is_verdict(event) else event.event


def _draw_disagreements(axes: Axes, line: TimeLine, gap: float) -> None:
    """Draws a bar on the lanes of both units and, where it begins, a line from one to the other."""
    places = {lane.unit: float(place) for place, lane in enumerate(line.lanes)}
    for dispute in line.disagreements[:MOST_MARKS]:
        tops = sorted(places[unit] for unit in dispute.units if unit in places)
        title = (
            f"{dispute.start:.2f} to {dispute.end:.2f} s: {dispute.units[0]}: {event_details(dispute.cause)}"
        )
        shown = _wide_enough([Span(dispute.start, dispute.end)], 2 * gap)
        for top in tops:
            _bars(axes, shown, top + 0.25, 0.07, Y_AXIS, "", title)
        if len(tops) == 2:
            axes.line([dispute.start] * 2, [tops[0] + 0.25, tops[1] + 0.32], Y_AXIS, 0.9, order=1.4)


def _sides(at: float, text: str) -> tuple[tuple[Side, float], ...]:
    """Beginning of a text, in inches, beside a mark to its left or right, and its end."""
    return ("left", at + 0.07), ("right", at - 0.07 - _LETTER * len(text))


def _draw_key(figure: Figure, line: TimeLine, height: float) -> None:
    """Explains what the time line shows, and nothing else."""
    key = figure.add_axes((0.0, height - 0.55, FULL_WIDTH, 0.5))
    key.set_xlim(0.0, FULL_WIDTH)
    key.set_ylim(2.0, 0.0)
    left = NAME_ROOM
    swatches = (
        ("source", INK, ""),
        ("no source", ALARM, ""),
        ("at rest", REST, ""),
        ("waiting for motion", UNUSED, "////"),
        ("collecting", X_AXIS, ""),
        ("unhealthy", ALARM, "xxxx"),
        ("disagree", Y_AXIS, ""),
    )
    shown = _shown(line)
    for name, colour, hatch in swatches:
        if not shown[name]:
            continue
        thin = name.endswith("source") or name == "disagree"
        _bars(key, [Span(left, left + 0.24)], 0.42 if thin else 0.28, 0.18 if thin else 0.46, colour, hatch)
        key.text(left + 0.29, 0.5, name, va="center", size=LABEL_SIZE, color=SOFT)
        left += 0.55 + _LETTER * len(name)
    left = NAME_ROOM
    occurring = {_kind(event) for lane in line.lanes for event in lane.marks}
    for name, (marker, colour, hollow) in MARKS.items():
        if name not in occurring:
            continue
        _points(key, [left + 0.06], [1.5], marker, colour, hollow, 5.0)
        key.text(left + 0.18, 1.5, name, va="center", size=LABEL_SIZE, color=SOFT)
        left += 0.4 + _LETTER * len(name)


def _shown(line: TimeLine) -> dict[str, bool]:
    """Returns the kinds of spans that occur, by their names in the key."""
    modes = {span.kind for lane in line.lanes for span in lane.modes}
    return {
        "source": any(lane.source for lane in line.lanes),
        "no source": bool(line.no_source),
        "at rest": bool(line.rests),
        "waiting for motion": WAITING in modes,
        "collecting": bool(modes - {WAITING}),
        "unhealthy": any(lane.unhealthy for lane in line.lanes),
        "disagree": bool(line.disagreements),
    }


def deviations_figure(result: RedundancyResult, line: TimeLine, prefix: str) -> Markup:
    """Draws each deviation at rest against the threshold it had then: a row for each unit, log scale."""
    units = (result.primary, *result.secondaries)
    height = 0.5 + len(units) * (PANEL_HEIGHT + PANEL_GAP) + 0.1
    figure = Figure(FULL_WIDTH, height)
    for column, sensor in enumerate(SENSORS):
        found = [evaluations(result, unit, sensor) for unit in units]
        low, high = decades(
            [np.array([each.deviation, each.threshold]) for series in found for each in series.values()]
        )
        for row, (unit, series) in enumerate(zip(units, found, strict=True)):
            axes = _panel(figure, height, row, column)
            title = f"{short(unit)}, {sensor}, {readable_unit(UNITS[sensor])}"
            log_value_axis(axes, low, high, title if series else f"{title}: never evaluated")
            _time_axis(axes, line, last=row == len(units) - 1)
            for check, marker, colour, hollow in _CHECKS:
                if check in series:
                    _draw_evaluations(
                        axes, series[check], marker, colour, hollow, MOST_POINTS_OF_ALL // len(units)
                    )
    return inline_svg(
        figure, prefix, f"Deviations of {count_of('unit', len(units))} at rest against their thresholds"
    )


def _draw_evaluations(
    axes: Axes, series: Evaluations, marker: str, colour: str, hollow: bool, most: int
) -> None:
    kept = _worst(series, most)
    lowest = 10.0 ** axes.get_ylim()[0]
    time = np.array(series.time)[kept]
    deviation = np.log10(np.maximum(np.array(series.deviation)[kept], lowest))
    exceeded = np.array(series.exceeded)[kept]
    threshold = np.log10(np.maximum(np.array(series.threshold)[kept], lowest))
    start, end = axes.get_xlim()
    steps = np.flatnonzero(np.diff(threshold, prepend=np.nan) != 0)
    since = np.repeat([start, *time[steps[1:]], end], 2)[1:-1]
    axes.line(since, np.repeat(threshold[steps], 2), ALARM, 0.9, order=1.2)
    _points(axes, time[~exceeded], deviation[~exceeded], marker, colour, hollow, 3.6)
    _points(axes, time[exceeded], deviation[exceeded], EXCEEDED[marker], ALARM, False, 4.6)


def _worst(series: Evaluations, most: int) -> list[int]:
    """Chooses which evaluations are drawn: the largest deviation of many neighbours."""
    count = len(series.time)
    edges = np.linspace(0, count, min(count, most) + 1).astype(int)
    deviation = np.nan_to_num(np.array(series.deviation), nan=-1.0)
    return [int(first + np.argmax(deviation[first:last])) for first, last in pairwise(edges)]


def difference_figure(result: RedundancyResult, line: TimeLine, prefix: str) -> Markup:
    """Draws |secondary - primary| over time, raw and compensated: a row for each secondary, log scale."""
    units = result.secondaries
    height = 0.5 + len(units) * (PANEL_HEIGHT + PANEL_GAP) + 0.1
    figure = Figure(FULL_WIDTH, height)
    for column, sensor in enumerate(SENSORS):
        lines = [_thin_lines(result, unit, sensor) for unit in units]
        low, high = decades([values for _, *both in lines for values in both])
        for row, (unit, (time, before, after)) in enumerate(zip(units, lines, strict=True)):
            axes = _panel(figure, height, row, column)
            title = f"{short(unit)}, {QUANTITIES[sensor]}, {readable_unit(UNITS[sensor])}"
            log_value_axis(axes, low, high, title)
            _time_axis(axes, line, last=row == len(units) - 1)
            for values, colour, width in ((before, UNCOMPENSATED, 1.3), (after, COMPENSATED, 0.8)):
                axes.line(time, np.log10(np.maximum(values, 10.0**low)), colour, width)
            for adopted in _adoptions(result, unit, sensor):
                axes.line([adopted, adopted], axes.get_ylim(), Z_AXIS, 0.9, order=1.0)
                _points(axes, [adopted], [high], "D", Z_AXIS, False, 4.0)
    return inline_svg(
        figure, prefix, f"{len(units)} secondaries less {result.primary}, as read and compensated"
    )


def _thin_lines(
    result: RedundancyResult, unit: str, sensor: Sensor
) -> tuple[FloatArray, FloatArray, FloatArray]:
    compared = difference(result, unit, sensor)
    time, before = thinned(compared.time, compared.before, MOST_POINTS)
    _, after = thinned(compared.time, compared.after, MOST_POINTS)
    return time, before, after


def _adoptions(result: RedundancyResult, unit: str, sensor: Sensor) -> list[float]:
    return [
        event.time
        for event in result.events
        if event.event == "adopted" and event.unit == unit and event.figures.get("sensor") == sensor
    ][-MOST_MARKS:]


def decades(arrays: Sequence[FloatArray]) -> tuple[float, float]:
    """Returns decadic logarithms that hold what is positive and finite, at least two decades."""
    numbers = np.concatenate([np.ravel(array) for array in arrays]) if arrays else np.empty(0)
    numbers = numbers[np.isfinite(numbers) & (numbers > 0)]
    if not numbers.size:
        return -3.0, 0.0
    # One outlier close to zero would press everything else to the upper edge.
    low, high = np.log10(np.quantile(numbers, 0.02)), np.log10(numbers.max())
    low, high = float(np.floor(low)), float(np.ceil(high + 0.05))
    return min(low, high - _SMALLEST_DECADES), high


def log_value_axis(axes: Axes, low: float, high: float, title: str) -> None:
    """Sets a vertical axis of decadic logarithms, decades written as numbers."""
    axes.set_ylim(low, high)
    marks = range(math.ceil(low), math.floor(high) + 1)
    stride = 1 if len(marks) <= 4 else 2
    axes.grid(marks, "y", GRID)
    shown = marks[::stride]
    numbered_value_axis(axes, shown, [significant(10.0**mark, 1) for mark in shown], title)


def _panel(figure: Figure, height: float, row: int, column: int) -> Axes:
    left = 0.62
    width = FULL_WIDTH / 2 - left - RIGHT - 0.05
    top = height - 0.2 - row * (PANEL_HEIGHT + PANEL_GAP)
    return figure.add_axes((left + column * FULL_WIDTH / 2, top - PANEL_HEIGHT, width, PANEL_HEIGHT))


def _time_axis(axes: Axes, line: TimeLine, *, last: bool) -> None:
    axes.set_xlim(line.start, line.end)
    gap = (line.end - line.start) * _SHORTEST_SEEN
    shade(axes, [(span.start, span.end) for span in merged(line.rests, gap)], REST, "")
    if last:
        horizontal_axis(axes, line.start, line.end, "time, s", most=8)


def _wide_enough(spans: Iterable[Span], shortest: float) -> list[Span]:
    """Widens what is too short to be seen, so that no fault is overlooked."""
    return [Span(span.start, max(span.end, span.start + shortest), span.kind) for span in spans]


def _bars(
    axes: Axes, spans: Sequence[Span], top: float, height: float, colour: str, hatch: str, title: str = ""
) -> None:
    ends = [(span.start, span.end) for span in spans]
    axes.bars(ends, top, height, colour, hatch, ink=SOFT, order=1.5, title=title)


def _points(
    axes: Axes,
    x: Sequence[float] | FloatArray,
    y: Sequence[float] | FloatArray,
    marker: str,
    colour: str,
    hollow: bool,
    size: float,
    titles: Sequence[str] = (),
) -> None:
    axes.points(x, y, colour, marker, size, hollow=hollow, edge=0.9, clipped=False, titles=titles)
