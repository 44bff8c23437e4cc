"""What `tumble redundancy` writes: events, a calibration file for each secondary, and the report."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.calibration.document import Calibration
from tumble.file_names import EVENTS, REDUNDANCY_PAGE, unit_stem
from tumble.files import FileKind, replacing
from tumble.plain import finite

if TYPE_CHECKING:
    from tumble.redundancy.result import RedundancyResult

EVENTS_KIND = FileKind("events of tumble redundancy", re.compile(rb'\A\{"time": '))


def write_results(
    result: RedundancyResult, primary: Calibration | None, folder: Path
) -> tuple[dict[str, str], list[str]]:
    """Write everything but the store into `folder`; give each path by what it is, and what to beware of."""
    from tumble.redundancy.report.page import REDUNDANCY_REPORT

    events = folder / EVENTS
    write_events(result, events)
    files = {"events": str(events)}
    warnings = []
    calibrated = {error.unit for error in result.errors}
    for unit in result.secondaries:
        path = folder / f"{unit_stem(unit, 'redundancy')}.yaml"
        if unit in calibrated:
            Calibration.from_redundancy(result, unit, primary).save(path)
            files[unit] = str(path)
        elif path.exists():
            warnings.append(f"{path} is of an earlier run, this one has no calibration for it")
    page = folder / REDUNDANCY_PAGE
    REDUNDANCY_REPORT.write(result, page)
    return files | {"report": str(page)}, warnings


def write_events(result: RedundancyResult, path: Path) -> None:
    """Write one JSON object a line: time, unit, event, figures; `null` for what is not finite."""
    with replacing(path, EVENTS_KIND) as file:
        for line in event_lines(result):
            file.write(f"{line}\n".encode())


def event_lines(result: RedundancyResult) -> Iterator[str]:
    """Give each event as JSON."""
    for event in result.events:
        content = {
            "time": event.time,
            "unit": event.unit,
            "event": event.event,
            "figures": finite(dict(event.figures)),
        }
        yield json.dumps(content, allow_nan=False)


def warn(warnings: list[str]) -> None:
    """Print warnings to standard error."""
    for warning in warnings:
        print(f"tumble: warning: {warning}", file=sys.stderr)
