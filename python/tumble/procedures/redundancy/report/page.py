"""The page of a redundancy replay: what happened over time, what was found, and its file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from tumble.foundation.units import UNITS
from tumble.procedures.redundancy.known_faults import COVERED
from tumble.procedures.redundancy.report import text
from tumble.procedures.redundancy.report.difference import SENSORS, agreements
from tumble.procedures.redundancy.report.end_state import EndState, end_state
from tumble.procedures.redundancy.report.figures import deviations_figure, difference_figure, timeline_figure
from tumble.procedures.redundancy.report.parameters import error_groups
from tumble.procedures.redundancy.report.timeline import TimeLine, is_verdict, time_line
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult
from tumble.report.identity import Identity, serials
from tumble.report.numbers import scales_of
from tumble.report.page import Picture, ResultPage
from tumble.report.parameters import ParameterGroup

MOST_ROWS = 300
"""Events in a table; the page states the number of further ones in the file of events."""

_HEALTH = ("unhealthy", "healthy", "rest began", "rest ended")
_ALARMS = (
    *("refused", "abandoned", "unhealthy", "disagree", "record rejected", "time jumped"),
    "all saturated",
    *("aiding measurement left out", "aiding measurement distrusted"),
)


@dataclass(frozen=True, slots=True)
class UnitEndState:
    """State of a unit at the end."""

    unit: str
    word: str
    sign: str
    details: str


@dataclass(frozen=True, slots=True)
class EventRow:
    """One event, or the same event at once of two sensors, as printed."""

    time: str
    unit: str
    title: str
    details: str
    remedy: str
    alarm: bool


@dataclass(frozen=True, slots=True)
class EventTable:
    """Events as printed, and how many more there are."""

    rows: tuple[EventRow, ...]
    count: int
    left_out: int

    @property
    def has_remedies(self) -> bool:
        """Returns whether any of them has a remedy."""
        return any(row.remedy for row in self.rows)


@dataclass(frozen=True, slots=True)
class SensorSection:
    """Everything found of one sensor of a secondary."""

    sensor: str
    sentence: str
    groups: tuple[ParameterGroup, ...]


@dataclass(frozen=True, slots=True)
class RedundantUnitSection:
    """Everything found of one secondary."""

    name: str
    anchor: str
    nothing: str
    sensors: tuple[SensorSection, ...]


@dataclass(frozen=True, slots=True)
class AgreementRow:
    """Secondary minus primary as numbers, as printed."""

    unit: str
    sensor: str
    condition: str
    windows: str
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class RedundancyPage:
    """Data for the template of the page."""

    name: str
    state: EndState
    summary: tuple[str, ...]
    states: tuple[UnitEndState, ...]
    unobserved: tuple[str, ...]
    warnings: tuple[str, ...]
    time_line: Picture
    deviations: Picture | None
    differences: Picture | None
    occurs: frozenset[str]
    """Names of what the keys of the figures explain, of what is drawn: `vector exceeded`, `adopted`."""
    agreements: tuple[AgreementRow, ...]
    units: tuple[RedundantUnitSection, ...]
    events: EventTable
    evaluations: EventTable
    health: EventTable
    changed: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, str], ...]
    method: tuple[tuple[str, str], ...]


def redundancy_page(result: RedundancyResult) -> RedundancyPage:
    """Gathers the page."""
    result = result.from_start()
    line = time_line(result)
    told: dict[str, list[RedundancyEvent]] = {"events": [], "evaluations": [], "health": []}
    for event in result.events:
        told[_table_of(event)].append(event)
    changed, unchanged = _settings(result)
    return RedundancyPage(
        name=result.primary,
        state=end_state(result),
        summary=tuple(text.summary(result)),
        states=tuple(_state(result, unit) for unit in (result.primary, *result.secondaries)),
        unobserved=tuple(text.unobserved_sentences(result)),
        warnings=result.warnings,
        time_line=Picture(timeline_figure(line, "line"), _time_line_caption(line)),
        deviations=_deviations(result, line),
        differences=_differences(result, line),
        occurs=frozenset(_occurring(result, line)),
        agreements=_agreement_rows(result),
        units=tuple(_section(result, unit, number) for number, unit in enumerate(result.secondaries, 1)),
        events=event_table(told["events"]),
        evaluations=event_table(told["evaluations"]),
        health=event_table(told["health"]),
        changed=changed,
        settings=unchanged,
        method=_method(result),
    )


def _state(result: RedundancyResult, unit: str) -> UnitEndState:
    word, details = text.unit_state(result, unit)
    return UnitEndState(unit, word, text.STATE_SIGNS[word], details)


def event_table(events: Sequence[RedundancyEvent]) -> EventTable:
    """Prints events, with what to do; what is more than `MOST_ROWS` rows is only counted.

    The same event of one unit at one time, as of both its sensors, is one row.
    """
    together: dict[tuple[float, str, str], list[EventRow]] = {}
    for event in events:
        key = (event.time, event.unit, text.event_title(event))
        if len(together) < MOST_ROWS or key in together:
            together.setdefault(key, []).append(_row(event))
    rows = tuple(_one_row(members) for members in together.values())
    shown = sum(map(len, together.values()))
    return EventTable(rows, len(events), len(events) - shown)


def _row(event: RedundancyEvent) -> EventRow:
    return EventRow(
        time=f"{event.time:.2f}",
        unit=event.unit,
        title=text.event_title(event),
        details=text.event_details(event),
        remedy=text.remedy(event),
        alarm=_is_alarm(event),
    )


def _one_row(rows: Sequence[EventRow]) -> EventRow:
    return replace(
        rows[0],
        details="; ".join(filter(None, (row.details for row in rows))),
        remedy=" ".join(dict.fromkeys(filter(None, (row.remedy for row in rows)))),
        alarm=any(row.alarm for row in rows),
    )


def _table_of(event: RedundancyEvent) -> str:
    if event.event == "evaluated" or event.figures.get("reason") == COVERED:
        return "evaluations"
    return "health" if event.event in _HEALTH and not is_verdict(event) else "events"


def _is_alarm(event: RedundancyEvent) -> bool:
    if event.event in ("evaluated", "selected"):
        return bool(event.figures.get("exceeded")) or event.figures.get("reason") == "none fit"
    return event.event in _ALARMS


def _time_line_caption(line: TimeLine) -> str:
    jumps = " Dotted lines: the common clock jumped." if line.jumps else ""
    return (
        "A lane for each unit, the primary on top; the table of events explains each mark, as does the "
        "pointer on it. A bar on two lanes, with a line between them: these units disagreed. Spans "
        f"are drawn as one where the gap between them is too short to see.{jumps}"
    )


def _deviations(result: RedundancyResult, line: TimeLine) -> Picture | None:
    if not any(event.event == "evaluated" for event in result.events):
        return None
    return Picture(
        deviations_figure(result, line, "rest"),
        "Means over each rest: of the norm, |specific force| less gravity and |angular rate|; of the vector, "
        "the difference from the primary, where that was valid. The line is the threshold as it was then; "
        "of evaluations too many to draw, the largest deviations are shown.",
    )


def _occurring(result: RedundancyResult, line: TimeLine) -> Iterator[str]:
    if line.rests:
        yield "at rest"
    for event in result.events:
        if event.event == "adopted":
            yield "adopted"
        elif event.event == "evaluated":
            check = str(event.figures.get("check", "norm"))
            yield f"{check} exceeded" if event.figures.get("exceeded") else check


def _differences(result: RedundancyResult, line: TimeLine) -> Picture | None:
    if len(result.window_time) == 0 or not result.secondaries:
        return None
    return Picture(
        difference_figure(result, line, "less"),
        "Norm of secondary less primary, both in the primary's case frame; of many windows, root mean "
        "squares of neighbours. Compensated: with the error stored at the time, at the primary's place. "
        "Where nothing was stored yet, both are the same.",
    )


def _agreement_rows(result: RedundancyResult) -> tuple[AgreementRow, ...]:
    rows = [row for row in agreements(result) if row.windows]
    scales = scales_of((UNITS[row.sensor], size) for row in rows for size in (row.before, row.after))
    return tuple(
        AgreementRow(
            unit=row.unit,
            sensor=row.sensor,
            condition=row.condition,
            windows=str(row.windows),
            before=text.quantity(row.before, row.sensor, scales),
            after=text.quantity(row.after, row.sensor, scales),
        )
        for row in rows
    )


def _section(result: RedundancyResult, unit: str, number: int) -> RedundantUnitSection:
    errors = text.errors_of(result, unit)
    missing = [sensor for sensor in SENSORS if sensor not in {error.sensor for error in errors}]
    return RedundantUnitSection(
        name=unit,
        anchor=f"unit-{number}",
        nothing=f"Nothing is stored of its {' or its '.join(missing)}." if missing else "",
        sensors=tuple(
            SensorSection(error.sensor, text.fit_sentence(error), error_groups(error)) for error in errors
        ),
    )


def _settings(
    result: RedundancyResult,
) -> tuple[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]]:
    """Prints the settings: those that differ from their defaults, and the others."""
    changed, unchanged = [], []
    for name, value in result.settings.items():
        if name in result.defaults and result.defaults[name] != value:
            changed.append((name, f"{_setting(value)} (default {_setting(result.defaults[name])})"))
        else:
            unchanged.append((name, _setting(value)))
    return tuple(changed), tuple(unchanged)


def _setting(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return f"{value:g}"
    return "none" if value is None else str(value)


def _method(result: RedundancyResult) -> tuple[tuple[str, str], ...]:
    own = f"hash {result.calibration_hash}" if result.calibration_hash else "none: it is assumed to be right"
    lines = [
        ("Settings", result.preset),
        ("Errors", "of each secondary against the primary: y_secondary = M y_primary + b"),
        ("Residuals", "root mean square per channel on held-out pairs"),
        ("Sigmas", "of scale, non-orthogonality and mounting: the elements of M count as independent"),
        ("Calibration of the primary", own),
        (
            "Serial numbers",
            ", ".join(f"{unit} {serial}" for unit, serial in result.serials.items() if serial),
        ),
        ("Software", result.software),
    ]
    return tuple((name, text) for name, text in lines if text)


def _identity(result: RedundancyResult) -> Identity:
    return Identity(
        "Redundancy",
        result.primary,
        serials(result.serials),
        result.provenance,
        result.software,
        result.time.date,
    )


REDUNDANCY_REPORT = ResultPage(
    "tumble.procedures.redundancy.report", "redundancy.html.j2", redundancy_page, _identity
)
