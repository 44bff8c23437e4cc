"""An alignment as a table on screen, and as JSON for machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.plain import finite
from tumble.procedures.align.report.page import unobserved_sentences
from tumble.procedures.align.result import AlignResult, UnitAlignment
from tumble.report.columns import parameter_cell, parameter_scales
from tumble.report.numbers import NOT_OBSERVABLE, scales_of

SCHEMA: Final = "tumble-align-result/1"


def screen_summary(result: AlignResult) -> RenderableType:
    """Describes the result at a glance: estimates for each unit, and warnings."""
    notes = [Text(f"Not observable: {line}", "yellow") for line in unobserved_sentences(result)]
    notes += [Text(f"Warning: {unit.name}: {line}", "yellow") for unit in result for line in unit.warnings]
    notes += [Text(f"Warning: {line}", "yellow") for line in result.warnings]
    return Group(Text(f"Relative to {result.primary}:"), "", _table(result), "", *notes)


def json_content(result: AlignResult, files: Mapping[str, Path]) -> dict[str, Any]:
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
    residuals = {
        "gyroscope residual": ("rad/s", [unit.gyroscope_residual for unit in result]),
        "accelerometer residual": ("m/s^2", [unit.accelerometer_residual for unit in result]),
    }
    scales = parameter_scales(parameter for unit in result for parameter in unit.parameters)
    scales = scales_of((unit, value) for unit, values in residuals.values() for value in values) | scales
    for k, parameter in enumerate(result.units[0].parameters):
        cells = [parameter_cell(unit.parameters[k], scales) for unit in result]
        table.add_row(
            parameter.name, *(Text(cell, "dim" if cell == NOT_OBSERVABLE else "") for cell in cells)
        )
    for name, (unit_of_residual, values) in residuals.items():
        table.add_row(name, *(scales[unit_of_residual].figure(value) for value in values))
    return table


def _unit_content(unit: UnitAlignment) -> dict[str, Any]:
    content = {each.name: getattr(unit, each.name) for each in fields(unit)}
    content["parameters"] = [
        {each.name: getattr(parameter, each.name) for each in fields(parameter)}
        for parameter in unit.parameters
    ]
    return content
