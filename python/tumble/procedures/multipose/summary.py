"""A multi-pose calibration as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.gravity import gravity_content
from tumble.foundation.plain import finite
from tumble.procedures.multipose.report.ferraris import compared
from tumble.procedures.multipose.report.text import next_sentences, sentences
from tumble.procedures.multipose.result import MultiposeResult
from tumble.report.columns import parameter_cell, parameter_scales
from tumble.report.numbers import NOT_OBSERVABLE

SCHEMA: Final = "tumble-multipose-result/1"


def screen_summary(result: MultiposeResult) -> RenderableType:
    """Describes the result at a glance: estimates, their quality, and the most useful additions."""
    head = [Text(line) for line in sentences(result)]
    notes = [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    advice = next_sentences(result)
    beside: list[RenderableType] = [_beside_ferraris(result), ""] if result.faces is not None else []
    return Group(*head, "", _table(result), "", *beside, *map(Text, advice), *notes)


def _table(result: MultiposeResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    triads = (*result.triads, *(() if result.magnetometer is None else result.magnetometer.triads))
    for title in ("", *(triad.triad for triad in triads)):
        table.add_column(title, no_wrap=True)
    scales = parameter_scales(parameter for triad in triads for parameter in triad.parameters)
    for each in zip(*(triad.parameters for triad in triads), strict=True):
        cells = (parameter_cell(parameter, scales) for parameter in each)
        table.add_row(each[0].name, *(Text(cell, "dim" if cell == NOT_OBSERVABLE else "") for cell in cells))
    return table


def _beside_ferraris(result: MultiposeResult) -> Table:
    table = Table(
        box=SIMPLE_HEAD,
        padding=(0, 1),
        show_edge=False,
        caption="by the formulas of Ferraris, and how many sigmas that is from the above",
        caption_justify="left",
    )
    for title in ("", "", "Ferraris", "sigmas"):
        table.add_column(title, no_wrap=True, justify="right" if title == "sigmas" else "left")
    for row in compared(result):
        table.add_row(row.triad, row.name, f"{row.ferraris} {row.unit}".strip(), row.difference)
    return table


def json_content(result: MultiposeResult, files: Mapping[str, Path]) -> dict[str, Any]:
    """Give the result without its recording: what was found, and the files it was written to."""
    content = {
        "name": result.name,
        "source": result.source,
        "software": result.software,
        "verdict": result.verdict,
        "gravity": gravity_content(result),
        "options": result.options,
        "norm": {
            "before": result.norm_before,
            "after": result.norm_after,
            "held_out": result.norm_held_out,
        },
        "angle": {"before": result.angle_before, "after": result.angle_after},
        "directions": result.directions,
        "tolerance": result.tolerance,
        "nominal_scale": asdict(result.nominal_scale) if result.nominal_scale else None,
        "parameters": list(_parameters(result)),
        "gyroscope_reason": result.gyroscope_reason,
        "magnetometer": _magnetometer(result),
        "magnetometer_reason": result.magnetometer_reason,
        "poses": [asdict(pose) for pose in result.poses],
        "turns": [asdict(turn) for turn in result.turns],
        "next_orientation": asdict(result.next_orientation) if result.next_orientation else None,
        "next_turn": asdict(result.next_turn) if result.next_turn else None,
        "faces": asdict(result.faces) if result.faces else None,
        "rests": [
            {"start": rest.start, "end": rest.end, "used": rest.used, "remark": rest.remark}
            for rest in result.rests
        ],
        "start": result.start_hash,
        "warnings": result.warnings,
        "calibration": result.calibration.content(),
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _magnetometer(result: MultiposeResult) -> dict[str, Any] | None:
    found = result.magnetometer
    if found is None:
        return None
    content = {
        "strength_source": found.strength_source,
        "expected_dip": found.expected_dip,
        "directions": found.directions,
        "coverage": found.coverage,
        "norm": {"before": found.norm_before, "after": found.norm_after, "held_out": found.norm_held_out},
        "points": [asdict(point) for point in found.points],
        "next_field": asdict(found.next_field) if found.next_field else None,
    }
    return {key: finite(value) for key, value in content.items()}


def _parameters(result: MultiposeResult) -> Iterator[dict[str, object]]:
    for row in result.rows():
        yield {key: finite(value) for key, value in row.items()}
