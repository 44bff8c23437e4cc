"""imucal: its JSON, version 2.0.0, of a Ferraris calibration.

imucal corrects `a = R_a^-1 K_a^-1 (y - b_a)` and `w = R_g^-1 K_g^-1 (y - K_ga a - b_g)` in m/s^2 and deg/s
(imucal.readthedocs.io, FerrarisCalibrationInfo). R has rows of unit length and need be no rotation, so K R
is any M.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from tumble.calibration.document import Calibration
from tumble.errors import CalibrationFileError
from tumble.exchange.parts import BIAS, MATRIX
from tumble.exchange.target import Content, Settings, Target, Written
from tumble.files import FileKind
from tumble.plain import plain
from tumble.recording import FloatArray

VERSION = "2.0.0"
TYPE = "ferraris"
_UNITS = {"acc_unit": "m/s^2", "gyr_unit": "deg/s", "from_acc_unit": "m/s^2", "from_gyr_unit": "deg/s"}
_MATRICES = ("K_a", "R_a", "K_g", "R_g", "K_ga")
_VECTORS = ("b_a", "b_g")


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Write the calibration of one IMU."""
    (calibration,) = calibrations
    accelerometer, gyroscope = calibration.accelerometer, calibration.gyroscope
    identity, zero = np.eye(3), np.zeros(3)
    response = None if gyroscope is None else gyroscope.g_sensitivity
    scale_a, rows_a = _scale_and_rows(identity if accelerometer is None else accelerometer.M)
    scale_g, rows_g = _scale_and_rows(identity if gyroscope is None else gyroscope.M)
    content = {
        "cal_type": TYPE,
        **_UNITS,
        "comment": f"{calibration.name}, by Tumble",
        "K_a": scale_a,
        "R_a": rows_a,
        "b_a": zero if accelerometer is None else accelerometer.b,
        "K_g": scale_g,
        "R_g": rows_g,
        "K_ga": np.zeros((3, 3)) if response is None else np.degrees(response),
        "b_g": zero if gyroscope is None else np.degrees(gyroscope.b),
        "_json_version": VERSION,
    }
    return Written(json.dumps(plain(content), indent=2) + "\n")


def _scale_and_rows(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    scale = np.linalg.norm(matrix, axis=1)
    return np.diag(scale), matrix / scale[:, np.newaxis]


def read(text: str) -> list[Content]:
    """Read a Ferraris calibration in m/s^2 and deg/s."""
    try:
        stated = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise CalibrationFileError(f"is no JSON: {error}") from None
    if not isinstance(stated, dict):
        raise CalibrationFileError("is no JSON object; give what imucal's to_json_file wrote")
    for name, unit in _UNITS.items():
        if stated.get(name, unit) != unit:
            raise CalibrationFileError(f"{name} is {stated[name]!r}, not {unit!r}; calibrate in {unit}")
    numbers = {name: _numbers(stated, name, (3, 3)) for name in _MATRICES}
    numbers |= {name: _numbers(stated, name, (3,)) for name in _VECTORS}
    forward = {sensor: numbers[f"K_{sensor}"] @ numbers[f"R_{sensor}"] for sensor in "ag"}
    gyroscope: Content = {"unit": "rad/s", "M": forward["g"], "b": np.radians(numbers["b_g"])}
    if numbers["K_ga"].any():
        gyroscope["g_sensitivity"] = np.radians(numbers["K_ga"])
    return [
        {
            "name": "imucal",
            "accelerometer": {"unit": "m/s^2", "M": forward["a"], "b": numbers["b_a"]},
            "gyroscope": gyroscope,
        }
    ]


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
    kind=FileKind("a calibration of imucal", re.compile(rb"\A\s*\{\s*\"cal_type\"")),
    holds={"accelerometer": (*BIAS, *MATRIX), "gyroscope": (*BIAS, *MATRIX, "g-sensitivity")},
    write=write,
    source="https://imucal.readthedocs.io/en/latest/",
    read=read,
)
