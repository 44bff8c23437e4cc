"""imucal: its JSON, version 2.0.0, of a Ferraris or turntable calibration.

imucal corrects `a = R_a^-1 K_a^-1 (y - b_a)` and `w = R_g^-1 K_g^-1 (y - K_ga a - b_g)` in m/s^2 and deg/s
(imucal/ferraris_calibration_info.py). R has rows of unit length and need be no rotation, so K R is any M.
Readings y are in the units that the file states, counts (`a.u.`) as a rule.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.bounded_json import JsonError, parse_json
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.files import FileKind
from tumble.foundation.plain import plain
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import UNITS, Triad
from tumble.foundation.words import short
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX
from tumble.tools.exchange.target import AS_CALIBRATED, READINGS, Content, Settings, Target, Written

VERSION = "2.0.0"
TYPES = ("Ferraris", "Turntable")
"""Calibrations of one formula."""
_OLDER = re.compile(r"2(\.0)*")
"""Versions that imucal takes for 2.0.0."""
_DEGREE: Final = float(np.radians(1.0))
_TO_SI: Final = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "rad/s": 1.0, "deg/s": _DEGREE}
_RESULTS: Final = {"acc_unit": ("m/s^2",), "gyr_unit": ("deg/s", "rad/s")}
"""Units of corrected readings that have a meaning here."""
WORDS: Final[Mapping[Triad, str]] = {"accelerometer": "acc", "gyroscope": "gyr"}
_MATRICES = ("K_a", "R_a", "K_g", "R_g", "K_ga")
_VECTORS = ("b_a", "b_g")


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the calibration of one IMU."""
    (calibration,) = calibrations
    accelerometer, gyroscope = calibration.accelerometer, calibration.gyroscope
    identity, zero = np.eye(3), np.zeros(3)
    response = None if gyroscope is None else gyroscope.g_sensitivity
    scale_a, rows_a = _scale_and_rows(identity if accelerometer is None else accelerometer.M)
    scale_g, rows_g = _scale_and_rows(identity if gyroscope is None else gyroscope.M)
    content = {
        "acc_unit": "m/s^2",
        "gyr_unit": "deg/s",
        "from_acc_unit": "m/s^2",
        "from_gyr_unit": "deg/s",
        "comment": f"{calibration.name}, by Tumble",
        "K_a": scale_a,
        "R_a": rows_a,
        "b_a": zero if accelerometer is None else accelerometer.b,
        "K_g": scale_g,
        "R_g": rows_g,
        "K_ga": np.zeros((3, 3)) if response is None else np.degrees(response),
        "b_g": zero if gyroscope is None else np.degrees(gyroscope.b),
        "cal_type": TYPES[0],
        "_format_version": VERSION,
    }
    return Written(json.dumps(plain(content), indent=2) + "\n")


def _scale_and_rows(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    scale = np.linalg.norm(matrix, axis=1)
    return np.diag(scale), matrix / scale[:, np.newaxis]


def read(text: str) -> list[Content]:
    """Reads a calibration, of readings in SI units, g, deg/s or counts."""
    stated = _stated(text)
    numbers = {name: _numbers(stated, name, (3, 3)) for name in _MATRICES}
    numbers |= {name: _numbers(stated, name, (3,)) for name in _VECTORS}
    content: Content = {"name": "imucal"}
    counts = {}
    for triad, word in WORDS.items():
        unit, letter = str(stated.get(f"from_{word}_unit")), word[0]
        if unit not in _TO_SI:
            counts[triad] = unit
        scale = _TO_SI.get(unit, 1.0)
        forward = numbers[f"K_{letter}"] @ numbers[f"R_{letter}"]
        section: Content = {
            "unit": UNITS[triad],
            "M": scale / _TO_SI[stated[f"{word}_unit"]] * forward,
            "b": scale * numbers[f"b_{letter}"],
        }
        if word == "gyr" and numbers["K_ga"].any():
            section["g_sensitivity"] = scale * numbers["K_ga"]
        content[triad] = section
    return [content | {READINGS: counts} if counts else content]


def _stated(text: str) -> dict[str, Any]:
    """Returns what the file states, of a type, version and units that have a meaning here."""
    try:
        stated = parse_json(text)
    except JsonError as error:
        raise CalibrationFileError(f"is no JSON: {error}") from None
    if not isinstance(stated, dict):
        raise CalibrationFileError("is no JSON object; give what imucal's to_json_file wrote")
    if stated.get("cal_type") not in TYPES:
        known = " or ".join(TYPES)
        raise CalibrationFileError(f"cal_type is {short(stated.get('cal_type'))}, not {known}")
    version = stated.get("_format_version")
    if not (isinstance(version, str) and _OLDER.fullmatch(version)):
        raise CalibrationFileError(
            f"_format_version is {short(version)}, not {VERSION}; convert it with imucal.legacy"
        )
    for name, units in _RESULTS.items():
        if stated.get(name) not in units:
            raise CalibrationFileError(f"{name} is {short(stated.get(name))}, not {' or '.join(units)}")
    return stated


def _numbers(stated: dict[str, Any], name: str, shape: tuple[int, ...]) -> FloatArray:
    try:
        numbers = np.array(stated[name], dtype=np.float64)
    except KeyError:
        raise CalibrationFileError(f"has no {name}; give what imucal's to_json_file wrote") from None
    except (TypeError, ValueError):
        raise CalibrationFileError(f"{name} holds what is no number") from None
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise CalibrationFileError(f"{name} has shape {numbers.shape}, not {shape}, or a gap")
    return numbers


IMUCAL = Target(
    word="imucal",
    title="imucal, JSON of version 2.0.0",
    ending=".json",
    kind=FileKind("a calibration of imucal", re.compile(rb'\A\s*\{[\s\S]*?"(cal_type|acc_unit|K_ga)"\s*:')),
    holds={"accelerometer": (*BIAS, *MATRIX), "gyroscope": (*BIAS, *MATRIX, "g-sensitivity")},
    write=write,
    source="https://imucal.readthedocs.io/en/latest/",
    axes=AS_CALIBRATED,
    read=read,
)
