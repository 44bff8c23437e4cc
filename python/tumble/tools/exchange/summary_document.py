"""JSON that `tumble export`, `import` and `formats` print."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field

from tumble.foundation.printed import Printed
from tumble.tools.exchange.command_export import EXPORT, TARGET_LIST
from tumble.tools.exchange.command_export_all import EXPORT_ALL
from tumble.tools.exchange.command_formats import FORMATS
from tumble.tools.exchange.command_import import IMPORT


class Lost(Printed):
    """A part that a format cannot hold, with the error that stays."""

    unit: str
    triad: str
    part: str
    size: Any
    at: str


class ExportedFile(Printed):
    """A calibration in the file of another program."""

    file: Path
    losses: list[Lost]
    remarks: list[str]
    warnings: list[str]


class ExportDocument(ExportedFile):
    """A calibration in the file of another program, and the verdict."""

    schema_: Literal["tumble-export/1"] = Field(EXPORT, alias="schema")
    verdict: Literal["whole", "with losses"]


class ExportAllDocument(Printed):
    """A calibration in the files of all programs at once."""

    schema_: Literal["tumble-export-all/1"] = Field(EXPORT_ALL, alias="schema")
    verdict: Literal["all written", "some refused"]
    folder: Path
    written: dict[str, ExportedFile]
    """By word of the format."""
    refused: dict[str, str]
    """Reason of each format that is not written."""


class PrintedFormat(Printed):
    """A format of another program."""

    title: str
    ending: str
    holds: dict[str, list[str]]
    needs: dict[str, str]
    """Settings that it needs (`--set`), with their meanings."""
    imported: bool
    """True if it is read back."""
    axes: str
    source: str
    """Source of names, units and formulas."""


class TargetsDocument(Printed):
    """Formats that calibrations are written in."""

    schema_: Literal["tumble-export-formats/1"] = Field(TARGET_LIST, alias="schema")
    verdict: Literal["listed"]
    formats: dict[str, PrintedFormat]


class Imported(Printed):
    """A calibration that another program made."""

    file: Path
    calibration: dict[str, Any]
    """Content of the calibration file."""


class ImportDocument(Printed):
    """Calibrations that another program made."""

    schema_: Literal["tumble-import/1"] = Field(IMPORT, alias="schema")
    verdict: Literal["imported"]
    calibrations: list[Imported]


class ReadFormat(Printed):
    """A format of logs that is read."""

    format: str
    what: str
    endings: list[str]
    extra: str
    """Extra of the package that it needs; empty if it needs none."""
    installed: bool
    example: str


class WrittenFormat(Printed):
    """A format of logs that is written."""

    format: str
    what: str
    example: str


class CalibrationFormat(WrittenFormat):
    """A format of calibrations."""

    read: bool


class FormatsDocument(Printed):
    """Every format that is read or written."""

    model_config = ConfigDict(validate_by_name=True)

    schema_: Literal["tumble-formats/1"] = Field(FORMATS, alias="schema")
    verdict: Literal["listed"]
    logs_read: list[ReadFormat] = Field(alias="logs read")
    logs_written: list[WrittenFormat] = Field(alias="logs written")
    calibrations: list[CalibrationFormat]
    packed: list[str]
    """Endings of packed text that is read."""
