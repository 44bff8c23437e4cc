"""The library for firmware: a calibration as a constant for `tumble.h` (docs/how-to/c.md)."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation.files import FileKind
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX, Part
from tumble.tools.exchange.parameters import all_powers, c_float
from tumble.tools.exchange.remark_lines import c_comment
from tumble.tools.exchange.target import AS_CALIBRATED, Setting, Settings, Target, Written

_HELD: tuple[Part, ...] = (*BIAS, *MATRIX, "bias over temperature", "scale over temperature")


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes `tumble_calibration`, and a `tumble_temperature_drift` for each triad that has one."""
    (calibration,) = calibrations
    name = settings.c_name("name")
    lines = [
        f"/* Calibration of {c_comment(calibration.name)} by Tumble; hash {calibration.hash()}. */",
        '#include "tumble.h"',
        "",
        f"static const tumble_calibration {name} = {{",
        *(line for triad in TRIADS for line in _error_model(triad, getattr(calibration, triad))),
        "};",
    ]
    drifts = {
        triad: section.temperature_drift
        for triad in TRIADS
        if (section := getattr(calibration, triad)) is not None and section.temperature_drift is not None
    }
    for triad, drift in drifts.items():
        lines += ["", *_drift(f"{name}_{triad}_drift", drift)]
    remarks = ("take readings to the reference with tumble_temperature_drift_remove() first",)
    return Written("\n".join(lines) + "\n", remarks=remarks if drifts else ())


def _error_model(triad: str, section: TriadCalibration | None) -> list[str]:
    matrix, bias = (np.eye(3), np.zeros(3)) if section is None else (section.M, section.b)
    return [
        f"    .{triad} = {{",
        f"        .matrix = {_rows(matrix)},",
        f"        .bias = {_row(bias)},",
        "    },",
    ]


def _drift(name: str, drift: TemperatureDrift) -> list[str]:
    return [
        f"static const tumble_temperature_drift {name} = {{",
        f"    .reference = {c_float(drift.reference)},",
        f"    .range = {_row(drift.range)},",
        f"    .bias = {_rows(all_powers(drift.bias))},",
        f"    .scale = {_rows(all_powers(drift.scale))},",
        "};",
    ]


def _row(values: FloatArray) -> str:
    return f"{{{', '.join(map(c_float, values))}}}"


def _rows(matrix: FloatArray) -> str:
    return f"{{{', '.join(map(_row, matrix))}}}"


C_SOURCE = Target(
    word="c",
    title="the library for firmware, a constant for tumble.h",
    ending=".h",
    kind=FileKind("a calibration for tumble.h", re.compile(rb"\A/\* Calibration of ")),
    holds=dict.fromkeys(TRIADS, _HELD),
    write=write,
    source="docs/how-to/c.md",
    axes=AS_CALIBRATED,
    own_settings=(Setting("name", "of the constant", "calibration"),),
)
