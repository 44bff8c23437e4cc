"""From calibration files to those of other programs, and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from pydantic import ValidationError

from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError, LogError, ProcedureError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import is_special, path_of
from tumble.foundation.provenance import date_now, sha256_of
from tumble.foundation.words import join, short
from tumble.logs.formats import firmware_parameters
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX
from tumble.tools.exchange.registry import TARGETS, target
from tumble.tools.exchange.target import READINGS, Content, Exported, Target

IMPORT = "import"
"""Procedure that an imported calibration was found by."""
LARGEST_FILE = 4 << 20
"""Bytes; all parameters of an autopilot take a hundredth of it."""


def export(
    calibrations: Calibration | Sequence[Calibration], to: str, settings: Mapping[str, str] | None = None
) -> Exported:
    """Creates the file of another program.

    `to` is one of `TARGETS`; `settings` are the further ones it needs. Parts that it cannot hold
    are in `losses`, with the error that remains.

    Raises `ProcedureError`, in one line, where there is no such format, it needs a setting, or a value is
    beyond what it takes.
    """
    given = calibrations if isinstance(calibrations, Sequence) else [calibrations]
    for each in given:
        if not isinstance(each, Calibration):
            raise ProcedureError(f"{short(each)}: is no Calibration; read its file with Calibration.load")
    units = list(given)
    return target(to).export(units, settings or {})


def import_calibrations(path: Path | str, source: str | None = None) -> list[Calibration]:
    """Reads the calibrations that a file of another program, or a log of firmware, holds, one for each IMU.

    `source` is one of `TARGETS`, found by what the file begins with if not given.

    Raises `CalibrationFileError` or `ProcedureError`, in one line with the file, where none can be read.
    """
    path = path_of(path, "a calibration")
    if is_special(path):
        raise LogError(f"{path}: is a device or a pipe, not a calibration; give a file")
    logged = firmware_parameters(path)
    format_, read = (
        _reading_of_text(path, source) if logged is None else _reading_of_log(path, source, *logged)
    )
    try:
        # Products beyond all bounds are infinite, and refused as such.
        with np.errstate(over="ignore", invalid="ignore"):
            contents = read()
    except CalibrationFileError as error:
        raise CalibrationFileError(error.why, str(path)) from error
    if not contents:
        raise CalibrationFileError(f"{path}: holds no calibration of {format_.title}")
    return [_calibration(content, path, format_) for content in contents]


_Reading: TypeAlias = tuple[Target, Callable[[], list[Content]]]
"""A format, and what reads it."""


def _reading_of_text(path: Path, source: str | None) -> _Reading:
    content = read_whole(path, LARGEST_FILE, "calibration", error=LogError)
    format_ = _format_of(path, source)
    assert format_.read is not None, "formats that cannot be read were left out"
    try:
        return format_, partial(format_.read, content.decode(format_.encoding))
    except UnicodeDecodeError:
        raise CalibrationFileError(f"{path}: is no text") from None


def _reading_of_log(
    path: Path, source: str | None, firmware: str, parameters: Mapping[str, float]
) -> _Reading:
    if source not in (None, firmware):
        raise ProcedureError(f"{path}: is a log of {firmware}; leave out --format {source}")
    format_ = target(firmware)
    assert format_.read_parameters is not None, "firmware that logs its parameters"
    return format_, partial(format_.read_parameters, parameters)


def _format_of(path: Path, source: str | None) -> Target:
    readable = {word: each for word, each in TARGETS.items() if each.read is not None}
    if source is not None:
        found = target(source)
        if found.read is None:
            raise ProcedureError(f"--format {source}: cannot be read back; give {join(list(readable))}")
        return found
    fitting = [each for each in readable.values() if each.kind.begins(path)]
    fitting = [each for each in fitting if each.ending == path.suffix] or fitting
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        raise ProcedureError(f"{path}: give --format {' or '.join(each.word for each in fitting)}")
    raise ProcedureError(f"{path}: is of no format that is known; give --format {join(list(readable))}")


def _calibration(content: dict[str, object], path: Path, format_: Target) -> Calibration:
    log = {"file": path.name, "sha256": sha256_of(path)}
    options: dict[str, object] = {"from": format_.word}
    if READINGS in content:
        options[READINGS] = content.pop(READINGS)
    method = {"procedure": IMPORT, "options": options}
    for triad, parts in format_.holds.items():
        if isinstance(section := content.get(triad), dict):
            groups = (("bias", BIAS), ("matrix", MATRIX))
            section["estimated"] = tuple(name for name, of in groups if not set(of).isdisjoint(parts))
    try:
        known = {"date": date_now(), "axes": format_.body or None, "log": log, "method": method}
        return Calibration.model_validate({**content, **known})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise CalibrationFileError(f"{path}: {place}: {short(first['msg'])}") from None
