"""Records as devices keep them in flash (docs/record-format.md), written and read by the core's own code.

A record is about one sensor of a unit: its error, `y = M u + b`, or what temperature does to it; for a
magnetometer, its error with the effect of current. That of a unit against the truth is stored as that of a
primary is, whose case frame its M leads from.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tumble.calibration.document import Calibration, MagnetometerCalibration, TriadCalibration
from tumble.foundation.errors import CalibrationFileError, ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.units import CALIBRATED_UNITS, TRIADS
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX, Part
from tumble.tools.exchange.target import (
    AS_CALIBRATED,
    Content,
    Read,
    Setting,
    Settings,
    Target,
    Write,
    Written,
)

BYTES = "latin-1"
"""Encoding by which text is bytes."""
_HELD: tuple[Part, ...] = (*BIAS, *MATRIX, "bias over temperature", "scale over temperature")
_DRIFT = "temperature_drift"
"""Key of a temperature drift in a section and in a record."""
_LARGEST_IDENTITY = 2**64 - 1
_A_LINE = 12
"""Bytes of a line of C."""


def write_bytes(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes records one after the other."""
    return Written("".join(record.decode(BYTES) for _, record in _records(calibrations, settings)))


def write_hexadecimal(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes a record a line."""
    return Written("".join(f"{record.hex()}\n" for _, record in _records(calibrations, settings)))


def write_c(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes an array of C for each record."""
    name = settings.c_name("name")
    lines = ["/* Records of a calibration by Tumble, for tumble_record_decode(). */", "#include <stdint.h>"]
    for sensor, record in _records(calibrations, settings):
        rows = (record[k : k + _A_LINE] for k in range(0, len(record), _A_LINE))
        body = [f"    {', '.join(f'0x{byte:02X}' for byte in row)}," for row in rows]
        lines += ["", f"static const uint8_t {name}_{sensor}[{len(record)}] = {{", *body, "};"]
    return Written("\n".join(lines) + "\n")


def _records(calibrations: Sequence[Calibration], settings: Settings) -> Iterator[tuple[str, bytes]]:
    """Returns the records of a calibration, each with the name of what it is about."""
    from tumble import _core

    (calibration,) = calibrations
    identity = settings.whole_number("identity")
    if not 0 <= identity <= _LARGEST_IDENTITY:
        raise settings.refusal("identity", "give a whole number of 64 bits")
    temperature = None if calibration.temperature is None else calibration.temperature.mean
    for triad in TRIADS:
        section = getattr(calibration, triad)
        if section is None:
            continue
        subject = {"identity": identity, "sensor": triad}
        drift = section.temperature_drift
        held_at = temperature if drift is None else drift.reference
        try:
            yield triad, _core.encode_record(subject | _error(section), held_at)
            if drift is not None:
                yield f"{triad}_drift", _core.encode_record(subject | {_DRIFT: drift.content()})
        except _core.CoreError as error:
            raise ProcedureError(f"{calibration.name}: {triad}: {error}") from None
    if calibration.magnetometer is None:
        return
    record = {"identity": identity, "sensor": "magnetometer", **_magnetometer(calibration.magnetometer)}
    try:
        yield "magnetometer", _core.encode_record(record)
    except _core.CoreError as error:
        raise ProcedureError(f"{calibration.name}: magnetometer: {error}") from None


def _model(section: TriadCalibration) -> dict[str, Any]:
    """Returns M and b of a section, with their sigmas, as a record has them."""
    stated = section.total_covariance
    sigma = np.full(12, np.inf) if stated is None else np.sqrt(np.diag(stated))
    sigma[np.isnan(sigma)] = np.inf
    return {
        "matrix": np.ascontiguousarray(section.M),
        "bias": section.b,
        "matrix_sigma": sigma[:9].reshape(3, 3),
        "bias_sigma": sigma[9:],
    }


def _magnetometer(section: MagnetometerCalibration) -> dict[str, Any]:
    """Returns a magnetometer as a record has it."""
    current = np.zeros(3) if section.current is None else section.current
    numbers = _model(section) | {"current": current}
    return {name: values.tolist() for name, values in numbers.items()} | {
        "current_unit": section.current_unit
    }


def _error(section: TriadCalibration) -> dict[str, Any]:
    """Returns the error of a section, which was fitted to no pairs with a primary, as a record has it."""
    has_matrix = not np.array_equal(section.M, np.eye(3))
    return _model(section) | {
        "fit_model": "affine" if has_matrix else "offset",
        "directions": 3 if has_matrix else 0,
        "pairs": 0,
        "sequence": 1,
    }


def read_bytes(text: str) -> list[Content]:
    """Reads records that stand one after the other."""
    return _units(_split(text.encode(BYTES)))


def read_hexadecimal(text: str) -> list[Content]:
    """Reads records in hexadecimal digits."""
    try:
        return _units(_split(bytes.fromhex(text)))
    except ValueError:
        raise CalibrationFileError("holds what is no hexadecimal digit") from None


def read_c(text: str) -> list[Content]:
    """Reads records in arrays of C."""
    ended = text.split("}")[:-1]
    arrays = [each.partition("{")[2] for each in ended if "{" in each]
    try:
        return _units([bytes(int(word, 0) for word in array.replace(",", " ").split()) for array in arrays])
    except ValueError:
        raise CalibrationFileError("holds an array of what is no byte") from None


def _split(content: bytes) -> Iterator[bytes]:
    """Splits records by the lengths that they state; without a length, the whole is one record."""
    from tumble import _core

    while content:
        length = _core.record_length(content) or len(content)
        yield content[:length]
        content = content[length:]


def _units(records: Sequence[bytes] | Iterator[bytes]) -> list[Content]:
    """Puts the records of each unit together."""
    from tumble import _core

    units: dict[int, dict[str, Any]] = {}
    try:
        for record in records:
            found = _core.decode_record(record)
            identity, triad = found["identity"], found["sensor"]
            unit = units.setdefault(identity, {"name": f"unit-{identity}", "serial": str(identity)})
            section = unit.setdefault(
                triad, {"unit": CALIBRATED_UNITS[triad], "M": np.eye(3), "b": np.zeros(3)}
            )
            section |= {_DRIFT: found[_DRIFT]} if _DRIFT in found else _section(found)
            if (held_at := found.get("temperature")) is not None:
                unit["temperature"] = dict.fromkeys(("low", "mean", "high"), held_at)
    except _core.CoreError as error:
        raise CalibrationFileError(f"a record {error}") from None
    return list(units.values())


def _section(error: dict[str, Any]) -> dict[str, Any]:
    """Returns the section of a calibration file for the error in a record."""
    sigma = np.concatenate([np.ravel(error["matrix_sigma"]), error["bias_sigma"]])
    section: dict[str, Any] = {"M": error["matrix"], "b": error["bias"]}
    if any(error.get("current", ())):
        section |= {"current": error["current"], "current_unit": error["current_unit"]}
    if np.isfinite(sigma).any():
        # A record keeps no covariance between its numbers.
        section["covariance"] = np.diag(np.where(np.isfinite(sigma), sigma, np.nan) ** 2)
    return section


def _form(
    word: str, form: str, ending: str, begins: bytes, write: Write, read: Read, *further: Setting
) -> Target:
    """Creates the target of one form in which records are written."""
    identity = Setting("identity", "of the unit, a whole number that tells it from all others")
    return Target(
        word=word,
        title=f"the records that a device keeps, {form}",
        ending=ending,
        kind=FileKind("records of a device", re.compile(begins)),
        write=write,
        read=read,
        own_settings=(identity, *further),
        holds={**dict.fromkeys(TRIADS, _HELD), "magnetometer": (*BIAS, *MATRIX)},
        source="docs/record-format.md",
        axes=AS_CALIBRATED,
        is_own=True,
        encoding=BYTES,
    )


RECORD = _form("record", "bytes", ".bin", rb"\ATR[\x01-\x04]", write_bytes, read_bytes)
RECORD_HEXADECIMAL = _form(
    "record-hex", "hexadecimal", ".hex", rb"\A54520[1-4]", write_hexadecimal, read_hexadecimal
)
RECORD_C = _form(
    "record-c",
    "arrays of C",
    ".h",
    rb"\A/\* Records of ",
    write_c,
    read_c,
    Setting("name", "that those of the arrays begin with", "calibration"),
)
