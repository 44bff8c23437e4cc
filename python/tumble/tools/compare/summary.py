"""Calibrations held against each other: tables on screen, and JSON for machines."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.tools.compare.report.text import (
    PARAMETER_COLUMNS,
    drift_sentence,
    hidden,
    parameter_rows,
    sentences,
    verdict_sentence,
)
from tumble.tools.compare.result import CompareResult, Pair

SCHEMA: Final = "tumble-compare-result/1"


def screen_summary(result: CompareResult) -> RenderableType:
    """Describes the result at a glance: whether they are the same, and each parameter."""
    parts = [part for pair in result.pairs for part in _pair(pair)]
    drift = [Text(drift_sentence(result))] if result.history else []
    return Group(*parts, *drift, *(Text(f"Note: {line}") for line in result.notes))


def _pair(pair: Pair) -> list[RenderableType]:
    return [
        Text(verdict_sentence(pair), "bold"),
        *map(Text, sentences(pair)),
        "",
        _table(pair),
        "",
        *(Text(f"Not compared: {line}", "dim") for line in hidden(pair)),
        *(Text(f"Note: {line}", "yellow") for line in pair.notes),
    ]


def _table(pair: Pair) -> Table:
    table = Table(
        box=SIMPLE_HEAD, padding=(0, 1), show_edge=False, caption="± 1 sigma", caption_justify="left"
    )
    for title in ("", pair.first, pair.second, *PARAMETER_COLUMNS[2:]):
        table.add_column(title, no_wrap=True)
    # Where nothing could be tested the numbers stand for themselves.
    shown = {row.name for row in pair.differences if row.compared}
    for name, cells in parameter_rows(pair):
        if name in shown or not shown:
            table.add_row(name, *cells)
    return table


def json_content(result: CompareResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give everything that was found, and the files it was written to."""
    content = {
        "verdict": result.verdict,
        "calibrations": [
            {"name": name, "file": file, "serial": serial, "date": date}
            for name, file, serial, date in zip(
                result.names, result.files, result.serials, result.dates, strict=True
            )
        ],
        "pairs": [
            {
                "first": pair.first,
                "second": pair.second,
                "verdict": pair.verdict,
                "probability": pair.probability,
                "joint": pair.joint,
                "temperature": pair.temperature,
                "groups": pair.groups,
                "motion": pair.motion,
                "parameters": [each.row() for each in pair.differences],
                "notes": pair.notes,
            }
            for pair in result.pairs
        ],
        "history": [
            {**each.row(), "years": each.years, "values": each.values, "sigmas": each.sigmas}
            for each in result.history
        ],
        "notes": result.notes,
        "warnings": result.warnings,
        "options": result.options,
        "software": result.software,
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}
