"""A replay of a redundant set as a table on screen, and as JSON for machines."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.foundation.units import UNITS
from tumble.foundation.words import count_of
from tumble.procedures.redundancy.report.text import (
    REMEDIES,
    known_fault_sentences,
    output_sentences,
    value_and_limit,
)
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult, SecondaryError, Sensor
from tumble.report.numbers import NOT_OBSERVABLE, Scale, scales_of

SCHEMA: Final = "tumble-redundancy-result/1"

SENSORS: tuple[Sensor, ...] = ("accelerometer", "gyroscope")
MOST_SHOWN = 8
"""Spans and faults; a long day has hundreds, and events.jsonl has them all."""


def screen_summary(result: RedundancyResult) -> RenderableType:
    """Returns the main results: the outcome of each secondary, the sources, and their reasons."""
    return _summary(result, MOST_SHOWN)


def long_summary(result: RedundancyResult) -> RenderableType:
    """Returns the same, with all spans of the source and all faults."""
    return _summary(result, len(result.events) + len(result.selected))


def _summary(result: RedundancyResult, most: int) -> RenderableType:
    result = result.from_start()
    preset = f"; settings {result.preset}" if result.preset else ""
    done = (
        "watched live"
        if math.isnan(result.replay_rate)
        else f"replayed, {result.replay_rate:,.0f} times faster than real time"
    )
    head = f"Primary {result.primary}; {result.end - result.start:.1f} s {done}{preset}"
    first = [Text(line, "bold red") for line in known_fault_sentences(result)]
    first += [Text(line, "yellow") for line in output_sentences(result)]
    notes = [Text(line, "yellow") for line in [*_refusals(result), *_faults(result, most)]]
    notes += [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(*first, Text(head), "", _table(result), "", *map(Text, _sources(result, most)), *notes)


def json_content(result: RedundancyResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give the result without its traces; sentences have times from the start, all else those of the logs."""
    read = result.from_start()
    content = {
        "primary": result.primary,
        "secondaries": result.secondaries,
        "start": result.start,
        "end": result.end,
        "settings": result.settings,
        "preset": result.preset,
        "events": dict(Counter(event.event for event in result.events)),
        "verdict": result.verdict,
        "known_faults": known_fault_sentences(read),
        "output": output_sentences(read),
        "degraded": result.degraded,
        "errors": [_error_content(error) for error in result.errors],
        "selected": [
            {"start": span.start, "end": span.end, "unit": span.unit, "reason": span.reason}
            for span in result.selected
        ],
        "warnings": result.warnings,
        "calibration_hash": result.calibration_hash,
        "software": result.software,
        "replay_rate": result.replay_rate,
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _error_content(error: SecondaryError) -> dict[str, Any]:
    content = {name: getattr(error, name) for name in SecondaryError.__slots__}
    return content | {"bias": error.shown_bias}


def _table(result: RedundancyResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    for title in ("", "deviation at rest", "triggered", "calibrated", "residual before", "after"):
        table.add_column(title, overflow="fold")
    scales = _scales(result)
    for unit in result.secondaries:
        table.add_row(Text(unit, "bold"))
        for sensor in SENSORS:
            table.add_row(f"  {sensor}", *_row(result, unit, sensor, scales[UNITS[sensor]]))
    return table


def _scales(result: RedundancyResult) -> dict[str, Scale]:
    """Chooses the unit of each sensor that deviations and residuals of all units are shown in."""
    sizes = [(UNITS[sensor], 0.0) for sensor in SENSORS]
    for error in result.errors:
        sizes += [(UNITS[error.sensor], size) for size in (error.residual_before, error.residual)]
    for sensor in SENSORS:
        sizes += [
            (UNITS[sensor], float(str(event.figures["deviation"])))
            for event in result.events
            if event.event == "evaluated" and event.figures["sensor"] == sensor
        ]
    return scales_of(sizes)


def _row(result: RedundancyResult, unit: str, sensor: Sensor, scale: Scale) -> list[str]:
    own = [event for event in result.events if event.unit == unit]
    error = next((each for each in result.errors if (each.unit, each.sensor) == (unit, sensor)), None)
    times = sum(event.event == "triggered" and event.figures["sensors"] in (sensor, "both") for event in own)
    evaluated = [event for event in own if event.event == "evaluated" and event.figures["sensor"] == sensor]
    triggered = f"{times} times" if times > 1 else ("once" if times else "no")
    return [_deviation(evaluated, scale), triggered, *_calibrated(error, scale)]


def _deviation(evaluated: list[RedundancyEvent], scale: Scale) -> str:
    """Largest deviation against its threshold, of the first evaluation and of the last."""
    if not evaluated:
        return "not evaluated"
    first, last = (_largest(evaluated, time) for time in (evaluated[0].time, evaluated[-1].time))
    shown = [_quantity(first, scale)]
    if evaluated[0].time != evaluated[-1].time:
        shown.append(_quantity(last, scale))
    return ", then ".join(shown)


def _largest(evaluated: list[RedundancyEvent], time: float) -> float:
    return max(abs(float(str(event.figures["deviation"]))) for event in evaluated if event.time == time)


def _calibrated(error: SecondaryError | None, scale: Scale) -> list[str]:
    if error is None:
        return ["no", "", ""]
    when = "stored before" if error.adopted is None else f"at {error.adopted:.1f} s"
    in_part = f", {error.directions} of 3 directions" if error.directions < 3 else ""
    how = f"{when}: {error.fit_model}{in_part}"
    return [how, _quantity(error.residual_before, scale), _quantity(error.residual, scale)]


def _quantity(value: float, scale: Scale) -> str:
    text = scale.figure(value)
    return "" if text == NOT_OBSERVABLE else text


def _sources(result: RedundancyResult, most: int) -> Iterator[str]:
    """Yields the sources, their times and reasons; where they changed often, their total times."""
    if len(result.selected) <= most:
        for span in result.selected:
            yield f"Source {span.start:.2f} to {span.end:.2f} s: {span.unit or 'none'} ({span.reason})"
        return
    lengths: dict[str, float] = {}
    for span in result.selected:
        unit = span.unit or "none"
        lengths[unit] = lengths.get(unit, 0.0) + span.end - span.start
    times = ", ".join(f"{unit} for {seconds:.1f} s" for unit, seconds in lengths.items())
    yield f"Source changed {count_of('time', len(result.selected) - 1)}: {times}"


_WHY = {
    "refused": "Refused",
    "abandoned": "Abandoned",
    "withheld": "Withheld",
    "record rejected": "Not restored",
}


def _refusals(result: RedundancyResult) -> Iterator[str]:
    """Describes why sensors were not calibrated; repeated reasons once."""
    counts: Counter[str] = Counter()
    for event in result.events:
        if event.event in _WHY:
            sensor = event.figures.get("sensor", "")
            counts[
                f"{_WHY[event.event]}: {event.unit}{f' {sensor}' if sensor else ''}: {_reason(event)}"
            ] += 1
    for line, count in counts.items():
        yield line if count == 1 else f"{line} ({count} times)"


def _faults(result: RedundancyResult, most: int) -> Iterator[str]:
    """Name the faults of units; what happened again and again once, with its first time."""
    first: dict[tuple[str, str], RedundancyEvent] = {}
    counts: Counter[tuple[str, str]] = Counter()
    for event in result.events:
        if event.event == "unhealthy":
            whose = event.figures.get("sensor", event.figures.get("channel", ""))
            which = (event.unit, f"{event.figures['reason']}{f' ({whose})' if whose else ''}")
            first.setdefault(which, event)
            counts[which] += 1
    for (unit, fault), event in list(first.items())[:most]:
        count = counts[unit, fault]
        times = f", {count} times from then on" if count > 1 else ""
        yield f"Unhealthy: {unit}: {fault} at {event.time:.2f} s{_value_and_limit(event)}{times}"
    if len(first) > most:
        yield f"Unhealthy: {len(first) - most} more faults; events.jsonl has them all"


_REMEDY_SHOWN = ("primary invalid", "implausible misalignment", "no motion", "timed out")
"""Reasons that another set of options, or another motion, does away with; the report has remedies of all."""


def _reason(event: RedundancyEvent) -> str:
    reason = str(event.figures["reason"])
    remedy = f"; {_clause(REMEDIES[event.event][reason])}" if reason in _REMEDY_SHOWN else ""
    return f"{reason}{_value_and_limit(event)}{remedy}"


def _clause(sentence: str) -> str:
    return f"{sentence[0].lower()}{sentence[1:].rstrip('.')}"


def _value_and_limit(event: RedundancyEvent) -> str:
    """Returns the value that broke its limit, each in its unit, where there is a limit."""
    return f", {value_and_limit(event)}" if "limit" in event.figures else ""
