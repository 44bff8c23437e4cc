"""A calibrated magnetometer as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.procedures.magnetometer.report.text import next_sentences, sentences
from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.report.columns import parameter_cell, parameter_scales
from tumble.report.numbers import NOT_OBSERVABLE

SCHEMA: Final = "tumble-magnetometer-result/1"


def screen_summary(result: MagnetometerResult) -> RenderableType:
    """Describes the result at a glance: estimates, their quality, and the most useful addition."""
    head = [Text(line) for line in sentences(result)]
    notes = [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(*head, "", _table(result), "", *map(Text, next_sentences(result)), *notes)


def _table(result: MagnetometerResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    for title in ("", "magnetometer"):
        table.add_column(title, no_wrap=True)
    scales = parameter_scales(result.parameters)
    for parameter in result.parameters:
        cell = parameter_cell(parameter, scales)
        table.add_row(parameter.name, Text(cell, "dim" if cell == NOT_OBSERVABLE else ""))
    return table


def json_content(result: MagnetometerResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give the result: what was found, and the files it was written to."""
    content = {
        "name": result.name,
        "source": result.source,
        "serial": result.serial,
        "software": result.software,
        "verdict": result.verdict,
        "options": result.options,
        "strength": asdict(result.strength),
        "strength_source": result.strength_source,
        "dip": asdict(result.dip),
        "expected_dip": result.expected_dip,
        "norm": {
            "before": result.norm_before,
            "after": result.norm_after,
            "held_out": result.norm_held_out,
        },
        "directions": result.directions,
        "coverage": result.coverage,
        "scatter": result.scatter,
        "correlated": result.correlated,
        "parameters": [{key: finite(value) for key, value in row.items()} for row in result.rows()],
        "points": [asdict(point) for point in result.points],
        "next_field": asdict(result.next_field) if result.next_field else None,
        "start": result.start_hash,
        "warnings": result.warnings,
        "calibration": result.calibration.content(),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}
