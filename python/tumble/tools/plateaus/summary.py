"""A calibration over temperature as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.tools.plateaus.report.text import COLUMNS, axis_rows, sentences
from tumble.tools.plateaus.result import PlateausResult, TriadOverTemperature

SCHEMA: Final = "tumble-plateaus-result/1"


def screen_summary(result: PlateausResult) -> RenderableType:
    """Describes the result at a glance: change of each axis, what is constant, and warnings."""
    head = [Text(line) for line in sentences(result)]
    notes = [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(*head, "", _table(result), "", *notes)


def _table(result: PlateausResult) -> Table:
    table = Table(
        box=SIMPLE_HEAD, padding=(0, 1), show_edge=False, caption="± 1 sigma", caption_justify="left"
    )
    for title in ("", *COLUMNS):
        table.add_column(title, no_wrap=True)
    for name, cells in axis_rows(result):
        table.add_row(name, *cells)
    return table


def json_content(result: PlateausResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give everything that was found, and the files it was written to."""
    content = {
        "name": result.name,
        "serial": result.serial,
        "software": result.software,
        "verdict": result.verdict,
        "reference": result.reference,
        "range": result.range,
        "plateaus": result.plateaus,
        "options": result.options,
        "triads": [_triad(each) for each in result.triads],
        "parameters": list(result.rows()),
        "warnings": result.warnings,
        "calibration": result.calibration.content(),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _triad(triad: TriadOverTemperature) -> dict[str, Any]:
    return {
        "triad": triad.triad,
        "chi_square": triad.chi_square,
        "degrees_of_freedom": triad.degrees_of_freedom,
        "widening": dict(triad.widening),
        "orders": {name: list(scores) for name, scores in triad.orders.items()},
        "constancies": triad.constancies,
        "predictions": triad.predictions,
    }
