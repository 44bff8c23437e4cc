"""An alignment as a table on screen, and as JSON for machines."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.align.report.page import unobserved_sentences
from tumble.align.result import AlignResult, UnitAlignment
from tumble.plain import finite
from tumble.report.numbers import NOT_OBSERVABLE, measurement, readable_scale, significant
from tumble.results import Parameter


def screen_summary(result: AlignResult) -> RenderableType:
    """Say what a person wants to know at once: what was found of each unit, and what to beware of."""
    notes = [Text(f"Not observable: {line}", "yellow") for line in unobserved_sentences(result)]
    notes += [Text(f"Warning: {unit.name}: {line}", "yellow") for unit in result for line in unit.warnings]
    notes += [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(Text(f"Relative to {result.primary}:"), "", _table(result), "", *notes)


def json_content(result: AlignResult, files: dict[str, Path]) -> dict[str, Any]:
    """Give everything that was found, and the files it was written to."""
    content = {
        "primary": result.primary,
        "source": result.source,
        "software": result.software,
        "options": result.options,
        "units": [_unit_content(unit) for unit in result],
        "warnings": result.warnings,
        "files": files,
    }
    return {key: finite(value) for key, value in content.items()}


def _table(result: AlignResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    table.add_column("", no_wrap=True)
    for unit in result:
        table.add_column(unit.name, no_wrap=True)
    for k, parameter in enumerate(result.units[0].parameters):
        cells = [_shown(unit.parameters[k]) for unit in result]
        table.add_row(
            parameter.name, *(Text(cell, "dim" if cell == NOT_OBSERVABLE else "") for cell in cells)
        )
    for name, unit_of, values in (
        ("gyroscope residual", "rad/s", [unit.gyroscope_residual for unit in result]),
        ("accelerometer residual", "m/s^2", [unit.accelerometer_residual for unit in result]),
    ):
        scales = [readable_scale(unit_of, value) for value in values]
        cells = [
            scale.quantity(significant(scale.factor * value))
            for scale, value in zip(scales, values, strict=True)
        ]
        table.add_row(name, *cells)
    return table


def _shown(parameter: Parameter) -> str:
    if not parameter.observable:
        return NOT_OBSERVABLE
    scale = readable_scale(parameter.unit, max(abs(parameter.value), parameter.sigma))
    return measurement(scale.factor * parameter.value, scale.factor * parameter.sigma, scale.unit)


def _unit_content(unit: UnitAlignment) -> dict[str, Any]:
    content = {each.name: getattr(unit, each.name) for each in fields(unit)}
    content["parameters"] = [
        {each.name: getattr(parameter, each.name) for each in fields(parameter)}
        for parameter in unit.parameters
    ]
    return content
