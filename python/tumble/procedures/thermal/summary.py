"""Drift over temperature as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.procedures.thermal.report.text import COLUMNS, axis_rows, sentences
from tumble.procedures.thermal.result import ThermalResult
from tumble.report.numbers import NOT_OBSERVABLE

SCHEMA: Final = "tumble-thermal-result/1"


def screen_summary(result: ThermalResult) -> RenderableType:
    """Describes the result at a glance: drift of each axis, and warnings."""
    head = [Text(line) for line in sentences(result)]
    notes = [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(*head, "", _table(result), "", *notes)


def _table(result: ThermalResult) -> Table:
    table = Table(
        box=SIMPLE_HEAD, padding=(0, 1), show_edge=False, caption="± 1 sigma", caption_justify="left"
    )
    for title in ("", *COLUMNS):
        table.add_column(title, no_wrap=True)
    for name, cells in axis_rows(result):
        table.add_row(name, *(Text(cell, "dim" if cell == NOT_OBSERVABLE else "") for cell in cells))
    return table


def json_content(result: ThermalResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give everything that was found, and the files it was written to."""
    content = {
        "name": result.name,
        "sources": result.sources,
        "serial": result.serial,
        "software": result.software,
        "verdict": result.verdict,
        "reference": result.reference,
        "range": result.range,
        "thermometer_step": result.step,
        "lag": result.lag,
        "start": result.start_hash,
        "options": result.options,
        "blocks": result.blocks,
        "axes": result.axes,
        "parameters": list(result.rows()),
        "warnings": result.warnings,
        "calibration": result.calibration.content(),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}
