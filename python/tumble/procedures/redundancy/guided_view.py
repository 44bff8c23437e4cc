"""View of a watched set, made of its board: the words are those of the dashboard."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, TypeAlias

from tumble.foundation.message import NOTHING, Message, message
from tumble.procedures.redundancy.board import DISAGREES, HEALTHY, SENSORS, WAITING, SetBoard, UnitOnBoard
from tumble.procedures.redundancy.live import RedundancyStep, SetState
from tumble.procedures.redundancy.monitor import COMMANDS
from tumble.procedures.redundancy.report.text import (
    deviation_of_threshold,
    event_details,
    event_title,
    mark_text,
    remedy,
)
from tumble.procedures.redundancy.result import RedundancyEvent, Sensor
from tumble.tools.guided.figures import (
    DeviationFigure,
    DeviationSeries,
    EventFigure,
    EventLine,
    RunFigure,
    StateFigure,
    StateRow,
)
from tumble.tools.guided.view import (
    RunAction,
    RunView,
    UnitLamp,
    UnitLampState,
    ViewKind,
)

NEWEST = 40
"""Events that are shown."""
FAULTS = ("unhealthy", "lost", "silent", "disagree", "no samples", "record rejected", "time jumped")
"""Events that report a fault."""
TITLES: Mapping[Sensor, Message] = {
    "accelerometer": message("Deviation of the accelerometers over their thresholds"),
    "gyroscope": message("Deviation of the gyroscopes over their thresholds"),
}
COLUMNS: Mapping[Sensor, Message] = {
    "accelerometer": message("accelerometer"),
    "gyroscope": message("gyroscope"),
}
ACTIONS = tuple(
    RunAction(command, label)
    for command, label in zip(
        COMMANDS, (message("Evaluate now"), message("Return to the primary")), strict=True
    )
)
LAMPS: Mapping[str, UnitLampState] = {
    HEALTHY: "good",
    WAITING: "waiting",
    DISAGREES: "warning",
    "silent": "silent",
    "lost": "lost",
}
"""By the condition of a unit; `faulty` for others."""
End: TypeAlias = Literal["listening", "done", "ended early"]


def is_shown_at_once(step: RedundancyStep) -> bool:
    """Returns whether a step has a view of its own; evaluations are shown with the next state."""
    return isinstance(step, SetState) or step.event in FAULTS or step.event == "selected"


def view_of(board: SetBoard, step: RedundancyStep | End, start: float) -> RunView:
    """Returns the view after a step, or at the beginning or the end; `start` is the first time, s."""
    rows = list(board.rows())
    event = step if isinstance(step, RedundancyEvent) else None
    is_fault = event is not None and event.event in FAULTS
    return RunView(
        kind=_kind(step),
        elapsed=0.0 if board.state is None else board.state.elapsed,
        instruction=_instruction(board, rows),
        detail=_detail(board),
        lamps=tuple(_lamp(row) for row in rows),
        figures=tuple(_figures(board, rows, start)),
        actions=() if step in ("done", "ended early") else ACTIONS,
        subject=event.unit if event is not None else "",
        warning=_warning(event) if event is not None and is_fault else _ending(step),
    )


def _kind(step: RedundancyStep | End) -> ViewKind:
    if isinstance(step, str):
        return step
    if isinstance(step, RedundancyEvent):
        return "warning" if step.event in FAULTS else "progress"
    return "progress"


def _warning(event: RedundancyEvent) -> Message:
    return message("{unit}: {text}", unit=event.unit, text=_fault(event))


def _ending(step: RedundancyStep | End) -> Message:
    return message("Stopped.") if step == "ended early" else NOTHING


def _instruction(board: SetBoard, rows: Sequence[UnitOnBoard]) -> Message:
    """Names what is wrong before all else."""
    faulty = [row for row in rows if LAMPS.get(row.condition, "faulty") not in ("good", "waiting")]
    if not board.source:
        return message("No source: {why}.", why=board.why)
    if len(faulty) == 1:
        return message("{unit}: {state}.", unit=faulty[0].name, state=Message(faulty[0].condition))
    if faulty:
        return message("{count} units are faulty.", count=len(faulty))
    return message("No unit is faulty.")


def _detail(board: SetBoard) -> Message:
    if not board.source:
        return Message(board.motion)
    source = message("The source is {source} ({why})", source=board.source, why=Message(board.why))
    if not board.motion:
        return message("{source}.", source=source)
    return message("{source}; {motion}.", source=source, motion=Message(board.motion))


def _lamp(row: UnitOnBoard) -> UnitLamp:
    rate = math.nan if row.rate is None else row.rate.rate
    return UnitLamp(row.name, LAMPS.get(row.condition, "faulty"), rate, Message(row.condition))


def _figures(board: SetBoard, rows: Sequence[UnitOnBoard], start: float) -> Iterator[RunFigure]:
    states = tuple(_state(board, row, rows) for row in rows)
    yield StateFigure(message("Units of the set"), (*COLUMNS.values(), message("calibration")), states)
    for sensor in SENSORS:
        series = tuple(_series(board, rows, sensor, start))
        if series:
            yield DeviationFigure(TITLES[sensor], "1", series, 1.0, tuple(_marks(board, start)))
    lines = (_line(event, start) for event in reversed(board.newest))
    yield EventFigure(message("Events"), tuple(lines))


def _state(board: SetBoard, row: UnitOnBoard, rows: Sequence[UnitOnBoard]) -> StateRow:
    lamp = LAMPS.get(row.condition, "faulty")
    calibration = message("primary") if row.name == board.units[0] else Message(row.calibration)
    return StateRow(
        name=row.name,
        state=Message(row.condition),
        healthy=None if lamp == "waiting" else lamp == "good",
        cells=(*(_deviation(row, sensor, rows) for sensor in SENSORS), calibration),
        exceeded=(*(_exceeds(row, sensor) for sensor in SENSORS), False),
        is_source=row.name == board.source,
        why=_fault(row.cause) if row.cause is not None else NOTHING,
    )


def _deviation(row: UnitOnBoard, sensor: Sensor, rows: Sequence[UnitOnBoard]) -> Message:
    event = row.deviations.get(sensor)
    if event is None:
        return NOTHING
    beside = [each.deviations[sensor] for each in rows if sensor in each.deviations]
    shown = deviation_of_threshold(event, beside)
    if sensor in row.calibrated:
        return message("{deviation}, before its calibration", deviation=shown)
    return Message(shown)


def _exceeds(row: UnitOnBoard, sensor: Sensor) -> bool:
    event = row.deviations.get(sensor)
    return event is not None and bool(event.figures.get("exceeded")) and sensor not in row.calibrated


def _fault(event: RedundancyEvent) -> Message:
    """Describes a fault: what was found, and the remedy."""
    details = event_details(event)
    found = f"{event_title(event)}{f': {details}' if details else ''}"
    todo = remedy(event)
    return Message(f"{found}. {todo}" if todo else f"{found}.")


def _series(
    board: SetBoard, rows: Sequence[UnitOnBoard], sensor: Sensor, start: float
) -> Iterator[DeviationSeries]:
    for row in rows:
        points = board.history.get((row.name, sensor), ())
        if points:
            times, ratios = zip(*points, strict=True)
            note = message("before its calibration") if sensor in row.calibrated else NOTHING
            yield DeviationSeries(row.name, tuple(time - start for time in times), ratios, note)


def _marks(board: SetBoard, start: float) -> Iterator[tuple[float, str]]:
    for event in board.newest:
        if event.event in FAULTS or event.event == "selected":
            yield event.time - start, f"{event.unit}: {mark_text(event)}"


def _line(event: RedundancyEvent, start: float) -> EventLine:
    details = event_details(event)
    text = Message(f"{event_title(event)}{f': {details}' if details else ''}")
    return EventLine(event.time - start, event.unit, text, is_fault=event.event in FAULTS)
